"""A sliding contact as a table and mapping."""

from memscal.extensions.motion.sliding_contact import SlidingContact
from memscal.model.arrays import Values
from memscal.model.quantities import Quantity
from memscal.summaries.declared import members
from memscal.summaries.table import Table

_QUANTITIES = (
    Quantity("load", "force", "normal load"),
    Quantity("tangential_load", "force", "tangential load"),
    Quantity("friction", "dimensionless", "shear over pressure"),
    Quantity("depth", "length", "depth", shown="um"),
    Quantity("low", "length", "contact begins at x"),
    Quantity("high", "length", "contact ends at x"),
    Quantity("half_width", "length", "half width of the contact"),
    Quantity("surface_centroid", "length", "centroid of the pressure"),
    Quantity("base_centroid", "length", "centroid of the base stress"),
    Quantity("peak_position", "length", "largest base stress at x"),
    Quantity("max_base_stress", "stress", "largest base stress"),
    Quantity("convergence", "dimensionless", "change of the base stress by half the cells"),
)


def mapping(contact: SlidingContact) -> Values:
    """Return the numbers of a sliding contact with their units."""
    return members(_QUANTITIES, contact, **contact.region._asdict())


def tables(contact: SlidingContact) -> list[Table]:
    """Return a row for each number."""
    rows = []
    for quantity, held in zip(_QUANTITIES, mapping(contact).values(), strict=True):
        rows.append((quantity.words, f"{held['value']:.4g} {quantity.unit}".rstrip()))
    title = (
        f"A {contact.indenter.shape} that slides on a film of {contact.film.thickness * 1e3:g} mm"
    )
    return [Table(title, ("", ""), rows)]
