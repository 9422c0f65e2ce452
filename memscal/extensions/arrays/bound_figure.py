"""Map of the least uncertainties with which an array locates a contact."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.bound import bound
from memscal.extensions.arrays.locate import Seeking
from memscal.figures.style import DECONVOLVED, MUTED
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM

#: Places along each axis of a map, and along a row; how far beyond the sensors they go, in
#: thicknesses.
_FINE = 41
_ALONG = 241
_BEYOND = 1.0


def bound_map(
    array: ArrayData, of_place: Axes, of_force: Axes, *, force: float = 1.0, shear: float = 0.3
) -> None:
    """Draw u(x), in mm, and u(force), in percent, of a force (N) at a point; of a row as curves."""
    centres = array.places[array.used]
    low = centres.min(axis=0) - _BEYOND * array.film.thickness
    high = centres.max(axis=0) + _BEYOND * array.film.thickness
    axes = Seeking.on(array, "point", shear).axes
    count = _FINE if len(axes) > 1 else _ALONG
    middle = centres.mean(axis=0)
    x, y = (
        np.linspace(low[i], high[i], count) if i in axes else middle[i : i + 1] for i in range(2)
    )
    places = np.stack(np.meshgrid(x, y), axis=-1)
    covariance = bound(array, places.reshape(-1, 2), force, shear=shear)
    errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).reshape(*places.shape[:2], 3)
    name = "xy"[axes[0]]
    drawn = (
        (of_place, errors[..., axes[0]] / MM, f"least $u({name})$ (mm)"),
        (of_force, 100 * errors[..., 2] / force, "least $u$(force) (%)"),
    )
    for panel, values, text in drawn:
        if len(axes) < 2:
            panel.plot((x, y)[axes[0]] / MM, values.ravel(), color=DECONVOLVED)
            for centre in centres[:, axes[0]] / MM:
                panel.axvline(centre, color=MUTED, lw=0.5, ls=":")
            panel.set(yscale="log", xlabel=f"${name}$ (mm)", ylabel=text)
        else:
            _draw_map(panel, places / MM, values, text)
            panel.plot(*centres.T / MM, "s", mfc="none", color="white", ms=4)


def _draw_map(panel: Axes, places: FloatArray, values: FloatArray, label: str) -> None:
    x, y = np.moveaxis(places, -1, 0)
    drawn = panel.pcolormesh(x, y, values, norm=LogNorm(), shading="gouraud")
    panel.figure.colorbar(drawn, ax=panel, label=label)
    panel.set(aspect="equal", xlabel="$x$ (mm)", ylabel="$y$ (mm)")
