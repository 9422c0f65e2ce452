"""Laws of the interface: their marginal likelihoods, Bayes factors, and slip lengths."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from memscal.friction.results import Interval
from memscal.model.checks import Message
from memscal.model.validation import FloatArray

__all__ = [
    "BayesFactor",
    "ImpliedFriction",
    "InterfaceComparison",
    "InterfaceLaw",
    "InterfaceLength",
    "LawComparison",
    "PriorChoice",
]

#: Steps of twice the natural logarithm of a Bayes factor, in words.
_WORDS = (
    (2.0, "not worth more than a bare mention"),
    (6.0, "positive"),
    (10.0, "strong"),
    (math.inf, "very strong"),
)


@dataclass(frozen=True)
class InterfaceLaw:
    r"""One law of the interface, weighed over all loads together.

    Parameters
    ----------
    name : str
        The law and what is free in it.
    best : tuple of float
        Its free parameters where the likelihood is largest: friction coefficients, of one load
        each if there are several, or a length in m.  Empty where nothing is free.
    log_evidence : float
        Natural logarithm of the likelihood averaged over the prior,
        :math:`\ln \int p(u | \theta)\,\pi(\theta)\,d\theta`, up to a constant of the scans.
    log_likelihood : float
        Largest :math:`\ln p(u | \theta)`, up to the same constant.
    numerical_error : float
        Standard uncertainty of ``log_evidence`` as an integral; 0 where it is negligible.
    least : float
        Least chi-square.
    degrees : int
        Degrees of freedom of it.
    p_value : float
        Chance of such a misfit, or a larger one, if the law holds with ``best``.
    """

    name: str
    best: tuple[float, ...]
    log_evidence: float
    log_likelihood: float
    numerical_error: float
    least: float
    degrees: int
    p_value: float

    @property
    def log_occam(self) -> float:
        """Logarithm of Occam's factor: what the law loses for what it leaves free."""
        return self.log_evidence - self.log_likelihood


@dataclass(frozen=True)
class BayesFactor:
    r"""How much more the data speak for one law than for another.

    Parameters
    ----------
    favoured, against : str
        Names of the two laws, the one of larger evidence first.
    log_factor : float
        :math:`\ln B = \ln p(u | \text{favoured}) - \ln p(u | \text{against})`, not negative.

    Examples
    --------
    >>> factor = BayesFactor("elasto-plastic", "Amontons", 4.0)
    >>> print(f"{factor.value:.0f}: {factor.words}")
    55: strong
    """

    favoured: str
    against: str
    log_factor: float

    @property
    def value(self) -> float:
        """The factor itself; ``inf`` where it is beyond all numbers."""
        return math.exp(self.log_factor) if self.log_factor < 700 else math.inf

    @property
    def words(self) -> str:
        r"""Evidence in words, by :math:`2\ln B` (Kass and Raftery, JASA 90 (1995) 773)."""
        return next(words for limit, words in _WORDS if 2 * self.log_factor < limit)


@dataclass(frozen=True)
class PriorChoice:
    """The Bayes factor under another prior: it depends on the range that was thought possible.

    Parameters
    ----------
    prior : str
        The prior, in words with its range.
    log_factor : float
        Logarithm of the evidence of the law that yields over that of the rigid one, under it;
        negative where the data speak for the rigid one.
    """

    prior: str
    log_factor: float


@dataclass(frozen=True, eq=False)
class InterfaceLength:
    r"""A length over which the interface yields, by profile likelihood: never a bare number.

    Parameters
    ----------
    value : float or None
        Length of largest likelihood, in m; ``None`` where the data give no more than a bound.
    standard_uncertainty : float or None
        Half of the interval of 68.3 %, in m; ``None`` where that has an open end.
    interval : Interval
        Lengths that the data do not exclude, in m; from 0 where a rigid interface is one of them.
    reason : str
        Why there is no value, in words; empty where there is one.
    values, deviance : ndarray, shape (m,)
        The profile likelihood: lengths in m, and :math:`-2\ln p(u | \theta)` along them, up to a
        constant: chi-square with the determinant of its covariance.
    """

    value: float | None
    standard_uncertainty: float | None
    interval: Interval
    reason: str
    values: FloatArray
    deviance: FloatArray

    @property
    def best(self) -> float:
        """Length of largest likelihood in m, ``inf`` included: to draw, not to report."""
        if self.value is not None:
            return self.value
        return float(self.values[self.deviance.argmin()])


@dataclass(frozen=True, eq=False)
class ImpliedFriction:
    r"""What the fitted law with a slip length means at each load.

    Parameters
    ----------
    loads : ndarray, shape (l,)
        Loads in N, increasing.
    friction : ndarray, shape (l, 3)
        Coefficient of Amontons' law that gives the same stress on the axis, through the sensor,
        as the slip length's lower end, best value and upper end do, in that order.  ``inf`` where
        full stick is not more than that.
    pressures : ndarray, shape (l,)
        Mean pressures over the contact, :math:`\bar p = P/\pi a^2`, in Pa.
    stiffnesses : ndarray, shape (l, 3)
        Tangential stiffness of the interface at the mean pressure, :math:`\mu\bar p/\ell`, in
        Pa/m, for the same three slip lengths; ``inf`` of a rigid interface.
    """

    loads: FloatArray
    friction: FloatArray
    pressures: FloatArray
    stiffnesses: FloatArray


@dataclass(frozen=True, eq=False)
class LawComparison:
    """Laws of the interface over all loads of one lubrication.

    Parameters
    ----------
    lubrication : str
        ``"dry"``, ``"lubricated"``, or ``""`` where it is not stated.
    loads : ndarray, shape (l,)
        Nominal loads of the scans that were used, in N.
    laws : tuple of InterfaceLaw
        The laws; the last one yields.
    factors : tuple of BayesFactor
        The law that yields and each of the others.
    length : InterfaceLength
        The length over which it yields: a slip length, or that of the normal law.
    priors : tuple of PriorChoice
        The Bayes factor of the last law and the first under other priors.
    implied : ImpliedFriction or None
        What a slip length means at each load; ``None`` of a normal law.
    """

    lubrication: str
    loads: FloatArray
    laws: tuple[InterfaceLaw, ...]
    factors: tuple[BayesFactor, ...]
    length: InterfaceLength
    priors: tuple[PriorChoice, ...]
    implied: ImpliedFriction | None = None

    @property
    def yielding_preferred(self) -> bool:
        """Whether there is positive evidence for the law that yields against every other."""
        others = max(law.log_evidence for law in self.laws[:-1])
        return 2 * (self.laws[-1].log_evidence - others) >= _WORDS[0][0]


@dataclass(frozen=True, eq=False)
class InterfaceComparison:
    """Laws of the interface against an effective friction coefficient, by evidence.

    Parameters
    ----------
    macroscopic : (float, float or None)
        Friction coefficient at which the interface slips, measured otherwise, and its standard
        uncertainty, which is one of the fit's.
    tangential : LawComparison or None
        From dry scans: one effective coefficient, one for each load, and the elasto-plastic law
        with a slip length, in that order; ``None`` without dry scans.
    normal : LawComparison or None
        From lubricated scans: a rigid frictionless interface, and one that yields normally, in
        that order; ``None`` without lubricated scans.
    messages : tuple of Message
        What a user should know.
    """

    macroscopic: tuple[float, float | None]
    tangential: LawComparison | None
    normal: LawComparison | None
    messages: tuple[Message, ...] = field(default=())
