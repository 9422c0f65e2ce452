"""The effective friction coefficient, by whole profiles, their maxima, and dry less lubricated."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import (
    Channel,
    Likelihood,
    LoadPoints,
    Predicted,
    Sensor,
    likelihood,
    points_at,
    predict,
    standardise,
)
from memscal.friction.results import BoundedEstimate, DryAgainstLubricated, Interval, LoadComparison
from memscal.model.arrays import FloatArray
from memscal.model.measured_stress import MeasuredProfile
from memscal.model.notation import format_bound

EXPANDED = 1.96
"""Coverage factor of 95 %."""


def bracketed_share(
    measured: FloatArray, errors: FloatArray, calculated: FloatArray, calculated_errors: FloatArray
) -> float:
    """Return the share of stresses (n,) within 1.96 u of the extremes of calculated ones (m, n)."""
    # Away from the axis the profiles cross: the larger of the two extremes is above.
    ends = calculated[[0, -1]]
    end_errors = calculated_errors[[0, -1]]
    allowed = EXPANDED * np.hypot(errors, end_errors)
    above = (ends + allowed).max(axis=0)
    return float(np.mean(((ends - allowed).min(axis=0) <= measured) & (measured <= above)))


#: Level of one standard deviation of a normal distribution.
_ONE_SIGMA = 0.6827


def profile_estimate(
    values: FloatArray,
    coordinates: FloatArray,
    deviance: FloatArray,
    chi_square: FloatArray,
    value_at: Callable[[float], float],
    *,
    reason: Callable[[Interval], str],
    two_sided: bool = False,
    level: float = 0.95,
    unit: str = "",
) -> BoundedEstimate:
    """Return best value and interval of -2 ln p (m,) along an increasing bounded coordinate."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(coordinates, deviance)
    # The lowest point of the spline next to the lowest node.
    i = int(np.argmin(deviance))
    around = coordinates[max(i - 1, 0) : i + 2]
    turns = spline.derivative().roots(extrapolate=False)
    turns = turns[(around[0] < turns) & (turns < around[-1])]
    best = float(min([coordinates[i], *turns], key=spline))
    lowest = float(spline(best))
    least = float(CubicSpline(coordinates, chi_square)(best))

    def interval(at: float) -> Interval:
        rise = float(chdtri(1, 1 - at))
        inside = np.append(coordinates[deviance - lowest <= rise], best)
        low = _crossing(spline, coordinates, float(inside.min()), -1, lowest + rise)
        high = _crossing(spline, coordinates, float(inside.max()), 1, lowest + rise)
        return Interval(
            0.0 if low is None else value_at(low), None if high is None else value_at(high), at
        )

    wide = interval(level)
    narrow = interval(_ONE_SIGMA)
    # There is no value without an upper end, with ``two_sided`` without both; ``reason`` says why.
    if wide.high is None or (two_sided and not wide.two_sided):
        value = spread = None
    else:
        value = value_at(float(np.clip(best, coordinates[0], coordinates[-1])))
        spread = (narrow.high - narrow.low) / 2 if narrow.high and narrow.low > 0 else None
    above = deviance - lowest + least
    return BoundedEstimate(value, spread, wide, reason(wide), values, above, least, unit=unit)


def _crossing(
    spline: Any, coordinates: FloatArray, start: float, side: int, level: float
) -> float | None:
    """Where the spline rises through a level next to an inside point; None beyond the ends."""
    beyond = coordinates[coordinates * side > start * side]
    if not beyond.size:
        return None
    outside = float(beyond.min() if side > 0 else beyond.max())
    if spline(outside) <= level:
        return None
    roots = spline.solve(level, extrapolate=False)
    between = roots[(min(start, outside) <= roots) & (roots <= max(start, outside))]
    return float(min(between, key=lambda root: abs(root - start), default=start))


def friction_reason(interval: Interval, last: float) -> str:
    """Say why there is no friction coefficient, ``last`` being the last one that was calculated."""
    if interval.high is not None:
        return ""
    end = "full stick" if np.isinf(last) else f"{last:.3g}, the last one calculated,"
    if interval.low <= 0:
        return (
            f"The friction coefficient is not identifiable: no friction and {end} agree with the "
            "data equally well."
        )
    bound = format_bound(interval.low, upper=False)
    return (
        f"The friction coefficient is not identifiable above {bound}: every larger one, {end} "
        "included, agrees with the data as well. This is a lower bound."
    )


