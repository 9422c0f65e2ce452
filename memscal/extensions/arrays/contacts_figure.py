"""Figure of contacts: where they press on the array, and their forces frame by frame."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.arrays.contacts import Contacts
from memscal.extensions.arrays.contacts_summary import assumed
from memscal.figures.style import (
    DECONVOLVED,
    MUTED,
    coverage,
    legend_above,
    panels_of,
)
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM


def contacts_figure(contacts: Contacts) -> Figure:
    """Draw the places over the sensors (of a row: frame by frame), and the forces."""
    errors = contacts.uncertainties
    note = f"Error bars: U = {{0:g}}u. {assumed(contacts)}"
    with panels_of(3.6, 1, 2, note) as (
        figure,
        (left, right),
    ):
        if np.isnan(errors[:, :2]).all(axis=0).any():
            axis = int(np.isnan(errors[:, 0]).all())
            place = (contacts.x, contacts.y)[axis]
            _draw_frames(left, contacts, place / MM, errors[:, axis] / MM)
            left.set(ylabel=f"${'xy'[axis]}$ (mm)")
        else:
            _draw_map(left, contacts)
        _draw_frames(right, contacts, contacts.force, errors[:, 2])
        right.set(ylabel=_force(contacts))
    return figure


def _force(contacts: Contacts) -> str:
    return "force (N)" if contacts.unit == "N" else "force (presses of the scan)"


def _draw_frames(axes: Axes, contacts: Contacts, values: FloatArray, errors: FloatArray) -> None:
    """Draw values with error bars along the frames, or their times."""
    along = contacts.frame if contacts.time is None else contacts.time
    axes.errorbar(along, values, coverage() * errors, fmt="o", ms=3, color=DECONVOLVED)
    axes.set(xlabel="frame" if contacts.time is None else "time (s)")


def _draw_map(axes: Axes, contacts: Contacts) -> None:
    """Draw places with error bars, coloured by force, and the sensors."""
    if contacts.centres is not None:
        axes.plot(*contacts.centres.T / MM, "s", mfc="none", color=MUTED, label="sensors")
    errors = coverage() * contacts.uncertainties / MM
    x = contacts.x / MM
    y = contacts.y / MM
    axes.errorbar(x, y, errors[:, 1], errors[:, 0], fmt="none", color=MUTED, lw=0.6)
    drawn = axes.scatter(x, y, s=12, c=contacts.force, zorder=3, label="contacts")
    axes.figure.colorbar(drawn, ax=axes, label=_force(contacts))
    axes.set(aspect="equal", xlabel="$x$ (mm)", ylabel="$y$ (mm)")
    legend_above(axes)
