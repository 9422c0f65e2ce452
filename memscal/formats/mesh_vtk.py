"""Legacy VTK files: what one may claim before meshio reads it."""

from __future__ import annotations

import re

import numpy as np

from memscal.errors import FormatError, UnsafeFileError

__all__ = ["checked_vtk"]

_SIGNATURE = b"# vtk DataFile Version"
_COUNTS = re.compile(
    rb"\b(POINTS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA)[ \t]+(\d+)(?:[ \t]+(\d+))?", re.IGNORECASE
)
# meshio makes text upper-case as Unicode does, where the long s (two bytes) becomes an S.
_DATASET = re.compile(rb"DATA(?:S|\xc5\xbf)ET([^\n]*)", re.IGNORECASE)
_STRUCTURED = re.compile(r"(?<!UN)STRUCTURED_|RECTILINEAR_")
_TYPES_WORD = re.compile(rb"CELL_TYPE(?:S|\xc5\xbf)", re.IGNORECASE)
_TYPES = re.compile(rb"CELL_TYPES[ \t]+(\d{1,18})[ \t\r]*\n", re.IGNORECASE)
# Cells of any number of nodes: polygons, polyhedra, and those of higher order.
_OF_ANY_SIZE = [7, 41, 42, *range(60, 82)]


def checked_vtk(data: bytes, name: str) -> bytes:
    """Return the bytes of a legacy VTK file that claims no more than it can hold.

    Only unstructured grids are read: a structured one is a few bytes that stand for any number
    of points.

    Raises
    ------
    FormatError, UnsafeFileError
        If it is no such file, or claims more points or cells than it has bytes.
    """
    if not data.startswith(_SIGNATURE):
        raise FormatError(
            f"{name} is not a legacy VTK file.",
            why=f"It does not begin with {_SIGNATURE.decode()!r}.",
            cure="Save the mesh again as .vtu or .vtk.",
        )
    _, _, body = data.partition(b"\n")
    _, _, body = body.partition(b"\n")  # the second line is a title
    for found in _DATASET.finditer(body):
        if _STRUCTURED.search(found[1].decode("utf-8", "replace").upper()):
            raise UnsafeFileError(
                f"{name} holds a structured grid.",
                why="A few bytes of it can stand for any number of points.",
                cure="Save it as an unstructured grid (.vtu).",
            )
    for found in _COUNTS.finditer(body):
        for count in found.groups()[1:]:
            if count and (len(count) > 18 or int(count) > len(data)):
                raise UnsafeFileError(
                    f"{name} claims {found[1].decode()} {count[:20].decode()}, but has "
                    f"{len(data):,} bytes.",
                    why="Memory would be taken for numbers that are not there.",
                    cure="Get the file again from where it came from.",
                )
    _require_known_sizes(body, name)
    return data


def _require_known_sizes(body: bytes, name: str) -> None:
    """Refuse cells whose numbers of nodes are stated one by one: meshio trusts what is stated."""
    found = _TYPES.search(body)
    if found is None or len(_TYPES_WORD.findall(body)) != 1:
        raise FormatError(
            f"{name} does not state the types of its cells once.",
            why="It is damaged or incomplete.",
            cure="Save the mesh again, as an unstructured grid (.vtu).",
        )
    count = int(found[1])
    if body.lstrip()[:5].upper() == b"ASCII":
        types = np.fromstring(body[found.end() :], dtype=np.int64, count=count, sep=" ")
    else:
        types = np.frombuffer(body, ">i4", count, found.end())
    strange = np.intersect1d(types, _OF_ANY_SIZE)
    if strange.size:
        raise FormatError(
            f"{name} has cells of the type {strange[0]}, whose number of nodes varies.",
            why="They are not read from legacy VTK files.",
            cure="Save the mesh as an unstructured grid (.vtu).",
        )