#: Values along which the likelihood is drawn.
_FINE = 200
#: Parts of a maximum's uncertainty that the likelihood counts by columns of its own.
_SYSTEMATIC = {"conversion_constant", "apparatus", "film", "position_scale", "load"}


@dataclass(frozen=True, eq=False)
class Confrontation:
    """Measured loads against a family: the likelihood of each along the family's parameter."""

    family: ProfileFamily
    sensor: Sensor
    members: ProfileFamily  # the family at fine values
    points: tuple[LoadPoints, ...]
    loads: tuple[int, ...]  # the family's load of each of the points
    whole: Likelihood  # of all loads, along the fine values
    shear: Channel | None = None  # what a tangential channel tells beside

    def effective(self, chosen: Sequence[int], held: Sequence[int] = ()) -> BoundedEstimate:
        """Return the coefficient that explains some of the loads together, by their profiles.

        Loads that are ``held`` at no friction tell what errors all loads share.
        """
        along = self.whole.only(chosen)
        if held:
            along = along.beside(self.whole.only(held))

        def at(value: float) -> Likelihood:
            of_chosen = self._at(value, chosen)
            return of_chosen.beside(self._at(self.family.values[0], held)) if held else of_chosen

        return self._effective(along, at)

    def _at(self, value: float, chosen: Sequence[int]) -> Likelihood:
        """Likelihood of some of the loads at one value."""
        points = [self.points[i] for i in chosen]
        loads = [self.loads[i] for i in chosen]
        shear = None if self.shear is None else self.shear.only(chosen)
        return likelihood(points, self.sensor, self.family.at(value), loads, shear)

    def effective_of_maximum(self, profile: MeasuredProfile, index: int) -> BoundedEstimate:
        """Return the coefficient that explains the measured maximum of one load."""
        a = self.sensor.conversion_constant
        noise = a * random_uncertainty(profile.maximum_budget)
        points = [points_at(np.zeros(1), self.points[index], a * profile.maximum, noise)]

        def at(members: ProfileFamily) -> Likelihood:
            return likelihood(points, self.sensor, members, [self.loads[index]])

        return self._effective(at(self.members), lambda value: at(self.family.at(value)))

    def at(self, values: FloatArray, index: int) -> tuple[FloatArray, FloatArray]:
        """Return chi-square and -2 ln p of one load at values that are among the fine ones."""
        coordinates = np.array([self.family.coordinate(float(value)) for value in values])
        where = np.searchsorted(self.members.coordinates, coordinates - 1e-12)
        along = self.whole.only([index])
        return along.chi_square[where], along.deviance[where]

    def _effective(self, along: Likelihood, at: Callable[[float], Likelihood]) -> BoundedEstimate:
        estimate = profile_estimate(
            along.values,
            along.coordinates,
            along.deviance,
            along.chi_square,
            self.family.value_at,
            reason=lambda interval: friction_reason(interval, float(self.family.values[-1])),
        )
        degrees = max(along.degrees - 1, 0)
        least = max(estimate.least, 0.0)
        return replace(
            estimate,
            least=least,
            budget={} if estimate.value is None else self._budget(estimate.value, at),
            degrees=degrees,
            p_value=float(chdtrc(max(degrees, 1), least)),
        )

    def _budget(self, value: float, at: Callable[[float], Likelihood]) -> dict[str, float]:
        """Contribution of each source to the coefficient, by the slope at its best value."""
        t = self.family.coordinate(value)
        if t >= 1:
            return {}
        stretch = self.family.scale / (1 - t) ** 2
        return {source: stretch * share for source, share in at(value).budget(0).items()}


def confront(
    family: ProfileFamily,
    sensor: Sensor,
    points: Sequence[LoadPoints],
    loads: Sequence[int],
    shear: Channel | None = None,
) -> Confrontation:
    """Hold measured loads against a family."""
    members = family.at(fine_values(family))
    whole = likelihood(points, sensor, members, loads, shear)
    return Confrontation(family, sensor, members, tuple(points), tuple(loads), whole, shear)


def fine_values(family: ProfileFamily) -> FloatArray:
    """Return values along a family, even in its bounded coordinate, its own among them."""
    nodes = family.coordinates
    even = np.linspace(nodes[0], nodes[-1], _FINE)
    apart = np.abs(np.subtract.outer(even, nodes)).min(axis=1) > 0.2 * (even[1] - even[0])
    # The family's own values are kept as they are, not as their coordinates give them back.
    return np.sort(np.concatenate([family.values, family.values_at(even[apart])]))


