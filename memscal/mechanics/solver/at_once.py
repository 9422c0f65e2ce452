"""A contact that is loaded in one step from the untouched film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from memscal.errors import ConvergenceError
from memscal.mechanics.solver.edge import is_contact, mixture, reached
from memscal.mechanics.solver.problem import ContactProblem, ContactState, Target, Touch
from memscal.mechanics.solver.step import take_step

__all__ = ["step_at_once"]


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
    """Find the neighbouring rings between which the edge lies; mix the states that meet there."""

    def meeting_at(ring: int) -> ContactState:
        inside = np.arange(problem.size) < ring
        return take_step(problem, replace(start, touching=inside), Touch(ring), same_contact=True)

    rings = min(rings, problem.size - 1)
    upper = meeting_at(rings)
    while reached(upper, target) < target.value and rings < problem.size - 1:
        rings += 1
        upper = meeting_at(rings)
    lower = meeting_at(rings - 1)
    while reached(lower, target) > target.value and rings > 2:
        rings, upper = rings - 1, lower
        lower = meeting_at(rings - 1)
    state = mixture(lower, upper, target)
    if not is_contact(problem, state):
        raise ConvergenceError(
            f"No contact that is loaded in one step was found at {target}.",
            why="At its edge the film would have to pull at the indenter, or pass through it.",
            cure="Load incrementally, use a lower friction coefficient, or other rings.",
        )
    return state
