"""Figure of a calibration: the paper's Fig. 2, with residuals, transfer function and checks."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle, pairwise
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.patches import Rectangle

from memscal.estimation.points import MINIMUM_POSITIONS, loads_differ
from memscal.figures import style
from memscal.figures.style import COLOURS, channel_indices, legend_above
from memscal.model.apparatus import ApparatusData, ApparatusRadial, Reconvolution
from memscal.model.arrays import FloatArray
from memscal.model.checks import REPEAT_CENTRES, failed_check_messages
from memscal.model.film import LINEAR
from memscal.model.indenter import Rod
from memscal.model.positions import even_lattice
from memscal.model.quantities import KPA, MM, PER_MM, PER_MM2, measured_text
from memscal.summaries.calibration import Calibrated, apparatus_of, sensor_title

_EXPANDED = 2.0  # coverage factor of everything that is drawn as a band or a limit
_MOST_DRAWN = 5_000  # points of lines
_Loads: TypeAlias = Sequence[tuple[str, ApparatusData]]  # each load's text and points


def draw_scan(axes: Axes, data: ApparatusData) -> None:
    """Draw the scan on a linear axis; the right-hand axis reads U/A in kPa."""
    scan = data.reconvolution
    _draw_measured(axes, data, scan.u_zz, _finite_errors(scan.u_zz_errors))
    _draw_predictions(axes, data)
    _draw_reference(axes, data)
    _draw_indenter(axes, data)
    limit_to_scan(axes, scan.x)
    word = "voltage" if data.reading.si == "V" else "reading"
    axes.set_ylabel(f"{word} $U_{{{channel_indices(data)}}}$ ({data.reading.unit})")
    _stress_axis(axes, data, baseline=_baseline(data))


def draw_scans(panels: Sequence[Axes], loads: _Loads) -> None:
    """Draw the scan; of several loads each in a panel of its own, with one label in the middle."""
    for i, (axes, (load, part)) in enumerate(zip(panels, loads, strict=False)):
        if i == _MOST_PANELS - 1 < len(loads) - 1:
            load += f"\nand {len(loads) - _MOST_PANELS} more loads"
        draw_scan(axes, part)
        axes.text(0.98, 0.92, load, ha="right", va="top", transform=axes.transAxes)
        for labelled in (axes, *axes.child_axes) if len(panels) > 1 else ():
            label = labelled.yaxis.label
            label.set(visible=i == len(panels) // 2, y=0.5 if len(panels) % 2 else 1.0)
            labelled.set_in_layout(labelled is axes)
    legend_above(panels[0], points=loads[0][1].reconvolution.x.size)


def draw_scan_log(axes: Axes, data: ApparatusData) -> None:
    """Draw the scan less its baseline, logarithmic; of points below 2u the upper limit, U + 2u."""
    scan = data.reconvolution
    signal = _turned(data, scan.x) * (scan.u_zz - _background(data, scan.x))
    errors = _finite_errors(scan.u_zz_errors)
    clear = (signal > _EXPANDED * errors) & (signal > 0)
    limit = np.where(clear, np.nan, np.maximum(signal, 0.0) + _EXPANDED * errors)
    limit[~(limit > 0)] = np.nan
    _draw_measured(axes, data, np.where(clear, signal, np.nan), errors, label="_measured")
    unit = data.reading
    if np.any(np.isfinite(limit)):
        (limits,) = axes.plot(scan.x / MM, limit / unit.scale, "v", mfc="none", mew=0.7)
        limits.set(color=COLOURS["muted"], markersize=0.8 * style.marker_size(scan.x.size))
        limits.set(label="less than 2u: upper limit, U + 2u")
        limits.set_rasterized(scan.x.size > style.SCATTER_THRESHOLD)
    _draw_predictions(axes, data, net=True)
    peak = _draw_reference(axes, data, net=True)
    axes.set_yscale("log")
    heights = np.concatenate([signal[clear], limit[np.isfinite(limit)]])
    if heights.size:
        top = max(float(np.max(heights)), peak)
        axes.set_ylim(0.5 * float(np.min(heights)) / unit.scale, 2.0 * top / unit.scale)
    _draw_indenter(axes, data)
    limit_to_scan(axes, scan.x)
    along = "distance from the centre $r$" if _by_distance(data) else "position $x$"
    aligned = ", repeats moved to one centre" if _aligned(data) and not _by_distance(data) else ""
    axes.set_xlabel(f"{along} (mm){aligned}")
    bar = "|" if _tangential(data) else ""
    axes.set_ylabel(f"{bar}$U_{{{channel_indices(data)}}}$ less baseline{bar} ({unit.unit})")
    _stress_axis(axes, data, baseline=0.0)
    if np.any(np.isfinite(limit)):
        axes.legend(handles=[limits], loc="lower left", bbox_to_anchor=(0, 1), borderpad=0.2)


def _draw_measured(
    axes: Axes, data: ApparatusData, u: FloatArray, errors: FloatArray, label: str = "scan, ±u"
) -> None:
    x, scale = data.reconvolution.x, data.reading.scale
    size, colour = style.marker_size(x.size), COLOURS["measured"]
    if x.size > style.SCATTER_THRESHOLD:
        (points,) = axes.plot(x / MM, u / scale, ".", color=colour, ms=1.5, mew=0)
        points.set(rasterized=True, label=label.removesuffix(", ±u"))
        return
    axes.errorbar(
        x / MM, u / scale, errors / scale, fmt="o", ms=size, mfc="white", mew=0.7, color=colour,
        elinewidth=0.7, capsize=1.5 if x.size <= 100 else 0, zorder=2, label=label,
    )  # fmt: skip


def _draw_predictions(axes: Axes, data: ApparatusData, *, net: bool = False) -> None:
    """Draw both reconvolutions; ``net``: less baseline and drift, and only where positive."""
    scan = data.reconvolution
    background = _background(data, scan.x) if net else np.zeros(scan.x.shape)
    for u, name, label, dashes in (
        (scan.u_zz_predicted, "deconvolved", "reconvolved, G", "-"),
        (scan.u_zz_gaussian, "gaussian", "reconvolved, Gaussian", "--"),
    ):
        x, curve = _as_curve(scan.x, u - background)
        if net:
            curve = _turned(data, x) * curve
            curve = np.where(curve > 0, curve, np.nan)
        single_valued = x.size < scan.x.size or np.unique(scan.x).size == scan.x.size
        line_like = single_valued and scan.offset_x is None and not (_joint(data) or _aligned(data))
        (line,) = axes.plot(x / MM, curve / data.reading.scale, dashes, label=label, zorder=3)
        line.set_color(COLOURS[name])
        if not line_like:  # rasters, several scans: many voltages near one x, which no line joins
            line.set(linestyle="none", marker="o" if name == "deconvolved" else "x")
            line.set(markersize=1.2 if x.size > style.SCATTER_THRESHOLD else 2.5, rasterized=True)


def _as_curve(x: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions in order with one value for each, where repeats agree; else as given."""
    places, inverse = np.unique(x, return_inverse=True)
    if places.size == x.size:
        order = np.argsort(x, kind="stable")
        return x[order], u[order]
    mean = np.bincount(inverse, weights=u) / np.bincount(inverse)
    return (places, mean) if np.max(np.abs(u - mean[inverse])) <= 1e-3 * np.ptp(u) else (x, u)


