"""Limits of what a dataset, a text or an attribute may claim, checked before any of it is read.

HDF5 sets aside the memory that a text of variable length claims, up to 4 GiB, and can walk for ever
through a damaged heap.  The claim is a descriptor of 16 bytes: length, address, index ("HDF5 File
Format Specification", section VIII).
"""

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import h5py

from memscal.errors import UnsafeFileError, counted
from memscal.model.sizes import MOST_ARRAY_BYTES, MOST_HDF5_BYTES

_DESCRIPTOR = 16
_OBJECT = 16  # _OBJECT: header of an object in a global heap
_CONTINUATION = 0x10
_ATTRIBUTE = 0x0C
_SHARED = 0x02
_VARIABLE_LENGTH = 9  # class of the datatype
_MAX_BLOCKS = 1000
#: Records of one name among the bytes of a file that are looked at.
_MAX_RECORDS = 10_000


def claimed_length(file: bytes, data: bytes | memoryview, position: int, heaps: set[int]) -> int:
    """Return the length, in bytes, that a descriptor claims, after a look at its heap."""
    # ``heaps``: addresses of those that were looked at before, in the same file.
    length, heap = struct.unpack_from("<IQ", data, position)
    if length and heap not in heaps:
        _check_heap(file, heap)
        heaps.add(heap)
    return int(length)


