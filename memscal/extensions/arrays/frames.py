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
_FRAME = "frame"
_TIME = "t"
_NAMED = 8


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
    others = [name for name in heads if name not in (*array.sensors, _FRAME, _TIME)]
    if lacking or others:
        counts = f"{len(heads.keys() - {_FRAME, _TIME})} columns of readings"
        lines = [f"{path} has {counts}, but the array has {len(array.sensors)} sensors."]
        if lacking:
            lines.append(f"Sensors without a column: {_listed(lacking)}.")
        if others:
            lines.append(f"Columns of no sensor: {_listed(others)}.")
        raise FormatError(
            " ".join(lines),
            why="Columns are matched by the names of the sensors.",
            cure=f"Name one column after each sensor, with its unit ('{array.sensors[0]} [mV]'), "
            f"empty where it did not read; beside them only '{_FRAME}' or '{_TIME}'.",
        )
    of_u = dimension_in("voltage", array.reading)
    wanted = {}
    for name in array.sensors:
        unit = table.unit_of(heads[name], u_unit, "u_unit (--u-unit)")
        wanted[name] = Wanted(heads[name], unit, of_u)
    if _FRAME in heads:
        wanted[_FRAME] = Wanted(heads[_FRAME])
    if _TIME in heads:
        unit = table.unit_of(heads[_TIME], None, _TIME, "s")
        wanted[_TIME] = Wanted(heads[_TIME], unit, "time")
    columns = table.columns(wanted)
    u = np.column_stack([columns[name] for name in array.sensors])
    return Frames(u, columns.get(_FRAME), columns.get(_TIME))


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more
