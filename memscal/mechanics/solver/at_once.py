r"""A contact that is loaded in one step, also where its edge falls between two rings.

Where a film sticks all at once, the shear is singular at the edge, and so is the pressure of a
compressible film.  On rings there may then be no set of rings that fulfils Signorini's conditions
exactly: with one ring more the contact pulls at its edge, with one less it overlaps.  The contact
then is a mixture of the two states in which the surfaces just meet at either ring.  Both are in
equilibrium and within Amontons' cone, and so is every mixture; the share is given by the target.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from memscal.errors import ConvergenceError
from memscal.mechanics.solver.problem import ContactProblem, ContactState, Load, Target, Touch
from memscal.mechanics.solver.step import take_step

__all__ = ["step_at_once"]

# A ring that pulls with more than this share of the largest pressure is no contact.
_PULL = 1e-2


def step_at_once(problem: ContactProblem, smooth: ContactState, target: Target) -> ContactState:
    """Return the state at ``target``, one step from the untouched film.

    Parameters
    ----------
    problem : ContactProblem
        Film, indenter and interface.
    smooth : ContactState
        The frictionless state at the same target, where the search begins.
    target : Load or Depth
        Where the step ends.

    Raises
    ------
    ConvergenceError
        If there is no such state.
    """
    untouched = np.zeros(problem.size)
    start = replace(smooth, anchor=untouched, outward=untouched)
    try:
        return take_step(problem, start, target)
    except ConvergenceError:
        rings = int(np.count_nonzero(start.touching))
        if problem.normal_law is not None or not np.all(start.touching[:rings]):
            raise
    return _between_rings(problem, start, target, rings)


def _between_rings(
    problem: ContactProblem, start: ContactState, target: Target, rings: int
) -> ContactState:
    """Mix the two states, of neighbouring rings, between which the target lies."""

    def meeting_at(ring: int) -> ContactState:
        inside = np.arange(problem.size) < ring
        return take_step(problem, replace(start, touching=inside), Touch(ring), same_contact=True)

    def measure(state: ContactState) -> float:
        return state.load if isinstance(target, Load) else state.depth

    upper = meeting_at(rings)
    while measure(upper) < target.value and rings < problem.size - 1:
        rings += 1
        upper = meeting_at(rings)
    lower = meeting_at(rings - 1)
    while measure(lower) > target.value and rings > 2:
        rings, upper = rings - 1, lower
        lower = meeting_at(rings - 1)
    share = (target.value - measure(lower)) / (measure(upper) - measure(lower))
    state = _mixture(lower, upper, share)
    if not 0 <= share <= 1 or state.pressure.min() < -_PULL * state.pressure.max():
        raise ConvergenceError(
            f"No contact was found at {target} that is loaded in one step.",
            why="At its edge the film would have to pull the indenter.",
            cure="Load incrementally, or use a lower friction coefficient.",
        )
    return state


def _mixture(lower: ContactState, upper: ContactState, share: float) -> ContactState:
    """Return the linear mixture of two states; statuses are those of the larger contact."""
    mixed = {
        name: (1 - share) * getattr(lower, name) + share * getattr(upper, name)
        for name in ("pressure", "shear", "depth", "load", "outward")
    }
    return replace(upper, **mixed, iterations=lower.iterations + upper.iterations)
