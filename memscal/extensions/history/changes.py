r"""Tests for a change of a sensor between calibrations whose errors are correlated.

Values y of n dates have the covariance :math:`V = C + \tau^2 I`: C by what the calibrations state,
with what they share, and :math:`\tau` by what scatters between dates beyond that (mounting).  A
change is the coefficient of one more column z beside those of the stable sensor, by generalised
least squares,

.. math::

    \hat\beta = (X^T V^{-1} X)^{-1} X^T V^{-1} y, \qquad X = [X_0, z],

over its standard uncertainty; :math:`\tau` is that of the largest restricted likelihood with the
change allowed for, which would otherwise count as scatter.  The statistic has Student's
distribution, of more degrees of freedom the less of the variance is :math:`\tau^2` (Welch and
Satterthwaite; GUM, JCGM 100:2008, G.4.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chndtrinc, fdtrc, fdtri, ndtr, ndtri, stdtr, stdtrit

from memscal.model.arrays import TINY, FloatArray, Values, array_record, floats

LEVEL = 0.05
"""A change is significant below this probability."""
POWER = 0.95
"""Share of changes of a size that would have been seen."""
TESTS = ("newest", "homogeneity", "change_point", "trend")

#: Scatter between dates over what a date's own errors are; histories that are drawn.
_SCATTERS = np.append(0.0, np.geomspace(0.3, 30.0, 14))
_DRAWS = 1000
#: Scatter that counts as none, over a date's own errors.
_NEGLIGIBLE = 1e-3


@array_record
class Fitted:
    """A column's coefficient of several histories (m,), by their most likely scatter."""

    value: FloatArray
    uncertainty: FloatArray
    scatter: FloatArray
    degrees: FloatArray

    @property
    def statistic(self) -> FloatArray:
        """Absolute values over standard uncertainties."""
        return np.abs(self.value) / self.uncertainty

    @property
    def p_value(self) -> float:
        """Chance of such a coefficient of the first history, or a larger one."""
        return float(2 * stdtr(self.degrees[0], -self.statistic[0]))

    def detectable(self, level: float) -> float:
        """Size of which a test at a level would have seen 95 %."""
        factor = ndtri(POWER) - stdtrit(self.degrees[0], level / 2)
        return float(factor * self.uncertainty[0])


class _Likely(NamedTuple):
    """Generalised least squares: the last coefficient, and the logarithm of the likelihood."""

    value: FloatArray
    uncertainty: float
    likelihood: FloatArray
    chi_square: FloatArray


def _least_squares(columns: FloatArray, covariance: FloatArray, values: FloatArray) -> _Likely:
    weighed = np.linalg.solve(covariance, columns)
    information = columns.T @ weighed
    coefficients = np.linalg.solve(information, weighed.T @ values)
    residual = values - columns @ coefficients
    chi_square = np.sum(residual * np.linalg.solve(covariance, residual), axis=0)
    volume = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
    uncertainty = float(np.sqrt(np.linalg.inv(information)[-1, -1]))
    return _Likely(coefficients[-1], uncertainty, -(volume + chi_square) / 2, chi_square)


def fitted(
    values: FloatArray, base: FloatArray, column: FloatArray, covariance: FloatArray
) -> Fitted | None:
    """Fit a column beside those of the base to histories (n, m); none where it tells nothing."""
    columns = np.column_stack([base, column])
    freedom = len(columns) - columns.shape[1]
    if np.linalg.matrix_rank(columns) < columns.shape[1]:
        return None
    own = own_variance(columns, covariance)
    scatters = np.sqrt(own) * _SCATTERS[: None if freedom > 0 else 1]
    unit = np.eye(len(columns))
    fits = [_least_squares(columns, covariance + s**2 * unit, values) for s in scatters]
    best = np.argmax([fit.likelihood for fit in fits], axis=0)
    scatter = scatters[best]
    excess = np.maximum(scatter, _NEGLIGIBLE * np.sqrt(own)) ** 2
    degrees = max(freedom, 1) * (1 + own / excess) ** 2
    return Fitted(
        np.choose(best, [fit.value for fit in fits]),
        np.array([fit.uncertainty for fit in fits])[best],
        scatter,
        degrees,
    )


def own_variance(columns: FloatArray, covariance: FloatArray) -> float:
    """Return the mean variance of a date beside the columns: what dates share is left out."""
    count, parameters = columns.shape
    rest = np.eye(count) - columns @ np.linalg.pinv(columns)
    mean = np.trace(rest @ covariance) / max(count - parameters, 1)
    return float(max(mean, TINY))


