"""The effective friction coefficient against the load, and the likelihoods that it is read from."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.figures import friction_scale as scale
from memscal.figures.friction_scale import friction_position, lubricated_words
from memscal.figures.style import COLOURS, house_style, new_figure, panel_letters
from memscal.friction.results import BoundedEstimate, FrictionComparison, LoadComparison

_READINGS = {
    "by_maximum": ("by the maximum", "gaussian", -1),
    "by_profile": ("by the profile", "deconvolved", 1),
}
#: Both readings of one load stand this share of the loads' span to its left and right.
_ASIDE = 0.008
#: Differences of chi-square that bound 68.3 % and 95 % of one parameter.
_LEVELS = ((1.0, "68 %"), (3.84, "95 %"))
_HIGHEST = 12.0
#: Entries in one line of a legend.
_ENTRIES = 7


def effective_friction_figure(comparison: FrictionComparison) -> Figure:
    """Draw the effective friction coefficient against the load, with intervals.

    A row for each lubrication, a panel for each loading.  Open intervals end in arrows; a band is
    the interval of all loads together.
    """
    return _panels(comparison, draw_effective, 2.7)


def draw_effective(
    axes: Axes, comparison: FrictionComparison, loads: Sequence[LoadComparison]
) -> None:
    """Draw both readings of each load, the joint interval, and the macroscopic coefficient."""
    span = loads[-1].load - loads[0].load or loads[0].load
    for name, (words, colour, side) in _READINGS.items():
        for i, at_load in enumerate(loads):
            reading, x = getattr(at_load, name), at_load.load + side * _ASIDE * span
            look = scale.mark(at_load.lubrication, COLOURS[colour])
            _draw_reading(axes, reading, x, words if i == 0 else "", look)
    _draw_joint(axes, comparison.joint[loads[0].lubrication][loads[0].loading])
    _draw_macroscopic(axes, comparison.macroscopic)
    scale.friction_axis(axes, "y")
    axes.set_xlim(0, loads[-1].load + 0.08 * span)
    axes.set_xlabel("load (N)")


def _draw_reading(
    axes: Axes, reading: BoundedEstimate, x: float, label: str, look: dict[str, Any]
) -> None:
    """Draw a value with its interval; where there is none, the open interval as an arrow."""
    colour = look["color"]
    low, high = reading.interval.low, reading.interval.high
    ends = friction_position([low, math.inf if high is None else high])
    (bar,) = axes.plot([x, x], ends, color=colour, lw=1.0, solid_capstyle="butt")
    bar.set_gid("interval")
    axes.plot([x], ends[:1], "_" if low > 0 else "", color=colour, ms=5, mew=1.0)
    if high is None:
        axes.plot([x], [1.0], "^", color=colour, ms=4, clip_on=False, label="_open")
    else:
        axes.plot([x], ends[1:], "_", color=colour, ms=5, mew=1.0)
    if reading.value is not None:
        (value,) = axes.plot([x], friction_position([reading.value]), ms=4, mew=0.8, **look)
        value.set(ls="none", zorder=3, label="_value")
    if label:
        axes.plot([], [], look["marker"], color=colour, ms=4, ls="-", lw=1.0, label=label)


def _draw_joint(axes: Axes, joint: BoundedEstimate) -> None:
    high = math.inf if joint.interval.high is None else joint.interval.high
    low, top = friction_position([joint.interval.low, high])
    axes.axhspan(low, top, color=COLOURS["reference"], alpha=0.18, lw=0, label="all loads, 95 %")
    if joint.value is not None:
        axes.axhline(float(friction_position(joint.value)), color=COLOURS["reference"], lw=0.8)


def _draw_macroscopic(axes: Axes, macroscopic: tuple[float, float | None] | None) -> None:
    if macroscopic is None:
        return
    value, u = macroscopic
    place = float(friction_position(value))
    axes.axhline(place, color=COLOURS["muted"], lw=0.8, ls="--", label="macroscopic")
    if u:
        low, high = friction_position([max(value - 1.96 * u, 0.0), value + 1.96 * u])
        axes.axhspan(low, high, color=COLOURS["muted"], alpha=0.15, lw=0)


def _panels(
    comparison: FrictionComparison,
    draw: Callable[[Axes, FrictionComparison, Sequence[LoadComparison]], None],
    height: float,
) -> Figure:
    """Draw a row of ``height`` inches for each lubrication, a panel for each loading."""
    lubrications = list(comparison.joint)
    with house_style():
        figure = new_figure(0.6 + height * len(lubrications))
        panels = figure.subplots(
            len(lubrications), len(comparison.loadings), sharex=True, sharey=True, squeeze=False
        )
        for row, lubrication in zip(panels, lubrications, strict=True):
            for axes, loading in zip(row, comparison.loadings, strict=True):
                draw(axes, comparison, scale.chosen(comparison, loading, lubrication))
                words = lubricated_words(lubrication) + (f", {loading} loading" if loading else "")
                axes.set_title(words, fontsize=8, loc="left")
        panel_letters(panels.flat)
        for axes in panels.flat:
            axes.label_outer()
        _one_legend(figure, panels.flat)
    return figure


def _one_legend(figure: Figure, panels: Iterable[Axes]) -> None:
    """Put the entries of all panels above them, each label once."""
    shown: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            shown.setdefault(label, handle)
    of_loads = (label for label in shown if label.endswith(" N"))
    loads = sorted(of_loads, key=lambda label: float(label.removesuffix(" N")))
    order = [*loads, *(label for label in shown if label not in loads)]
    handles = [shown[label] for label in order]
    figure.legend(handles, order, loc="outside upper center", ncols=min(len(order), _ENTRIES))


def likelihood_figure(comparison: FrictionComparison) -> Figure:
    """Draw chi-square above its least value against the coefficient: the profile likelihoods."""
    return _panels(comparison, _draw_likelihood, 2.4)


def _draw_likelihood(
    axes: Axes, comparison: FrictionComparison, loads: Sequence[LoadComparison]
) -> None:
    """Draw chi-square above its least value of each load and of all loads together."""
    looks = scale.load_looks(comparison)
    for at_load in loads:
        _draw_curve(axes, at_load.by_profile, *looks[at_load.load], 1.0)
    joint = comparison.joint[loads[0].lubrication][loads[0].loading]
    _draw_curve(axes, joint, COLOURS["measured"], "all loads", 1.8)
    draw_levels(axes)
    scale.friction_axis(axes, "x")
    axes.set_ylabel(r"$\chi^2 - \chi^2_{min}$")


def draw_levels(axes: Axes) -> None:
    """Draw the levels that bound 68.3 % and 95 %, and end the axis not far above."""
    for level, words in _LEVELS:
        axes.axhline(level, color="0.6", lw=0.6, ls=":")
        axes.annotate(
            words, (0.995, level), (0, 1), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", fontsize=6, color="0.4",
        )  # fmt: skip
    axes.set_ylim(0, _HIGHEST)


def _draw_curve(
    axes: Axes, reading: BoundedEstimate, colour: str, label: str, width: float
) -> None:
    rise = np.asarray(reading.chi_square) - float(np.min(reading.chi_square))
    axes.plot(friction_position(reading.values), rise, color=colour, lw=width, label=label)
