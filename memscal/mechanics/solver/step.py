r"""Contact of a rigid indenter with a film, ring by ring: its conditions, its state, its steps.

At every ring the separation of the two surfaces is

.. math:: g_i = f_i - \delta + w_i,

with the indenter's height :math:`f` above its lowest point, the depth :math:`\delta` and the
film's depression :math:`w`.  A rigid interface asks for :math:`g \ge 0`, :math:`p \ge 0` and
:math:`g\,p = 0` (Signorini); a compliant one for :math:`p = F(g)`.  Tangentially, with the
displacement :math:`u - u^0` of the film since the ring was last free of elastic strain,

.. math:: |q| \le \mu p, \qquad
          q = -\mu p\,\frac{u - u^0}{\ell}\ \text{(sticking)}, \qquad
          q = \mp\mu p\ \text{(slipping outward, inward)},

where sticking on a rigid interface (:math:`\ell = 0`) means :math:`u = u^0`.

A step leads from one equilibrium to the next, by an active-set Newton method.  Which rings touch,
stick and slip decides which equations hold.  These are solved, the rings that contradict their
status change it, and so on until none does: a semismooth Newton method on the conditions of
Signorini and Amontons.  Friction acts at the end of the step (implicit Euler).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from memscal.errors import ConvergenceError
from memscal.mechanics.interface import Interface, NormalLaw
from memscal.mechanics.surface import SurfaceCompliance
from memscal.model.arrays import (
    ArrayPair,
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    value_record,
)
from memscal.model.film import ElasticFilm


@array_record
class ContactProblem:
    """A film, an indenter and what is between them."""

    film: ElasticFilm
    compliance: SurfaceCompliance
    heights: FloatArray  # of the face above its lowest point, in m; inf where it has ended
    friction: float
    interface: Interface

    def displacements(self, p: FloatArray, q: FloatArray) -> ArrayPair:
        """Return depression and outward displacement (m) under tractions (Pa) at the rings."""
        both = self.compliance.whole @ np.append(p, q)
        return both[: p.size], both[p.size :]

    def separations(self, state: ContactState) -> FloatArray:
        """Return the distance between the two surfaces in m, ``inf`` beyond the indenter."""
        w, _ = self.displacements(state.pressure, state.shear)
        return self.heights - state.depth + w


@array_record
class ContactState:
    """A contact in equilibrium, as arrays over the rings."""

    pressure: FloatArray  # Pa
    shear: FloatArray  # Pa, positive outward on the film
    depth: float  # m
    load: float  # N
    touching: BoolArray
    slip: FloatArray  # sign of the shear where a ring slips, 0 where it sticks
    anchor: FloatArray  # outward displacement at which a sticking ring bears no shear, in m
    outward: FloatArray  # outward displacement in m


@value_record
class Load:
    """Press until the load is ``value`` N."""

    value: float


@value_record
class Depth:
    """Press until the depth is ``value`` m."""

    value: float


@value_record
class Touch:
    """Move until the surfaces meet at ``ring`` without pressing there."""

    ring: int


Target = Load | Depth


def reached(state: Any, target: Target) -> float:
    """Return the load or the depth of a state, as the target counts."""
    return float(state.load if isinstance(target, Load) else state.depth)


Goal = Load | Depth | Touch


@array_record
class _Status:
    """Status and trial values of the n rings while the equations are solved."""

    pressing: BoolArray  # rings that bear a pressure
    slip: FloatArray  # sign of the shear where a ring slips, 0 where it sticks
    anchor: FloatArray  # outward displacement (m) at which a sticking ring bears no shear
    # Trials for a compliant interface: separation (m), pressure (Pa) and elastic stretch (m).
    separation: FloatArray
    pressure: FloatArray
    stretch: FloatArray


class _Trial(NamedTuple):
    """Tractions and depth that fulfil the equations of a status and a goal."""

    pressure: FloatArray  # Pa
    shear: FloatArray  # Pa
    depth: float  # m
    separation: FloatArray  # of the two surfaces, in m
    outward: FloatArray  # displacement in m


def _solve_system(problem: ContactProblem, status: _Status, goal: Goal) -> _Trial:
    c = problem.compliance
    mu = problem.friction
    n = problem.heights.size
    rows = np.flatnonzero(status.pressing)
    count = rows.size
    off_axis = c.r > 0
    stuck = np.flatnonzero(status.pressing & (status.slip == 0) & off_axis) if mu > 0 else rows[:0]
    # Shear of a slipping ring per pressure.  Nothing slips where friction has no bound.
    bounded = mu if math.isfinite(mu) else 0.0
    ratio = bounded * (status.slip * off_axis)[rows]
    slipping = np.flatnonzero(ratio)

    # In units of the film's own compliance, the matrix mixes pressures with pressures.  The last
    # row is the goal's, from the start that of a ring which the surfaces are to meet.
    unit = c.whole[0, 0]
    ring = goal.ring if isinstance(goal, Touch) else 0
    unknown = np.append(rows, n + stuck)
    equations = c.whole.take(np.append(unknown, ring), axis=0)
    matrix = np.zeros((len(equations), len(equations)))
    matrix[:, :-1] = equations.take(unknown, axis=1)
    matrix[:, slipping] += equations.take(n + rows[slipping], axis=1) * ratio[slipping]
    matrix[:count, -1] = matrix[-1, -1] = -unit
    right = np.concatenate([-problem.heights[rows], status.anchor[stuck], [-problem.heights[ring]]])
    if isinstance(goal, Depth):
        matrix[-1] = 0.0
        matrix[-1, -1] = unit
        right[-1] = goal.value
    elif isinstance(goal, Load):
        scale = unit / c.areas.sum()
        matrix[-1] = 0.0
        matrix[-1, :count] = c.areas[rows] * scale
        right[-1] = goal.value * scale
    law = problem.interface.normal_law
    if law:
        # g = 0 becomes g = F^-1(p), linearised at the trial's separation.
        gap = status.separation[rows]
        stiffness = law.stiffness(gap, problem.film)
        diagonal = np.arange(count)
        matrix[diagonal, diagonal] += 1 / stiffness
        right[diagonal] += gap + law.pressure(gap, problem.film) / stiffness
    if problem.interface.slip_length > 0 and math.isfinite(mu):
        _add_tangential_compliance(problem, status, rows, stuck, matrix, right)
    try:
        solution = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            "The equations of the contact have no solution.",
            why=f"{count} rings press and {stuck.size} of them stick, on the way to {goal}.",
            cure="Check film, indenter and loads, and their units; try another number of rings.",
        ) from error

    pressure = np.zeros(n)
    shear = np.zeros(n)
    pressure[rows] = solution[:count]
    shear[rows] = ratio * solution[:count]
    shear[stuck] = solution[count:-1]
    depth = solution[-1] * unit
    w, u = problem.displacements(pressure, shear)
    return _Trial(pressure, shear, depth, problem.heights - depth + w, u)


def _add_tangential_compliance(
    problem: ContactProblem,
    status: _Status,
    pressing: IndexArray,
    stuck: IndexArray,
    matrix: FloatArray,
    right: FloatArray,
) -> None:
    r"""Replace :math:`u = u^0` by :math:`\mu p\,(u - u^0) + \ell q = 0`, linearised."""
    mu = problem.friction
    length = problem.interface.slip_length
    limit = mu * np.maximum(status.pressure[stuck], 0.0)
    # The equation is divided by what keeps it of the size of the others, also where p vanishes.
    size = limit + length / problem.compliance.radial[stuck]
    here = pressing.size + np.arange(stuck.size)
    matrix[here] *= (limit / size)[:, None]
    right[here] *= limit / size
    matrix[here, here] += length / size
    by_pressure = mu * status.stretch[stuck] / size
    matrix[here, np.searchsorted(pressing, stuck)] += by_pressure
    right[here] += by_pressure * status.pressure[stuck]


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
    """Return the equilibrium that follows ``start`` when ``goal`` has been reached."""
    # With same_contact the rings in contact stay those of ``start``, whatever their pressure.
    law = problem.interface.normal_law
    pressing = start.touching.copy()
    separation = np.zeros_like(problem.heights)  # counts where the interface is compliant alone
    if law:
        separation = problem.separations(start)
        pressing = _bearing(problem, law, separation)
    held = np.arange(pressing.size) == (goal.ring if isinstance(goal, Touch) else -1)
    pressing[held] = False
    stretch = start.outward - start.anchor
    status = _Status(pressing, start.slip, start.anchor, separation, start.pressure, stretch)
    for iteration in range(1, _MOST_ITERATIONS + 1):
        trial = _solve_system(problem, status, goal)
        revised, settled = _revise(problem, status, trial, held, iteration > _CAREFUL_AFTER)
        if same_contact:
            settled = np.array_equal(revised.slip, status.slip)
            revised = replace(revised, pressing=status.pressing)
        if settled:
            break
        status = revised
    else:
        raise ConvergenceError(
            f"The contact did not settle within {_MOST_ITERATIONS} iterations on the way to "
            f"{goal}.",
            why=f"Before it, {start.load:.6g} N were borne at a depth of {start.depth * 1e6:.6g} "
            "um.",
            cure="Try another number of rings, or a friction coefficient nearby.",
        )
    p, q, depth, _, u = trial
    slip = np.where(status.pressing, status.slip, 0.0)
    # What slips drags its anchor along, a slip length behind; what is free has none.
    moving = ~status.pressing | (slip != 0)
    anchor = np.where(moving, u + slip * problem.interface.slip_length, status.anchor)
    load = float(problem.compliance.areas @ p)
    return ContactState(p, q, depth, load, status.pressing | held, slip, anchor, u)


def _bearing(problem: ContactProblem, law: NormalLaw, separation: FloatArray) -> BoolArray:
    """Return the rings whose pressure counts."""
    pressure = law.pressure(separation, problem.film)
    return np.asarray(pressure > _NEGLIGIBLE * pressure.max())


def _revise(
    problem: ContactProblem, status: _Status, trial: _Trial, held: BoolArray, careful: bool
) -> tuple[_Status, bool]:
    """Return a status that the trial does not contradict, and whether nothing changed."""
    p = trial.pressure
    separation = trial.separation
    slip = _revised_slip(problem, status, trial, careful)
    settled = np.array_equal(slip, status.slip)
    law = problem.interface.normal_law
    if not law:
        # Let go of rings that pull, and catch rings that would pass through the indenter.
        pull = -p / abs(p).max(initial=1e-300)
        overlap = -separation / max(abs(trial.depth), 1e-300)
        wrong = np.where(status.pressing, pull, overlap)
        wrong[held] = 0.0
        pressing = status.pressing ^ _changing(wrong, careful)
        settled &= np.array_equal(pressing, status.pressing)
    else:
        # Where the surfaces part, the linear equations' own separation; where they close, the one
        # at which the (convex) law bears the linear equations' pressure.
        before = status.separation
        parting = np.maximum(separation, np.minimum(before, 0.0) - _PLUNGE * law.length)
        closing = status.pressing & (separation < before) & (p > 0)
        borne = law.separation(np.where(closing, p, 1.0), problem.film)
        separation = np.where(closing, np.clip(borne, separation, before), parting)
        pressing = _bearing(problem, law, separation)
    if not problem.interface.rigid:
        settled &= abs(p - status.pressure).max() <= _SETTLED * p.max()
    length = problem.interface.slip_length
    stretch = np.clip(trial.outward - status.anchor, -length, length)
    return _Status(pressing, slip, status.anchor, separation, p, stretch), settled


def _changing(wrong: FloatArray, careful: bool) -> BoolArray:
    """Return the rings whose status is too wrong to stay, or the worst of them alone."""
    changing = wrong > _SLACK
    if careful:
        changing &= np.arange(wrong.size) == np.argmax(wrong)
    return changing


def _revised_slip(
    problem: ContactProblem, status: _Status, trial: _Trial, careful: bool
) -> FloatArray:
    """Let rings slip whose shear is too large, and stick that would be pushed on by friction."""
    mu = problem.friction
    if mu == 0 or np.isinf(mu):
        return status.slip
    p = np.maximum(trial.pressure, 0.0)
    q = trial.shear
    u = trial.outward
    sticks = status.slip == 0
    stretch = u - status.anchor
    length = problem.interface.slip_length
    excess = (abs(q) - mu * p) / (mu * abs(trial.pressure).max())
    # A slipping ring stretches the interface by its slip length, against the shear; on the axis
    # nothing slips.
    pushed = (status.slip * stretch + length) / (abs(u).max() + length)
    pushed *= problem.compliance.r > 0
    changing = _changing(np.where(sticks, excess, pushed) * status.pressing, careful)
    # A ring that friction would push on far enough to slip back does so at once (the trial shear
    # of Alart and Curnier); sticking first, it could go back and forth for ever.
    turn = 2 * mu * p * problem.compliance.radial
    turns = abs(stretch) > np.maximum(turn, length)
    turned = np.where(turns, -np.sign(stretch), 0)
    return np.where(changing, np.where(sticks, np.sign(q), turned), status.slip)
