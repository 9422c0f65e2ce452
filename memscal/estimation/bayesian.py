r"""Bayesian model averaging of radial departures from a Gaussian apparatus function.

A departure is a sum of rings of radius q, blurred by a Gaussian of width b, with random
amplitudes; each has a closed form on both sides of the Hankel transform,

.. math::

    a\,(\delta_q \otimes g_b)(r) = \frac{a}{2\pi b^2}\,e^{-(r^2+q^2)/2b^2} I_0(rq/b^2),
    \qquad a\,J_0(kq)\,e^{-b^2k^2/2} .

Lengths are in units of the width of the best Gaussian; the strength is the expected size over the
Gaussian's, both as L2 norms over the plane.  Families (blurred discs, wide tails, rings) are no
small departures: the sensor of each that fits best stands in the Gaussian's place.  For a sensor,
shape and strength (a hypothesis) the model is linear, with Gaussian priors for the amplitudes and
flat ones for ln A, ln(width) and the nuisance parameters:
marginal likelihood and posterior are in closed form.  With the flat columns projected out
(restricted likelihood: Patterson and Thompson, Biometrika 58, 1971), singular values :math:`s_j` of
what is left of the shape's columns, data :math:`p_j` along its singular vectors and their rest
:math:`\rho`,

.. math::

    -2\log p(u \mid \tau) = \nu\log\hat\sigma^2 + \sum_j\log(1+\tau^2 s_j^2/\hat\sigma^2), \qquad
    \nu\hat\sigma^2 = \rho + \sum_j \frac{p_j^2}{1+\tau^2 s_j^2/\hat\sigma^2} .

and less ln of the determinant of the flat columns X, :math:`\log|X^TX|^{1/2}`.  Where noise is
stated, :math:`\hat\sigma` is at least that.  Of a scan that is only planned, expected squares take
the place of the data's.  The estimate is the posterior mean with a prior probability of 0.45 for
the Gaussian itself; its uncertainty is the mean squared error with priors that allow no Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress, pairwise, product
from typing import ClassVar

import numpy as np

from memscal.axisymmetry import kernels
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel, Rings, SmoothedDisc
from memscal.estimation.angular import AngularDepartures
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit, ReducedScan
from memscal.estimation.voltage_map import VoltageMap
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
    assumes: ClassVar[str] = "G is a Gaussian, a blurred disc, has wide tails, or departs smoothly."
    fails: ClassVar[str] = (
        "Detail finer than a third of G's width that the film hides is not found, only allowed for."
    )

    @property
    def constrained(self) -> bool:
        """Whether a constraint is set."""
        return self.nonnegative or self.monotone


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


@dataclass(frozen=True)
class Family:
    """Sensors that no departure from a Gaussian resembles: blurred discs, wide tails, rings."""

    name: str
    share: float  # of the disc in the mean square radius; of the second Gaussian in the integral
    spread: float  # standard deviation of the share within the family
    ratio: float = 0.0  # of the second Gaussian's width to the first's; none of a disc

    def kernel(self, width: float, offset: float = 0.0) -> RadialKernel:
        """G for a width (m), with the share off by some of its spread."""
        share = self.share + offset * self.spread
        if self.ratio:
            return GaussianMixture((1 - share, share), (width, self.ratio * width))
        return SmoothedDisc(2 * width * math.sqrt(share), width * math.sqrt(1 - share))


#: Shares of discs and their spreads, about half the way to the next share.
_DISCS = ((0.35, 0.2), (0.6, 0.2), (0.8, 0.12), (0.92, 0.08), (0.98, 0.04))
FAMILIES = (
    *(Family("disc", share, spread) for share, spread in _DISCS),
    *(Family("wide tail", 0.15, 0.08, ratio) for ratio in (2.0, 2.4, 2.9)),
    Family("wide tail", 0.35, 0.12, 2.0),
    Family("ring", -0.3, 0.15, 0.5),
)
#: Step in ln(width) of the derivative by it.
_RELATIVE_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class FamilyFit:
    """The sensor of a family that fits the scan best."""

    family: Family
    conversion_constant: float  # in V/Pa
    width: float  # in m

    def columns(self, of: Callable[[RadialKernel], FloatArray]) -> list[FloatArray]:
        """A G of the sensor, and its changes by ln(width) and by the spread of the share."""
        family, width, a = self.family, self.width, self.conversion_constant
        sensor, wider = (of(family.kernel(width * x)) for x in (1.0, 1 + _RELATIVE_STEP))
        less = of(family.kernel(width, -1.0))
        return [a * sensor, a / _RELATIVE_STEP * (wider - sensor), a * (sensor - less)]


@dataclass(frozen=True, eq=False)
class DepartureBasis:
    """The kernels that an estimate is a combination of, about the best Gaussian."""

    conversion_constant: float  # the Gaussian, in V/Pa and m
    sigma: float
    flat: int  # how many parameters have no prior: A, width, centre, baseline and drift
    rings: tuple[Rings, ...]  # the components of each of :data:`SHAPES`
    families: tuple[FamilyFit, ...]  # as many as fit the scan
    angular: AngularDepartures | None  # the last flat ones: theirs is a prior of unit variance

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Columns of each shape, then of each family: its sensor less the Gaussian, changes."""
        counts = [*(ring.radius.size for ring in self.rings), *(3 for _ in self.families)]
        ends = self.flat + np.cumsum([0, *counts])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    def kernels(self, k: FloatArray) -> FloatArray:
        """Transforms of all columns at ``k`` (rad/m), shape (k, p)."""
        # The first two are by A and width; parameters that move no kernel hold zeros.
        gaussian = kernels.gaussian_transfer(k, self.sigma)
        widening = -self.conversion_constant * self.sigma * k**2 * gaussian
        rings = [ring.transform(k) for ring in self.rings]
        families = self._families(gaussian, lambda kernel: kernel.transform(k))
        return self._columns(gaussian, widening, rings + families)

    def columns(self, reduced: ReducedScan) -> FloatArray:
        """Voltages of all columns, standardised, of a reduced scan, (r, p)."""
        around = [self.angular.combined(reduced.rings)] if self.angular else []
        kernels = self.kernels(reduced.model.k)[:, self.flat :]
        return np.hstack([reduced.flat, *around, reduced.signal(kernels)])

    def voltages(
        self, model: ForwardModel, fit: GaussianFit, coefficients: FloatArray
    ) -> FloatArray:
        """Voltages at the points of combinations of all columns, (p,) or (p, m): (n,) or (n, m)."""
        # Coefficients are few: of a million points there is no room for all columns.
        count = fit.jacobian.shape[1]
        volts = fit.jacobian @ coefficients[:count]
        if self.angular:
            theirs = coefficients[count : self.flat]
            around = self.angular.signal(model, fit.centre, theirs.reshape(len(theirs), -1))
            volts += around.reshape(volts.shape)
        kernels = self.kernels(model.k)[:, self.flat :]
        return np.asarray(volts + model.signal(fit.geometry, kernels @ coefficients[self.flat :]))

    def radial(self, r: FloatArray) -> FloatArray:
        """Values of all columns at radii ``r`` (m), shape (r, p)."""
        gaussian = kernels.unit_gaussian(r, self.sigma)
        widening = self.conversion_constant * kernels.unit_gaussian_slope(r, self.sigma)
        rings = [ring.radial(r) for ring in self.rings]
        families = self._families(gaussian, lambda kernel: kernel.radial(r))
        return self._columns(gaussian, widening, rings + families)

    @cached_property
    def integrals(self) -> FloatArray:
        """Integrals of all columns over the plane, shape (p,)."""
        return np.asarray(self.kernels(np.zeros(1))[0])

    def _families(
        self, gaussian: FloatArray, of: Callable[[RadialKernel], FloatArray]
    ) -> list[FloatArray]:
        """Columns of each family, three as a block: its sensor less the Gaussian, and changes."""
        blocks = []
        for fit in self.families:
            sensor, *changes = fit.columns(of)
            less = sensor - self.conversion_constant * gaussian
            blocks.append(np.stack([less, *changes], axis=1))
        return blocks

    def _columns(
        self, gaussian: FloatArray, widening: FloatArray, blocks: list[FloatArray]
    ) -> FloatArray:
        unmoved = np.zeros((gaussian.size, self.flat - 2))
        return np.hstack([gaussian[:, None], widening[:, None], unmoved, *blocks])


