"""The base of the film in a mesh: which way is up, where the base is, and what lies on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.formats.mesh_reader import Cells, Mesh
from memscal.model.checks import Message, import_notes
from memscal.model.validation import FloatArray

__all__ = ["AXES", "Base", "Frame", "find_base", "find_frame"]

AXES = "xyz"
# Of the largest coordinate: meshes are often stored in single precision.
_TOLERANCE = 1e-6
_FEWEST = 4


@dataclass(frozen=True, eq=False)
class Frame:
    """How a mesh lies in space.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Coordinates, in m.
    radial : tuple of int
        The axis along the radius of a section; both axes of the base's plane in 3-D.
    vertical : int
        The axis across the film.
    tolerance : float
        Distance within which coordinates are the same, in m.
    notes : tuple of Message
        What was taken.
    """

    points: FloatArray
    radial: tuple[int, ...]
    vertical: int
    tolerance: float
    notes: tuple[Message, ...]

    @property
    def height(self) -> FloatArray:
        """Coordinate across the film, in m."""
        return np.asarray(self.points[:, self.vertical])


@dataclass(frozen=True, eq=False)
class Base:
    """What lies on the base of the film.

    Parameters
    ----------
    nodes : ndarray of int
        Nodes on the base that belong to the film.
    cells : tuple of (Cells, ndarray of int, ndarray)
        For each block of cells: those with a side on the base, and the middles of these sides.
    outward : {1, -1}
        Direction of the vertical axis out of the film, through its base.
    notes : tuple of str
        What was taken.
    """

    nodes: NDArray[np.int64]
    cells: tuple[tuple[Cells, NDArray[np.int64], FloatArray], ...]
    outward: int
    notes: tuple[str, ...]


def find_frame(mesh: Mesh, points: FloatArray, vertical: str | None) -> Frame:
    """Find out which coordinates are radial and which is vertical.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    points : ndarray, shape (n, 3)
        Its points, in m.
    vertical : {"x", "y", "z"}, optional
        The axis across the film; by default the second of a section's two, and z in 3-D.

    Raises
    ------
    InputError
        If the mesh is a line, or has no extent along the axis that is asked for.
    """
    name = mesh.source.file_name
    inside = points[mesh.used]
    tolerance = _TOLERANCE * float(np.abs(inside).max())
    varying = [i for i in range(3) if np.ptp(inside[:, i]) > tolerance]
    if len(varying) < 2:
        raise InputError(
            f"{name} holds a mesh that is a line or a point.",
            cure="Give a section of the film from the axis outward, or the film in 3-D.",
        )
    up = varying[-1] if vertical is None else [*AXES, vertical].index(vertical)
    if up not in varying:
        raise InputError(
            f"The vertical axis is {vertical!r}, but the mesh in {name} extends along "
            f"{_listed(varying)}.",
            cure="Name the axis that points across the film, from base to surface.",
        )
    radial = tuple(i for i in varying if i != up)
    across = f"{AXES[up]} across the film"
    if len(radial) > 1:
        text = f"The mesh is a body in 3-D: {across} was taken, and its base in the other two."
    else:
        text = f"The mesh is a section: {AXES[radial[0]]} as the radius and {across} were taken."
    notes = import_notes([text])
    wide, high = (float(np.ptp(inside[:, i])) * 1e3 for i in (radial[0], up))
    if high > wide:
        text = (
            f"the mesh extends {high:.4g} mm along {AXES[up]} but {wide:.4g} mm along "
            f"{AXES[radial[0]]}. A film is wider than thick: if the axis across it is "
            f"{AXES[radial[0]]}, say so (vertical; --vertical)."
        )
        notes.append(Message("vertical_axis", text, "warning"))
    return Frame(points, radial, up, tolerance, tuple(notes))


def find_base(mesh: Mesh, frame: Frame, level: float | None) -> Base:
    """Find what lies on the base of the film.

    Parameters
    ----------
    mesh, frame : Mesh, Frame
        The mesh and how it lies.
    level : float, optional
        Position of the base along the vertical axis, in m; the lowest by default.

    Raises
    ------
    InputError
        If there are too few nodes at that level.
    """
    heights = frame.height[mesh.used]
    lowest, highest = float(heights.min()), float(heights.max())
    position = lowest if level is None else level
    # Only where nothing lies above it is the base the upper face of the film.
    outward = 1 if position >= highest - frame.tolerance else -1
    on_base = np.abs(frame.height - position) <= frame.tolerance
    sides, nodes = [], []
    for block in mesh.solid:
        touching = on_base[block.nodes]
        middle = frame.height[block.nodes].mean(axis=1)
        # An indenter or a substrate may be in the mesh too, on the other side of the base.
        film = touching.any(axis=1) & (outward * (middle - position) < 0)
        nodes.append(block.nodes[film][touching[film]])
        of_side = np.flatnonzero(film & (touching.sum(axis=1) > len(frame.radial)))
        weight = touching[of_side][..., None]
        corners = frame.points[block.nodes[of_side]]
        sides.append((block, of_side, (weight * corners).sum(axis=1) / weight.sum(axis=1)))
    found = np.unique(np.concatenate(nodes))
    what = f"{AXES[frame.vertical]} = {position * 1e3:.6g} mm"
    if found.size < _FEWEST:
        nearest = float(heights[np.argmin(np.abs(heights - position))])
        raise InputError(
            f"Only {found.size} nodes of the film in {mesh.source.file_name} lie on its base, at "
            f"{what}.",
            why=f"The mesh reaches from {AXES[frame.vertical]} = {lowest * 1e3:.6g} mm to "
            f"{highest * 1e3:.6g} mm, and its nearest node is at {nearest * 1e3:.6g} mm.",
            cure="Name the axis across the film (vertical; --vertical) or the position of the "
            "flat base on it (base; --base).",
        )
    which = ", its lowest level" if level is None else ""
    note = f"The base was taken at {what}{which}: {found.size} nodes."
    return Base(found, tuple(sides), outward, (note,))


def _listed(axes: list[int] | tuple[int, ...]) -> str:
    return " and ".join(AXES[i] for i in axes)
