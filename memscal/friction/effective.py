"""The effective friction coefficient, by whole profiles and by their maxima."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc, erf

from memscal.friction.family import bounded, unbounded
from memscal.friction.interval import friction_reason, profile_estimate
from memscal.friction.likelihood import (
    LUBRICATED_FRICTION,
    Channel,
    Likelihood,
    likelihood,
    points_at,
    predict,
)
from memscal.friction.results import BoundedEstimate, ByLoading, Interval, Joint, LoadComparison
from memscal.model.arrays import FloatArray, Values, array_record
from memscal.model.checks import FALSE_ALARM
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress

EXPANDED = 1.96
"""Coverage factor of 95 %."""
#: Values along which the likelihood is drawn.
_FINE = 200
#: Parts of a maximum's uncertainty that the likelihood counts by columns of its own.
_SYSTEMATIC = {"conversion_constant", "apparatus", "film", "position_scale", "load"}


@array_record
class FrictionFit:
    """Measured loads against calculated contacts: the likelihood of each along the friction."""

    channel: Channel
    shear: tuple[Channel, ...]  # that of the tangential channel, where it counts too
    fine: Channel  # the channel at the values along which the likelihood is drawn
    whole: Likelihood  # of all loads, there

    def coefficient(self, chosen: Sequence[int]) -> BoundedEstimate:
        """Return the coefficient that explains some of the loads together, by their profiles."""
        along = self.whole.only(chosen)
        return self._estimate(along, along.deviance, along.chi_square, self._near(chosen))

    def coefficient_beside(
        self, chosen: Sequence[int], lubricated: Sequence[int], friction: float
    ) -> BoundedEstimate:
        """Return that of some loads beside lubricated ones, which share errors with them.

        The lubricated friction is averaged over half a normal distribution of width ``friction``.
        """
        family = self.channel.family
        along = self.whole.only(chosen)
        beside = self.whole.only(lubricated)
        width = max(friction, _LEAST_WIDTH)
        weights = half_normal_weights(along.values, width)
        logs, chi_square, means = along.averaged_over(beside, weights)
        spread = _HALF_NORMAL_DEVIATION * width

        def near(value: float) -> Likelihood:
            mean = float(np.interp(bounded(value, family.scale), along.coordinates, means))
            by_coordinate = _stretch(mean, family.scale)
            held = self._near(lubricated)(mean)
            return self._near(chosen)(value).with_held(held, spread / by_coordinate)

        both = self.whole.only([*chosen, *lubricated])
        estimate = self._estimate(both, -2 * logs, chi_square, near)
        budget = dict(estimate.budget)
        interval = estimate.interval
        share = budget.get(LUBRICATED_FRICTION)
        if friction == 0:
            budget.pop(LUBRICATED_FRICTION, None)
        else:
            # No friction is at the end of its prior: where it is true, the average alone would
            # exclude the truth in one of five.
            none = self.coefficient_beside(chosen, lubricated, 0.0).interval
            interval = replace(interval, low=min(interval.low, none.low))
        return replace(
            estimate,
            interval=interval,
            reason=friction_reason(interval, family.values[-1]),
            beside=len(lubricated),
            # More friction of the lubricated loads reads as less of the others.
            by_lubricated=None if share is None else -share / spread,
            budget=budget,
        )

    def _near(self, chosen: Sequence[int]) -> Callable[[float], Likelihood]:
        """Return the likelihood of some of the loads at any one value."""
        channels = [channel.only(chosen) for channel in (self.channel, *self.shear)]
        return lambda value: likelihood(*(channel.at(value) for channel in channels))

    def coefficient_of_maximum(self, profile: MeasuredProfile, index: int) -> BoundedEstimate:
        """Return the coefficient that explains the measured maximum of one load."""
        a = self.channel.sensor.conversion_constant
        noise = a * random_uncertainty(profile.maximum_budget)
        top = points_at(np.zeros(1), self.channel.points[index], a * profile.maximum, noise)
        channel = replace(self.channel.only([index]), points=[top])
        along = likelihood(replace(self.fine.only([index]), points=[top]))
        return self._estimate(
            along, along.deviance, along.chi_square, lambda value: likelihood(channel.at(value))
        )

    def _estimate(
        self,
        along: Likelihood,
        deviance: FloatArray,
        chi_square: FloatArray,
        at: Callable[[float], Likelihood],
    ) -> BoundedEstimate:
        """Return the best coefficient with its interval; its budget by the slope at its value."""
        family = self.channel.family
        estimate = profile_estimate(
            along.values,
            along.coordinates,
            deviance,
            chi_square,
            family.scale,
            reason=friction_reason,
        )
        budget = {}
        if estimate.value is not None:
            stretch = _stretch(estimate.value, family.scale)
            shares = at(estimate.value).budget()
            budget = {source: stretch * share for source, share in shares.items()}
            # The likelihood is no parabola: the shares of its slope add up to its width.
            u = estimate.standard_uncertainty
            whole = math.hypot(*budget.values())
            if u is not None and whole > 0:
                budget = {source: share * u / whole for source, share in budget.items()}
        degrees = max(sum(load.degrees for load in along.loads) - 1, 0)
        least = max(estimate.least, 0.0)
        p_value = float(chdtrc(max(degrees, 1), least))
        return replace(estimate, least=least, budget=budget, degrees=degrees, p_value=p_value)


def fit_friction(channel: Channel, *shear: Channel) -> FrictionFit:
    """Hold the measured loads of a channel, or of two, against calculated contacts."""
    family = channel.family
    nodes = family.coordinates
    even = np.linspace(nodes[0], nodes[-1], _FINE)
    step = even[1] - even[0]
    distances = abs(np.subtract.outer(even, nodes)).min(axis=1)
    between = unbounded(even[distances > 0.2 * step], family.scale)
    # The family's own values are kept as they are, not as their coordinates give them back.
    values = np.sort([*family.values, *between])
    fine = channel.at(values)
    return FrictionFit(channel, shear, fine, likelihood(fine, *(each.at(values) for each in shear)))


def _stretch(value: float, scale: float) -> float:
    """Return the derivative of a coefficient by its bounded coordinate."""
    return (value + scale) ** 2 / scale


#: Standard deviation of half a normal distribution over its width, and mean over the former.
_HALF_NORMAL_DEVIATION = math.sqrt(1 - 2 / math.pi)
HALF_NORMAL_MEAN = math.sqrt(2 / math.pi) / _HALF_NORMAL_DEVIATION
#: A friction that is held has this width.
_LEAST_WIDTH = 1e-6
#: Values of the lubricated friction over which the likelihood is averaged, and how many widths
#: they reach.
_AVERAGED = 48
_FARTHEST = 4.0


def half_normal_weights(values: FloatArray, width: float) -> FloatArray:
    """Return what of half a normal distribution of a width each of the values stands for, (V,)."""
    inside = np.flatnonzero(values < _FARTHEST * width)
    chosen = inside[:: math.ceil(inside.size / _AVERAGED)]
    middles = (values[chosen][1:] + values[chosen][:-1]) / 2
    weights = np.zeros(values.size)
    weights[chosen] = np.diff(erf(np.array([0.0, *middles, np.inf]) / (math.sqrt(2) * width)))
    return weights


def random_uncertainty(budget: Mapping[str, float]) -> float:
    """Return what noise, centre and baseline add to a measured maximum."""
    return math.hypot(*(u for source, u in budget.items() if source not in _SYSTEMATIC))


def unexplained(
    estimate: BoundedEstimate, reason: str = "No friction coefficient explains these profiles."
) -> BoundedEstimate:
    """Return what is left of a coefficient that does not explain what it should."""
    nothing = Interval(math.nan, math.nan)
    return replace(estimate, value=None, standard_uncertainty=None, interval=nothing, reason=reason)


def with_loading(by_loading: ByLoading, *, tested: bool) -> dict[str, BoundedEstimate]:
    """Take the middle of both loadings; a rectangle between them, width / sqrt(12), is left.

    Where neither passes the chi-square, if it tests anything, nothing is left.
    """
    estimates = by_loading.values()
    if tested and max(estimate.p_value for estimate in estimates) < FALSE_ALARM:
        return {loading: unexplained(estimate) for loading, estimate in by_loading.items()}
    values = [estimate.value for estimate in estimates if estimate.value is not None]
    if len(values) < 2:
        return dict(by_loading)
    middle = sum(values) / 2
    apart = abs(values[0] - values[1]) / math.sqrt(12)
    lows = []
    highs = []
    for estimate, value in zip(estimates, values, strict=True):
        below = math.hypot(value - estimate.interval.low, EXPANDED * apart)
        # What the data do not exclude by one of the loadings is not excluded.
        lows.append(max(middle - below, 0.0) if estimate.interval.low > 0 else 0.0)
        highs.append(middle + math.hypot(estimate.interval.upper - value, EXPANDED * apart))
    widest = max(estimates, key=lambda estimate: estimate.standard_uncertainty or math.inf)
    u = widest.standard_uncertainty
    counted: Values = {
        "value": middle,
        "standard_uncertainty": None if u is None else math.hypot(u, apart),
        "interval": replace(widest.interval, low=min(lows), high=max(highs)),
        "budget": {**widest.budget, "loading": apart},
        "by_lubricated": widest.by_lubricated,
    }
    return {loading: replace(estimate, **counted) for loading, estimate in by_loading.items()}


def fit_together(
    measured: MeasuredStress,
    fits: Mapping[str, FrictionFit],
    lubricated_friction: float | None = None,
) -> Joint:
    """Fit all loads of a kind; the dry beside lubricated ones of about that friction, if any."""
    indices: dict[str, list[int]] = {}
    for i, profile in enumerate(measured.profiles):
        indices.setdefault(profile.lubrication, []).append(i)
    joint = {
        lubrication: {loading: fit.coefficient(chosen) for loading, fit in fits.items()}
        for lubrication, chosen in indices.items()
    }
    held = indices.pop("lubricated", [])
    first = next(iter(fits.values())).channel.family.values[0]
    if held and lubricated_friction is not None and first == 0:
        for lubrication, chosen in indices.items():
            for loading, fit in fits.items():
                joint[lubrication][loading] = fit.coefficient_beside(
                    chosen, held, lubricated_friction
                )
    return {kind: with_loading(held, tested=measured.noise_stated) for kind, held in joint.items()}


def load_comparison(profile: MeasuredProfile, fit: FrictionFit, index: int) -> LoadComparison:
    """Compare a measured load, by its index, with every calculated profile of a family."""
    sensor = fit.channel.sensor
    family = fit.channel.family
    points = fit.channel.points[index]
    # G convolved with each base stress, at the points and on the axis; A is not uncertain in it.
    places = points_at(np.append(profile.r, 0.0), points)
    blurred = predict(places, sensor.with_exact_constant(), family, index)
    variance = sum(np.sum(column**2, axis=-1) for column in blurred.columns.values())
    stresses = blurred.signal / sensor.conversion_constant
    errors = np.sqrt(variance) / sensor.conversion_constant
    calculated = stresses[:, :-1]
    calculated_errors = errors[:, :-1]
    maxima = stresses[:, -1]
    # Measured over calculated maximum: A and G err together.
    on_axis = predict(points_at(np.zeros(1), points), sensor, family, index)
    changes = np.concatenate([column[0, 0] for column in on_axis.columns.values()])
    systematic = np.linalg.norm(changes) / on_axis.signal[0, 0]
    random = random_uncertainty(profile.maximum_budget) / profile.maximum
    ratio = profile.maximum / float(maxima[0])
    # The family's own values are among the fine ones.
    along = fit.whole.only([index])
    nodes = np.searchsorted(along.coordinates, family.coordinates - 1e-12)
    chi_square = along.chi_square[nodes]
    deviance = along.deviance
    return LoadComparison(
        profile=profile,
        loading=family.loading,
        s_max=profile.maximum,
        s_max_uncertainty=profile.maximum_uncertainty,
        p0_max=float(maxima[0]),
        p0_max_uncertainty=float(errors[0, -1]),
        ratio=ratio,
        ratio_uncertainty=math.hypot(systematic, random) * ratio,
        calculated=calculated,
        calculated_errors=calculated_errors,
        p_max=maxima,
        chi_square=chi_square,
        deviance=deviance[nodes] - deviance.min(),
        p_values=chdtrc(points.degrees, chi_square),
        degrees=points.degrees,
        bracketed=bracketed_share(profile.s_zz, profile.s_zz_errors, calculated, calculated_errors),
        by_maximum=fit.coefficient_of_maximum(profile, index),
        by_profile=fit.coefficient([index]),
    )


def bracketed_share(
    measured: FloatArray, errors: FloatArray, calculated: FloatArray, calculated_errors: FloatArray
) -> float:
    """Return the share of stresses (n,) within 1.96 u of the extremes of calculated ones (m, n)."""
    # Away from the axis the profiles cross: the larger of the two extremes is above.
    ends = calculated[[0, -1]]
    allowed = EXPANDED * np.hypot(errors, calculated_errors[[0, -1]])
    low = (ends - allowed).min(axis=0)
    high = (ends + allowed).max(axis=0)
    return float(np.mean((low <= measured) & (measured <= high)))
