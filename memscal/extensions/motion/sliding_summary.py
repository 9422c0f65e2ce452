"""A sliding contact as a table and mapping; ``sliding.toml`` declares its numbers."""

import tomllib
from pathlib import Path

from memscal.extensions.motion.sliding_contact import SlidingContact
from memscal.model.arrays import Values
from memscal.model.quantities import Quantity
from memscal.summaries.declared import members
from memscal.summaries.table import Table

_ROWS = tomllib.loads(Path(__file__).with_name("sliding.toml").read_text("utf-8"))
_QUANTITIES = [Quantity(**row) for row in _ROWS["quantity"]]


def mapping(contact: SlidingContact) -> Values:
    """Return the numbers of a sliding contact with their units."""
    return members(_QUANTITIES, contact, **contact.region._asdict())


def tables(contact: SlidingContact) -> list[Table]:
    """Return a row for each number."""
    rows = [
        (quantity.heading, f"{number['value']:.4g}")
        for quantity, number in zip(_QUANTITIES, mapping(contact).values(), strict=True)
    ]
    return [Table(f"A {contact.indenter.shape} that slides on a film", ("", ""), rows)]
