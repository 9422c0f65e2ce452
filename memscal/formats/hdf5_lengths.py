"""How long variable-length text claims to be, found before the HDF5 library is asked for it.

HDF5 sets aside the memory that a variable-length string claims, up to 4 GiB, before it finds
out that the file holds no such string, and can walk for ever through the damaged heap that
holds it.  The claim stands in the file as a descriptor of 16
bytes (length, address, index; "HDF5 File Format Specification", section VIII): for a dataset
where its storage begins, for an attribute in the header of its object.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

__all__ = ["attribute_text_lengths", "text_length"]

_DESCRIPTOR = 16
_OBJECT = 16  # header of an object in a global heap
_CONTINUATION, _ATTRIBUTE = 0x10, 0x0C
_SHARED = 0x02
_VARIABLE_LENGTH = 9  # class of the datatype
_MAX_BLOCKS = 1000


def text_length(data: bytes, address: int) -> int:
    """Return the length that the descriptor at an address claims, in bytes.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not 0 <= address <= len(data) - _DESCRIPTOR:
        raise ValueError("the text lies outside the file")
    return _claim(data, data, address)


def _claim(file: bytes, data: bytes, position: int) -> int:
    """Return the length in a descriptor, after a look at the heap that it leads to."""
    length, heap = struct.unpack_from("<IQ", data, position)
    if length:
        _check_heap(file, heap)
    return int(length)


def _check_heap(file: bytes, address: int) -> None:
    """Refuse a global heap through which HDF5 would walk for ever, or out of the file.

    Every object says how far it is to the next; free space (index 0) counts its own header.
    """
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


def attribute_text_lengths(data: bytes, header: int, name: bytes, number: int) -> list[int]:
    """Return the lengths that an attribute's descriptors claim, in bytes.

    Parameters
    ----------
    data : bytes
        The file.
    header : int
        Address of the object's header.
    name : bytes
        The attribute.
    number : int
        How many texts it holds.

    Raises
    ------
    ValueError
        If the attribute is not found, or the header is damaged.
    """
    try:
        for kind, flags, message in _messages(data, header):
            if kind != _ATTRIBUTE or flags & _SHARED:
                continue
            found, start = _attribute(message)
            if found == name:
                starts = [start + i * _DESCRIPTOR for i in range(number)]
                return [_claim(data, message, at) for at in starts]
    except (struct.error, IndexError) as error:
        raise ValueError("the header of its object is damaged") from error
    lengths = list(_dense_lengths(data, name, number))
    if not lengths:
        raise ValueError("an attribute is stored in a way that cannot be checked")
    return lengths


def _dense_lengths(data: bytes, name: bytes, number: int) -> Iterator[int]:
    """Yield the claims of every attribute of this name and of variable length, in any object.

    Where an object has many attributes they lie in a heap of their own; its structure need
    not be followed, because a message stands there as it would in the header.
    """
    wanted = name + b"\0"
    position = data.find(wanted)
    while position >= 0:
        for size, versions in ((8, (1, 2)), (9, (3,))):
            start = position - size
            if start < 0 or data[start] not in versions:
                continue
            message = data[start : start + 2**16]
            named, values = _attribute(message)
            dtype = size + (-(-len(wanted) // 8) * 8 if data[start] == 1 else len(wanted))
            variable = dtype < len(message) and message[dtype] & 0x0F == _VARIABLE_LENGTH
            if named == name and variable and len(message) >= values + number * _DESCRIPTOR:
                for i in range(number):
                    yield _claim(data, message, values + i * _DESCRIPTOR)
        position = data.find(wanted, position + 1)


def _attribute(message: bytes) -> tuple[bytes, int]:
    """Return the name of an attribute message and where its data begin."""
    version, _, name, dtype, space = struct.unpack_from("<BBHHH", message)
    start = 9 if version == 3 else 8
    # Version 1 pads each part to a multiple of eight bytes.
    sizes = [-(-size // 8) * 8 if version == 1 else size for size in (name, dtype, space)]
    return message[start : start + name].rstrip(b"\0"), start + sum(sizes)


def _messages(data: bytes, header: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield type, flags and body of every message in an object header and its continuations."""
    if data[header : header + 4] == b"OHDR":
        settings = data[header + 5]
        start = header + 6 + (16 if settings & 0x20 else 0) + (4 if settings & 0x10 else 0)
        width = 1 << (settings & 0x03)
        size = int.from_bytes(data[start : start + width], "little")
        blocks, prefix = [(start + width, size)], 6 if settings & 0x04 else 4
    else:
        (size,) = struct.unpack_from("<I", data, header + 8)
        blocks, prefix = [(header + 16, size)], 8
    for _ in range(_MAX_BLOCKS):
        if not blocks:
            return
        position, size = blocks.pop()
        end = min(position + size, len(data))
        while position + prefix <= end:
            if prefix == 8:
                kind, length, flags = struct.unpack_from("<HHB", data, position)
            else:
                kind, length, flags = struct.unpack_from("<BHB", data, position)
            body = data[position + prefix : position + prefix + length]
            if kind == _CONTINUATION:
                address, extent = struct.unpack_from("<QQ", body)
                # A block of a version 2 header has a signature before and a checksum behind.
                blocks.append((address, extent) if prefix == 8 else (address + 4, extent - 8))
            yield kind, flags, body
            position += prefix + length
