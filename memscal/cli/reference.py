"""``memscal reference``: the stress at the base of a film under an indenter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli.failures import DONE, debug_option
from memscal.cli.options import (
    FILE,
    Quantity,
    film_from,
    film_options,
    force_option,
    indenter_from,
    json_option,
    radius_options,
    si,
)
from memscal.cli.output import emit_json, finite, message, note
from memscal.cli.targets import prove_writable

if TYPE_CHECKING:
    from memscal.mechanics.contact import Contact

__all__ = ["command"]

#: The paper's rod and sphere, in mm, and its film.
RADIUS = {"rod": 0.25, "sphere": 128.8}
FILM = {"young-modulus": 2.2, "poisson-ratio": 0.5, "thickness": 2.0}

#: Share of the film's thickness up to which linear elasticity is taken at its word.
_SHALLOW = 0.1

_SINGULAR = (
    "The pressure under a flat rod grows without bound towards its edge: "
    "there is no largest interface stress."
)

EXAMPLES = """\b
Examples:
  memscal reference rod
  memscal reference rod --load 0.5 --load 1 --load 2
  memscal reference rod --depth 100 --thickness 3 --json
  memscal reference rod --radius 0.5 --friction inf -o sticking_rod.h5
"""


@click.command("reference", epilog=EXAMPLES)
@click.argument("indenter", type=click.Choice(["rod", "sphere"]))
@click.option(
    "--load",
    "loads",
    type=Quantity("N"),
    multiple=True,
    help="Normal load, in N. May be repeated.  [default: 1, without --depth]",
)
@click.option(
    "--depth",
    "depths",
    type=Quantity("um"),
    multiple=True,
    help="Indentation depth, in um, in place of a load. May be repeated.",
)
@radius_options(uncertainties=False)
@click.option(
    "--friction",
    type=Quantity("ratio", open_low=False, infinite=True),
    default=0.0,
    show_default=True,
    metavar="MU",
    help="Friction coefficient between indenter and film; inf: it sticks. Under a rod: 0 or inf.",
)
@film_options(defaults=FILM, uncertainties=False)
@click.option(
    "--loading",
    type=click.Choice(["incremental", "total"]),
    default="incremental",
    show_default=True,
    help="Where a point sticks: where it first touched, or as if loaded in one step. The same "
    "under a rod.",
)
@click.option(
    "--backend",
    type=click.Choice(["hankel", "fem"]),
    default="hankel",
    show_default=True,
    help="How it is solved. This version has hankel: linear elasticity by Hankel transforms.",
)
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="OUT",
    help="Reference file to write (memscal-reference); for one load or depth.",
)
@json_option
@force_option
@debug_option
def command(
    indenter: str,
    loads: tuple[float, ...],
    depths: tuple[float, ...],
    friction: float,
    loading: str,
    backend: str,
    output: Path | None,
    as_json: bool,
    force: bool,
    **given: Any,
) -> int:
    """Solve the stress at the base of a bonded film under a rigid INDENTER.

    The film is linear elastic and bonded to a rigid base. What the options do not say is the
    paper's: E = 2.2 MPa, Poisson's ratio 0.5, thickness 2 mm; a rod of radius 0.25 mm.
    """
    if loads and depths:
        raise click.UsageError("Give --load or --depth, not both: one follows from the other.")
    if output is not None and max(len(loads), len(depths)) > 1:
        raise click.UsageError(
            "A reference file holds one load: with --output give one --load or one --depth."
        )
    given["radius"] = given["radius"] or RADIUS[indenter]
    if output is not None:
        prove_writable([output], force=force)
    film, body = film_from(given), indenter_from(indenter, given)

    from memscal.mechanics.indent import indent

    settings: dict[str, Any] = {"friction": friction, "loading": loading, "backend": backend}
    if depths:
        contacts = indent(film, body, depth=[si(depth, -6) for depth in depths], **settings)
    else:
        contacts = indent(film, body, load=list(loads or (1.0,)), **settings)
    if output is not None:
        from memscal.formats.reference import write_reference

        write_reference(contacts[0].profile(), output, overwrite=force)
    _tell(contacts, loading, output, as_json)
    return DONE


def _tell(contacts: Sequence[Contact], loading: str, output: Path | None, as_json: bool) -> None:
    solutions = [_solution(contact, loading) for contact in contacts]
    deep = [text for contact in contacts if (text := _deep(contact))]
    if as_json:
        head = {"schema_version": "1", "output": None if output is None else str(output)}
        emit_json({**head, "solutions": solutions, "warnings": [_SINGULAR, *deep]})
    else:
        from memscal.cli.tables import emit_tables

        emit_tables(_table(contacts[0], solutions))
    for text in deep:
        note(text)
    if output is not None:
        message(f"Written: {output}")


def _deep(contact: Contact) -> str:
    """Say where linear elasticity is formal."""
    share = contact.depth / contact.film.thickness
    if share <= _SHALLOW:
        return ""
    return (
        f"At {contact.load:.4g} N the {contact.indenter.shape} sinks by {share:.0%} of the film's "
        "thickness: linear elasticity is formal there, and its error is not part of the "
        "convergence."
    )


def _solution(contact: Contact, loading: str) -> dict[str, Any]:
    """Return one solution in the contract's names and units."""

    def quantity(value: float, unit: str) -> dict[str, Any]:
        return {"value": finite(value), "unit": unit}

    return {
        "load": quantity(contact.load, "N"),
        "depth": quantity(contact.depth * 1e6, "um"),
        "contact_radius": quantity(contact.contact_radius * 1e3, "mm"),
        "stick_radius": quantity(contact.stick_radius * 1e3, "mm"),
        "max_interface_stress": quantity(math.inf, "Pa"),
        "max_base_stress": quantity(float(contact.profile().sigma_zz.max()), "Pa"),
        "friction_coefficient": quantity(contact.friction, "1"),
        "sticking": math.isinf(contact.friction),
        "loading": loading,
        "backend": contact.backend,
        "convergence": quantity(contact.convergence, "1"),
    }


def _table(contact: Contact, solutions: Sequence[dict[str, Any]]) -> Any:
    from memscal.cli.tables import Table

    film = contact.film
    friction = "sticking" if math.isinf(contact.friction) else "frictionless"
    title = (
        f"A {friction} {contact.indenter.shape} of radius {contact.contact_radius * 1e3:.4g} mm "
        f"on a film of {film.thickness * 1e3:.4g} mm, E = {film.young_modulus * 1e-6:.4g} MPa, "
        f"Poisson's ratio {film.poisson_ratio:.4g} ({contact.backend})"
    )
    head = (
        "load (N)",
        "depth (um)",
        "load/depth (N/mm)",
        "largest base stress (Pa)",
        "convergence",
    )
    rows = [
        (
            f"{s['load']['value']:.4g}",
            f"{s['depth']['value']:.4g}",
            f"{1e3 * s['load']['value'] / s['depth']['value']:.4g}",
            f"{s['max_base_stress']['value']:.6g}",
            f"{s['convergence']['value']:.1g}",
        )
        for s in solutions
    ]
    return Table(title, head, rows)
