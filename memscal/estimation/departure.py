r"""How far the scan departs from the Gaussian: a weighing by evidence.

The apparatus function is written as the best Gaussian plus rings of several radii, each
blurred by half the Gaussian's width,

.. math::

    A\,G(r) = A_0\,g_s(r) + \sum_j c_j\,(\delta_{q_j} \otimes g_{s/2})(r), \qquad
    \delta_q \to J_0(kq),

with :math:`c_j \sim N(0, \rho\,\sigma^2 e_j^2)` and an envelope :math:`e_j` that ends at
three widths.  The strength :math:`\rho` is not chosen but averaged over, weighted by its
restricted likelihood (Patterson and Thompson, Biometrika 58, 1971), half of the prior
belonging to :math:`\rho = 0`: no departure.  The rest of the parameters (A, width, centre,
baseline, drift) are flat, so that a Gaussian sensor costs almost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from memscal.estimation.forward import ForwardModel, gaussian_transfer
from memscal.estimation.gaussian_fit import GaussianFit
from memscal.model.validation import FloatArray

__all__ = ["DepartureBasis", "WeighedFit", "departure_basis", "weigh_departures"]

_RINGS = 14
_SUPPORT_IN_WIDTHS = 3.0
_BLUR = 0.5
#: A width below the sampling is not seen: rings are never narrower than this many steps.
_SMALLEST_WIDTH_IN_STEPS = 0.5
_NEGLIGIBLE = 1e-4
_STRENGTHS = np.concatenate([[0.0], np.logspace(-2, 7, 37)])


@dataclass(frozen=True, eq=False)
class DepartureBasis:
    """Transforms of the kernels that the fit is a combination of, and their integrals.

    ``kernels`` (nodes, p): derivatives of the transform of A G by the Gaussian's A and width
    (further columns of the Jacobian move no kernel and hold zeros), then the rings;
    ``integrals`` (p,): their values at k = 0; ``flat``: how many have no prior.
    """

    kernels: FloatArray
    integrals: FloatArray
    flat: int


@dataclass(frozen=True, eq=False)
class WeighedFit:
    """Posterior of corrections to the Gaussian fit, averaged over the departure's strength.

    Parameters
    ----------
    mean : ndarray, shape (p,)
        Corrections to the Gaussian fit's parameters, then ring amplitudes (V/Pa).
    covariance : ndarray, shape (p, p)
        Their posterior covariance, the spread over strengths included.
    noise : float
        Noise of a point of weight one: in V, or a factor on the stated uncertainties.
    gaussian_probability : float
        Posterior probability that there is no departure, from a prior of one half.
    gain : ndarray, shape (p, n)
        Derivative of ``mean`` by the voltages.
    residual : ndarray, shape (n,)
        Voltages that are not explained, in V.
    """

    mean: FloatArray
    covariance: FloatArray
    gain: FloatArray
    noise: float
    gaussian_probability: float
    residual: FloatArray


def departure_basis(model: ForwardModel, fit: GaussianFit) -> DepartureBasis:
    """Return the kernels of the fit's own parameters and of the rings about it."""
    k, sigma = model.k, fit.sigma
    blur = max(sigma, _SMALLEST_WIDTH_IN_STEPS * model.points.step)
    reach = 1.5 * _SUPPORT_IN_WIDTHS * blur
    q = (np.arange(_RINGS) + 0.5) * reach / _RINGS
    envelope = np.sqrt(q / blur) * np.exp(-0.5 * (q / (_SUPPORT_IN_WIDTHS * blur)) ** 4)
    rings = j0(np.multiply.outer(k, q)) * envelope
    rings *= gaussian_transfer(k, _BLUR * blur)[:, None]
    gaussian = gaussian_transfer(k, sigma)
    own = np.zeros((k.size, fit.jacobian.shape[1]))
    own[:, 0] = gaussian
    own[:, 1] = -fit.conversion_constant * sigma * k**2 * gaussian
    integrals = np.concatenate([[1.0], np.zeros(own.shape[1] - 1), envelope])
    return DepartureBasis(np.hstack([own, rings]), integrals, own.shape[1])


