"""Base of the film in a mesh: its axes, nodes and cells, and means over circles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.formats.meshes.mesh_files import Cells, Mesh
from memscal.model.arrays import FloatArray
from memscal.model.checks import Message, import_notes

AXES = "xyz"
# Of the largest coordinate: meshes are often stored in single precision.
_TOLERANCE = 1e-6
_FEWEST = 4
_CIRCLES = 501
_DIRECTIONS = 72


@dataclass(frozen=True, eq=False)
class Frame:
    """How a mesh lies in space: ``points`` (n, 3) and ``tolerance`` in m, and its axes."""

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
    """Nodes on the base, cells with a side there and that side's middle; 1 or -1 is outward."""

    nodes: NDArray[np.int64]
    cells: tuple[tuple[Cells, NDArray[np.int64], FloatArray], ...]
    outward: int
    notes: tuple[str, ...]


def find_frame(mesh: Mesh, points: FloatArray, vertical: str | None) -> Frame:
    """Find which coordinates are radial and which is vertical; ``points`` (n, 3) are in m."""
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
            f"{' and '.join(AXES[i] for i in varying)}.",
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
    """Find what lies on the base, at a level of the vertical axis in m: by default the lowest."""
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
    base_nodes = np.unique(np.concatenate(nodes))
    level_text = f"{AXES[frame.vertical]} = {position * 1e3:.6g} mm"
    if base_nodes.size < _FEWEST:
        nearest = float(heights[np.argmin(np.abs(heights - position))])
        raise InputError(
            f"Only {base_nodes.size} nodes of the film in {mesh.source.file_name} lie on its base, "
            f"at {level_text}.",
            why=f"The mesh reaches from {AXES[frame.vertical]} = {lowest * 1e3:.6g} mm to "
            f"{highest * 1e3:.6g} mm, and its nearest node is at {nearest * 1e3:.6g} mm.",
            cure="Name the axis across the film (vertical; --vertical) or the position of the "
            "flat base on it (base; --base).",
        )
    which = ", its lowest level" if level is None else ""
    note = f"The base was taken at {level_text}{which}: {base_nodes.size} nodes."
    return Base(base_nodes, tuple(sides), outward, (note,))


def average_over_circles(
    places: FloatArray, columns: dict[str, FloatArray]
) -> tuple[dict[str, FloatArray], str]:
    """Interpolate between places (n, 2), in m from the axis, and average over circles.

    Circles of which less than half as much is inside as of others are left out: the corners.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    reach = float(np.hypot(*places.T).max()) or 1.0
    r = np.linspace(0.0, reach, _CIRCLES)
    # On the axis and along an edge of the mesh, rounding decides what is inside.
    directions = 2 * np.pi * (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    circles = np.maximum(r, 1e-6 * reach)[:, None]
    points = np.stack([circles * np.cos(directions), circles * np.sin(directions)], axis=-1)
    distinct, index = np.unique(np.round(places / reach, 7), axis=0, return_inverse=True)
    number = np.bincount(index.ravel())
    try:
        nodes = {name: np.bincount(index.ravel(), v) / number for name, v in columns.items()}
        fields = {n: LinearNDInterpolator(distinct * reach, v)(points) for n, v in nodes.items()}
    except QhullError as error:
        raise InputError(
            "The nodes on the base of the film lie on one line.",
            cure="Name the axis across the film (vertical; --vertical).",
        ) from error
    inside = np.isfinite(next(iter(fields.values())))
    share = inside.sum(axis=1)
    kept = share >= max(1, share.max() / 2)
    means = {name: np.nansum(values[kept], axis=1) / share[kept] for name, values in fields.items()}
    first = next(iter(columns))
    spread = np.nanmax(np.abs(fields[first][kept] - means[first][:, None]))
    peak = float(np.abs(means[first]).max())
    note = (
        f"Means over {kept.sum()} circles about the axis, interpolated linearly between "
        f"{distinct.shape[0]} places in the base; on a circle the normal stress differs from its "
        f"mean by up to {spread / peak if peak else 0:.2g} of the maximum."
    )
    return {"r": r[kept], **means}, note
