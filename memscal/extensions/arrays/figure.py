"""Figure of an array: map of A, crosstalk, residuals, readings of each sensor, noise, bound."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.arrays.array_checks import IDENTIFIED
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.extensions.arrays.summary import answer, array_of, identified
from memscal.figures.report import Picture, Report
from memscal.figures.style import (
    DECONVOLVED,
    FAILED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    drawable,
    panels_of,
)
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM, Quantity
from memscal.summaries.table import percent

#: Deviations of the centres from the layout are drawn so many times as long.
_LONGER = 20.0
#: Up to so many sensors have their numbers in the panels, and are named at the axes.
_MOST_NUMBERS = 16
#: Residuals are drawn up to so many standard deviations.
_FARTHEST = 4.0
#: Readings up to so many thicknesses from the sensor are drawn, in this share of its cell.
_NEAR = 3.0
_FILLED = 0.85
_CAPTION = (
    "a: A at the centres of the sensors; lines: deviations from the layout, 20 times as long; "
    "crosses: sensors that are not used. b: what the sensor of a row reads of that of a column; "
    "grey: not estimated, or not identified. c: residuals in standard deviations of a reading; a "
    "stripe along a row is a sensor, one down a column a press. d: readings of each sensor by the "
    "distance from it, and what the array predicts. e: correlation of the noise."
)


def array_figure(result: Any) -> Figure:
    """Draw a calibrated array."""
    array = array_of(result)
    deviation = np.sqrt(np.diag(array.noise))
    readings = array.readings
    residuals = (readings.u - readings.predicted) / deviation[:, None]
    correlation = array.noise / np.outer(deviation, deviation)
    with panels_of(9.0, 3, 2, note="") as (figure, panels):
        _draw_places(panels[0, 0], array)
        _draw_crosstalk(panels[0, 1], array)
        _draw_matrix(panels[1, 0], array, residuals, "residual over noise", _FARTHEST)
        panels[1, 0].set(aspect="auto", xlabel="press")
        _draw_readings(panels[1, 1], array)
        _draw_matrix(panels[2, 0], array, correlation, "correlation of the noise", 1.0)
        panels[2, 1].set_axis_off()
    return figure


def _draw_places(axes: Axes, array: SensorArray) -> None:
    """Draw A at the centres, and how far these are from the layout."""
    shown = Quantity("a", "voltage per stress").read_in(array.reading)
    a = array.conversion_constants / shown.scale
    x, y = array.places.T / MM
    points = axes.scatter(x, y, c=a, s=30, zorder=2)
    axes.figure.colorbar(points, ax=axes, label=f"A ({shown.unit})")
    if array.layout is not None:
        away = array.places - array.layout
        ends = array.places + _LONGER * (away - np.nanmean(away, axis=0))
        axes.plot([x, ends[:, 0] / MM], [y, ends[:, 1] / MM], color=GAUSSIAN, zorder=3)
        axes.plot(*array.layout[~array.used].T / MM, "x", color=FAILED)
    if a.size <= _MOST_NUMBERS:
        power = 10.0 ** np.floor(np.log10(np.nanmedian(a)))
        for i in np.flatnonzero(array.used):
            axes.annotate(
                f"{a[i] / power:.2f}",
                (x[i], y[i]),
                (0, 6),
                textcoords="offset points",
                ha="center",
                fontsize=6,
            )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x (mm)", ylabel="y (mm)")


def _draw_crosstalk(axes: Axes, array: SensorArray) -> None:
    """Draw the crosstalk that is identified, with its uncertainty."""
    errors = array.crosstalk_uncertainties
    known = array.estimated & (errors <= IDENTIFIED) & identified(array)
    crosstalk = 100 * np.where(known, array.crosstalk, np.nan)
    largest = 200 * np.max(abs(array.crosstalk), where=known, initial=IDENTIFIED)
    u = f", u up to {percent(errors[known].max())}" if known.any() else ": not identified"
    _draw_matrix(axes, array, crosstalk, f"crosstalk (%){u}", largest)
    if len(known) <= _MOST_NUMBERS:
        for i, j in np.argwhere(known):
            text = f"{crosstalk[i, j]:.2f}\n±{100 * errors[i, j]:.2f}"
            axes.annotate(text, (j, i), ha="center", va="center", fontsize=5)


def _draw_matrix(
    axes: Axes, array: SensorArray, values: FloatArray, label: str, limit: float
) -> None:
    """Draw a row of values for each sensor; grey where there is none."""
    axes.set_facecolor("#D0D0D0")
    image = axes.imshow(values, cmap="RdBu_r", vmin=-limit, vmax=limit, interpolation="nearest")
    axes.figure.colorbar(image, ax=axes, label=label)
    if len(values) <= _MOST_NUMBERS:
        axes.set_yticks(range(len(values)), map(drawable, array.sensors))


def _draw_readings(axes: Axes, array: SensorArray) -> None:
    """Draw what each sensor reads near the rod, measured and predicted, in a cell of its own."""
    readings = array.readings
    reach = _NEAR * array.film.thickness
    columns = int(np.ceil(np.sqrt(array.used.size)))
    for i, name in enumerate(array.sensors):
        row, column = divmod(i, columns)
        if columns**2 <= _MOST_NUMBERS:
            axes.annotate(drawable(name), (column, -row + _FILLED), fontsize=5, color=MUTED)
        x, y = readings.x - array.places[i, 0], readings.y - array.places[i, 1]
        distance = x if array.on_a_line else np.hypot(x, y)
        near = np.argsort(distance)
        near = near[abs(distance[near]) < reach]
        place = column + _FILLED * (distance[near] / reach + array.on_a_line) / 2
        both = np.stack([readings.u[i], readings.predicted[i]]) - readings.background[i]
        measured, predicted = _FILLED * both[:, near] / both[1, near].max(initial=0.0) - row
        axes.plot(place, measured, ".", ms=1.5, color=MEASURED, rasterized=True)
        axes.plot(place, predicted, color=DECONVOLVED, lw=0.6)
    axes.set_axis_off()


def report(result: Any) -> Report:
    """Return what the page of an array says beside its tables."""
    array = array_of(result)
    found = answer(array)
    return Report(
        title=f"Array of {len(array.sensors)} sensors",
        verdict=found,
        leading=3,
        pictures=[Picture(result.plot, f"{_CAPTION} {found}", _CAPTION)],
        checks=array.checks,
        messages=array.process.messages,
        files={"scan": array.process.input_scan},
        process=array.process,
    )
