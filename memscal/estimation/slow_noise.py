r"""Noise that is correlated along each pass over a sensor, averaged over lengths and shares of it.

A share :math:`s` of the variance falls off over :math:`l` steps, :math:`C_{ij} = (1 - s)\delta_{ij}
+ s\,e^{-|i - j|/l}`; the rest is white.  With :math:`z` the :math:`n` weighted data and orthonormal
:math:`Q` all that an apparatus function may do, :math:`r` columns, the restricted likelihood,
integrated over a noise of flat logarithm, is (Patterson and Thompson, Biometrika 58, 1971)

.. math::

    -2\log p(z \mid l, s) = \log|C| + \log|Q^TC^{-1}Q| + (n - r)\log S, \qquad
    S = \min_b (z - Qb)^TC^{-1}(z - Qb) .

The variance of the noise is :math:`S/(n - r)`.
"""

import numpy as np

from memscal.estimation.decorrelation import Decorrelation, SlowNoise
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.residuals import FEWEST_RESIDUALS, Residuals

#: White noise, then shares of slow noise for each length, in steps; their prior probabilities.
_SHARES = np.array([0.0, *3 * (0.1, 0.5, 0.9)])
_LENGTHS = np.repeat([3.0, 10.0, 30.0], [4, 3, 3])
_PRIOR = np.array([0.7, *9 * (0.3 / 9,)])
#: Of more points the covariances take too much room.
_MOST = 1000


def slow_noise(estimate: ProfileEstimate, residuals: Residuals) -> SlowNoise | None:
    """Average the noise's covariance over its correlation; none of rasters, or if it is stated."""
    place = residuals.place
    known = estimate.points.planar or estimate.points.decorrelation or place.size > _MOST
    if known or residuals.degrees < FEWEST_RESIDUALS:
        return None
    apart = abs(np.subtract.outer(place, place))
    same = np.equal.outer(residuals.sequence, residuals.sequence)
    kinds = same * np.exp(-apart / _LENGTHS[:, None, None]) * _SHARES[:, None, None]
    kinds[:, range(place.size), range(place.size)] = 1.0
    roots = np.linalg.cholesky(kinds)
    # C^-1/2 [Q z] = OR: R ends with the root of S, and the rest gives the determinant.
    whitened = np.linalg.solve(roots, np.column_stack([residuals.basis, residuals.values]))
    ends = abs(np.diagonal(np.linalg.qr(whitened, mode="r"), axis1=1, axis2=2))
    square = ends[:, -1] ** 2
    log_weight = np.log(_PRIOR) - np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(axis=1)
    log_weight -= np.log(ends[:, :-1]).sum(axis=1) + residuals.degrees / 2 * np.log(square)
    weight = np.exp(log_weight - np.logaddexp.reduce(log_weight))
    covariance = np.tensordot(weight * square / square[0], kinds, 1)
    probability = weight[1:].sum()
    return SlowNoise(
        probability=probability,
        length=weight[1:] @ _LENGTHS[1:] / probability,
        share=weight @ _SHARES / probability,
        covariance=Decorrelation(((residuals.point, np.linalg.cholesky(covariance)),)),
    )
