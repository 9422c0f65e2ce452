"""Figure of a calibration: the paper's Fig. 2, with residuals, transfer function and checks."""

import math
import textwrap
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from memscal.axisymmetry.kernels import gaussian_transfer, unit_gaussian
from memscal.figures.calibration_scan import (
    MOST_PANELS,
    draw_residuals,
    draw_scan_log,
    draw_scans,
    standardised,
)
from memscal.figures.style import (
    ALONG_RADIUS,
    DECONVOLVED,
    FAILED,
    FIGURE_WIDTH,
    GAUSSIAN,
    MEASURED,
    MUTED,
    REFERENCE,
    WINDOW,
    channel_indices,
    coverage,
    draw_band,
    drawable,
    drawn_as,
    house_style,
    legend_above,
    new_figure,
    on_axis,
    panel_letters,
)
from memscal.model.apparatus import ApparatusData, ApparatusRadial, Reconvolution
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import ESTIMATED, KPA, MM, PER_MM, PER_MM2, measured_text
from memscal.readings.find_places import even_lattice
from memscal.summaries.calibration import (
    Calibrated,
    Loads,
    apparatus_of,
    points_by_load,
    sensor_name,
    some_points,
)
from memscal.summaries.table import verdict

_Line = tuple[str, str, str]  # text, colour and weight
_MOST_DRAWN = 5_000  # points of lines
_FINE = 401  # points of the curves of G and its transform
_LOG_DECADES = 4.0


def draw_radial(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r), twice its standard uncertainty and the Gaussian, linear."""
    radial = data.radial_profile
    axes.axhline(0.0, color="0.4", lw=0.6)
    _draw_profiles(axes, data, floor=-np.inf)
    band = coverage() * radial.g_errors
    peak = _peak(radial)
    # The band may be much larger than G, which must stay legible in it.
    top = min(_largest(radial.g + band), 3 * peak)
    bottom = -min(_largest(band - radial.g, floor=0.0), 1.5 * peak)
    axes.set_ylim((bottom - 0.06 * top) / PER_MM2, 1.06 * top / PER_MM2)
    legend_above(axes)


def radial_figure(data: ApparatusData) -> Figure:
    """Draw G(r) alone, half a page wide, as a certificate shows it."""
    return drawn_as(partial(calibration_figure, data), (FIGURE_WIDTH / 2, 2.4), 2.0, ["radial"], ())


def draw_radial_log(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r) on a logarithmic axis; where G is not positive, it leaves the axis below."""
    radial = data.radial_profile
    axes.set_yscale("log")
    peak = _peak(radial)
    inside = radial.r <= _shown_radius(radial)
    least = 10**-_LOG_DECADES * peak
    floor = max(0.3 * radial.g_gaussian[inside].min(), least)
    _draw_profiles(axes, data, floor=0.1 * floor)
    axes.set_ylim(floor / PER_MM2, 3 * peak / PER_MM2)
    axes.set_xlabel(ALONG_RADIUS)


def draw_transfer(axes: Axes, data: ApparatusData) -> None:
    """Draw the transfer function's modulus, the window, and the resolved band."""
    transfer = data.transfer
    limit = transfer.resolved_wavenumber / PER_MM
    end = transfer.k[-1] / PER_MM
    if 0 < limit < np.inf:
        end = min(end, 2.0 * limit)
    k = np.linspace(0.0, end, _FINE)
    samples = np.stack([transfer.modulus, coverage() * transfer.modulus_errors, transfer.window])
    modulus, band, window = on_axis(transfer.k, samples, k * PER_MM)
    draw_band(
        axes, k, np.maximum(modulus - band, 0.0), modulus + band, f"±{coverage():g}u (conservative)"
    )
    axes.plot(k, np.maximum(modulus, 0.0), color=DECONVOLVED, label="modulus for G")
    gaussian = gaussian_transfer(k * PER_MM, data.gaussian_sigma)
    axes.plot(k, gaussian, "--", color=GAUSSIAN, label="Gaussian")
    axes.plot(k, window, ":", color=WINDOW, label="window")
    if limit < end:
        axes.axvspan(0.0, limit, color=REFERENCE, alpha=0.10, lw=0)
        axes.axvspan(
            limit,
            end,
            facecolor="0.95",
            edgecolor="0.75",
            hatch="////",
            lw=0,
            zorder=0,
            label="extrapolated",
        )
        axes.axvline(limit, color="0.25", lw=0.8, label=f"resolved to {limit:.3g} rad/mm")
    axes.set_xlim(0.0, end)
    axes.set_ylim(0.0, max(1.1, min(1.1 * _largest(modulus), 3.0)))
    axes.set(xlabel="wavenumber $k$ (rad/mm)", ylabel="transfer function (1)")
    legend_above(axes)


