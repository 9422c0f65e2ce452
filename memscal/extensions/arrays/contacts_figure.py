"""Figure of contacts: where they press on the array, and their forces frame by frame."""

from matplotlib.figure import Figure

from memscal.extensions.arrays.contacts import Contacts
from memscal.figures.style import DECONVOLVED, MUTED, coverage, panels_of
from memscal.model.quantities import MM


def contacts_figure(contacts: Contacts) -> Figure:
    """Draw the places on the array, coloured by force, and the forces frame by frame."""
    note = f"Error bars: U = {{0:g}}u. Squares: sensors. {contacts.assumed}"
    errors = coverage() * contacts.uncertainties
    x = contacts.x / MM
    y = contacts.y / MM
    named = "force (N)" if contacts.unit == "N" else "force (presses of the scan)"
    with panels_of(3.6, 1, 2, note) as (figure, (places, forces)):
        places.plot(*contacts.centres.T / MM, "s", mfc="none", color=MUTED)
        places.errorbar(x, y, errors[:, 1] / MM, errors[:, 0] / MM, fmt="none", color=MUTED, lw=0.6)
        drawn = places.scatter(x, y, s=12, c=contacts.force, zorder=3)
        figure.colorbar(drawn, ax=places, label=named)
        places.set(aspect="equal", adjustable="datalim", xlabel="$x$ (mm)", ylabel="$y$ (mm)")
        along = contacts.frame if contacts.time is None else contacts.time
        forces.errorbar(along, contacts.force, errors[:, 2], fmt="o", ms=3, color=DECONVOLVED)
        forces.set(xlabel="frame" if contacts.time is None else "time (s)", ylabel=named)
    return figure
