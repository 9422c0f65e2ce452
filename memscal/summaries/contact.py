"""Contacts as tables, mapping and arrays, as ``memscal reference`` prints them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray
from memscal.model.checks import Message
from memscal.model.indenter import Cone, RoundIndenter
from memscal.model.quantities import KPA, MM, Quantity, by_name
from memscal.model.records import CONTACT, PROFILE
from memscal.summaries.interop import column, data_frame, labelled_dataset, quantity_json
from memscal.summaries.table import Table

if TYPE_CHECKING:
    import pandas as pd
    import xarray

#: Share of the film's thickness up to which linear elasticity is taken as valid.
_SHALLOW = 0.1
_SINGULAR = (
    "The pressure under a flat rod grows without bound towards its edge: "
    "there is no largest interface stress."
)
_QUANTITIES = by_name(CONTACT.quantities)
_PROFILE = (
    *PROFILE.quantities,
    Quantity("interface_pressure", "stress", "pressure at the interface", axes=("r",)),
    Quantity("interface_shear", "stress", "outward traction at the interface", axes=("r",)),
)


def mapping(contact: Contact) -> dict[str, Any]:
    """Return one solution of ``reference --json``; the contract fixes its form."""
    shown = [_QUANTITIES[name] for name in ("load", "depth", "contact_radius", "stick_radius")]
    return {
        **{q.name: quantity_json(getattr(contact, q.name) / q.scale, q.unit) for q in shown},
        "max_interface_stress": quantity_json(contact.max_interface_stress, "Pa"),
        "max_base_stress": quantity_json(contact.max_base_stress, "Pa"),
        "friction_coefficient": quantity_json(contact.friction, "1"),
        "sticking": math.isinf(contact.friction),
        "loading": contact.loading,
        "backend": contact.backend,
        "strain": contact.strain,
        "convergence": quantity_json(contact.convergence, "1"),
        "steps": contact.steps,
        "elastic_energy": quantity_json(contact.elastic_energy, "J"),
        "work": quantity_json(contact.work, "J"),
        "dissipated_energy": quantity_json(contact.dissipated_energy, "J"),
        "discretisation": contact.discretisation,
    }


def depth_messages(contacts: Sequence[Contact]) -> tuple[list[Message], list[str]]:
    """Return notes on depths beyond linear elasticity, and all warnings of the JSON object."""
    notes = [Message("deep", text) for contact in contacts if (text := _deep(contact))]
    singular = [_SINGULAR] if contacts[0].indenter.shape == "rod" else []
    return notes, [*singular, *(note.text for note in notes)]


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


def tables(contact: Contact) -> list[Table]:
    """Return the table of one contact."""
    return [contacts_table([contact])]


def contacts_table(contacts: Sequence[Contact]) -> Table:
    """Return one row for each contact of a path; columns that do not apply are left out."""
    rod = contacts[0].indenter.shape == "rod"
    columns = {"load (N)": [f"{c.load:.4g}" for c in contacts], **_lengths("depth", contacts)}
    if rod:
        columns["load/depth (N/mm)"] = [f"{c.load / c.depth * MM:.4g}" for c in contacts]
    else:
        columns |= _lengths("contact_radius", contacts)
    if contacts[0].friction > 0:
        columns |= _lengths("stick_radius", contacts)
    if not rod:
        columns["interface peak (kPa)"] = [f"{c.max_interface_stress / KPA:.5g}" for c in contacts]
    columns["base peak (kPa)"] = [f"{c.max_base_stress / KPA:.5g}" for c in contacts]
    columns["steps"] = [f"{c.steps}" for c in contacts]
    columns["change"] = [f"{c.convergence:.1g}" for c in contacts]
    rows = [list(row) for row in zip(*columns.values(), strict=True)]
    return Table(_title(contacts[0]), list(columns), rows)


def _lengths(name: str, contacts: Sequence[Contact]) -> dict[str, list[str]]:
    quantity = _QUANTITIES[name]
    cells = [f"{getattr(contact, name) / quantity.scale:.4g}" for contact in contacts]
    return {column(quantity).replace("_", " "): cells}


def _title(contact: Contact) -> str:
    """Say in one line what was pressed on what, and how it was solved."""
    film = contact.film
    friction = "sticking" if math.isinf(contact.friction) else f"friction {contact.friction:.4g}"
    friction = friction if contact.friction else "frictionless"
    loading = f", {contact.loading} loading" if contact.loading and contact.friction else ""
    interface = f"; interface: {text}" if (text := contact.interface.description) else ""
    strain = ", finite strain" if contact.strain == "finite" else ""
    return (
        f"{_name(contact)} on a film of {film.thickness / MM:.4g} mm, "
        f"E = {film.young_modulus * 1e-6:.4g} MPa, Poisson's ratio {film.poisson_ratio:.4g}: "
        f"{friction}{loading} ({contact.backend}{strain}){interface}"
    )


def _name(contact: Contact) -> str:
    body = contact.indenter
    if isinstance(body, RoundIndenter):
        return f"A {body.shape} of radius {body.radius / MM:.4g} mm"
    if isinstance(body, Cone):
        return f"A cone inclined by {math.degrees(body.inclination):.4g} degrees"
    return f"A profile to {body.extent / MM:.4g} mm"


def _arrays(contact: Contact) -> dict[str, FloatArray]:
    profile = contact.profile()
    shear = contact.base_shear(profile.r) if profile.sigma_rz is None else profile.sigma_rz
    return {
        "r": profile.r,
        "sigma_zz": profile.sigma_zz,
        "sigma_rz": shear,
        "interface_pressure": contact.interface_pressure(profile.r),
        "interface_shear": contact.interface_shear(profile.r),
    }


def dataset(contact: Contact) -> xarray.Dataset:
    """Return normal stress and shear at the base and at the interface along r."""
    return labelled_dataset(_PROFILE, _arrays(contact))


def frame(contact: Contact) -> pd.DataFrame:
    """Return one row for each radius of the default profile."""
    return data_frame(_PROFILE, _arrays(contact))