def _check_heap(file: bytes, address: int) -> None:
    """Refuse a global heap through which HDF5 would walk for ever, or out of the file."""
    if address > len(file) - 16 or file[address : address + 4] != b"GCOL":
        raise ValueError("the text lies in no heap")
    end = address + int.from_bytes(file[address + 8 : address + 16], "little")
    position = address + 16
    if not position <= end <= len(file):
        raise ValueError("the heap of the text has a wrong size")
    while position + _OBJECT <= end:
        index, _, size = struct.unpack_from("<HHxxxxQ", file, position)
        step = size if index == 0 else _OBJECT + -(-size // 8) * 8
        if step < _OBJECT or position + step > end:
            raise ValueError("the heap of the text is damaged")
        position += step


def attribute_text_lengths(
    data: bytes, header: int, name: bytes, number: int, heaps: set[int]
) -> list[int]:
    """Return the lengths, in bytes, that an object's attribute of texts claims."""
    try:
        for kind, flags, message in _messages(data, header):
            if kind != _ATTRIBUTE or flags & _SHARED:
                continue
            attribute, start = _attribute(message)
            if attribute == name:
                starts = [start + i * _DESCRIPTOR for i in range(number)]
                return [claimed_length(data, message, at, heaps) for at in starts]
    except (struct.error, IndexError) as error:
        raise ValueError("the header of its object is damaged") from error
    lengths = list(_dense_lengths(data, name, number, heaps))
    if not lengths:
        raise ValueError("an attribute is stored in a way that cannot be checked")
    return lengths


def _dense_lengths(data: bytes, name: bytes, number: int, heaps: set[int]) -> Iterator[int]:
    """Yield the claims of every attribute of this name and of variable length, in any object."""
    # In a heap of many attributes a message stands as it would in the header.
    terminated = name + b"\0"
    whole = memoryview(data)
    position = data.find(terminated)
    for _ in range(_MAX_RECORDS):
        if position < 0:
            return
        for size, versions in ((8, (1, 2)), (9, (3,))):
            start = position - size
            if start < 0 or data[start] not in versions:
                continue
            message = whole[start : start + 2**16]
            attribute, values = _attribute(message)
            dtype = size + (-(-len(terminated) // 8) * 8 if data[start] == 1 else len(terminated))
            variable = dtype < len(message) and message[dtype] & 0x0F == _VARIABLE_LENGTH
            if attribute == name and variable and len(message) >= values + number * _DESCRIPTOR:
                for i in range(number):
                    yield claimed_length(data, message, values + i * _DESCRIPTOR, heaps)
        position = data.find(terminated, position + 1)
    raise ValueError("an attribute has more namesakes than can be checked")


def _attribute(message: bytes | memoryview) -> tuple[bytes, int]:
    """Return the name of an attribute message and where its data begin."""
    version, _, name, dtype, space = struct.unpack_from("<BBHHH", message)
    start = 9 if version == 3 else 8
    # Version 1 pads each part to a multiple of eight bytes.
    sizes = [-(-size // 8) * 8 if version == 1 else size for size in (name, dtype, space)]
    return bytes(message[start : start + name]).rstrip(b"\0"), start + sum(sizes)


def _messages(data: bytes, header: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield type, flags and body of every message in an object header and its continuations."""
    if data[header : header + 4] == b"OHDR":
        settings = data[header + 5]
        start = header + 6 + (16 if settings & 0x20 else 0) + (4 if settings & 0x10 else 0)
        width = 1 << (settings & 0x03)
        size = int.from_bytes(data[start : start + width], "little")
        blocks = [(start + width, size)]
        prefix = 6 if settings & 0x04 else 4
    else:
        (size,) = struct.unpack_from("<I", data, header + 8)
        blocks = [(header + 16, size)]
        prefix = 8
    for _ in range(_MAX_BLOCKS):
        if not blocks:
            return
        position, size = blocks.pop()
        end = min(position + size, len(data))
        while position + prefix <= end:
            layout = "<HHB" if prefix == 8 else "<BHB"
            kind, length, flags = struct.unpack_from(layout, data, position)
            body = data[position + prefix : position + prefix + length]
            if kind == _CONTINUATION:
                address, extent = struct.unpack_from("<QQ", body)
                # A block of a version 2 header has a signature before and a checksum behind.
                blocks.append((address, extent) if prefix == 8 else (address + 4, extent - 8))
            yield kind, flags, body
            position += prefix + length


MAX_TEXT_BYTES = 4 * 2**20
_MAX_RANK = 4
_MAX_NUMBER_BYTES = 16
_MAX_CHUNKS = 2**16
_MIN_CHUNK_LIMIT = 2**20
#: Chunks at the edges of an array of four axes may make it this many times as large.
_MAX_MARGIN = 16
_UNWRITTEN = "was never written in full", "Values that are not there would read as zeros."


#: Bytes that may be held of any file, and more for each of its bytes: packed readings of noise
#: stand for two or three bytes each, and arrays without noise beside them for many.
_USUAL = 2**26
_MOST_PER_BYTE = 64


def most_held(size: int) -> int:
    """Return how many bytes may be held of a file of this size."""
    return min(MOST_HDF5_BYTES, _USUAL + _MOST_PER_BYTE * size)


def refuse(where: str, problem: str, why: str) -> UnsafeFileError:
    """Return the error for a dataset that is not read."""
    cure = "Copy the data into a plain file: contiguous, or with gzip, shuffle and fletcher32."
    return UnsafeFileError(f"{where} {problem}.", why=why, cure=cure)


def check_type(where: str, kind: Any, *, text: bool) -> None:
    """Refuse a type that is not a plain number, or not a string where text is expected."""
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


class Layout(NamedTuple):
    """Type and shape of a dataset or an attribute, and the size that they claim, in bytes."""

    kind: Any
    shape: tuple[int, ...]
    size: int

    @property
    def held(self) -> int:
        """What its numbers take when they are read, each as eight bytes."""
        return 8 * math.prod(self.shape)

    @classmethod
    def of(cls, where: str, item: Any) -> "Layout":
        """Look at a dataset or an attribute."""
        # HDF5's objects are asked for once: each costs as much as reading a number.
        space = item.get_space()
        kind = item.get_type()
        if space.get_simple_extent_type() == h5py.h5s.NULL:
            raise refuse(where, "has a null dataspace", "It holds no value.")
        return cls(kind, space.shape, math.prod(space.shape) * kind.get_size())


def check_layout(where: str, dataset: Any, data: bytes, *, text: bool) -> Layout:
    """Refuse a dataset whose storage could read other files, run code or exhaust memory."""
    of = Layout.of(where, dataset)
    kind, shape, claimed = of
    check_type(where, kind, text=text)
    if len(shape) > (0 if text else _MAX_RANK):
        expected = "one piece of text" if text else f"at most {_MAX_RANK} dimensions"
        raise refuse(
            where, f"has {counted(len(shape), 'dimensions')}", f"It should have {expected}."
        )
    limit = MAX_TEXT_BYTES if text else MOST_ARRAY_BYTES
    size = claimed if text else max(claimed, of.held)
    if size > limit:
        raise refuse(
            where,
            f"claims {size:,} bytes",
            f"More than {limit:,} bytes are not read, however small the file is.",
        )
    plist = dataset.get_create_plist()
    layout = plist.get_layout()
    if layout == h5py.h5d.VIRTUAL:
        raise refuse(where, "is a virtual dataset", "Its values would come from other files.")
    if plist.get_external_count() > 0:
        raise refuse(where, "is stored in external files", "Any file could be read through it.")
    codes = _check_filters(where, plist)
    if layout == h5py.h5d.CHUNKED:
        size = _check_chunks(where, dataset, plist.get_chunk(), of)
        if h5py.h5z.FILTER_DEFLATE in codes:
            _check_inflation(where, dataset, codes, size, data)
    elif claimed and dataset.get_storage_size() < claimed:
        raise refuse(where, *_UNWRITTEN)
    return of


def _check_filters(where: str, plist: Any) -> list[int]:
    filters = {
        h5py.h5z.FILTER_DEFLATE: "gzip",
        h5py.h5z.FILTER_SHUFFLE: "shuffle",
        h5py.h5z.FILTER_FLETCHER32: "fletcher32",
    }
    codes = [plist.get_filter(i)[0] for i in range(plist.get_nfilters())]
    for code in codes:
        if code not in filters:
            raise refuse(
                where,
                f"uses the HDF5 filter {code}",
                "Only gzip, shuffle and fletcher32 are read: others may load foreign code.",
            )
        if codes.count(code) > 1:
            raise refuse(
                where,
                f"uses the filter {filters[code]} more than once",
                "Filters on filters can blow a small file up without limit.",
            )
    return codes


def _check_chunks(where: str, dataset: Any, chunk: tuple[int, ...], of: Layout) -> int:
    """Refuse chunks much larger than the data, too many or unwritten ones; return their size."""
    size = math.prod(chunk) * int(of.kind.get_size())
    if size > max(_MIN_CHUNK_LIMIT, 2 * of.size) or size > MOST_ARRAY_BYTES:
        raise refuse(
            where,
            f"has chunks of {size:,} bytes for {of.size:,} bytes of data",
            "A whole chunk is held in memory to read one number.",
        )
    number = math.prod(-(-n // c) for n, c in zip(of.shape, chunk, strict=True))
    if number * size > max(_MIN_CHUNK_LIMIT, _MAX_MARGIN * of.size):
        raise refuse(
            where,
            f"is cut into chunks of {number * size:,} bytes for {of.size:,} bytes of data",
            "Each is unpacked as a whole.",
        )
    if number > _MAX_CHUNKS:
        raise refuse(where, f"is cut into {number:,} chunks", f"At most {_MAX_CHUNKS:,} are read.")
    if number and dataset.get_num_chunks() < number:
        raise refuse(where, *_UNWRITTEN)
    return size


def _check_inflation(where: str, dataset: Any, codes: list[int], size: int, data: bytes) -> None:
    """Refuse a packed chunk that does not unpack to its size: HDF5 would, without a limit."""
    place = codes.index(h5py.h5z.FILTER_DEFLATE)
    # A checksum that was taken before packing is packed, too.
    size += 4 * (h5py.h5z.FILTER_FLETCHER32 in codes[:place])
    whole = memoryview(data)

    def check(chunk: Any) -> None:
        if not chunk.filter_mask & 1 << place:
            packed = whole[chunk.byte_offset :][: chunk.size]
            if len(zlib.decompressobj().decompress(packed, size + 1)) != size:
                raise refuse(
                    where,
                    f"has a chunk that does not unpack to {size:,} bytes",
                    "A few bytes can stand for any number of them.",
                )

    dataset.chunk_iter(check)
