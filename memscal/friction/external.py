"""Families of base stresses that were calculated elsewhere: finite-element tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import InputError
from memscal.formats.cache import CacheFolder
from memscal.friction.calculated import amontons_family
from memscal.friction.family import FRICTION_SCALE, ProfileFamily, base_wavenumbers, require_loads
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Sphere
from memscal.model.stress import StressProfile

#: Loads that differ by no more, relatively, are one; the stress is scaled in proportion.
_SAME_LOAD = 0.01
#: A table must have decayed to this share of its maximum where it ends.
_DECAYED = 1e-3
#: A table's force must be its load but for this share.
_CARRIES = 0.05
#: Missing tables that an error names.
_MOST_NAMED = 6


def external_family(
    profiles: Sequence[StressProfile],
    loads: ArrayLike,
    *,
    reach: float,
    film: ElasticFilm | None = None,
    indenter: Indenter | None = None,
    cache: CacheFolder = None,
    workers: int = 1,
) -> ProfileFamily:
    """Return base stresses of tables by friction; each serves loads within 1 % of its own."""
    nominal = require_loads(loads)
    tables = [_checked(profile, reach) for profile in profiles]
    if not tables:
        raise InputError("No table of a calculated stress was given.")
    loading = _common_loading(tables)
    frictions = np.array(sorted({_friction(profile) for profile in tables}))
    grid = _grid(tables, frictions, nominal)
    film = film or next((p.film for p in tables if p.film is not None), None)
    indenter = indenter or next((p.indenter for p in tables if p.indenter is not None), None)
    # Where no film is known: a stress halves over about the film's thickness.
    thickness = film.thickness if film else min(_half_width(profile) for profile in tables)
    nodes = base_wavenumbers(thickness, reach)
    spectra = np.array(
        [[hankel_transform(cell.r, cell.sigma_zz, nodes.k) for cell in row] for row in grid]
    )
    spectra *= (nominal / np.array([[cell.load for cell in row] for row in grid]))[:, :, None]
    by_load, changes = spectra, {}
    notes = "No film and sphere are known: the stress counts as proportional to the load."
    if film is not None and isinstance(indenter, Sphere):
        ours = amontons_family(
            film,
            indenter,
            nominal,
            friction=[float(mu) for mu in frictions],
            loading=loading or "incremental",
            reach=reach,
            cache=cache,
            workers=workers,
        )
        # What the tables have beside the contacts solved here counts as proportional to the load.
        by_load = ours.by_load + (spectra - ours.spectra)
        changes = dict(ours.changes)
        notes = "Sensitivities are those of the contacts that memscal calculates."
    return ProfileFamily(
        name="external",
        loading=loading,
        wavenumbers=nodes,
        loads=nominal,
        values=frictions,
        scale=FRICTION_SCALE,
        spectra=spectra,
        by_load=by_load,
        changes=changes,
        depths=_numbers(grid, "depth"),
        contact_radii=_numbers(grid, "contact_radius"),
        convergence=_numbers(grid, "convergence"),
        notes=(notes,),
    )


def _grid(
    tables: Sequence[StressProfile], frictions: FloatArray, loads: FloatArray
) -> list[list[StressProfile]]:
    """Return the table of each friction coefficient and load; name all that are missing."""
    grid, missing = [], []
    for mu in frictions:
        row = [_nearest(tables, float(mu), float(load)) for load in loads]
        absent = (load for load, cell in zip(loads, row, strict=True) if cell is None)
        missing += [f"{load:g} N with friction {mu:g}" for load in absent]
        grid.append([cell for cell in row if cell is not None])
    if missing:
        stated = sorted({profile.load for profile in tables})
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


def _nearest(tables: Sequence[StressProfile], mu: float, load: float) -> StressProfile | None:
    near = [p for p in tables if _friction(p) == mu and abs(p.load / load - 1) <= _SAME_LOAD]
    near.sort(key=lambda profile: abs(profile.load - load))
    if len(near) > 1 and near[0].load == near[1].load:
        raise InputError(
            f"{_name(near[0])} and {_name(near[1])} are both for {near[0].load:g} N with friction "
            f"{mu:g}.",
            cure="Give each load and friction coefficient once.",
        )
    return near[0] if near else None


def _checked(profile: StressProfile, reach: float) -> StressProfile:
    """Refuse a table that cannot be compared."""
    if profile.friction_coefficient is None:
        raise InputError(
            f"{_name(profile)} does not say its friction coefficient.",
            cure="State it when the table is imported (--friction).",
        )
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
    return profile


def _common_loading(tables: Sequence[StressProfile]) -> str:
    loadings = {p.loading for p in tables if p.loading and _friction(p) > 0}
    if len(loadings) > 1:
        raise InputError(
            "Some of the tables are for incremental loading and some for total loading.",
            why="A family holds one loading.",
            cure="Give the tables of one loading at a time.",
        )
    return loadings.pop() if loadings else ""


def _friction(profile: StressProfile) -> float:
    mu = profile.friction_coefficient
    return math.nan if mu is None else float(mu)


def _name(profile: StressProfile) -> str:
    return profile.source.file_name if profile.source else f"A table for {profile.load:g} N"


def _half_width(profile: StressProfile) -> float:
    below = np.flatnonzero(profile.sigma_zz < profile.sigma_zz.max() / 2)
    return float(profile.r[below[below > np.argmax(profile.sigma_zz)][0]])


def _numbers(grid: Sequence[Sequence[StressProfile]], name: str) -> FloatArray:
    """Return a number that tables may state, NaN where they do not."""
    rows = [[getattr(cell, name) for cell in row] for row in grid]
    return np.array([[math.nan if v is None else float(v) for v in row] for row in rows])
