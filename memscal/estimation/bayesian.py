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

from collections.abc import Iterator
from dataclasses import fields, replace
from functools import cached_property, lru_cache
from itertools import compress, product
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.special import logsumexp

from memscal.estimation.departures import (
    FAMILIES,
    SHAPES,
    DepartureBasis,
    Family,
    ReducedScan,
    Shape,
)
from memscal.estimation.voltage_map import VoltageMap
from memscal.model.arrays import (
    ArrayTriple,
    FloatArray,
    IndexArray,
    array_record,
    keyword_value_record,
    value_record,
)

#: The smallest noise, over the largest residual of a Gaussian, that is distinct from rounding.
_ROUNDING = 1e-9
#: Hypotheses of a smaller share of the posterior probability are left out.
_NEGLIGIBLE = 1e-4


@keyword_value_record
class Bayesian:
    """Bayesian model averaging in data space: the posterior mean of A G, or its MAP estimate."""

    nonnegative: bool = False  # G is nowhere negative
    monotone: bool = False  # G nowhere rises with the radius (a ring's does)
    name: ClassVar[str] = "bayesian"
    assumes: ClassVar[str] = "G is a Gaussian, a blurred disc, has wide tails, or departs smoothly."
    fails: ClassVar[str] = (
        "Detail finer than a third of G's width that the film hides is not found, only allowed for."
    )


@array_record
class _Sensors:
    """Weighted data and columns of flat prior about f sensors: each fit's Gaussian and families."""

    start: FloatArray  # (f, p): the sensor among all parameters
    root: FloatArray  # (f, p, flat): of the flat ones' covariance, for noise of unit variance
    q: FloatArray  # (f, n, flat)
    log_determinant: FloatArray  # (f,): of the columns
    data: FloatArray  # (f, n)
    rest: FloatArray  # (f, n): what the flat columns leave over

    @classmethod
    def of(cls, basis: DepartureBasis, columns: FloatArray, data: FloatArray) -> _Sensors:
        """Project the weighted flat columns out of the weighted data, less a family's sensor."""
        families = basis.blocks[len(basis.rings) :]
        flat = basis.flat
        start = np.zeros((1 + len(families), columns.shape[1]))
        # The flat columns among all: the first two are ln A and ln(width), of each family its own.
        choice = np.zeros((*start.shape, flat))
        choice[:, :flat] = np.eye(flat)
        choice[:, 0, 0] = basis.conversion_constant
        choice[:, 1, 1] = basis.sigma
        for i, block in enumerate(families, start=1):
            start[i, block.start] = 1.0
            choice[i, 1, 1] = 0.0
            choice[i, block.start, 0] = 1.0
            choice[i, block.start + 1, 1] = 1.0
        values = columns @ choice
        data = data - start @ columns.T
        scale = np.linalg.norm(values, axis=1, keepdims=True)
        q, r = np.linalg.qr(values / scale)
        diagonal = abs(np.diagonal(r, axis1=1, axis2=2))
        log_determinant = np.log(diagonal * scale[:, 0]).sum(axis=1)
        rest = data - _times(q, _times(q.mT, data))
        return cls(start, (choice / scale) @ np.linalg.inv(r), q, log_determinant, data, rest)


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Product of each matrix with a vector of its own, (h, m)."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _abreast(parts: list[FloatArray]) -> FloatArray:
    """Columns of all matrices of the parts, (h, n, m) each, next to each other: (n, sum of h m)."""
    return np.hstack([np.moveaxis(part, 0, 1).reshape(part.shape[1], -1) for part in parts])


class _Noise(NamedTuple):
    """Degrees of freedom, and variances of a point of weight one."""

    freedom: float
    added: float  # of noise that is expected, but not in the data
    stated: float


