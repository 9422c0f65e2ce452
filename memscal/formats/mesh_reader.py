"""Meshes with fields from other programs, through meshio, which sees a checked copy only.

A mesh can come from anywhere.  Its bytes are read once and hashed, and meshio is given a copy
that was checked and made plain (:mod:`memscal.formats.mesh_vtu`,
:mod:`memscal.formats.mesh_xdmf`, :mod:`memscal.formats.mesh_vtk`): it never sees the file, nor
any other.  What it prints becomes a note, and what it raises a
:class:`~memscal.errors.FormatError`.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import tempfile
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.errors import FormatError, InputError
from memscal.formats.damage import damage_named
from memscal.formats.file_bytes import read_bytes
from memscal.formats.mesh_names import MESH_ENDINGS
from memscal.formats.mesh_vtk import checked_vtk
from memscal.formats.mesh_vtu import plain_vtu
from memscal.formats.mesh_xdmf import plain_xdmf
from memscal.formats.text import printable
from memscal.model.provenance import SourceFile
from memscal.model.validation import FloatArray

__all__ = ["Cells", "Mesh", "load_meshio", "read_mesh"]

_UNREAD = "It is damaged or incomplete, or written in a way that is not read"
_AS_VTU = "Open it in ParaView and save it as an unstructured grid (.vtu), or get it again."
_MAX_NAME = 80
_MAX_SAID = 300


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one kind: their nodes, by rows, and the fields given for each of them."""

    dimension: int
    nodes: NDArray[np.int64]
    data: dict[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh and its fields, as they stand in a file.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Coordinates, in the file's unit.
    cells : tuple of Cells
        Blocks of cells of one kind.
    point_data : dict of str to ndarray, shape (n, components)
        Fields at the points.
    source : SourceFile
        The file.
    notes : tuple of str
        What was met on the way.
    tensor_order : bool
        Whether six components are known to be a tensor's in VTK's order.
    """

    points: FloatArray
    cells: tuple[Cells, ...]
    point_data: dict[str, FloatArray]
    source: SourceFile
    notes: tuple[str, ...]
    tensor_order: bool

    @property
    def solid(self) -> tuple[Cells, ...]:
        """The cells of the highest dimension, which are the body and not its faces or edges."""
        highest = max((each.dimension for each in self.cells), default=0)
        return tuple(each for each in self.cells if each.dimension == highest)

    @property
    def used(self) -> NDArray[np.int64]:
        """The nodes that belong to the body."""
        return np.unique(np.concatenate([each.nodes.ravel() for each in self.solid]))

    @property
    def size(self) -> str:
        """Numbers of nodes and cells, in words."""
        return f"{len(self.points)} nodes, {sum(len(each.nodes) for each in self.solid)} cells"


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Read a mesh and its fields from a VTU, legacy VTK or XDMF file.

    Parameters
    ----------
    path : path
        The file; an XDMF file's numbers may be in the HDF5 file of the same name beside it.

    Raises
    ------
    InputError
        If meshio is not installed, or the file cannot be read.
    FormatError, UnsafeFileError
        If it is no such mesh, is damaged, or could read or exhaust something.
    """
    shown = os.fspath(path)
    name, ending = os.path.basename(shown), os.path.splitext(shown)[1].lower()
    if ending not in MESH_ENDINGS:
        raise FormatError(
            f"{name} is not a mesh of a kind that is read.",
            why="Meshes are read from VTU (.vtu), legacy VTK (.vtk) and XDMF (.xdmf) files.",
            cure="Save it as .vtu from the program that wrote it or from ParaView, or export the "
            "stress at the base as a table (CSV).",
        )
    meshio = load_meshio()
    data = read_bytes(shown)
    if not data:
        raise FormatError(f"{name} is empty.", cure="Save the mesh again.")
    kind = MESH_ENDINGS[ending]
    notes: tuple[str, ...] = ()
    with damage_named(f"{name} cannot be read as a mesh", why=_UNREAD, cure=_AS_VTU):
        if kind == "xdmf":
            plain, notes = plain_xdmf(data, shown)
        else:
            plain = {"vtu": plain_vtu, "vtk": checked_vtk}[kind](data, name)
        found, said = _through_meshio(meshio, kind, plain)
        source = SourceFile(name, hashlib.sha256(data).hexdigest())
        return _checked(found, source, notes + said, kind)


def load_meshio() -> Any:
    """Return meshio.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        import meshio
    except ImportError as error:
        raise InputError(
            "Meshes are read and written with meshio, which is not installed.",
            cure='Install it with: pip install "memscal[fem-io]"',
        ) from error
    return meshio


def _through_meshio(meshio: Any, kind: str, plain: bytes) -> tuple[Any, tuple[str, ...]]:
    """Return what meshio makes of a plain copy, and what it says about it."""
    # Not meshio.read: on an unreadable file it prints and ends the program.
    reader = {"vtu": meshio.vtu, "vtk": meshio.vtk, "xdmf": meshio.xdmf}[kind].read
    said = io.StringIO()
    with tempfile.TemporaryDirectory(prefix="memscal-") as folder:
        copy = os.path.join(folder, f"plain.{kind}")
        with open(copy, "wb") as file:
            file.write(plain)
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
        ):
            warnings.simplefilter("ignore")
            # numpy's word for text that is no number, which must not pass for one.
            warnings.filterwarnings("error", message="string or file could not be read")
            try:
                found = reader(copy)
            except SystemExit as error:
                raise ValueError(said.getvalue()) from error
    words = printable(" ".join(said.getvalue().split()), _MAX_SAID)
    return found, ((f"meshio says: {words}",) if words else ())


def _checked(found: Any, source: SourceFile, notes: tuple[str, ...], kind: str) -> Mesh:
    """Return what meshio found, if it is a mesh that can be worked with."""
    points = np.asarray(found.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise _unusable(source, f"points of shape {points.shape}")
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    if not np.all(np.isfinite(points)):
        raise _unusable(source, "a point whose coordinates are not finite")
    blocks = []
    for i, block in enumerate(found.cells):
        nodes = np.asarray(block.data, dtype=np.int64)
        if nodes.size and not 0 <= nodes.min() <= nodes.max() < len(points):
            raise _unusable(source, "a cell with a node that is not there")
        fields = {name: parts[i] for name, parts in found.cell_data.items()}
        blocks.append(Cells(int(block.dim), nodes, _fields(fields, len(nodes))))
    blocks = [block for block in blocks if len(block.nodes)]
    if not blocks:
        raise _unusable(source, "no cells")
    return Mesh(
        points=points,
        cells=tuple(blocks),
        point_data=_fields(found.point_data, len(points)),
        source=source,
        notes=notes,
        tensor_order=kind != "xdmf",
    )


def _fields(fields: dict[str, Any], count: int) -> dict[str, FloatArray]:
    """Return fields of numbers with one row each; a name is stripped of what does not print."""
    kept = {}
    for name, values in fields.items():
        numbers = np.asarray(values)
        if numbers.dtype.kind in "iuf" and numbers.shape[:1] == (count,) and numbers.size:
            kept[printable(name, _MAX_NAME)] = numbers.reshape(count, -1).astype(np.float64)
    return kept


def _unusable(source: SourceFile, what: str) -> FormatError:
    return FormatError(
        f"{source.file_name} has {what}.",
        why="A stress at the base cannot be found in it.",
        cure="Save the mesh again, as an unstructured grid (.vtu).",
    )
