"""Parts that figures of friction share: an axis to infinity, colours, points, loads drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.figures.style import COLOURS
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
    margin = 0.02
    (axes.set_xlim if which == "x" else axes.set_ylim)(-margin, 1 + margin)
    axis.set_label_text(r"effective friction coefficient $\mu_e$")


def friction_name(friction: float) -> str:
    """Return a coefficient as a label: ``0.15``, or the sign of infinity."""
    return "∞" if np.isinf(friction) else f"{friction:.3g}"


def friction_colours(friction: ArrayLike) -> list[str]:
    """Return colours of friction coefficients, by their place between 0 and infinity."""
    import matplotlib as mpl

    shades = mpl.colormaps["plasma"](0.92 * (1.0 - friction_position(friction)))
    return [mpl.colors.to_hex(shade) for shade in np.atleast_2d(shades)]


def load_looks(comparison: FrictionComparison) -> dict[float, tuple[str, str]]:
    """Return colour and name of each load: darker as it grows; within 5 % loads look alike."""
    import matplotlib as mpl

    groups: list[list[float]] = []
    for load in sorted({profile.load for profile in comparison.measured.profiles}):
        if groups and load <= _ALIKE * groups[-1][0]:
            groups[-1].append(load)
        else:
            groups.append([load])
    shades = mpl.colormaps["viridis_r"](np.linspace(0.2, 1.0, len(groups)))
    colours = [mpl.colors.to_hex(shade) for shade in shades]
    if len(groups) == 1:
        colours = [COLOURS["deconvolved"]]
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


def on_axis(r: FloatArray, values: FloatArray, fine: FloatArray) -> FloatArray:
    """Return smooth even profiles (m, k) at fine radii, through (m, n) at increasing ones.

    Radii closer than a micrometre count as one.
    """
    from scipy.interpolate import CubicSpline

    kept = _apart(r)
    inner, samples = r[kept], values[:, kept]
    start = 1 if inner[0] < _CLOSE else 0
    mirrored = np.concatenate([-inner[start:][::-1], inner])
    both = np.concatenate([samples[:, start:][:, ::-1], samples], axis=1)
    return np.asarray(CubicSpline(mirrored, both, axis=1)(fine))


def _apart(r: FloatArray) -> Sequence[int]:
    kept, last = [], -np.inf
    for i, radius in enumerate(r):
        if radius - last > _CLOSE:
            kept.append(i)
            last = radius
    return kept


#: Coverage factor of the grey band, and of points distinct from zero.
EXPANDED = 2.0
#: How strongly points are drawn that are not distinct from zero.
_PALE = 0.25
_LEAST_LIMIT = 3.5


def draw_points(
    axes: Axes, at_load: LoadComparison, colour: str, label: str, logarithmic: bool
) -> None:
    """Draw the measured points; on a logarithmic scale those below 2u are pale or left out."""
    profile = at_load.profile
    r, s, u = (np.asarray(v) for v in (profile.r, profile.s_zz, profile.s_zz_errors))
    clear = s > EXPANDED * u if logarithmic else np.ones(s.size, dtype=bool)
    for shown, strength in ((clear, 1.0), (~clear & (s > 0), _PALE)):
        if shown.any():
            draw_errorbar(
                axes, r[shown] / MM, s[shown] / KPA, u[shown] / KPA, at_load,
                colour=colour, label=label, strength=strength,
            )  # fmt: skip


def draw_errorbar(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    u: FloatArray,
    at_load: LoadComparison,
    *,
    colour: str,
    label: str = "",
    strength: float = 1.0,
) -> None:
    """Draw points with their standard uncertainties, in the marker of their lubrication."""
    style = mark(at_load.lubrication, colour) | {"ls": "none", "ms": 3.0, "mew": 0.6}
    style |= {"label": label or "_points", "alpha": None if strength == 1.0 else strength}
    axes.errorbar(x, y, u, elinewidth=0.7, **style)


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