def _joint(data: ApparatusData) -> bool:
    """Whether several scans were fitted together: their points mix along x."""
    return "further_scans" in data.process.configuration


def _aligned(data: ApparatusData) -> bool:
    """Whether repeats with centres of their own are drawn about the first one's."""
    return any(message.kind == REPEAT_CENTRES for message in data.process.messages)


def _draw_reference(axes: Axes, data: ApparatusData, *, net: bool = False) -> float:
    """Draw baseline + A sigma_zz about the centre (``net``: only the latter); return its peak."""
    reference, constant = data.reference, data.conversion_constant
    stress = _seen_stress(data)
    if not (np.isfinite(constant) and constant > 0) or stress is None:
        return 0.0
    curved = data.film is not None and data.film.law not in ("", LINEAR)
    if curved and data.load and loads_differ((data.load, reference.load)):
        return 0.0  # the stress at another load has another shape
    voltage = constant * stress
    peak = float(np.max(voltage))
    if net:
        voltage = np.where(voltage > 0, voltage, np.nan)
    x = _centre(data) + np.concatenate([-reference.r[::-1], reference.r])
    curve = np.concatenate([voltage[::-1], voltage])
    if not net:
        curve = _turned(data, x) * curve + _background(data, x)
    (line,) = axes.plot(x / MM, curve / data.reading.scale, "-.", lw=1.0, zorder=1.5)
    line.set(color=COLOURS["reference"])
    line.set_label(rf"reference $\sigma_{{{channel_indices(data)}}}$ (right axis)")
    return peak


