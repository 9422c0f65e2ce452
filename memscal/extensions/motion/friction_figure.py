"""Figure of measured profiles beside sliding contacts, and of friction by speed or load."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.motion.compare_sliding import SlidingComparison
from memscal.figures.style import (
    MEASURED,
    draw_zero,
    legend_above,
    load_looks,
    mark,
    panels_of,
)
from memscal.model.quantities import KPA, MM

_NOTE = "Bars: 95 % intervals of the friction coefficient."


def friction_figure(comparison: SlidingComparison) -> Figure:
    """Draw the profiles with their fits, and the friction coefficient by speed."""
    columns = 2 if comparison.speeds else 1
    note = _NOTE if comparison.speeds else ""
    with panels_of(3.2, 1, columns, note=note, squeeze=False) as (figure, panels):
        profiles, *by_speed = panels[0]
        _draw_profiles(profiles, comparison)
        for axes in by_speed:
            _draw_speeds(axes, comparison)
    return figure


def _draw_profiles(axes: Axes, comparison: SlidingComparison) -> None:
    """Draw points and fits: open points and dashed lines where the indenter slid back."""
    profiles = comparison.measured.profiles
    speeds = [profile.scan.speed for profile in profiles]
    shades = speeds if comparison.speeds else [profile.load for profile in profiles]
    looks = load_looks(shade or 0.0 for shade in shades)
    draw_zero(axes)
    for profile, shade, curve in zip(profiles, shades, comparison.curves, strict=True):
        x, measured, fitted = curve
        colour, _ = looks[shade or 0.0]
        order = np.argsort(x, kind="stable")
        forth = profile.direction > 0
        look = mark("dry" if forth else "lubricated", colour)
        axes.plot(x / MM, measured / KPA, ls="none", ms=2.5, mew=0.5, alpha=0.5, **look)
        _, drawn = axes.get_legend_handles_labels()
        label = profile.label
        if comparison.speeds and shade:
            label = f"{label}, {shade / MM:.3g} mm/s"
        label = "" if label in drawn else label
        dashes = "-" if forth else "--"
        axes.plot(x[order] / MM, fitted[order] / KPA, dashes, color=colour, lw=1.0, label=label)
    axes.set(xlabel="position (mm)", ylabel="blurred stress $S_{zz}$ (kPa)")
    legend_above(axes)


def _draw_speeds(axes: Axes, comparison: SlidingComparison) -> None:
    """Draw the friction coefficient against the speed."""
    for (state, speed), found in comparison.speeds.items():
        x = speed / MM
        axes.plot([x, x], [found.interval.low, found.interval.upper], color=MEASURED, lw=0.8)
        axes.plot(x, found.best, ms=4, **mark(state, MEASURED))
    axes.set(xlabel="speed (mm/s)", xscale="log", ylabel=r"sliding friction coefficient $\mu$")
