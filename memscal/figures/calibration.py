"""Figure of a calibration: the paper's Fig. 2, with residuals, transfer function and checks."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.figures.scan import draw_residuals, draw_scan, draw_scan_log
from memscal.figures.style import (
    COLOURS,
    channel_indices,
    drawable,
    house_style,
    legend_above,
    new_figure,
    panel_letters,
)
from memscal.model.apparatus import ApparatusData, ApparatusRadial
from memscal.model.arrays import FloatArray
from memscal.model.checks import failed_check_messages
from memscal.model.quantities import KPA, MM, PER_MM, PER_MM2, measured_text
from memscal.summaries.calibration import Calibrated, apparatus_of, sensor_title

_EXPANDED = 2.0
_LOG_DECADES = 4.0


def draw_radial(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r), twice its standard uncertainty and the Gaussian, linear."""
    radial = data.radial_profile
    axes.axhline(0.0, color="0.4", lw=0.6)
    _draw_band(axes, radial, floor=-np.inf)
    _draw_profiles(axes, radial.r, radial.g, radial.g_gaussian)
    low, high = (radial.g + side * _EXPANDED * radial.g_errors for side in (-1, 1))
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    # The band may be much larger than G, which must stay legible in it.
    top = min(_largest(high), 3 * peak)
    bottom = -min(_largest(-low, floor=0.0), 1.5 * peak)
    axes.set_ylim((bottom - 0.06 * top) / PER_MM2, 1.06 * top / PER_MM2)
    axes.set_xlim(0.0, _shown_radius(radial) / MM)
    axes.set_ylabel(f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")
    legend_above(axes)


def draw_radial_log(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r) on a logarithmic axis; where G is not positive, only the band is drawn."""
    radial = data.radial_profile
    axes.set_yscale("log")
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    inside = radial.r <= _shown_radius(radial)
    smallest = np.min(np.maximum(radial.g_gaussian[inside], 10**-_LOG_DECADES * peak))
    floor = max(0.3 * float(smallest), 10**-_LOG_DECADES * peak)
    _draw_band(axes, radial, floor=floor)
    positive = (np.where(g > 0, g, np.nan) for g in (radial.g, radial.g_gaussian))
    _draw_profiles(axes, radial.r, *positive)
    axes.set_ylim(floor / PER_MM2, 3 * peak / PER_MM2)
    axes.set_xlim(0.0, _shown_radius(radial) / MM)
    axes.set_xlabel("distance from the axis $r$ (mm)")
    axes.set_ylabel(f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")


def draw_transfer(axes: Axes, data: ApparatusData) -> None:
    """Draw the transfer function's modulus, the window, and the resolved band."""
    transfer = data.transfer
    k, limit = transfer.k / PER_MM, transfer.resolved_wavenumber / PER_MM
    end = float(k[-1])
    if np.isfinite(limit) and limit > 0:
        end = min(end, 2.0 * limit)
    shown = k <= end
    band = _EXPANDED * transfer.modulus_errors
    blue = COLOURS["deconvolved"]
    low, high = np.maximum(transfer.modulus - band, 0.0), transfer.modulus + band
    axes.fill_between(k, low, high, color=blue, alpha=0.25, lw=0, label="±2u (conservative)")
    axes.plot(k, transfer.modulus, "-", color=blue, label="modulus for G")
    gaussian = np.exp(-0.5 * (data.gaussian_sigma * transfer.k) ** 2)
    axes.plot(k, gaussian, "--", color=COLOURS["gaussian"], label="Gaussian")
    axes.plot(k, transfer.window, ":", color=COLOURS["window"], label="window")
    _shade_unresolved(axes, limit, end)
    top = max(1.1, min(1.1 * _largest(transfer.modulus[shown]), 3.0))
    axes.set(xlim=(0.0, end), ylim=(0.0, top))
    axes.set_xlabel("wavenumber $k$ (rad/mm)")
    axes.set_ylabel("transfer function (1)")
    legend_above(axes)


def _draw_band(axes: Axes, radial: ApparatusRadial, *, floor: float) -> None:
    spread = _EXPANDED * radial.g_errors
    low, high = (np.maximum(radial.g + side * spread, floor) / PER_MM2 for side in (-1, 1))
    blue, r = COLOURS["deconvolved"], radial.r / MM
    axes.fill_between(r, low, high, color=blue, alpha=0.25, lw=0, label="±2u (conservative)")


def _draw_profiles(axes: Axes, r: FloatArray, g: FloatArray, gaussian: FloatArray) -> None:
    axes.plot(r / MM, g / PER_MM2, "-", color=COLOURS["deconvolved"], label="deconvolved G")
    axes.plot(r / MM, gaussian / PER_MM2, "--", color=COLOURS["gaussian"], label="Gaussian fit")


def _shade_unresolved(axes: Axes, limit: float, end: float) -> None:
    if not (np.isfinite(limit) and limit < end):
        return
    axes.axvspan(0.0, limit, color=COLOURS["reference"], alpha=0.10, lw=0, label="_resolved")
    hatched = axes.axvspan(limit, end, facecolor="0.95", edgecolor="0.75", hatch="////", lw=0)
    hatched.set(zorder=0, label="extrapolated")
    axes.axvline(limit, color="0.25", lw=0.8, label=f"resolved to {limit:.3g} rad/mm")


def _shown_radius(radial: ApparatusRadial) -> float:
    """Return the radius to draw up to: where G, or its Gaussian, has died away."""
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    alive = np.flatnonzero(np.maximum(np.abs(radial.g), radial.g_gaussian) > 1e-3 * peak)
    gaussian_alive = np.flatnonzero(radial.g_gaussian > 1e-3 * peak)
    if not alive.size or not gaussian_alive.size:
        return float(radial.r[-1])
    # Ripples of a poor deconvolution reach far; the Gaussian bounds the sensor.
    far = min(radial.r[alive[-1]], 1.6 * radial.r[gaussian_alive[-1]])
    return float(min(1.1 * far, radial.r[-1])) or float(radial.r[-1])


def _largest(values: FloatArray, floor: float = 1e-300) -> float:
    finite = values[np.isfinite(values)]
    return max(float(np.max(finite)), floor) if finite.size else floor


_PANELS_HEIGHT = 8.2
_LINE_HEIGHT = 0.155
_LINE_WIDTH = 122
_MAX_FAILED_LINES = 12
_MARGIN = 0.012  # left and right of the lines of text, of the width


def calibration_figure(result: Calibrated) -> Figure:
    """Draw an apparatus function and the scan that it came from, after Fig. 2 of the paper.

    Panels a and c, the scan with reconvolutions and reference; b, residuals over u; d and e, G(r)
    with its band (k = 2) and the Gaussian; f, the transfer function.
    """
    data = apparatus_of(result)
    with house_style():
        lines = _text_lines(data)
        text_height = _LINE_HEIGHT * (len(lines) + 0.6)
        figure = new_figure(_PANELS_HEIGHT + text_height)
        outer = figure.add_gridspec(2, 2, height_ratios=[text_height, _PANELS_HEIGHT])
        _write_lines(figure, lines)
        figure.add_subplot(outer[0, :]).set_axis_off()
        left = outer[1, 0].subgridspec(3, 1, height_ratios=[3.0, 1.5, 3.0])
        right = outer[1, 1].subgridspec(3, 1)
        scan = figure.add_subplot(left[0], label="scan")
        residuals = figure.add_subplot(left[1], sharex=scan, label="residuals")
        scan_log = figure.add_subplot(left[2], sharex=scan, label="scan_log")
        radial = figure.add_subplot(right[0], label="radial")
        radial_log = figure.add_subplot(right[1], sharex=radial, label="radial_log")
        transfer = figure.add_subplot(right[2], label="transfer")
        draw_scan(scan, data)
        draw_residuals(residuals, data)
        draw_scan_log(scan_log, data)
        draw_radial(radial, data)
        draw_radial_log(radial_log, data)
        draw_transfer(transfer, data)
        for axes in (scan, residuals, radial):
            axes.tick_params(labelbottom=False)
        panel_letters((scan, residuals, scan_log, radial, radial_log, transfer))
        # One pass of the layout, then none, so that rendering twice gives the same picture.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def values_text(data: ApparatusData) -> str:
    """Return the main values with their standard uncertainties, in one line."""
    parameters, deconvolved = data.parameters, "gaussian_sigma_deconvolved"
    values = [f"A = {measured_text(parameters, 'conversion_constant')}"]
    values.append(f"σ = {measured_text(parameters, 'gaussian_sigma')} (data space)")
    if deconvolved in parameters:
        values.append(f"{measured_text(parameters, deconvolved)} (deconvolved G)")
    return ",  ".join(values)


def _text_lines(data: ApparatusData) -> list[tuple[str, str, str]]:
    """Return the lines above the panels, with the colour and the weight of each."""
    ink = COLOURS["measured"]
    # A long name is cut, not the channel behind it.
    name, _, channel = sensor_title(data).rpartition(", channel ")
    name = textwrap.shorten(name, 82, placeholder=" …")
    title = textwrap.shorten(f"{name}, channel {channel}", 95, placeholder=" …")
    film = data.film
    law = f", {film.law_text}" if film.law else ""
    setting = (
        f"{data.indenter.shape} of radius {data.indenter.radius / MM:.3g} mm, {data.load:.3g} N; "
        f"film {film.thickness / MM:.3g} mm, E = {film.young_modulus / KPA / 1e3:.3g} MPa, "
        f"ν = {film.poisson_ratio:.3g}{law}; ± is the standard uncertainty (k = 1)"
    )
    rows = [(title, ink, "bold"), (setting, COLOURS["muted"], "normal")]
    rows.append((values_text(data), ink, "normal"))
    if data.checks and data.passed:
        rows.append((f"All {len(data.checks)} quality checks passed.", ink, "normal"))
    failed = [
        (line, COLOURS["failed"], "normal")
        for message in failed_check_messages(data.checks)
        for line in _wrapped(message.text)
    ]
    if len(failed) > _MAX_FAILED_LINES:
        ending = "… and more failed checks, which the artifact names."
        failed = [*failed[: _MAX_FAILED_LINES - 1], (ending, COLOURS["failed"], "normal")]
    return [(line, ink, weight) for row, ink, weight in rows for line in _wrapped(row)] + failed


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, _LINE_WIDTH) or [""]


def _write_lines(figure: Figure, lines: list[tuple[str, str, str]]) -> None:
    height = figure.get_figheight()
    for i, (line, colour, weight) in enumerate(lines):
        y = 1.0 - (0.08 + _LINE_HEIGHT * i) / height
        # A sensor's name may hold a dollar sign: it is text, not mathematics.
        text = figure.text(
            _MARGIN, y, drawable(line), color=colour, weight=weight, va="top", parse_math=False
        )
        size = 9.0 if i == 0 else 7.5
        text.set_fontsize(size)
        text.set_in_layout(False)
        # Lines are broken by their number of characters; one of wide letters is set smaller.
        available = (1 - 3 * _MARGIN) * figure.bbox.width
        text.set_fontsize(size * min(1.0, available / max(text.get_window_extent().width, 1.0)))