def _tangential(data: ApparatusData) -> bool:
    return channel_indices(data) != "zz"


def _seen_stress(data: ApparatusData) -> FloatArray | None:
    """The reference at the load, as the channel sees it where its voltage is positive, in Pa."""
    reference = data.reference
    factor = (data.load or reference.load) / reference.load
    if data.reading.per == "relative":
        factor = 1 / np.abs(reference.sigma_zz).max()
    if not _tangential(data):
        return reference.sigma_zz * factor
    return None if reference.sigma_rz is None else -reference.sigma_rz * factor


def _turned(data: ApparatusData, x: FloatArray) -> FloatArray:
    """One; of a tangential channel -1 where the indenter stands beyond the sensor."""
    return np.where((x > _centre(data)) & _tangential(data), -1.0, 1.0)


def _draw_indenter(axes: Axes, data: ApparatusData) -> None:
    """Draw the rod's diameter (or the sphere's contact) as the paper's black patch."""
    rod, radius = isinstance(data.indenter, Rod), data.reference.contact_radius
    form, radius = ("rod", data.indenter.radius) if rod and data.indenter else ("contact", radius)
    if radius is None:
        return
    left = (_centre(data) - radius) / MM
    patch = Rectangle((left, 0.0), 2 * radius / MM, 0.035, transform=axes.get_xaxis_transform())
    patch.set(facecolor="black", lw=0, zorder=4, label=f"{form}, diameter {2 * radius / MM:.3g} mm")
    axes.add_patch(patch)


def _stress_axis(axes: Axes, data: ApparatusData, *, baseline: float) -> None:
    """Add the right-hand axis (U - baseline)/A in kPa; without a positive A there is none."""
    if not (np.isfinite(constant := data.conversion_constant) and constant > 0):
        return
    unit, shown = data.reading, {"Pa": "kPa"}.get(data.reading.per, data.reading.per)
    per_mv = unit.scale / constant / (KPA if shown == "kPa" else 1.0)
    offset = baseline / unit.scale
    both_ways = (lambda u: (u - offset) * per_mv, lambda stress: stress / per_mv + offset)
    right = axes.secondary_yaxis("right", functions=both_ways)
    right.set_ylabel(rf"stress $\sigma_{{{channel_indices(data)}}}$, $U/A$ ({shown})")


def _centre(data: ApparatusData) -> float:
    """Return where the indenter's axis stands on the axis that is drawn, in m."""
    if _by_distance(data) or "centre" not in data.parameters:
        return 0.0
    return data.parameters["centre"]


def _by_distance(data: ApparatusData) -> bool:
    """Whether a raster's points are given by their distance from the centre."""
    raster = any(name.startswith("centre_") for name in data.parameters.names)
    # Several scans of a tangential channel keep the sign of the distance.
    signed = _tangential(data) and _joint(data)
    return raster and (signed or bool(np.all(data.reconvolution.x >= 0)))


def _baseline(data: ApparatusData) -> float:
    if data.reconvolution.background is not None:
        return float(np.mean(data.reconvolution.background))
    stated = "baseline" in data.parameters
    return data.parameters["baseline"] if stated else 0.0


def _background(data: ApparatusData, x: FloatArray) -> FloatArray:
    """Return baseline and drift, its change from end to end, at positions x, in V."""
    along, stated = data.reconvolution.x, data.reconvolution.background
    if stated is not None:
        # Elsewhere than at the points: of a raster or several scans a line through all of them.
        return stated if x is along else np.polynomial.Polynomial.fit(along, stated, 1)(x)
    level = np.full(x.shape, _baseline(data))
    if "drift" in data.parameters and np.ptp(along) > 0 and not _by_distance(data):
        middle = (np.max(along) + np.min(along)) / 2
        level += data.parameters["drift"] * (x - middle) / np.ptp(along)
    return level


