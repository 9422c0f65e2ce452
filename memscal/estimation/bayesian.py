r"""Bayesian model averaging of radial departures from a Gaussian apparatus function.

For a sensor, shape and strength (a hypothesis) the model is linear, with Gaussian priors for the
amplitudes and flat ones for ln A, ln(width) and the nuisance parameters: marginal likelihood and
posterior are in closed form.  With the flat columns projected out (restricted likelihood: Patterson
and Thompson, Biometrika 58, 1971), singular values :math:`s_j` of what is left of the shape's
columns, data :math:`p_j` along its singular vectors and their rest :math:`\rho`,

.. math::

    -2\log p(u \mid \tau) = \nu\log\hat\sigma^2 + \sum_j\log(1+\tau^2 s_j^2/\hat\sigma^2), \qquad
    \nu\hat\sigma^2 = \rho + \sum_j \frac{p_j^2}{1+\tau^2 s_j^2/\hat\sigma^2} .

and less ln of the determinant of the flat columns X, :math:`\log|X^TX|^{1/2}`.  Where noise is
stated, :math:`\hat\sigma` is at least that.  Of a scan that is only planned, expected squares take
the place of the data's.  The estimate is the posterior mean with a prior probability of 0.45 for
the Gaussian itself; its uncertainty is the mean squared error with priors that allow no Gaussian.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress, product
from typing import ClassVar

import numpy as np

from memscal.estimation import departures
from memscal.estimation.departures import DepartureBasis, Family, ReducedScan, Shape
from memscal.estimation.voltage_map import VoltageMap
from memscal.model.arrays import FloatArray

#: The smallest noise, over the largest residual of a Gaussian, that is distinct from rounding.
_ROUNDING = 1e-9
#: Hypotheses of a smaller share of the posterior probability are left out.
_NEGLIGIBLE = 1e-4


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


@dataclass(frozen=True, eq=False)
class _LinearModel:
    """Weighted data and columns of flat prior about one sensor, the Gaussian or a family's."""

    start: FloatArray  # (p,): the sensor among all parameters
    root: FloatArray  # (p, flat): of the flat parameters' covariance, for noise of unit variance
    q: FloatArray  # (n, flat)
    log_determinant: float  # of the columns
    data: FloatArray  # (n,)
    rest: FloatArray  # (n,): what the flat columns leave over
    freedom: float
    added: float  # variance of noise that is expected, but not in the data
    stated: float  # variance of the noise

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
        # ``places`` (p, flat): where the flat parameters stand among all parameters.
        scale = np.linalg.norm(flat, axis=0)
        q, r = np.linalg.qr(flat / scale)
        size = float(np.log(np.abs(np.diag(r)) * scale).sum())
        rest = data - q @ (q.T @ data)
        return cls(start, (places / scale) @ np.linalg.inv(r), q, size, data, rest, *noise)

    @cached_property
    def mean(self) -> FloatArray:
        """Posterior mean of all parameters without departures, (p,)."""
        return np.asarray(self.start + self.root @ (self.q.T @ self.data))

    @cached_property
    def numbers(self) -> tuple[float, ...]:
        """Square of what is left over, expected noise included; the noise's least variances."""
        power = float(self.rest @ self.rest) + self.added * self.freedom
        distinct = max((_ROUNDING * float(np.abs(self.data).max())) ** 2, 1e-300)
        return power, distinct, self.stated, self.freedom, self.log_determinant


@dataclass(frozen=True, eq=False)
class _Design:
    """Weighted columns of departures, by the SVD of what is left of them beside the flat ones."""

    linear: _LinearModel
    places: FloatArray  # (p, m): where their amplitudes stand among all parameters
    columns: FloatArray  # (n, m)
    left: FloatArray
    singular: FloatArray
    right: FloatArray
    along: FloatArray  # the data along the left singular vectors
    power: FloatArray  # their squares, those of the expected noise included

    @classmethod
    def of(cls, linear: _LinearModel, columns: FloatArray, places: FloatArray) -> _Design:
        """Decompose weighted columns (n, m)."""
        free = columns - linear.q @ (linear.q.T @ columns)
        left, singular, right = np.linalg.svd(free, full_matrices=False)
        along = left.T @ linear.rest
        # Of a vector that meets the flat columns, only what lies beside them carries noise.
        power = along**2
        if linear.added:
            power += linear.added * (1 - np.sum((linear.q.T @ left) ** 2, axis=0))
        return cls(linear, places, columns, left, singular, right, along, power)

    @cached_property
    def changes(self) -> FloatArray:
        """Changes of all parameters by the amplitudes, the flat ones fitted anew, (p, m)."""
        return np.asarray(self.places - self.linear.root @ (self.linear.q.T @ self.columns))

    @cached_property
    def turned(self) -> FloatArray:
        """The same by amplitudes along the singular vectors."""
        return np.asarray(self.changes @ self.right.T)


