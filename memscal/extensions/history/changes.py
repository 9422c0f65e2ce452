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

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chndtrinc, fdtrc, fdtri, ndtr, ndtri, stdtr, stdtrit

from memscal.model.arrays import TINY, FloatArray, Values, array_record

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
#: Time in years below which a calibration is due now.
_DAY = 1 / 365.25


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

    def stated(self, unit: str) -> Values:
        """Return the coefficient of the first history as JSON holds it."""
        return {
            "value": float(self.value[0]),
            "standard_uncertainty": float(self.uncertainty[0]),
            "unit": unit,
        }

    def test(self, level: float) -> Values:
        """Return the test of the first history, and the size of which it would have seen 95 %."""
        statistic = float(self.statistic[0])
        degrees = self.degrees[0]
        factor = ndtri(POWER) - stdtrit(degrees, level / 2)
        return {
            "statistic": statistic,
            "p": float(2 * stdtr(degrees, -statistic)),
            "seen": float(factor * self.uncertainty[0]),
        }


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
    uncertainty = np.sqrt(np.linalg.inv(information)[-1, -1])
    return _Likely(coefficients[-1], uncertainty, -(volume + chi_square) / 2, chi_square)


def fitted(
    values: FloatArray, base: FloatArray, column: FloatArray, covariance: FloatArray
) -> Fitted | None:
    """Fit a column beside those of the base to histories (n, m); none where it tells nothing."""
    values = np.atleast_2d(values.T).T
    columns = np.column_stack([base, column])
    count, parameters = columns.shape
    freedom = count - parameters
    if np.linalg.matrix_rank(columns) < parameters:
        return None
    own = own_variance(columns, covariance)
    scatters = np.sqrt(own) * _SCATTERS[: None if freedom > 0 else 1]
    unit = np.eye(count)
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
    return float(max(np.trace(rest @ covariance) / max(count - parameters, 1), TINY))


def change_tests(
    values: FloatArray,
    base: FloatArray,
    covariance: FloatArray,
    years: FloatArray,
    names: Sequence[str],
    level: float,
) -> dict[str, Values]:
    """Return the tests of one history (n,), its dates named, that tell something, by their names.

    Each has ``statistic``, ``p`` and ``seen``, the size of a step (or a change per year) of which
    a test at the level would have seen 95 %; a change point has its size, and what it is between.
    """
    steps = _steps(values, base, covariance)
    trend = fitted(values, base, years, covariance)
    changes = {"newest": steps.get(len(values) - 1), "trend": trend}
    found = {name: fit.test(level) for name, fit in changes.items() if fit}
    if not steps:
        return found
    i = max(steps, key=lambda i: steps[i].statistic[0])
    largest = steps[i]
    statistic = float(largest.statistic[0])
    # A step or a trend would count as scatter: that is taken from beside the largest step.
    total = covariance + largest.scatter[0] ** 2 * np.eye(len(values))
    least = min(float(step.uncertainty[0]) for step in steps.values())
    # No distribution is known of the largest of several correlated statistics.
    normal = np.random.default_rng(0).normal(size=(len(base), _DRAWS))
    drawn = _steps(np.linalg.cholesky(total) @ normal, base, covariance)
    most = np.max([step.statistic for step in drawn.values()], axis=0)
    above = 1 + np.count_nonzero(most >= statistic)
    factor = np.quantile(most, 1 - level) + ndtri(POWER)
    chi_square = float(_least_squares(base, total, values).chi_square)
    freedom = len(values) - base.shape[1]
    degrees = (freedom, largest.degrees[0])
    # A step adds the square of its size over its uncertainty.
    limit = freedom * fdtri(*degrees, 1 - level)
    return {
        **found,
        "change_point": {
            "statistic": statistic,
            "p": float(above / (_DRAWS + 1)),
            "seen": float(factor * least),
            "between": names[i - 1 : i + 1],
            **largest.stated("1"),
        },
        "homogeneity": {
            "statistic": chi_square,
            "p": float(fdtrc(*degrees, chi_square / freedom)),
            "seen": float(np.sqrt(chndtrinc(limit, freedom, 1 - POWER))) * least,
        },
    }


def _steps(values: FloatArray, base: FloatArray, covariance: FloatArray) -> dict[int, Fitted]:
    """Fit a step at each date but the first; the last step is that of the newest date alone."""
    dates = np.arange(len(values))
    fits = {i: fitted(values, base, dates >= i, covariance) for i in dates[1:].tolist()}
    return {i: fit for i, fit in fits.items() if fit}


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
    spans, beyond which nothing supports a line, and 0 where it is less than a day.
    """
    from scipy.optimize import brentq

    trend = fitted(history, base, years, covariance)
    span = np.ptp(years)
    if trend is None:
        return 0.0
    columns = np.column_stack([base, years])
    total = covariance + trend.scatter[0] ** 2 * np.eye(len(years))
    since = years - years[0]
    walk = np.minimum.outer(since, since)
    sizes = np.sqrt(own_variance(columns, covariance) / span) * _SCATTERS
    fits = [_least_squares(columns, total + size**2 * walk, history) for size in sizes]
    slopes, errors, likelihood, _ = map(np.ravel, zip(*fits, strict=True))
    weights = np.exp(likelihood - likelihood.max())

    def beyond(time: float) -> float:
        spread = np.sqrt((errors * time) ** 2 + sizes**2 * time)
        above = ndtr((slopes * time - tolerance) / spread)
        below = ndtr((-tolerance - slopes * time) / spread)
        return float(np.average(above + below, weights=weights)) - LEVEL

    if beyond(_DAY) > 0:
        return 0.0
    return span if beyond(span) < 0 else brentq(beyond, _DAY, span)
