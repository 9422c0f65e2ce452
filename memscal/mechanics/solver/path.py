"""Path of a contact to its loads: friction depends on history, and is followed step by step.

On a rigid interface every step of an incremental loading ends when the surfaces meet at the next
ring (or part, on the way back).  On a compliant one, contact has no edge; steps are even in the
cube root of the load (the square root of the depth): in the contact radius, for a sphere.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from memscal.errors import ConvergenceError
from memscal.mechanics.solver.step import (
    ContactProblem,
    ContactState,
    Load,
    Target,
    Touch,
    reached,
    take_step,
)
from memscal.model.arrays import array_record
from memscal.progress import Task

# Shares of the largest pressure that may pull, and of the depth that may overlap, at the very edge.
_PULL = 1e-2
_OVERLAP = 1e-3
# Share of the load that may pull at the edge of a contact that sticks at once: in a compressible
# film it does at any radius, whatever the rings.
_TENSION = 2e-3


def _overlaps(problem: ContactProblem, state: ContactState) -> bool:
    gaps = problem.separations(state)[~state.touching]
    return bool(np.any(gaps < -_OVERLAP * abs(state.depth)))


def _mixture(lower: ContactState, upper: ContactState, target: Target) -> ContactState:
    """Return the mixture of two states that is at ``target``; statuses are the second's."""
    begin = reached(lower, target)
    end = reached(upper, target)
    share = (target.value - begin) / (end - begin)
    if not 0 <= share <= 1:
        raise ConvergenceError(
            f"No contact was found at {target}.",
            why=f"It should lie from {begin:.6g} to {end:.6g}, where two neighbouring rings touch.",
            cure="Try another number of rings, or a friction coefficient nearby.",
        )
    mixed = {
        name: (1 - share) * getattr(lower, name) + share * getattr(upper, name)
        for name in ("pressure", "shear", "depth", "load", "anchor", "outward")
    }
    return replace(upper, **mixed)


def _step_at_once(problem: ContactProblem, smooth: ContactState, target: Target) -> ContactState:
    """Return the state at ``target``, one step from the untouched film.

    Where it does not settle, its edge lies between two rings: states that meet there are mixed.
    """
    untouched = np.zeros_like(problem.heights)
    start = replace(smooth, anchor=untouched, outward=untouched)
    try:
        return take_step(problem, start, target)
    except ConvergenceError:
        rings = int(np.count_nonzero(start.touching))
        if problem.interface.normal_law or not np.all(start.touching[:rings]):
            raise

    def meeting_at(ring: int) -> ContactState:
        inside = replace(start, touching=np.arange(start.touching.size) < ring)
        return take_step(problem, inside, Touch(ring), same_contact=True)

    last = problem.heights.size - 1
    rings = min(rings, last)
    upper = meeting_at(rings)
    while reached(upper, target) < target.value and rings < last:
        rings += 1
        upper = meeting_at(rings)
    lower = meeting_at(rings - 1)
    while reached(lower, target) > target.value and rings > 2:
        rings -= 1
        upper = lower
        lower = meeting_at(rings - 1)
    state = _mixture(lower, upper, target)
    tension = -problem.compliance.areas @ np.minimum(state.pressure, 0.0)
    if tension > _TENSION * state.load or _overlaps(problem, state):
        raise ConvergenceError(
            f"No contact that is loaded in one step was found at {target}.",
            why="At its edge the film would have to pull at the indenter, or pass through it.",
            cure="Load incrementally, use a lower friction coefficient, or other rings.",
        )
    return state


# Steps of a contact that neither grows nor shrinks, such as a rod's, when it is not the first.
_STEPS_OF_A_FIXED_CONTACT = 24


@array_record
class PathPoint:
    """A state that was asked for, and what happened on the way to it; energies in J."""

    state: ContactState
    steps: int  # from the untouched film
    elastic_energy: float
    work: float | None  # None after one step: it depends on the way
    dissipated_energy: float | None


def follow(
    problem: ContactProblem, targets: Sequence[Target], loading: str, increments: int
) -> list[PathPoint]:
    """Return the states at ``targets``; the ``last`` of a ConvergenceError is a PathPoint."""
    if problem.friction == 0 or loading != "total":
        steps = _step_by_step(problem, targets, increments)
        return list(Task("loads", len(targets)).counted(steps))
    # Each from the untouched film; the frictionless contact is where to begin.
    begin = _step_by_step(replace(problem, friction=0.0), targets, increments)
    pairs = zip(begin, targets, strict=True)
    states = [_step_at_once(problem, point.state, target) for point, target in pairs]
    return [PathPoint(s, 1, _elastic_energy(problem, s), None, None) for s in states]


@dataclass(eq=False)
class _Walk:
    """The state that the path has reached, its steps, and the work and dissipation (J)."""

    problem: ContactProblem
    state: ContactState
    steps: int = 0
    work: float = 0.0
    dissipated: float = 0.0
    ahead: ContactState | None = None  # the next meeting, beyond the target that came before it

    def step_to(self, following: ContactState) -> None:
        before = self.state
        self.work += (before.load + following.load) / 2 * (following.depth - before.depth)
        # The work of friction against the slip.
        slips = before.touching & (following.pressure > 0) & (following.slip != 0)
        slipped = np.where(slips, following.anchor - before.anchor, 0.0)
        # A ring that turns around slips under the shear that it has at the end.
        mean = (before.shear + following.shear) / 2
        shear = np.where(before.slip == following.slip, mean, following.shear)
        self.dissipated -= float(shear @ (self.problem.compliance.products @ slipped))
        self.state = following
        self.steps += 1

    def point(self) -> PathPoint:
        energy = _elastic_energy(self.problem, self.state)
        # Where nothing is lost, whatever the way, the energy in the film is the work done.
        lossless = self.problem.friction == 0 and not self.problem.interface.normal_law
        work = energy if lossless else self.work
        return PathPoint(self.state, self.steps, energy, work, self.dissipated)


