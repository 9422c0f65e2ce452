"""From messy positions to a grid: which readings belong to the same place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.validation import FloatArray

__all__ = ["Grid", "find_grid", "group_positions", "spacing_in_words", "typical_spacing"]

IntArray = NDArray[np.int64]
_CANDIDATES = 200
# Positions closer than this, of the typical spacing, differ by rounding only.
_EQUAL = 1e-6
_FINER = np.array([1.0, 0.3, 0.1, 0.03, 0.01])


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


def group_positions(
    what: str, positions: FloatArray, repeat: IntArray, tolerance: float, *, closeness: float = 0.0
) -> Grid:
    """Find the common places of repeated line scans, evenly spaced or not.

    The smallest spacing within one repeat is the measure: readings of different repeats
    belong together where they are closer than ``tolerance`` times that spacing.  A place is
    the mean of its readings.

    Parameters
    ----------
    what : str
        Name of the axis, for the message.
    positions, repeat : ndarray, shape (n,)
        Positions in m, and the repeat that each belongs to.
    tolerance : float
        Largest allowed deviation from a place, as a fraction of the smallest spacing.
    closeness : float
        Readings of one repeat closer than this fraction of its typical spacing share a place
        too, unless places would then be wider than the tolerance; 0 if none may.

    Raises
    ------
    InputError
        If readings that belong together are spread further than the tolerance, or one
        repeat has two readings at one place although none may.
    """
    if not closeness:
        grid = _grouped(what, positions, _smallest_spacing(positions, repeat, 0.0), tolerance)
        if np.unique(np.stack([repeat, grid.index]), axis=1).shape[1] < positions.size:
            raise _two_readings(what)
        return grid
    typical = max(typical_spacing(positions[repeat == k]) for k in np.unique(repeat))
    refusals = []
    # Where a line is dense in the middle, a smaller distance tells its places from one another.
    for share in (*(closeness * _FINER), _EQUAL):
        try:
            step = _smallest_spacing(positions, repeat, share * typical)
            return _grouped(what, positions, step, tolerance)
        except InputError as refusal:
            refusals.append(refusal)
    raise refusals[0]


def typical_spacing(positions: FloatArray) -> float:
    """Return the gap in which half of the length lies: repeated positions do not change it.

    Examples
    --------
    >>> round(typical_spacing(np.array([0.0, 0.01, 0.5, 0.51, 1.0, 1.01])), 2)
    0.49
    """
    gaps = np.sort(np.diff(np.sort(positions)))
    if gaps.size == 0:
        return 0.0
    covered = np.cumsum(gaps)
    return float(gaps[np.searchsorted(covered, 0.5 * covered[-1])])


def spacing_in_words(places: FloatArray, tolerance: float) -> str:
    """Say how far apart places are: by the step of their lattice, or from the least to the most.

    Examples
    --------
    >>> spacing_in_words(np.array([0.0, 0.501, 0.999, 1.5]) * 1e-3, 0.1)
    '0.4998 mm apart'
    >>> spacing_in_words(np.array([0.0, 0.1, 0.2, 1.2]) * 1e-3, 0.1)
    '0.1 to 1 mm apart'
    """
    gaps = np.diff(places)
    if gaps.size == 0:
        return "alone"
    lattice = _fit(places, np.arange(places.size), gaps, float(np.median(gaps)))
    if (
        lattice is None
        or lattice.deviation > tolerance * lattice.step
        or np.ptp(lattice.index) > (2 * places.size)
    ):
        return f"{gaps.min() * 1e3:.4g} to {gaps.max() * 1e3:.4g} mm apart"
    holes = lattice.places.size - places.size
    tail = f", with {holes} left out between them" if holes else ""
    return f"{lattice.step * 1e3:.4g} mm apart{tail}"


def _grouped(what: str, positions: FloatArray, step: float, tolerance: float) -> Grid:
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


def _smallest_spacing(positions: FloatArray, repeat: IntArray, closer: float) -> float:
    """Return the smallest spacing within a repeat, but for those that are too close to be one."""
    gaps = [np.diff(np.sort(positions[repeat == k])) for k in np.unique(repeat)]
    spacings = np.concatenate(gaps)
    if closer > 0:
        spacings = spacings[spacings > closer]
    if spacings.size == 0:
        raise InputError(
            "No repeat has two readings at different positions.",
            cure="Check the column of positions, and the one that numbers the repeats.",
        )
    if spacings.min() == 0:
        raise _two_readings("position")
    return float(spacings.min())


def _two_readings(what: str) -> InputError:
    return InputError(
        f"One repeat has two readings at the same {what}.",
        cure='Average them (repeats="average"; --repeats average), name the column that numbers '
        "the repeats, or remove one of the readings.",
    )


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
