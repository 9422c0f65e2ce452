"""Legacy VTK files: what one may claim before meshio reads it."""

from __future__ import annotations

import re

from memscal.errors import FormatError, UnsafeFileError

__all__ = ["checked_vtk"]

_SIGNATURE = b"# vtk DataFile Version"
_COUNTS = re.compile(
    rb"\b(POINTS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA)[ \t]+(\d+)(?:[ \t]+(\d+))?", re.IGNORECASE
)
# meshio makes text upper-case as Unicode does, where the long s becomes an S.
_DATASET = re.compile(rb"DATA(?:S|\xc5\xbf)ET\s+(\S+)", re.IGNORECASE)
_STRUCTURED = {"STRUCTURED_POINTS", "STRUCTURED_GRID", "RECTILINEAR_GRID"}


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
        if found[1].decode("utf-8", "replace").upper() in _STRUCTURED:
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
    return data
