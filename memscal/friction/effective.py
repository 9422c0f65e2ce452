"""The effective friction coefficient, by the whole profile and by its maximum."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import chdtrc, chdtri

from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import Likelihood, likelihood
from memscal.friction.prediction import (
    LoadPoints,
    Members,
    Sensor,
    members_of,
    predict,
    single_point,
)
from memscal.friction.results import EffectiveFriction, Interval, LoadComparison
from memscal.model.arrays import FloatArray
from memscal.model.notation import format_bound

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

__all__ = [
    "Confrontation",
    "Profiled",
    "bracketed_share",
    "confront",
    "fine_values",
    "load_comparison",
    "profiled",
    "random_uncertainty",
    "reason_of",
    "with_loading",
]

#: Coverage factor of 95 %.
_EXPANDED = 1.96


def bracketed_share(
    measured: FloatArray, errors: FloatArray, calculated: FloatArray, calculated_errors: FloatArray
) -> float:
    """Return the share of points between the extremes of a family, within 1.96 u.

    Where the profiles of different friction cross, away from the axis, the larger of the two
    extremes is above.

    Parameters
    ----------
    measured, errors : ndarray, shape (n,)
        Measured stress and its standard uncertainty, in Pa.
    calculated, calculated_errors : ndarray, shape (m, n)
        Calculated stress of each member, the extremes first and last, and its standard
        uncertainty, in Pa.

    Examples
    --------
    >>> calculated = np.array([[10.0, 5.0], [12.0, 4.0]])
    >>> bracketed_share(np.array([13.0, 8.0]), np.ones(2), calculated, np.zeros((2, 2)))
    0.5
    """
    ends, end_errors = calculated[[0, -1]], calculated_errors[[0, -1]]
    allowed = _EXPANDED * np.hypot(errors, end_errors)
    above = (ends + allowed).max(axis=0)
    below = (ends - allowed).min(axis=0)
    return float(np.mean((below <= measured) & (measured <= above)))


LEVEL = 0.95
#: Level of one standard deviation of a normal distribution.
_ONE_SIGMA = 0.6827
_STEPS = 40


@dataclass(frozen=True)
class Profiled:
    """What a profile likelihood says.

    Parameters
    ----------
    best : float
        Value of least chi-square; at an end it may be ``inf``.
    least : float
        Least chi-square.
    interval, narrow : Interval
        At the level that was asked for, and at 68.3 %.
    open_low, open_high : bool
        Whether the interval reaches the first and the last value.
    """

    best: float
    least: float
    interval: Interval
    narrow: Interval
    open_low: bool
    open_high: bool

    @property
    def standard_uncertainty(self) -> float | None:
        """Half of the interval of 68.3 %; ``None`` where an end is open."""
        if self.narrow.high is None or self.narrow.low <= 0:
            return None
        return (self.narrow.high - self.narrow.low) / 2


def profiled(
    coordinates: FloatArray,
    chi_square: FloatArray,
    value_at: Callable[[float], float],
    *,
    level: float = LEVEL,
) -> Profiled:
    """Return best value and intervals of chi-square along a bounded coordinate.

    Parameters
    ----------
    coordinates : ndarray, shape (m,)
        Increasing, fine enough for a cubic spline.
    chi_square : ndarray, shape (m,)
        Least chi-square over everything else.
    value_at : callable
        Takes a coordinate to the parameter's value.
    level : float
        Coverage of the interval.

    Examples
    --------
    >>> t = np.linspace(0, 1, 101)
    >>> found = profiled(t, ((t - 0.4) / 0.1) ** 2, lambda t: t)
    >>> print(f"{found.best:.2f}, {found.interval.low:.3f} to {found.interval.high:.3f}")
    0.40, 0.204 to 0.596
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(coordinates, chi_square)
    best = _minimum(spline, coordinates, chi_square)
    least = float(spline(best))
    first, last = float(coordinates[0]), float(coordinates[-1])

    def interval(at: float) -> tuple[Interval, bool, bool]:
        rise = float(chdtri(1, 1 - at))
        inside = np.append(coordinates[chi_square - least <= rise], best)
        low = _crossing(spline, coordinates, float(inside.min()), -1, least + rise)
        high = _crossing(spline, coordinates, float(inside.max()), 1, least + rise)
        bounds = Interval(
            0.0 if low is None else value_at(low), None if high is None else value_at(high), at
        )
        return bounds, low is None, high is None

    wide, open_low, open_high = interval(level)
    end = best if first < best < last else (first if best <= first else last)
    return Profiled(value_at(end), least, wide, interval(_ONE_SIGMA)[0], open_low, open_high)


def _minimum(spline: Any, coordinates: FloatArray, chi_square: FloatArray) -> float:
    """Lowest point of the spline next to the lowest node."""
    i = int(np.argmin(chi_square))
    around = slice(max(i - 1, 0), i + 2)
    low, high = coordinates[around][0], coordinates[around][-1]
    turns = spline.derivative().roots(extrapolate=False)
    candidates = [float(coordinates[i]), *(float(t) for t in turns if low < t < high)]
    return min(candidates, key=lambda t: float(spline(t)))


