"""Import of a stress profile from the table of any FEM program."""

from __future__ import annotations

import os

import numpy as np

from memscal.formats.csv_table import read_table
from memscal.formats.reference_profile import (
    ImportedProfile,
    Samples,
    profile_of,
    require_sign,
)
from memscal.formats.units import to_si
from memscal.model.checks import import_notes
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter

__all__ = ["read_reference_table"]

Column = str | int

# Radii that differ by less than this share of the largest are the same, but for rounding.
_SAME = 1e-9


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
    require_sign("sign", sign)
    require_sign("shear sign", shear_sign)
    table = read_table(path, delimiter=delimiter, decimal=decimal)
    columns = {
        "r": to_si(table.column(r), r_unit, "length", table.where(r)),
        "sigma_zz": sign * to_si(table.column(sigma), sigma_unit, "stress", table.where(sigma)),
    }
    if shear is not None:
        values = to_si(table.column(shear), sigma_unit, "stress", table.where(shear))
        columns["sigma_rz"] = shear_sign * values
    samples = Samples(
        columns=columns,
        source=table.source,
        notes=import_notes(
            [
                f"Imported from {table.source.file_name} (sha256 {table.source.sha256}).",
                *table.notes,
            ]
        ),
        kind="table",
        item="data row",
        units=(r_unit, sigma_unit),
        sign=sign,
        spacing=_SAME * float(np.nanmax(np.abs(columns["r"]), initial=0.0)),
    )
    return profile_of(samples, load=load, film=film, indenter=indenter, solver=solver)
