"""Figure of a planned scan: expected G, its transfer function, uncertainties along a variation."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from memscal.errors import InputError
from memscal.extensions.planning.design import Design, varied_designs
from memscal.figures.style import (
    DECONVOLVED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    WINDOW,
    along_radius,
    coverage,
    draw_band,
    legend_above,
    on_axis,
    panels_of,
)
from memscal.model.arrays import Values
from memscal.model.quantities import MM, PER_MM, PER_MM2

#: G is drawn to this many Gaussian widths, its transform to this many resolved bands.
_WIDTHS = 4.0
_BANDS = 2.0
_FINE = 401
#: Factors on the planned number at which the third panel is evaluated.
_FACTORS = np.geomspace(0.25, 4.0, 9)
#: No variation has more positions than this, unless the plan itself does.
_MOST_POSITIONS = 1025
_AXES = {
    "step": ("step (mm)", MM),
    "half_range": ("half range (mm)", MM),
    "repeats": ("repeats", 1),
}
_CURVES = (
    ("conversion_constant", "A", DECONVOLVED, "o"),
    ("gaussian_sigma", "σ", GAUSSIAN, "s"),
)


def design_figure(planned: Design, vary: str = "step") -> Figure:
    """Draw G, its transfer function, and uncertainties of A and sigma against what is varied."""
    if vary not in _AXES:
        raise InputError(
            f"The figure is to vary {vary!r}, which cannot be varied.",
            cure=f"Choose from {', '.join(_AXES)}.",
        )
    with panels_of(2.9, 1, 3) as (figure, panels):
        _draw_radial(panels[0], planned)
        _draw_transfer(panels[1], planned)
        _draw_varied(panels[2], planned, vary)
    return figure


def _draw_radial(axes: Axes, planned: Design) -> None:
    r = np.linspace(0.0, _WIDTHS * planned.parameters["gaussian_sigma"], _FINE)
    samples = np.stack([planned.g, coverage() * planned.g_errors])
    g, error = on_axis(planned.r, samples, r) / PER_MM2
    draw_band(axes, r / MM, g - error, g + error, f"±{coverage():g}u")
    axes.plot(r / MM, g, color=DECONVOLVED, label="G expected")
    assumed = planned.plan.kernel.radial(r) / PER_MM2
    axes.plot(r / MM, assumed, color=MEASURED, ls=":", label="G assumed")
    along_radius(axes, r, "$G_{zz}$ (1/mm$^2$)")
    legend_above(axes)


def _draw_transfer(axes: Axes, planned: Design) -> None:
    resolved = planned.resolved_wavenumber
    k = np.linspace(0.0, min(_BANDS * resolved, planned.k[-1]), _FINE)
    samples = np.stack([planned.transfer, coverage() * planned.transfer_errors])
    transfer, error = on_axis(planned.k, samples, k)
    axes.axvspan(0, resolved / PER_MM, color=WINDOW, alpha=0.12, lw=0)
    axes.axvline(resolved / PER_MM, color=WINDOW, ls=":", label="resolved")
    draw_band(axes, k / PER_MM, transfer - error, transfer + error)
    axes.plot(k / PER_MM, transfer, color=DECONVOLVED, label="modulus for G")
    axes.set_xlim(0, k[-1] / PER_MM)
    axes.set(xlabel="wavenumber $k$ (rad/mm)", ylabel="transfer function (1)", ylim=(0, None))
    legend_above(axes)


def _draw_varied(axes: Axes, planned: Design, vary: str) -> None:
    label, scale = _AXES[vary]
    designs = varied_designs(planned, vary, _values(planned, vary))
    along = np.array([getattr(varied.plan, vary) for varied in designs]) / scale
    for name, symbol, colour, marker in _CURVES:
        total = np.array([varied.relative_uncertainty(name) for varied in designs])
        noise = np.array([varied.budget[name]["noise"] for varied in designs])
        noise /= np.abs([varied.parameters[name] for varied in designs])
        look: Values = {"color": colour, "marker": marker, "ms": 3}
        axes.plot(along, 100 * coverage() * total, label=symbol, **look)
        axes.plot(along, 100 * coverage() * noise, ls="--", mfc="none", **look)
    axes.plot([], [], color="0.4", ls="--", label="noise alone")
    axes.axvline(getattr(planned.plan, vary) / scale, color=MUTED, ls=":", lw=0.8)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=label,
        ylabel=f"relative uncertainty, {coverage():g}u (%)",
    )
    # 0.5 and 20 in place of powers of ten: the axes span a decade or two.
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    legend_above(axes, columns=3)


def _values(planned: Design, vary: str) -> list[float]:
    number = getattr(planned.plan, vary)
    if vary == "repeats":
        return sorted({max(1, round(number * factor)) for factor in _FACTORS})
    most = max(_MOST_POSITIONS, planned.plan.positions) / planned.plan.positions
    if vary == "step":
        return [number * factor for factor in _FACTORS if 1 / factor <= most]
    values = [number * factor for factor in _FACTORS if factor <= most]
    # The scan has to reach over the sensor.
    return [value for value in values if value > abs(planned.plan.centre)]
