r"""The most credible profile among those that nowhere pull, or nowhere rise.

The posterior of the coefficients is :math:`w = \mu + L z` with :math:`z \sim N(0, 1)`.  The
nearest profile that meets :math:`A\,G(r_i) \ge 0`, or :math:`A\,(G(r_i) - G(r_{i+1})) \ge 0`, at
many radii has the least :math:`|z|^2` under linear inequalities: least distance programming,
solved as a non-negative least-squares problem (Lawson and Hanson, Solving Least Squares Problems,
chapter 23).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.errors import FitError
from memscal.estimation.forward import gaussian_transfer
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = ["PosteriorProfile", "constrained_profile"]

_RADII = 60
_REACH_IN_WIDTHS = 6.0
#: Beyond the reach a profile has ended; there the inequalities hold to this share of the peak.
_SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class PosteriorProfile:
    """A G as the scan's points have it: the posterior mean, its coefficients shifted."""

    estimate: ProfileEstimate
    shift: FloatArray

    def radial(self, r: FloatArray) -> FloatArray:
        """A G at radii ``r`` (m), in V/Pa/m^2."""
        return self.estimate.radial(r, self.shift)

    def transform(self, k: FloatArray) -> FloatArray:
        """Hankel transform of A G at ``k`` (rad/m), in V/Pa."""
        fit, basis = self.estimate.gaussian, self.estimate.basis
        corrections = self.estimate.weighed.mean + self.shift
        gaussian = fit.conversion_constant * gaussian_transfer(k, fit.sigma)
        return np.asarray(gaussian + basis.kernels(k) @ corrections)


def constrained_profile(
    estimate: ProfileEstimate, *, nonnegative: bool, monotone: bool
) -> PosteriorProfile:
    """Return the most credible A G under constraints; without any, the posterior mean.

    Parameters
    ----------
    estimate : ProfileEstimate
        The posterior.
    nonnegative : bool
        Whether A G must not be negative.
    monotone : bool
        Whether A G must not rise with the radius, nor be negative.

    Raises
    ------
    FitError
        If no profile meets the constraints.
    """
    if not (nonnegative or monotone):
        return PosteriorProfile(estimate, np.zeros_like(estimate.weighed.mean))
    width = max(estimate.gaussian.sigma, 0.5 * estimate.points.step)
    r = np.linspace(0.0, _REACH_IN_WIDTHS * width, _RADII)
    profile, columns = estimate.radial(r), estimate.basis.radial(r)
    if monotone:
        # What falls all the way to nothing is nowhere negative, either.
        profile = np.append(profile[:-1] - profile[1:], profile[-1])
        columns = np.vstack([columns[:-1] - columns[1:], columns[-1:]])
    scale = float(np.abs(profile).max())
    values, vectors = np.linalg.eigh(_scaled(estimate))
    kept = values > 1e-12 * values[-1]
    root = _deviation(estimate)[:, None] * vectors[:, kept] * np.sqrt(values[kept])
    z = _least_distance(columns @ root / scale, -profile / scale - _SLACK)
    return PosteriorProfile(estimate, root @ z)


def _deviation(estimate: ProfileEstimate) -> FloatArray:
    deviation = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0))
    return np.where(deviation > 0, deviation, 1.0)


def _scaled(estimate: ProfileEstimate) -> FloatArray:
    deviation = _deviation(estimate)
    return np.asarray(estimate.covariance / np.outer(deviation, deviation))


def _least_distance(matrix: FloatArray, bound: FloatArray) -> FloatArray:
    """Shortest z with ``matrix @ z >= bound``."""
    from scipy.optimize import nnls

    target = np.append(np.zeros(matrix.shape[1]), 1.0)
    dual, _ = nnls(np.vstack([matrix.T, bound]), target, maxiter=50 * bound.size)
    residual = np.vstack([matrix.T, bound]) @ dual - target
    if not residual[-1] < -1e-12:
        raise FitError(
            "No apparatus function of the kind that was asked for comes near the scan.",
            why="It would have to be negative, or to rise, somewhere.",
            cure="Leave out the constraint: nonnegative=false, monotone=false.",
        )
    return np.asarray(-residual[:-1] / residual[-1])
