"""One shape of pressure fitted to a scan, and the departures from it, by their evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from memscal.estimation.departure import DepartureBasis, departure_basis
from memscal.estimation.evidence import weigh_departures
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian_fit import GaussianFit
from memscal.estimation.newton import gauss_newton
from memscal.estimation.profile_estimate import NUMERICAL_FLOOR, ProfileEstimate
from memscal.measurement.pressure import PressureShape
from memscal.model.validation import FloatArray

__all__ = ["ShapeFit", "believed_noise", "fit_shape"]

#: A fit diverges if its width is this many times the Gaussian's, or that fraction of it.
_FARTHEST = 4.0
#: A pressure narrower than this share of the scan's step is not told from one without width.
_NARROWEST = 0.2
#: One of several shapes is nearer to a contact's pressure than a Gaussian is to a sensor's G:
#: departures are expected to be smaller by this factor.
_SMALLER = 0.4


@dataclass(frozen=True, eq=False)
class _Basis(DepartureBasis):
    """The kernels about a fitted pressure: its own two, and rings in units of its width."""

    shape: PressureShape

    def kernels(self, k: FloatArray) -> FloatArray:
        slope = self.conversion_constant * self.shape.widening(k, self.sigma)
        rings = [ring.transform(k) for ring in self.rings]
        return self._columns(self.shape.transform(k, self.sigma), slope, rings)


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """What the scan says of the pressure, for one shape to depart from.

    A state is the pressure's transform per newton at the model's nodes, then the free coordinates
    of the centre (m), then baseline and drift (V).

    Parameters
    ----------
    shape : PressureShape
        What was fitted.
    state : ndarray, shape (s,)
        Posterior mean.
    covariance : ndarray, shape (s, s)
        Expected squared error of the state.
    gain : ndarray, shape (s, n)
        Derivative of the state by the voltages.
    residual : ndarray, shape (n,)
        Voltages that are not explained, in V.
    noise : float
        Noise of a point of weight one that was found: in V, or over the stated uncertainties.
    log_evidence : float
        Of the shape and all its departures, up to a constant of the scan.
    """

    shape: PressureShape
    state: FloatArray
    covariance: FloatArray
    gain: FloatArray
    residual: FloatArray
    noise: float
    log_evidence: float


def fit_shape(shape: PressureShape, start: ProfileEstimate) -> ShapeFit:
    """Fit a shape from where a Gaussian has been, and weigh departures from it."""
    model, weights = start.model, start.weights
    fit = _fit(shape, model, weights, start.gaussian)
    rings = departure_basis(model, fit)
    smaller = tuple(replace(ring, amplitude=_SMALLER * ring.amplitude) for ring in rings.rings)
    basis = _Basis(rings.conversion_constant, rings.sigma, rings.flat, smaller, shape)
    count = float(start.outlier_weight.sum())
    weighed = weigh_departures(model, fit, basis, weights, count)
    rows = _state_rows(model.k, basis)
    kernel = fit.conversion_constant * shape.transform(model.k, fit.sigma)
    first = np.concatenate([kernel, fit.centre[model.points.free], fit.drift])
    growth = believed_noise(start, weighed.noise) / weighed.noise
    return ShapeFit(
        shape=shape,
        state=first + rows @ weighed.mean,
        covariance=growth**2 * (rows @ weighed.covariance @ rows.T),
        gain=rows @ weighed.gain,
        residual=weighed.residual,
        noise=weighed.noise,
        log_evidence=weighed.log_evidence - 0.5 * _log_information(model, weights, fit),
    )


def _fit(
    shape: PressureShape, model: ForwardModel, weights: FloatArray, start: GaussianFit
) -> GaussianFit:
    """Fit force, width, centre and drift; where that leads nowhere, stay with the Gaussian's."""
    free, standardised = model.points.free, model.points.standardised
    force, width = start.conversion_constant, max(start.sigma, _NARROWEST * model.points.step)
    theta = np.concatenate([[force, width], start.centre[free], start.drift])
    widths = np.full(1 + int(free.sum()), width)
    drifts = np.full(start.drift.size, np.ptp(model.points.u))
    scale = np.concatenate([[force], widths, drifts])

    def linearised(scaled: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = _linearise(shape, model, scaled * scale)
        misfit = standardised(found.predicted - model.points.u, weights)
        return misfit, standardised(found.jacobian, weights) * scale

    found = gauss_newton(linearised, theta / scale, tolerance=1e-9)
    if found is None or not found[0] > 0 or not 1 / _FARTHEST < found[1] < _FARTHEST:
        return _linearise(shape, model, theta)
    return _linearise(shape, model, found * scale)


def _linearise(shape: PressureShape, model: ForwardModel, theta: FloatArray) -> GaussianFit:
    """Return the model at given force, width, centres and drift, and its derivatives."""
    free = model.points.free
    force, width, centres = float(theta[0]), float(theta[1]), np.zeros(free.shape)
    centres[free] = theta[2 : 2 + free.sum()]
    drift = theta[2 + free.sum() :]
    geometry = model.geometry(centres)
    kernel, slope = shape.transform(model.k, width), shape.widening(model.k, width)
    signal, widening = model.signal(geometry, np.stack([kernel, slope], axis=1)).T
    shift = model.centre_derivative(geometry, force * kernel)
    jacobian = np.column_stack([signal, force * widening, shift, model.drift_columns])
    predicted = force * signal + model.drift_columns @ drift
    round_ = np.zeros(2)
    return GaussianFit(
        force, width, centres, drift, round_, model.points, geometry, jacobian, predicted
    )


def _state_rows(k: FloatArray, basis: _Basis) -> FloatArray:
    """Derivative of the state by the parameters and the departures' amplitudes."""
    kernels = basis.kernels(k)
    others = np.zeros((basis.flat - 2, kernels.shape[1]))
    others[:, 2 : basis.flat] = np.eye(basis.flat - 2)
    return np.vstack([kernels, others])


def _log_information(model: ForwardModel, weights: FloatArray, fit: GaussianFit) -> float:
    """Log determinant of the parameters' information, for flat priors alike of all shapes.

    They are flat in the logarithms of force and width, in centre, baseline and drift.
    """
    scale = np.ones(fit.jacobian.shape[1])
    scale[:2] = fit.conversion_constant, fit.sigma
    scaled = model.points.standardised(fit.jacobian * scale, weights)
    return 2 * float(np.log(np.abs(np.diag(np.linalg.qr(scaled, mode="r")))).sum())


def believed_noise(start: ProfileEstimate, found: float) -> float:
    """Noise of a point of weight one: stated uncertainties are believed until exceeded."""
    at_least = max(found, NUMERICAL_FLOOR * start.largest_signal)
    return at_least if start.points.u_errors is None else max(at_least, 1.0)
