"""The wafer: its smooth trend, how far sensors are from it, and rows and columns of places."""

import numpy as np

from memscal.extensions.fleet.results import FleetResults, median, robust_limit, robust_spread
from memscal.model.arrays import TINY, FloatArray

FEWEST = 24
"""Sensors with a value and a place that a trend takes: four for each of its terms."""
_TERMS = 6
#: Steps by which the weights of a robust fit settle, and where they stop to grow.
_STEPS = 20
_SMALL = 0.01
#: Part of a pitch by which places may be rounded.
_ROUNDING = 0.01


def trend(fleet: FleetResults, values: FloatArray) -> FloatArray:
    """Return a robust quadratic in x and y at the places of the values, NaN where there is none."""
    smooth = np.full(values.size, np.nan)
    some = np.isfinite(values + fleet.wafer_x + fleet.wafer_y)
    if some.sum() < FEWEST:
        return smooth
    x = fleet.wafer_x[some]
    y = fleet.wafer_y[some]
    terms = np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    # Least absolute deviations, by least squares whose weights come from the step before.
    fitted = np.full(x.size, median(values))
    for _ in range(_STEPS):
        residuals = values[some] - fitted
        smallest = _SMALL * robust_spread(residuals) + TINY
        weights = 1 / np.sqrt(np.hypot(residuals, smallest))
        weighted = terms * weights[:, None]
        fitted = terms @ np.linalg.lstsq(weighted, values[some] * weights)[0]
    smooth[some] = fitted
    return smooth


def deviations(fleet: FleetResults, name: str) -> FloatArray:
    """Return how far outliers are from the trend, or the median, in robust standard deviations.

    It is 0 of sensors as near as chance and their own uncertainty let them be.
    """
    values = getattr(fleet, name)
    u = getattr(fleet, f"{name}_errors")
    smooth = trend(fleet, values)
    placed = np.isfinite(smooth)
    distance = values - np.where(placed, smooth, median(values))
    # As many residuals as the trend has terms are all but zero.
    free = max(placed.sum() - _TERMS, 1)
    about_trend = robust_spread(distance[placed]) * placed.sum() / free
    spread = np.where(placed, about_trend, robust_spread(values))
    # Where most values are the same, others are as far as their uncertainty says.
    spread[spread == 0] = median(u) or 1.0
    limit = np.where(placed, robust_limit(free), robust_limit(np.isfinite(values).sum()))
    return np.where(np.abs(distance) > limit * spread + u, distance / spread, 0.0)


def lattice(places: FloatArray) -> FloatArray:
    """Return rows or columns, whole numbers, of places: how many pitches they are from zero."""
    known = np.unique(places[np.isfinite(places)].round(6))
    pitch = min(np.diff(known), default=1.0)
    return np.floor(places / pitch + _ROUNDING)
