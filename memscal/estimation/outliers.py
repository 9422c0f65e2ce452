"""Outliers and noise of a scan's points by their residuals: robust scales, weights, neighbours."""

from typing import Any, NamedTuple

import numpy as np

from memscal.estimation.points import ScanPoints, grouped
from memscal.model.arrays import TINY, FloatArray, IndexArray
from memscal.model.checks import OUTLIER_WEIGHT

#: A residual beyond this many robust standard deviations is an outlier: one in 2000 by chance.
OUTLIER_THRESHOLD = 3.5
#: Noise, over the largest voltage, of which no residual within the model's own error, 3e-5 by the
#: convergence of reference and quadrature, is an outlier.
_MODEL = 3e-5 / OUTLIER_THRESHOLD
#: Fewer differences, or degrees of freedom among repeats, say nothing of the noise.
_FEWEST_DIFFERENCES = 30
#: Points of which a third difference is taken are at most so unevenly spaced.
_UNEVEN = 4.0
_NEIGHBOURS = 8
#: Standard deviation of a normal distribution over its median absolute value.
_NORMAL = 1.4826


def robust_scale(values: FloatArray, least: float) -> float:
    """Standard deviation of a normal distribution by the median absolute value, no less."""
    return max(_NORMAL * float(np.median(abs(values))), least)


def point_weights(
    points: ScanPoints, residual: FloatArray, stated: FloatArray, threshold: float
) -> FloatArray:
    """Weights of the points by their residuals; over the plane by what neighbours do not share."""
    # One, and beyond the threshold such that the influence w z falls as 1/z^3.  The residuals count
    # in robust standard deviations of their own, of ``least`` or more; on a raster in those of
    # their neighbours where these are larger.
    root = np.sqrt(stated)
    least = _MODEL * (abs(points.u).max() * np.sqrt(np.median(stated)))
    standardised = residual * root
    scale: FloatArray | float = robust_scale(standardised, least)
    if points.planar:
        standardised = isolated(points, residual) * root
        # Errors of the stage make more noise where the voltage is steep.
        scale = np.maximum(scale, _NORMAL * median_nearby(points, abs(standardised)))
    z = abs(standardised) / scale
    return np.minimum(1.0, (threshold / np.maximum(z, threshold)) ** 4)


class RasterNoise(NamedTuple):
    """Noise of one reading of a raster that states none, and how well that is known."""

    deviation: float  # in V
    degrees: float  # of freedom of its square


def raster_noise(
    points: ScanPoints, residual: FloatArray, outlier: FloatArray
) -> RasterNoise | None:
    """Noise of one reading by its repeats, or by third differences of residuals (n,) in V."""
    # Both leave out what is smooth over the plane: a sensor that is not round adds nothing; and
    # points of little ``outlier`` weight.  ``None`` where noise is stated, or of too few of either.
    if points.noise_stated or not points.planar:
        return None
    ordinary = np.flatnonzero(outlier >= OUTLIER_WEIGHT)
    group = grouped(points.scan, points.place_numbers("index"), points.load)[ordinary]
    places, group = np.unique(group, return_inverse=True)
    repeats = group.size - places.size
    if repeats >= _FEWEST_DIFFERENCES:
        left = residual[ordinary]
        left = left - (np.bincount(group, left) / np.bincount(group))[group]
        return RasterNoise(float(np.sqrt(left @ left / repeats)), repeats)
    differences = _third_differences(points, ordinary)
    count = differences.shape[0]
    if count < _FEWEST_DIFFERENCES:
        return None
    square = np.sum((differences @ residual) ** 2)
    # Differences that share readings are correlated (Satterthwaite, Biometrics Bull. 2, 1946).
    degrees = count**2 / (differences @ differences.T).power(2).sum()
    return RasterNoise(np.sqrt(square / count), degrees)


def variances_nearby(points: ScanPoints, residual: FloatArray) -> FloatArray:
    """Variance of each reading (n,) of a raster by the differences that it has a part in."""
    # Zero where it has a part in none.
    differences = _third_differences(points, np.arange(residual.size))
    shares = differences.power(2).T
    return np.asarray(shares @ (differences @ residual) ** 2 / (shares.sum(axis=1) + TINY))


def _third_differences(points: ScanPoints, chosen: IndexArray) -> Any:
    """Divided third differences of neighbours among chosen readings along a row, (m, n)."""
    # sum c_i r_i / (sum c_i^2)^(1/2), 1/c_i the product of all x_i - x_j, is zero for every
    # parabola, and has the variance of the noise.
    from scipy.sparse import csr_array

    keys = np.stack([points.x, points.place_numbers("row"), points.repeat, points.scan])
    four = np.lib.stride_tricks.sliding_window_view(chosen[np.lexsort(keys[:, chosen])], 4)
    gaps = np.diff(points.x[four], axis=1)
    together = np.all(keys[1:, four[:, :1]] == keys[1:, four], axis=(0, 2))
    four = four[together & (gaps.max(axis=1) < _UNEVEN * gaps.min(axis=1))]
    apart = points.x[four][:, :, None] - points.x[four][:, None, :] + np.eye(4)
    coefficients = 1 / apart.prod(axis=2)
    coefficients /= np.linalg.norm(coefficients, axis=1)[:, None]
    rows = np.repeat(np.arange(len(four)), 4)
    shape = (len(four), points.u.size)
    return csr_array((coefficients.ravel(), (rows, four.ravel())), shape=shape)


def isolated(points: ScanPoints, residual: FloatArray) -> FloatArray:
    """What of each residual (n,) its neighbours in the plane do not share, (n,)."""
    # An outlier stands alone; where a model misses a sensor's shape, neighbours depart together.
    left = residual - median_nearby(points, residual)
    least = np.sign(left) * np.minimum(abs(left), abs(residual))
    return np.where(left * residual > 0, least, 0.0)


def median_nearby(points: ScanPoints, values: FloatArray) -> FloatArray:
    """Median (n,) of the values of each point's neighbours in the plane."""
    from scipy.spatial import KDTree

    medians = np.zeros_like(values)
    for inside in points.inside:
        rows = np.flatnonzero(inside)
        places = points.positions[:, rows].T
        count = min(_NEIGHBOURS + 1, rows.size)
        nearest = np.asarray(KDTree(places).query(places, k=count)[1])[:, 1:]
        medians[rows] = np.median(values[rows][nearest], axis=1)
    return medians
