"""Contacts as tables, mapping and arrays, as ``memscal reference`` prints them."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import changes_by_inputs
from memscal.mechanics.press_rod import is_tabulated, press_rod
from memscal.model.arrays import Arrays, FloatArray, Values
from memscal.model.checks import Message
from memscal.model.film import NEO_HOOKEAN
from memscal.model.indenter import Cone, Rod, RoundIndenter
from memscal.model.quantities import KPA, MM, Quantity, by_name
from memscal.model.records import PROFILE, SOLUTION
from memscal.summaries import declared
from memscal.summaries.table import Table

#: Share of the film's thickness up to which linear elasticity is taken as valid.
_SHALLOW = 0.1
_SINGULAR = (
    "The pressure under a flat rod grows without bound towards its edge: "
    "there is no largest interface stress."
)
_QUANTITIES = by_name(SOLUTION)
_PROFILE = (
    *PROFILE.quantities,
    Quantity("interface_pressure", "stress", "pressure at the interface", axes=("r",)),
    Quantity("interface_shear", "stress", "outward traction at the interface", axes=("r",)),
)


def mapping(contact: Contact) -> Values:
    """Return one solution of ``reference --json``; the contract fixes its form."""
    law = contact.film_of_law.law
    return declared.members(SOLUTION, contact, sticking=math.isinf(contact.friction), film_law=law)


def depth_messages(contacts: Sequence[Contact]) -> tuple[list[Message], list[str]]:
    """Return notes on depths beyond linear elasticity, and all warnings of the JSON object."""
    notes = []
    for contact in contacts:
        share = contact.depth / contact.film.thickness
        if share > _SHALLOW and contact.strain != "finite":
            text = (
                f"At {contact.load:.4g} N the {contact.indenter.shape} sinks by {share:.0%} of the "
                "film's thickness: linear elasticity is formal there, and its error is not part "
                f"of the convergence.{_in_rubber(contact)}"
            )
            notes.append(Message("deep", text))
    singular = [_SINGULAR] if contacts[0].indenter.shape == "rod" else []
    return notes, [*singular, *(note.text for note in notes)]


def _in_rubber(contact: Contact) -> str:
    film = replace(contact.film, law=NEO_HOOKEAN)
    rod = contact.indenter
    load = contact.load
    if not isinstance(rod, Rod) or not is_tabulated(film, rod, load, math.inf):
        return ""
    rubber = press_rod(film, rod, load, math.inf)
    stress = rubber.max_base_stress
    depth = rubber.depth
    return (
        " In a neo-Hookean film that sticks to the rod the largest base stress is "
        f"{stress / KPA:.3g} kPa ({stress / contact.max_base_stress - 1:+.0%}) and the depth "
        f"{depth / MM:.3g} mm ({depth / contact.depth - 1:+.0%})."
    )


def tables(contact: Contact) -> list[Table]:
    """Return the table of one contact."""
    return [contacts_table([contact])]


def contacts_table(contacts: Sequence[Contact]) -> Table:
    """Return one row for each contact of a path; columns that do not apply are left out."""
    rod = contacts[0].indenter.shape == "rod"
    columns = _numbers("load", contacts) | _numbers("depth", contacts)
    if rod:
        columns["load/depth (N/mm)"] = [f"{c.load / c.depth * MM:.4g}" for c in contacts]
    else:
        columns |= _numbers("contact_radius", contacts)
    if contacts[0].friction > 0:
        columns |= _numbers("stick_radius", contacts)
    if not rod:
        columns |= _numbers("max_interface_stress", contacts, ".5g")
    columns |= _numbers("max_base_stress", contacts, ".5g")
    columns |= _numbers("steps", contacts, "g") | _numbers("convergence", contacts, ".1g")
    rows = list(zip(*columns.values(), strict=True))
    return Table(_title(contacts[0]), list(columns), rows)


def _numbers(name: str, contacts: Sequence[Contact], form: str = ".4g") -> dict[str, list[str]]:
    """Return a column of one quantity; stress is shown in kPa here, in Pa in JSON."""
    quantity = _QUANTITIES[name]
    if quantity.dimension == "stress":
        quantity = replace(quantity, shown="")
    values = (getattr(contact, name) / quantity.scale for contact in contacts)
    return {quantity.heading: [format(value, form) for value in values]}


def _title(contact: Contact) -> str:
    film = contact.film
    friction = f"friction {contact.friction:.4g}" if contact.friction else "frictionless"
    if math.isinf(contact.friction):
        friction = "sticking"
    loading = f", {contact.loading} loading" if contact.loading and contact.friction else ""
    rough = contact.interface.description
    interface = f"; interface: {rough}" if rough else ""
    strain = f", {contact.film_of_law.law_text}" if contact.strain == "finite" else ""
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


def _arrays(contact: Contact) -> Arrays:
    profile = contact.profile()
    shear = contact.base_shear(profile.r) if profile.sigma_rz is None else profile.sigma_rz
    return {
        "r": profile.r,
        "sigma_zz": profile.sigma_zz,
        "sigma_rz": shear,
        "interface_pressure": contact.interface_pressure(profile.r),
        "interface_shear": contact.interface_shear(profile.r),
    }


def dataset(contact: Contact) -> declared.Dataset:
    """Return normal stress and shear at the base and at the interface along r."""
    return declared.labelled_dataset(_PROFILE, _arrays(contact))


def frame(contact: Contact) -> declared.DataFrame:
    """Return one row for each radius of the default profile."""
    return declared.data_frame(_PROFILE, _arrays(contact))


def correlated(contact: Contact) -> Values:
    """Return depth, radii and largest base stress at the exact load, as correlated numbers."""
    # They vary with the stated uncertainties of film and indenter; the change under refinement is
    # taken as a further standard uncertainty of each.
    names = ["depth", "contact_radius", "stick_radius", "max_base_stress"]

    def numbers(contact: Contact) -> FloatArray:
        return np.array([getattr(contact, name) for name in names], dtype=np.float64)

    values = numbers(contact)
    covariance = np.diag((contact.convergence * values) ** 2)
    for more, less, share in changes_by_inputs(contact):
        change = (numbers(more) - numbers(less)) * share
        covariance += np.outer(change, change)
    return declared.correlated_numbers(names, values, covariance)
