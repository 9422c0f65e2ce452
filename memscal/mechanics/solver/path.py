r"""The way to a load: friction remembers, so that a contact is followed step by step.

*Incremental* loading is the slow one of an experiment.  Between indenter and film that do not
yield, every step ends when the surfaces meet at the next ring (or part, on the way back): the
ring then sticks exactly where it first touched, and the contact grows by one ring in a step.
Between surfaces that yield, contact has no edge; steps are even in the cube root of the load (the
square root of the depth), which is even in the contact radius for a sphere.

*Total* loading is one step from the untouched film: with :math:`\mu = \infty` no point of the
contact has moved sideways at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from memscal.errors import ConvergenceError
from memscal.mechanics.solver.at_once import step_at_once
from memscal.mechanics.solver.problem import ContactProblem, ContactState, Load, Target, Touch
from memscal.mechanics.solver.step import take_step
from memscal.model.validation import FloatArray

__all__ = ["PathPoint", "follow"]

# Steps of a contact that neither grows nor shrinks, such as a rod's, when it is not the first.
_STEPS_OF_A_FIXED_CONTACT = 24


@dataclass(frozen=True, eq=False)
class PathPoint:
    """A state that was asked for, and what happened on the way to it.

    Parameters
    ----------
    state : ContactState
        The state.
    steps : int
        Steps from the untouched film.
    elastic_energy : float
        Energy stored in the film, in J.
    work : float or None
        Work done by the indenter, in J; ``None`` where one step says nothing of the way.
    dissipated_energy : float or None
        Work done by slip against friction, in J.
    """

    state: ContactState
    steps: int
    elastic_energy: float
    work: float | None
    dissipated_energy: float | None


def follow(
    problem: ContactProblem, targets: Sequence[Target], loading: str, increments: int
) -> list[PathPoint]:
    """Return the states at ``targets``, visited in their order.

    Parameters
    ----------
    problem : ContactProblem
        Film, indenter and interface.
    targets : sequence of Load or Depth
        Where to stop.
    loading : str
        ``"incremental"`` or ``"total"``.
    increments : int
        Steps to the largest target, where no ring's touch ends them.

    Raises
    ------
    ConvergenceError
        If a step does not settle; its ``last`` is the :class:`PathPoint` reached before it.
    """
    if problem.friction > 0 and loading == "total":
        return list(_in_one_step(problem, targets, increments))
    return list(_step_by_step(problem, targets, increments))


def _in_one_step(
    problem: ContactProblem, targets: Sequence[Target], increments: int
) -> Iterator[PathPoint]:
    """Solve each target from the untouched film; the frictionless contact is where to begin."""
    smooth = replace(problem, friction=0.0)
    for target, point in zip(targets, _step_by_step(smooth, targets, increments), strict=True):
        state = step_at_once(problem, point.state, target)
        yield PathPoint(state, 1, _elastic_energy(problem, state), None, None)


def _step_by_step(
    problem: ContactProblem, targets: Sequence[Target], increments: int
) -> Iterator[PathPoint]:
    """Follow the path; add up work and dissipation."""
    state, steps, work, dissipated = problem.virgin(), 0, 0.0, 0.0

    def reached() -> PathPoint:
        energy = _elastic_energy(problem, state)
        # Where nothing is lost, whatever the way, the energy in the film is the work done.
        lossless = problem.friction == 0 and problem.normal_law is None
        return PathPoint(state, steps, energy, energy if lossless else work, dissipated)

    farthest = max(target.value for target in targets)
    for target in targets:
        try:
            for following in _states_to(problem, state, target, farthest, increments):
                work += (state.load + following.load) / 2 * (following.depth - state.depth)
                dissipated += _dissipation(problem, state, following)
                state, steps = following, steps + 1
        except ConvergenceError as error:
            error.last = reached() if steps else None
            raise
        yield reached()


def _states_to(
    problem: ContactProblem,
    state: ContactState,
    target: Target,
    farthest: float,
    increments: int,
) -> Iterator[ContactState]:
    """Yield the states of the steps to one target, which is the last."""
    if problem.normal_law is not None:
        yield from _even_steps(problem, state, target, farthest, increments)
        return
    if problem.friction == 0:
        yield take_step(problem, state, target)
        return
    rising = target.value > _reached(state, target)
    while (event := _next_event(problem, state, rising=rising)) is not None:
        following = take_step(problem, _onset(state, rising=rising), event)
        if not _between(following, state, target):
            break
        yield following
        state = following
    yield from _to_target(problem, state, target, rising=rising)


def _to_target(
    problem: ContactProblem, state: ContactState, target: Target, *, rising: bool
) -> Iterator[ContactState]:
    """Yield the last steps to a target, on the way to which no ring's touch comes any more."""
    # Under a rod the contact is given, also where an edge that sticks pulls at the film.
    given = not np.any(_reachable(problem, problem.virgin().touching))
    count = _STEPS_OF_A_FIXED_CONTACT if given and state.load > 0 else 1
    begin = _reached(state, target)
    for share in np.arange(1, count + 1) / count:
        value = begin + (target.value - begin) * float(share)
        goal = target if share == 1 else replace(target, value=value)
        state = take_step(problem, _onset(state, rising=rising), goal, same_contact=given)
        yield state


