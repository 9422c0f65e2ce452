r"""Contact of the film at finite strain with a rigid face: exact constraints, Newton's method.

A node of the surface that touches lies on the indenter's contour *where it has moved to*,
:math:`R + u_r = r(s),\ u_z = z(s) - \delta`: the arc length s is its only unknown, or stays what
it was at first touch where the contact sticks.  Its displacements are eliminated with first and
second derivatives, so that the forces are normal to the face where it slides.  The depth
:math:`\delta` is one more unknown, whose force is the load.  Which nodes touch is found by an
active set: a node that is pulled leaves, and one that lies inside the indenter is taken in.
"""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from memscal.axisymmetry.hankel import gauss_between
from memscal.errors import ConvergenceError
from memscal.extensions.finite_strain.film_elements import FilmElements
from memscal.mechanics.solver.step import Load, Target, reached
from memscal.model.arrays import (
    ArrayPair,
    ArrayTriple,
    FloatArray,
    IndexArray,
    array_record,
    value_record,
)


@value_record
class Face:
    """A rod (radii in mm): its end, its rounded edge, and the wall that the film drapes against.

    A sphere is a rod that is all rounding.
    """

    radius: float
    edge: float

    @property
    def flat(self) -> float:
        """Radius of the flat part of the end: the contour is straight up to there."""
        return self.radius - self.edge

    def contour(self, s: FloatArray) -> ArrayTriple:
        """Return points, tangents and curvature vectors at ``s`` (mm), shapes (2, n)."""
        angle = np.clip((s - self.flat) / self.edge, 0.0, np.pi / 2)
        sine = np.sin(angle)
        cosine = np.cos(angle)
        wall = np.maximum(s - self.flat - np.pi / 2 * self.edge, 0.0)
        rise = 2 * self.edge * np.sin(angle / 2) ** 2
        points = np.stack([np.minimum(s, self.flat) + self.edge * sine, rise + wall])
        bend = np.where((angle > 0) & (angle < np.pi / 2), 1 / self.edge, 0.0)
        return points, np.stack([cosine, sine]), np.stack([-sine * bend, cosine * bend])

    def nearest(self, r: FloatArray, z: FloatArray) -> ArrayPair:
        """Return the arc length of the nearest point, and the distance outside it."""
        x = r - self.flat
        y = self.edge - z  # outward and downward from the rounding's centre
        wall = np.where((x <= 0) & (y <= 0), x > y, x > 0)
        s = np.where(wall, self.flat + np.pi / 2 * self.edge - y, r)
        turning = (x > 0) & (y > 0)
        s = np.where(turning, self.flat + self.edge * np.arctan2(x, y), s)
        return s, np.where(turning, np.hypot(x, y), np.where(wall, x, y)) - self.edge


# Newton's method has converged when the last step moved nothing by more than this share of the
# film's thickness; what is left is less by a tenth or, with new factors, the square of it.
_SETTLED = 1e-10
# The contact's edge is looked at again when the last step was shorter than this.
_LOOSE = 1e-3
# Near the end the factors are kept while each step is this much shorter than the one before.
_KEPT = 0.1
_MOST_ITERATIONS = 30
# A step or a guess that changes a point's volume by such factors is shortened to the first of these
# shares that does not.  One that moves nothing by more than so many thicknesses is harmless.
_CRUSHED = 0.1
_SWOLLEN = 4.0
_HARMLESS = 1e-5
_SHARES = 0.5 ** np.arange(6)
# A Newton step that moves something farther than so many thicknesses has diverged.
_FARTHEST = 3.0
# A node must lie this deep inside the indenter, in film thicknesses, to be taken in.
_INSIDE = 1e-10


class NewtonError(ConvergenceError):
    """Newton's method found no equilibrium from where it started: load in smaller steps."""


@array_record
class Pressed:
    """A film under an indenter."""

    x: FloatArray  # the unknowns of FilmElements
    depth: float  # mm
    touching: IndexArray  # nodes, from the axis outward
    place: FloatArray  # their places on the contour, in mm of arc length
    load: float = 0.0  # N