def _finite_errors(errors: FloatArray) -> FloatArray:
    return np.where(np.isfinite(errors), errors, 0.0)


def limit_to_scan(axes: Axes, x: FloatArray) -> None:
    """Show the positions (m) of the scan, whatever the reference reaches."""
    low, high = float(np.min(x)), float(np.max(x))
    margin = 0.03 * (high - low) or MM
    axes.set_xlim((low - margin) / MM, (high + margin) / MM)


def draw_residuals(axes: Axes, data: ApparatusData, loads: _Loads) -> None:
    """Draw residuals over each point's standard uncertainty; those beyond the axis at its edge."""
    scan = data.reconvolution
    with_g, with_gaussian, scale = _standardised(scan)
    series = [("Gaussian", scan.x, with_gaussian, COLOURS["gaussian"], "s", "none")]
    colours = style.shades(len(loads), 0.25)
    for i, ((load, part), colour, marker) in enumerate(zip(loads, colours, cycle("o^DvP*"))):
        name = "_" * (i >= _MOST_PANELS) + (load or "G")
        place, z = part.reconvolution.x, _standardised(part.reconvolution)[0]
        series.append((name, place, z, colour, marker, colour))
    # One outlier cannot stretch the axis.
    sizes = np.abs([with_g, with_gaussian])
    limit = float(max(3.5, min(1.1 * np.max(sizes), 2.0 * np.quantile(sizes, 0.9))))
    axes.axhspan(-_EXPANDED, _EXPANDED, color="0.92", lw=0, label="_±2")
    axes.axhline(0.0, color="0.4", lw=0.6)
    many = scan.x.size > style.SCATTER_THRESHOLD
    size = 1.2 if many else style.marker_size(scan.x.size)
    for name, x, z, colour, marker, face in series:
        (points,) = axes.plot(x / MM, z, ls="none", marker=marker, ms=size)
        rms = np.sqrt(np.mean(z**2))
        points.set(color=colour, markerfacecolor=face, label=f"{name}: rms {rms:.2f}")
        points.set(rasterized=many, markeredgewidth=0.3 if many else 0.7)
        for side, mark in ((1, "^"), (-1, "v")):
            beyond = side * z > limit
            if np.any(beyond):
                edge = np.full(int(np.sum(beyond)), 0.93 * side * limit)
                axes.plot(x[beyond] / MM, edge, mark, color=colour, ms=4, label="_beyond the axis")
    axes.set_ylim(-limit, limit)
    axes.set_ylabel(f"residual / {scale}")
    limit_to_scan(axes, scan.x)
    legend_above(axes, points=scan.x.size)


def _standardised(scan: Reconvolution) -> tuple[FloatArray, FloatArray, str]:
    """Residuals with G and with the Gaussian over their standard uncertainty, and its symbol."""
    errors, scale = scan.u_zz_errors, "$u$"
    if not np.all(np.isfinite(errors) & (errors > 0)):
        # Without a stated uncertainty residuals are shown over their own rms.
        rms = float(np.sqrt(np.mean(scan.residual**2)))
        errors, scale = np.full(errors.shape, rms if rms > 0 else 1.0), "own rms"
    return scan.residual / errors, (scan.u_zz - scan.u_zz_gaussian) / errors, scale


_LOG_DECADES = 4.0


