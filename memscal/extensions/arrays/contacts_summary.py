"""Contacts as an answer, tables, a mapping, and the text of contacts.csv."""

import csv
import io
from collections import Counter

import numpy as np

from memscal.errors import counted
from memscal.extensions.arrays.contacts import Contacts
from memscal.model.arrays import Values
from memscal.model.quantities import MM, Quantity, measured
from memscal.summaries.declared import members
from memscal.summaries.table import Table, percent

#: Of more frames the first are printed, with so many columns; digits of numbers there, in files,
#: and of what is carried over.
_PRINTED = 20
_COLUMNS = 8
_SHORT = 4
_LONG = 9
_CARRIED = 15


def _quantities(contacts: Contacts) -> tuple[Quantity, ...]:
    """Return what is told of each frame, in the order of the columns of contacts.csv."""
    newtons = "force" if contacts.unit == "N" else "dimensionless"
    time = [] if contacts.time is None else [Quantity("time", "time", stored="t")]
    return (
        Quantity("frame", "dimensionless"),
        *measured(Quantity("x", "length")),
        *measured(Quantity("y", "length")),
        *measured(Quantity("force", newtons)),
        Quantity("flags", "text"),
        Quantity("radius", "length"),
        Quantity("shear_x", newtons),
        Quantity("shear_y", newtons),
        Quantity("p_value", "dimensionless"),
        *time,
    )


def _values(contacts: Contacts) -> Values:
    """Return their values in SI units."""
    names = ("x_uncertainty", "y_uncertainty", "force_uncertainty", "shear_x", "shear_y")
    columns = np.column_stack([contacts.uncertainties, contacts.shear]).T
    return {**vars(contacts), **dict(zip(names, columns, strict=True))}


def answer(contacts: Contacts) -> str:
    """Return how many contacts were found, how well they are known, and what was assumed."""
    found = np.isfinite(contacts.force)
    sound = found & (np.array(contacts.flags) == "")
    flags = Counter("; ".join(filter(None, contacts.flags)).split("; "))
    lines = [f"{counted(int(found.sum()), 'contacts')} in {counted(found.size, 'frames')}."]
    if not sound.all():
        said = ", ".join(f"{flag} ({count})" for flag, count in flags.items())
        lines.append(f"Frames by flag: {said}.")
    if sound.any():
        errors = contacts.uncertainties[sound] / [MM, MM, 1.0]
        errors[:, 2] /= contacts.force[sound]
        x, y, force = np.median(errors, axis=0)
        known = [f"u({name}) = {u:.2g} mm" for name, u in (("x", x), ("y", y)) if u > 0]
        lines.append(
            f"Median standard uncertainties of those without a flag ({sound.sum()}): "
            f"{', '.join(known)}, {percent(force)} of force."
        )
    return "\n".join([*lines, contacts.assumed])


def tables(contacts: Contacts) -> list[Table]:
    """Return the first frames, with standard uncertainties."""
    heads, rows = _cells(contacts, _SHORT)
    title = f"Contacts: the first {min(len(rows), _PRINTED)} of {counted(len(rows), 'frames')}"
    return [Table(title, heads[:_COLUMNS], [row[:_COLUMNS] for row in rows[:_PRINTED]])]


def mapping(contacts: Contacts) -> Values:
    """Return the object of ``locate --json``."""
    return {
        "schema_version": "1",
        "indenter": contacts.pressed_by,
        "assumed_shear": contacts.assumed_shear,
        **members(_quantities(contacts), None, **_values(contacts)),
    }


def csv_text(contacts: Contacts) -> str:
    """Return the frames as comma-separated values, below comments; empty: not known."""
    text = io.StringIO()
    text.writelines(f"# {line}\n" for line in answer(contacts).splitlines())
    heads, rows = _cells(contacts, _LONG)
    csv.writer(text, lineterminator="\n").writerows([heads, *rows])
    return text.getvalue()


def _cells(contacts: Contacts, digits: int) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return heads and rows of text, with numbers of so many digits."""
    values = _values(contacts)
    heads = []
    columns = []
    for quantity in _quantities(contacts):
        heads.append(f"{quantity.key} [{quantity.unit}]".removesuffix(" []"))
        column = values[quantity.name]
        if quantity.name == "flags":
            heads[-1] = "flags"
        else:
            shown = _CARRIED if quantity.name in ("frame", "time") else digits
            column = [f"{number:.{shown}g}" for number in column / quantity.scale]
        columns.append(["" if cell == "nan" else cell for cell in column])
    return heads, [*zip(*columns, strict=True)]
