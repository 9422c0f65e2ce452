r"""What no apparatus function explains: independent residuals of a scan, and tests of them.

The residuals of a fit that weighs smooth departures against noise have no exact distribution.
These have one.  Weighted data :math:`z` are projected off a design :math:`X = QR` of all that an
apparatus function may do to first order: conversion constant, width, centre, baseline, drift,
and every combination of departures that stands above a share of the noise.  What is left,
:math:`(1 - QQ^T)z`, does not depend on G.  With as many points :math:`o` dropped as there are
columns, the others :math:`1` give residuals of unit covariance that lie nearest to it (BLUS:
Theil, J. Am. Stat. Assoc. 60, 1965),

.. math::

    w = (1 - Q_1 Q_1^T)^{-1/2}\,[(1 - QQ^T) z]_1, \qquad |w|^2 = |(1 - QQ^T) z|^2 .
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, chdtrc, fdtrc, fdtri, gammaincc, gammainccinv

from memscal.estimation.free_model import free_model
from memscal.estimation.hypotheses import FALSE_ALARM, chi_square_limit
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = [
    "Residuals",
    "TestOutcome",
    "chi_square_test",
    "independent_residuals",
    "neighbour_correlation_test",
    "pure_error_test",
    "runs_test",
]

#: Weight of the correlation from one step to the next: half as much for each step farther.
_DECAY = 0.5
_FARTHEST = 8
#: With fewer independent residuals there is nothing to test.
FEWEST_RESIDUALS = 3


@dataclass(frozen=True)
class TestOutcome:
    """A test's value, what it exceeds by chance once in a thousand, and its p-value."""

    #: Not a test case, whatever pytest makes of the name.
    __test__ = False

    value: float
    limit: float
    p_value: float


@dataclass(frozen=True, eq=False)
class Residuals:
    """Independent residuals of unit variance, in the order of the scan.

    Parameters
    ----------
    values : ndarray, shape (m,)
        Standard normal deviates if the noise is as stated; else up to a common factor.
    point : ndarray of int, shape (m,)
        The point of the scan that each is nearest to.
    sequence : ndarray of int, shape (m,)
        Which pass over the sensor it belongs to: a repeat, or a row of a raster.
    stated : bool
        Whether the noise is stated.
    """

    values: FloatArray
    point: NDArray[np.intp]
    sequence: NDArray[np.intp]
    stated: bool


def independent_residuals(estimate: ProfileEstimate) -> Residuals:
    """Return residuals that are independent of each other and of G.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile.

    Returns
    -------
    Residuals
        As many as there are points less columns of the model.

    Examples
    --------
    >>> import memscal
    >>> residuals = independent_residuals(memscal.calibrate(memscal.simulate()).solution.estimate)
    >>> 0.5 < residuals.values.std() < 1.5
    True
    """
    from scipy.linalg import qr

    model = free_model(estimate)
    basis = _orthonormal(model.design)
    left_over = model.data - basis @ (basis.T @ model.data)
    # The points that determine the parameters best are dropped: what is left of the others is
    # then nearest to their own residuals.
    dropped = qr(basis.T, mode="r", pivoting=True)[1][: basis.shape[1]]
    rest = np.delete(np.arange(model.data.size), dropped)
    values = _whitened(basis[rest], left_over[rest])
    order, sequence = _passes(estimate)
    place = np.empty_like(order)
    place[order] = np.arange(order.size)
    point = model.kept[rest]
    along = np.argsort(place[point])
    return Residuals(values[along], point[along], sequence[point[along]], model.stated)


def chi_square_test(residuals: Residuals) -> TestOutcome:
    """Test the residuals' size against the stated noise: chi-square per degree of freedom."""
    degrees = residuals.values.size
    total = float(residuals.values @ residuals.values)
    p_value = float(chdtrc(degrees, total))
    return TestOutcome(total / degrees, chi_square_limit(degrees) / degrees, p_value)


def pure_error_test(estimate: ProfileEstimate) -> TestOutcome | None:
    r"""Test the misfit against the scatter of repeats: F of lack of fit over pure error.

    Repeats at one position and load scatter by noise alone, whatever G; with their mean square
    :math:`s^2` of :math:`m` degrees, a misfit of :math:`l` degrees gives :math:`F(l, m)`.

    Returns
    -------
    TestOutcome or None
        ``None`` where no position was measured twice at one load.
    """
    model, points = free_model(estimate), estimate.points
    place = np.stack([points.scan, points.x, points.y, points.load], axis=1)[model.kept]
    group = np.unique(place, axis=0, return_inverse=True)[1].ravel()
    if points.decorrelation is not None or group.max() + 1 == group.size:
        return None
    weight = np.sqrt(estimate.weights / estimate.outlier_weight)[model.kept]
    mean = np.bincount(group, weight * model.data) / np.bincount(group, weight**2)
    scatter = model.data - weight * mean[group]
    basis = _orthonormal(model.design)
    left_over = model.data - basis @ (basis.T @ model.data)
    pure = float(scatter @ scatter)
    pure_degrees = group.size - int(group.max()) - 1
    misfit = max(float(left_over @ left_over) - pure, 0.0)
    degrees = group.size - basis.shape[1] - pure_degrees
    if degrees < FEWEST_RESIDUALS or pure_degrees < FEWEST_RESIDUALS or pure == 0.0:
        return None
    value = misfit / degrees / (pure / pure_degrees)
    limit = float(fdtri(degrees, pure_degrees, 1 - FALSE_ALARM))
    return TestOutcome(value, limit, float(fdtrc(degrees, pure_degrees, value)))


