"""Kinds of recorded files, told by what they begin with, and the table of each."""

import re
from contextlib import suppress
from typing import Any

from memscal.errors import InputError
from memscal.extensions.recorded.hdf5 import open_datasets
from memscal.extensions.recorded.spec import SpecScan
from memscal.extensions.recorded.tdms import open_channels
from memscal.formats.files import FilePath, read_pieces
from memscal.formats.tables.columns import NamedColumns
from memscal.model.arrays import Values
from memscal.model.sizes import MOST_TABLE_BYTES

_BEGINNINGS = {b"\x89HDF\r\n\x1a\n": "HDF5 file", b"TDSm": "TDMS file"}
_SCAN = re.compile(rb"^#S\s+\d", re.MULTILINE)


def kind_of_record(path: FilePath) -> str:
    """Return the kind of a file, which is "text" unless its first MiB tells another."""
    begin = b""
    with suppress(InputError):  # who opens it says why it cannot be read
        begin = next(filter(None, read_pieces(path, limit=MOST_TABLE_BYTES)), b"")
    for signature, kind in _BEGINNINGS.items():
        if begin.startswith(signature):
            return kind
    return "SPEC file" if _SCAN.search(begin) else "text"


def open_record(kind: str, path: FilePath, named: Values, **reading: Any) -> NamedColumns:
    """Open a file of a kind; ``named`` are the columns of a scan that are asked for."""
    if kind == "HDF5 file":
        return open_datasets(path, named, **reading)
    if kind == "TDMS file":
        return open_channels(path, named, **reading)
    return SpecScan(path, **reading)
