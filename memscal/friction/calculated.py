"""Families of base stresses of a sphere on a film, along friction coefficient or length."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.formats.cache import CacheFolder
from memscal.friction.family import STRONGER, FamilySetup, ProfileFamily, parameter_values
from memscal.mechanics.interface import ExponentialCompliance, GreenwoodTripp, Interface
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.measured_stress import MeasuredProfile

FRICTIONS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, math.inf)
"""Friction coefficients between which profiles are interpolated to 1e-3 of their maximum."""


def amontons_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,  # (L,), in N
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str = "incremental",
    reach: float,  # largest distance from the axis at which stresses will be asked for, in m
    cache: CacheFolder = None,
    workers: int = 1,
    order: int = 0,  # one for the shear at the base
) -> ProfileFamily:
    """Return the base stresses of a sphere on a film for a range of friction coefficients."""
    setup = FamilySetup.of(
        film, indenter, loads, reach=reach, cache=cache, workers=workers, order=order
    )
    values = parameter_values("friction coefficients", friction)
    if loading not in ("incremental", "total"):
        raise InputError(f'loading is {loading!r}, but it is "incremental" or "total".')
    paths = [setup.path(friction=float(mu), loading=loading) for mu in values]
    return setup.family(paths, name="amontons", loading=loading, values=values)


SLIP_LENGTHS = (0.0, 0.15e-6, 0.5e-6, 1.5e-6, 4e-6, 1e-5, 3e-5, 1e-4, 4e-4, math.inf)
"""Slip lengths in m, from the rigid interface to the one that bears no shear."""

#: Lengths of a normally compliant interface in units of the film's roughness.
_LENGTHS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0)
#: Roughness in m where a film states none.
_USUAL_ROUGHNESS = 2e-6
#: Greenwood and Tripp's surfaces: asperity density times radius times roughness, and the ratio
#: of radius and roughness.
_ASPERITIES = 0.05
_SLENDERNESS = 100.0
#: Pressure at which mean planes meet, in units of the contact's modulus (exponential law): so
#: light that no contact rests above them, and no depth is zero.
_MEETING = 1e-6


def elasto_plastic_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,
    *,
    friction: float,
    slip_lengths: Sequence[float] = SLIP_LENGTHS,
    reach: float,
    cache: CacheFolder = None,
    workers: int = 1,
) -> ProfileFamily:
    """Return incremental base stresses for slip lengths (m), from 0 (rigid) to inf (no shear)."""
    setup = FamilySetup.of(film, indenter, loads, reach=reach, cache=cache, workers=workers)
    values = parameter_values("slip lengths", slip_lengths)
    if not 0 < friction < math.inf:
        raise InputError(
            f"The macroscopic friction coefficient is {friction:g}.",
            why="A slip length says at which displacement the shear reaches friction times "
            "pressure: without friction, or with an unlimited one, it has no effect.",
            cure="Give the coefficient at which the indenter slides, such as 1.6.",
        )
    paths = [
        setup.path(friction=0.0)
        if math.isinf(length)
        else setup.path(friction=float(friction), interface=Interface(slip_length=float(length)))
        for length in values
    ]
    return setup.family(
        paths,
        name="elasto-plastic",
        loading="incremental",
        values=values,
        a_length=True,
        notes=(f"Macroscopic friction coefficient {friction:g}.",),
    )


def normal_compliance_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,
    *,
    lengths: Sequence[float] | None = None,
    law: str = "exponential",
    reach: float,
    cache: CacheFolder = None,
    workers: int = 1,
) -> ProfileFamily:
    r"""Return the base stresses without friction for a range of lengths (m) of a normal law.

    ``"exponential"``: :math:`p = p_1 e^{-d/\lambda}` with the length :math:`\lambda`; the pressure
    :math:`p_1` only shifts the depth.  ``"greenwood-tripp"``: asperities of the roughness
    :math:`\sigma`, with :math:`\eta\beta\sigma = 0.05` and :math:`\beta/\sigma = 100`.
    """
    setup = FamilySetup.of(film, indenter, loads, reach=reach, cache=cache, workers=workers)
    if law not in ("exponential", "greenwood-tripp"):
        raise InputError(f'law is {law!r}, but it is "exponential" or "greenwood-tripp".')
    if lengths is None:
        unit = film.roughness_rms or _USUAL_ROUGHNESS
        lengths = [share * unit for share in _LENGTHS]
    values = parameter_values("lengths of the normal compliance", lengths)
    if math.isinf(values[-1]):
        raise InputError(
            "A length of the normal compliance is infinite: such a film bears no load."
        )
    paths, stronger = (
        [setup.path(friction=0.0, interface=_normal(law, film, float(v), s)) for v in values]
        for s in (1.0, STRONGER)
    )
    return setup.family(
        paths,
        name="normal-compliance",
        loading="",
        values=values,
        a_length=True,
        stronger=stronger if law == "greenwood-tripp" else None,
        notes=(_NORMAL_NOTES[law],),
    )


_NORMAL_NOTES = {
    "exponential": "Exponential law; the length is free.  Depths count from a pressure of "
    f"{_MEETING:g} times the contact modulus; the base stress does not depend on it.",
    "greenwood-tripp": "Greenwood-Tripp law; the roughness is free, density times radius times "
    f"roughness is {_ASPERITIES:g}, and the radius is {_SLENDERNESS:g} times the roughness.",
}


def _normal(law: str, film: ElasticFilm, length: float, strength: float) -> Interface:
    if length == 0:
        return Interface()
    if law == "exponential":
        meeting = _MEETING * film.contact_modulus
        exponential = ExponentialCompliance(decay_length=length, reference_pressure=meeting)
        return Interface(normal=exponential)
    radius = _SLENDERNESS * length
    density = strength * _ASPERITIES / (radius * length)
    return Interface(
        normal=GreenwoodTripp(roughness=length, asperity_density=density, asperity_radius=radius)
    )


#: Stresses are calculated out to this multiple of the largest distance from the centre.
_REACH = 1.1
#: Loads are near whose logarithms differ by less: stresses are linear between to 2e-5.
_NEAR = 0.01


class LawFamilies:
    """Families of calculated contacts of what was measured, each at its profiles' loads."""

    def __init__(
        self, profiles: Sequence[MeasuredProfile], cache: CacheFolder, workers: int
    ) -> None:
        self.film: ElasticFilm = profiles[0].scan.film
        self.indenter: Indenter = profiles[0].scan.indenter
        reach = _REACH * max(float(profile.r[-1]) for profile in profiles)
        self._how: dict[str, Any] = {"reach": reach, "cache": cache, "workers": workers}

    def rigid(
        self, profiles: Sequence[MeasuredProfile], calculated: ProfileFamily | None
    ) -> ProfileFamily:
        """Return incremental contacts of Amontons' law, from no friction to full stick."""
        if calculated is not None and tuple(calculated.values[[0, -1]]) != (0.0, math.inf):
            calculated = None
        family = partial(amontons_family, self.film, self.indenter, **self._how)
        return _at_loads(profiles, calculated, family)

    def slipping(
        self,
        profiles: Sequence[MeasuredProfile],
        friction: float,
        uncertainty: float | None,
        calculated: ProfileFamily | None,
    ) -> ProfileFamily:
        """Return contacts of the elasto-plastic law at a macroscopic coefficient."""

        def family(loads: FloatArray) -> ProfileFamily:
            how = {"indenter": self.indenter, "loads": loads, **self._how}
            made = elasto_plastic_family(self.film, friction=friction, **how)
            if uncertainty is None:
                return made
            # Only its stresses count: without uncertainties it takes a third of the time.
            bare = replace(
                self.film,
                young_modulus_uncertainty=None,
                thickness_uncertainty=None,
                poisson_ratio_uncertainty=None,
            )
            more = elasto_plastic_family(bare, friction=friction + uncertainty, **how)
            change = more.spectra - made.spectra
            return replace(made, changes={**made.changes, "macroscopic_friction": change})

        return _at_loads(profiles, calculated, family)

    def yielding(
        self, profiles: Sequence[MeasuredProfile], calculated: ProfileFamily | None
    ) -> ProfileFamily:
        """Return contacts without friction that yield normally."""
        family = partial(normal_compliance_family, self.film, self.indenter, **self._how)
        return _at_loads(profiles, calculated, family)


def _at_loads(
    profiles: Sequence[MeasuredProfile],
    calculated: ProfileFamily | None,
    calculate: Callable[[FloatArray], ProfileFamily],
) -> ProfileFamily:
    """Return a family at the nearest of its loads; calculate it where one is not near enough."""
    loads = np.array([profile.load for profile in profiles])

    def apart(family: ProfileFamily) -> FloatArray:
        return np.asarray(np.abs(np.log(np.divide.outer(loads, family.loads))))

    if calculated is None or np.any(apart(calculated).min(axis=1) > _NEAR):
        distinct: list[float] = []
        for load in sorted(loads.tolist()):
            if not distinct or math.log(load / distinct[-1]) > _NEAR:
                distinct.append(load)
        calculated = calculate(np.array(distinct))
    # What is left of a difference is in the points' own loads, to first order.
    return calculated.only(apart(calculated).argmin(axis=1).tolist())
