r"""Bayesian model averaging of radial departures from a Gaussian apparatus function.

A departure is a sum of rings of radius q, blurred by a Gaussian of width b, with random
amplitudes; each has a closed form on both sides of the Hankel transform,

.. math::

    a\,(\delta_q \otimes g_b)(r) = \frac{a}{2\pi b^2}\,e^{-(r^2+q^2)/2b^2} I_0(rq/b^2),
    \qquad a\,J_0(kq)\,e^{-b^2k^2/2} .

Lengths are in units of the width of the best Gaussian; the strength is the expected size over
the Gaussian's, both as L2 norms over the plane.  For a shape and strength (a hypothesis) the
model is linear, with Gaussian priors for the amplitudes and flat ones for the nuisance parameters:
marginal likelihood and posterior are in closed form.  With the flat columns projected out
(restricted likelihood: Patterson and Thompson, Biometrika 58, 1971), singular values :math:`s_j` of
what is left of the shape's columns, data :math:`p_j` along its singular vectors and their rest
:math:`\rho`,

.. math::

    -2\log p(u \mid \tau) = \nu\log\hat\sigma^2 + \sum_j\log(1+\tau^2 s_j^2/\hat\sigma^2), \qquad
    \nu\hat\sigma^2 = \rho + \sum_j \frac{p_j^2}{1+\tau^2 s_j^2/\hat\sigma^2} .

Of a scan that is only planned, expected squares take the place of the data's.  The estimate is the
posterior mean with a prior probability of 0.4 for the Gaussian itself; its uncertainty is the mean
squared error with priors that allow departures only, rougher ones among them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import ClassVar

import numpy as np
from scipy.special import i0e, j0

from memscal.axisymmetry.kernels import gaussian_transfer, unit_gaussian, unit_gaussian_slope
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.model.arrays import FloatArray

#: Rings are never narrower than this many steps: a width below the sampling is not resolved.
_SMALLEST_WIDTH_IN_STEPS = 0.5
#: Neighbouring rings overlap: this share of their blur apart.
_SPACING = 0.7
_FEWEST_RINGS = 6
#: A field is cut at this multiple of its extent, where its envelope has fallen to 1e-5.
_REACH = 2.2
_SCALES = 12


@dataclass(frozen=True, kw_only=True)
class Bayesian:
    """Bayesian model averaging in data space: the posterior mean of A G, or its MAP estimate."""

    nonnegative: bool = False  # G is nowhere negative
    monotone: bool = False  # G nowhere rises with the radius (a ring's does)
    name: ClassVar[str] = "bayesian"
    assumes: ClassVar[str] = "G is a Gaussian, or departs from one smoothly."
    fails: ClassVar[str] = (
        "Detail finer than a third of G's width that the film hides is not found, only allowed for."
    )

    @property
    def constrained(self) -> bool:
        """Whether a constraint is set."""
        return self.nonnegative or self.monotone


@dataclass(frozen=True, eq=False)
class Rings:
    """Blurred rings: ``radius`` and ``blur`` in m, ``amplitude`` in V/Pa; each of shape (m,)."""

    radius: FloatArray
    blur: FloatArray
    amplitude: FloatArray

    def transform(self, k: FloatArray) -> FloatArray:
        """Hankel transforms at ``k`` (rad/m), shape (k, m)."""
        blurred = np.exp(-0.5 * np.multiply.outer(k, self.blur) ** 2)
        return np.asarray(self.amplitude * blurred * j0(np.multiply.outer(k, self.radius)))

    def radial(self, r: FloatArray) -> FloatArray:
        """Values at radii ``r`` (m), shape (r, m), in V/Pa/m^2."""
        square = self.blur**2
        # The scaled Bessel function carries exp(-rq/b^2), which completes the square.
        near = np.exp(-0.5 * np.subtract.outer(r, self.radius) ** 2 / square)
        bessel = i0e(np.multiply.outer(r, self.radius / square))
        return np.asarray(self.amplitude / (2 * np.pi * square) * near * bessel)

    @property
    def size(self) -> float:
        """Expected L2 norm over the plane of the sum with random signs, in V/Pa/m."""
        square = i0e(self.radius**2 / (2 * self.blur**2)) / (4 * np.pi * self.blur**2)
        return float(np.sqrt(np.sum(self.amplitude**2 * square)))


@dataclass(frozen=True)
class Shape:
    """A kind of departure, in units of the Gaussian's width."""

    name: str
    blur: float  # finest width of its components
    extent: float  # of a field, the radius where its envelope falls; of scales, the largest width
    scales: bool = False  # Gaussians of all widths from blur to extent, not rings of one blur

    def rings(self, width: float, amplitude: float) -> Rings:
        """Components about a Gaussian of a width (m) and amplitude (V/Pa), by its L2 norm."""
        if self.scales:
            blur = width * np.geomspace(self.blur, self.extent, _SCALES)
            plain = Rings(np.zeros(_SCALES), blur, np.ones(_SCALES))
        else:
            reach = _REACH * self.extent
            count = max(_FEWEST_RINGS, math.ceil(reach / (_SPACING * self.blur)))
            q = (np.arange(count) + 0.5) * reach / count
            envelope = np.sqrt(q) * np.exp(-0.5 * (q / self.extent) ** 4)
            plain = Rings(width * q, np.full(count, width * self.blur), envelope)
        gaussian = amplitude / (2 * np.sqrt(np.pi) * width)
        return replace(plain, amplitude=plain.amplitude * gaussian / plain.size)


