"""Figure of a sweep: results of a calibration against the amplitude of the noise."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.monte_carlo.sweep import Sweep
from memscal.figures.style import DECONVOLVED, GAUSSIAN, MUTED, panels_of
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import ESTIMATED, MM
from memscal.summaries.declared import power_of_ten

_INNER = (0.16, 0.84)  # of the draws: what one standard deviation holds of a normal law
_SHOWN = (0.05, 0.95)  # the axis follows these; heavy tails go to its edge


def sweep_figure(sweep: Sweep) -> Figure:
    """Draw how A, sigma and the reconvolution change with the noise that regularises them."""
    constant = ESTIMATED["conversion_constant"].read_in(sweep.reading)
    power = power_of_ten(sweep.conversion_constant / constant.scale)
    unit = constant.unit
    scale = constant.scale
    if not -2 <= power <= 3:
        unit = f"$10^{{{power}}}$ {unit}"
        scale *= 10.0**power
    rows = (
        (f"$A$ ({unit})", sweep.conversion_constant, sweep.seed_conversion_constant, scale),
        (
            r"$\sigma$ of deconvolved $G$ (mm)",
            sweep.gaussian_sigma_deconvolved,
            sweep.seed_gaussian_sigma,
            MM,
        ),
        ("reconvolution, rms misfit (%)", sweep.relative_rms, sweep.seed_relative_rms, 0.01),
    )
    with panels_of(6.6, 3, note="", sharex=True) as (figure, panels):
        for axes, (label, exact, draws, size) in zip(panels, rows, strict=True):
            exact = exact / size
            draws = np.where(np.isfinite(draws), draws / size, np.nan)
            axes.set_xscale("log")
            axes.axvline(1.0, color="0.5", lw=0.8, ls=":")
            limits = _limits(exact, draws)
            if np.any(np.isfinite(draws)):
                _draw_seeds(axes, sweep.amplitude, draws, limits)
            (line,) = axes.plot(sweep.amplitude, exact, "-o", color=DECONVOLVED, ms=4, zorder=4)
            line.set_label("exact expectation")
            axes.set_ylim(limits)
            if axes is not panels[2]:
                _relative_axis(axes, sweep.amplitude, exact)
            axes.set_ylabel(label)
        axes.set_xlabel("noise amplitude, relative to the one chosen by rule (1)")
        axes.set_xlim(0.85 * np.min(sweep.amplitude), 1.18 * np.max(sweep.amplitude))
        axes.xaxis.set_major_formatter(lambda amplitude, _: f"{amplitude:g}")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def _draw_seeds(
    axes: Axes, amplitude: FloatArray, draws: FloatArray, limits: tuple[float, float]
) -> None:
    look: Values = {"color": GAUSSIAN, "ms": 4}
    drawn = np.any(np.isfinite(draws), axis=1)
    x = amplitude[drawn]
    lower, median, upper = np.nanquantile(draws[drawn], (_INNER[0], 0.5, _INNER[1]), axis=1)
    band = axes.fill_between(x, lower, upper, color=GAUSSIAN, alpha=0.2, lw=0)
    band.set_label("middle 68 % of draws")
    across = np.broadcast_to(amplitude[:, None], draws.shape)
    axes.plot(across.ravel(), draws.ravel(), ".", alpha=0.6, mew=0, label="one draw", **look)
    axes.plot(x, median, "--", label="median of draws", **look)
    outside = 0
    for sign, edge, marker in ((1, limits[1], "^"), (-1, limits[0], "v")):
        beyond = sign * draws > sign * edge
        outside += int(np.sum(beyond))
        places = amplitude[np.any(beyond, axis=1)]
        level = np.full(places.size, 0.5 + 0.46 * sign)
        axes.plot(places, level, marker, transform=axes.get_xaxis_transform(), **look)
    if outside:
        note = f"{outside} of {np.sum(np.isfinite(draws))} draws beyond the axis"
        axes.set_title(note, loc="right", fontsize=7, color=MUTED, pad=2)


def _limits(exact: FloatArray, draws: FloatArray) -> tuple[float, float]:
    """Return axis limits from the exact results and the bulk of the draws."""
    known = exact[np.isfinite(exact)]
    drawn = draws[np.isfinite(draws)]
    rows = draws[np.any(np.isfinite(draws), axis=1)]
    # A bulk that reaches far beyond the exact results is a tail as well.
    shown = np.append(known, np.nanquantile(rows, _SHOWN, axis=1))
    if not shown.size:
        return 0.0, 1.0
    # The axis reaches no farther from the centre than some times the typical spread.
    centre = np.median(known) if known.size else 0.0
    typical = np.quantile(np.abs(drawn - centre), 0.68) if drawn.size else 0.0
    steps = np.max(np.abs(known - centre), initial=0.0)
    reach = max(1.2 * steps, 4.0 * typical, 1e-3 * abs(centre))
    low = max(np.min(shown), centre - reach)
    high = min(np.max(shown), centre + reach)
    margin = 0.12 * (high - low) or 0.05 * abs(centre) or 1.0
    bottom = low - margin
    return (max(bottom, 0.0) if low >= 0 else bottom), high + margin


def _relative_axis(axes: Axes, amplitude: FloatArray, exact: FloatArray) -> None:
    """Add a right-hand axis: the change from the result at the rule's amplitude, in percent."""
    base = exact[np.argmin(np.abs(np.log(amplitude)))]
    if not (np.isfinite(base) and base != 0):
        return
    both_ways = (lambda value: 100 * (value / base - 1), lambda change: base * (1 + change / 100))
    axes.secondary_yaxis("right", functions=both_ways).set_ylabel("change (%)")
