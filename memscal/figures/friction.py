"""Figures of a comparison of measured with calculated stress."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.errors import InputError
from memscal.extensions import hook
from memscal.figures.friction_profiles import (
    Loads,
    chosen,
    comparison_looks,
    draw_profiles,
    draw_residuals,
    friction_axis,
    friction_colour,
    friction_name,
    friction_position,
    friction_set_figure,
    joint_estimate,
    lubricated_words,
    profile_figure,
    share_limits,
)
from memscal.figures.style import (
    ALONG_RADIUS,
    COVERAGE_NOTE,
    DECONVOLVED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    REFERENCE,
    coverage,
    entry_columns,
    legend_above,
    mark,
    panels_of,
)
from memscal.friction.results import UNEXPLAINED, BoundedEstimate, FrictionComparison
from memscal.model.arrays import FloatArray, Values

RISE = r"$-2\,\ln(p/p_{max})$"
_INTERVALS = "95 % by profile likelihood, about k = 2"
INTERVAL_NOTE = f"Intervals of friction coefficients and lengths: {_INTERVALS}."
_BOTH_NOTE = f"{COVERAGE_NOTE} Intervals of friction coefficients: {_INTERVALS}."


_SHOWN = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, np.inf)
#: Labels at the ends of curves keep this share of the panel's height apart.
_APART = 0.045
_ROOM = 0.26


def maxima_figure(comparison: FrictionComparison) -> Figure:
    """Draw measured and calculated S_max/p0_max against the load, a panel for each loading."""
    count = len(comparison.loadings)
    with panels_of(3.4, 1, count, sharey=True, squeeze=False) as (figure, panels):
        for axes, loading in zip(panels.flat, comparison.loadings, strict=True):
            _draw_maxima(axes, comparison, loading)
            axes.label_outer()
    return figure


def _draw_maxima(axes: Axes, comparison: FrictionComparison, loading: str) -> None:
    compared = comparison.loads[loading]
    by_load = {at_load.load: at_load.p_max / at_load.p0_max for at_load in compared}
    loads = sorted(by_load)
    curves = np.array([by_load[load] for load in loads])
    shown = np.isin(comparison.friction, _SHOWN)
    shown[[0, -1]] = True
    drawn = {}
    for i in np.flatnonzero(shown):
        mu = comparison.friction[i]
        drawn[mu] = curves[:, i]
        axes.plot(loads, drawn[mu], color=friction_colour(mu), lw=0.9, gid=f"mu={mu:g}")
    for lubrication in dict.fromkeys(at_load.lubrication for at_load in compared):
        measured = [at_load for at_load in compared if at_load.lubrication == lubrication]
        axes.errorbar(
            [at_load.load for at_load in measured],
            [at_load.ratio for at_load in measured],
            [coverage() * at_load.ratio_uncertainty for at_load in measured],
            ms=4,
            mew=0.8,
            ls="none",
            elinewidth=0.8,
            capsize=2,
            zorder=3,
            label=lubricated_words(lubrication),
            **mark(lubrication, MEASURED),
        )
    _name_curves(axes, loads, drawn)
    axes.set_xlabel("load (N)")
    axes.set_ylabel("largest blurred stress\nover frictionless, $S_{max}/p^0_{max}$ (1)")
    words = f"{loading} loading" if loading else "as given"
    axes.annotate(words, (0.03, 0.96), xycoords="axes fraction", va="top", fontsize=7)
    legend_above(axes, columns=3)


def _name_curves(axes: Axes, loads: list[float], curves: Mapping[float, FloatArray]) -> None:
    """Name the curves at the end where more are apart; those that end together share a name."""
    end = max((-1, 0), key=lambda end: len(_apart(axes, curves, end)))
    groups = _apart(axes, curves, end)
    x = loads[end]
    # Room for the names; a load is never negative.
    room = _ROOM * max(loads[-1] - loads[0], 0.2 * loads[-1])
    look: Values = {"textcoords": "offset points", "va": "center", "fontsize": 6.5}
    if end:
        axes.set_xlim(0.0, x + room)
        look |= {"xytext": (7, 0), "ha": "left"}
    else:
        last = loads[-1] + 0.3 * room
        axes.set_xlim(x - room, last)
        axes.set_xticks([tick for tick in axes.get_xticks() if 0 <= tick <= last])
        look |= {"xytext": (-7, 0), "ha": "right"}
    for group in groups:
        height = group[:, 0].mean()
        low = group[:, 1].min()
        high = group[:, 1].max()
        name = f"≥ {low:.3g}" if np.isinf(high) else f"{low:.3g}–{high:.3g}"
        if low == high:
            name = friction_name(low)
        if group is groups[-1]:
            sign = "" if low < high == np.inf else "= "
            name = rf"$\mu$ {sign}{name}"
        axes.annotate(name, (x, height), color=friction_colour(high), **look)


def _apart(axes: Axes, curves: Mapping[float, FloatArray], end: int) -> list[FloatArray]:
    """Group the values of the curves at an end, (n, 2) with their coefficients, by nearness."""
    bottom, top = axes.get_ylim()
    values = np.array(sorted((curve[end], mu) for mu, curve in curves.items()))
    apart = np.diff(values[:, 0]) >= _APART * (top - bottom)
    return np.split(values, np.flatnonzero(apart) + 1)


def comparison_figure(
    comparison: FrictionComparison,
    *,
    name: str = "",
    lubrication: str | None = None,
    loading: str | None = None,
) -> Figure:
    """Draw a comparison on one page, or its figure of a name that ``--figures`` gives to a file.

    The page is by default of the first lubrication and loading.
    """
    if name:
        figures = comparison_figures(comparison)
        if name not in figures:
            raise InputError(
                f"The comparison has no figure {name!r}.", cure=f"Choose from {', '.join(figures)}."
            )
        return figures[name]()
    if comparison.by_shear:
        raise InputError("There is no figure of a comparison by the shear alone.")
    loads = chosen(comparison, lubrication, loading)
    with panels_of(5.6, 2, 2, note=_BOTH_NOTE) as (figure, panels):
        (profiles, maxima), (residuals, effective) = panels
        draw_profiles(profiles, comparison, loads)
        _draw_maxima(maxima, comparison, loads[0].loading)
        best = joint_estimate(comparison, loads).best
        share_limits([residuals], draw_residuals(residuals, comparison, loads, best))
        profiles.set_xlabel(ALONG_RADIUS)
        residuals.set_xlim(profiles.get_xlim())
        _draw_effective(effective, comparison, loads)
        legend_above(effective)
    return figure


def comparison_figures(comparison: FrictionComparison) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each figure of a comparison when called, by the stem of its file's name."""
    figures: dict[str, Callable[[], Figure]] = {}
    if comparison.by_shear:
        # Of a shear alone there is none.
        return figures if comparison.shear else {"sliding": comparison.plot}
    for state in dict.fromkeys(profile.lubrication for profile in comparison.measured.profiles):
        tail = f"-{state}" if state else ""
        figures[f"profiles{tail}"] = partial(profile_figure, comparison, state)
        figures[f"friction-set{tail}"] = partial(friction_set_figure, comparison, state)
    figures["maxima"] = partial(maxima_figure, comparison)
    figures["effective-friction"] = partial(_panels, comparison, _draw_effective, 2.7, _BOTH_NOTE)
    figures["likelihood"] = partial(_panels, comparison, _draw_likelihood, 2.4, INTERVAL_NOTE)
    if comparison.interface:
        figures["interface"] = partial(hook("interface_figure"), comparison)
    return figures


