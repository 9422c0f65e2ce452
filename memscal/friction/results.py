"""What a comparison of measured with calculated stress finds: friction, loads, agreement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from memscal.model.arrays import FloatArray
from memscal.model.checks import Message, QualityCheck

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile, MeasuredStress

__all__ = [
    "BayesFactor",
    "DryAgainstLubricated",
    "EffectiveFriction",
    "FrictionComparison",
    "ImpliedFriction",
    "InterfaceComparison",
    "InterfaceLaw",
    "InterfaceLength",
    "Interval",
    "LawComparison",
    "LoadComparison",
    "PriorChoice",
]


@dataclass(frozen=True)
class Interval:
    """A confidence interval of a parameter that is not negative and may have no upper end.

    Parameters
    ----------
    low : float
        Lower end; 0 where the data do not exclude it.
    high : float or None
        Upper end; ``None`` where the data exclude no large value, infinity included.
    level : float
        Coverage.

    Examples
    --------
    >>> Interval(0.12, None).holds(float("inf")), Interval(0.12, 0.3).holds(0.1)
    (True, False)
    """

    low: float
    high: float | None
    level: float = 0.95

    @property
    def two_sided(self) -> bool:
        """Whether the data exclude both smaller and larger values."""
        return self.low > 0 and self.high is not None

    def holds(self, value: float) -> bool:
        """Whether a value lies in the interval, its ends included."""
        return self.low <= value and (self.high is None or value <= self.high)


@dataclass(frozen=True, eq=False)
class EffectiveFriction:
    """An effective friction coefficient by profile likelihood: never a bare number.

    Parameters
    ----------
    value : float or None
        Coefficient of least chi-square; ``None`` where the data give no more than a bound.
    standard_uncertainty : float or None
        Half of the interval of 68.3 %; ``None`` where that has an open end.
    interval : Interval
        Values that the data do not exclude.
    reason : str
        Why there is no value, in words; empty where there is one.
    budget : mapping of str to float
        Contribution of each source to the standard uncertainty; empty where there is no value.
        ``loading``: what the choice of the loading's definition adds.
    values, chi_square : ndarray, shape (m,)
        The profile likelihood: chi-square along coefficients that end in ``inf``.
    degrees : int
        Degrees of freedom of chi-square at its least value; 0 of a reading of one datum.
    least : float
        Least chi-square.
    p_value : float
        Chance of such a misfit, or a larger one, if the best coefficient holds.
    """

    value: float | None
    standard_uncertainty: float | None
    interval: Interval
    reason: str
    budget: Mapping[str, float]
    values: FloatArray
    chi_square: FloatArray
    degrees: int
    least: float
    p_value: float

    @property
    def best(self) -> float:
        """Coefficient of least chi-square, ``inf`` included: to draw, not to report."""
        return float(self.values[np.argmin(self.chi_square)]) if self.value is None else self.value


@dataclass(frozen=True, eq=False)
class LoadComparison:
    """One load of one scan against calculated profiles of one definition of the loading.

    Parameters
    ----------
    profile : MeasuredProfile
        What was measured.
    loading : str
        ``"incremental"`` or ``"total"``; ``""`` for profiles from elsewhere.
    s_max, s_max_uncertainty : float
        Measured stress on the axis, in Pa.
    p0_max, p0_max_uncertainty : float
        Calculated frictionless maximum of G convolved with the base stress, in Pa.
    ratio, ratio_uncertainty : float
        ``s_max / p0_max``; the errors of A and G count together.
    calculated, calculated_errors : ndarray, shape (m, n)
        G convolved with the base stress at the profile's n radii for each of the m coefficients,
        and the standard uncertainty that G, film, indenter and common load bring, in Pa.
    p_max : ndarray, shape (m,)
        Maxima of the calculated profiles, in Pa.
    chi_square, p_values : ndarray, shape (m,)
        Of the scan against each of them, and the chance of it or a larger one.
    degrees : int
        Degrees of freedom.
    bracketed : float
        Share of the points that lie between no friction and full stick within 1.96 standard
        uncertainties.
    by_maximum, by_profile : EffectiveFriction
        The effective friction coefficient by the two readings.
    """

    profile: MeasuredProfile
    loading: str
    s_max: float
    s_max_uncertainty: float
    p0_max: float
    p0_max_uncertainty: float
    ratio: float
    ratio_uncertainty: float
    calculated: FloatArray
    calculated_errors: FloatArray
    p_max: FloatArray
    chi_square: FloatArray
    p_values: FloatArray
    degrees: int
    bracketed: float
    by_maximum: EffectiveFriction
    by_profile: EffectiveFriction

    @property
    def load(self) -> float:
        """Nominal load, in N."""
        return self.profile.load

    @property
    def lubrication(self) -> str:
        """``"dry"``, ``"lubricated"``, or ``""`` where it is not stated."""
        return self.profile.lubrication


@dataclass(frozen=True, eq=False)
class DryAgainstLubricated:
    """The difference of dry and lubricated stress at one load: A and G nearly cancel.

    Parameters
    ----------
    load : float
        The dry scan's nominal load, in N.
    r : ndarray, shape (n,)
        Distances from the centre at which the two are compared, in m.
    difference, difference_errors : ndarray, shape (n,)
        Dry minus lubricated S_zz, with its standard uncertainty, in Pa.
    chi_square, degrees, p_value : float
        Of the difference against none.
    maximum, maximum_uncertainty : float
        Difference of the stresses on the axis, in Pa.
    relative, relative_uncertainty : float
        That, over the lubricated stress on the axis.
    """

    load: float
    r: FloatArray
    difference: FloatArray
    difference_errors: FloatArray
    chi_square: float
    degrees: int
    p_value: float
    maximum: float
    maximum_uncertainty: float
    relative: float
    relative_uncertainty: float


@dataclass(frozen=True, eq=False, repr=False)
class FrictionComparison:
    """Measured stress against calculated contacts, with the friction that explains it.

    Parameters
    ----------
    measured : MeasuredStress
        What was measured: profiles of every load of every scan.
    friction : ndarray, shape (m,)
        Friction coefficients of the calculated profiles, increasing; the last may be ``inf``.
    loads : mapping of str to tuple of LoadComparison
        One for each measured profile, in their order, by definition of the loading.
    joint : mapping of str to mapping of str to EffectiveFriction
        One coefficient for all loads together, by lubrication and definition of the loading.
    dry_against_lubricated : tuple of DryAgainstLubricated
        One for each load at which both were measured.
    interface : InterfaceComparison or None
        Laws of the interface against effective friction, where they were asked for.
    macroscopic : (float, float or None) or None
        Friction coefficient measured otherwise, and its standard uncertainty.
    checks : tuple of QualityCheck
        Quality checks.
    messages : tuple of Message
        What a user should know.
    """

    measured: MeasuredStress
    friction: FloatArray
    loads: Mapping[str, tuple[LoadComparison, ...]]
    joint: Mapping[str, Mapping[str, EffectiveFriction]]
    dry_against_lubricated: tuple[DryAgainstLubricated, ...] = ()
    interface: InterfaceComparison | None = None
    macroscopic: tuple[float, float | None] | None = None
    checks: tuple[QualityCheck, ...] = ()
    messages: tuple[Message, ...] = field(default=())

    def __repr__(self) -> str:
        """Return the main numbers in place of thousands of array elements."""
        of_each = [
            f"{lubrication or 'not stated'}, {loading or 'given'}: {_in_words(found)}"
            for lubrication, by_loading in self.joint.items()
            for loading, found in by_loading.items()
        ]
        failed = [check.name for check in self.checks if not check.passed]
        state = f"failed: {', '.join(failed)}" if failed else "all checks passed"
        return f"<FrictionComparison: {'; '.join(of_each)}; {state}>"

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return all(check.passed for check in self.checks)

    @property
    def loadings(self) -> tuple[str, ...]:
        """Definitions of the loading that were compared."""
        return tuple(self.loads)


def _in_words(found: EffectiveFriction) -> str:
    low, high = found.interval.low, found.interval.high
    within = f"{low:.2g} to {'infinity' if high is None else f'{high:.2g}'}"
    return within if found.value is None else f"{found.value:.2g} ({within})"


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
