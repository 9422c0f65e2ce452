"""From messy positions to a grid: which readings belong to the same place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.validation import FloatArray

__all__ = ["Grid", "find_grid", "group_positions"]

IntArray = NDArray[np.int64]
_CANDIDATES = 200


@dataclass(frozen=True, eq=False)
class Grid:
    """Places, and the place of each reading.

    ``places`` (m,) in m, ``index`` (n,) into it, ``step`` (smallest spacing) and
    ``deviation`` (largest distance of a reading from its place) in m.
    """

    places: FloatArray
    index: IntArray
    step: float
    deviation: float


def find_grid(what: str, positions: FloatArray, tolerance: float) -> Grid:
    """Fit an evenly spaced grid to positions: the coarsest that meets all of them.

    Parameters
    ----------
    what : str
        Name of the axis, for the message.
    positions : ndarray, shape (n,)
        Positions in m, in any order, with repeats and gaps.
    tolerance : float
        Largest allowed deviation, as a fraction of the step.

    Returns
    -------
    Grid
        Its places fill gaps: a place without a reading is one where the scan has none.

    Raises
    ------
    InputError
        If no evenly spaced grid meets all positions.

    Examples
    --------
    >>> grid = find_grid("x", np.array([0.0, 1.0002, 2.9999, 1.0]) * 1e-3, 0.1)
    >>> grid.index
    array([0, 1, 3, 1])
    >>> round(grid.step * 1e3, 3)
    1.0
    """
    order = np.argsort(positions, kind="stable")
    gaps = np.diff(positions[order])
    best: Grid | None = None
    for step in _candidate_steps(positions, gaps):
        grid = _fit(positions, order, gaps, step)
        if grid is None:
            continue
        if grid.deviation <= tolerance * grid.step:
            return grid
        if best is None or grid.deviation / grid.step < best.deviation / best.step:
            best = grid
    raise _no_grid(what, best, tolerance)


def group_positions(what: str, positions: FloatArray, repeat: IntArray, tolerance: float) -> Grid:
    """Find the common places of repeated line scans, evenly spaced or not.

    The smallest spacing within one repeat is the measure: readings of different repeats
    belong together where they are closer than ``tolerance`` times that spacing.  A place is
    the mean of its readings.

    Raises
    ------
    InputError
        If readings that belong together are spread further than the tolerance, or one
        repeat has two readings at one place.
    """
    step = _smallest_spacing(positions, repeat)
    order = np.argsort(positions, kind="stable")
    new_place = np.diff(positions[order]) > 0.5 * step
    index = np.empty(positions.size, dtype=np.int64)
    index[order] = np.concatenate([[0], np.cumsum(new_place)])
    number = np.bincount(index)
    places = np.bincount(index, weights=positions) / number
    deviation = float(np.abs(positions - places[index]).max())
    if deviation > tolerance * step:
        raise InputError(
            f"Repeats of {what} lie up to {deviation * 1e3:.4g} mm from their common place; "
            f"{tolerance:g} of the smallest spacing ({step * 1e3:.4g} mm) is allowed.",
            cure="Raise the grid tolerance if the positions are as good as that.",
        )
    if np.unique(np.stack([repeat, index]), axis=1).shape[1] < positions.size:
        raise InputError(
            f"One repeat has two readings at the same {what}.",
            cure="Name the column that numbers the repeats, or remove one of the readings.",
        )
    return Grid(places, index, step, deviation)


def _candidate_steps(positions: FloatArray, gaps: FloatArray) -> list[float]:
    """Return distinct gaps, the widest first: one of them is the step, the rest noise and holes."""
    resolution = 1e-9 * max(float(np.ptp(positions)), float(np.abs(positions).max()) * 1e-3)
    distinct = np.unique(gaps[gaps > resolution])[::-1]
    if distinct.size > _CANDIDATES:
        chosen = np.linspace(0, distinct.size - 1, _CANDIDATES).astype(int)
        distinct = distinct[chosen]
    return [float(gap) for gap in distinct]


def _fit(positions: FloatArray, order: IntArray, gaps: FloatArray, step: float) -> Grid | None:
    """Number the readings by steps from one to the next, then fit start and step to them."""
    number = np.concatenate([[0], np.cumsum(np.round(gaps / step))]).astype(np.int64)
    if number[-1] == 0 or number[-1] > 10**6:
        return None
    ordered = positions[order]
    centred = number - number.mean()
    fitted = float(np.sum(centred * (ordered - ordered.mean())) / np.sum(centred**2))
    if not fitted > 0:
        return None
    start = float(ordered.mean() - fitted * number.mean())
    places = start + fitted * np.arange(number[-1] + 1)
    index = np.empty(positions.size, dtype=np.int64)
    index[order] = number
    deviation = float(np.abs(positions - places[index]).max())
    return Grid(places, index, fitted, deviation)


def _smallest_spacing(positions: FloatArray, repeat: IntArray) -> float:
    spacings = [
        np.diff(np.sort(positions[repeat == k])).min(initial=np.inf) for k in np.unique(repeat)
    ]
    smallest = float(min(spacings))
    if not (np.isfinite(smallest) and smallest > 0):
        raise InputError(
            "One repeat has two readings at the same position, or fewer than two readings.",
            cure="Name the column that numbers the repeats, or remove one of the readings.",
        )
    return smallest


def _no_grid(what: str, best: Grid | None, tolerance: float) -> InputError:
    if best is None:
        return InputError(
            f"All readings have the same {what}.", cure="Leave this axis out, or check the column."
        )
    return InputError(
        f"The positions along {what} do not lie on an evenly spaced grid.",
        why=f"The best one has a step of {best.step * 1e3:.4g} mm and readings up to "
        f"{best.deviation * 1e3:.4g} mm away from it; {tolerance:g} of the step is allowed.",
        cure="Check the column and its unit, or raise the grid tolerance.",
    )
