"""Triangles in the film's cross-section: fitted to the rings, coarser away from the contact.

From the surface, rows of nodes go down to the base.  A row keeps the radii of the row above and
drops every second node where the triangles may be wider there, so that their number hardly
depends on how fine the rings are.  Where the surface is finer, a row goes down in smaller steps,
and there are more of them.
"""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from memscal.model.arrays import ArrayFunction, BoolArray, FloatArray, IndexArray, array_record

# One side of a triangle spans two intervals between rings.  A quartic has four, but with two the
# shear of a sticking contact needs a quarter of the rings, for 1.4 times the time.
# It spans one at the last rings, so many of them, where a rod's pressure is singular, ...
_AT_THE_EDGE = 4
# ... and at an edge within the rings, where they are closer than this share of the outermost gap:
# the shear of a contact that sticks at once is singular there.
_NARROW = 0.25
# Two are joined where the wider one is at most so many times the narrower one.
_UNEVEN = 2.1
# Widest side at distances from the contact, all in film thicknesses: the field decays ...
_DISTANCES = (1.0, 5.0, 9.0)
_WIDEST = (0.25, 0.6, 1.5)
# ... and beyond, a side may grow by this share of the distance.
_WIDENING = 0.3
# Growth of a side from one to the next along the surface, and with depth.
_GROWTH = 0.6
_SLOPE = 1.0
# A node goes down with the row if no other would come less deep by this share of its step.
_TOGETHER = 0.8
# A step down is no longer, and ...
_TALLEST = 0.5
# ... so many steps from the base, a node goes on in even steps.
_EVEN_STEPS = 3
# A dropped node stays at least this share of the bridging side above it.
_ROOM = 0.2


@array_record
class TriangleMesh:
    """Nodes (radius and depth, shape (n, 2)) and the corners of triangles (shape (m, 3))."""

    points: FloatArray
    triangles: IndexArray


def film_triangles(rings: FloatArray, *, radius: float) -> TriangleMesh:
    """Return a mesh from the axis to the free edge; all lengths in thicknesses of the film."""
    widest = partial(_widest, rings[-1])
    # Corners of triangles on the surface: some of the rings, and others beyond.
    inside = _fitted(rings)
    beyond = graded(rings[-1], radius, rings[-1] - inside[-2], 1 + _GROWTH, widest)
    front = _Front(np.append(inside, beyond[1:]), widest)
    while np.any(front.depth < 1.0):
        front.advance()
    return TriangleMesh(np.array(front.points), np.array(front.triangles, np.int64))


def _widest(contact: float, r: Any) -> Any:
    """Return the longest side of a triangle that is allowed at ``r``."""
    away = r - contact
    return np.interp(away, _DISTANCES, _WIDEST) + _WIDENING * np.maximum(away - _DISTANCES[-1], 0.0)


def graded(
    begin: float, end: float, step: float, growth: float, widest: Callable[[float], Any]
) -> FloatArray:
    """Return nodes whose distances grow from a step by a factor, up to the widest at each."""
    nodes = [begin]
    while nodes[-1] < end:
        step = min(step * growth, widest(nodes[-1]))
        nodes.append(end if end - nodes[-1] < 1.5 * step else nodes[-1] + step)
    return np.array(nodes)


def _fitted(rings: FloatArray) -> FloatArray:
    """Return corners from the axis to the last ring, from that ring inward."""
    gaps = np.diff(rings)
    corners = [rings[-1]]
    last = gaps.size
    while last > 0:
        single = gaps.size - last < _AT_THE_EDGE or gaps[last - 1] < _NARROW * gaps[-1]
        first = last - 1
        longest = _widest(rings[-1], rings[last])
        if first > 0 and not single:
            group = gaps[first - 1 : last]
            if group.sum() <= longest and group.max() <= _UNEVEN * group.min():
                first -= 1
        pieces = int(np.ceil(gaps[first:last].sum() / longest))
        corners.extend(np.linspace(rings[last], rings[first], pieces + 1)[1:])
        last = first
    return np.array(corners[::-1])


class _Front:
    """The lowest row of nodes so far, as it advances to the base."""

    def __init__(self, r: FloatArray, widest: ArrayFunction) -> None:
        self.widest = widest
        self.r = r
        self.depth = np.zeros_like(r)
        self.node = np.arange(r.size)
        self.points: list[tuple[float, float]] = [(radius, 0.0) for radius in r]
        self.triangles: list[tuple[int, int, int]] = []

    def advance(self) -> None:
        """Go down where that leads least deep, and fill what lies between with triangles."""
        above = self.depth < 1.0
        ahead = np.where(above, self._next_depths(), 1.0)
        reach = (ahead + _TOGETHER * (ahead - self.depth))[above].min()
        moving = above & (ahead <= reach)
        lower = np.where(moving, ahead, self.depth)
        kept = self._kept(moving, lower)
        node = self.node.copy()
        for i in np.flatnonzero(moving & kept):
            node[i] = len(self.points)
            self.points.append((self.r[i], lower[i]))
        self._fill(node, np.flatnonzero(kept))
        self.r = self.r[kept]
        self.depth = lower[kept]
        self.node = node[kept]

    def _next_depths(self) -> FloatArray:
        """Return the depth to which each node would go; the last steps to the base are even."""
        sides = np.pad((self.r[2:] - self.r[:-2]) / 2, 1, mode="edge")
        left = 1.0 - self.depth
        step = np.minimum(sides, np.minimum(self.widest(self.r), _TALLEST))
        count = np.round(np.maximum(left / step, 1.0))
        depth = self.depth + np.where(count <= _EVEN_STEPS, left / count, step)
        return np.where(count == 1, 1.0, depth)

    def _kept(self, moving: BoolArray, lower: FloatArray) -> BoolArray:
        """Return which nodes the next row has: never do two neighbours drop out."""
        r = self.r
        width = np.pad(r[2:] - r[:-2], 1)
        longest = np.minimum(_SLOPE * lower, 1.001 * self.widest(r))
        # The side that bridges a dropped node must pass well below it.
        share = (r[1:-1] - r[:-2]) / np.maximum(width[1:-1], r[-1] * 1e-300)
        room = np.pad((1 - share) * lower[:-2] + share * lower[2:] - self.depth[1:-1], 1)
        droppable = moving & (width > 0) & (width <= longest) & (room >= _ROOM * width)
        kept = np.ones(r.size, bool)
        for i in np.flatnonzero(droppable):
            kept[i] = not kept[i - 1]
        return kept

    def _fill(self, node: IndexArray, kept: IndexArray) -> None:
        """Add the triangles between this row and the next."""
        for left, right in pairwise(kept):
            a = self.node[left]
            b = self.node[right]
            a_below = node[left]
            b_below = node[right]
            if right - left == 2:
                middle = self.node[left + 1]
                corners = [(a, a_below, middle), (a_below, b_below, middle), (middle, b_below, b)]
            elif self._length(a, b_below) <= self._length(a_below, b):
                corners = [(a, a_below, b_below), (a, b_below, b)]
            else:
                corners = [(a, a_below, b), (a_below, b_below, b)]
            self.triangles.extend(triangle for triangle in corners if len(set(triangle)) == 3)

    def _length(self, start: int, end: int) -> float:
        return float(np.hypot(*np.subtract(self.points[start], self.points[end])))
