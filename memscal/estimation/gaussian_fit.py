r"""The Gaussian apparatus function that fits the scan best, in data space.

The paper's approximation, fitted where the noise is known: its convolution with the
reference stress against the scan, together with conversion constant, centre, baseline and
linear drift, by weighted least squares.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from memscal.estimation.ellipse import elliptic_columns
from memscal.estimation.forward import ForwardModel, Geometry, gaussian_transfer
from memscal.estimation.newton import gauss_newton
from memscal.estimation.points import ScanPoints
from memscal.estimation.starting import robust_start, smoothing_length, undetermined
from memscal.model.validation import FloatArray

__all__ = ["GaussianFit", "fit_gaussian", "linearise"]

_Loss = Literal["linear", "soft_l1"]

#: A step in the ellipticity that the solver takes for one.
_TYPICAL_ELLIPTICITY = 0.2
#: Standardised residual from which on the robust fit's loss grows linearly.
_KNEE = 3.0
#: A width below this share of its typical size is left to a search with a trust region.
_NARROWEST = 0.05


@dataclass(frozen=True, eq=False)
class GaussianFit:
    """Best Gaussian in data space, and the model linearised about it.

    Parameters
    ----------
    conversion_constant : float
        A, in V/Pa.
    sigma : float
        Standard deviation of the Gaussian, in m.
    centre : ndarray, shape (scans, 2)
        Centre (x0, y0) of the sensor in each scan, in m; zero where a line does not tell.
    drift : ndarray, shape (2 or 3 a scan,)
        Baseline of each scan, and its change over half the range along x (and y), in V.
    ellipticity : ndarray, shape (2,)
        e1 (along x against y) and e2 (along the diagonals), where the points spread over a plane.
    points : ScanPoints
        What was fitted.
    geometry : Geometry
        Distances from the centre.
    jacobian : ndarray, shape (n, p)
        Derivatives of the voltages by A, sigma, centre and drift, in this order.
    predicted : ndarray, shape (n,)
        Voltages of the fit, in V.
    """

    conversion_constant: float
    sigma: float
    centre: FloatArray
    drift: FloatArray
    ellipticity: FloatArray
    points: ScanPoints
    geometry: Geometry
    jacobian: FloatArray
    predicted: FloatArray

    def covariance(self, weights: FloatArray, noise: float) -> FloatArray:
        """Covariance of the parameters for a noise (V) and relative weights."""
        standardised = self.points.standardised(self.jacobian, weights)
        information = standardised.T @ standardised
        scale = np.sqrt(np.diag(information))
        inverse = np.linalg.inv(information / np.outer(scale, scale))
        return np.asarray(noise**2 * inverse / np.outer(scale, scale))

    def gain(self, weights: FloatArray) -> FloatArray:
        """Derivative of the parameters by the voltages, shape (p, n)."""
        twice = self.points.standardised(self.jacobian, weights)
        back = self.points.standardised(np.eye(weights.size), weights)
        return np.asarray(self.covariance(weights, 1.0) @ twice.T @ back)


def fit_gaussian(
    model: ForwardModel, weights: FloatArray, start: GaussianFit | None = None
) -> GaussianFit:
    """Fit a Gaussian apparatus function to the scan.

    Parameters
    ----------
    model : ForwardModel
        Points and reference.
    weights : ndarray, shape (n,)
        Relative weights: the inverse noise variance up to a common factor.
    start : GaussianFit, optional
        An earlier fit to start from; without one the search is global and robust.

    Raises
    ------
    FitError
        If the scan does not determine the parameters.
    """
    if start is None:
        return _solve(model, weights, robust_start(model, weights), loss="soft_l1")
    centres = start.centre[model.points.free]
    shape = [start.conversion_constant, start.sigma]
    ellipse = start.ellipticity[: model.points.ellipse]
    theta = np.concatenate([shape, centres, start.drift, ellipse])
    return _solve(model, weights, theta, loss="linear")


def _solve(model: ForwardModel, weights: FloatArray, start: FloatArray, loss: _Loss) -> GaussianFit:
    from scipy.optimize import least_squares

    standardised = model.points.standardised
    last: dict[bytes, GaussianFit] = {}

    def evaluate(scaled: FloatArray) -> GaussianFit:
        # Residuals and Jacobian are asked for at the same point, one after the other.
        key = scaled.tobytes()
        if key not in last:
            last.clear()
            last[key] = linearise(model, scaled * scale)
        return last[key]

    scale = _typical(model, start)
    unexplained = model.points.u - evaluate(start / scale).predicted
    noise = _robust_scale(standardised(unexplained, weights))

    def residual(scaled: FloatArray) -> FloatArray:
        return standardised(evaluate(scaled).predicted - model.points.u, weights) / noise

    def slope(scaled: FloatArray) -> FloatArray:
        return standardised(evaluate(scaled).jacobian, weights) * scale / noise

    # A robust fit is only where the next one starts.
    knee, tolerance = (_KNEE, 1e-4) if loss == "soft_l1" else (np.inf, 1e-9)
    found = gauss_newton(
        lambda scaled: (residual(scaled), slope(scaled)),
        start / scale,
        tolerance=tolerance,
        knee=knee,
    )
    # At a width of zero every slope by the width is zero: steps do not leave it.
    if found is None or found[1] < _NARROWEST:
        result = least_squares(
            residual,
            start / scale,
            jac=slope,
            loss=loss,
            f_scale=_KNEE,
            xtol=1e-10,
            ftol=1e-12,
            gtol=1e-10,
            max_nfev=100,
        )
        if not result.success:
            raise undetermined(model, linearise(model, result.x * scale).conversion_constant)
        found = np.asarray(result.x)
    fit = linearise(model, found * scale)
    if not 0 < fit.conversion_constant < np.inf:
        raise undetermined(model, fit.conversion_constant)
    return _positive_width(fit)


def _typical(model: ForwardModel, theta: FloatArray) -> FloatArray:
    """Typical size of each parameter, so that the solver sees numbers near one."""
    width = max(abs(theta[1]), 0.05 * smoothing_length(model))
    amplitude = np.ptp(model.points.u)
    centres = int(model.points.free.sum())
    ellipse = np.full(model.points.ellipse, _TYPICAL_ELLIPTICITY)
    drift = np.full(theta.size - 2 - centres - ellipse.size, amplitude)
    return np.concatenate([[abs(theta[0]), width], np.full(centres, width), drift, ellipse])


def linearise(model: ForwardModel, theta: FloatArray) -> GaussianFit:
    """Return the model and its derivatives at given parameters.

    Parameters
    ----------
    model : ForwardModel
        Points and reference.
    theta : ndarray, shape (p,)
        A, sigma, free coordinates of the centres, drift, and in a plane the ellipticity, as in
        :class:`GaussianFit`.
    """
    free, elliptic = model.points.free, model.points.ellipse
    amplitude, sigma = float(theta[0]), float(theta[1])
    centre = np.zeros(free.shape)
    centre[free] = theta[2 : 2 + free.sum()]
    drift = theta[2 + free.sum() : theta.size - elliptic]
    ellipticity = np.zeros(2)
    ellipticity[:elliptic] = theta[theta.size - elliptic :]
    geometry = model.geometry(centre)
    kernel = gaussian_transfer(model.k, sigma)
    columns = np.stack([kernel, -sigma * model.k**2 * kernel], axis=1)
    shape, widening, *ovals = (
        elliptic_columns(model, geometry, sigma, ellipticity).T
        if elliptic
        else model.signal(geometry, columns).T
    )
    shift = model.centre_derivative(geometry, amplitude * kernel)
    baseline = model.drift_columns
    oval = [amplitude * column for column in ovals[:elliptic]]
    jacobian = np.column_stack([shape, amplitude * widening, shift, baseline, *oval])
    predicted = amplitude * shape + baseline @ drift
    return GaussianFit(
        amplitude, sigma, centre, drift, ellipticity, model.points, geometry, jacobian, predicted
    )


def _positive_width(fit: GaussianFit) -> GaussianFit:
    """The model is even in the width: choose its positive branch."""
    if fit.sigma >= 0:
        return fit
    jacobian = fit.jacobian.copy()
    jacobian[:, 1] *= -1
    return replace(fit, sigma=-fit.sigma, jacobian=jacobian)


def _robust_scale(residual: FloatArray) -> float:
    """Median absolute deviation as a standard deviation, never zero."""
    scale = 1.4826 * float(np.median(np.abs(residual)))
    return max(scale, 1e-12 * float(np.abs(residual).max()), np.finfo(float).tiny)
