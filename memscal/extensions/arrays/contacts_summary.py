"""Contacts as an answer, tables, a mapping, a data frame, and the text of a table of numbers."""

import csv
import io
from collections import Counter

import numpy as np

from memscal.errors import counted
from memscal.extensions.arrays.contacts import Contacts
from memscal.model.arrays import Values
from memscal.model.notation import format_measured
from memscal.model.quantities import DIMENSIONS, MM, Quantity, measured
from memscal.summaries import declared
from memscal.summaries.table import Table, percent

#: Of more frames the first are printed.
_PRINTED = 20


def _quantities(contacts: Contacts) -> tuple[Quantity, ...]:
    """Return what is told of each frame, in the order of the columns of contacts.csv."""
    newtons = "force" if contacts.unit == "N" else "dimensionless"
    time = [] if contacts.time is None else [Quantity("time", "time", "time", stored="t")]
    return (
        Quantity("frame", "number", "frame"),
        *measured(Quantity("x", "length", "x")),
        *measured(Quantity("y", "length", "y")),
        *measured(Quantity("force", newtons, "force")),
        Quantity("flags", "text", "flags"),
        Quantity("radius", "length", "radius of the contact"),
        Quantity("shear_x", newtons, "shear along x"),
        Quantity("shear_y", newtons, "shear along y"),
        Quantity("p_value", "number", "p"),
        *time,
    )


def _values(contacts: Contacts) -> Values:
    """Return their values in SI units."""
    values = vars(contacts).copy()
    values["shear_x"], values["shear_y"] = contacts.shear.T
    for name, errors in zip(("x", "y", "force"), contacts.uncertainties.T, strict=True):
        values[f"{name}_uncertainty"] = errors
    return values


def assumed(contacts: Contacts) -> str:
    """Return what was assumed of the contacts, in words."""
    if contacts.unit != "N":
        return "Assumed: presses like those of the scan; forces are in such presses."
    one = contacts.indenter
    under = "a point" if one is None else f"a {one.shape} of radius {one.radius / MM:.4g} mm"
    shear = "no shear"
    if contacts.assumed_shear:
        shear = f"a shear force of 0 ± {contacts.assumed_shear:.3g} of the normal force (k = 1) "
        shear += "along each axis"
    return f"Assumed: {under}, with {shear}."


def answer(contacts: Contacts) -> str:
    """Return how many contacts were found, how well they are known, and what was assumed."""
    found = np.isfinite(contacts.force)
    lines = [f"{counted(int(found.sum()), 'contacts')} in {counted(found.size, 'frames')}."]
    if found.any():
        errors = contacts.uncertainties[found]
        of_x, of_y = (np.median(column) / MM for column in errors[:, :2].T)
        share = percent(np.median(errors[:, 2] / contacts.force[found]))
        known = [f"u({name}) = {u:.2g} mm" for name, u in (("x", of_x), ("y", of_y)) if u > 0]
        lines.append(f"Median standard uncertainties: {', '.join(known)}, u(force) = {share}.")
    return "\n".join([*lines, assumed(contacts)])


def tables(contacts: Contacts) -> list[Table]:
    """Return the first frames, and how often each flag is set."""
    count = len(contacts.flags)
    unit = "" if contacts.unit == "1" else f" ({contacts.unit})"
    rows = []
    for i in range(min(count, _PRINTED)):
        u = contacts.uncertainties[i]
        rows.append(
            (
                f"{contacts.frame[i]:g}",
                _cell(contacts.x[i] / MM, u[0] / MM),
                _cell(contacts.y[i] / MM, u[1] / MM),
                _cell(contacts.force[i], u[2]),
                contacts.flags[i],
            )
        )
    title = "Contacts (± standard uncertainty, k = 1)"
    if count > _PRINTED:
        title += f": the first {_PRINTED} of {count} frames"
    head = ("frame", "x (mm)", "y (mm)", f"force{unit}", "flags")
    set_in = Counter(flag for text in contacts.flags for flag in text.split("; ") if flag)
    flags = [(flag, str(number)) for flag, number in set_in.most_common()]
    return [Table(title, head, rows), Table("Flags", ("flag", "frames"), flags)]


def _cell(value: float, u: float) -> str:
    if np.isnan(value):
        return "-"
    return f"{value:.4g}" if np.isnan(u) else format_measured(value, u)


def mapping(contacts: Contacts) -> Values:
    """Return the object of ``locate --json``."""
    one = contacts.indenter
    indenter = None
    if one is not None:
        indenter = {"shape": one.shape, "radius": {"value": one.radius / MM, "unit": "mm"}}
    return {
        "schema_version": "1",
        "indenter": indenter,
        "assumed_shear": contacts.assumed_shear,
        **declared.members(_quantities(contacts), None, **_values(contacts)),
    }


def frame(contacts: Contacts) -> declared.DataFrame:
    """Return one row for each frame."""
    return declared.data_frame(_quantities(contacts), _values(contacts))


def csv_text(contacts: Contacts) -> str:
    """Return the frames as comma-separated values, below comments; empty: not known."""
    values = _values(contacts)
    heads = []
    columns = []
    for quantity in _quantities(contacts):
        unit = quantity.unit if quantity.dimension in DIMENSIONS else ""
        heads.append(f"{quantity.key} [{unit}]" if unit else quantity.key)
        column = values[quantity.name]
        if quantity.name != "flags":
            column = [_number(value / quantity.scale) for value in column]
        columns.append(column)
    text = io.StringIO()
    for line in answer(contacts).splitlines():
        text.write(f"# {line}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(zip(*columns, strict=True))
    return text.getvalue()


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.9g}"
