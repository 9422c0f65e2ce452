"""The reference part of ``memscal import``: a stress at the base, from a table or a mesh."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from memscal.cli.options import FILM, Quantity, film_from, indenter_from, si

if TYPE_CHECKING:
    from memscal.formats.reference_profile import ImportedProfile

__all__ = ["NAMES", "is_mesh", "needed", "read", "reference_options", "strange"]

_Command = TypeVar("_Command", bound=Callable[..., Any])

_SHARED = ("r_unit", "sigma", "sigma_unit", "shear", "sign", "shear_sign", "solver")
_OF_TABLES = ("r",)
_OF_MESHES = ("vertical", "base", "centre")
NAMES = (*_OF_TABLES, *_SHARED, *_OF_MESHES)
"""The options that only a reference has."""

_READING = ("delimiter", "decimal")
_POSITION = Quantity("mm", low=-float("inf"))


def reference_options(command: _Command) -> _Command:
    """Add the options that say what a table or a mesh of stress at the base holds."""
    signs = click.Choice(["1", "-1"])
    options = [
        click.option("--r", metavar="COLUMN", help="Reference: column of the radius."),
        click.option(
            "--r-unit",
            metavar="UNIT",
            help="Reference: unit of the radius, or of a mesh's coordinates, such as mm.",
        ),
        click.option(
            "--sigma",
            metavar="COLUMN|FIELD",
            help="Reference: column of the normal stress at the base; in a mesh the field of it, "
            "or of the stress tensor, and FIELD:2 is its component 2.",
        ),
        click.option(
            "--sigma-unit", metavar="UNIT", help="Reference: unit of the stresses, such as MPa."
        ),
        click.option(
            "--shear",
            metavar="COLUMN|FIELD",
            help="Reference: the radial shear stress; in a mesh a stress tensor's own by default.",
        ),
        click.option(
            "--sign",
            type=signs,
            help="Reference: -1 where compression is negative.  [default: 1 for a table, -1 for a "
            "mesh]",
        ),
        click.option(
            "--shear-sign",
            type=signs,
            help="Reference: -1 where the shear is the stress component S13 with axis 3 from the "
            "base to the surface; 1 where it is the base's traction on the film, positive outward."
            "  [default: 1 for a table; for a mesh S13, whichever way its axis points]",
        ),
        click.option("--solver", metavar="TEXT", help="Reference: the program that calculated it."),
        click.option(
            "--vertical",
            type=click.Choice(["x", "y", "z"]),
            help="Mesh: axis across the film.  [default: the second of a section's two; z in 3-D]",
        ),
        click.option(
            "--base",
            type=_POSITION,
            help="Mesh: position of the base on that axis, in mm.  [default: the lowest]",
        ),
        click.option(
            "--centre",
            type=(_POSITION, _POSITION),
            metavar="MM MM",
            help="Mesh in 3-D: where the indenter's axis meets the base, in mm.  [default: 0 0]",
        ),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def needed(path: Path) -> tuple[str, ...]:
    """Return the options without which a reference cannot be read."""
    return (*(() if is_mesh(path) else _OF_TABLES), "r_unit", "sigma", "sigma_unit", "load")


def strange(path: Path, given: dict[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Return the options given that a mesh, or a table, has no use for, and which it is."""
    kind, names = ("mesh", (*_OF_TABLES, *_READING)) if is_mesh(path) else ("table", _OF_MESHES)
    return kind, tuple(name for name in names if given[name] is not None)


def read(path: Path, given: dict[str, Any]) -> ImportedProfile:
    """Read the reference with the options given; for the others the library's defaults hold."""
    setting: dict[str, Any] = {
        "film": None if all(given[name] is None for name in FILM) else film_from(given),
        "indenter": None if given["radius"] is None else indenter_from(given["indenter"], given),
    }
    if not is_mesh(path):
        from memscal.formats.reference_table import read_reference_table

        return read_reference_table(
            path, **_given(given, (*_OF_TABLES, *_SHARED, *_READING, "load")), **setting
        )
    from memscal.formats.meshes.reference_mesh import read_reference_mesh

    places = _given(given, ("base", "centre"))
    if "base" in places:
        places["base"] = si(places["base"], -3)
    if "centre" in places:
        places["centre"] = tuple(si(each, -3) for each in places["centre"])
    return read_reference_mesh(
        path, **_given(given, (*_SHARED, "vertical", "load")), **places, **setting
    )


def _given(values: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: values[name] for name in names if values[name] is not None}


def is_mesh(path: Path) -> bool:
    """Return whether a file's name says that it is a mesh."""
    from memscal.formats.meshes import mesh_files

    return mesh_files.is_mesh(path)
