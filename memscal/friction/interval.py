r"""Confidence intervals by profile likelihood, of a parameter with two bounds of its own.

A friction coefficient is not negative, and beyond full stick nothing changes any more.  On the
bounded coordinate :math:`t = \theta/(\theta + \theta_0)` the interval is

.. math:: \{t : \chi^2(t) - \min \chi^2 \le \chi^2_{1,p}\} ,

and where it holds an end of the coordinate it has no end there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtri

from memscal.friction.results import Interval
from memscal.model.notation import format_bound
from memscal.model.validation import FloatArray

__all__ = ["Profiled", "profiled", "reason_of"]

LEVEL = 0.95
#: Level of one standard deviation of a normal distribution.
_ONE_SIGMA = 0.6827
_STEPS = 40


@dataclass(frozen=True)
class Profiled:
    """What a profile likelihood says.

    Parameters
    ----------
    best : float
        Value of least chi-square; at an end it may be ``inf``.
    least : float
        Least chi-square.
    interval, narrow : Interval
        At the level that was asked for, and at 68.3 %.
    open_low, open_high : bool
        Whether the interval reaches the first and the last value.
    """

    best: float
    least: float
    interval: Interval
    narrow: Interval
    open_low: bool
    open_high: bool

    @property
    def standard_uncertainty(self) -> float | None:
        """Half of the interval of 68.3 %; ``None`` where an end is open."""
        if self.narrow.high is None or self.narrow.low <= 0:
            return None
        return (self.narrow.high - self.narrow.low) / 2


def profiled(
    coordinates: FloatArray,
    chi_square: FloatArray,
    value_at: Callable[[float], float],
    *,
    level: float = LEVEL,
) -> Profiled:
    """Return best value and intervals of chi-square along a bounded coordinate.

    Parameters
    ----------
    coordinates : ndarray, shape (m,)
        Increasing, fine enough for a cubic spline.
    chi_square : ndarray, shape (m,)
        Least chi-square over everything else.
    value_at : callable
        Takes a coordinate to the parameter's value.
    level : float
        Coverage of the interval.

    Examples
    --------
    >>> t = np.linspace(0, 1, 101)
    >>> found = profiled(t, ((t - 0.4) / 0.1) ** 2, lambda t: t)
    >>> print(f"{found.best:.2f}, {found.interval.low:.3f} to {found.interval.high:.3f}")
    0.40, 0.204 to 0.596
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(coordinates, chi_square)
    best = _minimum(spline, coordinates, chi_square)
    least = float(spline(best))
    first, last = float(coordinates[0]), float(coordinates[-1])

    def interval(at: float) -> tuple[Interval, bool, bool]:
        rise = float(chdtri(1, 1 - at))
        inside = np.append(coordinates[chi_square - least <= rise], best)
        low = _crossing(spline, coordinates, float(inside.min()), -1, least + rise)
        high = _crossing(spline, coordinates, float(inside.max()), 1, least + rise)
        bounds = Interval(
            0.0 if low is None else value_at(low), None if high is None else value_at(high), at
        )
        return bounds, low is None, high is None

    wide, open_low, open_high = interval(level)
    end = best if first < best < last else (first if best <= first else last)
    return Profiled(value_at(end), least, wide, interval(_ONE_SIGMA)[0], open_low, open_high)


def _minimum(spline: Any, coordinates: FloatArray, chi_square: FloatArray) -> float:
    """Lowest point of the spline next to the lowest node."""
    i = int(np.argmin(chi_square))
    around = slice(max(i - 1, 0), i + 2)
    low, high = coordinates[around][0], coordinates[around][-1]
    turns = spline.derivative().roots(extrapolate=False)
    candidates = [float(coordinates[i]), *(float(t) for t in turns if low < t < high)]
    return min(candidates, key=lambda t: float(spline(t)))


def _crossing(
    spline: Any, coordinates: FloatArray, start: float, side: int, level: float
) -> float | None:
    """Where the spline rises through a level next to an inside point; None beyond the ends."""
    beyond = coordinates[coordinates * side > start * side]
    if not beyond.size:
        return None
    inside, outside = start, float(beyond.min() if side > 0 else beyond.max())
    if spline(outside) <= level:
        return None
    for _ in range(_STEPS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if spline(middle) <= level else (inside, middle)
    return (inside + outside) / 2


def reason_of(found: Profiled, last: float, what: str = "friction coefficient") -> str:
    """Say in words why a profile likelihood gives no value; empty where it gives one.

    Parameters
    ----------
    found : Profiled
        What the likelihood says.
    last : float
        Last value that was calculated; ``inf`` is full stick.
    what : str
        Name of the parameter.
    """
    if not found.open_high:
        return ""
    end = "full stick" if np.isinf(last) else f"{last:.3g}, the last one calculated,"
    if found.open_low:
        return (
            f"The {what} is not identifiable: no friction and {end} agree with the data "
            "equally well."
        )
    bound = format_bound(found.interval.low, upper=False)
    return (
        f"The {what} is not identifiable above {bound}: every larger one, {end} included, agrees "
        "with the data as well. This is a lower bound."
    )
