"""The effective friction coefficient, by the whole profile and by its maximum."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc

from memscal.friction.family import ProfileFamily
from memscal.friction.interval import profiled, reason_of
from memscal.friction.likelihood import Likelihood, likelihood
from memscal.friction.load_points import LoadPoints, single_point
from memscal.friction.predicted import Members, Sensor, members_of
from memscal.friction.results import EffectiveFriction
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

__all__ = ["Confrontation", "confront", "fine_values", "random_uncertainty", "with_loading"]

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