@dataclass(frozen=True, eq=False)
class _Conditional:
    """Marginal likelihood and posterior given one hypothesis, at the MAP estimate of the noise."""

    design: _Design
    prior: float  # variance of the amplitudes
    log_marginal: float
    scatter: float  # variance of the residuals
    variance: float  # of the noise: at least as stated

    @cached_property
    def filter(self) -> FloatArray:
        """From data to amplitudes, along the singular vectors, (m,)."""
        singular = self.design.singular
        return self.prior * singular / (self.variance + self.prior * singular**2)

    @property
    def slope(self) -> FloatArray:
        """Derivative of the logarithm by the weighted data, (n,)."""
        explained = self.filter * self.design.singular * self.design.along
        return (self.design.left @ explained - self.design.linear.rest) / self.variance

    @property
    def mean(self) -> FloatArray:
        """Posterior mean of all parameters, (p,)."""
        design, linear = self.design, self.design.linear
        amplitudes = self.filter * (design.left.T @ linear.data)
        return np.asarray(linear.mean + design.turned @ amplitudes)

    @property
    def gain(self) -> tuple[FloatArray, FloatArray]:
        """Derivative of the mean by the weighted data (p, n): two factors, (p, f) and (n, f)."""
        linear, turned = self.design.linear, self.design.turned * self.filter
        return np.hstack([linear.root, turned]), np.hstack([linear.q, self.design.left])

    @property
    def covariance_root(self) -> FloatArray:
        """Square root of the covariance, (p, c)."""
        design = self.design
        # Posterior variances along the singular vectors; in all other directions the prior's.
        left = self.prior * self.variance / (self.variance + self.prior * design.singular**2)
        parts = [self.variance**0.5 * design.linear.root, left**0.5 * design.turned]
        if len(design.right) < design.right.shape[1]:
            parts.append(self.prior**0.5 * (design.changes - design.turned @ design.right))
        return np.hstack(parts)