def draw_radial(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r), twice its standard uncertainty and the Gaussian, linear."""
    radial = data.radial_profile
    axes.axhline(0.0, color="0.4", lw=0.6)
    _draw_profiles(axes, data, radial.g, radial.g_gaussian, floor=-np.inf)
    low, high = (radial.g + side * _EXPANDED * radial.g_errors for side in (-1, 1))
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    # The band may be much larger than G, which must stay legible in it.
    top = min(_largest(high), 3 * peak)
    bottom = -min(_largest(-low, floor=0.0), 1.5 * peak)
    axes.set_ylim((bottom - 0.06 * top) / PER_MM2, 1.06 * top / PER_MM2)
    legend_above(axes)


def draw_radial_log(axes: Axes, data: ApparatusData) -> None:
    """Draw G(r) on a logarithmic axis; where G is not positive, only the band is drawn."""
    radial = data.radial_profile
    axes.set_yscale("log")
    peak = max(_largest(radial.g), _largest(radial.g_gaussian))
    inside = radial.r <= _shown_radius(radial)
    smallest = np.min(np.maximum(radial.g_gaussian[inside], 10**-_LOG_DECADES * peak))
    floor = max(0.3 * float(smallest), 10**-_LOG_DECADES * peak)
    positive = (np.where(g > 0, g, np.nan) for g in (radial.g, radial.g_gaussian))
    _draw_profiles(axes, data, *positive, floor=floor)
    axes.set_ylim(floor / PER_MM2, 3 * peak / PER_MM2)
    axes.set_xlabel("distance from the axis $r$ (mm)")


def draw_transfer(axes: Axes, data: ApparatusData) -> None:
    """Draw the transfer function's modulus, the window, and the resolved band."""
    transfer = data.transfer
    k, limit = transfer.k / PER_MM, transfer.resolved_wavenumber / PER_MM
    end = min(float(k[-1]), 2.0 * limit if np.isfinite(limit) and limit > 0 else np.inf)
    band = _EXPANDED * transfer.modulus_errors
    blue = COLOURS["deconvolved"]
    low, high = np.maximum(transfer.modulus - band, 0.0), transfer.modulus + band
    axes.fill_between(k, low, high, color=blue, alpha=0.25, lw=0, label="±2u (conservative)")
    axes.plot(k, transfer.modulus, "-", color=blue, label="modulus for G")
    gaussian = np.exp(-0.5 * (data.gaussian_sigma * transfer.k) ** 2)
    axes.plot(k, gaussian, "--", color=COLOURS["gaussian"], label="Gaussian")
    axes.plot(k, transfer.window, ":", color=COLOURS["window"], label="window")
    if np.isfinite(limit) and limit < end:
        axes.axvspan(0.0, limit, color=COLOURS["reference"], alpha=0.10, lw=0, label="_resolved")
        hatched = axes.axvspan(limit, end, facecolor="0.95", edgecolor="0.75", hatch="////", lw=0)
        hatched.set(zorder=0, label="extrapolated")
        axes.axvline(limit, color="0.25", lw=0.8, label=f"resolved to {limit:.3g} rad/mm")
    top = max(1.1, min(1.1 * _largest(transfer.modulus[k <= end]), 3.0))
    axes.set(xlim=(0.0, end), ylim=(0.0, top))
    axes.set(xlabel="wavenumber $k$ (rad/mm)", ylabel="transfer function (1)")
    legend_above(axes)


def _draw_profiles(
    axes: Axes, data: ApparatusData, g: FloatArray, gaussian: FloatArray, *, floor: float
) -> None:
    """Draw the band of G above a floor, and both profiles to where they have died away."""
    radial, blue = data.radial_profile, COLOURS["deconvolved"]
    r, spread = radial.r / MM, _EXPANDED * radial.g_errors
    low, high = (np.maximum(radial.g + side * spread, floor) / PER_MM2 for side in (-1, 1))
    axes.fill_between(r, low, high, color=blue, alpha=0.25, lw=0, label="±2u (conservative)")
    axes.plot(r, g / PER_MM2, "-", color=blue, label="deconvolved G")
    axes.plot(r, gaussian / PER_MM2, "--", color=COLOURS["gaussian"], label="Gaussian fit")
    axes.set_xlim(0.0, _shown_radius(radial) / MM)
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


