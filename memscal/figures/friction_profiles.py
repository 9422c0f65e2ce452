"""Measured stress profiles beside calculated ones, and what all figures of friction share."""

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.figures.style import (
    ALONG_RADIUS,
    MEASURED,
    SCATTER_THRESHOLD,
    Looks,
    coverage,
    draw_measured,
    draw_residual_band,
    draw_zero,
    legend_above,
    load_looks,
    mark,
    on_axis,
    panels_of,
)
from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import (
    UNEXPLAINED,
    BoundedEstimate,
    FrictionComparison,
    LoadComparison,
)
from memscal.model.arrays import FloatArray
from memscal.model.quantities import KPA, MM

Loads = Sequence[LoadComparison]
"""Loads of one loading and lubrication, in their order."""

_TICKS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 1.0, 2.0, np.inf)


def friction_position(friction: ArrayLike) -> FloatArray:
    """Return where a friction coefficient stands on an axis from 0 to infinity: mu/(mu + 0.3)."""
    return bounded(friction, FRICTION_SCALE)


def friction_axis(axes: Axes, which: str) -> None:
    """Give an axis, x or y, the ticks of effective friction coefficients from 0 to infinity."""
    look = {
        "ticks": friction_position(_TICKS),
        "ticklabels": [friction_name(mu) for mu in _TICKS],
        "lim": (-0.02, 1.02),
        "label": r"effective friction coefficient $\mu_e$",
    }
    axes.set(**{which + name: value for name, value in look.items()})


def friction_name(friction: float) -> str:
    """Return a coefficient as a label: ``0.15``, or the sign of infinity."""
    return "∞" if np.isinf(friction) else f"{friction:.3g}"


def friction_colour(friction: float) -> str:
    """Return the colour of a friction coefficient, by its place between 0 and infinity."""
    place = float(friction_position(friction))
    return mpl.colors.to_hex(mpl.colormaps["plasma"](0.8 * (1.0 - place)))


def lubricated_words(lubrication: str) -> str:
    """Return a lubrication in words."""
    return lubrication or "lubrication not stated"


def chosen(
    comparison: FrictionComparison, lubrication: str | None, loading: str | None = None
) -> list[LoadComparison]:
    """Return the loads of one loading and lubrication, increasing; of the first by default."""
    loading = comparison.loadings[0] if loading is None else loading
    if loading not in comparison.loads:
        raise InputError(
            f"The loading {loading!r} was not compared.",
            cure=f"There is {', '.join(repr(name) for name in comparison.loadings)}.",
        )
    measured = [at_load.lubrication for at_load in comparison.loads[loading]]
    state = measured[0] if lubrication is None else lubrication
    if state not in measured:
        raise InputError(
            f"No profile is {lubricated_words(state)!r}.",
            cure=f"There is {', '.join(sorted({lubricated_words(name) for name in measured}))}.",
        )
    loads = [at_load for at_load in comparison.loads[loading] if at_load.lubrication == state]
    return sorted(loads, key=lambda at_load: at_load.load)


def joint_estimate(comparison: FrictionComparison, loads: Loads) -> BoundedEstimate:
    """Return the coefficient of all loads together, of the lubrication and loading of some."""
    return comparison.joint[loads[0].lubrication][loads[0].loading]


def comparison_looks(comparison: FrictionComparison) -> Looks:
    """Return colour and name of each load of a comparison, lubricated or not."""
    return load_looks(profile.load for profile in comparison.measured.profiles)


def _calculated_at(
    comparison: FrictionComparison, at_load: LoadComparison, friction: float
) -> FloatArray:
    """Return the calculated blurred stress (n,), in Pa, at any coefficient within those solved."""
    from scipy.interpolate import PchipInterpolator

    calculated = at_load.calculated
    if comparison.friction.size == 1:
        return np.asarray(calculated[0])
    # As the family interpolates: past the friction of full stick nothing changes.
    family = PchipInterpolator(friction_position(comparison.friction), calculated)
    return family(friction_position(friction))


#: How strongly points are drawn that are not distinct from zero.
_PALE = 0.25
_LEAST_LIMIT = 3.5
_BARS = {"ls": "none", "ms": 3.0, "mew": 0.6, "elinewidth": 0.7}


def _draw_points(
    axes: Axes, at_load: LoadComparison, colour: str, label: str, logarithmic: bool
) -> None:
    """Draw the measured points; on a logarithmic scale those below 2u are pale or left out."""
    profile = at_load.profile
    r = profile.r / MM
    s = profile.s_zz / KPA
    bars = coverage() * profile.s_zz_errors / KPA
    clear = s > bars if logarithmic else np.ones(s.size, bool)
    look = mark(at_load.lubrication, colour) | _BARS | {"many": s.size > SCATTER_THRESHOLD}
    for shown, alpha in ((clear, None), (~clear & (s > 0), _PALE)):
        if shown.any():
            points = (r[shown], s[shown], bars[shown])
            draw_measured(axes, *points, alpha=alpha, label=label, **look)