_READINGS = {
    "by_maximum": ("by the maximum", GAUSSIAN, -1),
    "by_profile": ("by the profile", DECONVOLVED, 1),
}
#: Both readings of one load stand this share of the loads' span to its left and right.
_ASIDE = 0.008
#: Differences of chi-square that bound 68.3 % and 95 % of one parameter.
_LEVELS = ((1.0, "68 %"), (3.84, "95 %"))
_HIGHEST = 12.0


def _draw_effective(axes: Axes, comparison: FrictionComparison, loads: Loads) -> None:
    """Draw both readings of each load, the joint interval, and the macroscopic coefficient."""
    span = loads[-1].load - loads[0].load or loads[0].load
    for name, (words, colour, side) in _READINGS.items():
        for i, at_load in enumerate(loads):
            x = at_load.load + side * _ASIDE * span
            look = mark(at_load.lubrication, colour)
            _draw_reading(axes, getattr(at_load, name), x, words if i == 0 else "", look)
    joint = joint_estimate(comparison, loads)
    label = "all loads, 95 %"
    if joint.kind == UNEXPLAINED:
        label = "all loads: none explains them"
    axes.axhspan(*interval_ends(joint), color=REFERENCE, alpha=0.18, lw=0, label=label)
    if joint.value is not None:
        axes.axhline(float(friction_position(joint.value)), color=REFERENCE, lw=0.8)
    if comparison.macroscopic:
        value, u = comparison.macroscopic
        label = f"macroscopic, ±{coverage():g}u" if u else "macroscopic"
        axes.axhline(float(friction_position(value)), color=MUTED, lw=0.8, ls="--", label=label)
        if u:
            spread = coverage() * u
            low, high = friction_position([max(value - spread, 0.0), value + spread])
            axes.axhspan(low, high, color=MUTED, alpha=0.15, lw=0)
    friction_axis(axes, "y")
    axes.set(xlim=(0, loads[-1].load + 0.08 * span), xlabel="load (N)")


