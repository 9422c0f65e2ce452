"""The linear model of every apparatus function that a scan can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = ["FreeModel", "free_model"]

#: A departure of the expected size that moves no voltage by more of its noise is left as noise.
_SHARE_OF_NOISE = 0.1
#: A point of less weight is an outlier and is left out.
_OUTLIER = 0.5
_CLIPPED = 4.0


@dataclass(frozen=True, eq=False)
class FreeModel:
    """The scan's data and the linear model of every apparatus function it can tell apart.

    Parameters
    ----------
    data : ndarray, shape (m,)
        What the best Gaussian leaves of the voltages, weighted: independent, and of unit variance
        where the noise is stated.  Outliers are left out.
    design : ndarray, shape (m, r)
        Weighted derivatives by the parameters without prior and by the departures that count.
        In this order: A, width, centres, baselines and drifts first.
    kept : ndarray of int, shape (m,)
        Which points of the scan they are.
    stated : bool
        Whether the noise is stated.
    """

    data: FloatArray
    design: FloatArray
    kept: NDArray[np.intp]
    stated: bool


def free_model(estimate: ProfileEstimate, *, clip_outliers: bool = False) -> FreeModel:
    """Linearise the model about the best Gaussian, with every departure that can be seen.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile.
    clip_outliers : bool
        Keep outliers, with residuals cut to four times their noise, in place of leaving them out.
    """
    points, basis = estimate.points, estimate.basis
    ordinary = estimate.outlier_weight >= _OUTLIER
    weights, u = estimate.weights / estimate.outlier_weight, points.u
    if clip_outliers:
        most = _CLIPPED * estimate.noise
        u = np.where(ordinary, u, estimate.predicted + np.clip(u - estimate.predicted, -most, most))
        ordinary = np.ones_like(ordinary)
    weights = np.where(ordinary, weights, estimate.weights)
    kept = np.flatnonzero(ordinary)

    def standardised(values: FloatArray) -> FloatArray:
        return points.standardised(values, weights)[kept]

    jacobian = estimate.gaussian.jacobian
    flat = standardised(jacobian / np.linalg.norm(jacobian, axis=0))
    kernels = basis.kernels(estimate.model.k)[:, basis.flat :]
    rings = standardised(estimate.model.signal(estimate.gaussian.geometry, kernels))
    base = np.linalg.qr(flat)[0]
    left, singular, _ = np.linalg.svd(rings - base @ (base.T @ rings), full_matrices=False)
    stated = points.u_errors is not None
    noise = 1.0 if stated else estimate.noise_scale
    seen = singular > _SHARE_OF_NOISE * noise
    return FreeModel(
        data=standardised(u - estimate.gaussian.predicted),
        design=np.hstack([flat, left[:, seen] * singular[seen]]),
        kept=kept,
        stated=stated,
    )