def _even_steps(
    problem: ContactProblem,
    state: ContactState,
    target: Target,
    farthest: float,
    increments: int,
) -> Iterator[ContactState]:
    """Yield states that are evenly spaced in the contact radius of a sphere."""
    power = 3 if isinstance(target, Load) else 2
    begin, end = ((v / farthest) ** (1 / power) for v in (_reached(state, target), target.value))
    count = max(1, math.ceil(increments * abs(end - begin) - 1e-9))
    for share in np.linspace(begin, end, count + 1)[1:-1]:
        state = take_step(problem, state, replace(target, value=farthest * float(share) ** power))
        yield state
    yield take_step(problem, state, target)


def _onset(state: ContactState, *, rising: bool) -> ContactState:
    """Return the state with the rings that meet without pressing in contact, or out of it."""
    return state if rising else replace(state, touching=state.touching & (state.pressure > 0))


def _next_event(problem: ContactProblem, state: ContactState, *, rising: bool) -> Touch | None:
    """Return the ring where the surfaces meet, or part, next; ``None`` where there is none."""
    touching = _onset(state, rising=rising).touching
    reachable = _reachable(problem, touching)
    if rising:
        candidates, measure = reachable, problem.separations(state)
    else:
        candidates, measure = touching & _neighbours(reachable), state.pressure
    where = np.flatnonzero(candidates)
    if where.size == 0 or (not rising and np.count_nonzero(touching) < 2):
        return None
    return Touch(int(where[np.argmin(measure[where])]))


def _reachable(problem: ContactProblem, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the free rings next to the contact that the indenter has not ended at."""
    return ~touching & _neighbours(touching) & np.isfinite(problem.heights)


def _neighbours(rings: NDArray[np.bool_]) -> NDArray[np.bool_]:
    beside = np.zeros_like(rings)
    beside[1:] |= rings[:-1]
    beside[:-1] |= rings[1:]
    return beside


def _reached(state: ContactState, target: Target) -> float:
    return state.load if isinstance(target, Load) else state.depth


def _between(following: ContactState, state: ContactState, target: Target) -> bool:
    """Whether a step brought the state nearer to the target without passing it."""
    begin, now = _reached(state, target), _reached(following, target)
    return begin < now <= target.value or begin > now >= target.value


def _elastic_energy(problem: ContactProblem, state: ContactState) -> float:
    r"""Return :math:`\frac12\int(p\,w + q\,u)\,dA`, in J (Clapeyron)."""
    p, q = state.pressure, state.shear
    w, u = problem.displacements(p, q)
    return 0.5 * _surface_integral(problem.compliance.r, (p, w), (q, u))


def _dissipation(problem: ContactProblem, before: ContactState, after: ContactState) -> float:
    """Return the work of friction against the slip between two states, in J."""
    both = before.touching & after.touching
    slipped = np.where(both, after.anchor - before.anchor, 0.0)
    shear = (before.shear + after.shear) / 2
    return -_surface_integral(problem.compliance.r, (shear, slipped))


def _surface_integral(r: FloatArray, *products: tuple[FloatArray, FloatArray]) -> float:
    """Integrate products of functions that are linear between rings; exact."""
    left, right, width = r[:-1], r[1:], np.diff(r)
    total = 0.0
    for f, g in products:
        f0, f1, g0, g1 = f[:-1], f[1:], g[:-1], g[1:]
        # Cubic integrand: Simpson's rule is exact.
        middle = (left + right) / 2 * (f0 + f1) / 2 * (g0 + g1) / 2
        total += float(np.sum(width / 6 * (left * f0 * g0 + 4 * middle + right * f1 * g1)))
    return 2 * np.pi * total
