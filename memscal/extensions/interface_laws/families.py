"""Contacts of a sphere whose interface yields, along a length of its law."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.friction.family import FamilySetup, ProfileFamily, parameter_values
from memscal.mechanics.interface import ExponentialCompliance, Interface
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.measured_stress import MeasuredProfile

SLIP_LENGTHS = (0.0, 0.15e-6, 0.5e-6, 1.5e-6, 4e-6, 1e-5, 3e-5, 1e-4, 4e-4, math.inf)
"""Slip lengths in m, from the rigid interface to the one that bears no shear."""

#: Lengths of a normally compliant interface in units of the film's roughness.
_LENGTHS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0)
#: Roughness in m where a film states none.
_USUAL_ROUGHNESS = 2e-6
#: Pressure at which mean planes meet, in units of the contact's modulus: so
#: light that no contact rests above them, and no depth is zero.
_MEETING = 1e-6


def elasto_plastic_family(
    film: ElasticFilm,
    indenter: Sphere,
    loads: ArrayLike,
    *,
    friction: float,
    slip_lengths: Sequence[float] = SLIP_LENGTHS,
    **options: Any,
) -> ProfileFamily:
    """Return incremental base stresses for slip lengths (m), from 0 (rigid) to inf (no shear)."""
    setup = FamilySetup(film, indenter, loads, **options)
    values = parameter_values("slip lengths", slip_lengths)
    if not 0 < friction < math.inf:
        raise InputError(
            f"The macroscopic friction coefficient is {friction:g}.",
            why="A slip length says at which displacement the shear reaches friction times "
            "pressure: without friction, or with an unlimited one, it has no effect.",
            cure="Give the coefficient at which the indenter slides, such as 1.6.",
        )
    paths = []
    for length in values:
        if math.isinf(length):
            paths.append(setup.path(friction=0.0))
        else:
            interface = Interface(slip_length=length)
            paths.append(setup.path(friction=float(friction), interface=interface))
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
    indenter: Sphere,
    loads: ArrayLike,
    *,
    lengths: Sequence[float] | None = None,
    **options: Any,
) -> ProfileFamily:
    """Return base stresses without friction for a range of lengths (m) of an exponential law."""
    setup = FamilySetup(film, indenter, loads, **options)
    if lengths is None:
        lengths = [share * (film.roughness_rms or _USUAL_ROUGHNESS) for share in _LENGTHS]
    values = parameter_values("lengths of the normal compliance", lengths)
    if math.isinf(values[-1]):
        raise InputError(
            "A length of the normal compliance is infinite: such a film bears no load."
        )
    paths = []
    for length in values:
        interface = Interface()
        if length > 0:
            meeting = _MEETING * film.contact_modulus
            normal = ExponentialCompliance(decay_length=length, reference_pressure=meeting)
            interface = Interface(normal=normal)
        paths.append(setup.path(friction=0.0, interface=interface))
    note = (
        "Exponential law; the length is free.  Depths count from a pressure of "
        f"{_MEETING:g} times the contact modulus; the base stress does not depend on it."
    )
    return setup.family(
        paths, name="normal-compliance", loading="", values=values, a_length=True, notes=(note,)
    )


#: Loads are near whose logarithms differ by less: stresses are linear between to 2e-5.
_NEAR = 0.01


def slipping_family(friction: float, uncertainty: float | None, **contacts: Any) -> ProfileFamily:
    """Return the elasto-plastic family at a macroscopic coefficient that may be uncertain."""
    made = elasto_plastic_family(friction=friction, **contacts)
    if uncertainty is None:
        return made
    # Only its stresses count: without uncertainties it takes a third of the time.
    contacts["film"] = replace(
        contacts["film"],
        young_modulus_uncertainty=None,
        thickness_uncertainty=None,
        poisson_ratio_uncertainty=None,
    )
    more = elasto_plastic_family(friction=friction + uncertainty, **contacts)
    changes = {**made.changes, "macroscopic_friction": more.spectra - made.spectra}
    return replace(made, changes=changes)


def family_at_loads(
    profiles: Sequence[MeasuredProfile],
    calculated: ProfileFamily | None,
    calculate: Callable[..., ProfileFamily],
) -> ProfileFamily:
    """Return a family at the nearest of its loads; calculate it where one is not near enough."""
    loads = np.array([profile.load for profile in profiles])

    def apart(family: ProfileFamily) -> FloatArray:
        """Distances of logarithms of the loads, (profiles, loads of the family)."""
        return np.asarray(np.abs(np.log(np.divide.outer(loads, family.loads))))

    if calculated is None or np.any(apart(calculated).min(axis=1) > _NEAR):
        distinct: list[float] = []
        for load in sorted(loads.tolist()):
            if not distinct or math.log(load / distinct[-1]) > _NEAR:
                distinct.append(load)
        calculated = calculate(loads=np.array(distinct))
    # What is left of a difference is in the points' own loads, to first order.
    return calculated.only(apart(calculated).argmin(axis=1).tolist())
