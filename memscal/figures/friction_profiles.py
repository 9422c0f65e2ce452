"""Measured stress profiles beside calculated ones, and what all figures of friction share."""

from collections.abc import Sequence
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.figures.style import COLOURS, house_style, legend_above, new_figure, panels_of, shades
from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import FrictionComparison, LoadComparison
from memscal.model.arrays import FloatArray
from memscal.model.quantities import KPA, MM

#: Loads up to this multiple of another one look alike.
_ALIKE = 1.05
#: Radii closer than this, in m, count as one.
_CLOSE = 1e-6
_TICKS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 1.0, 2.0, np.inf)
#: Marker and filling of a lubrication.
_LUBRICATIONS = {"dry": ("o", True), "lubricated": ("s", False), "": ("D", True)}


def friction_position(friction: ArrayLike) -> FloatArray:
    """Return where a friction coefficient stands on an axis from 0 to infinity: mu/(mu + 0.3)."""
    return bounded(friction, FRICTION_SCALE)


def friction_axis(axes: Axes, which: Literal["x", "y"]) -> None:
    """Give an axis the ticks of effective friction coefficients from 0 to infinity."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_ticks(list(friction_position(_TICKS)), [friction_name(mu) for mu in _TICKS])
    (axes.set_xlim if which == "x" else axes.set_ylim)(-0.02, 1.02)
    axis.set_label_text(r"effective friction coefficient $\mu_e$")


def friction_name(friction: float) -> str:
    """Return a coefficient as a label: ``0.15``, or the sign of infinity."""
    return "∞" if np.isinf(friction) else f"{friction:.3g}"


def friction_colours(friction: ArrayLike) -> list[str]:
    """Return colours of friction coefficients, by their place between 0 and infinity."""
    shades = mpl.colormaps["plasma"](0.92 * (1.0 - friction_position(friction)))
    return [mpl.colors.to_hex(shade) for shade in np.atleast_2d(shades)]


def load_looks(comparison: FrictionComparison) -> dict[float, tuple[str, str]]:
    """Return colour and name of each load: darker as it grows; within 5 % loads look alike."""
    groups: list[list[float]] = []
    for load in sorted({profile.load for profile in comparison.measured.profiles}):
        if groups and load <= _ALIKE * groups[-1][0]:
            groups[-1].append(load)
        else:
            groups.append([load])
    colours = shades(len(groups), 0.2)
    names = [f"{np.mean(group):.3g} N" for group in groups]
    return {
        load: (colour, name)
        for group, colour, name in zip(groups, colours, names, strict=True)
        for load in group
    }


def mark(lubrication: str, colour: str) -> dict[str, Any]:
    """Return marker and colours of points by their lubrication, distinct in grey print."""
    marker, filled = _LUBRICATIONS.get(lubrication, _LUBRICATIONS[""])
    return {"marker": marker, "color": colour, "mfc": colour if filled else "white"}


def lubricated_words(lubrication: str) -> str:
    """Return a lubrication in words."""
    return lubrication or "lubrication not stated"


def chosen(
    comparison: FrictionComparison, loading: str | None, lubrication: str | None
) -> list[LoadComparison]:
    """Return the loads of one loading and lubrication, increasing; of the first by default."""
    loading = comparison.loadings[0] if loading is None else loading
    if loading not in comparison.loads:
        problem = f"The loading {loading!r} was not compared."
        cure = f"There is {', '.join(repr(name) for name in comparison.loadings)}."
        raise InputError(problem, cure=cure)
    measured = [at_load.lubrication for at_load in comparison.loads[loading]]
    state = measured[0] if lubrication is None else lubrication
    if state not in measured:
        problem = f"No profile is {lubricated_words(state)!r}."
        cure = f"There is {', '.join(sorted({lubricated_words(name) for name in measured}))}."
        raise InputError(problem, cure=cure)
    loads = [at_load for at_load in comparison.loads[loading] if at_load.lubrication == state]
    return sorted(loads, key=lambda at_load: at_load.load)


def on_axis(r: FloatArray, values: FloatArray, fine: FloatArray) -> FloatArray:
    """Return smooth even profiles (m, k) at fine radii, through (m, n) at increasing ones."""
    from scipy.interpolate import CubicSpline

    kept, last = [], -np.inf
    for i, radius in enumerate(r):
        if radius - last > _CLOSE:
            kept.append(i)
            last = radius
    inner, samples = r[kept], values[:, kept]
    start = 1 if inner[0] < _CLOSE else 0
    mirrored = np.concatenate([-inner[start:][::-1], inner])
    both = np.concatenate([samples[:, start:][:, ::-1], samples], axis=1)
    return np.asarray(CubicSpline(mirrored, both, axis=1)(fine))


#: Coverage factor of the grey band, and of points distinct from zero.
EXPANDED = 2.0
#: How strongly points are drawn that are not distinct from zero.
_PALE = 0.25
_LEAST_LIMIT = 3.5
_BARS = {"ls": "none", "ms": 3.0, "mew": 0.6, "elinewidth": 0.7}


def _draw_points(
    axes: Axes, at_load: LoadComparison, colour: str, label: str, logarithmic: bool
) -> None:
    """Draw the measured points; on a logarithmic scale those below 2u are pale or left out."""
    profile = at_load.profile
    r, s, u = profile.r / MM, profile.s_zz / KPA, profile.s_zz_errors / KPA
    clear = s > EXPANDED * u if logarithmic else np.ones(s.size, dtype=bool)
    for shown, alpha in ((clear, None), (~clear & (s > 0), _PALE)):
        if shown.any():
            look = mark(at_load.lubrication, colour) | _BARS | {"alpha": alpha}
            axes.errorbar(r[shown], s[shown], u[shown], label=label or "_points", **look)


def share_limits(panels: Sequence[Axes]) -> None:
    """Give residual panels one scale that shows every point, and at least the band."""
    sizes = [
        np.abs(np.asarray(line.get_ydata()))
        for axes in panels
        for line in axes.lines
        if line.get_marker() not in ("None", "", None)
    ]
    limit = max(_LEAST_LIMIT, 1.1 * float(np.max(np.concatenate(sizes))))
    for axes in panels:
        axes.set_ylim(-limit, limit)


_FINE = 241
_DECADES = 3.3
_SHOWN = (0.0, 0.05, 0.1, 0.2, 0.3, np.inf)
#: Panels of a row of loads: with more, only the smallest, the largest and those between fit.
_MOST_LOADS = 4


def profile_figure(
    comparison: FrictionComparison, *, lubrication: str | None = None, loading: str | None = None
) -> Figure:
    """Draw measured profiles between no friction and full stick, as Figure 3 of the paper."""
    loads = chosen(comparison, loading, lubrication)
    with panels_of(4.6, 2, 2, height_ratios=(2.2, 1), sharex=True) as (figure, panels):
        draw_profiles(panels[0, 0], comparison, loads)
        draw_profiles(panels[0, 1], comparison, loads, logarithmic=True)
        for axes, index in zip(panels[1], (0, -1), strict=True):
            draw_residuals(axes, comparison, loads, index)
        share_limits(panels[1])
    return figure


def draw_profiles(
    axes: Axes,
    comparison: FrictionComparison,
    loads: Sequence[LoadComparison],
    *,
    logarithmic: bool = False,
) -> None:
    """Draw measured points with their uncertainties, and the calculated limits through them."""
    looks = load_looks(comparison)
    for at_load in loads:
        colour, name = looks[at_load.load]
        r = np.linspace(0.0, at_load.profile.r[-1], _FINE)
        limits = on_axis(at_load.profile.r, at_load.calculated[[0, -1]], r) / KPA
        axes.plot(r / MM, limits[0], color=colour, lw=1.0)
        axes.plot(r / MM, limits[1], color=colour, lw=1.0, ls="--")
        _draw_points(axes, at_load, colour, "" if logarithmic else name, logarithmic)
    if logarithmic:
        top = max(float(at_load.profile.s_zz.max()) for at_load in loads) / KPA
        axes.set_yscale("log")
        axes.set_ylim(top * 10**-_DECADES, 2.0 * top)
        for ls, index in (("-", 0), ("--", -1)):
            label = rf"$G*\sigma_{{zz}}$, $\mu$ = {friction_name(comparison.friction[index])}"
            axes.plot([], [], color="0.3", lw=1.0, ls=ls, label=label)
    else:
        axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
        axes.set_xlim(0, max(float(at_load.profile.r[-1]) for at_load in loads) / MM)
        ends = [friction_name(comparison.friction[i]) for i in (0, -1)]
        lines = [lubricated_words(loads[0].lubrication)]
        lines += [f"{loads[0].loading} loading"] if loads[0].loading else []
        lines += [rf"solid: $\mu$ = {ends[0]}", rf"dashed: $\mu$ = {ends[1]}"]
        _note(axes, "\n".join(lines), (0.97, 0.95))
    axes.set_ylabel("stress at the base (kPa)")
    legend_above(axes, columns=4 if not logarithmic else 2)


def _note(axes: Axes, text: str, corner: tuple[float, float]) -> None:
    """Write inside the frame, left of and below a place at its upper right, where no data are."""
    axes.annotate(text, corner, xycoords="axes fraction", ha="right", va="top", fontsize=7)


def draw_residuals(
    axes: Axes, comparison: FrictionComparison, loads: Sequence[LoadComparison], index: int
) -> None:
    """Draw measured minus calculated stress at one coefficient, over its uncertainty."""
    looks = load_looks(comparison)
    _plot_residuals(axes, loads, index, [looks[at_load.load][0] for at_load in loads])
    axes.set_xlabel("distance from the centre (mm)")
    axes.set_ylabel(rf"$(S_{{zz}} - S^{{\mu={friction_name(comparison.friction[index])}}})/u$")


def _plot_residuals(
    axes: Axes, loads: Sequence[LoadComparison], index: int, colours: Sequence[str]
) -> None:
    axes.axhspan(-EXPANDED, EXPANDED, color="0.92", lw=0)
    axes.axhline(0.0, color="0.4", lw=0.6)
    for at_load, colour in zip(loads, colours, strict=True):
        profile, look = at_load.profile, mark(at_load.lubrication, colour)
        z = (profile.s_zz - at_load.calculated[index]) / profile.s_zz_errors
        axes.plot(profile.r / MM, z, ls="none", ms=2.5, mew=0.6, **look)


def friction_set_figure(
    comparison: FrictionComparison, *, lubrication: str | None = None, loading: str | None = None
) -> Figure:
    """Draw profiles beside those of a set of friction coefficients, as Figure 4 of the paper."""
    loads = chosen(comparison, loading, lubrication)
    shown = np.linspace(0, len(loads) - 1, min(len(loads), _MOST_LOADS)).round().astype(int)
    loads = [loads[i] for i in np.unique(shown)]
    with house_style():
        figure = new_figure(5.0)
        rows = (1.5, 1.5, 1.0)
        panels = figure.subplots(3, len(loads), height_ratios=rows, sharex="col", squeeze=False)
        for column, at_load in zip(panels.T, loads, strict=True):
            frictionless = at_load.calculated[0]
            column[0].set_title(f"{at_load.load:.3g} N", fontsize=8)
            _draw_set(column[0], comparison, at_load, 0.0 * frictionless, KPA)
            column[0].set_ylim(bottom=0)
            _draw_set(column[1], comparison, at_load, frictionless, at_load.p0_max / 100)
            best = int(np.argmin(at_load.deviance))
            _plot_residuals(column[2], [at_load], best, [COLOURS["measured"]])
            name = friction_name(comparison.friction[best])
            _note(column[2], rf"most likely: $\mu$ = {name}", (0.96, 0.9))
        share_limits(panels[2])
        low, high = zip(*(axes.get_ylim() for axes in panels[1]), strict=True)
        for axes in panels[1]:
            axes.set_ylim(min(low), max(high))
        words = ("stress (kPa)", "beyond frictionless\n(% of its maximum)", "residual / $u$")
        for axes, label in zip(panels[:, 0], words, strict=True):
            axes.set_ylabel(label)
        figure.align_ylabels(panels[:, 0])
        figure.supxlabel("distance from the centre (mm)", fontsize=8)
        _legend_of_friction(figure, comparison, loads[0])
    return figure


def _shown_indices(comparison: FrictionComparison) -> list[int]:
    """Return indices of the coefficients to draw: some of them, the ends always."""
    names = {int(np.argmin(np.abs(comparison.friction - mu))) for mu in _SHOWN if np.isfinite(mu)}
    return sorted(names | {0, comparison.friction.size - 1})


def _draw_set(
    axes: Axes,
    comparison: FrictionComparison,
    at_load: LoadComparison,
    less: FloatArray,
    unit: float,
) -> None:
    """Draw stress less that of some profile at its radii, in a unit (Pa)."""
    profile, look = at_load.profile, mark(at_load.lubrication, COLOURS["measured"]) | _BARS
    # As far as the frictionless profile exceeds a twentieth of its top.
    strong = at_load.calculated[0] > 0.05 * at_load.calculated[0].max()
    r = np.linspace(0.0, profile.r[np.flatnonzero(strong)[-1]], _FINE)
    for i in _shown_indices(comparison):
        curve = on_axis(profile.r, (at_load.calculated[i] - less)[None, :], r)[0]
        axes.plot(r / MM, curve / unit, color=friction_colours(comparison.friction[i])[0], lw=0.9)
    stress, errors = (profile.s_zz - less) / unit, profile.s_zz_errors / unit
    axes.errorbar(profile.r / MM, stress, errors, label="_points", **look)
    axes.set_xlim(0, 1.03 * r[-1] / MM)


def _legend_of_friction(
    figure: Figure, comparison: FrictionComparison, at_load: LoadComparison
) -> None:
    handles = [
        Line2D([], [], color=friction_colours(comparison.friction[i])[0], lw=1.2,
               label=rf"$\mu$ = {friction_name(comparison.friction[i])}")
        for i in _shown_indices(comparison)
    ]  # fmt: skip
    point = Line2D([], [], ms=3, ls="none", **mark(at_load.lubrication, "k"))
    point.set_label(f"measured, {lubricated_words(at_load.lubrication)}")
    title = f"{at_load.loading} loading" if at_load.loading else "profiles as given"
    figure.legend(
        handles=[point, *handles], loc="outside upper center", ncols=len(handles) + 1, title=title,
        title_fontsize=8,
    )  # fmt: skip
