"""Families of base stresses of a sphere on a film, calculated here, or elsewhere as tables."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import InputError
from memscal.formats.cache import CacheFolder
from memscal.friction.family import (
    FRICTION_SCALE,
    STRONGER,
    FamilySetup,
    ProfileFamily,
    base_wavenumbers,
    parameter_values,
    require_loads,
)
from memscal.mechanics.interface import ExponentialCompliance, GreenwoodTripp, Interface
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.measured_stress import MeasuredProfile
from memscal.model.stress import StressProfile

FRICTIONS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, math.inf)
"""Friction coefficients between which profiles are interpolated to 1e-3 of their maximum."""


def amontons_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,  # (L,), in N
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str = "incremental",
    **options: Any,  # reach, cache, workers and order of FamilySetup; so in the next functions
) -> ProfileFamily:
    """Return the base stresses of a sphere on a film for a range of friction coefficients."""
    setup = FamilySetup(film, indenter, loads, **options)
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
    **options: Any,
) -> ProfileFamily:
    """Return the base stresses without friction for a range of lengths (m) of a normal law."""
    setup = FamilySetup(film, indenter, loads, **options)
    if law not in ("exponential", "greenwood-tripp"):
        raise InputError(f'law is {law!r}, but it is "exponential" or "greenwood-tripp".')
    if lengths is None:
        lengths = [share * (film.roughness_rms or _USUAL_ROUGHNESS) for share in _LENGTHS]
    values = parameter_values("lengths of the normal compliance", lengths)
    if math.isinf(values[-1]):
        problem = "A length of the normal compliance is infinite: such a film bears no load."
        raise InputError(problem)
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


def contacts_of(
    profiles: Sequence[MeasuredProfile], cache: CacheFolder, workers: int
) -> dict[str, Any]:
    """Return film, indenter and options by which contacts of what was measured are calculated."""
    scan = profiles[0].scan
    reach = _REACH * max(float(profile.r[-1]) for profile in profiles)
    contacts = {"film": scan.film, "indenter": scan.indenter, "reach": reach}
    return contacts | {"cache": cache, "workers": workers}


def slipping_family(friction: float, uncertainty: float | None, **contacts: Any) -> ProfileFamily:
    """Return the elasto-plastic family at a macroscopic coefficient that may be uncertain."""
    made = elasto_plastic_family(friction=friction, **contacts)
    if uncertainty is None:
        return made
    # Only its stresses count: without uncertainties it takes a third of the time.
    names = ("young_modulus", "thickness", "poisson_ratio")
    exact: Any = dict.fromkeys((f"{name}_uncertainty" for name in names), None)
    contacts["film"] = replace(contacts["film"], **exact)
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
        return np.asarray(np.abs(np.log(np.divide.outer(loads, family.loads))))

    if calculated is None or np.any(apart(calculated).min(axis=1) > _NEAR):
        distinct: list[float] = []
        for load in sorted(loads.tolist()):
            if not distinct or math.log(load / distinct[-1]) > _NEAR:
                distinct.append(load)
        calculated = calculate(loads=np.array(distinct))
    # What is left of a difference is in the points' own loads, to first order.
    return calculated.only(apart(calculated).argmin(axis=1).tolist())


#: Loads that differ by no more, relatively, are one; the stress is scaled in proportion.
_SAME_LOAD = 0.01
#: A table must have decayed to this share of its maximum where it ends.
_DECAYED = 1e-3
#: A table's force must be its load but for this share.
_CARRIES = 0.05
#: Missing tables that an error names.
_MOST_NAMED = 6
_Table = tuple[float, StressProfile]  # with its friction coefficient first


def external_family(
    profiles: Sequence[StressProfile],
    loads: ArrayLike,
    *,
    film: ElasticFilm,
    indenter: Indenter,
    reach: float,
    **options: Any,
) -> ProfileFamily:
    """Return base stresses of tables by friction; each serves loads within 1 % of its own."""
    nominal = require_loads(loads)
    tables = [(_checked_friction(profile, reach), profile) for profile in profiles]
    if not tables:
        raise InputError("No table of a calculated stress was given.")
    loadings = {profile.loading for mu, profile in tables if profile.loading and mu > 0}
    if len(loadings) > 1:
        problem = "Some of the tables are for incremental loading and some for total loading."
        why = "A family holds one loading."
        raise InputError(problem, why=why, cure="Give the tables of one loading at a time.")
    loading = "".join(loadings)
    frictions = np.array(sorted({mu for mu, _ in tables}))
    grid = _grid(tables, frictions, nominal)
    nodes = base_wavenumbers(film.thickness, reach)
    spectra = np.array(
        [[hankel_transform(cell.r, cell.sigma_zz, nodes.k) for cell in row] for row in grid]
    )
    spectra *= (nominal / np.array([[cell.load for cell in row] for row in grid]))[:, :, None]
    law: dict[str, Any] = {"friction": frictions.tolist(), "loading": loading or "incremental"}
    ours = amontons_family(film, indenter, nominal, reach=reach, **law, **options)
    return ProfileFamily(
        name="external",
        loading=loading,
        wavenumbers=nodes,
        loads=nominal,
        values=frictions,
        scale=FRICTION_SCALE,
        spectra=spectra,
        # What the tables have beside the contacts solved here counts as proportional to the load.
        by_load=ours.by_load + (spectra - ours.spectra),
        changes=ours.changes,
        depths=_numbers(grid, "depth"),
        contact_radii=_numbers(grid, "contact_radius"),
        convergence=_numbers(grid, "convergence"),
        notes=("Sensitivities are those of the contacts that memscal calculates.",),
    )


def _grid(
    tables: Sequence[_Table], frictions: FloatArray, loads: FloatArray
) -> list[list[StressProfile]]:
    """Return the table of each friction coefficient and load; name all that are missing."""
    grid = []
    missing = []
    for mu in frictions:
        row = [_nearest(tables, float(mu), float(load)) for load in loads]
        absent = (load for load, cell in zip(loads, row, strict=True) if cell is None)
        missing += [f"{load:g} N with friction {mu:g}" for load in absent]
        grid.append([cell for cell in row if cell is not None])
    if missing:
        stated = sorted({profile.load for _, profile in tables})
        more = len(missing) - _MOST_NAMED
        listed = missing[:_MOST_NAMED] + [f"and {more} more"] * (more > 0)
        raise InputError(
            f"No table was given for {'; '.join(listed)}.",
            why=f"The tables are for {', '.join(f'{load:g}' for load in stated)} N; a load must be "
            f"within {_SAME_LOAD:.0%} of one of them, because a sphere's stress is not "
            "proportional to its load.",
            cure="Calculate the missing ones, or leave out the friction coefficients or loads "
            "that lack them.",
        )
    return grid


def _nearest(tables: Sequence[_Table], mu: float, load: float) -> StressProfile | None:
    near = [p for of, p in tables if of == mu and abs(p.load / load - 1) <= _SAME_LOAD]
    near.sort(key=lambda profile: abs(profile.load - load))
    if len(near) > 1 and near[0].load == near[1].load:
        raise InputError(
            f"{_name(near[0])} and {_name(near[1])} are both for {near[0].load:g} N with friction "
            f"{mu:g}.",
            cure="Give each load and friction coefficient once.",
        )
    return near[0] if near else None


def _checked_friction(profile: StressProfile, reach: float) -> float:
    if profile.friction_coefficient is None:
        problem = f"{_name(profile)} does not say its friction coefficient."
        raise InputError(problem, cure="State it when the table is imported (--friction).")
    tail = abs(float(profile.sigma_zz[-1])) / float(np.abs(profile.sigma_zz).max())
    if profile.r[-1] < reach and tail > _DECAYED:
        raise InputError(
            f"{_name(profile)} ends at r = {profile.r[-1] * 1e3:.4g} mm with {tail:.1%} of its "
            f"maximum left, but stresses are needed out to {reach * 1e3:.4g} mm.",
            cure="Extend the table to where the stress has decayed.",
        )
    if abs(profile.force / profile.load - 1) > _CARRIES:
        raise InputError(
            f"The stress in {_name(profile)} carries {profile.force:.4g} N, but its load is "
            f"{profile.load:g} N.",
            why="The force that the base carries must be the load.",
            cure="Check the load, the units, and that the table is fine enough.",
        )
    return float(profile.friction_coefficient)


def _name(profile: StressProfile) -> str:
    return profile.source.file_name if profile.source else f"A table for {profile.load:g} N"


def _numbers(grid: Sequence[Sequence[StressProfile]], name: str) -> FloatArray:
    return np.array([[getattr(cell, name) for cell in row] for row in grid], dtype=np.float64)
