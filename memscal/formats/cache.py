"""memscal-contact-table: calculated contacts that are kept from one run to the next.

A folder of such files is a cache: each is named after the SHA-256 of everything that its numbers
depend on, so that an entry is either right or not found.  A damaged, foreign or older file counts
as not found.  Files are written whole or not at all, so that any number of programs may share a
folder; the entries that were used longest ago are removed when there are too many.  Numbers are
in SI units, bit for bit as they were calculated.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from memscal.errors import FormatError, MemscalError, OutputError
from memscal.formats.files import atomic_write_bytes
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import Group, Node, Number, file_tree, tree_to_bytes
from memscal.formats.values import altered, require_schema
from memscal.model.arrays import FloatArray

__all__ = [
    "CONTACT_TABLE_SCHEMA",
    "ContactTable",
    "clear_contact_tables",
    "find_contact_table",
    "keep_contact_table",
    "table_key",
]

CONTACT_TABLE_SCHEMA = "memscal-contact-table"

#: A folder grows no further than this.
_MOST_BYTES = 64 * 2**20
_MOST_ENTRIES = 512
_ENTRY = re.compile(r"[0-9a-f]{64}\.h5")
_KEY = re.compile(r"[0-9a-f]{64}")
_ARRAYS = {
    "spectra": ("N", ("value", "load", "k")),
    "by_load": ("N", ("value", "load", "k")),
    "depth": ("m", ("value", "load")),
    "contact_radius": ("m", ("value", "load")),
    "convergence": ("1", ("value", "load")),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactTable:
    """Transforms of base stresses over M values of a parameter, L loads and K wavenumbers.

    Parameters
    ----------
    value : ndarray, shape (M,)
        Values of the parameter; ``inf`` is allowed.
    load : ndarray, shape (L,)
        Loads in N.
    k : ndarray, shape (K,)
        Wavenumbers in rad/m.
    spectra, by_load : ndarray, shape (M, L, K)
        Transforms in N, and their derivatives by the logarithm of the load.
    changes : mapping of str to ndarray, shape (M, L, K)
        Changes by one standard uncertainty of each source, in N.
    depth, contact_radius, convergence : ndarray, shape (M, L)
        Depths and radii in m, and relative changes under refinement.
    """

    value: FloatArray
    load: FloatArray
    k: FloatArray
    spectra: FloatArray
    by_load: FloatArray
    changes: Mapping[str, FloatArray]
    depth: FloatArray
    contact_radius: FloatArray
    convergence: FloatArray


def table_key(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what a table depends on, in plain values that JSON can say.

    Examples
    --------
    >>> table_key({"load": 0.34}) == table_key({"load": 0.34000000000000002})
    True
    """
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def keep_contact_table(folder: str | os.PathLike[str], key: str, table: ContactTable) -> bool:
    """Write a table into a folder under its key, and remove the oldest beyond the folder's limit.

    Returns
    -------
    bool
        Whether it was written: a full or read-only disk costs time in the next run, no more.
    """
    data = tree_to_bytes(file_tree(CONTACT_TABLE_SCHEMA, _entry(key, table)))
    try:
        os.makedirs(folder, exist_ok=True)
        atomic_write_bytes(_path(folder, key), data, overwrite=True)
    except (OSError, OutputError):
        return False
    _prune(folder)
    return True


def find_contact_table(folder: str | os.PathLike[str], key: str) -> ContactTable | None:
    """Return the table that was kept under a key; ``None`` where there is none that is sound."""
    path = _path(folder, key)
    try:
        with open_hdf5(path) as file:
            require_schema(file, CONTACT_TABLE_SCHEMA)
            if altered(file) or file.text("/entry/key") != key:
                return None
            table = _table(file)
    except MemscalError:
        return None
    with contextlib.suppress(OSError):
        os.utime(path)
    return table


def clear_contact_tables(folder: str | os.PathLike[str]) -> int:
    """Remove all tables from a folder, and nothing else; return how many there were."""
    return sum(_removed(path) for path, _ in _entries(folder))


def _path(folder: str | os.PathLike[str], key: str) -> Path:
    if not _KEY.fullmatch(key):
        raise FormatError(f"{key!r} is not the key of a contact table.")
    return Path(folder) / f"{key}.h5"


def _entry(key: str, table: ContactTable) -> Group:
    children: dict[str, Node] = {
        "value": Number(table.value, "1", ("value",)),
        "load": Number(table.load, "N", ("load",)),
        "k": Number(table.k, "rad/m", ("k",)),
    }
    for name, (units, axes) in _ARRAYS.items():
        children[name] = Number(getattr(table, name), units, axes)
    for source, change in table.changes.items():
        children[f"by_{source}"] = Number(change, "N", ("value", "load", "k"))
    contacts = Group("NXdata", children, {"signal": "spectra", "axes": _ARRAYS["spectra"][1]})
    return Group(
        "NXentry",
        {"contacts": contacts, "key": key, "sources": " ".join(table.changes)},
        {"default": "contacts"},
    )


def _table(file: SafeFile) -> ContactTable:
    def array(name: str) -> FloatArray:
        return np.asarray(file.array(f"/entry/contacts/{name}"), dtype=np.float64)

    sources = file.text("/entry/sources").split()
    return ContactTable(
        value=array("value"),
        load=array("load"),
        k=array("k"),
        changes={source: array(f"by_{source}") for source in sources},
        **{name: array(name) for name in _ARRAYS},
    )


def _entries(folder: str | os.PathLike[str]) -> list[tuple[Path, os.stat_result]]:
    """Return the tables of a folder, the one used longest ago first."""
    found = []
    with contextlib.suppress(OSError), os.scandir(folder) as listed:
        for item in listed:
            with contextlib.suppress(OSError):
                if _ENTRY.fullmatch(item.name) and item.is_file(follow_symlinks=False):
                    found.append((Path(item.path), item.stat(follow_symlinks=False)))
    return sorted(found, key=lambda entry: (entry[1].st_mtime_ns, entry[0].name))


def _prune(folder: str | os.PathLike[str]) -> None:
    entries = _entries(folder)
    size = sum(status.st_size for _, status in entries)
    # What was written last stays, however large it is.
    for number, (path, status) in enumerate(entries[:-1]):
        if size <= _MOST_BYTES and len(entries) - number <= _MOST_ENTRIES:
            return
        _removed(path)
        size -= status.st_size


def _removed(path: Path) -> bool:
    try:
        path.unlink()
    except OSError:
        return False
    return True