def share_limits(panels: Sequence[Axes], largest: float) -> None:
    """Give residual panels one scale that shows every point, and at least the band."""
    limit = max(_LEAST_LIMIT, 1.1 * largest)
    for axes in panels:
        axes.set_ylim(-limit, limit)


_FINE = 241
_DECADES = 3.3
_SHOWN = (0.05, 0.1, 0.2, 0.3)
#: Panels of a row of loads: with more, only the smallest, the largest and those between fit.
_MOST_LOADS = 4


def profile_figure(comparison: FrictionComparison, lubrication: str) -> Figure:
    """Draw measured profiles between no friction and full stick, as Figure 3 of the paper."""
    loads = chosen(comparison, lubrication)
    with panels_of(4.6, 2, 2, height_ratios=(2.2, 1), sharex=True) as (figure, panels):
        draw_profiles(panels[0, 0], comparison, loads)
        draw_profiles(panels[0, 1], comparison, loads, logarithmic=True)
        largest = max(
            draw_residuals(axes, comparison, loads, friction)
            for axes, friction in zip(panels[1], comparison.friction[[0, -1]], strict=True)
        )
        share_limits(panels[1], largest)
    return figure


def draw_profiles(
    axes: Axes,
    comparison: FrictionComparison,
    loads: Loads,
    *,
    logarithmic: bool = False,
) -> None:
    """Draw measured points, calculated curves of the fitted coefficient, and their limits."""
    looks = comparison_looks(comparison)
    joint = joint_estimate(comparison, loads)
    words = "most likely" if joint.value is None else "fitted"
    if joint.kind == UNEXPLAINED:
        words = "rejected"
    styles = {
        "-": rf"$\mu_e$ = {friction_name(joint.best)} ({words})",
        ":": rf"$\mu$ = {friction_name(comparison.friction[0])}",
        "--": rf"$\mu$ = {friction_name(comparison.friction[-1])}",
    }
    for at_load in loads:
        colour, name = looks[at_load.load]
        r = np.linspace(0.0, at_load.profile.r[-1], _FINE)
        fitted = _calculated_at(comparison, at_load, joint.best)
        shown = np.stack([fitted, *at_load.calculated[[0, -1]]])
        curves = on_axis(at_load.profile.r, shown, r) / KPA
        for curve, ls in zip(curves, styles, strict=True):
            axes.plot(r / MM, curve, color=colour, lw=1.0 if ls == "-" else 0.8, ls=ls)
        _draw_points(axes, at_load, colour, "" if logarithmic else name, logarithmic)
    axes.set_ylabel("blurred stress $S_{zz}$ (kPa)")
    if logarithmic:
        top = max(at_load.profile.s_zz.max() for at_load in loads) / KPA
        axes.set_yscale("log")
        axes.set_ylim(top * 10**-_DECADES, 2.0 * top)
        for ls, label in styles.items():
            axes.plot([], [], color="0.3", lw=1.0, ls=ls, label=label)
        pale = mark(loads[0].lubrication, "0.3") | {"ls": "none", "ms": 3.0, "alpha": 2 * _PALE}
        axes.plot([], [], label=f"pale: less than {coverage():g}u", **pale)
        legend_above(axes)
        return
    draw_zero(axes)
    axes.set_xlim(0, max(at_load.profile.r[-1] for at_load in loads) / MM)
    lines = [lubricated_words(loads[0].lubrication)]
    if loads[0].loading:
        lines.append(f"{loads[0].loading} loading")
    for dashes, label in zip(("solid", "dotted", "dashed"), styles.values(), strict=True):
        lines.append(f"{dashes}: {label}")
    _note(axes, "\n".join(lines), (0.97, 0.95))
    legend_above(axes, columns=4, points=max(at_load.profile.r.size for at_load in loads))


def _note(axes: Axes, text: str, corner: tuple[float, float]) -> None:
    """Write inside the frame, left of and below a place at its upper right, where no data are."""
    axes.annotate(text, corner, xycoords="axes fraction", ha="right", va="top", fontsize=7)


def draw_residuals(
    axes: Axes, comparison: FrictionComparison, loads: Loads, friction: float
) -> float:
    """Draw measured minus calculated stress at one coefficient, over its uncertainty."""
    looks = comparison_looks(comparison)
    draw_residual_band(axes)
    axes.set_xlabel(ALONG_RADIUS)
    axes.set_ylabel(rf"residual / $u$, $\mu$ = {friction_name(friction)}")
    return max(
        _draw_residuals(axes, comparison, at_load, friction, looks[at_load.load][0])
        for at_load in loads
    )


