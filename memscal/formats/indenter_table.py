"""The shape of an indenter from a table: a tip that was worn, or measured."""

from __future__ import annotations

import os

from memscal.errors import InputError
from memscal.formats.csv_table import read_table
from memscal.formats.units import to_si
from memscal.model.indenter import Profile

__all__ = ["read_indenter_table"]


def read_indenter_table(
    path: str | os.PathLike[str],
    *,
    r: str | int = 1,
    z: str | int = 2,
    r_unit: str = "mm",
    z_unit: str = "um",
) -> Profile:
    r"""Read an indenter's profile from a table with one row per radius.

    Parameters
    ----------
    path : path
        A delimited text file.
    r, z : str or int
        Columns of radius and height: a name, or a number counted from 1.
    r_unit, z_unit : str
        Their units.

    Returns
    -------
    Profile
        With heights above the lowest point of the table.

    Raises
    ------
    FormatError, UnitError, InputError
        If the table cannot be read or is no profile: radii that do not increase from 0, fewer
        than four of them, a height that is missing, or a flat face.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "tip.csv")
    ...     rows = "r,z\n0,0\n0.5,1\n1,4\n1.5,9\n"
    ...     _ = path.write_text(rows)
    ...     read_indenter_table(path)
    <Profile: 4 radii to 1.5 mm, heights to 9 um>
    """
    table = read_table(path)
    radii = to_si(table.column(r), r_unit, "length", table.where(r))
    heights = to_si(table.column(z), z_unit, "length", table.where(z))
    try:
        # What a microscope calls zero is anywhere.
        return Profile(r=radii, z=heights - heights.min())
    except InputError as error:
        raise InputError(
            f"{table.source.file_name}: {error.problem}", why=error.why, cure=error.cure
        ) from error
