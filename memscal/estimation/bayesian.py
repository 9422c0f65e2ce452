r"""How far the scan departs from the Gaussian: hypotheses weighed by their evidence.

A hypothesis is a shape of departure and its strength; its evidence and its posterior are those of
:mod:`memscal.estimation.bayesian`.

Two sets of prior weights are in use.  The estimate is the posterior mean under one that believes
in the Gaussian by 0.4, so that a Gaussian sensor costs little.  Its uncertainty is the mean
squared distance from the truth under another that believes in departures only, rougher ones
among them: what regularisation hides is counted as what such fields have there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from memscal.estimation.departures import SHAPES, DepartureBasis, Shape
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.model.arrays import FloatArray

__all__ = ["HYPOTHESES", "Outcome", "Part", "Projected", "WeighedFit", "weigh_departures"]

_VARIANCE_ROUNDS = 8
#: The smallest noise, over the largest residual of a Gaussian, that is told from rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Part:
    """One shape's design with the flat columns projected out, by its singular values.

    ``along``: the data along the left singular vectors; ``power``: their squares, those of the
    expected noise included.
    """

    block: slice
    columns: FloatArray
    left: FloatArray
    singular: FloatArray
    right: FloatArray
    along: FloatArray
    power: FloatArray


@dataclass(frozen=True, eq=False)
class Outcome:
    """One hypothesis: log evidence, noise variance, and what gives its posterior.

    ``shrink``: factors from data to amplitudes along the singular vectors; ``slope``: derivative
    of the log evidence by the weighted data.
    """

    log_evidence: float
    variance: float
    strength: float
    part: Part | None
    shrink: FloatArray
    slope: FloatArray

    def amplitude_covariance(self, least_variance: float) -> FloatArray:
        """Posterior covariance of the amplitudes, at a noise that is believed at least."""
        if self.part is None:
            return np.zeros((0, 0))
        prior, right = self.strength**2, self.part.right
        variance = max(self.variance, least_variance)
        left_over = prior * variance / (variance + prior * self.part.singular**2)
        seen = (right.T * left_over) @ right
        if right.shape[0] == right.shape[1]:
            return np.asarray(seen)
        # Fewer points than components leave the prior as it was along what they do not see.
        return np.asarray(seen + prior * (np.eye(right.shape[1]) - right.T @ right))


@dataclass(frozen=True, eq=False)
class Projected:
    """Weighted data and flat columns: what every hypothesis shares.

    ``added``: variance of noise that is expected, but not in the data.
    """

    scale: FloatArray
    q: FloatArray
    inverse: FloatArray
    data: FloatArray
    rest: FloatArray
    freedom: float
    added: float

    @classmethod
    def from_columns(
        cls, flat: FloatArray, data: FloatArray, freedom: float, added: float
    ) -> Projected:
        """Project the flat columns out of the data; all of them weighted."""
        scale = np.linalg.norm(flat, axis=0)
        q, r = np.linalg.qr(flat / scale)
        return cls(scale, q, np.linalg.inv(r), data, data - q @ (q.T @ data), freedom, added)

    @property
    def power(self) -> float:
        """Square of all that the flat columns leave over, the expected noise included."""
        return float(self.rest @ self.rest) + self.added * self.freedom

    def part(self, columns: FloatArray, block: slice) -> Part:
        """Decompose a shape's columns, weighted; ``block`` is where they stand among all."""
        free = columns - self.q @ (self.q.T @ columns)
        left, singular, right = np.linalg.svd(free, full_matrices=False)
        along = left.T @ self.rest
        # Of a vector that meets the flat columns, only the part beside them carries noise.
        free_share = 1 - np.sum((self.q.T @ left) ** 2, axis=0)
        return Part(
            block, columns, left, singular, right, along, along**2 + self.added * free_share
        )

    def gaussian(self) -> Outcome:
        """Return the outcome without any departure."""
        variance = self._floor(self.power / self.freedom)
        nothing = np.zeros(0)
        log_evidence = -0.5 * self.freedom * float(np.log(variance))
        return Outcome(log_evidence, variance, 0.0, None, nothing, -self.rest / variance)

    def weigh(self, part: Part, strength: float) -> Outcome:
        """Return the outcome for one shape at one strength, the noise at its most probable."""
        beyond = max(self.power - float(part.power.sum()), 0.0)
        signal = (strength * part.singular) ** 2
        variance = self._floor(self.power / self.freedom)
        for _ in range(_VARIANCE_ROUNDS):
            explained = part.power * variance / (variance + signal)
            variance = self._floor((beyond + float(explained.sum())) / self.freedom)
        inflation = 1 + signal / variance
        log_evidence = -0.5 * (self.freedom * np.log(variance) + float(np.log(inflation).sum()))
        return Outcome(
            log_evidence,
            variance,
            strength,
            part,
            strength**2 * part.singular / (variance + signal),
            (part.left @ (signal / (variance + signal) * part.along) - self.rest) / variance,
        )

    def _floor(self, variance: float) -> float:
        return max(variance, (_ROUNDING * float(np.abs(self.data).max())) ** 2, 1e-300)