def _draw_reading(axes: Axes, reading: BoundedEstimate, x: float, label: str, look: Values) -> None:
    """Draw a value with its interval; where there is none, the open interval as an arrow."""
    colour = look["color"]
    low, high = interval_ends(reading)
    axes.plot([x, x], [low, high], color=colour, lw=1.0, solid_capstyle="butt", gid="interval")
    cap = {"marker": "_", "ls": "none", "color": colour, "ms": 5, "mew": 1.0}
    if reading.interval.low > 0:
        axes.plot(x, low, **cap)
    if reading.interval.high is None:
        axes.plot(x, 1.0, "^", color=colour, ms=4, clip_on=False, label="_open")
    else:
        axes.plot(x, high, **cap)
    if reading.value is not None:
        place = friction_position(reading.value)
        axes.plot(x, place, ms=4, mew=0.8, ls="none", zorder=3, label="_value", **look)
    if label:
        axes.plot([], [], look["marker"], color=colour, ms=4, ls="-", lw=1.0, label=label)


def interval_ends(reading: BoundedEstimate) -> FloatArray:
    """Return where the ends of an interval stand on the axis."""
    return friction_position([reading.interval.low, reading.interval.upper])


def _panels(
    comparison: FrictionComparison,
    draw: Callable[[Axes, FrictionComparison, Loads], None],
    height: float,
    note: str,
) -> Figure:
    """Draw a row of ``height`` inches for each lubrication, a panel for each loading."""
    lubrications = list(comparison.joint)
    rows = len(lubrications)
    columns = len(comparison.loadings)
    with panels_of(
        0.6 + height * rows, rows, columns, note, sharex=True, sharey=True, squeeze=False
    ) as (figure, panels):
        for row, lubrication in zip(panels, lubrications, strict=True):
            for axes, loading in zip(row, comparison.loadings, strict=True):
                draw(axes, comparison, chosen(comparison, lubrication, loading))
                words = lubricated_words(lubrication) + (f", {loading} loading" if loading else "")
                axes.set_title(words, fontsize=8, loc="left")
                axes.label_outer()
        # The entries of all panels stand above them, each label once, those of loads first.
        entries: Values = {}
        for axes in panels.flat:
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                entries.setdefault(label, handle)
        first = dict.fromkeys(name for _, name in comparison_looks(comparison).values())
        order = [label for label in first if label in entries]
        order += [label for label in entries if label not in first]
        handles = [entries[label] for label in order]
        figure.legend(handles, order, loc="outside upper center", ncols=entry_columns(len(order)))
    return figure


def _draw_likelihood(axes: Axes, comparison: FrictionComparison, loads: Loads) -> None:
    """Draw chi-square above its least value against the coefficient: the profile likelihoods."""
    looks = comparison_looks(comparison)
    curves = [(at_load.by_profile, *looks[at_load.load], 1.0) for at_load in loads]
    curves.append((joint_estimate(comparison, loads), MEASURED, "all loads", 1.8))
    for reading, colour, name, width in curves:
        place = friction_position(reading.values)
        axes.plot(place, deviance_rise(reading), color=colour, lw=width, label=name)
    draw_levels(axes)
    friction_axis(axes, "x")
    axes.set_ylabel(RISE)


def draw_levels(axes: Axes) -> None:
    """Draw the levels that bound 68.3 % and 95 %, and end the axis not far above."""
    for level, words in _LEVELS:
        axes.axhline(level, color="0.6", lw=0.6, ls=":")
        axes.annotate(
            words,
            (0.995, level),
            (0, 1),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            fontsize=6,
            color="0.4",
        )
    axes.set_ylim(0, _HIGHEST)


def deviance_rise(reading: BoundedEstimate) -> FloatArray:
    """Return the deviance over its least value."""
    return reading.deviance - np.min(reading.deviance)