def _crossing(
    spline: Any, coordinates: FloatArray, start: float, side: int, level: float
) -> float | None:
    """Where the spline rises through a level next to an inside point; None beyond the ends."""
    beyond = coordinates[coordinates * side > start * side]
    if not beyond.size:
        return None
    inside, outside = start, float(beyond.min() if side > 0 else beyond.max())
    if spline(outside) <= level:
        return None
    for _ in range(_STEPS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if spline(middle) <= level else (inside, middle)
    return (inside + outside) / 2


def reason_of(found: Profiled, last: float, what: str = "friction coefficient") -> str:
    """Say in words why a profile likelihood gives no value; empty where it gives one.

    Parameters
    ----------
    found : Profiled
        What the likelihood says.
    last : float
        Last value that was calculated; ``inf`` is full stick.
    what : str
        Name of the parameter.
    """
    if not found.open_high:
        return ""
    end = "full stick" if np.isinf(last) else f"{last:.3g}, the last one calculated,"
    if found.open_low:
        return (
            f"The {what} is not identifiable: no friction and {end} agree with the data "
            "equally well."
        )
    bound = format_bound(found.interval.low, upper=False)
    return (
        f"The {what} is not identifiable above {bound}: every larger one, {end} included, agrees "
        "with the data as well. This is a lower bound."
    )


#: Values along which chi-square is drawn.
_FINE = 200
#: Parts of a maximum's uncertainty that the likelihood counts by columns of its own.
_SYSTEMATIC = {"conversion_constant", "apparatus", "film", "position_scale", "load"}


@dataclass(frozen=True, eq=False)
class Confrontation:
    """Measured loads against a family: chi-square of each along the family's parameter.

    Parameters
    ----------
    family, sensor
        What was calculated, and what the sensor makes of it.
    members : Members
        The family at fine values.
    points : tuple of LoadPoints
        What was measured.
    loads : tuple of int
        The family's load of each of them.
    whole : Likelihood
        Of all loads along the fine values.
    """

    family: ProfileFamily
    sensor: Sensor
    members: Members
    points: tuple[LoadPoints, ...]
    loads: tuple[int, ...]
    whole: Likelihood

    def effective(self, chosen: Sequence[int]) -> EffectiveFriction:
        """Return the coefficient that explains some of the loads together, by their profiles."""
        points = [self.points[i] for i in chosen]
        loads = [self.loads[i] for i in chosen]
        return self._effective(self.whole.only(chosen), points, loads)

    def effective_of_maximum(self, profile: MeasuredProfile, index: int) -> EffectiveFriction:
        """Return the coefficient that explains the measured maximum of one load."""
        a = self.sensor.conversion_constant
        points = [
            single_point(
                a * profile.maximum,
                a * random_uncertainty(profile.maximum_budget),
                self.points[index],
            )
        ]
        loads = [self.loads[index]]
        along = likelihood(points, self.sensor, self.members, loads)
        return self._effective(along, points, loads)

    def at(self, values: FloatArray, index: int) -> FloatArray:
        """Return chi-square of one load at values that are among the fine ones."""
        where = np.searchsorted(self.members.coordinates, self._coordinates(values) - 1e-12)
        return self.whole.only([index]).chi_square[where]

    def _coordinates(self, values: FloatArray) -> FloatArray:
        return np.array([self.family.coordinate(float(value)) for value in values])

    def _effective(
        self, along: Likelihood, points: Sequence[LoadPoints], loads: Sequence[int]
    ) -> EffectiveFriction:
        found = profiled(along.coordinates, along.chi_square, self.family.value_at)
        value = None if found.open_high else found.best
        degrees = max(along.degrees - 1, 0)
        return EffectiveFriction(
            value=value,
            standard_uncertainty=None if value is None else found.standard_uncertainty,
            interval=found.interval,
            reason=reason_of(found, float(self.family.values[-1])),
            budget={} if value is None else self._budget(value, points, loads),
            values=along.values,
            chi_square=along.chi_square,
            degrees=degrees,
            least=max(found.least, 0.0),
            p_value=float(chdtrc(max(degrees, 1), max(found.least, 0.0))),
        )

    def _budget(
        self, value: float, points: Sequence[LoadPoints], loads: Sequence[int]
    ) -> dict[str, float]:
        """Contribution of each source to the coefficient, by the slope at its best value."""
        t, scale = self.family.coordinate(value), self.family.scale
        if t >= 1:
            return {}
        here = members_of(self.family, np.array([value]))
        along = likelihood(points, self.sensor, here, loads)
        stretch = scale / (1 - t) ** 2
        return {source: stretch * part for source, part in along.budget(0).items()}


def confront(
    family: ProfileFamily, sensor: Sensor, points: Sequence[LoadPoints], loads: Sequence[int]
) -> Confrontation:
    """Hold measured loads against a family."""
    members = members_of(family, fine_values(family))
    return Confrontation(
        family=family,
        sensor=sensor,
        members=members,
        points=tuple(points),
        loads=tuple(loads),
        whole=likelihood(points, sensor, members, loads),
    )


def fine_values(family: ProfileFamily) -> FloatArray:
    """Return values along a family, even in its bounded coordinate, its own among them."""
    own = family.coordinates
    even = np.linspace(own[0], own[-1], _FINE)
    apart = np.abs(np.subtract.outer(even, own)).min(axis=1) > 0.2 * (even[1] - even[0])
    # The family's own values are kept as they are, not as their coordinates give them back.
    between = [family.value_at(float(t)) for t in even[apart]]
    return np.sort(np.concatenate([family.values, between]))


def random_uncertainty(budget: Mapping[str, float]) -> float:
    """Return what noise, centre and baseline add to a measured maximum."""
    return math.hypot(*(part for source, part in budget.items() if source not in _SYSTEMATIC))


def with_loading(found: EffectiveFriction, other: EffectiveFriction | None) -> EffectiveFriction:
    r"""Add to a budget what the other definition of the loading would have given.

    The truth lies anywhere between the two: a rectangle of their difference, whose standard
    uncertainty is :math:`|\Delta| / \sqrt{12}`.
    """
    if found.value is None or other is None or other.value is None:
        return found
    apart = abs(found.value - other.value) / math.sqrt(12)
    return replace(found, budget={**found.budget, "loading": apart})


def load_comparison(
    profile: MeasuredProfile, confronted: Confrontation, index: int
) -> LoadComparison:
    """Compare a measured load with every calculated profile of a family.

    Parameters
    ----------
    profile : MeasuredProfile
        What was measured.
    confronted : Confrontation
        All measured loads against the family.
    index : int
        Which of them this one is.
    """
    family, load = confronted.family, confronted.loads[index]
    own = members_of(family, family.values)
    calculated, errors = _blurred(confronted.sensor, own, load, profile.r, confronted.points[index])
    top, top_errors = _blurred(confronted.sensor, own, load, np.zeros(1), confronted.points[index])
    chi_square = confronted.at(family.values, index)
    degrees = confronted.points[index].degrees
    ratio = profile.maximum / float(top[0, 0])
    return LoadComparison(
        profile=profile,
        loading=family.loading,
        s_max=profile.maximum,
        s_max_uncertainty=profile.maximum_uncertainty,
        p0_max=float(top[0, 0]),
        p0_max_uncertainty=float(top_errors[0, 0]),
        ratio=ratio,
        ratio_uncertainty=_ratio_uncertainty(profile, confronted, own, index) * ratio,
        calculated=calculated,
        calculated_errors=errors,
        p_max=top[:, 0],
        chi_square=chi_square,
        p_values=np.asarray(chdtrc(degrees, chi_square)),
        degrees=degrees,
        bracketed=bracketed_share(profile.s_zz, profile.s_zz_errors, calculated, errors),
        by_maximum=confronted.effective_of_maximum(profile, index),
        by_profile=confronted.effective([index]),
    )


def _blurred(
    sensor: Sensor, members: Members, load: int, r: FloatArray, like: LoadPoints
) -> tuple[FloatArray, FloatArray]:
    """Return G convolved with the base stress of each member at radii, and its uncertainty.

    That of A is not counted: it is the measured stress's.
    """
    places = _places(r, like)
    found = predict(places, sensor.of_shape, members, load)
    parts = [np.sum(column**2, axis=-1) for column in found.columns.values()]
    variance = np.sum(parts, axis=0) if parts else np.zeros_like(found.signal)
    a = sensor.conversion_constant
    return found.signal / a, np.sqrt(variance) / a


def _places(r: FloatArray, like: LoadPoints) -> LoadPoints:
    """Return radii as points of the nominal load, with the uncertainties of others."""
    nothing = np.zeros(r.size)
    return LoadPoints(
        u=nothing,
        offset=r,
        log_load=nothing,
        noise=nothing,
        load_errors=nothing,
        x_errors=nothing,
        flat=np.zeros((r.size, 0)),
        free_centre=False,
        load_share=like.load_share,
        position_share=like.position_share,
    )


def _ratio_uncertainty(
    profile: MeasuredProfile, confronted: Confrontation, members: Members, index: int
) -> float:
    """Relative uncertainty of measured over frictionless maximum: A and G err together."""
    top = single_point(0.0, 0.0, confronted.points[index])
    found = predict(top, confronted.sensor, members, confronted.loads[index])
    parts = [float(np.linalg.norm(column[0, 0])) for column in found.columns.values()]
    systematic = float(np.linalg.norm(parts)) / float(found.signal[0, 0])
    return float(np.hypot(systematic, random_uncertainty(profile.maximum_budget) / profile.maximum))