def draw_maps(figure: Figure, place: SubplotSpec, data: ApparatusData, loads: _Loads) -> list[Axes]:
    """Draw voltage and residual of each load in a row, and G beside the first."""
    shown, indices, unit = loads[:_MOST_MAPS], channel_indices(data), data.reading
    grid, panels = place.subgridspec(len(shown), 3), list[Axes]()
    for row, (load, part) in enumerate(shown):
        scan, background = part.reconvolution, np.asarray(part.reconvolution.background)
        # An outlier does not stretch the colours of the other voltages.
        measured, predicted = (
            (u - background) / unit.scale for u in (scan.u_zz, scan.u_zz_predicted)
        )
        z, _, scale = _standardised(scan)
        for i, (values, span, colours, label) in enumerate((
            (measured, predicted, "viridis", f"$U_{{{indices}}}$ less baseline ({unit.unit})"),
            (z, _RESIDUALS, "RdBu_r", f"residual / {scale}"),
        )):  # fmt: skip
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
    x, y = np.asarray(scan.offset_x), np.asarray(scan.offset_y)
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
_MOST_PANELS, _MOST_MAPS, _MAP_HEIGHT = 6, 4, 2.2
_MARGIN = 0.012  # left and right of the lines of text, of the width


def calibration_figure(result: Calibrated) -> Figure:
    """Draw an apparatus function and the scan that it came from, after Fig. 2 of the paper."""
    data = apparatus_of(result)
    loads = _by_load(data)
    lines = _text_lines(data, loads)
    count = data.reconvolution.x.size
    if (every := -(-count // _MOST_DRAWN)) > 1 and data.reconvolution.offset_x is None:
        lines.append((f"Of {count:,} points one in {every} is drawn.", COLOURS["muted"], "normal"))
        columns: dict[str, Any] = {
            n: None if v is None else v[::every] for n, v in vars(data.reconvolution).items()
        }
        data = replace(data, reconvolution=Reconvolution(**columns))
        loads = _by_load(data)
    apart, mapped = min(len(loads), _MOST_PANELS), min(len(loads), _MOST_MAPS)
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
        draw_scan_log(scan_log, data)
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


def _by_load(data: ApparatusData) -> _Loads:
    """Return the points of each load apart, from the smallest up; of a single one without text."""
    scan, parts = data.reconvolution, []
    if scan.load is None:
        return [("", data)]
    loads, inverse = np.unique(scan.load, return_inverse=True)
    # A load that is measured with noise at each point is one load: there is no gap in it.
    group = np.cumsum([0, *map(loads_differ, pairwise(loads))])[inverse]
    counts = np.bincount(group)
    if counts.size == 1 or counts.min() < MINIMUM_POSITIONS:
        return [("", data)]
    for inside in group == np.arange(counts.size)[:, None]:
        columns = {name: v[inside] for name, v in vars(scan).items() if v is not None}
        load = float(scan.load[inside].mean())
        part = replace(data, load=load, reconvolution=Reconvolution(**columns))
        parts.append((f"{load:.3g} N", part))
    return parts


def values_text(data: ApparatusData) -> str:
    """Return the main values with their standard uncertainties, in one line."""
    parameters, deconvolved = data.parameters, "gaussian_sigma_deconvolved"
    values = [f"A = {measured_text(parameters, 'conversion_constant')}"]
    values.append(f"σ = {measured_text(parameters, 'gaussian_sigma')} (data space)")
    if deconvolved in parameters:
        values.append(f"{measured_text(parameters, deconvolved)} (deconvolved G)")
    return ",  ".join(values)


def _text_lines(data: ApparatusData, loads: _Loads) -> list[tuple[str, str, str]]:
    """Return the lines above the panels, with the colour and the weight of each."""
    ink = COLOURS["measured"]
    # A long name is cut, not the channel behind it.
    name, _, channel = sensor_title(data).rpartition(", channel ")
    name = textwrap.shorten(name, 82, placeholder=" …")
    title = textwrap.shorten(f"{name}, channel {channel}", 95, placeholder=" …")
    film, rod = data.film, data.indenter
    load = f", {data.load:.3g} N; " if data.load else "; "
    if len(loads) > 1:
        load = f", {loads[0][0]} to {loads[-1][0]}; "
    setting = f"{rod.shape} of radius {rod.radius / MM:.3g} mm{load}" if rod else ""
    if film is not None:
        setting += f"film {film.thickness / MM:.3g} mm, "
        setting += f"E = {film.young_modulus / KPA / 1e3:.3g} MPa, ν = {film.poisson_ratio:.3g}"
        setting += f", {film.law_text}; " if film.law else "; "
    setting += "± is the standard uncertainty (k = 1)"
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
