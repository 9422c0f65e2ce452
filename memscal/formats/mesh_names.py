"""The names by which a mesh is told from a table, before anything is loaded to read it."""

from __future__ import annotations

import os

__all__ = ["MESH_ENDINGS", "is_mesh"]

MESH_ENDINGS = {".vtu": "vtu", ".vtk": "vtk", ".xdmf": "xdmf", ".xmf": "xdmf"}
"""Endings of the meshes that are read, and meshio's names of their formats."""

# Known as meshes of other kinds, so that none is taken for a table.
_OTHERS = {
    *(".pvtu", ".pvd", ".vtp", ".vts", ".vtr", ".vti", ".vtm", ".msh", ".med", ".inp", ".frd"),
    *(".exo", ".e", ".bdf", ".unv", ".odb", ".rst", ".mph", ".ply", ".stl", ".obj"),
}


def is_mesh(path: str | os.PathLike[str]) -> bool:
    """Return whether a file's name says that it is a mesh and not a table.

    Examples
    --------
    >>> is_mesh("film.vtu"), is_mesh("film.csv")
    (True, False)
    """
    ending = os.path.splitext(os.fspath(path))[1].lower()
    return ending in MESH_ENDINGS or ending in _OTHERS
