r"""Thousands of replicates of one scan at once: the same points, other voltages.

:class:`ReplicateEstimator` is :func:`memscal.estimation.profile_estimate.estimate_profile` for
voltages that scatter about those of an estimate.  Positions, loads and weights stay those of the
estimate.  The Gaussian fit is expanded (:mod:`memscal.estimation.expansion`).  Departures are
weighed about Gaussians of a few widths, so that every design matrix is decomposed once and the
evidence of every hypothesis for every replicate is a few matrix products; between these widths
the outcome is interpolated to the replicate's own.

A reference that is off by :math:`\delta\hat\sigma` is the reference of the estimate with other
data: :math:`K \otimes (\sigma + \delta\sigma) = u` is
:math:`K \otimes \sigma = u - K \otimes \delta\sigma`, iterated for :math:`K`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from memscal.estimation.batch_evidence import BatchEvidence
from memscal.estimation.departure import DepartureBasis, departure_basis
from memscal.estimation.expansion import GaussianExpansion, GaussianFits
from memscal.estimation.forward import unit_gaussian
from memscal.estimation.gaussian_fit import linearise
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = ["ReplicateEstimator", "Replicates"]

_REFERENCE_ROUNDS = 5
#: Widths of the Gaussians that departures are weighed about: this many standard uncertainties
#: from the estimate's, which count as these shares of it at the least and at the most.
_NODES_APART = 1.7
_LEAST_SPREAD = 0.01
_MOST_SPREAD = 0.2


@dataclass(frozen=True, eq=False)
class Replicates:
    """What each replicate of a scan says.

    Parameters
    ----------
    bases : tuple of DepartureBasis
        The kernels that corrections are combinations of, about Gaussians of several widths.
    gaussian : ndarray, shape (replicates, p)
        A (V/Pa), sigma (m), centres (m) and drift (V) of each Gaussian fit.
    means : tuple of ndarray, shape (replicates, m)
        For each basis, its share of the posterior mean: corrections to the Gaussian fit, and the
        departures' amplitudes.
    noise : ndarray, shape (replicates,)
        Noise of a point of weight one.
    probability : ndarray, shape (replicates, hypotheses)
        Posterior probability of each hypothesis.
    """

    bases: tuple[DepartureBasis, ...]
    gaussian: FloatArray
    means: tuple[FloatArray, ...]
    noise: FloatArray
    probability: FloatArray

    @property
    def sigma(self) -> FloatArray:
        """Width of each Gaussian fit, shape (replicates,), in m."""
        return np.asarray(self.gaussian[:, 1])

    @property
    def conversion_constant(self) -> FloatArray:
        """Integral of A G over the plane, shape (replicates,), in V/Pa."""
        return self.gaussian[:, 0] + self.correction(np.zeros(1))[:, 0]

    @property
    def corrected(self) -> FloatArray:
        """A, sigma, centres and drift with the corrections, shape (replicates, p)."""
        flat = self.gaussian.shape[1]
        return np.asarray(self.gaussian + sum(mean[:, :flat] for mean in self.means))

    def radial(self, r: FloatArray) -> FloatArray:
        """A G at radii ``r`` (m), shape (replicates, r), in V/Pa/m^2."""
        gaussian = unit_gaussian(r, self.sigma[:, None]) * self.gaussian[:, :1]
        parts = zip(self.means, self.bases, strict=True)
        return np.asarray(gaussian + sum(mean @ basis.radial(r).T for mean, basis in parts))

    def kernel(self, k: FloatArray) -> FloatArray:
        """Transform of A G at wavenumbers ``k`` (rad/m), shape (replicates, k), in V/Pa."""
        return gaussian_kernels(self.gaussian, k) + self.correction(k)

    def correction(self, k: FloatArray) -> FloatArray:
        """Transform of A G less that of the Gaussian fit, shape (replicates, k), in V/Pa."""
        parts = zip(self.means, self.bases, strict=True)
        return np.asarray(sum(mean @ basis.kernels(k).T for mean, basis in parts))


def gaussian_kernels(gaussian: FloatArray, k: FloatArray) -> FloatArray:
    """Transforms of Gaussians of A and sigma (the first columns), shape (replicates, k)."""
    return np.asarray(gaussian[:, :1] * np.exp(-0.5 * (gaussian[:, 1:2] * k) ** 2))


class ReplicateEstimator:
    """Estimates replicates of the scan behind an estimate.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's own estimate; replicates are expanded about it.

    Examples
    --------
    >>> import memscal
    >>> solution = memscal.calibrate(memscal.simulate(noise=0.003, seed=1)).solution
    >>> estimate = solution.estimate
    >>> draws = np.random.default_rng(0).normal(size=(200, estimate.points.u.size))
    >>> found = ReplicateEstimator(estimate).fit(estimate.predicted + draws * estimate.noise)
    >>> bool(abs(found.sigma.mean() / estimate.gaussian.sigma - 1) < 0.01)
    True
    """

    def __init__(self, estimate: ProfileEstimate) -> None:
        model, weights = estimate.model, estimate.weights
        self.estimate = estimate
        noise = estimate.noise_scale
        self.expansion = GaussianExpansion.about(model, estimate.gaussian, weights, noise)
        sigma = estimate.gaussian.sigma
        spread = max(np.sqrt(estimate.gaussian_covariance[1, 1]), _LEAST_SPREAD * sigma)
        self.widths = sigma + min(_NODES_APART * spread, _MOST_SPREAD * sigma) * np.array(
            [-1.0, 0.0, 1.0]
        )
        freedom = float(estimate.outlier_weight.sum()) - estimate.basis.flat
        self.evidence = [self._about(width, freedom) for width in self.widths]

    def _about(self, width: float, freedom: float) -> BatchEvidence:
        """Decompose the designs about a Gaussian of a width."""
        model, weights = self.estimate.model, self.estimate.weights
        theta = self.expansion.start.copy()
        theta[1] = width
        fit = linearise(model, theta)
        basis = departure_basis(model, fit)
        columns = model.signal(fit.geometry, basis.kernels(model.k)[:, basis.flat :])
        standardised = model.points.standardised
        return BatchEvidence(
            basis, standardised(fit.jacobian, weights), standardised(columns, weights), freedom
        )

    def fit(self, voltages: FloatArray, changes: FloatArray | None = None) -> Replicates:
        """Estimate replicates.

        Parameters
        ----------
        voltages : ndarray, shape (replicates, n)
            Voltages at the measured points, in V.
        changes : ndarray, shape (replicates, nodes), optional
            By how much the transform of each replicate's reference, per newton, is larger than
            that of the estimate; of a single scan.

        Returns
        -------
        Replicates
            What each says.
        """
        data = self._standardised(voltages)
        fits = self.expansion.fit(data)
        if changes is None:
            return self._weighed(fits, 0.0)
        k = self.estimate.model.k
        for _ in range(_REFERENCE_ROUNDS):
            carried = self._carried(gaussian_kernels(fits.parameters, k), changes)
            fits = self.expansion.fit(data - carried)
        further: FloatArray | float = 0.0
        for _ in range(_REFERENCE_ROUNDS):
            further = self._carried(self._weighed(fits, further).correction(k), changes)
        return self._weighed(fits, further)

    def _standardised(self, voltages: FloatArray) -> FloatArray:
        return self.estimate.points.standardised(voltages.T, self.estimate.weights).T

    def _carried(self, kernels: FloatArray, changes: FloatArray) -> FloatArray:
        """Standardised voltages of kernels through the changes of their references."""
        model = self.estimate.model
        measure = model.reference.wavenumbers.weights
        synthesis = model.synthesis(self.estimate.gaussian.geometry)
        per_newton = (kernels * changes * measure) @ synthesis.T
        return self._standardised(per_newton * model.points.load)

    def _weighed(self, fits: GaussianFits, less: FloatArray | float) -> Replicates:
        """Weigh departures about each width, and interpolate to that of each replicate."""
        data = fits.residual - less
        size = fits.parameters[:, 0] / self.expansion.start[0]
        found = [evidence.weigh(data, size) for evidence in self.evidence]
        shares = _lagrange(self.widths, fits.parameters[:, 1])
        return Replicates(
            bases=tuple(evidence.basis for evidence in self.evidence),
            gaussian=fits.parameters,
            means=tuple(s[:, None] * mean for s, (mean, _, _) in zip(shares, found, strict=True)),
            noise=np.asarray(
                sum(s * noise for s, (_, noise, _) in zip(shares, found, strict=True))
            ),
            probability=found[1][2],
        )


def _lagrange(nodes: FloatArray, x: FloatArray) -> FloatArray:
    """Weights of each node in the polynomial through them, shape (nodes, x)."""
    weights = np.ones((nodes.size, x.size))
    for i, j in permutations(range(nodes.size), 2):
        weights[i] *= (x - nodes[j]) / (nodes[i] - nodes[j])
    return weights
