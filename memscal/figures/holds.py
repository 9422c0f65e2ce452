"""Figure of a log: the holds that were found in it, and the readings that they give."""

import math

import numpy as np
from matplotlib.figure import Figure

from memscal.figures.style import GAUSSIAN, MEASURED, marker_size, panels_of
from memscal.model.holds import Holds
from memscal.model.quantities import MM

#: Of a longer log so many rows are drawn, evenly.
_MOST_ROWS = 20_000


def holds_figure(holds: Holds) -> Figure:
    """Draw position, load and reading over the lines of the file, and readings over position."""
    mean = holds.mean
    reading = holds.reading
    # Of an array the holds are those of the sum, and each sensor has a mean of its own.
    summed = "sum of all readings" if any(" of " in name for name in mean) else "reading"
    reading_label = f"{summed} ({reading.unit})"
    names = {
        "x": ("x (mm)", MM),
        "y": ("y (mm)", MM),
        "normal_load": ("load (N)", 1.0),
        "u_zz": (reading_label, reading.scale),
    }
    shown = [name for name in names if name in holds.log and np.ptp(holds.log[name]) > 0]
    every = math.ceil(holds.line.size / _MOST_ROWS)
    first = holds.line[holds.first]
    last = holds.line[holds.stop - 1]
    with panels_of(1.6 * (len(shown) + 1.4), len(shown) + 1) as (figure, panels):
        for axes, name in zip(panels, shown, strict=False):
            label, scale = names[name]
            log = holds.log[name][::every] / scale
            axes.plot(holds.line[::every], log, color="0.6", lw=0.7)
            axes.hlines(mean[name] / scale, first, last, color=GAUSSIAN, lw=2.5, zorder=3)
            axes.set_ylabel(label)
            axes.sharex(panels[0])
        panels[0].set_title(
            f"{first.size} holds (thick) in {holds.line.size} rows of the log", loc="left"
        )
        panels[-2].set_xlabel("line of the file")
        axes = panels[-1]
        along = "y" if np.ptp(mean.get("y", 0.0)) > np.ptp(mean["x"]) else "x"
        axes.errorbar(
            mean[along] / MM,
            mean["u_zz"] / reading.scale,
            2 * holds.u_errors / reading.scale,
            color=MEASURED,
            fmt="o",
            ms=marker_size(first.size),
            lw=0.8,
            zorder=3,
        )
        axes.set(xlabel=f"{along} (mm)", ylabel=reading_label)
        axes.set_title("mean of each hold ± 2 standard uncertainties (k = 2)", loc="left")
    return figure
