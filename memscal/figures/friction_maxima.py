"""Measured over frictionless maximum against the load, among calculated ones."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.figures.friction_scale import (
    LUBRICATIONS,
    friction_colours,
    friction_name,
    lubricated_words,
    main_loading,
)
from memscal.figures.style import COLOURS, house_style, legend_above, new_figure, panel_letter
from memscal.friction.results import FrictionComparison
from memscal.model.validation import FloatArray

__all__ = ["draw_maxima", "maxima_figure"]

_SHOWN = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, np.inf)
#: Labels at the ends of curves keep this share of the panel's height apart.
_APART = 0.045
_ROOM = 0.22


def maxima_figure(found: FrictionComparison) -> Figure:
    """Draw S_max/p0_max against the load, as Figure 5 of the paper.

    Parameters
    ----------
    found : FrictionComparison
        What was compared.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each definition of the loading: measured ratios with standard uncertainties,
        dry and lubricated, and curves of p_max/p0_max for several friction coefficients.
    """
    with house_style():
        figure = new_figure(3.4)
        count = len(found.loadings)
        panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
        for axes, loading in zip(panels, found.loadings, strict=True):
            draw_maxima(axes, found, loading)
        for axes, letter in zip(panels, "abc", strict=False):
            panel_letter(axes, letter)
        for axes in panels[1:]:
            axes.set_ylabel("")
    return figure


def draw_maxima(axes: Axes, found: FrictionComparison, loading: str | None = None) -> None:
    """Draw the ratios of one definition of the loading, and the calculated curves."""
    loading = main_loading(found, loading)
    loads, curves = _curves(found, loading)
    ends = []
    for mu in _shown(found.friction):
        curve = curves[:, int(np.flatnonzero(found.friction == mu)[0])]
        (line,) = axes.plot(loads, curve, color=friction_colours(mu)[0], lw=0.9)
        line.set_gid(f"mu={mu:g}")
        ends.append((float(curve[-1]), mu))
    for lubrication in dict.fromkeys(one.lubrication for one in found.loads[loading]):
        _draw_ratios(axes, found, loading, lubrication)
    _make_room(axes, float(loads[0]), float(loads[-1]))
    _name_ends(axes, float(loads[-1]), ends)
    axes.set_xlabel("load (N)")
    axes.set_ylabel(r"$S_{max}/p^0_{max}$")
    words = f"{loading} loading" if loading else "as given"
    axes.annotate(words, (0.03, 0.96), xycoords="axes fraction", va="top", fontsize=7)
    legend_above(axes, columns=3)


def _shown(friction: FloatArray) -> list[float]:
    """Return coefficients to draw: the usual ones that were calculated, and the ends."""
    wanted = {float(mu) for mu in friction if mu in _SHOWN} | {float(friction[0])}
    return sorted(wanted | {float(friction[-1])})


def _curves(found: FrictionComparison, loading: str) -> tuple[FloatArray, FloatArray]:
    """Return loads, increasing, and the calculated maxima over the frictionless ones there."""
    by_load = {one.load: one.p_max / one.p0_max for one in found.loads[loading]}
    loads = sorted(by_load)
    return np.array(loads), np.array([by_load[load] for load in loads])


def _draw_ratios(axes: Axes, found: FrictionComparison, loading: str, lubrication: str) -> None:
    of_it = [one for one in found.loads[loading] if one.lubrication == lubrication]
    marker, filled = LUBRICATIONS.get(lubrication, LUBRICATIONS[""])
    black = COLOURS["measured"]
    axes.errorbar(
        [one.load for one in of_it],
        [one.ratio for one in of_it],
        [one.ratio_uncertainty for one in of_it],
        fmt=marker, color=black, mfc=black if filled else "white", ms=4, mew=0.8,
        elinewidth=0.8, capsize=2, label=lubricated_words(lubrication), zorder=3,
    )  # fmt: skip


def _make_room(axes: Axes, first: float, last: float) -> None:
    """Leave room at the right for the curves' names."""
    span = max(last - first, 0.2 * last)
    axes.set_xlim(min(0.0, first), last + _ROOM * span)


def _name_ends(axes: Axes, x: float, ends: list[tuple[float, float]]) -> None:
    """Name the curves at their ends; those that end together share a name."""
    low, high = axes.get_ylim()
    groups: list[list[tuple[float, float]]] = []
    for end in sorted(ends):
        if groups and end[0] - groups[-1][-1][0] < _APART * (high - low):
            groups[-1].append(end)
        else:
            groups.append([end])
    for group in groups:
        height = float(np.mean([value for value, _ in group]))
        text = _group_name([mu for _, mu in group])
        axes.annotate(
            text if group is not groups[-1] else rf"$\mu$ {text if '≥' in text else '= ' + text}",
            (x, height), (7, 0), textcoords="offset points", va="center", fontsize=6.5,
            color=friction_colours(max(mu for _, mu in group))[0],
        )  # fmt: skip


def _group_name(group: list[float]) -> str:
    """Return one name for curves that end together."""
    low, high = min(group), max(group)
    if low == high:
        return friction_name(low)
    return f"≥ {friction_name(low)}" if np.isinf(high) else f"{friction_name(low)}–{high:.3g}"