def runs_test(residuals: Residuals) -> TestOutcome:
    r"""Test the residuals' signs along the scan: the share of neighbours that have the same.

    Independent residuals change sign from one to the next as often as a coin does.  (Wald and
    Wolfowitz, Ann. Math. Stat. 11, 1940, count runs for a median that is not known; here it is
    zero, and the number of changes is binomial.)  The p-value is one-sided, for too few runs, and
    as coarse as a count: at most as often below a level as that level says.
    """
    same_pass = np.diff(residuals.sequence) == 0
    changed = np.diff(residuals.values > 0) & same_pass
    pairs, changes = int(same_pass.sum()), int(changed.sum())
    # The fewest changes that chance allows.
    fewest = int(np.argmax(bdtr(np.arange(pairs + 1.0), pairs, 0.5) > FALSE_ALARM))
    share = (pairs - changes) / max(pairs, 1)
    p_value = float(bdtr(float(changes), pairs, 0.5)) if pairs else 1.0
    return TestOutcome(share, (pairs - fewest) / max(pairs, 1), p_value)


def neighbour_correlation_test(residuals: Residuals) -> TestOutcome:
    r"""Test whether neighbouring residuals are alike, whatever the size of the noise.

    The statistic, near one for residuals that are smooth along the scan, is
    :math:`T = \sum_{l \ge 1} 2^{-l} \sum_i w_i w_{i+l} / \sum_i w_i^2 = w^T M w / w^T w`.  For
    :math:`n` independent normal residuals its mean is zero, and its second and third moments are
    :math:`2\,\mathrm{tr} M^2/n(n+2)` and :math:`8\,\mathrm{tr} M^3/n(n+2)(n+4)`; the p-value is
    that of the gamma distribution (Pearson's type III) with these moments.  One-sided.
    """
    from scipy.sparse import diags

    values, sequence = residuals.values, residuals.sequence
    n, steps = values.size, range(1, min(_FARTHEST, values.size - 1) + 1)
    bands = [0.5 * _DECAY**i * (sequence[i:] == sequence[:-i]) for i in steps]
    matrix = diags([*bands, *bands], [*steps, *(-i for i in steps)]).tocsr()
    value = float(values @ (matrix @ values) / (values @ values))
    squared = matrix @ matrix
    deviation = np.sqrt(2 * squared.trace() / (n * (n + 2)))
    third = 8 * matrix.multiply(squared).sum() / (n * (n + 2) * (n + 4))
    if not deviation > 0:
        return TestOutcome(0.0, 1.0, 1.0)
    shape = 4 * deviation**6 / third**2
    limit = deviation * (gammainccinv(shape, FALSE_ALARM) - shape) / np.sqrt(shape)
    p_value = gammaincc(shape, max(shape + np.sqrt(shape) * value / deviation, 0.0))
    return TestOutcome(value, float(limit), float(p_value))


def _orthonormal(design: FloatArray) -> FloatArray:
    """Orthonormal basis of the columns' span; columns scaled first, none counted twice."""
    scaled = design / np.linalg.norm(design, axis=0)
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, singular > 1e-10 * singular[0]])


def _whitened(basis: FloatArray, values: FloatArray) -> FloatArray:
    """Apply the symmetric inverse root of 1 - QQ' for some rows of Q."""
    left, singular, _ = np.linalg.svd(basis, full_matrices=False)
    growth = 1 / np.sqrt(np.maximum(1 - singular**2, np.finfo(float).eps)) - 1
    return np.asarray(values + left @ (growth * (left.T @ values)))


def _passes(estimate: ProfileEstimate) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Order of the points along the scan, and which pass over the sensor each belongs to."""
    points = estimate.points
    runs_along_x = points.free[points.scan, 0]
    along = np.where(runs_along_x, points.x, points.y)
    across = np.where(runs_along_x, points.y, points.x)
    order = np.lexsort((along, across, points.repeat, points.scan))
    keys = np.stack([points.scan, points.repeat, across])[:, order]
    new = np.concatenate([[0], np.any(np.diff(keys, axis=1) != 0, axis=0)])
    sequence = np.empty(order.size, dtype=np.intp)
    sequence[order] = np.cumsum(new)
    return order, sequence