def _draw_residuals(
    axes: Axes,
    comparison: FrictionComparison,
    at_load: LoadComparison,
    friction: float,
    colour: str,
) -> float:
    """Draw the residuals of one load; return the largest."""
    profile = at_load.profile
    calculated = _calculated_at(comparison, at_load, friction)
    z = (profile.s_zz - calculated) / profile.s_zz_errors
    look = mark(at_load.lubrication, colour) | {"ls": "none", "ms": 2.5, "mew": 0.6}
    draw_measured(axes, profile.r / MM, z, None, many=z.size > SCATTER_THRESHOLD, **look)
    return float(abs(z).max())


def friction_set_figure(comparison: FrictionComparison, lubrication: str) -> Figure:
    """Draw profiles beside those of a set of friction coefficients, as Figure 4 of the paper."""
    loads = chosen(comparison, lubrication)
    shown = np.linspace(0, len(loads) - 1, min(len(loads), _MOST_LOADS)).round().astype(int)
    loads = [loads[i] for i in np.unique(shown)]
    heights = (1.5, 1.5, 1.0)
    with panels_of(5.0, 3, len(loads), sharex="col", squeeze=False, height_ratios=heights) as (
        figure,
        panels,
    ):
        largest = 0.0
        for (stress, beyond, residual), at_load in zip(panels.T, loads, strict=True):
            frictionless = at_load.calculated[0]
            stress.set_title(f"{at_load.load:.3g} N", fontsize=8)
            _draw_set(stress, comparison, at_load, 0.0 * frictionless, KPA)
            stress.set_ylim(bottom=0)
            _draw_set(beyond, comparison, at_load, frictionless, at_load.p0_max / 100)
            fitted = at_load.by_profile
            draw_residual_band(residual)
            z = _draw_residuals(residual, comparison, at_load, fitted.best, MEASURED)
            largest = max(largest, z)
            words = "most likely" if fitted.value is None else "fitted"
            _note(residual, rf"{words}: $\mu_e$ = {friction_name(fitted.best)}", (0.96, 0.93))
            residual.set_xlabel("$r$ (mm)" if len(loads) > 2 else ALONG_RADIUS)
        share_limits(panels[2], largest)
        limits = np.array([axes.get_ylim() for axes in panels[1]])
        for axes in panels[1]:
            axes.set_ylim(limits.min(), limits.max())
        panels[0, 0].set_ylabel("blurred stress\n$S_{zz}$ (kPa)")
        panels[1, 0].set_ylabel("beyond frictionless\n(% of its maximum)")
        panels[2, 0].set_ylabel("residual / $u$")
        figure.align_ylabels(panels[:, 0])
        first = loads[0]
        label = f"measured, {lubricated_words(first.lubrication)}"
        look = mark(first.lubrication, "k")
        handles = [Line2D([], [], ms=3, ls="none", label=label, **look)]
        for mu in comparison.friction[_shown_indices(comparison)]:
            label = rf"$\mu$ = {friction_name(mu)}"
            handles.append(Line2D([], [], color=friction_colour(mu), lw=1.2, label=label))
        figure.legend(
            handles=handles,
            title=f"{first.loading} loading" if first.loading else "profiles as given",
            title_fontsize=8,
            loc="outside upper center",
            ncols=len(handles),
        )
    return figure


def _shown_indices(comparison: FrictionComparison) -> list[int]:
    """Return indices of the coefficients to draw: some of them, the ends always."""
    nearest = {int(abs(comparison.friction - mu).argmin()) for mu in _SHOWN}
    return sorted(nearest | {0, comparison.friction.size - 1})


def _draw_set(
    axes: Axes,
    comparison: FrictionComparison,
    at_load: LoadComparison,
    less: FloatArray,
    unit: float,
) -> None:
    """Draw stress less that of some profile at its radii, in a unit (Pa)."""
    profile = at_load.profile
    look = mark(at_load.lubrication, MEASURED) | _BARS
    # As far as the frictionless profile exceeds a twentieth of its top.
    strong = at_load.calculated[0] > 0.05 * at_load.calculated[0].max()
    r = np.linspace(0.0, profile.r[strong][-1], _FINE)
    for i in _shown_indices(comparison):
        curve = on_axis(profile.r, (at_load.calculated[i] - less)[None, :], r)[0]
        axes.plot(r / MM, curve / unit, color=friction_colour(comparison.friction[i]), lw=0.9)
    stress = (profile.s_zz - less) / unit
    errors = coverage() * profile.s_zz_errors / unit
    many = stress.size > SCATTER_THRESHOLD
    draw_measured(axes, profile.r / MM, stress, errors, many=many, **look)
    axes.set_xlim(0, 1.03 * r[-1] / MM)
