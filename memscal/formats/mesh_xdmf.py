"""XDMF made plain: the same mesh with all its numbers inline and no way to another file.

XDMF keeps its numbers in an HDF5 file, and names it; meshio would open whatever is named.  Here
one file is taken, of the same name and in the same folder, and read through the safe reader.
"""

from __future__ import annotations

import contextlib
import math
import os
from xml.etree.ElementTree import Element, SubElement, tostring

from memscal.errors import FormatError, UnsafeFileError
from memscal.formats.hdf5_reader import SafeFile, open_hdf5
from memscal.formats.mesh_xml import parse_xml
from memscal.formats.text import printable

__all__ = ["plain_xdmf"]

_HDF5_ENDINGS = (".h5", ".hdf5", ".hdf")
_MAX_SHOWN = 100
# Inline, a number takes some fifty bytes of memory for a while.
_MAX_NUMBERS = 2**23


def plain_xdmf(data: bytes, path: str) -> tuple[bytes, tuple[str, ...]]:
    """Return an XDMF file with all its numbers inline, and notes on where they came from.

    Parameters
    ----------
    data : bytes
        An XDMF file of version 2 or 3 with one grid.
    path : str
        Where it was read: its HDF5 file lies beside it.

    Raises
    ------
    FormatError
        If it is no such file, or is damaged.
    UnsafeFileError
        If it names a file other than the HDF5 file beside it.
    """
    name = os.path.basename(path)
    root = parse_xml(data, name)
    if root.tag != "Xdmf":
        raise FormatError(
            f"{name} is not an XDMF file: it holds {printable(root.tag, 80)!r}.",
            cure="Save the mesh again, or as an unstructured grid (.vtu).",
        )
    grid = _only_grid(root, name)
    plain = Element("Xdmf", Version=root.get("Version", "3.0"))
    kept = SubElement(SubElement(plain, "Domain"), "Grid", GridType="Uniform")
    with contextlib.ExitStack() as opened:
        numbers = _Numbers(path, opened)
        for part in grid:
            items = part.findall("DataItem")
            of_mesh = part.tag in ("Topology", "Geometry")
            if of_mesh or (part.tag == "Attribute" and _is_field(part, items)):
                copy = SubElement(kept, part.tag, part.attrib)
                if part.tag == "Attribute":
                    copy.set("Center", part.get("Center", "Node"))
                elif part.tag == "Geometry" and not {"Type", "GeometryType"} & set(part.attrib):
                    copy.set("GeometryType", "XYZ")
                for item in items:
                    numbers.add(copy, item)
        return tostring(plain), numbers.notes


def _only_grid(root: Element, name: str) -> Element:
    """Return the grid that holds the mesh, which may be the only one of a collection."""
    grids = [each for each in root.iter("Grid") if each.find("Topology") is not None]
    if len(grids) == 1 and len(list(root.iter("Grid"))) <= 2:
        return grids[0]
    raise FormatError(
        f"{name} holds {len(list(root.iter('Grid')))} grids, {len(grids)} of them with a mesh.",
        why="Only one mesh with its fields is read: no series in time, no parts.",
        cure="Save the time step that is wanted as an unstructured grid (.vtu).",
    )


def _is_field(part: Element, items: list[Element]) -> bool:
    """Leave out what is no field on the mesh, such as constants of the whole grid."""
    return (
        bool(part.get("Name"))
        and part.get("Center", "Node") in ("Node", "Cell")
        and (len(items) == 1)
    )


class _Numbers:
    """The numbers that data items hold, inline or in the HDF5 file beside the XDMF file."""

    def __init__(self, path: str, opened: contextlib.ExitStack) -> None:
        self._folder, self._name = os.path.split(path)
        self._opened = opened
        self._files: dict[str, SafeFile] = {}
        self._left = _MAX_NUMBERS

    @property
    def notes(self) -> tuple[str, ...]:
        """Name and checksum of each HDF5 file that was read."""
        return tuple(
            f"Its numbers are those of {each.source.file_name} (sha256 {each.source.sha256})."
            for each in self._files.values()
        )

    def add(self, owner: Element, item: Element) -> None:
        """Add a copy of a data item that holds its numbers itself."""
        how = item.get("Format", "XML")
        if "Reference" in item.attrib or len(item) or item.get("ItemType", "Uniform") != "Uniform":
            raise FormatError(
                f"{self._name} has a data item that is calculated from others, or points to them.",
                cure="Save the mesh as an unstructured grid (.vtu), or with plain data items.",
            )
        copy = SubElement(owner, "DataItem", {**item.attrib, "Format": "XML"})
        text = (item.text or "").strip()
        if how == "HDF":
            self._fill(copy, text)
        elif how == "XML":
            self._require_as_many_as_claimed(item, text)
            copy.text = text + " "
        else:
            raise UnsafeFileError(
                f"{self._name} keeps numbers in another file in the format {printable(how, 20)!r}.",
                why="Any file could be read through it.",
                cure="Save the mesh with its numbers in HDF5 or inline, or as .vtu.",
            )

    def _fill(self, copy: Element, address: str) -> None:
        """Put the numbers of a dataset, such as ``mesh.h5:/data0``, into a data item."""
        file_name, _, inside = address.partition(":")
        values = self._file(file_name).array("/" + inside.strip().strip("/"))
        self._left -= values.size
        if self._left < 0:
            raise UnsafeFileError(
                f"{self._name} has more than {_MAX_NUMBERS:,} numbers, which are not read.",
                cure="Leave out the fields that are not needed, or save the mesh as .vtu.",
            )
        whole = values.dtype.kind == "i"
        for key in ("NumberType", "DataType"):
            copy.attrib.pop(key, None)
        copy.set("NumberType", "Int" if whole else "Float")
        copy.set("Precision", "8")
        copy.set("Dimensions", " ".join(str(n) for n in values.shape))
        copy.text = " ".join(map(repr, values.ravel().tolist())) + " "

    def _file(self, file_name: str) -> SafeFile:
        if file_name not in self._files:
            stem, ending = os.path.splitext(file_name)
            if stem != os.path.splitext(self._name)[0] or ending.lower() not in _HDF5_ENDINGS:
                raise UnsafeFileError(
                    f"{self._name} takes its numbers from "
                    f"{printable(file_name, _MAX_SHOWN)!r}, which is not read.",
                    why="Any file could be read through it: only the HDF5 file of the same name "
                    "in the same folder is.",
                    cure=f"Name it {os.path.splitext(self._name)[0]}.h5, here and in the XDMF "
                    "file, or save the mesh as .vtu.",
                )
            path = os.path.join(self._folder, file_name)
            self._files[file_name] = self._opened.enter_context(open_hdf5(path))
        return self._files[file_name]

    def _require_as_many_as_claimed(self, item: Element, text: str) -> None:
        sizes = item.get("Dimensions", "").split()
        if not sizes or not all(each.isdecimal() and len(each) < 20 for each in sizes):
            raise FormatError(
                f"{self._name} has a data item without dimensions.",
                cure="Save the mesh again, or as an unstructured grid (.vtu).",
            )
        claimed = math.prod(int(each) for each in sizes)
        if claimed > len(text):
            raise UnsafeFileError(
                f"{self._name} claims {claimed:,} numbers where there are {len(text):,} bytes.",
                why="Memory would be taken for numbers that are not there.",
                cure="Get the file again from where it came from.",
            )
