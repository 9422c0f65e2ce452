"""Import of a stress profile from the table of any FEM program."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

import numpy as np

from memscal.errors import InputError
from memscal.formats.csv_table import read_table
from memscal.formats.units import to_si
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray

__all__ = ["ImportedProfile", "read_reference_table"]

Column = str | int

# A larger difference between force and load is warned of, one beyond a factor is refused.
_WARNED = 0.03
_REFUSED = 2.0
# A table whose stress has not decayed to this share of its maximum ends early.
_DECAYED = 0.01


@dataclass(frozen=True, eq=False)
class ImportedProfile:
    """A stress profile that was read from a table, and what was done on the way."""

    profile: StressProfile
    notes: tuple[str, ...]


def read_reference_table(
    path: str | os.PathLike[str],
    *,
    r: Column,
    sigma: Column,
    r_unit: str,
    sigma_unit: str,
    load: float,
    sign: int = 1,
    shear: Column | None = None,
    shear_sign: int = 1,
    film: ElasticFilm | None = None,
    indenter: Indenter | None = None,
    solver: str = "",
    delimiter: str | None = None,
    decimal: str | None = None,
) -> ImportedProfile:
    """Read the stress at the base of the film from a table with one row per radius.

    Parameters
    ----------
    path : path
        A delimited text file.
    r, sigma : str or int
        Columns of radius and normal stress: a name, or a number counted from 1.
    r_unit, sigma_unit : str
        Their units; ``sigma_unit`` holds for ``shear`` too.
    load : float
        Normal load of the calculation, in N.
    sign : {1, -1}
        -1 where the program counts compression as negative, as most FEM programs do; it
        turns the normal stress only.
    shear : str or int, optional
        Column of the radial shear stress.
    shear_sign : {1, -1}
        1 where the column is the radial traction of the base on the film, positive outward; -1
        where it is the stress component S13 (S_rz) with the third axis from the base to the
        surface, because the film's lower face looks the other way.
    film, indenter : optional
        What was pressed on what.
    solver : str
        The program.
    delimiter, decimal : str, optional
        Column separator and decimal mark; found from the file by default.

    Returns
    -------
    ImportedProfile
        The profile, sorted by radius, and what was done: also recorded in ``profile.notes``.

    Raises
    ------
    InputError
        If a value is missing, a radius is negative, the stress is mostly tensile, or it carries
        less than half or more than twice the load (less, only if it decays within the table).
    """
    for name, value in (("sign", sign), ("shear sign", shear_sign)):
        if value not in (1, -1):
            raise InputError(f"The {name} is {value}.", cure="Give 1 or -1.")
    table = read_table(path, delimiter=delimiter, decimal=decimal)
    notes = [
        f"Imported from {table.source.file_name} (sha256 {table.source.sha256}).",
        *table.notes,
    ]
    columns = {
        "r": to_si(table.column(r), r_unit, "length", table.where(r)),
        "sigma_zz": sign * to_si(table.column(sigma), sigma_unit, "stress", table.where(sigma)),
    }
    if shear is not None:
        values = to_si(table.column(shear), sigma_unit, "stress", table.where(shear))
        columns["sigma_rz"] = shear_sign * values
    for name, values in columns.items():
        _require_numbers(table.source.file_name, name, values)
    if columns["r"].min() < 0:
        raise InputError(
            f"{table.source.file_name} has a negative radius ({columns['r'].min() * 1e3:g} mm).",
            why="A reference is a profile against the distance from the axis.",
            cure="Give one half of a section through the axis, with r from 0.",
        )
    columns = _sorted_by_radius(columns, notes)
    profile = StressProfile(
        r=columns["r"],
        sigma_zz=columns["sigma_zz"],
        sigma_rz=columns.get("sigma_rz"),
        load=load,
        film=film,
        indenter=indenter,
        solver=solver,
        source=table.source,
    )
    notes += _compare_with_load(profile, table.source.file_name, (r_unit, sigma_unit))
    return ImportedProfile(replace(profile, notes="\n".join(notes)), tuple(notes))


def _compare_with_load(
    profile: StressProfile, file_name: str, units: tuple[str, str]
) -> tuple[str, ...]:
    """Hold the force that the table carries against its load, which finds a wrong unit."""
    force, load = profile.force, profile.load
    if force <= 0:
        raise InputError(
            f"The normal stress in {file_name} is mostly negative: it carries {force:.4g} N.",
            why="Here compression is positive.",
            cure="If the program counts compression as negative, say so (sign=-1; --sign -1).",
        )
    ratio, reach = force / load, profile.r[-1] * 1e3
    tail = abs(float(profile.sigma_zz[-1])) / float(np.abs(profile.sigma_zz).max())
    early = tail > _DECAYED
    within = f"within r = {reach:.4g} mm"
    if ratio > _REFUSED or (ratio < 1 / _REFUSED and not early):
        raise InputError(
            f"The stress in {file_name} carries {force:.4g} N {within}, {ratio:.4g} times the load "
            f"of {load:g} N.",
            why="The force that the base carries must be the load.",
            cure=f'Check the unit of the stresses ("{units[1]}"), the unit of the radii '
            f'("{units[0]}"), the sign, that the column is the normal stress at the base, and '
            "the load in N.",
        )
    carried = f"The table carries {force:.4g} N of the load of {load:g} N ({ratio:.2%}) {within}."
    if abs(ratio - 1) <= _WARNED:
        return (carried,)
    cure = (
        f"The table ends with {tail:.1%} of its maximum left: extend it to where the stress has "
        "decayed."
        if early and ratio < 1
        else "Check the load, the units, and that the radii are fine enough under the indenter."
    )
    warning = (
        f"Warning: the table's force differs from the load by {abs(ratio - 1):.1%} of it. A "
        "calibration takes stress per load from the table, so its conversion constant would be "
        f"wrong by as much. {cure}"
    )
    return carried, warning


def _require_numbers(file_name: str, name: str, values: FloatArray) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(
            f"{file_name}: {name} is not a number in data row {bad[0] + 1}"
            + (f" and {bad.size - 1} more." if bad.size > 1 else "."),
            cure="Remove these rows, or calculate them.",
        )


def _sorted_by_radius(columns: dict[str, FloatArray], notes: list[str]) -> dict[str, FloatArray]:
    """Sort, and average the values that element-wise output gives twice at a shared node."""
    r = columns["r"]
    if np.any(np.diff(r) < 0):
        notes.append("The rows were sorted by radius.")
    places, index = np.unique(r, return_inverse=True)
    if places.size == r.size:
        order = np.argsort(r)
        return {name: values[order] for name, values in columns.items()}
    number = np.bincount(index)
    means = {n: np.bincount(index, weights=v) / number for n, v in columns.items() if n != "r"}
    peak = float(np.abs(means["sigma_zz"]).max())
    apart = float(np.abs(columns["sigma_zz"] - means["sigma_zz"][index]).max())
    notes.append(
        f"{r.size - places.size} rows repeat a radius; they were averaged "
        f"(normal stresses differ from the mean by up to {apart / peak if peak else 0:.2g} "
        "of the maximum)."
    )
    return {"r": places, **means}
