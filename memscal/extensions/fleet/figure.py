"""Figure of a fleet of sensors: distributions, and the maps of the wafer."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from memscal.extensions.fleet.results import SUMMARISED, FleetResults, median, robust_spread
from memscal.extensions.fleet.results_summary import outliers, verdict
from memscal.figures.report import Picture, Report
from memscal.figures.style import (
    DECONVOLVED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    drawable,
    legend_above,
    panels_of,
)
from memscal.model.arrays import FloatArray, Values

_MOST_BINS = 60
_MOST_NAMES = 12
#: Characters of a name beside its place.
_LONGEST_NAME = 16
#: What a histogram shows, in robust standard deviations from the median.
_REACH = 8.0
#: Markers that are drawn as an image, which keeps a page of many sensors small.
_MANY = 2000


def fleet_figure(fleet: FleetResults) -> Figure:
    """Draw the distributions of A and sigma, and both over wafer or batch, from their medians."""
    with panels_of(5.6, 2, 2, note="") as (figure, panels):
        for (symbol, name), (upper, lower) in zip(SUMMARISED.items(), panels.T, strict=True):
            values = getattr(fleet, name)
            middle = median(values)
            label = f"{symbol} over {middle:.4g} {fleet.unit_of(symbol)}, less 1 (%)"
            label = label.replace("sigma", "σ")
            change = 100 * (values / middle - 1)
            _distribution(upper, change, label)
            if symbol in fleet.tolerances:
                centre, allowed = fleet.allowed(symbol)
                ends = 100 * (np.array([centre - allowed, centre + allowed]) / middle - 1)
                upper.axvspan(*ends, color=GAUSSIAN, alpha=0.2, zorder=0, label="tolerance")
                legend_above(upper)
            _places(lower, fleet, change, label)
    return figure


def _distribution(axes: Axes, change: FloatArray, label: str) -> None:
    """Draw a histogram of the bulk; values beyond it are in its last bins."""
    axes.set_xlabel(label)
    axes.set_ylabel("sensors")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    known = change[np.isfinite(change)]
    if known.size:
        reach = _REACH * robust_spread(known)
        bins = int(np.clip(2 * np.cbrt(known.size), 5, _MOST_BINS))
        axes.hist(np.clip(known, -reach, reach), bins=bins, color=DECONVOLVED, alpha=0.8)
        axes.axvline(0.0, color=MEASURED, lw=1, label="median")
        legend_above(axes)


def _places(axes: Axes, fleet: FleetResults, change: FloatArray, label: str) -> None:
    """Draw changes over the wafer, or along the batch without places."""
    x = fleet.wafer_x
    y = fleet.wafer_y
    axes.margins(0.1)
    if np.isfinite(x + y).any():
        # The panel stays as it is: of a single row the axes show more.
        axes.set_aspect("equal", adjustable="datalim")
        counted = fleet.place_unit == "die"
        axes.set_xlabel("column of dies" if counted else "$x$ on the wafer (mm)")
        axes.set_ylabel("row of dies" if counted else "$y$ on the wafer (mm)")
        centre = (np.nanmin(x) + np.nanmax(x)) / 2, (np.nanmin(y) + np.nanmax(y)) / 2
        radius = np.nanmax(np.hypot(x - centre[0], y - centre[1]))
        axes.add_patch(Circle(centre, radius, fill=False, color=MUTED, lw=0.8))
    else:
        x = np.arange(change.size, dtype=np.float64)
        y = np.nan_to_num(change)
        axes.set_xlabel("place in the batch")
        axes.set_ylabel(label)
    limit = np.nan_to_num(3 * robust_spread(change)) or 1.0
    size = np.clip(4e3 / change.size, 1, 40)
    shown: Values = {"s": size, "rasterized": change.size > _MANY}
    colours: Values = {"c": change, "cmap": "coolwarm", "vmin": -limit, "vmax": limit}
    points = axes.scatter(x, y, linewidths=0, **colours, **shown)
    axes.figure.colorbar(points, ax=axes, label=label, extend="both")
    placed = np.isfinite(x + y)
    for i in [i for i in outliers(fleet) if placed[i]][:_MOST_NAMES]:
        name = drawable(fleet.sensors[i][:_LONGEST_NAME])
        axes.annotate(name, (x[i], y[i]), (3, 3), textcoords="offset points", fontsize=6)
    checks = fleet.failed.keys() - fleet.errors.keys()
    marks = (("not calibrated", fleet.errors, MUTED), ("check failed", checks, MEASURED))
    for name, some, colour in marks:
        marked = [i for i in some if placed[i]]
        if marked:
            shown |= {"color": colour, "label": f"{name} ({len(marked)})"}
            axes.scatter(x[marked], y[marked], marker="x", linewidths=0.8, **shown)
    legend_above(axes)


def report(fleet: FleetResults) -> Report:
    """Return what the page of a fleet says beside its tables."""
    counts = verdict(fleet)
    caption = (
        "a, b: distributions of A and of the Gaussian width fitted to the scan; the last bins hold "
        "what is beyond them. c, d: both over the wafer, or along the batch, with the names of "
        "outliers."
    )
    return Report(
        title=f"Calibrations of {fleet.name}",
        verdict=counts,
        failed=bool(fleet.failed),
        pictures=[Picture(fleet.plot, f"Panels: {caption} {counts}", caption)],
        messages=fleet.messages,
    )
