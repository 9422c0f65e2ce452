"""VTU made plain: the same mesh with nothing but uncompressed numbers beside their names.

What meshio is given is such a copy.  It inflates blocks without a limit, and refuses files as
VTK itself writes them today: with texts among the fields, or of version 2.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from memscal.errors import FormatError
from memscal.formats.mesh_arrays import NUMBER_TYPES, ArrayDecoder
from memscal.formats.mesh_xml import parse_xml
from memscal.formats.text import printable

__all__ = ["plain_vtu"]

_SECTIONS = ("Points", "Cells", "PointData", "CellData")
# Bytes that are no XML follow a raw section's first underscore.
_RAW = re.compile(rb"""<AppendedData[^>]*encoding\s*=\s*["']raw["'][^>]*>\s*_""")
_RAW_END = b"</AppendedData>"
# VTK's own limit is a hexahedron of order ten.
_MOST_NODES = 1331
_POLYHEDRA = (41, 42)


def plain_vtu(data: bytes, name: str) -> bytes:
    """Return a VTU file with all its numbers decoded, inline and uncompressed.

    Parameters
    ----------
    data : bytes
        A VTU file in any of VTK's encodings: ascii, binary, or appended as base64 or raw bytes.
    name : str
        Its name, for messages.

    Raises
    ------
    FormatError, UnsafeFileError
        If it is no such file, is damaged, or claims more than is read.
    """
    data, raw = _without_raw(data, name)
    root = parse_xml(data, name)
    if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
        raise FormatError(
            f"{name} is not a VTU file: it holds {printable(root.get('type', root.tag), 80)}.",
            cure="Save the mesh as an unstructured grid (.vtu) in one file.",
        )
    pieces = root.findall("UnstructuredGrid/Piece")
    if len(pieces) != 1:
        raise FormatError(
            f"{name} holds {len(pieces)} pieces.",
            why="Only a mesh in one piece is read.",
            cure="Merge them (in ParaView: the filter Merge Blocks) and save the mesh again.",
        )
    decoder = ArrayDecoder(
        name,
        order=root.get("byte_order", "LittleEndian"),
        header=root.get("header_type", "UInt32"),
        compressor=root.get("compressor", ""),
    )
    plain = Element("VTKFile", type="UnstructuredGrid", version="1.0", header_type="UInt64")
    piece = SubElement(SubElement(plain, "UnstructuredGrid"), "Piece", pieces[0].attrib)
    appended = _Appended(root.find("AppendedData"), raw)
    appended.find_starts(root.iter())
    for section in _SECTIONS:
        found = pieces[0].find(section)
        kept = SubElement(piece, section)
        arrays = {}
        for array in [] if found is None else found.findall("DataArray"):
            if array.get("type") in NUMBER_TYPES:
                arrays[array.get("Name", "")] = values = _numbers(array, decoder, appended)
                _add_plain(kept, array, values)
        if section == "Cells":
            _require_sound_cells(arrays, name)
    return tostring(plain)


class _Appended:
    """The section that holds the numbers of all arrays, one after the other."""

    def __init__(self, element: Element | None, raw: bytes | None) -> None:
        text = "" if element is None else (element.text or "").strip()
        self.raw = raw is not None
        self.data = memoryview(raw if raw is not None else text[1:].encode())
        self.starts: list[int] = []

    def find_starts(self, elements: Iterable[Element]) -> None:
        """Note where arrays begin, which is where those before them end."""
        offsets = (each.get("offset", "") for each in elements)
        self.starts = sorted({int(each) for each in offsets if each.strip().isdecimal()})

    def at(self, offset: int) -> memoryview:
        """Return the section from an offset to the beginning of the next array."""
        later = np.searchsorted(self.starts, offset, side="right")
        end = self.starts[later] if later < len(self.starts) else len(self.data)
        return self.data[offset:end]


def _without_raw(data: bytes, name: str) -> tuple[bytes, bytes | None]:
    """Cut raw bytes out of what is otherwise XML."""
    begin = _RAW.search(data)
    if begin is None:
        return data, None
    end = data.rfind(_RAW_END)
    if end < begin.end():
        raise FormatError(
            f"{name} ends inside its appended data.",
            why="The file is damaged or incomplete.",
            cure="Get the file again from where it came from.",
        )
    return data[: begin.end()] + data[end:], data[begin.end() : end]


def _numbers(array: Element, decoder: ArrayDecoder, appended: _Appended) -> np.ndarray[Any, Any]:
    """Return the numbers of an array, wherever and however they are kept."""
    kind, text = array.get("type", ""), array.text or ""
    how = array.get("format", "ascii")
    if how == "ascii":
        return decoder.from_text(text, kind)
    if how != "appended":
        return decoder.from_base64(text.encode(), kind)
    offset = array.get("offset", "").strip()
    place = appended.at(int(offset) if offset.isdecimal() else len(appended.data))
    if appended.raw:
        return decoder.from_bytes(place, kind)
    return decoder.from_base64(bytes(place), kind)


def _add_plain(section: Element, array: Element, values: np.ndarray[Any, Any]) -> None:
    """Add a copy of an array that needs neither decompression nor an appended section."""
    copy = SubElement(section, "DataArray", type=array.get("type", ""), format="binary")
    for key in ("Name", "NumberOfComponents"):
        if array.get(key):
            copy.set(key, array.get(key, ""))
    content = values.tobytes()
    copy.text = base64.b64encode(np.uint64(len(content)).tobytes() + content).decode()


def _require_sound_cells(arrays: dict[str, np.ndarray[Any, Any]], name: str) -> None:
    """Refuse cells with absurd numbers of nodes, for which meshio would take memory unasked."""
    offsets, types, nodes = (
        arrays.get(key, np.empty(0)).ravel() for key in ("offsets", "types", "connectivity")
    )
    sizes = np.diff(offsets.astype(np.int64), prepend=0)
    if sizes.size and not (
        {each.dtype.kind for each in (offsets, types, nodes)} <= {"i", "u"}
        and 1 <= sizes.min() <= sizes.max() <= _MOST_NODES
        and sizes.sum() <= nodes.size
    ):
        raise FormatError(
            f"{name} has cells whose numbers of nodes cannot be.",
            why="The file is damaged or incomplete.",
            cure="Get the file again from where it came from.",
        )
    if np.isin(types, _POLYHEDRA).any():
        raise FormatError(
            f"{name} has polyhedra for cells, which are not read.",
            cure="Cut them into tetrahedra (in ParaView: the filter Tetrahedralize).",
        )
