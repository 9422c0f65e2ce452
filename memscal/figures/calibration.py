"""Figure of a calibration: the paper's Fig. 2, with residuals, transfer function and checks."""

import textwrap
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from memscal.axisymmetry.kernels import unit_gaussian
from memscal.figures import style
from memscal.figures.calibration_scan import (
    MOST_PANELS,
    Loads,
    draw_residuals,
    draw_scan_log,
    draw_scans,
    points_by_load,
    standardised,
)
from memscal.figures.style import ALONG_RADIUS, COLOURS, EXPANDED, channel_indices, legend_above
from memscal.model.apparatus import ApparatusData, ApparatusRadial, Reconvolution
from memscal.model.arrays import FloatArray
from memscal.model.checks import failed_check_messages
from memscal.model.quantities import ESTIMATED, KPA, MM, PER_MM, PER_MM2, measured_text
from memscal.readings.find_places import even_lattice
from memscal.summaries.calibration import Calibrated, apparatus_of, sensor_title

_MOST_DRAWN = 5_000  # points of lines
_FINE = 401  # points of the curves of G and its transform
_LOG_DECADES = 4.0


def draw_radial(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r), twice its standard uncertainty and the Gaussian, linear."""
    radial = data.radial_profile
    axes.axhline(0.0, color="0.4", lw=0.6)
    _draw_profiles(axes, data, floor=-np.inf)
    low, high = (radial.g + side * EXPANDED * radial.g_errors for side in (-1, 1))
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    # The band may be much larger than G, which must stay legible in it.
    top = min(_largest(high), 3 * peak)
    bottom = -min(_largest(-low, floor=0.0), 1.5 * peak)
    axes.set_ylim((bottom - 0.06 * top) / PER_MM2, 1.06 * top / PER_MM2)
    legend_above(axes)


def radial_figure(data: ApparatusData) -> Figure:
    """Draw G(r) alone, half a page wide, as a certificate shows it."""
    with style.house_style():
        figure = style.new_figure(2.4)
        figure.set_figwidth(style.FIGURE_WIDTH / 2)
        axes = figure.subplots()
        draw_radial(axes, data)
        axes.set_xlabel("distance from the axis $r$ (mm)")
    return figure


def draw_radial_log(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r) on a logarithmic axis; where G is not positive, it leaves the axis below."""
    radial = data.radial_profile
    axes.set_yscale("log")
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    inside = radial.r <= _shown_radius(radial)
    smallest = np.min(np.maximum(radial.g_gaussian[inside], 10**-_LOG_DECADES * peak))
    floor = max(0.3 * float(smallest), 10**-_LOG_DECADES * peak)
    _draw_profiles(axes, data, floor=0.1 * floor)
    axes.set_ylim(floor / PER_MM2, 3 * peak / PER_MM2)
    axes.set_xlabel(ALONG_RADIUS)


def draw_transfer(axes: Axes, data: ApparatusData) -> None:
    """Draw the transfer function's modulus, the window, and the resolved band."""
    transfer = data.transfer
    limit = transfer.resolved_wavenumber / PER_MM
    end = float(transfer.k[-1]) / PER_MM
    end = min(end, 2.0 * limit if np.isfinite(limit) and limit > 0 else np.inf)
    k = np.linspace(0.0, end, _FINE)
    samples = transfer.modulus, EXPANDED * transfer.modulus_errors, transfer.window
    modulus, band, window = style.on_axis(transfer.k, np.stack(samples), k * PER_MM)
    blue = COLOURS["deconvolved"]
    low = np.maximum(modulus - band, 0.0)
    high = modulus + band
    axes.fill_between(k, low, high, color=blue, alpha=0.25, lw=0, label="±2u (conservative)")
    axes.plot(k, np.maximum(modulus, 0.0), "-", color=blue, label="modulus for G")
    gaussian = np.exp(-0.5 * (data.gaussian_sigma * k * PER_MM) ** 2)
    axes.plot(k, gaussian, "--", color=COLOURS["gaussian"], label="Gaussian")
    axes.plot(k, window, ":", color=COLOURS["window"], label="window")
    if np.isfinite(limit) and limit < end:
        axes.axvspan(0.0, limit, color=COLOURS["reference"], alpha=0.10, lw=0, label="_resolved")
        hatched = axes.axvspan(limit, end, facecolor="0.95", edgecolor="0.75", hatch="////", lw=0)
        hatched.set(zorder=0, label="extrapolated")
        axes.axvline(limit, color="0.25", lw=0.8, label=f"resolved to {limit:.3g} rad/mm")
    top = max(1.1, min(1.1 * _largest(modulus), 3.0))
    axes.set(xlim=(0.0, end), ylim=(0.0, top))
    axes.set(xlabel="wavenumber $k$ (rad/mm)", ylabel="transfer function (1)")
    legend_above(axes)