def _conditioned(designs: Sequence[tuple[_Design, float]]) -> Iterator[_Conditional]:
    """Condition on designs of a strength, the noise at its MAP estimate."""
    signal, power = np.zeros((2, len(designs), max(d.singular.size for d, _ in designs)))
    for i, (design, strength) in enumerate(designs):
        size = design.singular.size
        signal[i, :size], power[i, :size] = (strength * design.singular) ** 2, design.power
    numbers = np.array([design.linear.numbers for design, _ in designs]).T
    total, distinct, stated, freedom, log_determinant = numbers
    beyond = np.maximum(total - power.sum(axis=1), 0.0)
    scatter = np.maximum(total / freedom, distinct)
    for _ in range(8):
        explained = power * scatter[:, None] / (scatter[:, None] + signal)
        scatter = np.maximum((beyond + explained.sum(axis=1)) / freedom, distinct)
    variance = np.maximum(scatter, stated)
    ratio = signal / variance[:, None]
    square = (beyond + (power / (1 + ratio)).sum(axis=1)) / variance
    loss = freedom * np.log(variance) + square + np.log(1 + ratio).sum(axis=1)
    log_marginal = -0.5 * loss - log_determinant
    for (design, strength), *of_noise in zip(designs, log_marginal, scatter, variance, strict=True):
        yield _Conditional(design, strength**2, *map(float, of_noise))


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
        families: list[Family | None] = [f for f in departures.FAMILIES if f.name == name]
        shapes: list[Shape | None] = [
            s for s in departures.SHAPES if departure in (s.name, f"{s.name} {s.blur}")
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
    hypotheses, designs = zip(*_designs(basis, columns, data, noise), strict=True)
    conditionals = list(_conditioned(designs))
    averaged, gain = _average(list(hypotheses), conditionals, expected_noise**2, basis.integrals)
    residual = model.points.u - fit.predicted - basis.voltages(model, fit, averaged.mean)
    gain = gain[:, : reduced.data.size]
    return replace(averaged, gain=reduced.by_voltages(gain), residual=residual)


def _designs(
    basis: DepartureBasis, columns: FloatArray, data: FloatArray, noise: tuple[float, float, float]
) -> Iterator[tuple[int, tuple[_Design, float]]]:
    """Number, design and strength of each hypothesis; none of a family that does not fit."""
    unit, flat, blocks = np.eye(columns.shape[1]), basis.flat, basis.blocks
    of_shape = dict(zip(departures.SHAPES, blocks[: len(basis.rings)], strict=True))
    of_family = dict(zip([f.family for f in basis.families], blocks[len(of_shape) :], strict=True))
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
    for i, hypothesis in enumerate(HYPOTHESES):
        family, shape, strength = hypothesis.family, hypothesis.shape, hypothesis.strength
        if family not in linear:
            continue
        if (family, shape) not in designs:
            block = slice(0, 0) if shape is None else of_shape[shape]
            parts = [matrix[:, block] for matrix in (columns, unit)]
            if family is not None:
                # The share of a family departs by its own spread, whatever the strength.
                last = slice(of_family[family].stop - 1, of_family[family].stop)
                pairs = zip(parts, (columns, unit), strict=True)
                parts = [np.hstack([strength * part, matrix[:, last]]) for part, matrix in pairs]
            designs[family, shape] = _Design.of(linear[family], *parts)
        yield i, (designs[family, shape], strength if family is None else 1.0)


def _average(
    hypotheses: list[int], conditionals: list[_Conditional], added: float, integrals: FloatArray
) -> tuple[WeighedFit, FloatArray]:
    """Average mean and gain by one set of probabilities, squared errors by the other."""
    log_marginal, scatter = np.full(len(HYPOTHESES), -np.inf), np.zeros(len(HYPOTHESES))
    log_marginal[hypotheses] = [c.log_marginal for c in conditionals]
    scatter[hypotheses] = [c.scatter for c in conditionals]
    priors = np.array([[h.estimate, h.uncertainty] for h in HYPOTHESES]).T
    estimate, uncertainty = (_posterior(log_marginal, prior) for prior in priors)
    used = [
        (i, c)
        for i, c in zip(hypotheses, conditionals, strict=True)
        if estimate[i] > 0 or uncertainty[i] > 0
    ]
    places = [i for i, _ in used]
    p, q, means = estimate[places], uncertainty[places], np.stack([c.mean for _, c in used])
    change_of_a = np.full(estimate.size, np.nan)
    change_of_a[places] = means @ integrals
    mean = p @ means
    apart = means - mean
    of_mean = [(share, c) for share, (_, c) in zip(p, used, strict=True) if share > 0]
    factors = [(share * left, right) for share, c in of_mean for left, right in [c.gain]]
    left, right = map(np.hstack, zip(*factors, strict=True))
    gain = left @ right.T
    roots = [(share, c) for share, (_, c) in zip(q, used, strict=True) if share > 0]
    parts = [(q**0.5)[:, None] * apart]
    parts += [(share**0.5 * c.covariance_root).T for share, c in roots]
    if added:
        for share, c in roots:
            left, right = c.gain
            parts.append(((share * added) ** 0.5 * (left @ right.T - gain)).T)
    root = np.vstack(parts)
    # The probabilities depend on the data, too: d(p m) = (m - mean) p d(log marginal likelihood).
    slopes = np.stack([c.slope for _, c in of_mean])
    moving = (p[p > 0, None] * apart[p > 0]).T @ slopes
    sums = (np.logaddexp.reduce(log_marginal[p > 0] + np.log(p[p > 0])) for p in priors)
    noise, unknown = float(np.sqrt(estimate @ scatter)), VoltageMap(())
    # The gain is that of the standardised data, and the residual is left to be computed.
    averaged = WeighedFit(
        mean, root.T @ root, unknown, noise, estimate, mean, change_of_a, *map(float, sums)
    )
    return averaged, gain + moving


def supported(basis: DepartureBasis, weighed: WeighedFit) -> tuple[DepartureBasis, WeighedFit]:
    """Leave out the shapes and families of negligible probability."""
    blocks = basis.blocks
    used = [bool(np.diag(weighed.covariance)[block].any()) for block in blocks]
    columns = [np.arange(basis.flat)]
    columns += [np.arange(b.start, b.stop) for b, use in zip(blocks, used, strict=True) if use]
    chosen, families = np.concatenate(columns), compress(basis.families, used[len(basis.rings) :])
    kept = replace(basis, rings=tuple(compress(basis.rings, used)), families=tuple(families))
    kept._tables.update({key: table[:, chosen] for key, table in basis._tables.items()})
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
