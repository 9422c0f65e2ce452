"""memscal-contact-table: calculated contacts that are kept from one run to the next.

A folder of such files is a cache.  Each is named after the SHA-256 of everything that its numbers
depend on (SI units, bit for bit); a damaged, foreign or older file counts as not found.
"""

import hashlib
import json
import os
import re
from contextlib import suppress
from pathlib import Path

from memscal.errors import MemscalError, OutputError
from memscal.formats.digest import require_schema, require_unaltered
from memscal.formats.files import FilePath, atomic_write_bytes
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.hdf5.writer import Group, Nodes, Number, file_tree, tree_to_bytes
from memscal.model.arrays import Arrays, Values

CONTACT_TABLE_SCHEMA = "memscal-contact-table"

CacheFolder = FilePath | None
"""A folder in which calculated contacts are kept; ``None`` keeps none."""

#: A folder grows no further than this.
_MOST_BYTES = 64 * 2**20
_MOST_ENTRIES = 512
_ENTRY = re.compile(r"[0-9a-f]{64}\.h5")
_TRANSFORM = ("N", ("value", "load", "k"))
#: Units and axes of arrays that are not transforms in N.
_OTHERS = {
    "value": ("1", ("value",)),
    "load": ("N", ("load",)),
    "k": ("rad/m", ("k",)),
    "depths": ("m", ("value", "load")),
    "contact_radii": ("m", ("value", "load")),
    "convergence": ("1", ("value", "load")),
}


def table_key(content: Values) -> str:
    """Return the SHA-256 of what a table depends on, in plain values for JSON."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def keep_contact_table(folder: FilePath, key: str, arrays: Arrays) -> None:
    """Write arrays under their key, remove the oldest; where the disk takes none, keep none."""
    # value (M,), load (L,), k (K,), transforms (M, L, K) in N, all others (M, L).
    children = {
        name: Number(array, *_OTHERS.get(name, _TRANSFORM)) for name, array in arrays.items()
    }
    contacts = Group("NXdata", children, {"signal": "spectra", "axes": _TRANSFORM[1]})
    stored: Nodes = {"contacts": contacts, "key": key, "arrays": " ".join(arrays)}
    entry = Group("NXentry", stored, {"default": "contacts"})
    data = tree_to_bytes(file_tree(CONTACT_TABLE_SCHEMA, entry))
    with suppress(OSError, OutputError):
        os.makedirs(folder, exist_ok=True)
        atomic_write_bytes(_path(folder, key), data, overwrite=True)
        _prune(folder)


def find_contact_table(folder: FilePath, key: str) -> Arrays | None:
    """Return the arrays that were kept under a key; ``None`` where none of them are sound."""
    path = _path(folder, key)
    try:
        with open_hdf5(path) as file:
            require_schema(file, CONTACT_TABLE_SCHEMA)
            require_unaltered(file)
            if file.text("/entry/key") != key:
                return None
            arrays = {
                name: file.array(f"/entry/contacts/{name}")
                for name in file.text("/entry/arrays").split()
            }
    except MemscalError:
        return None
    with suppress(OSError):
        os.utime(path)
    return arrays


def _path(folder: FilePath, key: str) -> Path:
    return Path(folder) / f"{key}.h5"


def _prune(folder: FilePath) -> None:
    """Remove the tables of a folder that were used longest ago, until it is small enough."""
    entries = []
    with suppress(OSError), os.scandir(folder) as items:
        for item in items:
            with suppress(OSError):
                if _ENTRY.fullmatch(item.name) and item.is_file(follow_symlinks=False):
                    entries.append((Path(item.path), item.stat(follow_symlinks=False)))
    entries.sort(key=lambda entry: (entry[1].st_mtime_ns, entry[0].name))
    size = sum(status.st_size for _, status in entries)
    # What was written last stays, however large it is.
    for number, (path, status) in enumerate(entries[:-1]):
        if size <= _MOST_BYTES and len(entries) - number <= _MOST_ENTRIES:
            return
        with suppress(OSError):
            path.unlink()
        size -= status.st_size