def _step_by_step(
    problem: ContactProblem, targets: Sequence[Target], increments: int
) -> Iterator[PathPoint]:
    """Follow the path from target to target."""
    # The first touch, at the ring (or rings) of the lowest height.
    nothing = np.zeros_like(problem.heights)
    lowest = float(problem.heights.min())
    touching = problem.heights <= lowest
    first = ContactState(nothing, nothing, lowest, 0.0, touching, nothing, nothing, nothing)
    walk = _Walk(problem, first)
    # The last state of the path that a target interrupted, and the way it went.
    resume = walk
    upward = True
    farthest = max(target.value for target in targets)
    for target in targets:
        if math.isclose(reached(walk.state, target), target.value, rel_tol=1e-12):
            # Nothing moves, and nothing that slipped is found to stick.
            yield walk.point()
            continue
        rising = target.value > reached(walk.state, target)
        if rising == upward:
            walk = resume
        try:
            if problem.interface.normal_law:
                _walk_evenly(walk, target, farthest, increments)
            elif problem.friction == 0:
                walk.step_to(take_step(problem, walk.state, target))
            else:
                resume = _walk_ring_by_ring(walk, target, rising=rising)
                upward = rising
        except ConvergenceError as error:
            error.last = walk.point() if walk.steps else None
            raise
        yield walk.point()


def _walk_ring_by_ring(walk: _Walk, target: Target, *, rising: bool) -> _Walk:
    """Go to the target, ring by ring; return the walk as it was at the last ring before it."""
    problem = walk.problem
    while following := walk.ahead or _next_meeting(problem, walk.state, target, rising=rising):
        walk.ahead = None
        begin = reached(walk.state, target)
        end = reached(following, target)
        if not (begin < end <= target.value or begin > end >= target.value):
            # The path goes on from the ring before: a state between two rings changes no other.
            before = replace(walk, ahead=following)
            walk.step_to(_mixture(walk.state, following, target))
            return before
        walk.step_to(following)
    # No more rings can touch, as under a rod.  On a rigid interface the first loading is then one
    # step: everything grows in proportion.
    proportional = walk.state.load == 0 and problem.interface.rigid
    count = 1 if proportional else _STEPS_OF_A_FIXED_CONTACT
    for value in np.linspace(reached(walk.state, target), target.value, count + 1)[1:]:
        goal = replace(target, value=float(value))
        walk.step_to(take_step(problem, walk.state, goal, same_contact=True))
    return walk


def _walk_evenly(walk: _Walk, target: Target, farthest: float, increments: int) -> None:
    """Go to a target in steps that are even in the contact radius of a sphere."""
    power = 3 if isinstance(target, Load) else 2
    values = reached(walk.state, target), target.value
    begin, end = ((value / farthest) ** (1 / power) for value in values)
    count = max(1, math.ceil(increments * abs(end - begin) - 1e-9))
    for share in np.linspace(begin, end, count + 1)[1:-1]:
        goal = replace(target, value=farthest * float(share) ** power)
        walk.step_to(take_step(walk.problem, walk.state, goal))
    walk.step_to(take_step(walk.problem, walk.state, target))


def _next_meeting(
    problem: ContactProblem, state: ContactState, target: Target, *, rising: bool
) -> ContactState | None:
    """Return the next state in which the surfaces just meet at a ring at the contact's edge."""
    touching = state.touching
    if not rising:
        # Rings that meet without pressing are out of contact on the way back.
        touching = touching & (state.pressure > 0)
    neighbours = (1, 0, 1)
    outside = ~touching & np.isfinite(problem.heights)
    edge = outside & (np.convolve(touching, neighbours, "same") > 0)
    if not rising:
        edge = touching & (np.convolve(edge, neighbours, "same") > 0)
        if np.count_nonzero(touching) < 2:
            return None
    onset = replace(state, touching=touching)
    states = []
    for ring in np.flatnonzero(edge):
        goal = Touch(int(ring))
        # The rings in contact stay in contact, unless one pulls by more than a little at the edge.
        state = take_step(problem, onset, goal, same_contact=True)
        in_tension = state.pressure.min() < -_PULL * state.pressure.max()
        if in_tension or _overlaps(problem, state):
            state = take_step(problem, onset, goal)
        states.append(state)
    # A contact with a hole has two edges: what meets, or parts, first comes next.
    nearest = min if rising else max
    return nearest(states, key=lambda following: reached(following, target), default=None)


def _elastic_energy(problem: ContactProblem, state: ContactState) -> float:
    r"""Return :math:`\frac12\int(p\,w + q\,u)\,dA`, in J (Clapeyron)."""
    w, u = problem.displacements(state.pressure, state.shear)
    products = problem.compliance.products
    return 0.5 * float(state.pressure @ (products @ w) + state.shear @ (products @ u))
