"""What a comparison of measured with calculated stress finds: friction, loads, agreement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from memscal.model.checks import Message, QualityCheck
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.friction.compliance import InterfaceComparison
    from memscal.model.measured_stress import MeasuredProfile, MeasuredStress

__all__ = [
    "DryAgainstLubricated",
    "EffectiveFriction",
    "FrictionComparison",
    "Interval",
    "LoadComparison",
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