def random_uncertainty(budget: Mapping[str, float]) -> float:
    """Return what noise, centre and baseline add to a measured maximum."""
    return math.hypot(*(u for source, u in budget.items() if source not in _SYSTEMATIC))


def with_loading(estimate: BoundedEstimate, other: BoundedEstimate | None) -> BoundedEstimate:
    """Add the standard uncertainty of a rectangle between both loadings, width / sqrt(12)."""
    if estimate.value is None or other is None or other.value is None:
        return estimate
    apart = abs(estimate.value - other.value) / math.sqrt(12)
    return replace(estimate, budget={**estimate.budget, "loading": apart})


def load_comparison(
    profile: MeasuredProfile, confronted: Confrontation, index: int
) -> LoadComparison:
    """Compare a measured load, by its index, with every calculated profile of a family."""
    family = confronted.family
    load = confronted.loads[index]
    points = confronted.points[index]
    r = np.append(profile.r, 0.0)
    calculated, errors = _blurred(confronted.sensor, family, load, r, points)
    (calculated, top), (errors, top_errors) = (
        np.split(values, [-1], axis=1) for values in (calculated, errors)
    )
    chi_square, deviance = confronted.at(family.values, index)
    by_profile = confronted.effective([index])
    lowest = float(confronted.whole.only([index]).deviance.min())
    ratio = profile.maximum / float(top[0, 0])
    # Measured and calculated maximum: A and G err together.
    on_axis = predict(points_at(np.zeros(1), points), confronted.sensor, family, load)
    norms = [float(np.linalg.norm(column[0, 0])) for column in on_axis.columns.values()]
    systematic = float(np.linalg.norm(norms)) / float(on_axis.signal[0, 0])
    random = random_uncertainty(profile.maximum_budget) / profile.maximum
    return LoadComparison(
        profile=profile,
        loading=family.loading,
        s_max=profile.maximum,
        s_max_uncertainty=profile.maximum_uncertainty,
        p0_max=float(top[0, 0]),
        p0_max_uncertainty=float(top_errors[0, 0]),
        ratio=ratio,
        ratio_uncertainty=float(np.hypot(systematic, random)) * ratio,
        calculated=calculated,
        calculated_errors=errors,
        p_max=top[:, 0],
        chi_square=chi_square,
        deviance=deviance - lowest,
        p_values=np.asarray(chdtrc(points.degrees, chi_square)),
        degrees=points.degrees,
        bracketed=bracketed_share(profile.s_zz, profile.s_zz_errors, calculated, errors),
        by_maximum=confronted.effective_of_maximum(profile, index),
        by_profile=by_profile,
    )


def _blurred(
    sensor: Sensor, members: ProfileFamily, load: int, r: FloatArray, like: LoadPoints
) -> tuple[FloatArray, FloatArray]:
    """Return G convolved with each member's base stress, and its uncertainty (not that of A)."""
    predicted = predict(points_at(r, like), sensor.of_shape, members, load)
    squares = (np.sum(column**2, axis=-1) for column in predicted.columns.values())
    variance = sum(squares, start=np.zeros_like(predicted.signal))
    a = sensor.conversion_constant
    return predicted.signal / a, np.sqrt(variance) / a


#: Loads that differ by less than this share are one.
_SAME_LOAD = 0.05
#: Places that are nearer than this share of a step are one.
_CLOSE = 0.25
_FEWEST_PLACES = 6


def lubricated_pairs(profiles: Sequence[MeasuredProfile]) -> list[tuple[int, int]]:
    """Return the indices of dry and lubricated profiles of one load."""
    return [
        (i, j)
        for (i, dry), (j, wet) in product(enumerate(profiles), repeat=2)
        if (dry.lubrication, wet.lubrication) == ("dry", "lubricated")
        and abs(dry.load / wet.load - 1) < _SAME_LOAD
    ]


