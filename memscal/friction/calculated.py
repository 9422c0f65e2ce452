"""Families of base stresses of a sphere on a film, calculated here, or elsewhere as tables."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import InputError
from memscal.friction.family import FamilySetup, ProfileFamily, parameter_values, require_loads
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.stress import StressProfile

FRICTIONS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, math.inf)
"""Friction coefficients between which profiles are interpolated to 1e-3 of their maximum."""


def amontons_family(
    film: ElasticFilm,
    indenter: Sphere,
    loads: ArrayLike,  # (L,), in N
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str = "incremental",
    derivatives: bool = True,
    **options: Any,  # reach, cache, workers and order of FamilySetup; so in the next functions
) -> ProfileFamily:
    """Return the base stresses of a sphere on a film for a range of friction coefficients."""
    setup = FamilySetup(film, indenter, loads, **options)
    values = parameter_values("friction coefficients", friction)
    if loading not in ("incremental", "total"):
        raise InputError(f'loading is {loading!r}, but it is "incremental" or "total".')
    paths = [setup.path(friction=mu, loading=loading, derivatives=derivatives) for mu in values]
    return setup.family(paths, name="amontons", loading=loading, values=values)


#: Loads that differ by no more, relatively, are one; the stress is scaled in proportion.
_SAME_LOAD = 0.01
#: A table must have decayed to this share of its maximum where it ends.
_DECAYED = 1e-3
#: A table's force must be its load but for this share.
_CARRIES = 0.05
_Table = tuple[float, StressProfile]  # with its friction coefficient first


def external_family(
    profiles: Sequence[StressProfile],
    loads: ArrayLike,
    *,
    film: ElasticFilm,
    indenter: Sphere,
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
        raise InputError(
            "Some of the tables are for incremental loading and some for total loading.",
            why="A family holds one loading.",
            cure="Give the tables of one loading at a time.",
        )
    loading = "".join(loadings)
    frictions = np.array(sorted({mu for mu, _ in tables}))
    grid = _grid(tables, frictions, nominal)
    solved = amontons_family(
        film,
        indenter,
        nominal,
        friction=frictions.tolist(),
        loading=loading or "incremental",
        reach=reach,
        **options,
    )
    k = solved.wavenumbers.k
    spectra = []
    for row in grid:
        members = [
            load / cell.load * hankel_transform(cell.r, cell.sigma_zz, k)
            for load, cell in zip(nominal, row, strict=True)
        ]
        spectra.append(members)

    def numbers(name: str) -> FloatArray:
        """Numbers of all tables, not a number where one is not stated."""
        return np.array([[getattr(cell, name) for cell in row] for row in grid], np.float64)

    return replace(
        solved,
        name="external",
        loading=loading,
        spectra=np.array(spectra),
        # What the tables have beside the contacts solved here counts as proportional to the load.
        by_load=solved.by_load + (spectra - solved.spectra),
        depths=numbers("depth"),
        contact_radii=numbers("contact_radius"),
        convergence=numbers("convergence"),
        notes=("Sensitivities are those of the contacts that memscal calculates.",),
    )


def _grid(
    tables: Sequence[_Table], frictions: FloatArray, loads: FloatArray
) -> list[list[StressProfile]]:
    """Return the table of each friction coefficient and load; name all that are missing."""
    grid = []
    missing = []
    for mu in frictions.tolist():
        row = []
        for load in loads.tolist():
            nearest = _nearest(tables, mu, load)
            if nearest:
                row.append(nearest)
            else:
                missing.append(f"{load:g} N with friction {mu:g}")
        grid.append(row)
    if missing:
        stated = ", ".join(f"{load:g}" for load in sorted({table.load for _, table in tables}))
        raise InputError(
            f"No table was given for {'; '.join(missing)}.",
            why=f"The tables are for {stated} N; a load must be within {_SAME_LOAD:.0%} of one of "
            "them, because a sphere's stress is not proportional to its load.",
            cure="Calculate the missing ones, or leave out the friction coefficients or loads "
            "that lack them.",
        )
    return grid


def _nearest(tables: Sequence[_Table], mu: float, load: float) -> StressProfile | None:
    """Return the table of a friction coefficient whose load is nearest, and near enough."""
    near = [
        profile
        for friction, profile in tables
        if friction == mu and abs(profile.load / load - 1) <= _SAME_LOAD
    ]
    near.sort(key=lambda profile: abs(profile.load - load))
    if len(near) > 1 and near[0].load == near[1].load:
        raise InputError(
            f"{_name(near[0])} and {_name(near[1])} are both for {near[0].load:g} N with friction "
            f"{mu:g}.",
            cure="Give each load and friction coefficient once.",
        )
    return near[0] if near else None


def _checked_friction(profile: StressProfile, reach: float) -> float:
    """Return the friction coefficient of a table; refuse one that is no whole stress."""
    if profile.friction_coefficient is None:
        raise InputError(
            f"{_name(profile)} does not say its friction coefficient.",
            cure="State it when the table is imported (--friction).",
        )
    size = abs(profile.sigma_zz)
    tail = size[-1] / size.max()
    if profile.r[-1] < reach and tail > _DECAYED:
        end = profile.r[-1] * 1e3
        raise InputError(
            f"{_name(profile)} ends at r = {end:.4g} mm with {tail:.1%} of its "
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
    return profile.friction_coefficient


def _name(profile: StressProfile) -> str:
    """Name a table by its file, or by its load."""
    return profile.source.file_name if profile.source else f"A table for {profile.load:g} N"
