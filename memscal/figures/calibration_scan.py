"""Panels of a calibration's scan: voltages with both reconvolutions, and residuals."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle, pairwise
from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from memscal.estimation.points import MINIMUM_POSITIONS, loads_differ
from memscal.figures import style
from memscal.figures.style import ALONG_RADIUS, COLOURS, EXPANDED, channel_indices, legend_above
from memscal.model.apparatus import ApparatusData, Reconvolution
from memscal.model.arrays import FloatArray
from memscal.model.checks import REPEAT_CENTRES
from memscal.model.film import LINEAR
from memscal.model.indenter import Rod
from memscal.model.quantities import KPA, MM

Loads: TypeAlias = Sequence[tuple[str, ApparatusData]]  # each load's text and points
_Look: TypeAlias = tuple[str, str]  # colour and marker
MOST_PANELS = 6
"""Loads that are drawn in panels of their own and named."""


def draw_scan(axes: Axes, data: ApparatusData, look: _Look) -> None:
    """Draw the scan on a linear axis; the right-hand axis reads U/A in kPa."""
    scan = data.reconvolution
    _draw_measured(axes, data, scan.u_zz, look, "scan, ±2u")
    _draw_predictions(axes, data)
    _draw_reference(axes, data)
    _draw_indenter(axes, data)
    limit_to_scan(axes, scan.x)
    word = "voltage" if data.reading.si == "V" else "reading"
    axes.set_ylabel(f"{word} $U_{{{channel_indices(data)}}}$ ({data.reading.unit})")
    _stress_axis(axes, data, baseline=_baseline(data))


def draw_scans(panels: Sequence[Axes], loads: Loads) -> None:
    """Draw the scan; of several loads each in a panel of its own, with one label in the middle."""
    looks = _looks(loads, COLOURS["measured"])
    for i, (axes, (load, part), look) in enumerate(zip(panels, loads, looks, strict=False)):
        if i == MOST_PANELS - 1 < len(loads) - 1:
            load += f"\nand {len(loads) - MOST_PANELS} more loads"
        draw_scan(axes, part, look)
        words = axes.text(0.98, 0.92, load, ha="right", va="top", transform=axes.transAxes)
        words.set_color(look[0])
        for labelled in (axes, *axes.child_axes) if len(panels) > 1 else ():
            label = labelled.yaxis.label
            label.set(visible=i == len(panels) // 2, y=0.5 if len(panels) % 2 else 1.0)
            labelled.set_in_layout(labelled is axes)
            labelled.yaxis.labelpad = 10  # clear of the longer numbers of other panels
    legend_above(panels[0], points=loads[0][1].reconvolution.x.size)


def draw_scan_log(axes: Axes, data: ApparatusData, loads: Loads) -> None:
    """Draw the scan less its baseline, logarithmic, each load in its colour."""
    axes.set_yscale("log")
    looks = _looks(loads, COLOURS["measured"])
    ranges = [
        _draw_net(axes, part, look, "_" * (i >= MOST_PANELS or not load) + load)
        for i, ((load, part), look) in enumerate(zip(loads, looks, strict=True))
    ]
    low = np.nanmin([r[0] for r in ranges])
    high = np.nanmax([r[1] for r in ranges])
    if np.isfinite([low, high]).all():
        axes.set_ylim(0.5 * low / data.reading.scale, 2.0 * high / data.reading.scale)
    _draw_indenter(axes, data)
    limit_to_scan(axes, data.reconvolution.x)
    along = "y" if data.process.configuration.get("direction") == "y" else "x"
    aligned = ", repeats moved to one centre" if _aligned(data) else ""
    axes.set_xlabel(ALONG_RADIUS if _by_distance(data) else f"position ${along}$ (mm){aligned}")
    bar = "|" if _tangential(data) else ""
    unit = data.reading.unit
    axes.set_ylabel(f"{bar}$U_{{{channel_indices(data)}}}$ less baseline{bar} ({unit})")
    _stress_axis(axes, data, baseline=0.0)
    named = [_LIMIT, *(load for load, _ in loads)]  # the lines are those of the panel above
    entries = zip(*axes.get_legend_handles_labels(), strict=True)
    handles = [handle for handle, name in entries if name in named]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1), borderpad=0.2, ncols=2)


_LIMIT = "less than 2u: upper limit, U + 2u"


def _draw_net(axes: Axes, data: ApparatusData, look: _Look, label: str) -> tuple[float, float]:
    """Draw points less baseline, of those below 2u the upper limit; return what is to be shown."""
    scan = data.reconvolution
    signal = _turned(data, scan.x) * (scan.u_zz - _background(data, scan.x))
    errors = EXPANDED * _finite_errors(scan.u_zz_errors)
    clear = (signal > errors) & (signal > 0)
    limit = np.where(clear, np.nan, np.maximum(signal, 0.0) + errors)
    limit[~(limit > 0)] = np.nan
    _draw_measured(axes, data, np.where(clear, signal, np.nan), look, label)
    if np.any(np.isfinite(limit)):
        (limits,) = axes.plot(scan.x / MM, limit / data.reading.scale, "v", mfc="none", mew=0.7)
        limits.set(color=COLOURS["muted"], markersize=0.8 * style.marker_size(scan.x.size))
        drawn = axes.get_legend_handles_labels()[1]
        limits.set_label("_" * (_LIMIT in drawn) + _LIMIT)
        limits.set_rasterized(scan.x.size > style.SCATTER_THRESHOLD)
    _draw_predictions(axes, data, net=True)
    peak = _draw_reference(axes, data, net=True)
    heights = np.concatenate([signal[clear], limit[np.isfinite(limit)], [np.nan]])
    return np.fmin.reduce(heights), max(np.fmax.reduce(heights), peak)


def _draw_measured(axes: Axes, data: ApparatusData, u: FloatArray, look: _Look, label: str) -> None:
    """Draw voltages (V) at the scan's points, with their expanded uncertainties."""
    x = data.reconvolution.x
    scale = data.reading.scale
    (colour, marker) = look
    size = style.marker_size(x.size)
    if x.size > style.SCATTER_THRESHOLD:
        (points,) = axes.plot(x / MM, u / scale, ".", color=colour, ms=1.5, mew=0)
        points.set(rasterized=True, label=label.removesuffix(", ±2u"))
        return
    errors = EXPANDED * _finite_errors(data.reconvolution.u_zz_errors)
    axes.errorbar(
        x / MM,
        u / scale,
        errors / scale,
        fmt=marker,
        ms=size,
        mfc="white",
        mew=0.7,
        color=colour,
        elinewidth=0.7,
        capsize=1.5 if x.size <= 100 else 0,
        zorder=2,
        label=label,
    )