@array_record
class _Tangent:
    """The forces' change with what is free and with the depth, at a state."""

    factors: Any
    pushed: FloatArray  # forces on what is free, per depth
    along: FloatArray  # change of what is free, per depth
    stiffness: float  # load per depth


@array_record
class Pressing:
    """A film, an indenter, and whether the surface sticks to it."""

    elements: FilmElements
    face: Face
    sticking: bool
    # Whether a node sticks at its undeformed radius, and not where it came to touch the face.
    upright: bool = False

    def press(self, start: Pressed, goal: Target, before: Pressed) -> Pressed:
        """Return the equilibrium at a goal, from a state near it and the last; or NewtonError."""
        elements = self.elements
        seen = set[bytes]()
        state = self.placed(self._touching(start, before, set()) or start)
        forces = elements.forces(state.x)
        tangent = None
        last = np.inf
        for _ in range(_MOST_ITERATIONS):
            state, moved, tangent = self._step(state, forces, goal, tangent)
            if not moved < _FARTHEST * elements.thickness:
                break
            forces = elements.forces(state.x)
            near = moved < _KEPT * last
            last = moved
            if tangent is None or moved > _LOOSE * elements.thickness:
                tangent = None
                continue
            changed = self._touching(state, before, seen, forces)
            if changed is not None:
                state = self.placed(changed)
                tangent = None
                forces = elements.forces(state.x)
            elif moved < _SETTLED * elements.thickness:
                if elements.is_inside_out(state.x):
                    break
                return replace(state, load=-float(np.sum(forces[state.touching + elements.n])))
            elif not near:
                tangent = None
        raise NewtonError(f"No equilibrium was found near a depth of {state.depth:.4g} mm.")

    def interpolated(self, contact: Any) -> Pressed:
        """Return a guess at the state of a contact that was found on another mesh."""
        elements = self.elements
        pressed = contact.inside.pressed
        mesh = contact.inside.pressing.elements
        # A node touches between two that did.
        touched = np.isin(mesh.surface, pressed.touching)
        r = elements.nodes[0][elements.surface]
        before = mesh.nodes[0][mesh.surface]
        touching = elements.surface[np.interp(r, before, touched) > 1 - 1e-9]
        x = elements.interpolated(pressed.x, mesh)
        return self.at_nearest(replace(pressed, x=x, touching=touching))

    def at_nearest(self, state: Pressed) -> Pressed:
        """Return the state with its touching nodes' places where they are nearest to the face."""
        touches = np.isin(self.elements.surface, state.touching)
        return replace(state, place=self.nearest(state)[0][touches])

    def is_sound(self, state: Pressed, before: Pressed) -> bool:
        """Whether no point's volume has changed by so much that Newton's method would go astray."""
        now, last = (self.elements.volume_ratio(s.x) for s in (state, before))
        return bool(np.all((last <= 0) | (now > _CRUSHED * last) & (now < _SWOLLEN * last)))

    def placed(self, state: Pressed) -> Pressed:
        """Return the state with its touching nodes on the face."""
        x = state.x.copy()
        points, _, _ = self.face.contour(state.place)
        x[state.touching] = points[0] - self.elements.nodes[0][state.touching]
        x[state.touching + self.elements.n] = points[1] - state.depth
        x[self.elements.held] = 0.0
        return replace(state, x=x)

    def _touching(
        self, state: Pressed, before: Pressed, seen: set[bytes], forces: Any = None
    ) -> Pressed | None:
        """Return the state with the nodes that should touch, or None if they do already."""
        nodes = self.elements.surface
        place, gap = self.nearest(state)
        touches = np.isin(nodes, state.touching)
        place[touches] = state.place
        chosen = touches | (gap < -_INSIDE * self.elements.thickness)
        if forces is not None:  # else none leaves
            _, (along, up), _ = self.face.contour(place)
            pushed = up * forces[nodes] - along * forces[nodes + self.elements.n] > 0
            chosen[touches] = pushed[touches]
        chosen[0] = True
        key = chosen.tobytes()
        if key in seen:  # a node that enters and leaves by turns is kept
            chosen |= touches
        if np.array_equal(chosen, touches):
            return None
        seen.add(key)
        if self.sticking and not self.upright:
            # A node that sticks stays where its way since the last state crossed the face.
            _, first = self.nearest(before)
            share = np.clip(first / np.maximum(first - gap, 1e-300), 0.0, 1.0)
            crossing, _ = self.nearest(before, state, share)
            place = np.where(touches, place, crossing)
        return replace(state, touching=nodes[chosen], place=place[chosen])

    def nearest(
        self, state: Pressed, to: Pressed | None = None, share: FloatArray | float = 0.0
    ) -> ArrayPair:
        """Return arc length and distance of the surface's nodes, on the way to another state."""
        n = self.elements.n
        nodes = self.elements.surface
        radius = self.elements.nodes[0][nodes]
        to = to or state
        u, w = ((1 - share) * state.x[dofs] + share * to.x[dofs] for dofs in (nodes, nodes + n))
        depth = (1 - share) * state.depth + share * to.depth
        place, gap = self.face.nearest(radius + u, w + depth)
        if self.upright:
            place = self.face.radius * np.arcsin(np.minimum(radius / self.face.radius, 1.0))
        return place, gap

    def _step(
        self, state: Pressed, forces: FloatArray, goal: Target, tangent: _Tangent | None
    ) -> tuple[Pressed, float, _Tangent | None]:
        """Take Newton's step; return the state after it and how far it moves something, in mm."""
        touching = state.touching
        n = self.elements.n
        change = self._change(state)
        tangent = tangent or self._tangent(state, forces, change)
        solution = tangent.factors.solve(-(change.T @ forces))
        sunk = goal.value - state.depth
        if isinstance(goal, Load):
            load = -np.sum(forces[touching + n])
            sunk = (goal.value - load - tangent.pushed @ solution) / tangent.stiffness
        solution = solution + sunk * tangent.along
        free = np.zeros(self.elements.size)
        free[self._free(state)] = solution
        moved = max(np.max(np.abs(free[: 2 * n])), abs(sunk))
        for share in _SHARES:
            place = state.place + share * free[touching]
            x = state.x + share * free
            depth = state.depth + share * sunk
            ahead = self.placed(replace(state, x=x, depth=depth, place=place))
            if moved < _HARMLESS * self.elements.thickness or self.is_sound(ahead, state):
                break
        return ahead, moved, tangent if share == 1 else None

    def _free(self, state: Pressed) -> IndexArray:
        """Return the unknowns that are free; those of sliding nodes are radial."""
        free = np.ones(self.elements.size, dtype=bool)
        free[np.append(self.elements.held, state.touching + self.elements.n)] = False
        if self.sticking:
            free[state.touching] = False
        return np.flatnonzero(free)

    def _change(self, state: Pressed) -> Any:
        """Return the change of all unknowns with those that are free, sparse."""
        # The places of touching nodes are in the columns of their radial displacement, which is
        # free where they slide.
        size = self.elements.size
        touching = state.touching
        change = sparse.eye_array(size, format="csc")
        _, tangents, _ = self.face.contour(state.place)
        rows = np.append(touching, touching + self.elements.n)
        values = np.append(tangents[0] - 1, tangents[1])
        sliding = (values, (rows, np.append(touching, touching)))
        change = change + sparse.coo_array(sliding, shape=(size, size)).tocsc()
        return change[:, self._free(state)]

    def _tangent(self, state: Pressed, forces: FloatArray, change: Any) -> _Tangent:
        """Return what the forces change by, at a state."""
        touching = state.touching
        n = self.elements.n
        stiffness = self.elements.tangent(state.x)
        _, _, bends = self.face.contour(state.place)
        curvature = np.zeros(forces.size)
        curvature[touching] = forces[touching] * bends[0] + forces[touching + n] * bends[1]
        reduced = change.T @ stiffness @ change + sparse.diags_array(curvature[self._free(state)])
        # The matrix is symmetric, and needs pivots off the diagonal only for the pressures.
        factors = splu(reduced.tocsc(), diag_pivot_thresh=1e-4)
        # The depth moves all touching nodes down.
        sinking = np.zeros(forces.size)
        sinking[touching + n] = -1.0
        sunk = stiffness @ sinking
        pushed = change.T @ sunk
        along = -factors.solve(pushed)
        return _Tangent(factors, pushed, along, sinking @ sunk + pushed @ along)