#: Edges (a disc, a plateau), a core (a ring, a spike), and tails.
SHAPES = (
    *(Shape("edge", 0.65, extent) for extent in (0.8, 1.2)),
    *(Shape("rough edge", blur, extent) for blur in (0.4, 0.5) for extent in (0.8, 1.2)),
    Shape("core", 0.3, 2.0, scales=True),
    *(Shape("tail", 0.85, extent) for extent in (1.8, 3.0)),
)


@dataclass(frozen=True, eq=False)
class DepartureBasis:
    """The kernels that an estimate is a combination of, about the best Gaussian."""

    conversion_constant: float  # the Gaussian, in V/Pa and m
    sigma: float
    flat: int  # how many parameters have no prior: A, width, centre, baseline and drift
    rings: tuple[Rings, ...]  # the components of each of :data:`SHAPES`

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Columns of each shape."""
        ends = self.flat + np.cumsum([0, *(ring.radius.size for ring in self.rings)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    def kernels(self, k: FloatArray) -> FloatArray:
        """Transforms of all columns at ``k`` (rad/m), shape (k, p)."""
        # The first two are by A and width; parameters that move no kernel hold zeros.
        gaussian = gaussian_transfer(k, self.sigma)
        widening = -self.conversion_constant * self.sigma * k**2 * gaussian
        return self._columns(gaussian, widening, [ring.transform(k) for ring in self.rings])

    def radial(self, r: FloatArray) -> FloatArray:
        """Values of all columns at radii ``r`` (m), shape (r, p)."""
        gaussian = unit_gaussian(r, self.sigma)
        widening = self.conversion_constant * unit_gaussian_slope(r, self.sigma)
        return self._columns(gaussian, widening, [ring.radial(r) for ring in self.rings])

    @cached_property
    def integrals(self) -> FloatArray:
        """Integrals of all columns over the plane, shape (p,)."""
        return np.asarray(self.kernels(np.zeros(1))[0])

    def _columns(
        self, gaussian: FloatArray, widening: FloatArray, rings: list[FloatArray]
    ) -> FloatArray:
        unmoved = np.zeros((gaussian.size, self.flat - 2))
        return np.hstack([gaussian[:, None], widening[:, None], unmoved, *rings])


def departure_basis(model: ForwardModel, fit: GaussianFit) -> DepartureBasis:
    """Return the kernels of the fit's own parameters and of every shape about it."""
    width = max(fit.sigma, _SMALLEST_WIDTH_IN_STEPS * model.points.step)
    rings = tuple(shape.rings(width, fit.conversion_constant) for shape in SHAPES)
    return DepartureBasis(fit.conversion_constant, fit.sigma, fit.jacobian.shape[1], rings)


