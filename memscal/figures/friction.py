"""A comparison of measured with calculated stress at a glance, and all of its figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.figures.friction_profiles import (
    draw_profiles,
    draw_residuals,
    friction_set_figure,
    profile_figure,
)
from memscal.figures.friction_readings import (
    draw_effective,
    draw_levels,
    effective_friction_figure,
    likelihood_figure,
)
from memscal.figures.friction_scale import (
    LUBRICATIONS,
    chosen,
    friction_axis,
    friction_colours,
    friction_name,
    friction_position,
    lubricated_words,
    main_loading,
)
from memscal.figures.style import COLOURS, house_style, legend_above, new_figure, panel_letter
from memscal.friction.family import FRICTION_SCALE
from memscal.friction.results import FrictionComparison, InterfaceComparison, LawComparison
from memscal.model.arrays import FloatArray

__all__ = [
    "comparison_figure",
    "comparison_figures",
    "draw_maxima",
    "interface_figure",
    "length_position",
    "maxima_figure",
]

_UM = 1e-6
#: The length in the middle of the axis, in m.
_MIDDLE = 3e-6
_TICKS = (0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, np.inf)
_COLOURS = {"tangential": "deconvolved", "normal": "gaussian"}


def interface_figure(found: FrictionComparison) -> Figure:
    """Draw what laws of the interface explain.

    Parameters
    ----------
    found : FrictionComparison
        What was compared, with an interface.

    Returns
    -------
    matplotlib.figure.Figure
        Panel a, profile likelihood of the length over which the interface yields; b, evidence of
        each law over that of the best; c, where dry scans were measured, the coefficient that the
        slip length means at each load, beside that which was found there.

    Raises
    ------
    InputError
        If no interface was compared.
    """
    if found.interface is None:
        raise InputError(
            "There is no law of the interface to draw.",
            cure="Compare with interface=True and a macroscopic friction coefficient.",
        )
    parts = _parts(found.interface)
    with house_style():
        figure = new_figure(3.0)
        implied = found.interface.tangential
        widths = (1.0, 1.0, 1.0) if implied is not None and implied.implied is not None else (1, 1)
        panels = figure.subplots(1, len(widths), width_ratios=widths)
        _draw_lengths(panels[0], parts)
        _draw_evidence(panels[1], parts)
        if implied is not None and len(widths) == 3:
            _draw_implied(panels[2], found, implied)
        for axes, letter in zip(panels, "abc", strict=False):
            panel_letter(axes, letter)
    return figure


def _parts(found: InterfaceComparison) -> dict[str, LawComparison]:
    both = {"tangential": found.tangential, "normal": found.normal}
    return {name: part for name, part in both.items() if part is not None}


def length_position(length: ArrayLike) -> FloatArray:
    r"""Return where a length (m) stands on an axis from 0 to infinity: 3 um in its middle.

    Examples
    --------
    >>> length_position([0.0, 3e-6, np.inf])
    array([0. , 0.5, 1. ])
    """
    return friction_position(FRICTION_SCALE * np.asarray(length, dtype=np.float64) / _MIDDLE)


def _draw_lengths(axes: Axes, parts: dict[str, LawComparison]) -> None:
    for direction, part in parts.items():
        rise = np.asarray(part.length.deviance) - float(np.min(part.length.deviance))
        label = f"{direction}, {lubricated_words(part.lubrication)}"
        colour = COLOURS[_COLOURS[direction]]
        axes.plot(length_position(part.length.values), rise, color=colour, label=label)
    draw_levels(axes)
    names = ["∞" if np.isinf(tick) else f"{tick:g}" for tick in _TICKS]
    axes.xaxis.set_ticks(list(length_position(np.array(_TICKS) * _UM)), names)
    axes.set_xlim(-0.02, 1.02)
    axes.set(xlabel="length (um)", ylabel=r"$\chi^2 - \chi^2_{min}$")
    legend_above(axes, columns=1)


def _draw_evidence(axes: Axes, parts: dict[str, LawComparison]) -> None:
    """Draw the logarithm of each law's evidence, below that of the best of its kind."""
    names, height = [], 0
    for direction, part in parts.items():
        best = max(law.log_evidence for law in part.laws)
        for law in part.laws:
            below = law.log_evidence - best
            axes.plot([below, 0.0], [height, height], color="0.8", lw=0.8, zorder=1)
            axes.plot([below], [height], "o", color=COLOURS[_COLOURS[direction]], ms=5)
            names.append(_folded(law.name))
            height += 1
    axes.yaxis.set_ticks(list(range(height)), names)
    axes.set_ylim(height - 0.5, -0.5)
    axes.axvline(0.0, color="0.6", lw=0.6)
    axes.set_xlabel("ln of evidence over the best")


