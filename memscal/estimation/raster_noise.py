"""Noise and outliers of a scan over the plane, whatever of its sensor is not round."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from memscal.model.arrays import FloatArray

if TYPE_CHECKING:
    from memscal.estimation.points import ScanPoints

#: Fewer differences, or degrees of freedom among repeats, say nothing of the noise.
_FEWEST = 30
#: Points of which a third difference is taken are at most so unevenly spaced.
_UNEVEN = 4.0
_NEIGHBOURS = 8


def raster_noise(points: ScanPoints, residual: FloatArray) -> float | None:
    """Noise of one reading (V) by its repeats, or by third differences of residuals (n,) in V.

    Both leave out what is smooth over the plane: a sensor that is not round adds nothing.
    ``None`` where there are too few of either.
    """
    if points.u_errors is not None or not points.planar:
        return None
    groups = np.stack([points.scan, points.of_places("index"), points.load])
    group = np.unique(groups, axis=1, return_inverse=True)[1].ravel()
    degrees = group.size - int(group.max()) - 1
    if degrees >= _FEWEST:
        left = residual - (np.bincount(group, residual) / np.bincount(group))[group]
        # Of pairs every deviation from the mean is one of two: the median is of those that vary.
        scale = np.sqrt(group.size / degrees)
        return float(_spread(left[np.bincount(group)[group] > 1]) * scale)
    return third_difference_noise(points, residual)


def third_difference_noise(points: ScanPoints, residual: FloatArray) -> float | None:
    r"""Noise of one reading by divided third differences along the rows of a raster.

    :math:`\sum_i c_i r_i / (\sum_i c_i^2)^{1/2}` with :math:`c_i^{-1} = \prod_{j \ne i} (x_i -
    x_j)` is zero for every parabola, and has the variance of the noise.
    """
    keys = np.stack([points.x, points.of_places("row"), points.repeat, points.scan])
    order = np.lexsort(keys)
    four = np.lib.stride_tricks.sliding_window_view(order, 4)
    x = points.x[four]
    gaps = np.diff(x, axis=1)
    together = np.all(keys[1:, four[:, :1]] == keys[1:, four], axis=(0, 2))
    even = gaps.max(axis=1) < _UNEVEN * gaps.min(axis=1)
    four = four[together & even]
    if len(four) < _FEWEST:
        return None
    apart = points.x[four][:, :, None] - points.x[four][:, None, :] + np.eye(4)
    coefficients = 1 / apart.prod(axis=2)
    coefficients /= np.linalg.norm(coefficients, axis=1)[:, None]
    return _spread(np.sum(coefficients * residual[four], axis=1))


def isolated(points: ScanPoints, residual: FloatArray) -> FloatArray:
    """What of each residual (n,) its neighbours in the plane do not share, (n,).

    An outlier stands alone; where a model misses a sensor's shape, neighbours depart together.
    """
    from scipy.spatial import KDTree

    if not points.planar:
        return residual
    alone = np.zeros_like(residual)
    for scan in range(points.scans):
        rows = np.flatnonzero(points.scan == scan)
        places = np.stack([points.x[rows], points.y[rows]], axis=1)
        count = min(_NEIGHBOURS + 1, rows.size)
        nearest = np.asarray(KDTree(places).query(places, k=count)[1])[:, 1:]
        around = np.median(residual[rows][nearest], axis=1)
        left = residual[rows] - around
        same = left * residual[rows] > 0
        alone[rows] = np.where(same, np.sign(left) * np.minimum(abs(left), abs(residual[rows])), 0)
    return alone


def _spread(values: FloatArray) -> float:
    """Standard deviation of a normal distribution by the median absolute value."""
    return 1.4826 * float(np.median(np.abs(values)))