_VARIANCE_ROUNDS = 8
#: The smallest noise, over the largest residual of a Gaussian, that is distinct from rounding.
_ROUNDING = 1e-9
#: Hypotheses of a smaller share of the posterior probability are left out.
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True, eq=False)
class _Design:
    """One shape's weighted columns, and the SVD of what is left of them beside the flat columns."""

    block: slice  # where its amplitudes stand among all parameters
    columns: FloatArray  # (n, m)
    left: FloatArray
    singular: FloatArray
    right: FloatArray
    along: FloatArray  # the data along the left singular vectors
    power: FloatArray  # their squares, those of the expected noise included


@dataclass(frozen=True, eq=False)
class _Conditional:
    """Marginal likelihood and posterior given one hypothesis, at the MAP estimate of the noise."""

    log_marginal: float
    variance: float  # of the noise
    strength: float
    design: _Design | None
    shrink: FloatArray  # from data to amplitudes, along the singular vectors
    slope: FloatArray  # (n,): derivative of log_marginal by the weighted data

    def amplitude_covariance(self, least_variance: float) -> FloatArray:
        """Posterior covariance of the amplitudes, for at least this variance of the noise."""
        if self.design is None:
            return np.zeros((0, 0))
        prior, right = self.strength**2, self.design.right
        variance = max(self.variance, least_variance)
        left_over = prior * variance / (variance + prior * self.design.singular**2)
        determined = (right.T * left_over) @ right
        if right.shape[0] == right.shape[1]:
            return np.asarray(determined)
        # Fewer points than components leave the prior as it was in all other directions.
        return np.asarray(determined + prior * (np.eye(right.shape[1]) - right.T @ right))


@dataclass(frozen=True, eq=False)
class _LinearModel:
    """Weighted data and columns of flat prior, which every hypothesis shares."""

    scale: FloatArray  # (flat,)
    q: FloatArray
    inverse: FloatArray
    data: FloatArray  # (n,)
    rest: FloatArray  # (n,): what the flat columns leave over
    freedom: float
    added: float  # variance of noise that is expected, but not in the data

    @classmethod
    def of(cls, flat: FloatArray, data: FloatArray, freedom: float, added: float) -> _LinearModel:
        """Project the weighted flat columns out of the weighted data."""
        scale = np.linalg.norm(flat, axis=0)
        q, r = np.linalg.qr(flat / scale)
        return cls(scale, q, np.linalg.inv(r), data, data - q @ (q.T @ data), freedom, added)

    @cached_property
    def least_squares(self) -> FloatArray:
        """From weighted data to the flat parameters without departures, shape (flat, n)."""
        return np.asarray((self.inverse @ self.q.T) / self.scale[:, None])

    @cached_property
    def power(self) -> float:
        """Square of all that the flat columns leave over, the expected noise included."""
        return float(self.rest @ self.rest) + self.added * self.freedom

    def decompose(self, columns: FloatArray, block: slice) -> _Design:
        """Decompose a shape's weighted columns; ``block`` is where they stand among all."""
        free = columns - self.q @ (self.q.T @ columns)
        left, singular, right = np.linalg.svd(free, full_matrices=False)
        along = left.T @ self.rest
        # Of a vector that meets the flat columns, only what lies beside them carries noise.
        power = along**2 + self.added * (1 - np.sum((self.q.T @ left) ** 2, axis=0))
        return _Design(block, columns, left, singular, right, along, power)

    def gaussian(self) -> _Conditional:
        """Return the conditional without any departure."""
        variance = self._floor(self.power / self.freedom)
        log_marginal = -0.5 * self.freedom * float(np.log(variance))
        return _Conditional(log_marginal, variance, 0.0, None, np.zeros(0), -self.rest / variance)

    def condition(self, design: _Design, strength: float) -> _Conditional:
        """Return the conditional on a shape and its strength, the noise at its MAP estimate."""
        beyond = max(self.power - float(design.power.sum()), 0.0)
        signal = (strength * design.singular) ** 2
        variance = self._floor(self.power / self.freedom)
        for _ in range(_VARIANCE_ROUNDS):
            explained = design.power * variance / (variance + signal)
            variance = self._floor((beyond + float(explained.sum())) / self.freedom)
        log_determinant = float(np.log(1 + signal / variance).sum())
        log_marginal = -0.5 * (self.freedom * np.log(variance) + log_determinant)
        shrink = strength**2 * design.singular / (variance + signal)
        left_over = signal / (variance + signal) * design.along
        slope = (design.left @ left_over - self.rest) / variance
        return _Conditional(log_marginal, variance, strength, design, shrink, slope)

    def _floor(self, variance: float) -> float:
        return max(variance, (_ROUNDING * float(np.abs(self.data).max())) ** 2, 1e-300)