def dry_against_lubricated(
    profiles: tuple[MeasuredProfile, MeasuredProfile],
    points: tuple[LoadPoints, LoadPoints],
    sensor: Sensor,
    frictionless: ProfileFamily,  # says how voltages change with load and place
    loads: tuple[int, int],  # its loads of the two
    conversion_share: float,  # relative standard uncertainty of A
) -> DryAgainstLubricated | None:
    """Compare the dry and the lubricated profile of one load; None of too few places in common."""
    # Errors of A, G and film nearly cancel in the difference: noise, the scatter of the loads, and
    # each scan's own baseline, drift and centre are left.
    sides = [of_load.averaged() for of_load in points]
    kept = _common(sides[0].offset, sides[1].offset)
    if kept[0].size < _FEWEST_PLACES:
        return None
    predicted = [predict(sides[i], sensor, frictionless, loads[i]) for i in range(2)]
    both = list(zip(sides, predicted, kept, strict=True))
    # What the frictionless contact says of other places and loads is taken off both.
    dry, wet = ((side.u - of_side.signal[0])[places] for side, of_side, places in both)
    flat = np.column_stack([sides[0].flat, predicted[0].slope[0] * sides[0].side])[kept[0]]
    noise, correlation = _noise(both)
    left = points_at(sides[0].offset[kept[0]], sides[0], dry - wet, noise)
    left = replace(left, flat=flat, correlation=correlation)
    nothing = np.zeros((1, noise.size))
    of_noise = standardise(left, Predicted(nothing, nothing, nothing, nothing, {}))
    chi_square = float(np.sum(of_noise.residual**2))
    degrees = left.degrees
    difference, errors = _difference(profiles, sides, predicted, kept, sensor, conversion_share)
    top = profiles[0].maximum - profiles[1].maximum
    random = (random_uncertainty(profile.maximum_budget) for profile in profiles)
    u_top = math.hypot(conversion_share * top, *random)
    return DryAgainstLubricated(
        load=profiles[0].load,
        r=sides[0].radius[kept[0]],
        difference=difference,
        difference_errors=errors,
        chi_square=chi_square,
        degrees=degrees,
        p_value=float(chdtrc(degrees, chi_square)),
        maximum=top,
        maximum_uncertainty=u_top,
        relative=top / profiles[1].maximum,
        relative_uncertainty=u_top / profiles[1].maximum,
    )


def _common(dry: FloatArray, wet: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of places that both scans measured, a quarter of a step apart at most."""
    nearest = np.searchsorted((wet[1:] + wet[:-1]) / 2, dry)
    step = float(np.median(np.diff(dry))) if dry.size > 1 else 0.0
    close = np.abs(dry - wet[nearest]) < _CLOSE * step
    first, where = np.unique(nearest[close], return_index=True)
    return close.nonzero()[0][where], first


def _noise(
    both: Sequence[tuple[LoadPoints, Predicted, NDArray[np.intp]]],
) -> tuple[FloatArray, FloatArray | None]:
    """Noise of a difference, in V, without what both scans share, and its correlation if any."""
    variance = np.zeros(())
    shared = None
    for points, predicted, places in both:
        moved = predicted.by_load[0] * points.load_errors, predicted.slope[0] * points.x_errors
        variance = variance + np.sum(np.square([points.noise, *moved]), axis=0)[places]
        if points.correlation is not None:
            apart = points.correlation - np.eye(points.u.size)
            covariance = (np.outer(points.noise, points.noise) * apart)[np.ix_(places, places)]
            shared = covariance if shared is None else shared + covariance
    noise = np.sqrt(variance)
    return noise, None if shared is None else shared / np.outer(noise, noise) + np.eye(noise.size)


def _difference(
    profiles: tuple[MeasuredProfile, MeasuredProfile],
    sides: Sequence[LoadPoints],
    predicted: Sequence[Predicted],
    kept: tuple[NDArray[np.intp], NDArray[np.intp]],
    sensor: Sensor,
    conversion_share: float,
) -> tuple[FloatArray, FloatArray]:
    """Return dry minus lubricated stress at the dry scan's places, and its uncertainty, in Pa."""
    along = [(profile.x, profile.y)[profile.axis] for profile in profiles]
    orders = [np.argsort(along[i])[kept[i]] for i in range(2)]
    dry, wet = (profiles[i].s_zz[orders[i]] for i in range(2))
    farther = sides[0].radius[kept[0]] - sides[1].radius[kept[1]]
    heavier = math.log(profiles[0].load / profiles[1].load)
    moved = predicted[1].slope[0][kept[1]] * farther + predicted[1].by_load[0][kept[1]] * heavier
    difference = dry - wet - moved / sensor.conversion_constant
    variance = (conversion_share * difference) ** 2
    for profile, order in zip(profiles, orders, strict=True):
        sources = (source for source in profile.roots if source != "conversion_constant")
        variance = variance + profile.errors_by(*sources)[order] ** 2
    return difference, np.sqrt(variance)
