"""The interval of a friction coefficient, or of a length, by its profile likelihood."""

from collections.abc import Callable

import numpy as np
from scipy.special import chdtri

from memscal.friction.family import unbounded
from memscal.friction.results import BoundedEstimate, Interval
from memscal.model.arrays import FloatArray
from memscal.model.notation import format_bound

_LEVEL = 0.95
#: Level of one standard deviation of a normal distribution.
_ONE_SIGMA = 0.6827


def profile_estimate(
    values: FloatArray,
    coordinates: FloatArray,
    deviance: FloatArray,
    chi_square: FloatArray,
    scale: float,
    *,
    reason: Callable[[Interval, float], str],  # of the interval, and of the last value
    two_sided: bool = False,
    unit: str = "",
) -> BoundedEstimate:
    """Return best value and interval of -2 ln p (m,) along the bounded coordinate of a scale."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(coordinates, deviance)
    # The lowest point of the spline next to the lowest node.
    i = deviance.argmin()
    around = coordinates[max(i - 1, 0) : i + 2]
    turns = spline.derivative().roots(extrapolate=False)
    turns = turns[(around[0] < turns) & (turns < around[-1])]
    best = min([coordinates[i], *turns], key=spline)
    lowest = float(spline(best))

    def interval_of(level: float) -> Interval:
        """Values whose -2 ln p is no larger than the level allows."""
        top = lowest + chdtri(1, 1 - level)
        crossings = unbounded(spline.solve(top, extrapolate=False), scale)
        # An end that the level allows is beyond what was calculated.
        low = 0.0 if deviance[0] <= top else float(crossings.min())
        high = None if deviance[-1] <= top else float(crossings.max())
        return Interval(low, high, level)

    interval = interval_of(_LEVEL)
    value = None
    spread = None
    # Without an upper end there is no value, with ``two_sided`` without both; ``reason`` says why.
    if interval.two_sided or (interval.high is not None and not two_sided):
        value = float(unbounded(best, scale))
        narrow = interval_of(_ONE_SIGMA)
        if narrow.high and narrow.low > 0:
            spread = (narrow.high - narrow.low) / 2
    least = float(CubicSpline(coordinates, chi_square)(best))
    above = deviance - lowest + least
    words = reason(interval, values[-1])
    return BoundedEstimate(value, spread, interval, words, values, above, least, unit=unit)


def friction_reason(interval: Interval, last: float) -> str:
    """Say why there is no friction coefficient, ``last`` being the last one that was calculated."""
    if interval.high is not None:
        return ""
    end = "full stick" if np.isinf(last) else f"{last:.3g}, the last one calculated,"
    above = ""
    if interval.low > 0:
        above = f" above {format_bound(interval.low, upper=False)}, a lower bound"
    return (
        f"The friction coefficient is not identifiable{above}: every larger one, {end} included, "
        "agrees with the data as well."
    )