def change_tests(
    values: FloatArray, base: FloatArray, covariance: FloatArray, years: FloatArray, level: float
) -> dict[str, Values]:
    """Return the tests of one history (n,) that tell something, by their names.

    Each has ``statistic``, ``p`` and ``seen``, the size of a step (or a change per year) of which
    a test at the level would have seen 95 %.
    """
    history = values[:, None]
    steps = _steps(history, base, covariance)
    trend = fitted(history, base, years - years.mean(), covariance)
    found = {}
    for name, change in (("newest", steps[-1] if steps else None), ("trend", trend)):
        if change is not None:
            found[name] = {
                "statistic": float(change.statistic[0]),
                "p": change.p_value,
                "seen": change.detectable(level),
            }
    if steps:
        found["change_point"] = _change_point(steps, base, covariance, level)
        found["homogeneity"] = _homogeneity(values, steps, base, covariance, level)
    return found


def _steps(values: FloatArray, base: FloatArray, covariance: FloatArray) -> list[Fitted]:
    """Fit a step at each date but the first; the last step is that of the newest date alone."""
    dates = np.arange(len(values))
    fits = [fitted(values, base, floats(dates >= i), covariance) for i in dates[1:]]
    return [fit for fit in fits if fit is not None]


def _largest(steps: Sequence[Fitted]) -> Fitted:
    """Return the most significant step of the first history."""
    return max(steps, key=lambda step: float(step.statistic[0]))


def _change_point(
    steps: Sequence[Fitted], base: FloatArray, covariance: FloatArray, level: float
) -> Values:
    """Hold the largest step against those of stable histories that are drawn."""
    # No distribution is known of the largest of several correlated statistics.
    largest = _largest(steps)
    total = covariance + largest.scatter[0] ** 2 * np.eye(len(base))
    normal = np.random.default_rng(0).normal(size=(len(base), _DRAWS))
    drawn = _steps(np.linalg.cholesky(total) @ normal, base, covariance)
    most = np.max([step.statistic for step in drawn], axis=0)
    statistic = float(largest.statistic[0])
    least = min(float(step.uncertainty[0]) for step in steps)
    factor = np.quantile(most, 1 - level) + ndtri(POWER)
    above = 1 + np.count_nonzero(most >= statistic)
    return {"statistic": statistic, "p": above / (_DRAWS + 1), "seen": float(factor * least)}


def _homogeneity(
    values: FloatArray,
    steps: Sequence[Fitted],
    base: FloatArray,
    covariance: FloatArray,
    level: float,
) -> Values:
    """Hold the chi-square of a stable sensor against what it is by chance."""
    # A step or a trend would count as scatter: that is taken from beside the largest step.
    largest = _largest(steps)
    freedom = len(values) - base.shape[1]
    total = covariance + largest.scatter[0] ** 2 * np.eye(len(values))
    chi_square = float(_least_squares(base, total, values[:, None]).chi_square[0])
    degrees = (freedom, largest.degrees[0])
    middle = floats(np.arange(len(values)) >= len(values) // 2)[:, None]
    # What a step of one adds to it.
    step = float(_least_squares(base, total, middle).chi_square[0])
    limit = freedom * fdtri(*degrees, 1 - level)
    seen = float(chndtrinc(limit, freedom, 1 - POWER))
    return {
        "statistic": chi_square,
        "p": float(fdtrc(*degrees, chi_square / freedom)),
        "seen": float(np.sqrt(seen / step)),
    }


def exceeded_after(
    history: FloatArray,
    base: FloatArray,
    covariance: FloatArray,
    years: FloatArray,
    tolerance: float,
) -> float:
    """Return after how many years a sensor has changed by more than a tolerance in 5 %.

    The change since the newest date is that of the trend, with its uncertainty, and of a random
    walk: each of its sizes counts by its likelihood.  It is at most the time that the history
    spans, beyond which nothing supports a line.
    """
    from scipy.optimize import brentq

    ahead = years - years[-1]
    trend = fitted(history, base, ahead, covariance)
    span = float(np.ptp(years))
    if trend is None:
        return 0.0
    columns = np.column_stack([base, ahead])
    total = covariance + trend.scatter[0] ** 2 * np.eye(len(years))
    since = years - years[0]
    walk = np.minimum.outer(since, since)
    own = own_variance(columns, covariance) / span
    sizes = np.sqrt(own) * _SCATTERS
    fits = [_least_squares(columns, total + size**2 * walk, history) for size in sizes]
    likelihood = np.array([fit.likelihood[0] for fit in fits])
    weights = np.exp(likelihood - likelihood.max())
    slopes = np.array([fit.value[0] for fit in fits])
    errors = np.array([fit.uncertainty for fit in fits])

    def beyond(time: float) -> float:
        spread = np.sqrt((errors * time) ** 2 + sizes**2 * time)
        above = ndtr((slopes * time - tolerance) / spread)
        below = ndtr((-tolerance - slopes * time) / spread)
        return float(weights @ (above + below) / weights.sum() - LEVEL)

    return span if beyond(span) < 0 else float(brentq(beyond, 1e-6, span))
