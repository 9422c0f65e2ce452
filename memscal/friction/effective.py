"""The effective friction coefficient, by whole profiles and by their maxima."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from memscal.friction.family import bounded, unbounded
from memscal.friction.interval import friction_reason, profile_estimate
from memscal.friction.likelihood import Channel, Likelihood, likelihood, points_at, predict
from memscal.friction.results import BoundedEstimate, LoadComparison
from memscal.model.arrays import FloatArray
from memscal.model.measured_stress import MeasuredProfile

EXPANDED = 1.96
"""Coverage factor of 95 %."""
#: Values along which the likelihood is drawn.
_FINE = 200
#: Parts of a maximum's uncertainty that the likelihood counts by columns of its own.
_SYSTEMATIC = {"conversion_constant", "apparatus", "film", "position_scale", "load"}


@dataclass(frozen=True, eq=False)
class FrictionFit:
    """Measured loads against calculated contacts: the likelihood of each along the friction."""

    channel: Channel
    shear: Channel | None
    fine: Channel  # the channel at the values along which the likelihood is drawn
    whole: Likelihood  # of all loads, there

    def coefficient(self, chosen: Sequence[int], held: Sequence[int] = ()) -> BoundedEstimate:
        """Return the coefficient that explains some of the loads together, by their profiles.

        Loads that are ``held`` at no friction tell what errors all loads share.
        """

        def likelihood_at(value: float, loads: Sequence[int]) -> Likelihood:
            """Likelihood of some of the loads at one value."""
            shear = None if self.shear is None else self.shear.at(value).only(loads)
            return likelihood(self.channel.at(value).only(loads), shear)

        frictionless = likelihood_at(float(self.channel.family.values[0]), held)
        along = self.whole.only(chosen).with_held(self.whole.only(held))
        return self._estimate(
            along, lambda value: likelihood_at(value, chosen).with_held(frictionless)
        )

    def coefficient_of_maximum(self, profile: MeasuredProfile, index: int) -> BoundedEstimate:
        """Return the coefficient that explains the measured maximum of one load."""
        a = self.channel.sensor.conversion_constant
        noise = a * random_uncertainty(profile.maximum_budget)
        top = points_at(np.zeros(1), self.channel.points[index], a * profile.maximum, noise)
        channel = replace(self.channel.only([index]), points=[top])
        along = likelihood(replace(self.fine.only([index]), points=[top]))
        return self._estimate(along, lambda value: likelihood(channel.at(value)))

    def _estimate(self, along: Likelihood, at: Callable[[float], Likelihood]) -> BoundedEstimate:
        """Return the best coefficient with its interval; its budget by the slope at its value."""
        family = self.channel.family
        last = float(family.values[-1])
        estimate = profile_estimate(
            along.values,
            along.coordinates,
            along.deviance,
            along.chi_square,
            family.scale,
            reason=lambda interval: friction_reason(interval, last),
        )
        budget = {}
        if estimate.value is not None:
            coordinate = bounded(estimate.value, family.scale)
            stretch = family.scale / (1 - coordinate) ** 2  # of the coefficient by the coordinate
            shares = at(estimate.value).budget()
            budget = {source: float(stretch * share) for source, share in shares.items()}
        degrees = max(sum(load.degrees for load in along.loads) - 1, 0)
        least = max(estimate.least, 0.0)
        p_value = float(chdtrc(max(degrees, 1), least))
        return replace(estimate, least=least, budget=budget, degrees=degrees, p_value=p_value)


def fit_friction(channel: Channel, shear: Channel | None = None) -> FrictionFit:
    """Hold the measured loads of a channel, or of two, against calculated contacts."""
    family = channel.family
    nodes = family.coordinates
    even = np.linspace(nodes[0], nodes[-1], _FINE)
    step = even[1] - even[0]
    distances = np.abs(np.subtract.outer(even, nodes)).min(axis=1)
    between = unbounded(even[distances > 0.2 * step], family.scale)
    # The family's own values are kept as they are, not as their coordinates give them back.
    values = np.sort([*family.values, *between])
    fine = channel.at(values)
    fine_shear = None if shear is None else shear.at(values)
    return FrictionFit(channel, shear, fine, likelihood(fine, fine_shear))


def random_uncertainty(budget: Mapping[str, float]) -> float:
    """Return what noise, centre and baseline add to a measured maximum."""
    parts = [u for source, u in budget.items() if source not in _SYSTEMATIC]
    return math.hypot(*parts)


def with_loading(by_loading: Mapping[str, BoundedEstimate]) -> dict[str, BoundedEstimate]:
    """Add the standard uncertainty of a rectangle between both loadings, width / sqrt(12)."""
    counted = dict(by_loading)
    values = [estimate.value for estimate in by_loading.values() if estimate.value is not None]
    if len(values) == 2:
        apart = abs(values[0] - values[1]) / math.sqrt(12)
        for loading, estimate in by_loading.items():
            budget = {**estimate.budget, "loading": apart}
            counted[loading] = replace(estimate, budget=budget)
    return counted


def load_comparison(profile: MeasuredProfile, fit: FrictionFit, index: int) -> LoadComparison:
    """Compare a measured load, by its index, with every calculated profile of a family."""
    sensor = fit.channel.sensor
    family = fit.channel.family
    points = fit.channel.points[index]
    # G convolved with each base stress, at the points and on the axis; A is not uncertain in it.
    places = points_at(np.append(profile.r, 0.0), points)
    blurred = predict(places, sensor.with_exact_constant(), family, index)
    variance = np.zeros_like(blurred.signal)
    for column in blurred.columns.values():
        variance += np.sum(column**2, axis=-1)
    stresses = blurred.signal / sensor.conversion_constant
    errors = np.sqrt(variance) / sensor.conversion_constant
    calculated = stresses[:, :-1]
    calculated_errors = errors[:, :-1]
    maxima = stresses[:, -1]
    # Measured over calculated maximum: A and G err together.
    on_axis = predict(points_at(np.zeros(1), points), sensor, family, index)
    changes = np.concatenate([column[0, 0] for column in on_axis.columns.values()])
    systematic = float(np.linalg.norm(changes)) / float(on_axis.signal[0, 0])
    random = random_uncertainty(profile.maximum_budget) / profile.maximum
    ratio = profile.maximum / float(maxima[0])
    # The family's own values are among the fine ones.
    along = fit.whole.only([index])
    nodes = np.searchsorted(along.coordinates, family.coordinates - 1e-12)
    chi_square = along.chi_square[nodes]
    deviance = along.deviance
    measured = profile.s_zz
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
        bracketed=bracketed_share(measured, profile.s_zz_errors, calculated, calculated_errors),
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
