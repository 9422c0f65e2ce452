"""Frames of an array from a table: one row for each, one column for each sensor, by name."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from memscal.errors import FormatError, InputError
from memscal.extensions.arrays.array_data import ArrayData
from memscal.formats.files import FilePath
from memscal.formats.tables.columns import Wanted
from memscal.formats.tables.sheets import open_table
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import dimension_in

#: Columns that are no readings, where no sensor has their name.
_CARRIED = ("frame", "t")

#: What locate does not have: options of import, and numbers of columns.
_UNKNOWN = "--|number of the column"


@contextmanager
def without_options(rows: str) -> Iterator[None]:
    """Say which rows a table needs where the cure would be an option of import."""
    try:
        yield
    except InputError as error:
        if not re.search(_UNKNOWN, error.cure):
            raise
        raise type(error)(
            error.problem,
            why="" if "--" in error.why else error.why,
            cure=f"Correct the table: {rows}, cells parted by commas, with a decimal point.",
        ) from error


@without_options(
    "one head with each sensor once and its unit ('T00 [mV]'), below it numbers, and empty cells "
    "where a sensor did not read or was overloaded"
)
def read_frames(array: ArrayData, path: FilePath) -> tuple[FloatArray, Values]:
    """Return readings (frames, sensors), and ``frame`` and ``time`` where they stand in a table.

    Its columns may be in any order; those of another array are refused.
    """
    table = open_table(path, gaps=True)
    carries = [name for name in _CARRIED if name in table.heads and name not in array.sensors]
    lacking = [name for name in array.sensors if name not in table.heads]
    others = [name for name in table.heads if name not in (*array.sensors, *carries)]
    if lacking or others:
        count = len({*table.heads} - {*carries})
        raise FormatError(
            f"{path} has {count} columns of readings, but the array has {len(array.sensors)} "
            f"sensors. Without a column: {', '.join(lacking) or 'none'}. Columns of no sensor: "
            f"{', '.join(others) or 'none'}.",
            why="Columns are matched by the names of the sensors.",
            cure=f"Name one column after each sensor, with its unit ('{array.sensors[0]} [mV]'), "
            "empty where it did not read; beside them only 'frame' or 't'.",
        )
    of_u = dimension_in("voltage", array.reading)
    wanted = {
        name: Wanted(name, table.unit_of(name, None, "u_A [mV]"), of_u) for name in array.sensors
    }
    if "frame" in carries:
        wanted["frame"] = Wanted("frame")
    if "t" in carries:
        wanted["time"] = Wanted("t", table.unit_of("t", None, "t", "s"), "time")
    carried: Values = {**table.columns(wanted)}
    u = np.column_stack([carried.pop(name) for name in array.sensors])
    return u, carried