@dataclass(frozen=True)
class Hypothesis:
    """A shape at a strength, with its prior probabilities; no shape for the Gaussian itself."""

    shape: Shape | None
    strength: float
    estimate: float
    uncertainty: float


def _hypotheses() -> tuple[Hypothesis, ...]:
    """The prior: probabilities by kind of departure, shared evenly within one."""
    kinds: list[tuple[str, tuple[float, ...], float, float]] = [
        ("edge", (0.4, 0.8), 0.20, 0.0),
        ("rough edge 0.4", (0.4,), 0.07, 0.30),
        ("rough edge 0.5", (0.8, 1.6), 0.0, 0.10),
        ("core", (0.4,), 0.06, 0.0),
        ("core", (0.3,), 0.0, 0.30),
        ("tail", (0.2,), 0.27, 0.30),
    ]
    hypotheses = [Hypothesis(None, 0.0, 0.40, 0.0)]
    for kind, strengths, estimate, uncertainty in kinds:
        shapes = [s for s in SHAPES if kind in (s.name, f"{s.name} {s.blur}")]
        pairs = list(product(shapes, strengths))
        priors = estimate / len(pairs), uncertainty / len(pairs)
        hypotheses += [Hypothesis(shape, strength, *priors) for shape, strength in pairs]
    return tuple(hypotheses)


HYPOTHESES = _hypotheses()


@dataclass(frozen=True, eq=False)
class WeighedFit:
    """Posterior of corrections to the Gaussian fit, averaged over the hypotheses."""

    mean: FloatArray  # (p,): corrections to the fit's parameters, then the shapes' amplitudes
    covariance: FloatArray  # (p, p): expected squared error, the spread over hypotheses included
    gain: FloatArray  # (p, n): derivative of the mean by the voltages
    noise: float  # noise of a point of weight one: in V, or a factor on the stated uncertainties
    probability: FloatArray  # (h,): posterior probability of each of HYPOTHESES
    residual: FloatArray  # (n,): voltages that are not explained, in V
    log_marginal_likelihood: float = 0.0  # of all hypotheses, up to a constant of the scan

    @property
    def gaussian_probability(self) -> float:
        """Posterior probability that there is no departure, from a prior of 0.4."""
        return float(self.probability[0])


def weigh_departures(
    model: ForwardModel,
    fit: GaussianFit,
    basis: DepartureBasis,
    weights: FloatArray,
    effective_count: float,
    expected_noise: float = 0.0,
    least_noise: float = 0.0,
) -> WeighedFit:
    """Average departures from a Gaussian fit over the hypotheses."""
    # ``effective_count``: number of readings in the data, more than points if each is a mean of
    # repeats.  Of a point of weight one, ``expected_noise`` is that of voltages that have none
    # (zero for data), ``least_noise`` the least that the covariance counts.
    standardised, flat = model.points.standardised, basis.flat
    voltages = model.signal(fit.geometry, basis.kernels(model.k)[:, flat:])
    unexplained = model.points.u - fit.predicted
    rings, data = standardised(voltages, weights), standardised(unexplained, weights)
    # Down-weighted points carry no full degree of freedom.
    jacobian = standardised(fit.jacobian, weights)
    linear = _LinearModel.of(jacobian, data, effective_count - flat, expected_noise**2)
    designs = [
        linear.decompose(rings[:, block.start - flat : block.stop - flat], block)
        for block in basis.blocks
    ]
    conditionals = [linear.gaussian()]
    for hypothesis in HYPOTHESES[1:]:
        assert hypothesis.shape is not None
        design = designs[SHAPES.index(hypothesis.shape)]
        conditionals.append(linear.condition(design, hypothesis.strength))
    averaged = _average(linear, conditionals, flat + rings.shape[1], least_noise**2)
    explained = fit.jacobian @ averaged.mean[:flat] + voltages @ averaged.mean[flat:]
    gain = averaged.gain @ standardised(np.eye(data.size), weights)
    return replace(averaged, gain=gain, residual=unexplained - explained)


