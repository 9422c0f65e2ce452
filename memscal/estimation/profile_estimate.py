"""From the points of a scan to its radial profile: centre, baseline, noise and outliers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.errors import FitError
from memscal.estimation.departure import DepartureBasis, departure_basis
from memscal.estimation.evidence import WeighedFit, weigh_departures
from memscal.estimation.forward import ForwardModel, gaussian_transfer, unit_gaussian
from memscal.estimation.gaussian_fit import GaussianFit, fit_gaussian
from memscal.estimation.points import ScanPoints
from memscal.model.validation import FloatArray

__all__ = ["ProfileEstimate", "estimate_profile"]

#: A residual beyond this many robust standard deviations is an outlier: one in 2000 by chance.
OUTLIER_THRESHOLD = 3.5
#: Error of the reference and of its transforms, relative to the largest signal.
NUMERICAL_FLOOR = 1e-6
#: A conversion constant must exceed this many of its standard uncertainties.
LEAST_SIGNIFICANCE = 5.0
_WEIGHING_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class ProfileEstimate:
    """What the scan says, with its uncertainty, before any division.

    Parameters
    ----------
    model : ForwardModel
        Points and reference.
    gaussian : GaussianFit
        The best Gaussian in data space.
    basis, weighed : DepartureBasis, WeighedFit
        Kernels about it and their posterior.
    weights : ndarray, shape (n,)
        Relative weight of each point, the outliers' below one included.
    outlier_weight : ndarray, shape (n,)
        One for ordinary points; less for outliers.
    """

    model: ForwardModel
    gaussian: GaussianFit
    basis: DepartureBasis
    weighed: WeighedFit
    weights: FloatArray
    outlier_weight: FloatArray

    @property
    def points(self) -> ScanPoints:
        """The measured points."""
        return self.model.points

    @property
    def noise(self) -> FloatArray:
        """Standard uncertainty of each voltage, shape (n,), in V; outliers' noise is not raised."""
        base = np.ones_like(self.points.u) if self.points.u_errors is None else self.points.u_errors
        return base * self.noise_scale

    @property
    def noise_scale(self) -> float:
        """Noise of a point (V); or, with stated uncertainties, the factor they must grow by.

        Stated uncertainties are believed until the residuals exceed them (Birge's ratio).  A
        scatter is never taken for less than the model's own numerical error.
        """
        found = max(self.weighed.noise, NUMERICAL_FLOOR * self.largest_signal)
        return found if self.points.u_errors is None else max(found, 1.0)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of all corrections, at the noise that is believed."""
        return self.weighed.covariance * (self.noise_scale / self.weighed.noise) ** 2

    @property
    def gaussian_covariance(self) -> FloatArray:
        """Covariance of the Gaussian fit's own parameters, by the Jacobian's order."""
        return self.gaussian.covariance(self.weights, self.noise_scale)

    @property
    def gaussian_gain(self) -> FloatArray:
        """Derivative of the Gaussian fit's parameters by the voltages."""
        return self.gaussian.gain(self.weights)

    @cached_property
    def kernel(self) -> FloatArray:
        """Transform of A G at the quadrature nodes, in V/Pa."""
        gaussian = gaussian_transfer(self.model.k, self.gaussian.sigma)
        correction = self.basis.kernels(self.model.k) @ self.weighed.mean
        return np.asarray(self.gaussian.conversion_constant * gaussian + correction)

    def radial(self, r: FloatArray) -> FloatArray:
        """A G at radii ``r`` (m), in V/Pa/m^2."""
        gaussian = self.gaussian.conversion_constant * unit_gaussian(r, self.gaussian.sigma)
        return np.asarray(gaussian + self.basis.radial(r) @ self.weighed.mean)

    @property
    def spectrum(self) -> RadialSpectrum:
        """Transform of the voltage's radial profile per newton, in V m^2 / N."""
        reference = self.model.reference
        return RadialSpectrum(reference.wavenumbers, self.kernel * reference.values)

    @property
    def conversion_constant(self) -> float:
        """Integral of A G over the plane: A without any division, in V/Pa."""
        return float(self.gaussian.conversion_constant + self.basis.integrals @ self.weighed.mean)

    @property
    def centre(self) -> FloatArray:
        """Centre of the sensor (x0, y0), in m, with the departures allowed for."""
        plane = 2 if self.points.planar else 1
        corrected = self.gaussian.centre.copy()
        corrected[:plane] += self.weighed.mean[2 : 2 + plane]
        return corrected

    @property
    def drift(self) -> FloatArray:
        """Baseline and its change over half the range along x (and y), in V."""
        first = 4 if self.points.planar else 3
        return np.asarray(self.gaussian.drift + self.weighed.mean[first : self.basis.flat])

    @property
    def background(self) -> FloatArray:
        """Baseline and drift at each point, shape (n,), in V."""
        return np.asarray(self.model.drift_columns @ self.drift)

    @property
    def predicted(self) -> FloatArray:
        """Voltage at each point, shape (n,), in V."""
        return self.points.u - self.weighed.residual

    @property
    def largest_signal(self) -> float:
        """Largest voltage above the background, in V."""
        return float(np.abs(self.predicted - self.background).max())