def _looks(loads: Loads, alone: str) -> list[_Look]:
    """Return colour and marker of each load, the same in all panels; of a single one ``alone``."""
    colours = style.shades(len(loads), 0.25) if len(loads) > 1 else [alone]
    return list(zip(colours, cycle("o^DvP*"), strict=False))


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
        gaps = np.diff(np.sort(x))
        # Moved to one centre, repeats stand beside each other; a single pass does not.
        mixed = _joint(data) or (_aligned(data) and np.min(gaps) < 0.3 * np.median(gaps))
        line_like = single_valued and scan.offset_x is None and not mixed
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
    reference = data.reference
    constant = data.conversion_constant
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
    rod = isinstance(data.indenter, Rod)
    radius = data.reference.contact_radius
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
    unit = data.reading
    shown = {"Pa": "kPa"}.get(data.reading.per, data.reading.per)
    per_mv = unit.scale / constant / (KPA if shown == "kPa" else 1.0)
    offset = baseline / unit.scale
    both_ways = (lambda u: (u - offset) * per_mv, lambda stress: stress / per_mv + offset)
    right = axes.secondary_yaxis("right", functions=both_ways)
    if unit.per == "Pa":
        blurred, stress = (f"${s}_{{{channel_indices(data)}}}$" for s in ("S", r"\sigma"))
        right.set_ylabel(f"blurred stress {blurred}, {stress} ({shown})")
    else:
        right.set_ylabel(f"$U/A$ ({shown})")


def _centre(data: ApparatusData) -> float:
    """Return where the indenter's axis stands on the axis that is drawn, in m."""
    if _by_distance(data):
        return 0.0
    return next((data.parameters[n] for n in ("centre", "centre_y") if n in data.parameters), 0.0)


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
    along = data.reconvolution.x
    stated = data.reconvolution.background
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
    low = float(np.min(x))
    high = float(np.max(x))
    margin = 0.03 * (high - low) or MM
    axes.set_xlim((low - margin) / MM, (high + margin) / MM)


def draw_residuals(axes: Axes, data: ApparatusData, loads: Loads) -> None:
    """Draw residuals over each point's standard uncertainty; those beyond the axis at its edge."""
    scan = data.reconvolution
    with_g, with_gaussian, scale = standardised(scan)
    series = [("Gaussian", scan.x, with_gaussian, COLOURS["gaussian"], "s", "none")]
    looks = _looks(loads, COLOURS["deconvolved"])
    for i, ((load, part), (colour, marker)) in enumerate(zip(loads, looks, strict=True)):
        name = "_" * (i >= MOST_PANELS) + (load or "G")
        place = part.reconvolution.x
        z = standardised(part.reconvolution)[0]
        series.append((name, place, z, colour, marker, colour))
    # One outlier cannot stretch the axis.
    sizes = np.abs([with_g, with_gaussian])
    limit = float(max(3.5, min(1.1 * np.max(sizes), 2.0 * np.quantile(sizes, 0.9))))
    axes.axhspan(-EXPANDED, EXPANDED, color="0.92", lw=0, label="_±2")
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


def standardised(scan: Reconvolution) -> tuple[FloatArray, FloatArray, str]:
    """Residuals with G and with the Gaussian over their standard uncertainty, and its symbol."""
    errors = scan.u_zz_errors
    scale = "$u$"
    if not np.all(np.isfinite(errors) & (errors > 0)):
        # Without a stated uncertainty residuals are shown over their own rms.
        rms = float(np.sqrt(np.mean(scan.residual**2)))
        errors = np.full(errors.shape, rms if rms > 0 else 1.0)
        scale = "own rms"
    return scan.residual / errors, (scan.u_zz - scan.u_zz_gaussian) / errors, scale


def points_by_load(data: ApparatusData) -> Loads:
    """Return the points of each load apart, from the smallest up; of a single one without text."""
    scan = data.reconvolution
    parts = []
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