def departure_basis(
    model: ForwardModel,
    fit: GaussianFit,
    reduced: ReducedScan | None = None,
    angular: AngularDepartures | None = None,
) -> DepartureBasis:
    """Return the kernels of the fit's own parameters and of every shape about it."""
    # With the scan as reduced about the fit, of the families' best fits, too.
    width = max(fit.sigma, _SMALLEST_WIDTH_IN_STEPS * model.points.step)
    rings = tuple(shape.rings(width, fit.conversion_constant) for shape in SHAPES)
    families = () if reduced is None else tuple(_fitted_families(reduced, width))
    flat = fit.jacobian.shape[1] + (angular.count if angular else 0)
    return DepartureBasis(fit.conversion_constant, fit.sigma, flat, rings, families, angular)


#: Steps in ln(width) end below the first, are cut at the second; beyond the third factor from the
#: Gaussian's width a family does not fit the scan.
_FAMILY_ROUNDS = 8
_SETTLED, _LONGEST, _FARTHEST = 1e-3, 0.3, 2.5


def _fitted_families(reduced: ReducedScan, start: float) -> Iterator[FamilyFit]:
    """Fit A and width of every family, centre, baseline and drift by the way."""
    fit, k, step = reduced.fit, reduced.model.k, _RELATIVE_STEP
    others = np.linalg.qr(reduced.flat[:, 2:])[0]

    def free(values: FloatArray) -> FloatArray:
        return np.asarray(values - others @ (others.T @ values))

    gaussian = fit.conversion_constant * kernels.gaussian_transfer(k, fit.sigma)
    data = free(reduced.data + reduced.signal(gaussian))
    widths, amplitudes = np.full((2, len(FAMILIES)), start)
    for _ in range(_FAMILY_ROUNDS):
        sensors = [
            family.kernel(width * factor).transform(k)
            for factor in (1.0, 1 + step)
            for family, width in zip(FAMILIES, widths, strict=True)
        ]
        signal, wider = np.hsplit(free(reduced.signal(np.stack(sensors, axis=1))), 2)
        # Least squares in A and A d ln(width), of all families at once.
        slope = (wider - signal) / step
        a, b, c = (np.sum(x, axis=0) for x in (signal**2, signal * slope, slope**2))
        determinant = a * c - b**2
        amplitudes = (c * (data @ signal) - b * (data @ slope)) / determinant
        growth = (a * (data @ slope) - b * (data @ signal)) / determinant / amplitudes
        growth = np.clip(growth, -_LONGEST, _LONGEST)
        widths = widths * np.exp(growth)
        if np.abs(growth).max() < _SETTLED:
            break
    for family, width, amplitude in zip(FAMILIES, widths, amplitudes, strict=True):
        if amplitude > 0 and start / _FARTHEST < width < start * _FARTHEST:
            yield FamilyFit(family, float(amplitude), float(width))


