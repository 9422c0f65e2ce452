"""Calculated contacts of the loads that were measured, for each law of the interface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from memscal.friction.amontons import amontons_family
from memscal.friction.cache import CacheFolder
from memscal.friction.compliant import elasto_plastic_family, normal_compliance_family
from memscal.friction.family import ProfileFamily
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

__all__ = ["LawFamilies", "at_loads"]

#: Stresses are calculated out to this multiple of the largest distance from the centre.
_REACH = 1.1
#: Loads are near whose logarithms differ by less: stresses are linear between to 2e-5.
_NEAR = 0.01


class LawFamilies:
    """Families of calculated contacts of what was measured, each at its profiles' loads.

    Parameters
    ----------
    profiles : sequence of MeasuredProfile
        Measured loads of one sphere on one film.
    cache, workers
        As for :func:`memscal.friction.amontons.amontons_family`.
    """

    def __init__(
        self, profiles: Sequence[MeasuredProfile], cache: CacheFolder, workers: int
    ) -> None:
        scan = profiles[0].scan
        self.film: ElasticFilm = scan.film
        self.indenter: Indenter = scan.indenter
        self.reach = _REACH * max(float(profile.r[-1]) for profile in profiles)
        self.cache, self.workers = cache, workers

    def rigid(
        self, profiles: Sequence[MeasuredProfile], known: ProfileFamily | None
    ) -> ProfileFamily:
        """Return incremental contacts of Amontons' law: those that are known, where they do."""
        if known is not None and known.values[0] == 0 and math.isinf(known.values[-1]):
            found = at_loads(known, _loads(profiles))
            if found is not None:
                return found
        made = amontons_family(self.film, self.indenter, _distinct(profiles), **self._how)
        return _required(at_loads(made, _loads(profiles)))

    def slipping(
        self,
        profiles: Sequence[MeasuredProfile],
        friction: float,
        uncertainty: float | None,
        known: ProfileFamily | None,
    ) -> ProfileFamily:
        """Return contacts of the elasto-plastic law at a macroscopic coefficient.

        The difference to those at one standard uncertainty more is the change named
        ``"macroscopic_friction"``.
        """
        loads = _loads(profiles)
        found = None if known is None else at_loads(known, loads)
        if found is not None:
            return found

        def family(film: ElasticFilm, mu: float) -> ProfileFamily:
            return elasto_plastic_family(
                film, self.indenter, _distinct(profiles), friction=mu, **self._how
            )

        made = family(self.film, friction)
        if uncertainty is not None:
            # Only its stresses are wanted: without uncertainties it takes a third of the time.
            bare = replace(
                self.film,
                young_modulus_uncertainty=None,
                thickness_uncertainty=None,
                poisson_ratio_uncertainty=None,
            )
            change = family(bare, friction + uncertainty).spectra - made.spectra
            made = replace(made, changes={**made.changes, "macroscopic_friction": change})
        return _required(at_loads(made, loads))

    def yielding(
        self, profiles: Sequence[MeasuredProfile], known: ProfileFamily | None
    ) -> ProfileFamily:
        """Return contacts without friction that yield normally."""
        found = None if known is None else at_loads(known, _loads(profiles))
        if found is not None:
            return found
        made = normal_compliance_family(self.film, self.indenter, _distinct(profiles), **self._how)
        return _required(at_loads(made, _loads(profiles)))

    @property
    def _how(self) -> dict[str, Any]:
        return {"reach": self.reach, "cache": self.cache, "workers": self.workers}


def at_loads(family: ProfileFamily, loads: FloatArray) -> ProfileFamily | None:
    """Return a family at the nearest of its loads; ``None`` where one is not near enough.

    What is left of a difference is in the points' own loads, to first order.
    """
    apart = np.abs(np.log(np.divide.outer(loads, family.loads)))
    if np.any(apart.min(axis=1) > _NEAR):
        return None
    return family.only(apart.argmin(axis=1).tolist())


def _required(family: ProfileFamily | None) -> ProfileFamily:
    assert family is not None
    return family


def _loads(profiles: Sequence[MeasuredProfile]) -> FloatArray:
    return np.array([profile.load for profile in profiles])


def _distinct(profiles: Sequence[MeasuredProfile]) -> FloatArray:
    """Return the loads that are not near to a smaller one."""
    found: list[float] = []
    for load in sorted(profile.load for profile in profiles):
        if not found or math.log(load / found[-1]) > _NEAR:
            found.append(load)
    return np.array(found)
