"""Figure of the measured fields of an array: a map of each sensor."""

import numpy as np
from matplotlib.figure import Figure

from memscal.extensions.arrays.array_data import ArrayData
from memscal.figures.style import panels_of
from memscal.model.quantities import MM


def measured_figure(array: ArrayData) -> Figure:
    """Draw the smoothed field of each sensor, per press, over the places of the presses."""
    readings = array.readings
    fields = readings.predicted / array.reading.scale
    most = np.abs(fields).max()
    x = readings.x / MM
    y = readings.y / MM
    with panels_of(3.0 * len(fields), len(fields), squeeze=False, note="") as (figure, panels):
        for name, field, axes in zip(array.sensors, fields, panels.flat, strict=True):
            drawn = axes.tripcolor(x, y, field, cmap="RdBu_r", vmin=-most, vmax=most)
            axes.set(aspect="equal", title=name, xlabel="$x$ (mm)", ylabel="$y$ (mm)")
            figure.colorbar(drawn, ax=axes, label=f"reading per press ({array.reading.unit})")
    return figure