@array_record
class _Conditionals:
    """Marginal likelihoods and posteriors, each given one of h hypotheses of m amplitudes.

    What the flat ones leave of the weighted columns of its departures is decomposed, by the SVD.
    """

    sensors: _Sensors
    number: IndexArray  # (h,): places among HYPOTHESES
    family: IndexArray  # (h,): of the sensor
    prior: FloatArray  # (h,): variance of the amplitudes
    by_amplitude: FloatArray  # (h, p, m): changes of all parameters, the flat ones fitted anew
    left: FloatArray  # (h, n, s)
    singular: FloatArray  # (h, s)
    right: FloatArray  # (h, s, m)
    data: FloatArray  # (h, s): along the left singular vectors
    filter: FloatArray  # (h, s): from data to amplitudes, along the singular vectors
    # At the MAP estimate of the noise.
    log_marginal: FloatArray  # (h,)
    scatter: FloatArray  # (h,): variance of the residuals
    variance: FloatArray  # (h,): of the noise: at least as stated

    @classmethod
    def of(
        cls, sensors: _Sensors, columns: FloatArray, choice: _Choice, noise: _Noise
    ) -> _Conditionals:
        """Decompose what each hypothesis chooses of the columns, (n, p)."""
        q = sensors.q[choice.family]
        chosen = columns.T[choice.places].mT * choice.factors[:, None, :]
        explained = q.mT @ chosen
        by_amplitude = -(sensors.root[choice.family] @ explained)
        hypothesis = np.arange(len(choice.places))[:, None]
        amplitude = np.arange(choice.places.shape[1])
        by_amplitude[hypothesis, choice.places, amplitude] += choice.factors
        left, singular, right = np.linalg.svd(chosen - q @ explained, full_matrices=False)
        data = _times(left.mT, sensors.rest[choice.family])
        power = data**2
        if noise.added:
            # Of a vector that meets the flat columns, only the rest of it carries noise.
            power += noise.added * (1 - np.sum((q.mT @ left) ** 2, axis=1))
        prior = choice.strength**2
        signal = prior[:, None] * singular**2
        likelihoods = _likelihoods(sensors, choice.family, signal, power, noise)
        filters = prior[:, None] * singular / (likelihoods[-1][:, None] + signal)
        decomposed = (by_amplitude, left, singular, right, data, filters)
        return cls(sensors, choice.number, choice.family, prior, *decomposed, *likelihoods)

    @cached_property
    def by_component(self) -> FloatArray:
        """Changes of all parameters by amplitudes along the singular vectors, (h, p, s)."""
        return self.by_amplitude @ self.right.mT

    @property
    def slopes(self) -> FloatArray:
        """Derivatives of the logarithms by the weighted data, (h, n)."""
        explained = _times(self.left, self.filter * self.singular * self.data)
        return (explained - self.sensors.rest[self.family]) / self.variance[:, None]

    @property
    def means(self) -> FloatArray:
        """Posterior means of all parameters, (h, p)."""
        sensors = self.sensors
        flat = _times(sensors.q.mT, sensors.data)
        plain = (sensors.start + _times(sensors.root, flat))[self.family]
        data = _times(self.left.mT, sensors.data[self.family])
        return plain + _times(self.by_component, self.filter * data)

    def gain(self, shares: FloatArray) -> FloatArray:
        """Derivatives of the means by the weighted data, summed by shares (h,): (p, n)."""
        sensor_shares = np.bincount(self.family, shares, len(self.sensors.q))
        some = shares > 0
        components = self.by_component[some] * (shares[:, None] * self.filter)[some, None, :]
        weighted = sensor_shares[:, None, None] * self.sensors.q
        by_parameters = _abreast([components, self.sensors.root])
        return by_parameters @ _abreast([self.left[some], weighted]).T

    def covariance_root(self, shares: FloatArray) -> FloatArray:
        """Square root (p, c) of the sum of covariances by shares (h,)."""
        sensor_shares = np.bincount(self.family, shares * self.variance, len(self.sensors.q))
        # Posterior variances along the singular vectors; in all other directions the prior's.
        prior = self.prior[:, None]
        variance = self.variance[:, None]
        along = shares[:, None] * prior * variance / (variance + prior * self.singular**2)
        parts = [
            self.sensors.root * (sensor_shares**0.5)[:, None, None],
            self.by_component * (along**0.5)[:, None, :],
        ]
        if self.right.shape[1] < self.right.shape[2]:
            hidden = self.by_amplitude - self.by_component @ self.right
            parts.append(hidden * ((shares * self.prior) ** 0.5)[:, None, None])
        return _abreast(parts)


def _likelihoods(
    sensors: _Sensors,
    family: IndexArray,
    signal: FloatArray,
    power: FloatArray,
    noise: _Noise,
) -> ArrayTriple:
    """Log marginal likelihoods, variances of the residuals, and of the noise, (h,) each."""
    total = np.sum(sensors.rest**2, axis=1) + noise.added * noise.freedom
    least = (_ROUNDING * abs(sensors.data).max(axis=1)) ** 2
    total = total[family]
    least = np.maximum(least, 1e-300)[family]
    beyond = np.maximum(total - power.sum(axis=1), 0.0)
    scatter = np.maximum(total / noise.freedom, least)
    for _ in range(8):
        explained = power * scatter[:, None] / (scatter[:, None] + signal)
        scatter = np.maximum((beyond + explained.sum(axis=1)) / noise.freedom, least)
    variance = np.maximum(scatter, noise.stated)
    growth = 1 + signal / variance[:, None]
    chi_square = (beyond + (power / growth).sum(axis=1)) / variance
    loss = noise.freedom * np.log(variance) + chi_square + np.log(growth).sum(axis=1)
    return -0.5 * loss - sensors.log_determinant[family], scatter, variance