def weigh_departures(
    model: ForwardModel,
    fit: GaussianFit,
    basis: DepartureBasis,
    weights: FloatArray,
    effective_count: float,
) -> WeighedFit:
    """Weigh departures from a Gaussian fit by evidence.

    Parameters
    ----------
    model, fit, basis
        The forward model, the best Gaussian, and the kernels about it.
    weights : ndarray, shape (n,)
        Relative weights of the points.
    effective_count : float
        How many points the data are worth, outliers down-weighted.

    Returns
    -------
    WeighedFit
        Posterior mean and covariance of all corrections, and the noise.
    """
    root = np.sqrt(weights)
    rings = model.signal(fit.geometry, basis.kernels[:, basis.flat :])
    design = np.hstack([fit.jacobian, rings]) * root[:, None]
    scale = np.linalg.norm(design, axis=0)
    scale[basis.flat :] = scale[basis.flat :].max()
    design = design / scale
    data = root * (model.points.u - fit.predicted)
    probability, variance = _evidence(design, data, basis.flat, effective_count)
    information, projected = design.T @ design, design.T @ data
    average = np.zeros_like(information)
    second = np.zeros_like(information)
    for strength, p, v in zip(_STRENGTHS, probability, variance, strict=True):
        if p > 0:
            inverse = _posterior_inverse(information, basis.flat, strength)
            centre = inverse @ projected
            average += p * inverse
            second += p * (v * inverse + np.outer(centre, centre))
    gain = average @ design.T
    mean = average @ projected
    covariance = (second - np.outer(mean, mean)) / np.outer(scale, scale)
    return WeighedFit(
        mean=mean / scale,
        covariance=covariance,
        gain=gain * root / scale[:, None],
        noise=float(np.sqrt(probability @ variance)),
        gaussian_probability=float(probability[0]),
        residual=np.divide(data - design @ mean, root),
    )


def _evidence(
    design: FloatArray, data: FloatArray, flat: int, effective_count: float
) -> tuple[FloatArray, FloatArray]:
    """Posterior probability and noise variance for each departure strength.

    The flat columns are projected out (restricted likelihood); in the singular basis of
    what is left every strength costs one sum.
    """
    flat_part = np.linalg.qr(design[:, :flat])[0]
    rings = design[:, flat:] - flat_part @ (flat_part.T @ design[:, flat:])
    rest = data - flat_part @ (flat_part.T @ data)
    left, singular, _ = np.linalg.svd(rings, full_matrices=False)
    squared = singular**2
    power = (left.T @ rest) ** 2
    beyond = max(float(rest @ rest - power.sum()), 0.0)
    # Down-weighted points carry no full degree of freedom.
    freedom = effective_count - flat
    inflation = 1 + np.multiply.outer(_STRENGTHS, squared)
    variance = (beyond + (power / inflation).sum(axis=1)) / freedom
    variance = np.maximum(variance, np.finfo(float).tiny)
    log_evidence = -0.5 * (freedom * np.log(variance) + np.log(inflation).sum(axis=1))
    prior = np.full(_STRENGTHS.size, 0.5 / (_STRENGTHS.size - 1))
    prior[0] = 0.5
    posterior = prior * np.exp(log_evidence - log_evidence.max())
    posterior[posterior < _NEGLIGIBLE * posterior.sum()] = 0.0
    return posterior / posterior.sum(), variance


def _posterior_inverse(information: FloatArray, flat: int, strength: float) -> FloatArray:
    """Posterior covariance of all columns at one strength, per unit noise variance."""
    count = flat if strength == 0 else information.shape[0]
    precision = information[:count, :count].copy()
    if strength > 0:
        precision[range(flat, count), range(flat, count)] += 1 / strength
    covariance = np.zeros_like(information)
    covariance[:count, :count] = np.linalg.inv(precision)
    return covariance
