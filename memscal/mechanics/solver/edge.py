r"""The edge of a contact, where it falls between two rings.

Where a film sticks, the tractions of a compressible film oscillate towards the edge, and those of
one that sticks at once are singular.  On rings there may then be no contact that fulfils
Signorini's conditions to the last digit: with one ring more it pulls at its edge, with one less
it overlaps.  What can always be found are the states in which the surfaces just meet at one ring
or the next.  Both are in equilibrium and within Amontons' cone, and so is every mixture of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from memscal.errors import ConvergenceError
from memscal.mechanics.solver.problem import ContactProblem, ContactState, Load, Target, Touch
from memscal.mechanics.solver.step import take_step

__all__ = ["is_contact", "meet_at", "mixture", "reached"]

# At the very edge, a share of the largest pressure may pull, and a share of the depth overlap:
# that is what the rings next to it resolve.  It is gone with the next ring.
_PULL = 1e-2
_OVERLAP = 1e-3


def meet_at(problem: ContactProblem, start: ContactState, ring: int) -> ContactState:
    """Return the state that follows ``start`` when the surfaces meet, or part, at ``ring``.

    The rings in contact stay in contact, though one may pull a little at the edge.  Only where
    that would be more than a little are they free to go.

    Raises
    ------
    ConvergenceError
        If there is no such state.
    """
    state = take_step(problem, start, Touch(ring), same_contact=True)
    return state if is_contact(problem, state) else take_step(problem, start, Touch(ring))


def is_contact(problem: ContactProblem, state: ContactState) -> bool:
    """Whether a state fulfils Signorini's conditions, but for what an edge does not resolve."""
    outside = problem.separations(state)[~state.touching]
    overlaps = np.any(outside < -_OVERLAP * abs(state.depth))
    return bool(state.pressure.min() >= -_PULL * state.pressure.max() and not overlaps)


def mixture(lower: ContactState, upper: ContactState, target: Target) -> ContactState:
    """Return the mixture of two states that is at ``target``; statuses are the second's.

    Raises
    ------
    ConvergenceError
        If the target does not lie between them.
    """
    begin, end = reached(lower, target), reached(upper, target)
    share = (target.value - begin) / (end - begin)
    if not 0 <= share <= 1:
        raise ConvergenceError(
            f"No contact was found at {target}.",
            why=f"It should lie between {begin:.6g} and {end:.6g}, where the surfaces meet at one "
            "ring and at the next.",
            cure="Try another number of rings, or a friction coefficient nearby.",
        )
    mixed = {
        name: (1 - share) * getattr(lower, name) + share * getattr(upper, name)
        for name in ("pressure", "shear", "depth", "load", "anchor", "outward")
    }
    return replace(upper, **mixed, iterations=lower.iterations + upper.iterations)


def reached(state: ContactState, target: Target) -> float:
    """Return the load or the depth of a state, as the target counts."""
    return state.load if isinstance(target, Load) else state.depth
