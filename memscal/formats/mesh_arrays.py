"""The numbers of a VTU file: encoded and compressed in VTK's ways, decoded within limits.

In every way an array is a header and a payload.  Without compression the header is the number
of bytes that follow; with it, the number of blocks, the size of a block and of a last shorter
one, and the compressed size of each (VTK File Formats, section "XML formats").
"""

from __future__ import annotations

import base64
import lzma
import re
import warnings
import zlib
from typing import Any

import numpy as np

from memscal.errors import FormatError, UnsafeFileError
from memscal.formats.text import printable

__all__ = ["NUMBER_TYPES", "ArrayDecoder"]

NUMBER_TYPES = {
    **{f"Int{bits}": f"i{bits // 8}" for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": f"u{bits // 8}" for bits in (8, 16, 32, 64)},
    **{f"Float{bits}": f"f{bits // 8}" for bits in (32, 64)},
}
"""VTK's names of number types, and numpy's."""

_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
_COMPRESSORS = {"vtkZLibDataCompressor", "vtkLZMADataCompressor"}
_LZMA_MEMORY = 128 * 2**20
# Decoded numbers of one file; the file itself has a limit of its own.
_MAX_DECODED_BYTES = 512 * 2**20
# Base64 that was encoded in parts has padding, "=", at the end of each.
_PART = re.compile(rb"[A-Za-z0-9+/]+={0,2}")


class ArrayDecoder:
    """Decoder of the arrays of one file, which together may not grow beyond a limit.

    Parameters
    ----------
    name : str
        The file, for messages.
    order, header, compressor : str
        Attributes of the root element: ``byte_order``, ``header_type`` and ``compressor``.
    """

    def __init__(self, name: str, *, order: str, header: str, compressor: str) -> None:
        if order not in _ORDERS or header not in ("UInt32", "UInt64"):
            raise FormatError(
                f"{name} has the byte order {printable(order, 40)!r} and headers of type "
                f"{printable(header, 40)!r}, which VTK does not know.",
                cure="Save the mesh again.",
            )
        self.name = name
        self._compressor = compressor
        self._header = np.dtype(_ORDERS[order] + NUMBER_TYPES[header])
        self._order = _ORDERS[order]
        self._budget = _MAX_DECODED_BYTES

    def from_text(self, text: str, kind: str) -> np.ndarray[Any, Any]:
        """Return the numbers of an array that is written in digits."""
        dtype = np.dtype(NUMBER_TYPES[kind])
        if not text.strip():
            return np.empty(0, dtype)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # numpy only warns of what is no number
            values = np.fromstring(text, dtype, sep=" ")
        self._spend(values.nbytes)
        return values

    def from_base64(self, text: bytes, kind: str) -> np.ndarray[Any, Any]:
        """Return the numbers of an array in base64."""
        parts = _PART.findall(b"".join(text.split()))
        return self.from_bytes(b"".join(base64.b64decode(part) for part in parts), kind)

    def from_bytes(self, stream: bytes | memoryview, kind: str) -> np.ndarray[Any, Any]:
        """Return the numbers of an array that begins at the first byte of ``stream``."""
        payload = self._inflate(stream) if self._compressor else self._uncompressed(stream)
        dtype = np.dtype(self._order + NUMBER_TYPES[kind])
        whole = len(payload) // dtype.itemsize * dtype.itemsize
        return np.frombuffer(payload[:whole], dtype).astype(dtype.newbyteorder("="))

    def _sizes(self, stream: bytes | memoryview, first: int, count: int) -> list[int]:
        each = self._header.itemsize
        if len(stream) < (first + count) * each:
            raise self._damaged("an array ends inside its header")
        return [int(size) for size in np.frombuffer(stream, self._header, count, first * each)]

    def _uncompressed(self, stream: bytes | memoryview) -> bytes:
        """Return the payload; too short a one is found out when its numbers are counted."""
        (size,) = self._sizes(stream, 0, 1)
        begin = self._header.itemsize
        # GetFEM states a wrong size, larger than the array, which then ends with its text.
        end = min(begin + size, len(stream))
        self._spend(end - begin)
        return bytes(stream[begin:end])

    def _inflate(self, stream: bytes | memoryview) -> bytes:
        if self._compressor not in _COMPRESSORS:
            raise FormatError(
                f"{self.name} is compressed with {printable(self._compressor, 80)}, which is not "
                "read.",
                cure="Save it with ZLib compression or without any (in ParaView: the compressor "
                "type in the dialogue that saves the data).",
            )
        (blocks,) = self._sizes(stream, 0, 1)
        if blocks > len(stream):
            raise self._damaged(f"an array claims {blocks:,} compressed blocks")
        if not blocks:
            return b""
        full, last, *packed = self._sizes(stream, 1, 2 + blocks)
        begin = self._header.itemsize * (3 + blocks)
        found = []
        for i, size in enumerate(packed):
            expected = last if last and i == blocks - 1 else full
            self._spend(expected)
            found.append(self._inflate_block(bytes(stream[begin : begin + size]), expected))
            begin += size
        return b"".join(found)

    def _inflate_block(self, block: bytes, expected: int) -> bytes:
        """Inflate one block, and stop at the size that its header states."""
        try:
            if self._compressor == "vtkZLibDataCompressor":
                data = zlib.decompressobj().decompress(block, max(expected, 1))
            else:
                data = lzma.LZMADecompressor(memlimit=_LZMA_MEMORY).decompress(block, expected)
        except (zlib.error, lzma.LZMAError) as error:
            raise self._damaged(f"a compressed block cannot be read ({error})") from error
        if len(data) != expected:
            raise self._damaged(f"a block of {expected:,} bytes has only {len(data):,}")
        return data

    def _spend(self, size: int) -> None:
        self._budget -= size
        if self._budget < 0:
            raise UnsafeFileError(
                f"{self.name} claims more than {_MAX_DECODED_BYTES:,} bytes of numbers.",
                why="They are not read, however small the file is.",
                cure="Check that it is the right file; leave out the fields that are not needed.",
            )

    def _damaged(self, what: str) -> FormatError:
        return FormatError(
            f"{self.name} is damaged or incomplete: {what}.",
            cure="Get the file again from where it came from.",
        )
