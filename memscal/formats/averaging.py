"""Means of repeated readings, with a pooled spread that a few outliers do not carry away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.formats.grid import IntArray
from memscal.model.validation import FloatArray

__all__ = ["Average", "average"]

BoolArray = NDArray[np.bool_]

# Chance that a whole table of Gaussian readings loses one of them.
_CHANCE = 0.01
# The median of absolute normal deviates, in standard deviations.
_MEDIAN = 0.6744897501960817
# Degrees of freedom that a median is worth, of each difference: its efficiency for Gaussian noise.
_EFFICIENCY = 0.37
# Neighbouring places that share a measure of spread: noise may grow with the signal.
_NEIGHBOURS = 6


@dataclass(frozen=True, eq=False)
class Average:
    """Means of readings that share a place.

    ``mean`` and ``errors``, its standard uncertainty, have shape (places,); both are NaN where
    nothing was read, and ``errors`` is ``None`` where no place was read twice.  ``kept`` and
    ``deviation`` have shape (readings,): whether a reading is part of its mean, and how many
    standard deviations it lies from the mean of the others.  ``disagreeing`` (places,) marks
    those whose readings differ too much, while none can be called the outlier.  ``spread`` is
    the pooled standard deviation of single readings, with ``freedom`` degrees of freedom.
    """

    mean: FloatArray
    errors: FloatArray | None
    kept: BoolArray
    deviation: FloatArray
    disagreeing: BoolArray
    spread: float
    freedom: int


def average(values: FloatArray, place: IntArray, size: int) -> Average:
    r"""Average readings by place, and leave out those that do not belong to their place.

    A first measure of spread is the median of the absolute differences of successive
    readings of a place, over :math:`0.6745\sqrt2`: up to a quarter of the readings may be
    outliers before it fails, and, unlike deviations from a place's own centre, differences
    need no correction for the few readings of a place.  Noise may grow with the signal or its
    slope, so neighbouring places are measured apart too, and the largest measure counts.

    A reading is outlying where it differs from the mean of the others of its place by more
    than Student's t explains, so that one table of Gaussian readings in a hundred loses one.
    The degrees of freedom are those that the median is worth.  The worst reading of a place
    goes first; the majority of a place always stays.  Where it cannot, as with two readings,
    all stay, and the uncertainty there is that of their own spread.

    The pooled standard deviation is the usual one of all that is kept,
    :math:`s^2 = \sum (u - \bar u)^2 / (N - m)` for N readings at m places: unbiased, but for
    the one table in a hundred.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Readings; NaN is none.
    place : ndarray, shape (n,)
        The place of each, from 0 to ``size - 1``; neighbours have neighbouring numbers.
    size : int
        Number of places.

    Examples
    --------
    >>> readings = np.array([1.0, 1.1, 0.9, 1.0, 1.1, 9.0, 1.1, 1.0, 0.9, 1.0, 0.9, 1.1])
    >>> found = average(readings, np.arange(12) // 3, 4)
    >>> np.flatnonzero(~found.kept)
    array([5])
    >>> found.mean
    array([1.  , 1.05, 1.  , 1.  ])
    """
    read = np.isfinite(values)
    kept, deviation, disagreeing = read.copy(), np.zeros(values.size), np.zeros(size, dtype=bool)
    freedom = int(read.sum()) - np.unique(place[read]).size
    if freedom > 0:
        allowed = _allowed(int(read.sum()), freedom)
        scale = _scales(values[read], place[read], size)
        found = _sift(values[read], place[read], scale, allowed)
        kept[read], deviation[read], disagreeing = found
    number, mean = _means(values, place, size, kept)
    if freedom == 0:
        return Average(mean, None, kept, deviation, disagreeing, np.nan, 0)
    square = np.zeros(values.size)
    square[kept] = (values[kept] - mean[place[kept]]) ** 2
    squares = np.bincount(place, weights=square, minlength=size)
    own = np.sqrt(squares / np.maximum(number - 1, 1))
    steady = ~disagreeing
    freedom = int(np.sum(np.maximum(number[steady] - 1, 0)))
    spread = float(np.sqrt(np.sum(squares[steady]) / freedom)) if freedom else float(own.max())
    scatter = np.where(disagreeing, own, spread)
    errors = np.divide(scatter, np.sqrt(number), out=np.full(size, np.nan), where=number > 0)
    return Average(mean, errors, kept, deviation, disagreeing, spread, freedom)


def _allowed(readings: int, freedom: int) -> float:
    """Return the largest deviation that chance explains, in standard deviations."""
    from scipy.special import stdtrit

    return float(-stdtrit(_EFFICIENCY * freedom, _CHANCE / (2 * readings)))


def _scales(values: FloatArray, place: IntArray, size: int) -> FloatArray:
    """Return a spread of single readings for each place, from differences of successive ones."""
    order = np.argsort(place, kind="stable")
    ordered, places = values[order], place[order]
    same = places[1:] == places[:-1]
    differences, at = np.abs(np.diff(ordered))[same], places[1:][same]
    unit = np.sqrt(2.0) * _MEDIAN
    # No spread is finer than the steps in which the voltage was recorded.
    resolution = np.diff(np.unique(values)).min(initial=np.inf)
    overall = max(float(np.median(differences)) / unit, resolution if differences.any() else 0.0)
    scale = np.full(size, overall)
    repeated, number = np.unique(at, return_counts=True)
    blocks = np.array_split(np.arange(repeated.size), max(repeated.size // _NEIGHBOURS, 1))
    ends = np.cumsum([number[block].sum() for block in blocks])
    spreads = [float(np.median(part)) / unit for part in np.split(differences, ends[:-1])]
    padded = np.pad(np.maximum(spreads, overall), 1, mode="edge")
    # The border of a noisy region may lie within a block, whose median does not see it.
    widest = np.max([padded[:-2], padded[1:-1], padded[2:]], axis=0)
    scale[repeated] = np.repeat(widest, [block.size for block in blocks])
    return scale


def _sift(
    values: FloatArray, place: IntArray, scale: FloatArray, allowed: float
) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Drop the worst reading of each place until all of it belongs together, or none can go."""
    size = scale.size
    kept = np.ones(values.size, dtype=bool)
    deviation = np.zeros(values.size)
    disagreeing = np.zeros(size, dtype=bool)
    full = np.bincount(place, minlength=size)
    while True:
        number, mean = _means(values, place, size, kept)
        lone = np.sqrt(number / np.maximum(number - 1, 1))[place]
        apart = np.where(kept, np.abs(values - mean[place]) * lone, 0.0)
        apart[disagreeing[place] | (number[place] < 2)] = 0.0
        strange = apart > allowed * scale[place]
        order = np.lexsort((apart, place))
        last = np.append(place[order][1:] != place[order][:-1], True)
        worst = order[last][strange[order[last]]]
        if worst.size == 0:
            return kept, deviation, disagreeing
        at = place[worst]
        majority = 2 * (number[at] - 1) > full[at]
        deviation[worst] = apart[worst] / np.maximum(scale[at], np.finfo(float).tiny)
        kept[worst[majority]] = False
        split = at[~majority]
        disagreeing[split] = True
        kept[np.isin(place, split)] = True


def _means(
    values: FloatArray, place: IntArray, size: int, kept: BoolArray
) -> tuple[FloatArray, FloatArray]:
    number = np.bincount(place[kept], minlength=size).astype(np.float64)
    total = np.bincount(place[kept], weights=values[kept], minlength=size)
    return number, np.divide(total, number, out=np.full(size, np.nan), where=number > 0)