# The first step of a rod, as a share of its radius in depth; those of a sphere to the first goal,
# for the sake of the work; and what the next may grow by.
_FIRST = 0.05
_FIRST_STEPS = 5
_GROWTH = 1.4
# Under a rod no step is longer than this share of its radius: film that comes to stick on the way
# is placed to the second order in it.
_LONGEST = 0.1
# A step is halved at most so many times.
_HALVINGS = 8


def work(states: list[Pressed]) -> float:
    """Return the integral of load over depth from the untouched film, by splines, in mJ."""
    from scipy.interpolate import CubicSpline

    # Over the number of the step, so that a path may turn back.
    number = np.arange(len(states) + 1.0)
    path = CubicSpline(number, [(0.0, 0.0), *((state.depth, state.load) for state in states)])
    places, weights = gauss_between(number, 4)
    return float(weights @ (path(places)[:, 1] * path(places, 1)[:, 0]))


@dataclass(eq=False)
class Path:
    """The states so far, and the length of the next step; goals are loads in N or depths in mm."""

    pressing: Pressing
    start: Pressed
    length: float = np.inf
    states: list[Pressed] = field(default_factory=list)

    def reach(self, goal: Target, guesses: Iterable[Pressed]) -> Iterator[float]:
        """Go to a goal, at once from a good guess; yield the share of the way after each step."""
        for guess in guesses:
            with suppress(NewtonError):
                self.states.append(self.pressing.press(guess, goal, guess))
                yield 1.0
                return
        begin = reached(self.states[-1], goal) if self.states else 0.0
        halvings = 0
        way = goal.value - begin
        if np.isinf(self.length):
            self.length = min(_FIRST * self._radius(goal), goal.value / _FIRST_STEPS)
        while begin != goal.value:
            left = goal.value - begin
            pieces = max(1.0, np.ceil(abs(left) / self.length - 1e-9))
            ahead = goal.value if pieces == 1 else begin + left / pieces
            stage = replace(goal, value=ahead)
            try:
                before = self.states[-1] if self.states else self.start
                state = self.pressing.press(self._guess(stage), stage, before)
            except NewtonError:
                self.length = abs(ahead - begin) / 2
                halvings += 1
                if halvings > _HALVINGS:
                    raise
                continue
            halvings = max(0, halvings - 1)
            longer = max(abs(ahead - begin), self.length) * _GROWTH
            self.length = min(longer, _LONGEST * self._radius(goal))
            self.states.append(state)
            begin = ahead
            yield 1 - (goal.value - begin) / way

    def _radius(self, goal: Target) -> float:
        """Return a rod's radius as a depth, or the load that sinks it so far; inf for a sphere."""
        radius = self.pressing.face.radius if self.pressing.face.flat else np.inf
        modulus = self.pressing.elements.material.shear_modulus
        return radius * (8 * modulus * radius if isinstance(goal, Load) else 1.0)

    def _guess(self, goal: Target) -> Pressed:
        """Return the last state, carried on as it came as far as that is sound."""
        states = self.states[-3:] or [self.start]
        values = np.array([reached(state, goal) for state in states])
        if np.any(np.diff(values) * np.sign(goal.value - values[-1]) <= 0):  # it turned back
            states = states[-1:]
            values = values[-1:]
        for share in _SHARES:
            to = float(values[-1] + share * (goal.value - values[-1]))
            # The parabola through three states.
            powers = np.vander(values - to, increasing=True).T
            weights = np.linalg.solve(powers, np.eye(values.size)[0])
            x = weights @ [s.x for s in states]
            depth = float(weights @ [s.depth for s in states])
            ahead = replace(states[-1], x=x, depth=depth if isinstance(goal, Load) else to)
            if not self.pressing.sticking:
                ahead = self.pressing.at_nearest(ahead)
            if self.pressing.is_sound(self.pressing.placed(ahead), states[-1]):
                break
        return ahead