def _draw_profiles(axes: Axes, data: ApparatusData, *, floor: float) -> None:
    """Draw G with its band and the Gaussian, above a floor, to where they have died away."""
    radial = data.radial_profile
    end = _shown_radius(radial)
    r = np.linspace(0.0, end, _FINE)
    g, band = on_axis(radial.r, np.stack([radial.g, coverage() * radial.g_errors]), r)
    profiles = np.stack([g - band, g + band, g, unit_gaussian(r, data.gaussian_sigma)])
    low, high, g, gaussian = np.maximum(profiles, floor) / PER_MM2
    draw_band(axes, r / MM, low, high, f"±{coverage():g}u (conservative)")
    axes.plot(r / MM, g, color=DECONVOLVED, label="deconvolved G")
    axes.plot(r / MM, gaussian, "--", color=GAUSSIAN, label="Gaussian fit")
    axes.set_xlim(0.0, end / MM)
    axes.set_ylabel(f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")


def _shown_radius(radial: ApparatusRadial) -> float:
    """Return the radius to draw up to: where G, or its Gaussian, has died away."""
    peak = _peak(radial)
    last = float(radial.r[-1])
    alive = radial.r[np.maximum(abs(radial.g), radial.g_gaussian) > 1e-3 * peak]
    gaussian_alive = radial.r[radial.g_gaussian > 1e-3 * peak]
    if not gaussian_alive.size:
        return last
    # Ripples of a poor deconvolution reach far; the Gaussian bounds the sensor.
    far = min(alive[-1], 1.6 * gaussian_alive[-1])
    return min(1.1 * far, last) or last


def _peak(radial: ApparatusRadial) -> float:
    """Return the largest of G and its Gaussian."""
    return max(_largest(radial.g), _largest(radial.g_gaussian))


def _largest(values: FloatArray, floor: float = 1e-300) -> float:
    return np.max(values, initial=floor, where=np.isfinite(values))


_RESIDUALS = (-3.5, 3.5)
_DOTS = 5e3  # area of all points that lie on no lattice, in square points: half of a map's


def _draw_maps(figure: Figure, place: SubplotSpec, data: ApparatusData, loads: Loads) -> list[Axes]:
    """Draw voltage and residual of each load in a row, and G beside the first."""
    grid = place.subgridspec(len(loads), 3)
    panels = []
    voltage_label = f"$U_{{{channel_indices(data)}}}$ less baseline ({data.reading.unit})"
    for row, (load, part) in enumerate(loads):
        scan = part.reconvolution
        background = np.asarray(scan.background)
        voltage = (scan.u_zz - background) / data.reading.scale
        predicted = (scan.u_zz_predicted - background) / data.reading.scale
        z, _, scale = standardised(scan)
        left = figure.add_subplot(grid[row, 0], label="voltage map")
        # An outlier does not stretch the colours of the other voltages.
        span = (predicted.min(), predicted.max())
        _finish(left, _draw_points(left, scan, voltage, "viridis", span), voltage_label)
        left.set_ylabel("$y$ from the centre (mm)", labelpad=8)
        right = figure.add_subplot(grid[row, 1], label="residual map")
        _finish(right, _draw_points(right, scan, z, "RdBu_r", _RESIDUALS), f"residual / {scale}")
        for axes in (left, right):
            axes.set_title(load, loc="left", fontsize=8.0, pad=4)
        panels += [left, right]
    panels.insert(2, _draw_g(figure.add_subplot(grid[0, 2], label="G map"), data))
    return panels


def _draw_g(axes: Axes, data: ApparatusData) -> Axes:
    field = data.field
    reach = 5 * data.gaussian_sigma
    x = abs(field.x) <= reach
    y = abs(field.y) <= reach
    g = field.g[np.ix_(y, x)] / PER_MM2
    plane = (field.x[x] / MM, field.y[y] / MM, g)
    drawn = axes.pcolormesh(*plane, cmap="viridis", rasterized=True)
    axes.contour(*plane, [g.max() / 2], colors=MEASURED, linewidths=1.0)
    axes.plot([], [], color=MEASURED, lw=1.0, label="half of the largest G")
    legend_above(axes)
    _finish(axes, drawn, f"$G_{{{channel_indices(data)}}}$ (1/mm$^2$)")
    return axes


def _draw_points(
    axes: Axes, scan: Reconvolution, values: FloatArray, colours: str, span: tuple[float, float]
) -> ScalarMappable:
    """Draw values at the points of a raster; on a lattice nodes that are missing are grey."""
    look: Values = {"cmap": colours, "rasterized": True, "vmin": span[0], "vmax": span[1]}
    x = np.asarray(scan.offset_x)
    y = np.asarray(scan.offset_y)
    lattice = even_lattice(x, y, x.size)
    if not lattice:
        return axes.scatter(x / MM, y / MM, _DOTS / x.size, values, lw=0, **look)
    along, across = lattice
    nodes = [(a.start + a.step * np.arange(a.index.max() + 1)) / MM for a in lattice]
    cells = np.full((nodes[1].size, nodes[0].size), np.nan)
    cells[across.index, along.index] = values
    axes.set_facecolor("0.75")
    return axes.pcolormesh(*nodes, cells, **look)


def _finish(axes: Axes, drawn: ScalarMappable, label: str) -> None:
    """Give a map its aspect, axes, and a colour bar that is as high as it is."""
    axes.set(aspect="equal", xlabel="$x$ from the centre (mm)")
    axes.locator_params(nbins=4)
    Colorbar(axes.inset_axes((1.04, 0.0, 0.06, 1.0)), drawn, label=label)


_PANELS_HEIGHT = 8.2
_LINE_HEIGHT = 0.155
_LINE_WIDTH = 122
_MOST_MAPS = 4
_MAP_HEIGHT = 2.2
_MARGIN = 0.012  # left and right of the lines of text, of the width


def calibration_figure(result: Calibrated) -> Figure:
    """Draw an apparatus function and the scan that it came from, after Fig. 2 of the paper."""
    data = apparatus_of(result)
    loads = points_by_load(data)
    lines = _text_lines(data, loads)
    count = data.reconvolution.x.size
    every = math.ceil(count / _MOST_DRAWN)
    raster = data.reconvolution.offset_x is not None
    if every > 1 and not raster:
        lines.append((f"Of {count:,} points one in {every} is drawn.", MUTED, "normal"))
        data = replace(
            data, reconvolution=some_points(data.reconvolution, slice(None, None, every))
        )
        loads = points_by_load(data)
    mapped = loads[:_MOST_MAPS] if raster else []
    apart = min(len(loads), MOST_PANELS)
    heights = [_LINE_HEIGHT * (len(lines) + 0.6), _PANELS_HEIGHT + max(apart - 3, 0)]
    if mapped:
        heights.append(_MAP_HEIGHT * len(mapped))
    with house_style():
        figure = new_figure(sum(heights))
        outer = figure.add_gridspec(len(heights), 2, height_ratios=heights)
        _write_lines(figure, lines)
        figure.add_subplot(outer[0, :], label="text").set_axis_off()
        scan_panels = _draw_scan_panels(figure, outer[1, 0], data, loads)
        grid = outer[1, 1].subgridspec(3, 1)
        radial = figure.add_subplot(grid[0], label="radial")
        radial_log = figure.add_subplot(grid[1], sharex=radial, label="radial_log")
        transfer = figure.add_subplot(grid[2], label="transfer")
        draw_radial(radial, data)
        radial.tick_params(labelbottom=False)
        draw_radial_log(radial_log, data)
        draw_transfer(transfer, data)
        panels = [*scan_panels, radial, radial_log, transfer]
        if mapped:
            panels += _draw_maps(figure, outer[2, :], data, mapped)
        panel_letters(panels)
        # Passes of the layout (maps need three), then none: rendering twice gives the same picture.
        for _ in range(3 if mapped else 1):
            figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def _draw_scan_panels(
    figure: Figure, place: SubplotSpec, data: ApparatusData, loads: Loads
) -> list[Axes]:
    """Draw scan, residuals and scan on a logarithmic axis; return a panel of each."""
    apart = min(len(loads), MOST_PANELS)
    heights = [max(1.0, 3.0 / apart)] * apart
    grid = place.subgridspec(apart + 2, 1, height_ratios=[*heights, 1.5, 3.0])
    scan = figure.add_subplot(grid[0], label="scan")
    scans = [
        scan,
        *(figure.add_subplot(grid[i], sharex=scan, label="scan") for i in range(1, apart)),
    ]
    residuals = figure.add_subplot(grid[-2], sharex=scan, label="residuals")
    scan_log = figure.add_subplot(grid[-1], sharex=scan, label="scan_log")
    draw_scans(scans, loads)
    draw_residuals(residuals, data, loads)
    draw_scan_log(scan_log, data, loads)
    for axes in (*scans, residuals):
        axes.tick_params(labelbottom=False)
    return [scan, residuals, scan_log]


def values_text(data: ApparatusData) -> str:
    """Return the main values with their expanded uncertainties, in one line."""
    parameters = data.parameters
    names = ("conversion_constant", "gaussian_sigma", "gaussian_sigma_deconvolved")
    values = [
        f"{ESTIMATED[name].symbol} = {measured_text(parameters, name, data.coverage_factor(name))}"
        for name in names
        if name in parameters
    ]
    bands = f"bars and bands: U = {coverage():g}u (k = {coverage():g})"
    return f"{',  '.join(values)};  ±: 95 %;  {bands}"


def _text_lines(data: ApparatusData, loads: Loads) -> list[_Line]:
    """Return the lines above the panels, with the colour and the weight of each."""
    ink = MEASURED
    # A long name is cut, not the channel behind it.
    name = textwrap.shorten(f"Apparatus function of {sensor_name(data)}", 82, placeholder=" …")
    title = textwrap.shorten(f"{name}, channel {data.sensor.channel}", 95, placeholder=" …")
    lines = [(title, ink, "bold"), (_setting(data, loads), MUTED, "normal")]
    lines.append((values_text(data), ink, "normal"))
    colour = ink if data.passed else FAILED
    said = textwrap.wrap(verdict(data.checks), _LINE_WIDTH)
    return lines + [(line, colour, "normal") for line in said]


def _setting(data: ApparatusData, loads: Loads) -> str:
    """Return in one line what pressed on what film."""
    film = data.film
    rod = data.indenter
    parts = []
    if rod:
        load = f", {data.load:.3g} N" if data.load else ""
        if len(loads) > 1:
            load = f", {loads[0][0]} to {loads[-1][0]}"
        parts.append(f"{rod.shape} of radius {rod.radius / MM:.3g} mm{load}")
    if film:
        modulus = f"E = {film.young_modulus / KPA / 1e3:.3g} MPa"
        law = f", {film.law_text}" if film.law else ""
        elasticity = f"{modulus}, ν = {film.poisson_ratio:.3g}{law}"
        parts.append(f"film {film.thickness / MM:.3g} mm, {elasticity}")
    return "; ".join(parts)


def _write_lines(figure: Figure, lines: list[_Line]) -> None:
    height = figure.get_figheight()
    for i, (line, colour, weight) in enumerate(lines):
        y = 1.0 - (0.08 + _LINE_HEIGHT * i) / height
        # A sensor's name may hold a dollar sign: it is text, not mathematics.
        size = 9.0 if i == 0 else 7.5
        text = figure.text(
            _MARGIN,
            y,
            drawable(line),
            color=colour,
            weight=weight,
            va="top",
            parse_math=False,
            fontsize=size,
            in_layout=False,
        )
        # A line that is too wide, as one of wide letters, is set smaller.
        available = (1 - 3 * _MARGIN) * figure.bbox.width
        text.set_fontsize(size * min(1.0, available / max(text.get_window_extent().width, 1.0)))
