"""Calculated contacts of the loads that were measured, for each law of the interface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from memscal.friction.amontons import amontons_family
from memscal.friction.cache import CacheFolder
from memscal.friction.compliant import elasto_plastic_family, normal_compliance_family
from memscal.friction.family import ProfileFamily
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.measurement.measured_stress import MeasuredProfile

__all__ = ["LawFamilies"]

#: Stresses are calculated out to this multiple of the largest distance from the centre.
_REACH = 1.1


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
        scan = profiles[0].part.scan
        self.film: ElasticFilm = scan.film
        self.indenter: Indenter = scan.indenter
        self.reach = _REACH * max(float(profile.r[-1]) for profile in profiles)
        self.cache, self.workers = cache, workers

    def rigid(
        self, profiles: Sequence[MeasuredProfile], known: ProfileFamily | None
    ) -> ProfileFamily:
        """Return incremental contacts of Amontons' law, from those that are known if they do."""
        loads = _loads(profiles)
        if known is None or not np.isin(loads, known.loads).all():
            known = amontons_family(
                self.film,
                self.indenter,
                np.unique(loads),
                reach=self.reach,
                cache=self.cache,
                workers=self.workers,
            )
        return _at_loads(known, loads)

    def slipping(
        self, profiles: Sequence[MeasuredProfile], friction: float, uncertainty: float | None
    ) -> ProfileFamily:
        """Return contacts of the elasto-plastic law at a macroscopic coefficient.

        The difference to those at one standard uncertainty more is the change named
        ``"macroscopic_friction"``.
        """

        def family(film: ElasticFilm, mu: float) -> ProfileFamily:
            return elasto_plastic_family(
                film,
                self.indenter,
                np.unique(_loads(profiles)),
                friction=mu,
                reach=self.reach,
                cache=self.cache,
                workers=self.workers,
            )

        found = family(self.film, friction)
        if uncertainty is not None:
            # Only its stresses are wanted: without uncertainties it takes a third of the time.
            bare = replace(
                self.film,
                young_modulus_uncertainty=None,
                thickness_uncertainty=None,
                poisson_ratio_uncertainty=None,
            )
            change = family(bare, friction + uncertainty).spectra - found.spectra
            found = replace(found, changes={**found.changes, "macroscopic_friction": change})
        return _at_loads(found, _loads(profiles))

    def yielding(self, profiles: Sequence[MeasuredProfile]) -> ProfileFamily:
        """Return contacts without friction that yield normally."""
        found = normal_compliance_family(
            self.film,
            self.indenter,
            np.unique(_loads(profiles)),
            reach=self.reach,
            cache=self.cache,
            workers=self.workers,
        )
        return _at_loads(found, _loads(profiles))


def _loads(profiles: Sequence[MeasuredProfile]) -> FloatArray:
    return np.array([profile.load for profile in profiles])


def _at_loads(family: ProfileFamily, loads: FloatArray) -> ProfileFamily:
    places = [int(np.flatnonzero(family.loads == load)[0]) for load in loads]
    return family.only(places)
