"""What a dataset may claim before any of it is read."""

from __future__ import annotations

import math
from typing import Any

from memscal.errors import UnsafeFileError

__all__ = ["MAX_DATASET_BYTES", "MAX_TEXT_BYTES", "check_layout", "check_type", "claimed_bytes"]

MAX_DATASET_BYTES = 128 * 2**20
MAX_TEXT_BYTES = 4 * 2**20
_MAX_RANK = 4
_MAX_CHUNKS = 2**16
_MIN_CHUNK_LIMIT = 2**20
_MAX_NUMBER_BYTES = 16


def refuse(where: str, problem: str, why: str) -> UnsafeFileError:
    """Return the error for a dataset that is not read."""
    return UnsafeFileError(
        f"{where} {problem}.",
        why=why,
        cure="Copy the data into a plain file: contiguous, or with gzip, shuffle and fletcher32.",
    )


def claimed_bytes(dataset: Any) -> int:
    """Return the size that a dataset's shape and type claim, in bytes."""
    return int(math.prod(dataset.shape)) * int(dataset.get_type().get_size())


def check_type(where: str, kind: Any, *, text: bool) -> None:
    """Refuse a type that is not a plain number, or not a string where text is wanted."""
    from memscal.formats.hdf5_library import h5py

    type_class = kind.get_class()
    if text:
        if type_class != h5py.h5t.STRING:
            raise refuse(where, "does not hold text", "Text is expected here.")
        return
    if type_class not in (h5py.h5t.INTEGER, h5py.h5t.FLOAT):
        raise refuse(
            where,
            "holds neither integers nor floating-point numbers",
            "Objects, references, compounds and strings are not read where numbers belong.",
        )
    if kind.get_size() > _MAX_NUMBER_BYTES:
        raise refuse(where, f"has numbers of {kind.get_size()} bytes", "No number is that long.")


def check_layout(where: str, dataset: Any, *, text: bool) -> None:
    """Refuse a dataset whose storage could read other files, run code or exhaust memory.

    ``dataset`` is a low-level ``h5py.h5d.DatasetID``; only its header is looked at.
    """
    from memscal.formats.hdf5_library import h5py

    if dataset.get_space().get_simple_extent_type() == h5py.h5s.NULL:
        raise refuse(where, "has a null dataspace", "It holds no value.")
    check_type(where, dataset.get_type(), text=text)
    shape = dataset.shape
    if len(shape) > (0 if text else _MAX_RANK):
        wanted = "one piece of text" if text else f"at most {_MAX_RANK} dimensions"
        raise refuse(where, f"has {len(shape)} dimensions", f"It should have {wanted}.")
    limit = MAX_TEXT_BYTES if text else MAX_DATASET_BYTES
    if claimed_bytes(dataset) > limit:
        raise refuse(
            where,
            f"claims {claimed_bytes(dataset):,} bytes",
            f"More than {limit:,} bytes are not read, however small the file is.",
        )
    _check_storage(where, dataset, h5py)


def _check_storage(where: str, dataset: Any, h5py: Any) -> None:
    plist = dataset.get_create_plist()
    layout = plist.get_layout()
    if layout == h5py.h5d.VIRTUAL:
        raise refuse(where, "is a virtual dataset", "Its values would come from other files.")
    if plist.get_external_count() > 0:
        raise refuse(where, "is stored in external files", "Any file could be read through it.")
    _check_filters(where, plist, h5py)
    if layout == h5py.h5d.CHUNKED:
        _check_chunks(where, dataset, plist)
    elif claimed_bytes(dataset) and dataset.get_storage_size() < claimed_bytes(dataset):
        raise refuse(
            where, "was never written in full", "Values that are not there would read as zeros."
        )


def _check_filters(where: str, plist: Any, h5py: Any) -> None:
    known = {
        h5py.h5z.FILTER_DEFLATE: "gzip",
        h5py.h5z.FILTER_SHUFFLE: "shuffle",
        h5py.h5z.FILTER_FLETCHER32: "fletcher32",
    }
    seen: set[int] = set()
    for i in range(plist.get_nfilters()):
        code = plist.get_filter(i)[0]
        if code not in known:
            raise refuse(
                where,
                f"uses the HDF5 filter {code}",
                "Only gzip, shuffle and fletcher32 are read: others may load foreign code.",
            )
        if code in seen:
            raise refuse(
                where,
                f"uses the filter {known[code]} more than once",
                "Filters on filters can blow a small file up without limit.",
            )
        seen.add(code)


def _check_chunks(where: str, dataset: Any, plist: Any) -> None:
    chunk = plist.get_chunk()
    shape = dataset.shape
    size = int(math.prod(chunk)) * int(dataset.get_type().get_size())
    limit = max(_MIN_CHUNK_LIMIT, 2 * claimed_bytes(dataset))
    if size > limit or size > MAX_DATASET_BYTES:
        raise refuse(
            where,
            f"has chunks of {size:,} bytes for {claimed_bytes(dataset):,} bytes of data",
            "A whole chunk is held in memory to read one number.",
        )
    number = math.prod(-(-n // c) for n, c in zip(shape, chunk, strict=True))
    if number > _MAX_CHUNKS:
        raise refuse(where, f"is cut into {number:,} chunks", f"At most {_MAX_CHUNKS:,} are read.")
    if number and dataset.get_num_chunks() < number:
        raise refuse(
            where, "was never written in full", "Values that are not there would read as zeros."
        )