_NEGLIGIBLE = 1e-4


@dataclass(frozen=True)
class Hypothesis:
    """A shape at a strength, with its weights in the estimate and in the uncertainty.

    ``shape`` and ``strength`` are ``None`` and zero for the Gaussian itself.
    """

    shape: Shape | None
    strength: float
    estimate: float
    uncertainty: float


def _hypotheses() -> tuple[Hypothesis, ...]:
    """The prior: weights by kind of departure, shared evenly within one."""
    kinds: list[tuple[str, tuple[float, ...], float, float]] = [
        ("edge", (0.4, 0.8), 0.20, 0.0),
        ("rough edge 0.4", (0.4,), 0.07, 0.30),
        ("rough edge 0.5", (0.8, 1.6), 0.0, 0.10),
        ("core", (0.4,), 0.06, 0.0),
        ("core", (0.3,), 0.0, 0.30),
        ("tail", (0.2,), 0.27, 0.30),
    ]
    found = [Hypothesis(None, 0.0, 0.40, 0.0)]
    for kind, strengths, estimate, uncertainty in kinds:
        shapes = [s for s in SHAPES if kind in (s.name, f"{s.name} {s.blur}")]
        share = len(shapes) * len(strengths)
        found += [
            Hypothesis(shape, strength, estimate / share, uncertainty / share)
            for shape in shapes
            for strength in strengths
        ]
    return tuple(found)


HYPOTHESES = _hypotheses()


@dataclass(frozen=True, eq=False)
class WeighedFit:
    """Posterior of corrections to the Gaussian fit, averaged over the hypotheses.

    Parameters
    ----------
    mean : ndarray, shape (p,)
        Corrections to the Gaussian fit's parameters, then amplitudes of the shapes' components.
    covariance : ndarray, shape (p, p)
        Their expected squared error, the spread over hypotheses included.
    gain : ndarray, shape (p, n)
        Derivative of ``mean`` by the voltages.
    noise : float
        Noise of a point of weight one: in V, or a factor on the stated uncertainties.
    probability : ndarray, shape (h,)
        Posterior probability of each of :data:`HYPOTHESES`.
    residual : ndarray, shape (n,)
        Voltages that are not explained, in V.
    log_evidence : float
        Of all hypotheses together, up to a constant of the scan.
    """

    mean: FloatArray
    covariance: FloatArray
    gain: FloatArray
    noise: float
    probability: FloatArray
    residual: FloatArray
    log_evidence: float = 0.0

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
    """Weigh departures from a Gaussian fit by evidence.

    Parameters
    ----------
    model, fit, basis
        The forward model, the best Gaussian, and the kernels about it.
    weights : ndarray, shape (n,)
        Relative weights of the points.
    effective_count : float
        How many points the data are worth, outliers down-weighted; more than there are if each
        stands for the mean of several repeats to come.
    expected_noise : float
        Standard deviation of the noise of a point of weight one that is to be expected, for
        voltages that have none; zero for data.
    least_noise : float
        Noise of a point of weight one that the covariance counts at least: what is stated is
        believed though the data scatter less.

    Returns
    -------
    WeighedFit
        Posterior mean and covariance of all corrections, and the noise.
    """
    standardised, flat = model.points.standardised, basis.flat
    voltages = model.signal(fit.geometry, basis.kernels(model.k)[:, flat:])
    unexplained = model.points.u - fit.predicted
    rings, data = standardised(voltages, weights), standardised(unexplained, weights)
    # Down-weighted points carry no full degree of freedom.
    jacobian = standardised(fit.jacobian, weights)
    problem = Projected.from_columns(jacobian, data, effective_count - flat, expected_noise**2)
    parts = [problem.part(rings[:, b.start - flat : b.stop - flat], b) for b in basis.blocks]
    outcomes = [problem.gaussian()]
    for hypothesis in HYPOTHESES[1:]:
        assert hypothesis.shape is not None
        part = parts[SHAPES.index(hypothesis.shape)]
        outcomes.append(problem.weigh(part, hypothesis.strength))
    found = _average(problem, outcomes, flat + rings.shape[1], least_noise**2)
    explained = fit.jacobian @ found.mean[:flat] + voltages @ found.mean[flat:]
    gain = found.gain @ standardised(np.eye(data.size), weights)
    return replace(found, gain=gain, residual=unexplained - explained)