def estimate_profile(points: ScanPoints, reference: RadialSpectrum) -> ProfileEstimate:
    """Estimate the radial profile of a scan, its centre, baseline, noise and outliers.

    Parameters
    ----------
    points : ScanPoints
        The measured points.
    reference : RadialSpectrum
        Transform of the base stress per newton.

    Returns
    -------
    ProfileEstimate
        The best Gaussian and the weighed departures from it.

    Raises
    ------
    FitError
        If the scan does not determine the parameters: no centre within it, or no signal that
        stands clear of zero.
    """
    model = ForwardModel(points, reference)
    stated = np.ones_like(points.u) if points.u_errors is None else points.u_errors**-2.0
    fit = fit_gaussian(model, stated)
    residual = points.u - fit.predicted
    outlier = _outlier_weight(residual * np.sqrt(stated), threshold=2 * OUTLIER_THRESHOLD)
    for _ in range(_WEIGHING_ROUNDS):
        weights = stated * outlier
        fit = fit_gaussian(model, weights, start=fit)
        basis = departure_basis(model, fit)
        weighed = weigh_departures(model, fit, basis, weights, float(outlier.sum()))
        found = _outlier_weight(weighed.residual * np.sqrt(stated), OUTLIER_THRESHOLD)
        if np.allclose(found, outlier, atol=0.02):
            break
        outlier = found
    estimate = ProfileEstimate(model, fit, basis, weighed, weights, outlier)
    _require_determined(estimate)
    return estimate


def _require_determined(estimate: ProfileEstimate) -> None:
    """Refuse a scan that does not cross its sensor, or whose signal is lost in noise."""
    points, integrals = estimate.points, estimate.basis.integrals
    for name, positions, centre in zip("xy", (points.x, points.y), estimate.centre, strict=True):
        if not positions.min() - points.step <= centre <= positions.max() + points.step:
            raise FitError(
                f"The sensor's centre would lie at {name} = {centre * 1e3:.4g} mm, outside the "
                f"scan from {positions.min() * 1e3:.4g} mm to {positions.max() * 1e3:.4g} mm.",
                why="A centre that was not crossed is not determined, nor is anything else.",
                cure="Scan across the sensor.",
            )
    uncertainty = float(np.sqrt(integrals @ estimate.covariance @ integrals))
    if not estimate.conversion_constant > LEAST_SIGNIFICANCE * uncertainty:
        raise FitError(
            f"The conversion constant would be ({estimate.conversion_constant * 1e3:.2g} ± "
            f"{uncertainty * 1e3:.2g}) mV/Pa: it is not told apart from zero.",
            why="The voltage does not rise above its noise as the rod passes, or the scan is too "
            "short to tell the profile's tail from the baseline.",
            cure="Check channel and positions; scan farther; raise the load or average repeats.",
        )


def _outlier_weight(standardised: FloatArray, threshold: float) -> FloatArray:
    """Weights that leave ordinary points at one and fall fast beyond the threshold.

    The influence w z of a point falls as 1/z^3 beyond the threshold, so a gross outlier
    moves nothing, yet no point is ever dropped.
    """
    scale = 1.4826 * np.median(np.abs(standardised))
    z = np.abs(standardised) / max(scale, np.finfo(float).tiny)
    return np.asarray(np.minimum(1.0, (threshold / np.maximum(z, threshold)) ** 4))
