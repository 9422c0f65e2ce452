r"""The linear equations of a contact whose rings' statuses are known.

Unknown are the pressure of every pressing ring, the shear of every sticking ring, and the depth.
A slipping ring's shear is :math:`\pm\mu p`.  A compliant interface is linearised at a trial.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import ConvergenceError
from memscal.mechanics.solver.problem import ContactProblem, Depth, Goal, Load
from memscal.model.validation import FloatArray

__all__ = ["Statuses", "Tractions", "solve_system"]

_Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Statuses:
    """What is taken for granted while the equations are solved; arrays over the n rings.

    Parameters
    ----------
    pressing : ndarray of bool
        Rings that bear a pressure.
    slip : ndarray of int8
        Sign of the shear where a ring slips, 0 where it sticks.
    anchor : ndarray
        Outward displacement (m) at which a sticking ring bears no shear.
    separation : ndarray
        Trial of the separation (m), where the interface is normally compliant.
    pressure, stretch : ndarray
        Trial of the pressure (Pa) and of the interface's elastic stretch (m), where the
        interface is tangentially compliant.
    """

    pressing: NDArray[np.bool_]
    slip: NDArray[np.int8]
    anchor: FloatArray
    separation: FloatArray
    pressure: FloatArray
    stretch: FloatArray


@dataclass(frozen=True, eq=False)
class Tractions:
    """Pressure and shear (Pa) at the rings, and the depth (m)."""

    pressure: FloatArray
    shear: FloatArray
    depth: float


def solve_system(problem: ContactProblem, statuses: Statuses, goal: Goal) -> Tractions:
    """Return the tractions and the depth that fulfil the equations of ``statuses`` and ``goal``."""
    c, mu = problem.compliance, problem.friction
    off_axis = c.r > 0
    rows = np.flatnonzero(statuses.pressing)
    sticks = statuses.pressing & (statuses.slip == 0) & off_axis
    stuck = np.flatnonzero(sticks) if mu > 0 else rows[:0]
    # Shear of a slipping ring per pressure.  Nothing slips where friction has no bound.
    bounded = mu if math.isfinite(mu) else 0.0
    ratio = bounded * np.where(off_axis, statuses.slip, 0)[rows]

    # In units of the film's own compliance, the matrix mixes pressures with pressures.
    unit = c.normal[0, 0]
    normal = np.hstack(
        [
            c.normal[:, rows] + c.normal_by_shear[:, rows] * ratio,
            c.normal_by_shear[:, stuck],
            np.full((problem.size, 1), -unit),
        ]
    )
    radial = np.hstack(
        [
            c.radial_by_pressure[np.ix_(stuck, rows)] + c.radial[np.ix_(stuck, rows)] * ratio,
            c.radial[np.ix_(stuck, stuck)],
            np.zeros((stuck.size, 1)),
        ]
    )
    last, wanted = _goal_row(problem, goal, normal, rows, unit)
    matrix = np.vstack([normal[rows], radial, last])
    right = np.concatenate([-problem.heights[rows], statuses.anchor[stuck], [wanted]])
    _add_normal_compliance(problem, statuses, rows, matrix, right)
    if problem.interface.slip_length > 0 and math.isfinite(mu):
        _add_tangential_compliance(problem, statuses, (rows, stuck), matrix, right)
    try:
        found = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            "The equations of the contact have no solution.",
            why=f"{rows.size} rings press and {stuck.size} of them stick, on the way to {goal}.",
            cure="Check film, indenter and loads, and their units; try another number of rings.",
        ) from error

    pressure, shear = np.zeros(problem.size), np.zeros(problem.size)
    pressure[rows] = found[: rows.size]
    shear[rows] = ratio * found[: rows.size]
    shear[stuck] = found[rows.size : -1]
    return Tractions(pressure, shear, float(found[-1]) * unit)


def _goal_row(
    problem: ContactProblem, goal: Goal, normal: FloatArray, rows: _Indices, unit: float
) -> tuple[FloatArray, float]:
    """Return the equation that ends the step, of the size of the others."""
    row = np.zeros(normal.shape[1])
    if isinstance(goal, Load):
        areas = problem.compliance.areas
        scale = unit / areas.sum()
        row[: rows.size] = areas[rows] * scale
        return row, goal.value * scale
    if isinstance(goal, Depth):
        row[-1] = unit
        return row, goal.value
    return normal[goal.ring], -float(problem.heights[goal.ring])


def _add_normal_compliance(
    problem: ContactProblem,
    statuses: Statuses,
    rows: _Indices,
    matrix: FloatArray,
    right: FloatArray,
) -> None:
    """Replace g = 0 by g = F^-1(p), linearised at the trial's separation."""
    law = problem.normal_law
    if law is None:
        return
    gap = statuses.separation[rows]
    stiffness = law.stiffness(gap, problem.film)
    own = np.arange(rows.size)
    matrix[own, own] += 1 / stiffness
    right[own] += gap + law.pressure(gap, problem.film) / stiffness


def _add_tangential_compliance(
    problem: ContactProblem,
    statuses: Statuses,
    indices: tuple[_Indices, _Indices],
    matrix: FloatArray,
    right: FloatArray,
) -> None:
    r"""Replace :math:`u = u^0` by :math:`\mu p\,(u - u^0) + \ell q = 0`, linearised.

    The equation is divided by what keeps it of the size of the others, also where p vanishes.
    """
    rows, stuck = indices
    mu, length = problem.friction, problem.interface.slip_length
    limit = mu * np.maximum(statuses.pressure[stuck], 0.0)
    size = limit + length / np.diagonal(problem.compliance.radial)[stuck]
    here = rows.size + np.arange(stuck.size)
    matrix[here] *= (limit / size)[:, None]
    right[here] *= limit / size
    matrix[here, here] += length / size
    pull = mu * statuses.stretch[stuck] / size
    matrix[here, np.searchsorted(rows, stuck)] += pull
    right[here] += pull * statuses.pressure[stuck]
