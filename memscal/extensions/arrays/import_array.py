"""What the import of a table of an array does beyond that of a single sensor's."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.extensions.arrays.frames import without_options
from memscal.formats.tables.columns import NamedColumns, Wanted
from memscal.formats.tables.dialect import is_number
from memscal.formats.tables.scan import ImportedScan, with_notes
from memscal.formats.tables.sheets import open_table
from memscal.formats.tables.stated import TableLayout
from memscal.formats.units import to_si
from memscal.model.arrays import Columns, FloatArray, Values
from memscal.model.checks import at_ceiling_text
from memscal.model.scan import Scan

#: Begins the names of the readings of each sensor, of which ``u_zz`` is the sum.
_OF = "u_zz of "
_ERRORS = "u_zz_errors of "
#: Stands, with its place added, for the name of a sensor that is no number: no cell holds as much.
_NAMED = 1e12


def columns_of_array(
    table: NamedColumns, asked: Sequence[str | int], named: Mapping[str, str | int | None]
) -> dict[str, str]:
    """Return the columns of the sensors, by the names of their readings; ``*`` is any other."""
    heads = table.heads
    taken = [
        table.index_of(column)
        for name, column in named.items()
        if column is not None and name != "u_zz"
    ]
    numbers: list[int] = []
    for column in asked:
        pattern = re.escape(str(column)).replace(r"\*", ".+")
        found = [
            i for i, head in enumerate(heads) if i not in taken and re.fullmatch(pattern, head)
        ]
        numbers += found if "*" in str(column) and found else [table.index_of(column)]
    sensors = {_OF + heads[i]: table.names[i] for i in numbers}
    if len(sensors) < len(numbers):
        raise InputError(
            f"The columns of the sensors are {', '.join(heads[i] for i in numbers)}.",
            why="The name of a sensor is the head of its column, and tells it from the others.",
            cure="Name each column once (--u), and rename columns of the same name.",
        )
    return {"u_zz": table.names[numbers[0]], **(sensors if len(sensors) > 1 else {})}


def add_up(columns: Columns, layout: TableLayout) -> list[str]:
    """Make ``u_zz`` the sum of all sensors' readings, which get their sign; return a note."""
    names = [name for name in columns if name.startswith(_OF)]
    total = np.zeros(columns["u_zz"].shape)
    for name in names:
        columns[name] *= layout.u_sign
        if not np.isnan(columns[name]).all():  # one without readings changes no other's
            total += columns[name]
    columns["u_zz"] = total
    notes = [f"An array of {len(names)} sensors."]
    if layout.holds:
        notes.append("Holds are found in the sum of all, of which scatter and change are told.")
    return notes


def errors_of_sensors(columns: Columns) -> FloatArray:
    """Return the standard uncertainty of a typical sensor in each hold; zero if not all have one.

    The sum scatters as no sensor does.
    """
    errors = [columns[name] for name in columns if name.startswith(_ERRORS)]
    return np.nanmedian(errors, axis=0) * np.all(errors)


def array_scan(
    scan: ImportedScan, layout: Any, ceiling: float | None, of: Wanted
) -> tuple[ImportedScan, Scan]:
    """Return the scan of an array, of that of the sum; and that of the sensor that reads most."""
    channels = dict(scan.channels)
    stored = [name for name in channels if name.startswith(_OF)]
    u_zz = np.stack([channels.pop(name) for name in stored])
    names = [name.removeprefix(_OF) for name in stored]
    stated: Values = {}
    notes = []
    if layout is not None:
        stated, note = read_layout(layout, names)
        notes.append(note)
    if ceiling is not None:  # a calibration leaves out what is there, and says of which sensor
        high = to_si(ceiling, of.unit, of.dimension, "ceiling (--ceiling)")
        stated["reading_high"] = high
        at_ceiling = int(np.sum(u_zz >= high))
        if at_ceiling == np.isfinite(u_zz).sum():
            raise InputError(
                f"All {at_ceiling} readings are at or above the ceiling of {ceiling:g} {of.unit}.",
                cure="Give the ceiling in the unit of the readings (--ceiling), or leave it out.",
            )
        notes.append(at_ceiling_text(at_ceiling))
    own = [channels.pop(name) for name in scan.channels if name.startswith(_ERRORS)]
    if scan.u_zz_errors is not None:  # of holds each sensor has its own
        stated["u_zz_errors"] = np.broadcast_to(own or [scan.u_zz_errors], u_zz.shape)
    array = replace(
        with_notes(scan, notes),
        u_zz=u_zz,
        channels=channels,
        sensors=tuple(names),
        **stated,
    )
    most = int(np.nan_to_num(u_zz).argmax()) // scan.u_zz.size
    return array, array.of_sensor(most)


@without_options(
    "one head (sensor, 'x [mm]', 'y [mm]', board by a number), below it a row for each sensor"
)
def read_layout(source: Any, sensors: Sequence[str]) -> tuple[Values, str]:
    """Return what a table states that names each sensor once, lengths in m; and a note on it."""
    table = open_table(source)
    # A cell that is a number is read as one, and a name by what stands for it.
    keys = [float(name) if is_number(name) else _NAMED + i for i, name in enumerate(sensors)]
    words = {name.lower(): key for name, key in zip(sensors, keys, strict=True)}
    fields = {"layout": ("x", "y")}
    if "x_errors" in table.heads:
        fields["layout_uncertainty"] = ("x_errors", "y_errors")
    wanted = {"sensor": Wanted("sensor", words=words)}
    for name in chain(*fields.values()):
        wanted[name] = Wanted(name, table.unit_of(name, None, "x [mm]"), "length")
    if "board" in table.heads:
        wanted["board"] = Wanted("board")
    columns = table.columns(wanted)
    for name, values in columns.items():
        empty = np.flatnonzero(np.isnan(values))
        if empty.size:
            raise InputError(
                f"{table.where(name)} is empty in {table.lines(empty.tolist())}.",
                why="A layout states all of each sensor.",
                cure="Fill in the cells, or leave the column x_errors, y_errors or board out.",
            )
    found = columns["sensor"].tolist()
    wrong = [name for name, key in zip(sensors, keys, strict=True) if found.count(key) != 1]
    if wrong or len(found) > len(keys):
        raise InputError(
            f"{table.where('sensor')} has {len(found)} rows for {len(keys)} sensors, and does not "
            f"name exactly once: {', '.join(wrong) or 'those of the other rows'}.",
            why="A layout says where each sensor is, by the name of its column of readings.",
            cure="Give each sensor one row, and no other.",
        )
    order = [found.index(key) for key in keys]
    stated: Values = {
        field: np.column_stack([columns[name] for name in names])[order]
        for field, names in fields.items()
    }
    if "board" in columns:
        stated["board"] = columns["board"][order]
    file = table.source
    name = "" if file is None else f" from {file.file_name} (SHA-256 {file.sha256})"
    return stated, f"Read{name}: {', '.join(stated)}."
