"""Figure of a sweep: results of a calibration against the amplitude of the noise."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.monte_carlo.sweep import Sweep
from memscal.figures.style import COLOURS, panels_of
from memscal.model.arrays import FloatArray
from memscal.model.quantities import ESTIMATED, MM
from memscal.summaries.declared import power_of_ten

_INNER = (0.16, 0.84)  # of the draws: what one standard deviation holds of a normal law
_SHOWN = (0.05, 0.95)  # the axis follows these; heavy tails go to its edge


def sweep_figure(sweep: Sweep) -> Figure:
    """Draw how A, sigma and the reconvolution change with the noise that regularises them."""
    constants = sweep.conversion_constant, sweep.seed_conversion_constant
    widths = sweep.gaussian_sigma_deconvolved, sweep.seed_gaussian_sigma
    constant = ESTIMATED["conversion_constant"].read_in(sweep.reading)
    power = power_of_ten(sweep.conversion_constant / constant.scale)
    power = 0 if -2 <= power <= 3 else power
    unit = f"$10^{{{power}}}$ {constant.unit}" if power else constant.unit
    rows = (
        (f"$A$ ({unit})", *constants, constant.scale * 10.0**power),
        (r"$\sigma$ of deconvolved $G$ (mm)", *widths, MM),
        ("reconvolution, rms misfit (%)", sweep.relative_rms, sweep.seed_relative_rms, 0.01),
    )
    with panels_of(6.6, 3, note="", sharex=True) as (figure, panels):
        for axes, (label, exact, draws, scale) in zip(panels, rows, strict=True):
            _draw_row(axes, sweep.amplitude, exact / scale, draws / scale)
            axes.set_ylabel(label)
        for axes in panels[:2]:
            _relative_axis(axes, sweep.amplitude)
        axes = panels[2]
        axes.set_xlabel("noise amplitude, relative to the one chosen by rule (1)")
        axes.set_xlim(0.85 * np.min(sweep.amplitude), 1.18 * np.max(sweep.amplitude))
        axes.xaxis.set_major_formatter(lambda amplitude, _: f"{amplitude:g}")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def _draw_row(axes: Axes, amplitude: FloatArray, exact: FloatArray, draws: FloatArray) -> None:
    axes.set_xscale("log")
    axes.axvline(1.0, color="0.5", lw=0.8, ls=":", label="_rule's choice")
    draws = np.where(np.isfinite(draws), draws, np.nan)
    low, high = _limits(exact, draws)
    if np.any(np.isfinite(draws)):
        _draw_seeds(axes, amplitude, draws, (low, high))
    (line,) = axes.plot(amplitude, exact, "-o", color=COLOURS["deconvolved"], ms=4, zorder=4)
    line.set_label("exact expectation")
    axes.set_ylim(low, high)


def _draw_seeds(
    axes: Axes, amplitude: FloatArray, draws: FloatArray, limits: tuple[float, float]
) -> None:
    colour = COLOURS["gaussian"]
    across = np.broadcast_to(amplitude[:, None], draws.shape)
    drawn = np.any(np.isfinite(draws), axis=1)
    lower, median, upper = np.nanquantile(draws[drawn], (_INNER[0], 0.5, _INNER[1]), axis=1)
    axes.fill_between(
        amplitude[drawn], lower, upper, color=colour, alpha=0.2, lw=0, label="middle 68 % of draws"
    )
    axes.plot(
        across.ravel(), draws.ravel(), ".", color=colour, ms=4, alpha=0.6, mew=0, label="one draw"
    )
    axes.plot(amplitude[drawn], median, "--", color=colour, label="median of draws")
    outside = 0
    for sign, edge, marker in ((1, limits[1], "^"), (-1, limits[0], "v")):
        beyond = sign * draws > sign * edge
        outside += int(np.sum(beyond))
        places = amplitude[np.any(beyond, axis=1)]
        level = np.full(places.size, 0.5 + 0.46 * sign)
        across_x = axes.get_xaxis_transform()
        label = "_beyond the axis"
        axes.plot(places, level, marker, color=colour, ms=4, transform=across_x, label=label)
    if outside:
        note = f"{outside} of {int(np.sum(np.isfinite(draws)))} draws beyond the axis"
        axes.set_title(note, loc="right", fontsize=7, color=COLOURS["muted"], pad=2)


def _limits(exact: FloatArray, draws: FloatArray) -> tuple[float, float]:
    """Return axis limits from the exact results and the bulk of the draws."""
    shown = exact[np.isfinite(exact)]
    for row in draws:
        finite = row[np.isfinite(row)]
        if finite.size:
            # A bulk that reaches far beyond the exact results is a tail as well.
            shown = np.concatenate([shown, np.quantile(finite, _SHOWN)])
    if not shown.size:
        return 0.0, 1.0
    centre = float(np.median(exact[np.isfinite(exact)])) if np.any(np.isfinite(exact)) else 0.0
    # The axis reaches no farther from the centre than some times the typical spread.
    steps = np.abs(exact[np.isfinite(exact)] - centre)
    spread = np.abs(draws[np.isfinite(draws)] - centre)
    typical = float(np.quantile(spread, 0.68)) if spread.size else 0.0
    reach = max(1.2 * float(np.max(steps, initial=0.0)), 4.0 * typical, 1e-3 * abs(centre))
    low = max(float(np.min(shown)), centre - reach)
    high = min(float(np.max(shown)), centre + reach)
    margin = 0.12 * (high - low) or 0.05 * abs(centre) or 1.0
    bottom = low - margin
    return (max(bottom, 0.0) if low >= 0 else bottom), high + margin


def _relative_axis(axes: Axes, amplitude: FloatArray) -> None:
    """Add a right-hand axis: the change from the result at the rule's amplitude, in percent."""
    (line,) = (line for line in axes.lines if line.get_label() == "exact expectation")
    base = float(np.asarray(line.get_ydata())[np.argmin(np.abs(np.log(amplitude)))])
    if not (np.isfinite(base) and base != 0):
        return
    both_ways = (lambda value: 100 * (value / base - 1), lambda change: base * (1 + change / 100))
    axes.secondary_yaxis("right", functions=both_ways).set_ylabel("change (%)")
