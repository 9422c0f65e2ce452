"""Figure of a sliding contact: its stresses along the way, and the base stress from above."""

import numpy as np
from matplotlib.figure import Figure

from memscal.extensions.motion.sliding_contact import SlidingContact
from memscal.figures.style import DECONVOLVED, MEASURED, legend_above, panels_of
from memscal.model.quantities import KPA, MM

#: The base is drawn up to so many thicknesses from the contact.
_AROUND = 2.0
_PLACES = 201


def sliding_figure(contact: SlidingContact) -> Figure:
    """Draw pressure and base stress along the way, and the base stress with the contact's edge."""
    reach = contact.region.high + _AROUND * contact.film.thickness
    x = np.linspace(-reach, reach, _PLACES)
    with panels_of(3.0, 1, 2, note="") as (figure, (along, above)):
        pressure = contact.interface_pressure(x, 0.0)
        along.plot(x / MM, pressure / KPA, "--", color=MEASURED, label="pressure on the film")
        field = contact.base_stress(x, x[:, None]) / KPA
        along.plot(x / MM, field[_PLACES // 2], color=DECONVOLVED, label="stress at the base")
        along.set(xlabel="$x$ (mm), at $y = 0$", ylabel="normal stress (kPa)")
        legend_above(along)
        areas = above.contourf(x / MM, x / MM, field, levels=12, cmap="Blues")
        figure.colorbar(areas, ax=above, label="stress at the base (kPa)")
        # The edge of the contact: a pressure of 1 Pa.
        above.contour(contact.x / MM, contact.y / MM, contact.pressure, [1.0], colors=MEASURED)
        above.set(aspect="equal", xlabel="$x$ (mm)", ylabel="$y$ (mm)")
    return figure
