"""Records of what a comparison of measured with calculated stress gives."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.model.arrays import FloatArray, array_record, value_record
from memscal.model.checks import Checked, Message, QualityCheck, state_of_checks
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.notation import format_bound
from memscal.model.result import Correlated, Shown, Tabulated

if TYPE_CHECKING:
    from memscal import InterfaceComparison

_UM = 1e-6

VALUE = "value"
INTERVAL = "interval"
LOWER_BOUND = "lower bound"
UPPER_BOUND = "upper bound"
UNKNOWN = "unknown"
UNEXPLAINED = "none explains it"
"""What data tell about a parameter; an interval is that of a parameter without a best value."""


@value_record
class Interval:
    """A confidence interval of a parameter that is not negative and may have no upper end.

    ``low`` is 0 where the data do not exclude it, ``high`` ``None`` where they exclude no large
    value.  Neither is a number where no value explains the data.

    >>> print(Interval(0.12, None))
    [0.12, ∞] (95 %)
    """

    low: float
    high: float | None
    level: float = 0.95

    def __str__(self) -> str:
        """Return both ends and the level."""
        return f"[{self.low:.3g}, {self.upper:.3g}] ({100 * self.level:.3g} %)".replace("inf", "∞")

    @property
    def upper(self) -> float:
        """The upper end, infinite where there is none."""
        return math.inf if self.high is None else self.high

    @property
    def two_sided(self) -> bool:
        """Whether the data exclude both smaller and larger values."""
        return self.low > 0 and self.high is not None

    def holds(self, value: float) -> bool:
        """Whether a value lies in the interval, its ends included."""
        return self.low <= value <= self.upper


@array_record
class BoundedEstimate:
    r"""A friction coefficient or a length (``unit`` m) by profile likelihood, with its interval.

    ``value`` is that of the largest likelihood, ``None`` where the data give no more than a bound,
    for the ``reason`` in words; ``standard_uncertainty`` half of the interval of 68.3 %, ``None``
    where that has an open end.  ``interval`` holds what the data do not exclude.  ``deviance``
    (m,), along ``values`` (m,) that may end in ``inf``, is :math:`-2\ln p(u | \theta)` up to a
    constant, by which its least value is chi-square there: ``least``, of ``degrees`` (0 of one
    datum) and ``p_value``.
    ``beside``: how many lubricated loads were fitted with it; ``by_lubricated``: how far it moves
    for one of their friction.  ``budget``: contribution of each source to the standard uncertainty,
    the squares of which add up; ``loading`` is that of the loading's definition.  Printed, it is
    the value with its interval, or the bound, rounded outward.

    >>> nothing = np.zeros(1)
    >>> print(BoundedEstimate(0.2134, None, Interval(0.171, 0.262), "", nothing, nothing, 0.0))
    0.21 [0.17, 0.26]
    >>> print(BoundedEstimate(None, None, Interval(0.2433, None), "", nothing, nothing, 0.0))
    above 0.24 (95 %)
    """

    value: float | None
    standard_uncertainty: float | None
    interval: Interval
    reason: str
    values: FloatArray
    deviance: FloatArray
    least: float
    budget: Mapping[str, float] = field(default_factory=dict)
    degrees: int = 0
    p_value: float = 1.0
    unit: str = ""
    beside: int = 0
    by_lubricated: float | None = None

    @property
    def best(self) -> float:
        """Value of the largest likelihood, ``inf`` included: to draw, not to report."""
        return float(self.values[np.argmin(self.deviance)]) if self.value is None else self.value

    @property
    def kind(self) -> str:
        """What the data tell: value, interval without a value, lower or upper bound, or nothing."""
        low = self.interval.low
        if math.isnan(low):
            return UNEXPLAINED
        if self.interval.high is None:
            return LOWER_BOUND if low > 0 else UNKNOWN
        if low <= 0 and (self.value is None or self.value <= 0):
            return UPPER_BOUND
        return INTERVAL if self.value is None else VALUE

    def __str__(self) -> str:
        """Return the value with its interval, or the bound that is left of it."""
        kind = self.kind
        if kind == UNEXPLAINED:
            return kind
        if kind == UNKNOWN:
            return "not identifiable"
        scale = _UM if self.unit else 1.0
        tail = " um" if self.unit else ""
        low = self.interval.low / scale
        high = self.interval.upper / scale
        if kind == VALUE and self.value is not None:
            return _rounded(self.value / scale, low, high) + tail
        tail += f" ({100 * self.interval.level:.3g} %)"
        lower = format_bound(low, upper=False)
        if kind == LOWER_BOUND:
            return f"above {lower}{tail}"
        upper = format_bound(high, upper=True)
        return f"below {upper}{tail}" if kind == UPPER_BOUND else f"[{lower}, {upper}]{tail}"

    def __repr__(self) -> str:
        """Return the text in place of the likelihood's arrays."""
        return f"<{type(self).__name__}: {self}>"


ByLoading = Mapping[str, BoundedEstimate]
Joint = Mapping[str, ByLoading]
"""Coefficients of all loads together, by lubrication and loading."""


