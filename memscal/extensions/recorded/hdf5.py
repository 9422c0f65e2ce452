"""HDF5 files of other programs: plain datasets by their paths, or what an NXdata plots."""

from typing import Any

from memscal.errors import FormatError, InputError
from memscal.extensions.recorded.columns import RecordedColumns
from memscal.formats.files import FilePath
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.model.arrays import Values

#: Groups that @default leads through: that of the file, of its entry, and of a part of it.
_MOST_DEFAULTS = 3


def open_datasets(path: FilePath, named: Values, **reading: Any) -> RecordedColumns:
    """Read the datasets that are named; where x, y and u are not, signal and axis of the NXdata."""
    with open_hdf5(path) as file:
        schema = file.schema
        if schema is not None:
            raise InputError(
                f"{file.name} is no table, but has the schema {schema!r}.",
                cure="Give it to memscal as it is.",
            )
        stated = {name: str(column) for name, column in named.items() if column is not None}
        defaults = {} if stated.keys() & {"x", "y", "u_zz"} else _plotted(file)
        stated |= defaults
        # A path is one however it begins, but the messages name it as it was given.
        places = {column: "/" + column.strip("/") for column in stated.values()}
        arrays = {column: file.array(place) for column, place in places.items()}
        units = [file.units_of(place) or "" for place in places.values()]
    rows = arrays[stated["u_zz"]].size if "u_zz" in stated else 0
    return RecordedColumns(file.source, arrays, units, rows, defaults, **reading)


def _plotted(file: SafeFile) -> dict[str, str]:
    """Return the paths of the signal, and of its first axis, that a file plots by default."""
    group = ""
    for _ in range(_MOST_DEFAULTS):
        if file.attribute(group or "/", "NX_class") not in ("NXdata", ("NXdata",)):
            group += f"/{_name_in(file, group, 'default')}"
    signal, axis = (f"{group}/{_name_in(file, group, name)}" for name in ("signal", "axes"))
    return {"u_zz": signal, "x": axis}


def _name_in(file: SafeFile, group: str, attribute: str) -> str:
    """Return the name, or the first of those, that an attribute of a group states."""
    stated = file.attribute(group or "/", attribute)
    name = stated[0] if isinstance(stated, tuple) else stated
    if not isinstance(name, str) or not name.strip("/. "):
        raise FormatError(
            f"{file.where(group or '/')} has no attribute {attribute!r} that names something.",
            why="Where no datasets are named, those are read that are plotted: @default of the "
            "file and of its entry name an NXdata, and that its @signal and its @axes.",
            cure="Name datasets by their paths (--x /entry/x --u /entry/u).",
        )
    return name