def _average(
    linear: _LinearModel, conditionals: list[_Conditional], count: int, least_variance: float
) -> WeighedFit:
    """Average mean and gain by one set of probabilities, squared errors by the other."""
    # The gain is that of the standardised data, and the residual is left to be computed.
    log_marginal = np.array([c.log_marginal for c in conditionals])
    prior = np.array([h.estimate for h in HYPOTHESES])
    estimate = _posterior(log_marginal, prior)
    uncertainty = _posterior(log_marginal, np.array([h.uncertainty for h in HYPOTHESES]))
    gain = np.zeros((count, linear.data.size))
    for p, conditional in zip(estimate, conditionals, strict=True):
        if p > 0:
            _add_gain(gain, linear, conditional, p)
    mean = gain @ linear.data
    # The probabilities depend on the data, too: d(p m) = (m - mean) p d(log marginal likelihood).
    moving, covariance = np.zeros_like(gain), np.zeros((count, count))
    for p, q, conditional in zip(estimate, uncertainty, conditionals, strict=True):
        if p == q == 0:
            continue
        of_hypothesis = np.zeros_like(gain)
        _add_gain(of_hypothesis, linear, conditional, 1.0)
        off = of_hypothesis @ linear.data - mean
        if p > 0:
            moving += p * np.outer(off, conditional.slope)
        if q > 0:
            covariance += q * np.outer(off, off)
            if linear.added:
                apart = of_hypothesis - gain
                covariance += q * linear.added * (apart @ apart.T)
            _add_covariance(covariance, linear, conditional, q, least_variance)
    noise = float(np.sqrt(estimate @ np.array([c.variance for c in conditionals])))
    possible = prior > 0
    likelihood = float(np.logaddexp.reduce(log_marginal[possible] + np.log(prior[possible])))
    gain += moving
    return WeighedFit(mean, covariance, gain, noise, estimate, linear.data, likelihood)


def _posterior(log_marginal: FloatArray, prior: FloatArray) -> FloatArray:
    """Posterior probabilities by Bayes' theorem, negligible ones set to zero."""
    weight = prior * np.exp(log_marginal - log_marginal[prior > 0].max())
    weight[weight < _NEGLIGIBLE * weight.sum()] = 0.0
    return np.asarray(weight / weight.sum())


def _add_gain(
    gain: FloatArray, linear: _LinearModel, conditional: _Conditional, share: float
) -> None:
    """Add the derivative of the posterior mean given a hypothesis, times its probability."""
    fitted, design = linear.least_squares, conditional.design
    flat = len(fitted)
    gain[:flat] += share * fitted
    if design is not None:
        amplitudes = (design.right.T * conditional.shrink) @ design.left.T
        gain[design.block] += share * amplitudes
        gain[:flat] -= share * (fitted @ design.columns) @ amplitudes


def _add_covariance(
    covariance: FloatArray,
    linear: _LinearModel,
    conditional: _Conditional,
    share: float,
    least_variance: float,
) -> None:
    """Add the posterior covariance given a hypothesis, times its probability."""
    flat = linear.scale.size
    plain = linear.inverse @ linear.inverse.T / np.outer(linear.scale, linear.scale)
    covariance[:flat, :flat] += share * max(conditional.variance, least_variance) * plain
    design = conditional.design
    if design is not None:
        amplitudes = conditional.amplitude_covariance(least_variance)
        carried = linear.least_squares @ design.columns
        covariance[design.block, design.block] += share * amplitudes
        covariance[:flat, design.block] -= share * carried @ amplitudes
        covariance[design.block, :flat] -= share * amplitudes @ carried.T
        covariance[:flat, :flat] += share * carried @ amplitudes @ carried.T
