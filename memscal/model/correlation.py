"""Correlation of a scan's noise: of all pairs of points, (n, n), or of neighbours, (n, w).

In the banded form column j is the correlation of each point with the j-th one after it.
"""

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.model.arrays import FloatArray, IndexArray, floats, frozen_array
from memscal.model.sizes import MOST_CORRELATED, too_large

#: A combination of voltages with less of the noise than this would outweigh all others.
_LEAST_EIGENVALUE = 1e-8
_NOT_POSITIVE = "u_zz_correlation is not positive definite"
_WHY = "Some combination of the voltages would have no noise, or less than none."
_CURE = "Add the electronic noise, which is independent from point to point."


def is_banded(correlation: FloatArray) -> bool:
    """Whether only neighbours are correlated."""
    return bool(correlation.shape[0] != correlation.shape[1])


def checked_correlation(stated: ArrayLike, size: int) -> FloatArray:
    """Return a read-only copy of a correlation of ``size`` points, which must be one of noise."""
    correlation = frozen_array(stated)
    shape = correlation.shape
    if len(shape) != 2 or not shape[0] == size >= shape[1] or not np.isfinite(correlation).all():
        raise InputError(
            f"u_zz_correlation has shape {shape}, but it should be ({size}, {size}), or ({size}, w)"
            " of neighbours, and finite.",
            why="It correlates every point of one repeat with every other, or with the next w - 1.",
        )
    if is_banded(correlation):
        _require_band(correlation)
        return correlation
    if size > MOST_CORRELATED:
        raise too_large(
            "u_zz_correlation",
            size,
            MOST_CORRELATED,
            "points",
            why="The cube of their number is worked with.",
            cure="Give the correlation of neighbours alone, (n, w), or average neighbouring "
            "readings.",
        )
    symmetric = np.allclose(correlation, correlation.T, atol=1e-9)
    if not symmetric or not np.allclose(np.diag(correlation), 1.0):
        raise InputError(
            "u_zz_correlation is not a correlation: not symmetric, or not one on its diagonal.",
            cure="Divide a covariance by the standard uncertainties of row and column, and "
            "give those as u_zz_errors.",
        )
    least = np.linalg.eigvalsh(correlation)[0]
    if least <= _LEAST_EIGENVALUE:
        raise InputError(
            f"{_NOT_POSITIVE}: it has the eigenvalue {least:.3g}.", why=_WHY, cure=_CURE
        )
    return correlation


def _require_band(band: FloatArray) -> None:
    if not np.allclose(band[:, 0], 1.0):
        raise InputError(
            "u_zz_correlation is not one in its first column, of each point with itself.",
            cure="Divide a covariance by the standard uncertainties.",
        )
    last = band[::-1][: band.shape[1]]
    if np.any(np.triu(last, 1)):
        raise InputError(
            "u_zz_correlation correlates the last points with points beyond the end.",
            cure="Give zeros there.",
        )
    try:
        root_of(band)
    except np.linalg.LinAlgError:
        raise InputError(f"{_NOT_POSITIVE}.", why=_WHY, cure=_CURE) from None


def of_points(correlation: FloatArray, kept: IndexArray) -> FloatArray:
    """Return the correlation of some of the points, in their order."""
    if not is_banded(correlation):
        return correlation[np.ix_(kept, kept)]
    width = correlation.shape[1]
    chosen = np.zeros((kept.size, min(width, kept.size)))
    chosen[:, 0] = 1.0
    for j in range(1, chosen.shape[1]):
        apart = kept[j:] - kept[:-j]
        near = apart < width
        chosen[:-j, j][near] = correlation[kept[:-j][near], apart[near]]
    if is_banded(chosen):
        return chosen
    # So few points that all are neighbours.
    whole = sum(np.diag(chosen[: kept.size - j, j], -j) for j in range(kept.size))
    return whole + np.tril(whole, -1).T


def root_of(correlation: FloatArray) -> FloatArray:
    """Lower Cholesky factor L: (n, n), or its diagonals (w, n), the main one first."""
    from scipy.linalg import cholesky_banded

    if is_banded(correlation):
        return floats(cholesky_banded(correlation.T, lower=True))
    return floats(np.linalg.cholesky(correlation))
