"""How ``memscal reference`` tells what it found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from memscal.cli.output import emit_json, finite, note

if TYPE_CHECKING:
    from memscal.mechanics.contact import Contact

__all__ = ["tell"]

#: Share of the film's thickness up to which linear elasticity is taken at its word.
_SHALLOW = 0.1

_SINGULAR = (
    "The pressure under a flat rod grows without bound towards its edge: "
    "there is no largest interface stress."
)


def tell(contacts: Sequence[Contact], loading: str, output: Path | None, *, as_json: bool) -> None:
    """Print the contacts as a table or as one JSON object; notes go to stderr."""
    warnings = [text for contact in contacts if (text := _deep(contact))]
    if as_json:
        if contacts[0].indenter.shape == "rod":
            warnings.insert(0, _SINGULAR)
        head = {"schema_version": "1", "output": None if output is None else str(output)}
        solutions = [_solution(contact, loading) for contact in contacts]
        emit_json({**head, "solutions": solutions, "warnings": warnings})
    else:
        from memscal.cli.tables import Table, emit_tables

        emit_tables(Table(_title(contacts[0], loading), *_columns(contacts)))
    for text in warnings:
        if text is not _SINGULAR:
            note(text)


def _deep(contact: Contact) -> str:
    """Say where linear elasticity is formal."""
    share = contact.depth / contact.film.thickness
    if share <= _SHALLOW or contact.strain == "finite":
        return ""
    return (
        f"At {contact.load:.4g} N the {contact.indenter.shape} sinks by {share:.0%} of the film's "
        "thickness: linear elasticity is formal there, and its error is not part of the "
        "convergence. --strain finite shows what it changes, under a rod or a sphere."
    )


def _solution(contact: Contact, loading: str) -> dict[str, Any]:
    """Return one solution in the contract's names and units."""

    def quantity(value: float | None, unit: str) -> dict[str, Any]:
        return {"value": None if value is None else finite(float(value)), "unit": unit}

    return {
        "load": quantity(contact.load, "N"),
        "depth": quantity(contact.depth * 1e6, "um"),
        "contact_radius": quantity(contact.contact_radius * 1e3, "mm"),
        "stick_radius": quantity(contact.stick_radius * 1e3, "mm"),
        "max_interface_stress": quantity(contact.max_interface_stress, "Pa"),
        "max_base_stress": quantity(contact.max_base_stress, "Pa"),
        "friction_coefficient": quantity(contact.friction, "1"),
        "sticking": math.isinf(contact.friction),
        "loading": loading,
        "backend": contact.backend,
        "strain": contact.strain,
        "convergence": quantity(contact.convergence, "1"),
        "steps": contact.steps,
        "elastic_energy": quantity(contact.elastic_energy, "J"),
        "work": quantity(contact.work, "J"),
        "dissipated_energy": quantity(contact.dissipated_energy, "J"),
        "discretisation": contact.discretisation,
    }


def _title(contact: Contact, loading: str) -> str:
    """Say in one line what was pressed on what, and how it was solved."""
    film, rod = contact.film, contact.indenter.shape == "rod"
    if contact.friction == 0:
        friction = "frictionless"
    elif math.isinf(contact.friction):
        friction = "sticking"
    else:
        friction = f"friction {contact.friction:.4g}"
    way = "" if rod or contact.friction == 0 else f", {loading} loading"
    described = contact.interface.description
    interface = f"; interface: {described}" if described else ""
    strain = ", finite strain" if contact.strain == "finite" else ""
    return (
        f"{_name(contact)} on a film of {film.thickness * 1e3:.4g} mm, "
        f"E = {film.young_modulus * 1e-6:.4g} MPa, Poisson's ratio {film.poisson_ratio:.4g}: "
        f"{friction}{way} ({contact.backend}{strain}){interface}"
    )


def _name(contact: Contact) -> str:
    from memscal.model.indenter import Cone, RoundIndenter

    body = contact.indenter
    if isinstance(body, RoundIndenter):
        return f"A {body.shape} of radius {body.radius * 1e3:.4g} mm"
    if isinstance(body, Cone):
        return f"A cone inclined by {math.degrees(body.inclination):.4g} degrees"
    return f"A profile to {body.extent * 1e3:.4g} mm"


def _columns(contacts: Sequence[Contact]) -> tuple[list[str], list[list[str]]]:
    """Return head and rows; a column that says nothing under this indenter is left out."""
    rod = contacts[0].indenter.shape == "rod"
    frictional = contacts[0].friction > 0
    columns: list[tuple[str, list[str]]] = [
        ("load (N)", [f"{c.load:.4g}" for c in contacts]),
        ("depth (um)", [f"{c.depth * 1e6:.4g}" for c in contacts]),
    ]
    if rod:
        ratio = [f"{c.load / c.depth * 1e-3:.4g}" for c in contacts]
        columns.append(("load/depth (N/mm)", ratio))
    else:
        columns.append(("contact radius (mm)", [f"{c.contact_radius * 1e3:.4g}" for c in contacts]))
    if frictional:
        columns.append(("stick radius (mm)", [f"{c.stick_radius * 1e3:.4g}" for c in contacts]))
    if not rod:
        peaks = [f"{c.max_interface_stress * 1e-3:.5g}" for c in contacts]
        columns.append(("interface peak (kPa)", peaks))
    columns += [
        ("base peak (kPa)", [f"{c.max_base_stress * 1e-3:.5g}" for c in contacts]),
        ("steps", [f"{c.steps}" for c in contacts]),
        ("change", [f"{c.convergence:.1g}" for c in contacts]),
    ]
    rows = [list(row) for row in zip(*(cells for _, cells in columns), strict=True)]
    return [name for name, _ in columns], rows
