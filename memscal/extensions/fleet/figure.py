"""Figure of a fleet of sensors: distributions, failures, and the map of the wafer."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from memscal.extensions.fleet.results import FleetResults, robust_limit, robust_spread
from memscal.extensions.fleet.results_summary import error_classes, failures, verdict
from memscal.figures.report import Picture, Report
from memscal.figures.style import (
    DECONVOLVED,
    FAILED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    drawable,
    legend_above,
    panels_of,
)
from memscal.model.arrays import FloatArray, Values
from memscal.summaries.declared import power_of_ten

_MOST_BINS = 60
_MOST_BARS = 12
#: Ticks whose labels have room.
_TICKS = 5
#: Markers that are drawn as an image, which keeps a page of many sensors small.
_MANY = 2000


def fleet_figure(fleet: FleetResults) -> Figure:
    """Draw the distributions of A and sigma, failures by kind, and A over wafer or batch."""
    power = power_of_ten(fleet.conversion_constant)
    power = 0 if -2 <= power <= 3 else power
    unit = f"$10^{{{power}}}$ {fleet.unit}" if power else fleet.unit
    with panels_of(5.6, 2, 2, note="") as (figure, panels):
        label = f"conversion constant $A$ ({unit})"
        _distribution(panels[0, 0], fleet.conversion_constant / 10.0**power, label)
        _distribution(panels[0, 1], fleet.gaussian_sigma, r"Gaussian width $\sigma$ (mm)")
        _failures(panels[1, 0], fleet)
        _places(figure, panels[1, 1], fleet)
    return figure


def _distribution(axes: Axes, values: FloatArray, label: str) -> None:
    """Draw a histogram of the bulk; values beyond it are counted."""
    axes.set_xlabel(label)
    axes.set_ylabel("sensors")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.xaxis.set_major_locator(MaxNLocator(_TICKS))
    values = values[np.isfinite(values)]
    if not values.size:
        return
    centre = np.median(values)
    spread = robust_spread(values)
    limit = robust_limit(values.size)
    reach = 1.2 * limit * spread
    low = max(values.min(), centre - reach)
    high = min(values.max(), centre + reach)
    inside = values[(values >= low) & (values <= high)]
    bins = int(np.clip(2 * np.cbrt(inside.size), 5, _MOST_BINS))
    axes.hist(inside, bins=bins, color=DECONVOLVED, alpha=0.8)
    axes.axvline(centre, color=MEASURED, lw=1, label="median")
    limits = [centre + sign * limit * spread for sign in (-1, 1) if spread > 0]
    for i, end in enumerate(end for end in limits if low <= end <= high):
        name = f"{'_' * i}{limit:.2g} robust deviations"
        axes.axvline(end, color=GAUSSIAN, lw=1, ls="--", label=name)
    if low < high:
        margin = 0.04 * (high - low)
        axes.set_xlim(low - margin, high + margin)
    beyond = values.size - inside.size
    if beyond:
        axes.set_xlabel(f"{label}\n{beyond} of {values.size} beyond the axis")
    legend_above(axes)


def _failures(axes: Axes, fleet: FleetResults) -> None:
    bars = [(name.replace("_", " "), n, FAILED) for name, n in failures(fleet).items()]
    bars += [(kind, n, MUTED) for kind, n in error_classes(fleet).items()]
    bars = sorted(bars, key=lambda bar: -bar[1])[:_MOST_BARS][::-1]
    axes.set_xlabel("sensors (grey: errors, not calibrated)")
    if not bars:
        axes.text(0.5, 0.5, "no failed check, no error", ha="center", transform=axes.transAxes)
        axes.set(xticks=[], yticks=[])
        return
    names, numbers, colours = zip(*bars, strict=True)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.barh(range(len(bars)), numbers, color=colours)
    axes.set_yticks(range(len(bars)), [drawable(name) for name in names], fontsize=7)
    axes.set_ylim(-0.7, max(len(bars), 5) - 0.3)


def _places(figure: Figure, axes: Axes, fleet: FleetResults) -> None:
    """Draw A relative to its median over the wafer, or along the batch without positions."""
    a = fleet.conversion_constant
    finite = np.isfinite(a)
    change = 100 * (a / np.median(a[finite]) - 1) if finite.any() else a
    failed = np.zeros(a.size, dtype=bool)
    failed[list(fleet.failed)] = True
    limit = 3 * robust_spread(change[finite]) or 1.0
    label = "$A$ over its median, less 1 (%)"
    x = fleet.wafer_x
    y = fleet.wafer_y
    placed = np.isfinite(x) & np.isfinite(y)
    shown: Values = {"rasterized": a.size > _MANY, "linewidths": 0}
    size = np.clip(4e3 / max(a.size, 1), 1, 40)
    if placed.any():
        some = placed & finite
        points = axes.scatter(
            x[some],
            y[some],
            s=size,
            c=change[some],
            cmap="RdBu_r",
            vmin=-limit,
            vmax=limit,
            **shown,
        )
        figure.colorbar(points, ax=axes, label=label, extend="both")
        # The panel stays as it is: of a single row the axes show more.
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.1)
        axes.set_xlabel("$x$ on the wafer (mm)")
        axes.set_ylabel("$y$ on the wafer (mm)")
    else:
        x = np.arange(a.size, dtype=np.float64)
        y = change
        placed = np.ones(a.size, dtype=bool)
        axes.scatter(x, y, s=min(size, 8), color=DECONVOLVED, **shown)
        axes.set_xlabel("place in the batch")
        axes.set_ylabel(label)
    marks = failed & placed
    if marks.any():
        shown["linewidths"] = 0.8
        y = np.where(np.isfinite(y), y, 0.0)
        kinds = {"check failed": marks & finite, "not calibrated": marks & ~finite}
        for (name, some), colour in zip(kinds.items(), (MEASURED, MUTED), strict=True):
            if some.any():
                shown |= {"color": colour, "label": f"{name} ({some.sum()})"}
                axes.scatter(x[some], y[some], s=max(size, 6.0), marker="x", **shown)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=7)


def report(fleet: FleetResults) -> Report:
    """Return what the page of a fleet says beside its tables."""
    counts = verdict(fleet)
    caption = (
        "a, b: distributions of A and of the Gaussian width fitted to the scan. c: sensors that "
        "failed each check, and errors by class. d: A over the wafer, or along the batch."
    )
    picture = Picture(fleet.plot, f"Panels: {caption} {counts}", caption)
    return Report(
        title=f"Calibrations of {fleet.name}",
        verdict=counts,
        failed=bool(fleet.failed),
        pictures=[picture],
        messages=fleet.messages,
    )
