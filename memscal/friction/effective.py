"""The effective friction coefficient, by whole profiles and by their maxima."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from memscal.friction.family import ProfileFamily, bounded, unbounded
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
        first = self.channel.family.values[0]

        def at(value: float) -> Likelihood:
            return self._at(value, chosen).with_held(self._at(first, held))

        return self._estimate(self.whole.only(chosen).with_held(self.whole.only(held)), at)

    def _at(self, value: float, chosen: Sequence[int]) -> Likelihood:
        """Likelihood of some of the loads at one value."""
        shear = None if self.shear is None else self.shear.at(value).only(chosen)
        return likelihood(self.channel.at(value).only(chosen), shear)

    def coefficient_of_maximum(self, profile: MeasuredProfile, index: int) -> BoundedEstimate:
        """Return the coefficient that explains the measured maximum of one load."""
        a = self.channel.sensor.conversion_constant
        noise = a * random_uncertainty(profile.maximum_budget)
        top = points_at(np.zeros(1), self.channel.points[index], a * profile.maximum, noise)

        def at(channel: Channel) -> Likelihood:
            return likelihood(replace(channel.only([index]), points=[top]))

        return self._estimate(at(self.fine), lambda value: at(self.channel.at(value)))

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
            # The coordinate's derivative by the coefficient, turned over.
            stretch = family.scale / (1 - bounded(estimate.value, family.scale)) ** 2
            shares = at(estimate.value).budget()
            budget = {source: float(stretch * share) for source, share in shares.items()}
        degrees = max(sum(load.degrees for load in along.loads) - 1, 0)
        least = max(estimate.least, 0.0)
        p_value = float(chdtrc(max(degrees, 1), least))
        return replace(estimate, least=least, budget=budget, degrees=degrees, p_value=p_value)


def fit_friction(channel: Channel, shear: Channel | None = None) -> FrictionFit:
    """Hold the measured loads of a channel, or of two, against calculated contacts."""
    values = fine_values(channel.family)
    fine = channel.at(values)
    whole = likelihood(fine, None if shear is None else shear.at(values))
    return FrictionFit(channel, shear, fine, whole)


def fine_values(family: ProfileFamily) -> FloatArray:
    """Return values along a family, even in its bounded coordinate, its own among them."""
    nodes = family.coordinates
    even = np.linspace(nodes[0], nodes[-1], _FINE)
    apart = np.abs(np.subtract.outer(even, nodes)).min(axis=1) > 0.2 * (even[1] - even[0])
    # The family's own values are kept as they are, not as their coordinates give them back.
    return np.sort(np.concatenate([family.values, unbounded(even[apart], family.scale)]))


def random_uncertainty(budget: Mapping[str, float]) -> float:
    """Return what noise, centre and baseline add to a measured maximum."""
    return math.hypot(*(u for source, u in budget.items() if source not in _SYSTEMATIC))


def with_loading(by_loading: Mapping[str, BoundedEstimate]) -> dict[str, BoundedEstimate]:
    """Add the standard uncertainty of a rectangle between both loadings, width / sqrt(12)."""
    values = [estimate.value for estimate in by_loading.values() if estimate.value is not None]
    if len(values) < 2:
        return dict(by_loading)
    apart = abs(values[0] - values[1]) / math.sqrt(12)
    return {
        loading: replace(estimate, budget={**estimate.budget, "loading": apart})
        for loading, estimate in by_loading.items()
    }


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
    calculated = blurred.signal / sensor.conversion_constant
    errors = np.sqrt(variance) / sensor.conversion_constant
    p0_max = float(calculated[0, -1])
    # Measured over calculated maximum: A and G err together.
    on_axis = predict(points_at(np.zeros(1), points), sensor, family, index)
    changes = [column[0, 0] for column in on_axis.columns.values()]
    systematic = float(np.linalg.norm(np.concatenate(changes))) / float(on_axis.signal[0, 0])
    random = random_uncertainty(profile.maximum_budget) / profile.maximum
    ratio = profile.maximum / p0_max
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
        p0_max=p0_max,
        p0_max_uncertainty=float(errors[0, -1]),
        ratio=ratio,
        ratio_uncertainty=math.hypot(systematic, random) * ratio,
        calculated=calculated[:, :-1],
        calculated_errors=errors[:, :-1],
        p_max=calculated[:, -1],
        chi_square=chi_square,
        deviance=deviance[nodes] - deviance.min(),
        p_values=np.asarray(chdtrc(points.degrees, chi_square)),
        degrees=points.degrees,
        bracketed=bracketed_share(
            profile.s_zz, profile.s_zz_errors, calculated[:, :-1], errors[:, :-1]
        ),
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
