"""Map of the least uncertainties with which an array locates a contact."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from memscal.errors import InputError
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.bound import bound
from memscal.extensions.arrays.locate import Seeking
from memscal.figures.style import DECONVOLVED, MUTED
from memscal.model.quantities import MM

#: How far the map goes beyond the sensors, and its step, in thicknesses.
_BEYOND = 1.0
_STEP = 0.1


def bound_map(array: ArrayData, of_place: Axes, of_force: Axes) -> None:
    """Draw u(x), in mm, and u(force), in percent, at a point and the load; of a row as curves.

    Of a row that is along neither x nor y, with which nothing is located, there is none.
    """
    try:
        seeking = Seeking.on(array, "point", 0.0, _BEYOND)
    except InputError:
        of_place.remove()
        of_force.remove()
        return
    axis = seeking.axes[0]
    name = "xy"[axis]
    places = seeking.grid(_STEP)
    covariance = bound(array, places, array.load)
    x, y = places.T / MM
    sensors = array.places[array.used] / MM
    for panel, i, scale, label in (
        (of_place, axis, MM, f"least $u({name})$ (mm)"),
        (of_force, 2, array.load / 100, "least $u$(force) (%)"),
    ):
        errors = np.sqrt(covariance[:, i, i]) / scale
        if len(seeking.axes) > 1:
            drawn = panel.tripcolor(x, y, errors, norm=LogNorm(), shading="gouraud")
            panel.figure.colorbar(drawn, ax=panel, label=label)
            panel.plot(*sensors.T, "s", mfc="none", color="white", ms=4)
            panel.set(aspect="equal", xlabel="$x$ (mm)", ylabel="$y$ (mm)")
        else:
            panel.plot(places[:, axis] / MM, errors, color=DECONVOLVED)
            panel.vlines(sensors[:, axis], errors.min(), errors.max(), color=MUTED, lw=0.5, ls=":")
            panel.set(yscale="log", xlabel=f"${name}$ (mm)", ylabel=label)