def _rounded(value: float, low: float, high: float) -> str:
    """Return a value and its interval, with the digits that follow from its closer end."""
    # Two digits of the distance to it if that begins with 1 or 2, one otherwise; zero is no end.
    distances = []
    if 0 < low < value:
        distances.append(value - low)
    if high > value:
        distances.append(high - value)
    places = 3
    if distances:
        places = max(0, -math.floor(math.log10(min(distances) / 3)))
    lower = f"{low:.{places}f}" if low > 0 else "0"
    return f"{value:.{places}f} [{lower}, {high:.{places}f}]"


@array_record
class LoadComparison:
    """One load of one scan against calculated profiles of one definition of the loading.

    Measured stress on the axis ``s_max`` and calculated frictionless maximum of G convolved with
    the base stress ``p0_max``, in Pa; in the uncertainty of their ``ratio`` errors of A and G count
    together.  ``calculated`` (m, n): G convolved with the base stress at the profile's n radii for
    each of the m coefficients, with what G, film, indenter and common load leave uncertain, in Pa;
    ``p_max`` (m,): maxima.  ``chi_square`` (m,) is that of the scan against each, ``deviance`` (m,)
    twice the loss of its log likelihood from the best coefficient to each; ``bracketed`` the
    share of points between no friction and full stick within 1.96 standard uncertainties.
    ``by_maximum`` and ``by_profile`` are the two readings of the effective friction coefficient.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> comparison = memscal.compare(
    ...     [made.dry, made.lubricated], sensor, friction=(0, 0.3), loading="total"
    ... )
    >>> first = comparison.loads["total"][0]
    >>> 0.8 < first.ratio < 1.4  # measured maximum over the frictionless one
    True
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
    deviance: FloatArray
    p_values: FloatArray
    degrees: int
    bracketed: float
    by_maximum: BoundedEstimate
    by_profile: BoundedEstimate

    @property
    def load(self) -> float:
        """Nominal load, in N."""
        return self.profile.load

    @property
    def lubrication(self) -> str:
        """``"dry"``, ``"lubricated"``, or ``""`` where it is not stated."""
        return self.profile.lubrication


@array_record
class DryAgainstLubricated:
    """The difference of dry and lubricated stress at one load: A and G nearly cancel.

    ``load`` is the dry scan's nominal one, in N; ``difference`` (n,) is dry minus lubricated S_zz
    at distances ``r`` (m) from the centre, ``maximum`` that of the stresses on the axis, in Pa,
    ``relative`` that over the lubricated one; chi-square is that of the difference against none.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> comparison = memscal.compare(
    ...     [made.dry, made.lubricated], sensor, friction=(0, 0.3), loading="total"
    ... )
    >>> [difference] = comparison.dry_against_lubricated
    >>> abs(difference.relative) < 0.5
    True
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


def joint_text(joint: Joint) -> str:
    """Return the coefficients of all loads together, by lubrication and loading."""
    texts = []
    for lubrication, by_loading in joint.items():
        for loading, estimate in by_loading.items():
            texts.append(f"{lubrication or 'not stated'}, {loading or 'given'}: {estimate}")
    return "; ".join(texts)


@array_record
class FrictionComparison(Shown, Tabulated, Correlated, Checked):
    """Measured stress against calculated contacts, with the friction that explains it.

    ``joint``, of all loads together, is by normal stress and shear together where ``shear``, the
    apparatus function of a tangential channel, was given; all else is by the normal stress.
    Where no coefficient explains all loads, ``wrong_inputs`` are inputs a factor on one of which
    would: ``radius``, ``young_modulus``, ``thickness``, ``load``, ``gain``.
    Of a tangential channel alone ``loads`` is empty; ``by_shear`` holds the coefficient of each
    load by the loading in its place.  Printed, it is the tables of ``memscal compare``.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(friction=0.1, loads=[0.69], lubricated_loads=[0.69])
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> comparison = memscal.compare(
    ...     [made.dry, made.lubricated], sensor, friction=(0, 0.3), loading="total"
    ... )
    >>> sorted(comparison.joint)  # print(comparison) shows the tables
    ['dry', 'lubricated']
    """

    measured: MeasuredStress
    friction: FloatArray
    loads: Mapping[str, tuple[LoadComparison, ...]]
    joint: Mapping[str, Mapping[str, BoundedEstimate]]
    dry_against_lubricated: tuple[DryAgainstLubricated, ...] = ()
    interface: InterfaceComparison | None = None
    macroscopic: tuple[float, float | None] | None = None
    checks: tuple[QualityCheck, ...] = ()
    messages: tuple[Message, ...] = ()
    shear: ApparatusFunction | None = None
    by_shear: Mapping[str, tuple[BoundedEstimate, ...]] = field(default_factory=dict)
    wrong_inputs: Mapping[str, float] | None = None

    def __repr__(self) -> str:
        """Return the main numbers in place of thousands of array elements."""
        return f"<FrictionComparison: {joint_text(self.joint)}; {state_of_checks(self.checks)}>"

    @property
    def unexplained(self) -> list[str]:
        """Lubrications whose loads no friction coefficient explains."""
        first = self.loadings[0]
        return [name for name, by in self.joint.items() if by[first].kind == UNEXPLAINED]

    @property
    def loadings(self) -> tuple[str, ...]:
        """Definitions of the loading that were compared."""
        return tuple(self.loads or self.by_shear)
