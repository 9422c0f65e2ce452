"""Frames of an array from a table: one row for each, one column for each sensor, by name."""

from typing import NamedTuple

import numpy as np

from memscal.errors import FormatError
from memscal.extensions.arrays.array_data import ArrayData
from memscal.formats.files import FilePath
from memscal.formats.tables.columns import Wanted
from memscal.formats.tables.dialect import cut_head
from memscal.formats.tables.sheets import open_table
from memscal.model.arrays import FloatArray
from memscal.model.quantities import dimension_in

#: Columns that are no readings.
_CARRIED = ("frame", "t")


class Frames(NamedTuple):
    """Readings (frames, sensors), and the number and the time of each frame where they stand."""

    u: FloatArray
    number: FloatArray | None
    time: FloatArray | None


def read_frames(array: ArrayData, path: FilePath, u_unit: str | None = None) -> Frames:
    """Read frames, their columns in the order of the sensors; refuse those of another array."""
    table = open_table(path)
    heads = {cut_head(name)[0]: name for name in table.names}
    lacking = [name for name in array.sensors if name not in heads]
    others = [name for name in heads if name not in (*array.sensors, *_CARRIED)]
    if lacking or others:
        count = len(heads.keys() - {*_CARRIED})
        raise FormatError(
            f"{path} has {count} columns of readings, but the array has {len(array.sensors)} "
            f"sensors. Without a column: {', '.join(lacking) or 'none'}. Columns of no sensor: "
            f"{', '.join(others) or 'none'}.",
            why="Columns are matched by the names of the sensors.",
            cure=f"Name one column after each sensor, with its unit ('{array.sensors[0]} [mV]'), "
            "empty where it did not read; beside them only 'frame' or 't'.",
        )
    of_u = dimension_in("voltage", array.reading)
    wanted = {}
    for name in array.sensors:
        unit = table.unit_of(heads[name], u_unit, "u_unit (--u-unit)")
        wanted[name] = Wanted(heads[name], unit, of_u)
    if "frame" in heads:
        wanted["frame"] = Wanted(heads["frame"])
    if "t" in heads:
        wanted["t"] = Wanted(heads["t"], table.unit_of(heads["t"], None, "t", "s"), "time")
    columns = table.columns(wanted)
    u = np.column_stack([columns[name] for name in array.sensors])
    return Frames(u, columns.get("frame"), columns.get("t"))