#: The smallest noise, over the largest residual of a Gaussian, that is distinct from rounding.
_ROUNDING = 1e-9
#: Hypotheses of a smaller share of the posterior probability are left out.
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True, eq=False)
class _Design:
    """Weighted columns of departures, and the SVD of what is left of them beside the flat ones."""

    places: FloatArray  # (p, m): where their amplitudes stand among all parameters
    columns: FloatArray  # (n, m)
    left: FloatArray
    singular: FloatArray
    right: FloatArray
    along: FloatArray  # the data along the left singular vectors
    power: FloatArray  # their squares, those of the expected noise included


@dataclass(frozen=True, eq=False)
class _Conditional:
    """Marginal likelihood and posterior given one hypothesis, at the MAP estimate of the noise."""

    linear: _LinearModel
    log_marginal: float
    scatter: float  # variance of the residuals
    variance: float  # of the noise: at least as stated
    slope: FloatArray  # (n,): derivative of log_marginal by the weighted data
    design: _Design | None = None
    strength: float = 0.0

    def posterior(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mean (p,), its derivative by the weighted data (p, n), and covariance (p, p)."""
        linear, design = self.linear, self.design
        fitted, places = linear.least_squares, linear.places
        plain = linear.inverse @ linear.inverse.T / np.outer(linear.scale, linear.scale)
        gain, covariance = fitted, self.variance * plain
        if design is not None:
            prior, right, carried = self.strength**2, design.right, fitted @ design.columns
            # Posterior variances along the singular vectors; in all other directions the prior's.
            left = prior * self.variance / (self.variance + prior * design.singular**2)
            amplitudes = (right.T * (left * design.singular / self.variance)) @ design.left.T
            spread = (right.T * (left - prior)) @ right + prior * np.eye(right.shape[1])
            gain = np.vstack([fitted - carried @ amplitudes, amplitudes])
            both = np.vstack([-carried, np.eye(right.shape[1])])
            whole = both @ spread @ both.T
            whole[: len(plain), : len(plain)] += covariance
            covariance, places = whole, np.hstack([places, design.places])
        mean = linear.start + places @ (gain @ linear.data)
        return mean, places @ gain, places @ covariance @ places.T


@dataclass(frozen=True, eq=False)
class _LinearModel:
    """Weighted data and columns of flat prior about one sensor, the Gaussian or a family's."""

    start: FloatArray  # (p,): the sensor among all parameters
    places: FloatArray  # (p, flat): where the flat parameters stand among them
    scale: FloatArray  # (flat,)
    q: FloatArray
    inverse: FloatArray
    log_determinant: float  # of the columns
    data: FloatArray  # (n,)
    rest: FloatArray  # (n,): what the flat columns leave over
    freedom: float
    added: float  # variance of noise that is expected, but not in the data
    least: float  # variance of the noise as stated

    @classmethod
    def of(
        cls,
        start: FloatArray,
        places: FloatArray,
        flat: FloatArray,
        data: FloatArray,
        *noise: float,
    ) -> _LinearModel:
        """Project the weighted flat columns out of the weighted data."""
        scale = np.linalg.norm(flat, axis=0)
        q, r = np.linalg.qr(flat / scale)
        size = float(np.log(np.abs(np.diag(r)) * scale).sum())
        rest = data - q @ (q.T @ data)
        return cls(start, places, scale, q, np.linalg.inv(r), size, data, rest, *noise)

    @cached_property
    def least_squares(self) -> FloatArray:
        """From weighted data to the flat parameters without departures, shape (flat, n)."""
        return np.asarray((self.inverse @ self.q.T) / self.scale[:, None])

    @cached_property
    def power(self) -> float:
        """Square of all that the flat columns leave over, the expected noise included."""
        return float(self.rest @ self.rest) + self.added * self.freedom

    def decompose(self, columns: FloatArray, places: FloatArray) -> _Design:
        free = columns - self.q @ (self.q.T @ columns)
        left, singular, right = np.linalg.svd(free, full_matrices=False)
        along = left.T @ self.rest
        # Of a vector that meets the flat columns, only what lies beside them carries noise.
        power = along**2 + self.added * (1 - np.sum((self.q.T @ left) ** 2, axis=0))
        return _Design(places, columns, left, singular, right, along, power)

    def condition(self, design: _Design | None = None, strength: float = 0.0) -> _Conditional:
        """Return the conditional on departures of a strength, the noise at its MAP estimate."""
        scatter = self._distinct(self.power / self.freedom)
        beyond, signal, power = self.power, np.zeros(0), np.zeros(0)
        if design is not None:
            signal, power = (strength * design.singular) ** 2, design.power
            beyond = max(self.power - float(power.sum()), 0.0)
            for _ in range(8):
                explained = power * scatter / (scatter + signal)
                scatter = self._distinct((beyond + float(explained.sum())) / self.freedom)
        variance = max(scatter, self.least)
        square = beyond / variance + float((power / (variance + signal)).sum())
        log_determinant = float(np.log(1 + signal / variance).sum())
        log_marginal = -0.5 * (self.freedom * np.log(variance) + square + log_determinant)
        log_marginal -= self.log_determinant
        if design is None:
            return _Conditional(self, log_marginal, scatter, variance, -self.rest / variance)
        left_over = signal / (variance + signal) * design.along
        slope = (design.left @ left_over - self.rest) / variance
        return _Conditional(self, log_marginal, scatter, variance, slope, design, strength)

    def _distinct(self, variance: float) -> float:
        return max(variance, (_ROUNDING * float(np.abs(self.data).max())) ** 2, 1e-300)


@dataclass(frozen=True)
class Hypothesis:
    """The Gaussian or a family, with departures of a shape and strength; prior probabilities."""

    family: Family | None
    shape: Shape | None
    strength: float
    estimate: float
    uncertainty: float

    @property
    def kind(self) -> str:
        """Name of the family, or of the shape; none of the Gaussian itself."""
        named = self.family or self.shape
        return named.name if named else ""


#: Family (none: the Gaussian), departure from it and its strengths; prior probabilities, shared
#: evenly within a row, for the estimate and for its uncertainty.
_PRIOR: tuple[tuple[str, str, tuple[float, ...], float, float], ...] = (
    ("", "", (0.0,), 0.45, 0.0),
    ("", "edge", (0.4,), 0.20, 0.0),
    ("", "rough edge 0.4", (0.4,), 0.01, 0.015),
    ("", "rough edge 0.5", (0.8, 1.6), 0.0, 0.005),
    ("", "core", (0.4,), 0.03, 0.0),
    ("", "core", (0.3,), 0.0, 0.015),
    ("", "tail", (0.2,), 0.105, 0.015),
    ("disc", "", (0.0,), 0.10, 0.30),
    ("disc", "edge", (0.2,), 0.0, 0.17),
    ("disc", "core", (0.2,), 0.0, 0.04),
    ("wide tail", "", (0.0,), 0.09, 0.17),
    ("wide tail", "core", (0.1,), 0.0, 0.09),
    ("ring", "", (0.0,), 0.015, 0.18),
)


def _hypotheses() -> Iterator[Hypothesis]:
    for name, departure, strengths, estimate, uncertainty in _PRIOR:
        families: list[Family | None] = [f for f in FAMILIES if f.name == name]
        shapes: list[Shape | None] = [
            s for s in SHAPES if departure in (s.name, f"{s.name} {s.blur}")
        ]
        triples = list(product(families or [None], shapes or [None], strengths))
        for triple in triples:
            yield Hypothesis(*triple, estimate / len(triples), uncertainty / len(triples))


HYPOTHESES = tuple(_hypotheses())


@dataclass(frozen=True, eq=False)
class WeighedFit:
    """Posterior of corrections to the Gaussian fit, averaged over the hypotheses."""

    mean: FloatArray  # (p,): corrections to the fit's parameters, then the shapes' amplitudes
    covariance: FloatArray  # (p, p): expected squared error, the spread over hypotheses included
    gain: VoltageMap  # (p, n): derivative of the mean by the voltages
    noise: float  # noise of a point of weight one: in V, or a factor on the stated uncertainties
    probability: FloatArray  # (h,): posterior probability of each of HYPOTHESES
    residual: FloatArray  # (n,): voltages that are not explained, in V
    change_of_a: FloatArray  # (h,): by each hypothesis, in V/Pa; NaN where it is unlikely
    # Of all hypotheses, up to a constant of the scan, by the priors of estimate and uncertainty.
    log_marginal_likelihood: float = 0.0
    log_marginal_of_uncertainty: float = 0.0

    @property
    def gaussian_probability(self) -> float:
        """Posterior probability that there is no departure, from a prior of 0.45."""
        return float(self.probability[0])

    def of_kind(self, name: str) -> tuple[float, float]:
        """Posterior probability of a kind of hypotheses, and what they change in A, in V/Pa."""
        shares = [p * (h.kind == name) for p, h in zip(self.probability, HYPOTHESES, strict=True)]
        total, change = float(np.sum(shares)), np.nan_to_num(self.change_of_a)
        others = float((self.probability - shares) @ change) / max(1 - total, 1e-300)
        return total, float(shares @ change) / total - others if total > 0 else 0.0


def weigh_departures(
    reduced: ReducedScan,
    basis: DepartureBasis,
    effective_count: float,
    expected_noise: float = 0.0,
    least_noise: float = 0.0,
) -> WeighedFit:
    """Average departures from a Gaussian fit over the hypotheses."""
    # ``effective_count``: readings in the data, of which a point may be a mean, by their weight.
    # Of a point of weight one, ``expected_noise`` is that of voltages that have none (of a plan),
    # ``least_noise`` the least that there is, as stated.
    model, fit, flat = reduced.model, reduced.fit, basis.flat
    columns, data = basis.columns(reduced), reduced.data
    size = basis.angular.count if basis.angular else 0
    if size:
        # A prior of unit variance is a further reading of each amplitude: zero, with the noise.
        prior = least_noise * np.eye(size, columns.shape[1], flat - size)
        columns, data = np.vstack([columns, prior]), np.append(data, np.zeros(size))
    noise = effective_count + size - flat, expected_noise**2, least_noise**2
    conditionals = list(_conditionals(basis, columns, data, noise))
    averaged, gain = _average(conditionals, expected_noise**2, basis.integrals)
    residual = model.points.u - fit.predicted - basis.voltages(model, fit, averaged.mean)
    gain = gain[:, : reduced.data.size]
    return replace(averaged, gain=reduced.by_voltages(gain), residual=residual)


def _conditionals(
    basis: DepartureBasis, columns: FloatArray, data: FloatArray, noise: tuple[float, float, float]
) -> Iterator[_Conditional | None]:
    """Condition on each hypothesis; nothing of a family that does not fit the scan."""
    unit, flat, blocks = np.eye(columns.shape[1]), basis.flat, basis.blocks
    of_shape = dict(zip(SHAPES, blocks, strict=False))
    of_family = dict(zip([f.family for f in basis.families], blocks[len(SHAPES) :], strict=True))
    # The first two parameters are ln A and ln(width).
    places = unit[:, :flat] * np.r_[basis.conversion_constant, basis.sigma, np.ones(flat - 2)]
    linear: dict[Family | None, _LinearModel] = {}
    linear[None] = _LinearModel.of(0 * unit[0], places, columns @ places, data, *noise)
    for fitted, block in of_family.items():
        sensor = unit[block.start]
        of_a = sensor + basis.conversion_constant * unit[0]
        places = np.column_stack([of_a, unit[block.start + 1], unit[:, 2:flat]])
        rest = data - columns[:, block.start]
        linear[fitted] = _LinearModel.of(sensor, places, columns @ places, rest, *noise)
    designs: dict[tuple[Family | None, Shape | None], _Design] = {}
    for hypothesis in HYPOTHESES:
        family, shape, strength = hypothesis.family, hypothesis.shape, hypothesis.strength
        if family not in linear:
            yield None
        elif family is None and shape is None:
            yield linear[family].condition()
        else:
            if (family, shape) not in designs:
                parts = [] if shape is None else [unit[:, of_shape[shape]]]
                if family is not None:
                    # The share of a family departs by its own spread, whatever the strength.
                    last = of_family[family].stop - 1
                    parts = [strength * part for part in parts] + [unit[:, last : last + 1]]
                places = np.hstack(parts)
                designs[family, shape] = linear[family].decompose(columns @ places, places)
            yield linear[family].condition(
                designs[family, shape], strength if family is None else 1.0
            )


def _average(
    conditionals: list[_Conditional | None], added: float, integrals: FloatArray
) -> tuple[WeighedFit, FloatArray]:
    """Average mean and gain by one set of probabilities, squared errors by the other."""
    log_marginal = np.array([-np.inf if c is None else c.log_marginal for c in conditionals])
    priors = np.array([[h.estimate, h.uncertainty] for h in HYPOTHESES]).T
    estimate, uncertainty = (_posterior(log_marginal, prior) for prior in priors)
    change_of_a = np.full(estimate.size, np.nan)
    posteriors = []
    for i, conditional in enumerate(conditionals):
        if conditional is not None and (estimate[i] > 0 or uncertainty[i] > 0):
            posteriors.append((estimate[i], uncertainty[i], conditional, *conditional.posterior()))
            change_of_a[i] = integrals @ posteriors[-1][3]
    mean = np.sum([p * m for p, _, _, m, _, _ in posteriors], axis=0)
    gain = np.sum([p * g for p, _, _, _, g, _ in posteriors], axis=0)
    # The probabilities depend on the data, too: d(p m) = (m - mean) p d(log marginal likelihood).
    moving = np.sum([p * np.outer(m - mean, c.slope) for p, _, c, m, _, _ in posteriors], axis=0)
    covariance = np.zeros((mean.size, mean.size))
    for _, q, _, m, g, within in posteriors:
        covariance += q * (within + np.outer(m - mean, m - mean))
        if added and q:
            covariance += q * added * ((g - gain) @ (g - gain).T)
    scatter = np.array([0.0 if c is None else c.scatter for c in conditionals])
    sums = (np.logaddexp.reduce(log_marginal[p > 0] + np.log(p[p > 0])) for p in priors)
    noise, unknown = float(np.sqrt(estimate @ scatter)), VoltageMap(())
    # The gain is that of the standardised data, and the residual is left to be computed.
    logs = map(float, sums)
    averaged = WeighedFit(mean, covariance, unknown, noise, estimate, mean, change_of_a, *logs)
    return averaged, gain + moving


def supported(basis: DepartureBasis, weighed: WeighedFit) -> tuple[DepartureBasis, WeighedFit]:
    """Leave out the shapes and families of negligible probability."""
    blocks = basis.blocks
    used = [bool(np.diag(weighed.covariance)[block].any()) for block in blocks]
    columns = [np.arange(basis.flat)]
    columns += [np.arange(b.start, b.stop) for b, use in zip(blocks, used, strict=True) if use]
    chosen, families = np.concatenate(columns), compress(basis.families, used[len(basis.rings) :])
    kept = replace(basis, rings=tuple(compress(basis.rings, used)), families=tuple(families))
    return kept, replace(
        weighed,
        mean=weighed.mean[chosen],
        covariance=weighed.covariance[np.ix_(chosen, chosen)],
        gain=weighed.gain[chosen],
    )


def _posterior(log_marginal: FloatArray, prior: FloatArray) -> FloatArray:
    """Posterior probabilities by Bayes' theorem, negligible ones set to zero."""
    weight = prior * np.exp(log_marginal - log_marginal[prior > 0].max())
    weight[weight < _NEGLIGIBLE * weight.sum()] = 0.0
    return np.asarray(weight / weight.sum())