def _average(
    problem: Projected, outcomes: list[Outcome], count: int, least_variance: float
) -> WeighedFit:
    """Average mean and gain by one set of weights, squared errors by the other.

    The gain is that of the standardised data, and the residual is left to be found.
    """
    evidence = np.array([o.log_evidence for o in outcomes])
    estimate, uncertainty = (
        _posterior(evidence, np.array([getattr(h, name) for h in HYPOTHESES]))
        for name in ("estimate", "uncertainty")
    )
    gain = np.zeros((count, problem.data.size))
    for p, outcome in zip(estimate, outcomes, strict=True):
        if p > 0:
            _add_gain(gain, problem, outcome, p)
    mean = gain @ problem.data
    # The data move the probabilities, too: d(p m) = (m - mean) p d(log evidence).
    moving = np.zeros_like(gain)
    for p, outcome in zip(estimate, outcomes, strict=True):
        if p > 0:
            own = np.zeros_like(gain)
            _add_gain(own, problem, outcome, 1.0)
            moving += p * np.outer(own @ problem.data - mean, outcome.slope)
    covariance = np.zeros((count, count))
    for p, outcome in zip(uncertainty, outcomes, strict=True):
        if p > 0:
            own = np.zeros_like(gain)
            _add_gain(own, problem, outcome, 1.0)
            off = own @ problem.data - mean
            covariance += p * np.outer(off, off)
            if problem.added:
                apart = own - gain
                covariance += p * problem.added * (apart @ apart.T)
            _add_covariance(covariance, problem, outcome, p, least_variance)
    variance = np.array([o.variance for o in outcomes])
    prior = np.array([h.estimate for h in HYPOTHESES])
    believed = prior > 0
    return WeighedFit(
        mean=mean,
        covariance=covariance,
        gain=gain + moving,
        noise=float(np.sqrt(estimate @ variance)),
        probability=estimate,
        residual=problem.data,
        log_evidence=float(np.logaddexp.reduce(evidence[believed] + np.log(prior[believed]))),
    )


def _posterior(log_evidence: FloatArray, prior: FloatArray) -> FloatArray:
    weight = prior * np.exp(log_evidence - log_evidence[prior > 0].max())
    weight[weight < _NEGLIGIBLE * weight.sum()] = 0.0
    return np.asarray(weight / weight.sum())


def _flat_map(problem: Projected) -> FloatArray:
    """From weighted data to the flat parameters of a plain fit, shape (flat, n)."""
    return np.asarray((problem.inverse @ problem.q.T) / problem.scale[:, None])


def _add_gain(gain: FloatArray, problem: Projected, outcome: Outcome, share: float) -> None:
    fitted = _flat_map(problem)
    flat = fitted.shape[0]
    gain[:flat] += share * fitted
    part = outcome.part
    if part is not None:
        amplitudes = (part.right.T * outcome.shrink) @ part.left.T
        gain[part.block] += share * amplitudes
        gain[:flat] -= share * (fitted @ part.columns) @ amplitudes


def _add_covariance(
    covariance: FloatArray,
    problem: Projected,
    outcome: Outcome,
    share: float,
    least_variance: float,
) -> None:
    flat = problem.scale.size
    plain = problem.inverse @ problem.inverse.T / np.outer(problem.scale, problem.scale)
    covariance[:flat, :flat] += share * max(outcome.variance, least_variance) * plain
    part = outcome.part
    if part is not None:
        amplitudes = outcome.amplitude_covariance(least_variance)
        carried = _flat_map(problem) @ part.columns
        covariance[part.block, part.block] += share * amplitudes
        covariance[:flat, part.block] -= share * carried @ amplitudes
        covariance[part.block, :flat] -= share * amplitudes @ carried.T
        covariance[:flat, :flat] += share * carried @ amplitudes @ carried.T