def _draw_profiles(axes: Axes, data: ApparatusData, *, floor: float) -> None:
    """Draw G with its band and the Gaussian, above a floor, to where they have died away."""
    radial = data.radial_profile
    blue = COLOURS["deconvolved"]
    end = _shown_radius(radial)
    r = np.linspace(0.0, end, _FINE)
    g, band = style.on_axis(radial.r, np.stack([radial.g, EXPANDED * radial.g_errors]), r)
    gaussian = unit_gaussian(r, data.gaussian_sigma)
    low, high, g, gaussian = (
        np.maximum(values, floor) / PER_MM2 for values in (g - band, g + band, g, gaussian)
    )
    axes.fill_between(r / MM, low, high, color=blue, alpha=0.25, lw=0, label="±2u (conservative)")
    axes.plot(r / MM, g, "-", color=blue, label="deconvolved G")
    axes.plot(r / MM, gaussian, "--", color=COLOURS["gaussian"], label="Gaussian fit")
    axes.set_xlim(0.0, end / MM)
    axes.set_ylabel(f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")


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


_RESIDUALS = (-3.5, 3.5)
_DOTS = 5e3  # area of all points that lie on no lattice, in square points: half of a map's


def draw_maps(figure: Figure, place: SubplotSpec, data: ApparatusData, loads: Loads) -> list[Axes]:
    """Draw voltage and residual of each load in a row, and G beside the first."""
    shown = loads[:_MOST_MAPS]
    indices = channel_indices(data)
    unit = data.reading
    grid = place.subgridspec(len(shown), 3)
    panels = list[Axes]()
    for row, (load, part) in enumerate(shown):
        scan = part.reconvolution
        background = np.asarray(part.reconvolution.background)
        # An outlier does not stretch the colours of the other voltages.
        measured, predicted = (
            (u - background) / unit.scale for u in (scan.u_zz, scan.u_zz_predicted)
        )
        z, _, scale = standardised(scan)
        for i, (values, span, colours, label) in enumerate(
            (
                (measured, predicted, "viridis", f"$U_{{{indices}}}$ less baseline ({unit.unit})"),
                (z, _RESIDUALS, "RdBu_r", f"residual / {scale}"),
            )
        ):
            axes = figure.add_subplot(grid[row, i], label=f"{('voltage', 'residual')[i]} map")
            options = {"vmin": np.min(span), "vmax": np.max(span), "rasterized": True}
            _finish(axes, _draw_points(axes, scan, values, cmap=colours, **options), label)
            axes.set_title(load, loc="left", fontsize=8.0, pad=4)
            panels.append(axes)
        panels[-2].set_ylabel("$y$ from the centre (mm)", labelpad=8)
    kernel = figure.add_subplot(grid[0, 2], label="G map")
    x, y = (np.abs(a) <= 5 * data.gaussian_sigma for a in (data.field.x, data.field.y))
    plane = data.field.x[x] / MM, data.field.y[y] / MM, data.field.g[np.ix_(y, x)] / PER_MM2
    drawn = kernel.pcolormesh(*plane, cmap="viridis", rasterized=True)
    kernel.contour(*plane, [plane[2].max() / 2], colors=COLOURS["measured"], linewidths=1.0)
    kernel.plot([], [], color=COLOURS["measured"], lw=1.0, label="half of the largest G")
    legend_above(kernel)
    _finish(kernel, drawn, f"$G_{{{indices}}}$ (1/mm$^2$)")
    return [*panels[:2], kernel, *panels[2:]]


def _draw_points(axes: Axes, scan: Reconvolution, values: Any, **options: Any) -> ScalarMappable:
    """Draw values at the points of a raster; on a lattice nodes that are missing are grey."""
    x = np.asarray(scan.offset_x)
    y = np.asarray(scan.offset_y)
    lattice = even_lattice(x, y, x.size)
    if lattice is None:
        return axes.scatter(x / MM, y / MM, _DOTS / x.size, values, lw=0, **options)
    nodes = [(a.start + a.step * np.arange(a.index.max() + 1)) / MM for a in lattice]
    cells = np.full((nodes[1].size, nodes[0].size), np.nan)
    cells[lattice[1].index, lattice[0].index] = values
    axes.set_facecolor("0.75")
    return axes.pcolormesh(*nodes, cells, **options)


def _finish(axes: Axes, drawn: ScalarMappable, label: str) -> None:
    """Give a map its aspect, axes, and a colour bar that is as high as it is."""
    axes.set(aspect="equal", xlabel="$x$ from the centre (mm)")
    axes.locator_params(nbins=4)
    Colorbar(axes.inset_axes((1.04, 0.0, 0.06, 1.0)), drawn, label=label)


_PANELS_HEIGHT = 8.2
_LINE_HEIGHT = 0.155
_LINE_WIDTH = 122
_MAX_FAILED_LINES = 12
_MOST_MAPS = 4
_MAP_HEIGHT = 2.2
_MARGIN = 0.012  # left and right of the lines of text, of the width


def calibration_figure(result: Calibrated) -> Figure:
    """Draw an apparatus function and the scan that it came from, after Fig. 2 of the paper."""
    data = apparatus_of(result)
    loads = points_by_load(data)
    lines = _text_lines(data, loads)
    count = data.reconvolution.x.size
    if (every := -(-count // _MOST_DRAWN)) > 1 and data.reconvolution.offset_x is None:
        lines.append((f"Of {count:,} points one in {every} is drawn.", COLOURS["muted"], "normal"))
        columns: dict[str, Any] = {
            n: None if v is None else v[::every] for n, v in vars(data.reconvolution).items()
        }
        data = replace(data, reconvolution=Reconvolution(**columns))
        loads = points_by_load(data)
    apart = min(len(loads), MOST_PANELS)
    mapped = min(len(loads), _MOST_MAPS)
    mapped *= data.reconvolution.offset_x is not None
    with style.house_style():
        heights = [_LINE_HEIGHT * (len(lines) + 0.6), _PANELS_HEIGHT + max(apart - 3, 0)]
        heights += [_MAP_HEIGHT * mapped] * bool(mapped)
        figure = style.new_figure(sum(heights))
        outer = figure.add_gridspec(len(heights), 2, height_ratios=heights)
        _write_lines(figure, lines)
        figure.add_subplot(outer[0, :]).set_axis_off()
        scan_heights = [max(1.0, 3.0 / apart)] * apart
        left = outer[1, 0].subgridspec(apart + 2, 1, height_ratios=[*scan_heights, 1.5, 3.0])
        right = outer[1, 1].subgridspec(3, 1)
        scan = figure.add_subplot(left[0], label="scan")
        scans = [scan, *(figure.add_subplot(left[i], sharex=scan) for i in range(1, apart))]
        residuals = figure.add_subplot(left[-2], sharex=scan, label="residuals")
        scan_log = figure.add_subplot(left[-1], sharex=scan, label="scan_log")
        radial = figure.add_subplot(right[0], label="radial")
        radial_log = figure.add_subplot(right[1], sharex=radial, label="radial_log")
        transfer = figure.add_subplot(right[2], label="transfer")
        draw_scans(scans, loads)
        draw_residuals(residuals, data, loads)
        draw_scan_log(scan_log, data, loads)
        draw_radial(radial, data)
        draw_radial_log(radial_log, data)
        draw_transfer(transfer, data)
        for axes in (*scans, residuals, radial):
            axes.tick_params(labelbottom=False)
        maps = draw_maps(figure, outer[2, :], data, loads) if mapped else ()
        style.panel_letters((scan, residuals, scan_log, radial, radial_log, transfer, *maps))
        # Passes of the layout (maps need three), then none: rendering twice gives the same picture.
        for _ in range(3 if mapped else 1):
            figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def values_text(data: ApparatusData) -> str:
    """Return the main values with their expanded uncertainties, in one line."""
    parameters = data.parameters
    names = ("conversion_constant", "gaussian_sigma", "gaussian_sigma_deconvolved")
    values = [
        f"{ESTIMATED[name].symbol} = {measured_text(parameters, name, EXPANDED)}"
        for name in names
        if name in parameters
    ]
    return f"{',  '.join(values)};  ±, bars and bands: U = 2u (k = 2)"


def _text_lines(data: ApparatusData, loads: Loads) -> list[tuple[str, str, str]]:
    """Return the lines above the panels, with the colour and the weight of each."""
    ink = COLOURS["measured"]
    # A long name is cut, not the channel behind it.
    name, _, channel = sensor_title(data).rpartition(", channel ")
    name = textwrap.shorten(name, 82, placeholder=" …")
    title = textwrap.shorten(f"{name}, channel {channel}", 95, placeholder=" …")
    film = data.film
    rod = data.indenter
    load = f", {data.load:.3g} N; " if data.load else "; "
    if len(loads) > 1:
        load = f", {loads[0][0]} to {loads[-1][0]}; "
    setting = f"{rod.shape} of radius {rod.radius / MM:.3g} mm{load}" if rod else ""
    if film is not None:
        setting += f"film {film.thickness / MM:.3g} mm, "
        setting += f"E = {film.young_modulus / KPA / 1e3:.3g} MPa, ν = {film.poisson_ratio:.3g}"
        setting += f", {film.law_text}" if film.law else ""
    setting = setting.removesuffix("; ")
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
        text = figure.text(_MARGIN, y, style.drawable(line), color=colour, weight=weight, va="top")
        size = 9.0 if i == 0 else 7.5
        text.set(parse_math=False, fontsize=size, in_layout=False)
        # Lines are broken by their number of characters; one of wide letters is set smaller.
        available = (1 - 3 * _MARGIN) * figure.bbox.width
        text.set_fontsize(size * min(1.0, available / max(text.get_window_extent().width, 1.0)))
