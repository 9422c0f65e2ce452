"""Figure of an array: map of A, crosstalk, residuals, readings of each sensor, noise, bound."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.arrays.array_checks import IDENTIFIED
from memscal.extensions.arrays.bound_figure import bound_map
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.extensions.arrays.summary import array_of, identified
from memscal.figures.report import Picture, Report
from memscal.figures.style import (
    DECONVOLVED,
    FAILED,
    GAUSSIAN,
    MEASURED,
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
#: Readings up to so many thicknesses from the sensor are drawn.
_NEAR = 3.0
_CAPTION = (
    "a: A at the centres of the sensors; lines: deviations from the layout, 20 times as long; "
    "crosses: sensors that are not used. b: what the sensor of a row reads of that of a column; "
    "grey: not estimated, or not identified. c: residuals in standard deviations of a reading; a "
    "stripe along a row is a sensor, one down a column a press. d: readings of each sensor by the "
    "distance from it, and what the array predicts. e, f: least uncertainties of place and force "
    "of a contact at the load of the scan, by the noise and shear over force of 0 ± 0.3 (k = 1). "
    "g: correlation of the noise."
)


def array_figure(result: Any) -> Figure:
    """Draw a calibrated array; of measured fields the map of the bound alone."""
    array = array_of(result)
    if array.kernel == "measured":
        with panels_of(3.6, 1, 2, note="") as (figure, panels):
            bound_map(array, *panels)
        return figure
    deviation = np.sqrt(np.diag(array.noise))
    readings = array.readings
    residuals = (readings.u - readings.predicted) / deviation[:, None]
    correlation = array.noise / np.outer(deviation, deviation)
    with panels_of(11.0, 4, 2, note="") as (figure, panels):
        places, crosstalk, scan, profiles, of_place, of_force, noise, rest = panels.flat
        _draw_places(places, array)
        _draw_crosstalk(crosstalk, array)
        _draw_matrix(scan, array, residuals, "residual over noise", _FARTHEST)
        scan.set(aspect="auto", xlabel="press")
        _draw_readings(profiles, array)
        bound_map(array, of_place, of_force)
        _draw_matrix(noise, array, correlation, "correlation of the noise", 1.0)
        rest.remove()
    return figure


def _draw_places(axes: Axes, array: SensorArray) -> None:
    """Draw A at the centres, and how far these are from the layout."""
    shown = Quantity("a", "voltage per stress").read_in(array.reading)
    a = array.conversion_constants / shown.scale
    x, y = array.places.T / MM
    points = axes.scatter(x, y, c=a, s=30)
    axes.figure.colorbar(points, ax=axes, label=f"A ({shown.unit})")
    if array.layout is not None:
        away = array.places - array.layout
        end = array.places + _LONGER * (away - np.nanmean(away, axis=0))
        # Where sensors are not where they should be, lines end at the panel's edge.
        lines = [x, end[:, 0] / MM], [y, end[:, 1] / MM]
        axes.plot(*lines, color=GAUSSIAN, scalex=False, scaley=False)
        axes.plot(*array.layout[~array.used].T / MM, "x", color=FAILED)
    for i in np.flatnonzero(array.used) if a.size <= _MOST_NUMBERS else ():
        number = f"{a[i]:.2e}"
        axes.annotate(
            number, (x[i], y[i]), (-3, 4), textcoords="offset points", fontsize=6, rotation=45
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x (mm)", ylabel="y (mm)")


def _draw_crosstalk(axes: Axes, array: SensorArray) -> None:
    """Draw the crosstalk that is identified, with its uncertainty."""
    errors = array.crosstalk_uncertainties
    known = array.estimated & identified(array)
    crosstalk = 100 * np.where(known, array.crosstalk, np.nan)
    largest = 200 * np.max(abs(array.crosstalk), where=known, initial=IDENTIFIED)
    u = f"u up to {percent(errors[known].max())}" if known.any() else "not identified"
    _draw_matrix(axes, array, crosstalk, f"crosstalk (%), {u}", largest)


def _draw_matrix(
    axes: Axes, array: SensorArray, values: FloatArray, label: str, limit: float
) -> None:
    """Draw a row of values for each sensor; grey where there is none."""
    axes.set_facecolor("#D0D0D0")
    image = axes.imshow(values, cmap="RdBu_r", vmin=-limit, vmax=limit, interpolation="nearest")
    axes.figure.colorbar(image, ax=axes, label=label)
    _name_rows(axes, array)
    axes.set_xlabel("sensor")
    if len(values.T) == len(values) <= _MOST_NUMBERS:
        axes.set_xticks(range(len(values)), map(drawable, array.sensors), rotation=90)


def _name_rows(axes: Axes, array: SensorArray) -> None:
    if len(array.sensors) <= _MOST_NUMBERS:
        axes.set_yticks(range(len(array.sensors)), map(drawable, array.sensors))


def _draw_readings(axes: Axes, array: SensorArray) -> None:
    """Draw what each sensor reads near the rod, measured and predicted, in a row of its own."""
    readings = array.readings
    for i in np.flatnonzero(array.used).tolist():
        distance = array.distances(i)
        near = np.argsort(distance)
        near = near[abs(distance[near]) < _NEAR * array.film.thickness]
        both = np.stack([readings.u[i], readings.predicted[i]]) - readings.background[i]
        # Upwards, as the rows of the other panels go downwards.
        measured, predicted = i - 0.8 * both[:, near] / both[1].max()
        axes.plot(distance[near] / MM, measured, ".", ms=1.5, color=MEASURED, rasterized=True)
        axes.plot(distance[near] / MM, predicted, color=DECONVOLVED, lw=0.6)
    _name_rows(axes, array)
    axes.invert_yaxis()
    axes.set_xlabel("distance (mm)")


def report(result: Any) -> Report:
    """Return what the page of an array says beside its tables."""
    array = array_of(result)
    process = array.process
    return Report(
        title=f"Array of {len(array.sensors)} sensors",
        pictures=[Picture(result.plot, _CAPTION, _CAPTION)],
        checks=array.checks,
        messages=array.messages,
        files={"scan": process.input_scan},
        process=process,
    )