def _folded(name: str, width: int = 22) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(name, width))


def _draw_implied(axes: Axes, found: FrictionComparison, part: LawComparison) -> None:
    implied = part.implied
    if implied is None:
        return
    low, best, high = friction_position(np.sort(implied.friction, axis=1)).T
    blue = COLOURS["deconvolved"]
    axes.fill_between(implied.loads, low, high, color=blue, alpha=0.25, lw=0)
    axes.plot(implied.loads, best, color=blue, label="what the slip length means")
    loads = next(iter(found.loads.values()))
    of_it = [one for one in loads if one.lubrication == part.lubrication]
    for i, one in enumerate(of_it):
        reading = one.by_profile
        top = np.inf if reading.interval.high is None else reading.interval.high
        ends = friction_position([reading.interval.low, top])
        label = "found at each load" if i == 0 else "_found"
        axes.plot([one.load] * 2, ends, color=COLOURS["measured"], lw=1.0, label=label)
        if reading.value is not None:
            place = friction_position([reading.value])
            axes.plot([one.load], place, "o", color=COLOURS["measured"], ms=4)
    friction_axis(axes, "y", r"effective friction coefficient $\mu_e$")
    axes.set_xlabel("load (N)")
    axes.set_xlim(left=0)
    legend_above(axes, columns=1)


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


def comparison_figure(
    found: FrictionComparison, *, lubrication: str | None = None, loading: str | None = None
) -> Figure:
    """Draw what a comparison found on one page.

    Parameters
    ----------
    found : FrictionComparison
        What was compared.
    lubrication : str, optional
        Whose profiles to draw: of the first one measured by default.
    loading : str, optional
        Definition of the loading: the first one compared by default.

    Returns
    -------
    matplotlib.figure.Figure
        Panel a, measured profiles between no friction and full stick; b, measured maxima over
        frictionless ones against the load; c, residuals against the frictionless profiles; d, the
        effective friction coefficient against the load.

    Raises
    ------
    InputError
        If nothing was measured or compared so.
    """
    loading = main_loading(found, loading)
    loads = chosen(found, loading, lubrication)
    with house_style():
        figure = new_figure(5.6)
        panels = figure.subplots(2, 2)
        draw_profiles(panels[0, 0], found, loads)
        draw_maxima(panels[0, 1], found, loading)
        draw_residuals(panels[1, 0], found, loads, 0)
        panels[1, 0].set_xlim(panels[0, 0].get_xlim())
        draw_effective(panels[1, 1], found, loads[0].lubrication, loading)
        legend_above(panels[1, 1], columns=2)
        for axes, letter in zip(panels.flat, "abcd", strict=True):
            panel_letter(axes, letter)
    return figure


def comparison_figures(found: FrictionComparison) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each figure of a comparison, by the stem of its file's name.

    Parameters
    ----------
    found : FrictionComparison
        What was compared.

    Returns
    -------
    mapping of str to callable
        ``profiles-dry`` and ``friction-set-dry`` (one for each lubrication), ``maxima``,
        ``effective-friction`` and ``likelihood``, and ``interface`` where one was compared; each
        draws when it is called.
    """
    figures: dict[str, Callable[[], Figure]] = {}
    measured = (profile.lubrication for profile in found.measured.profiles)
    for lubrication in dict.fromkeys(measured):
        tail = f"-{lubrication}" if lubrication else ""
        figures[f"profiles{tail}"] = _of(profile_figure, found, lubrication)
        figures[f"friction-set{tail}"] = _of(friction_set_figure, found, lubrication)
    figures["maxima"] = lambda: maxima_figure(found)
    figures["effective-friction"] = lambda: effective_friction_figure(found)
    figures["likelihood"] = lambda: likelihood_figure(found)
    if found.interface is not None:
        figures["interface"] = lambda: interface_figure(found)
    return figures


def _of(
    draw: Callable[..., Figure], found: FrictionComparison, lubrication: str
) -> Callable[[], Figure]:
    return lambda: draw(found, lubrication=lubrication)
