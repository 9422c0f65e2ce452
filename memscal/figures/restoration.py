"""A restored stress: with its band, beside what was measured and what was calculated."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.figures.style import (
    COLOURS,
    SCATTER_THRESHOLD,
    house_style,
    legend_above,
    marker_size,
    new_figure,
    panel_letter,
)
from memscal.measurement.comparison import Comparison
from memscal.measurement.restoration import Restoration
from memscal.mechanics.contact import Contact
from memscal.model.quantities import KPA, MM

__all__ = ["restoration_figure"]

_EXPANDED = 2.0
_LEAST_LIMIT = 3.5


def restoration_figure(found: Restoration, compared: Comparison | None = None) -> Figure:
    """Draw the stress at the base, as restored, as the sensor blurs it, and as calculated.

    Parameters
    ----------
    found : Restoration
        What was restored.
    compared : Comparison, optional
        A calculated stress to be shown beside it.

    Returns
    -------
    matplotlib.figure.Figure
        Panel a, stress against the distance from the centre; b, residuals against it.
    """
    compared = found.comparison if compared is None else compared
    with house_style():
        figure = new_figure(3.3)
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        _draw_stress(left, found, compared)
        _draw_residuals(right, found)
        for axes, letter in zip((left, right), "ab", strict=True):
            panel_letter(axes, letter)
    return figure


def _draw_stress(axes: Axes, found: Restoration, compared: Comparison | None) -> None:
    r = found.r / MM
    stress = found.sigma_zz / KPA
    band = _EXPANDED * np.sqrt(np.maximum(np.diag(found.covariance), 0.0)) / KPA
    blue = COLOURS["deconvolved"]
    axes.fill_between(r, stress - band, stress + band, color=blue, alpha=0.25, lw=0)
    axes.plot(r, stress, color=blue, label=r"restored $\sigma_{zz}$, ±2u")
    blurred = found.blurred_stress(found.r) / KPA
    axes.plot(r, blurred, color=COLOURS["gaussian"], ls="-.", label=r"blurred again, $G*\sigma$")
    if compared is not None:
        frictionless = isinstance(compared.stress, Contact)
        label = "calculated, no friction" if frictionless else "expected"
        axes.plot(r, compared.sigma_zz / KPA, color=COLOURS["reference"], ls="--", label=label)
    many = found.points.u.size > SCATTER_THRESHOLD
    size = 1.2 if many else 0.8 * marker_size(found.points.u.size)
    (points,) = axes.plot(found.distance / MM, found.measured_stress / KPA, ls="none", marker="o")
    points.set(color=COLOURS["measured"], ms=size, mfc="none", mew=0.6)
    points.set(label="scan, $S_{zz} = U/A$", rasterized=many)
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)
    axes.set_xlim(0, max(r[-1], float(found.distance.max()) / MM))
    axes.set_xlabel("distance from the centre (mm)")
    axes.set_ylabel("stress at the base (kPa)", labelpad=8)
    legend_above(axes, columns=2, points=found.points.u.size)


def _draw_residuals(axes: Axes, found: Restoration) -> None:
    """Draw residuals over their noise; what lies beyond the axis stands at its edge."""
    z = found.residual / found.noise
    limit = max(_LEAST_LIMIT, min(1.1 * float(np.abs(z).max()), 8.0))
    ordinary = np.abs(z) <= limit
    side = np.where(found.points.free[0, 0], found.points.x, found.points.y) / MM
    axes.axhspan(-_EXPANDED, _EXPANDED, color="0.92", lw=0)
    axes.axhline(0.0, color="0.4", lw=0.6)
    size = marker_size(z.size)
    label = f"scan: rms {float(np.sqrt(np.mean(z**2))):.2f}"
    axes.plot(side[ordinary], z[ordinary], "o", color=COLOURS["measured"], ms=size, label=label)
    edge = 0.93 * limit * np.sign(z[~ordinary])
    axes.plot(side[~ordinary], edge, "^", color=COLOURS["failed"], ms=4, label="_beyond the axis")
    axes.set_ylim(-limit, limit)
    axes.set(xlabel="position (mm)", ylabel="residual / $u$")
    legend_above(axes, columns=1)
