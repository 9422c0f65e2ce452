r"""One step of a contact: from one equilibrium to the next, by an active-set Newton method.

Which rings touch, stick and slip decides which equations hold.  With that known they are linear
(rigid interface) or smooth (compliant interface); they are solved, the rings that contradict
their status change it, and so on until none does: a semismooth Newton method on the conditions
of Signorini and Amontons.  Friction acts at the end of the step (implicit Euler).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from memscal.errors import ConvergenceError
from memscal.mechanics.interface import NormalLaw
from memscal.mechanics.solver.problem import ContactProblem, ContactState, Goal, Touch
from memscal.mechanics.solver.system import Statuses, Tractions, solve_system
from memscal.model.validation import FloatArray

__all__ = ["take_step"]

_MOST_ITERATIONS = 200
# Relative slack of a contradiction: below it, a ring may keep its status.
_SLACK = 1e-11
# A compliant interface is solved when pressures move by less than this share of the largest.
_SETTLED = 1e-9
# Pressures of a compliant interface below this share of the largest are left out.
_NEGLIGIBLE = 1e-9
# How far a trial may press a compliant interface together at once, in lengths of its law.
_PLUNGE = 4.0
# After so many iterations only the worst contradiction is mended at a time: no cycle survives.
_CAREFUL_AFTER = 30


def take_step(
    problem: ContactProblem, start: ContactState, goal: Goal, *, same_contact: bool = False
) -> ContactState:
    """Return the equilibrium that follows ``start`` when ``goal`` has been reached.

    Parameters
    ----------
    problem : ContactProblem
        Film, indenter and interface.
    start : ContactState
        The state before; its anchors are where sticking rings stay.
    goal : Load, Depth or Touch
        Where the step ends.
    same_contact : bool
        Whether the rings in contact are those of ``start``, whatever their pressure.

    Raises
    ------
    ConvergenceError
        If the statuses do not settle.
    """
    statuses = _first_statuses(problem, start, goal)
    held = goal.ring if isinstance(goal, Touch) else None
    for iteration in range(1, _MOST_ITERATIONS + 1):
        tractions = solve_system(problem, statuses, goal)
        careful = iteration > _CAREFUL_AFTER
        revised, settled = _revise(problem, statuses, tractions, held=held, careful=careful)
        if same_contact:
            changed = not np.array_equal(revised.slip, statuses.slip)
            revised, settled = replace(revised, pressing=statuses.pressing), not changed
        if settled:
            return _accepted(problem, statuses, tractions, held, iteration)
        statuses = revised
    raise ConvergenceError(
        f"The contact did not settle within {_MOST_ITERATIONS} iterations on the way to {goal}.",
        why=f"Before it, {start.load:.6g} N were borne at a depth of {start.depth * 1e6:.6g} um.",
        cure="Try another number of rings, or a friction coefficient nearby.",
    )


def _first_statuses(problem: ContactProblem, start: ContactState, goal: Goal) -> Statuses:
    """Begin with the statuses of the state before."""
    law = problem.normal_law
    pressing = start.touching.copy()
    separation = problem.separations(start)
    if law is not None:
        pressing = _bearing(problem, law, separation)
    if isinstance(goal, Touch):
        pressing[goal.ring] = False
    return Statuses(
        pressing=pressing,
        slip=start.slip,
        anchor=start.anchor,
        separation=separation,
        pressure=start.pressure,
        stretch=start.outward - start.anchor,
    )


def _bearing(problem: ContactProblem, law: NormalLaw, separation: FloatArray) -> NDArray[np.bool_]:
    """Return the rings whose pressure counts."""
    pressure = law.pressure(separation, problem.film)
    return np.asarray(pressure > _NEGLIGIBLE * pressure.max())


def _revise(
    problem: ContactProblem,
    statuses: Statuses,
    tractions: Tractions,
    *,
    held: int | None,
    careful: bool,
) -> tuple[Statuses, bool]:
    """Return statuses that the tractions do not contradict, and whether nothing changed."""
    p, q = tractions.pressure, tractions.shear
    w, u = problem.displacements(p, q)
    gap = problem.heights - tractions.depth + w
    slip, tangential = _revised_slip(problem, statuses, tractions, u, careful=careful)
    law = problem.normal_law
    if law is None:
        pressing = _revised_contact(statuses, p, gap, tractions.depth, held, careful=careful)
        separation = gap
        normal = bool(np.any(pressing != statuses.pressing))
    else:
        separation = _revised_separation(problem, law, statuses, tractions, gap)
        pressing = _bearing(problem, law, separation)
        normal = False
    moved = np.max(np.abs(p - statuses.pressure)) > _SETTLED * p.max()
    settled = not (normal or tangential or (moved and not problem.interface.rigid))
    length = problem.interface.slip_length
    revised = Statuses(
        pressing=pressing,
        slip=slip,
        anchor=statuses.anchor,
        separation=separation,
        pressure=p,
        stretch=np.clip(u - statuses.anchor, -length, length),
    )
    return revised, settled


def _revised_contact(
    statuses: Statuses,
    p: FloatArray,
    gap: FloatArray,
    depth: float,
    held: int | None,
    *,
    careful: bool,
) -> NDArray[np.bool_]:
    """Let go of rings that pull, and catch rings that would pass through the indenter."""
    pulled = np.where(statuses.pressing, -p / np.abs(p).max(initial=1e-300), 0.0)
    passed = np.where(statuses.pressing, 0.0, -gap / max(abs(depth), 1e-300))
    if held is not None:
        passed[held] = 0.0
    wrong = np.maximum(pulled, passed)
    changing = wrong > _SLACK
    if careful and np.any(changing):
        changing = np.arange(wrong.size) == np.argmax(wrong)
    return statuses.pressing ^ changing


def _revised_slip(
    problem: ContactProblem,
    statuses: Statuses,
    tractions: Tractions,
    u: FloatArray,
    *,
    careful: bool,
) -> tuple[NDArray[np.int8], bool]:
    """Let rings slip whose shear is too large, and stick that would be pushed on by friction."""
    mu = problem.friction
    if mu == 0 or np.isinf(mu):
        return statuses.slip, False
    p, q = tractions.pressure, tractions.shear
    largest = mu * np.abs(p).max()
    sticks = statuses.pressing & (statuses.slip == 0)
    slips = statuses.pressing & (statuses.slip != 0) & (problem.compliance.r > 0)
    excess = np.where(sticks, (np.abs(q) - mu * np.maximum(p, 0.0)) / largest, 0.0)
    # A slipping ring stretches the interface by its slip length, against the shear.
    short = statuses.slip * (u - statuses.anchor) + problem.interface.slip_length
    reach = np.max(np.abs(u)) + problem.interface.slip_length
    pushed = np.where(slips, short / reach, 0.0)
    wrong = np.maximum(excess, pushed)
    changing = wrong > _SLACK
    if not np.any(changing):
        return statuses.slip, False
    if careful:
        changing = np.arange(wrong.size) == np.argmax(wrong)
    # A ring that friction would push on far enough to slip back does so at once (the trial shear
    # of Alart and Curnier); sticking first, it could go back and forth for ever.
    stretch = u - statuses.anchor
    turn = 2 * mu * np.maximum(p, 0.0) * np.diagonal(problem.compliance.radial)
    turns = np.abs(stretch) > np.maximum(turn, problem.interface.slip_length)
    turned = np.where(turns, -np.sign(stretch), 0)
    slip = np.where(changing, np.where(sticks, np.sign(q), turned), statuses.slip)
    return slip.astype(np.int8), True


def _revised_separation(
    problem: ContactProblem,
    law: NormalLaw,
    statuses: Statuses,
    tractions: Tractions,
    gap: FloatArray,
) -> FloatArray:
    """Return the next trial of the separations.

    Where the surfaces part, the linear equations' own; where they close, the one at which the
    law bears the linear equations' pressure, because a convex law soon bears far more.
    """
    before, p = statuses.separation, tractions.pressure
    after = np.maximum(gap, np.minimum(before, 0.0) - _PLUNGE * law.length)
    closing = statuses.pressing & (gap < before) & (p > 0)
    borne = law.separation(np.where(closing, p, 1.0), problem.film)
    return np.where(closing, np.clip(borne, gap, before), after)


def _accepted(
    problem: ContactProblem,
    statuses: Statuses,
    tractions: Tractions,
    held: int | None,
    iterations: int,
) -> ContactState:
    p, q = tractions.pressure, tractions.shear
    _, u = problem.displacements(p, q)
    slip = np.where(statuses.pressing, statuses.slip, 0).astype(np.int8)
    # What slips drags its anchor along, a slip length behind; what is free has none.
    moving = ~statuses.pressing | (slip != 0)
    anchor = np.where(moving, u + slip * problem.interface.slip_length, statuses.anchor)
    touching = statuses.pressing.copy()
    if held is not None:
        touching[held] = True
    return ContactState(
        pressure=p,
        shear=q,
        depth=tractions.depth,
        load=float(problem.compliance.areas @ p),
        touching=touching,
        slip=slip,
        anchor=anchor,
        outward=u,
        iterations=iterations,
    )