@value_record
class Hypothesis:
    """The Gaussian or a family, with departures of a shape and strength; prior probabilities."""

    kind: str  # name of the family, or of the shape; none of the Gaussian itself
    family: Family | None
    shape: Shape | None
    strength: float
    estimate: float
    uncertainty: float


#: Family (none: the Gaussian), departure from it and its strengths; prior probabilities, shared
#: evenly within a row, for the estimate and for its uncertainty.
_PRIOR = (
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
        families = [f for f in FAMILIES if f.name == name]
        shapes = [s for s in SHAPES if departure in (s.name, f"{s.name} {s.blur}")]
        triples = [*product(families or (None,), shapes or (None,), strengths)]
        for family, shape, strength in triples:
            count = len(triples)
            named = family or shape
            kind = named.name if named else ""
            yield Hypothesis(kind, family, shape, strength, estimate / count, uncertainty / count)


HYPOTHESES = tuple(_hypotheses())
#: Their prior probabilities, for the estimate and for its uncertainty.
_PRIORS = np.array([[h.estimate, h.uncertainty] for h in HYPOTHESES]).T


@array_record
class WeighedFit:
    """Posterior of corrections to the Gaussian fit, averaged over the hypotheses."""

    mean: FloatArray  # (p,): corrections to the fit's parameters, then the shapes' amplitudes
    covariance: FloatArray  # (p, p): expected squared error, the spread over hypotheses included
    gain: VoltageMap  # (p, n): derivative of the mean by the voltages
    noise: float  # noise of a point of weight one: in V, or a factor on the stated uncertainties
    probability: FloatArray  # (h,): posterior probability of each of HYPOTHESES
    residual: FloatArray  # (n,): voltages that are not explained, in V
    log_marginals: FloatArray  # (h,): logarithm of the voltages' probability by each of HYPOTHESES
    free: float = -np.inf  # the same by a G that is free in the plane, where that is chosen


def weigh_departures(
    reduced: ReducedScan,
    basis: DepartureBasis,
    effective_count: float,
    least_noise: float = 0.0,
    expected_noise: float = 0.0,
) -> Weighing:
    """Weigh the hypotheses about departures from a fit."""
    # ``effective_count``: readings in the data, of which a point may be a mean, by their weight.
    # Of a point of weight one, ``expected_noise`` is that of voltages that have none (of a plan),
    # ``least_noise`` the least that there is, as stated.
    columns = basis.columns(reduced)
    data = reduced.data
    # A prior is a further reading: of the curvatures, and of each amplitude of unit variance zero,
    # with the noise.
    curvatures, left = reduced.fit.prior
    count = basis.angular.count if basis.angular else 0
    prior = least_noise * np.eye(count + left.size, columns.shape[1], basis.flat - count)
    prior[count:] = 0.0
    prior[count:, : curvatures.shape[1]] = curvatures
    columns = np.vstack([columns, prior])
    data = np.concatenate([data, np.zeros(count), left])
    noise = _Noise(effective_count + len(prior) - basis.flat, expected_noise**2, least_noise**2)
    sizes = tuple(ring.radius.size for ring in basis.rings)
    choice = _choice(basis.flat, sizes, tuple(fitted.family for fitted in basis.families))
    given = _Conditionals.of(_Sensors.of(basis, columns, data), columns, choice, noise)
    log_marginals = np.full(len(HYPOTHESES), -np.inf)
    log_marginals[given.number] = given.log_marginal
    # An amplitude's prior has the unit of the noise.
    if count:
        log_marginals += count * np.log(least_noise)
    return Weighing(reduced, basis, given, noise.added, log_marginals)


@array_record
class Weighing:
    """The hypotheses about a fit, weighed; they are averaged when that is asked for."""

    reduced: ReducedScan
    basis: DepartureBasis
    given: _Conditionals
    added: float
    log_marginals: FloatArray  # (h,): of each of HYPOTHESES

    @cached_property
    def log_marginal_likelihoods(self) -> FloatArray:
        """Of all hypotheses by either prior, up to a constant of the scan, (2,)."""
        return logsumexp(self.log_marginals, b=self.priors, axis=1)

    @property
    def evidence(self) -> float:
        """The first of them, by the prior of the estimate."""
        return float(self.log_marginal_likelihoods[0])

    @property
    def priors(self) -> FloatArray:
        """Of all hypotheses, for the estimate and for its uncertainty, (2, h)."""
        return _PRIORS if self.basis.rings else np.eye(1, len(HYPOTHESES)).repeat(2, axis=0)

    def average(self, *, allowing: int = 1) -> WeighedFit:
        """Average mean and gain by one set of probabilities, squared errors by the other."""
        # Or by the first one, too, ``allowing`` for no more departures than the estimate does.
        given = self.given
        probabilities = []
        for prior in self.priors[[0, allowing]]:
            # Bayes' theorem; negligible probabilities are set to zero.
            held = np.where(prior > 0, self.log_marginals, -np.inf)
            weight = prior * np.exp(held - held.max())
            weight[weight < _NEGLIGIBLE * weight.sum()] = 0.0
            probabilities.append(weight / weight.sum())
        estimate, uncertainty = probabilities
        likely = ((estimate > 0) | (uncertainty > 0))[given.number]
        used = replace(given, **{f.name: getattr(given, f.name)[likely] for f in fields(given)[1:]})
        p = estimate[used.number]
        q = uncertainty[used.number]
        means = used.means
        mean = p @ means
        apart = means - mean
        gain = used.gain(p)
        parts = [q**0.5 * apart.T, used.covariance_root(q)]
        if self.added:
            for share, one in zip(q, np.eye(q.size), strict=True):
                parts.append((self.added * share) ** 0.5 * (used.gain(one) - gain))
        root = np.hstack(parts)
        # The probabilities depend on the data, too: d(p m) = (m - mean) p d(log marginal).
        gain = gain + (p[:, None] * apart).T @ used.slopes
        return WeighedFit(
            mean=mean,
            covariance=root @ root.T,
            gain=self.reduced.by_voltages(gain[:, : self.reduced.data.size]),
            noise=float(np.sqrt(p @ used.scatter)),
            probability=estimate,
            residual=self.reduced.residual(self.basis, mean),
            log_marginals=self.log_marginals,
        )


class _Choice(NamedTuple):
    """The columns that hypotheses choose, times factors; of none of them the factor is zero."""

    number: IndexArray  # (h,): places among HYPOTHESES
    family: IndexArray  # (h,): of the sensor: 0 of the Gaussian
    places: IndexArray  # (h, m)
    factors: FloatArray  # (h, m)
    strength: FloatArray  # (h,): standard deviation of the amplitudes


@lru_cache(maxsize=64)
def _choice(flat: int, sizes: tuple[int, ...], families: tuple[Family, ...]) -> _Choice:
    """Return what the hypotheses choose of the flat columns, the shapes', three of each family."""
    ends = flat + np.cumsum([0, *sizes])
    # Beside a G that is free in the plane the Gaussian stands alone.
    asked = HYPOTHESES if sizes else HYPOTHESES[:1]
    known = [(i, h) for i, h in enumerate(asked) if h.family in (None, *families)]
    family = np.zeros(len(known), np.intp)
    strength = np.ones(len(known))
    # Equal numbers of columns for all: one batch of decompositions.
    places = np.zeros((len(known), max(sizes, default=1) + bool(families)), np.intp)
    factors = np.zeros(places.shape)
    for row, (_, hypothesis) in enumerate(known):
        factor = hypothesis.strength
        if not hypothesis.family:
            strength[row] = factor
            factor = 1.0
        else:
            # The share of a family departs by its own spread, whatever the strength.
            family[row] = 1 + families.index(hypothesis.family)
            places[row, -1] = ends[-1] + 3 * family[row] - 1
            factors[row, -1] = 1.0
        if hypothesis.shape:
            shape = SHAPES.index(hypothesis.shape)
            places[row, : sizes[shape]] = np.arange(ends[shape], ends[shape + 1])
            factors[row, : sizes[shape]] = factor
    return _Choice(np.array([i for i, _ in known]), family, places, factors, strength)


def supported(basis: DepartureBasis, weighed: WeighedFit) -> tuple[DepartureBasis, WeighedFit]:
    """Leave out the shapes and families of negligible probability."""
    variances = np.diag(weighed.covariance)
    used = [variances[block].any() for block in basis.blocks]
    chosen = np.r_[: basis.flat, *compress(basis.blocks, used)]
    rings = tuple(compress(basis.rings, used))
    families = tuple(compress(basis.families, used[len(basis.rings) :]))
    averaged = replace(
        weighed,
        mean=weighed.mean[chosen],
        covariance=weighed.covariance[np.ix_(chosen, chosen)],
        gain=weighed.gain[chosen],
    )
    return replace(basis, rings=rings, families=families), averaged
