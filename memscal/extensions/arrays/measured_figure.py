"""Figure of the measured fields of an array: a map of each sensor."""

from math import ceil

import numpy as np
from matplotlib.figure import Figure

from memscal.extensions.arrays.array_data import ArrayData
from memscal.figures.style import panels_of
from memscal.model.quantities import MM

#: Maps beside each other.
_ACROSS = 4


def measured_figure(array: ArrayData) -> Figure:
    """Draw the smoothed field of each sensor, per press, over the places of the presses."""
    readings = array.readings
    fields = readings.predicted / array.reading.scale
    most = np.abs(fields).max()
    rows = ceil(len(fields) / _ACROSS)
    with panels_of(2.4 * rows, rows, _ACROSS, "", squeeze=False) as (figure, panels):
        for name, field, axes in zip(array.sensors, fields, panels.flat, strict=False):
            drawn = axes.tripcolor(
                readings.x / MM, readings.y / MM, field, cmap="RdBu_r", vmin=-most, vmax=most
            )
            axes.set(aspect="equal", title=name, xlabel="$x$ (mm)", ylabel="$y$ (mm)")
        for axes in panels.flat[len(fields) :]:
            axes.remove()
        shown = panels.flat[: len(fields)].tolist()
        figure.colorbar(drawn, ax=shown, label=f"reading per press ({array.reading.unit})")
    return figure
