"""Panels of a calibration's scan: voltages with both reconvolutions, and residuals."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from memscal.estimation.points import loads_differ
from memscal.figures.style import (
    ALONG_RADIUS,
    DECONVOLVED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    REFERENCE,
    SCATTER_THRESHOLD,
    channel_indices,
    coverage,
    draw_measured,
    draw_residual_band,
    legend_above,
    marker_size,
    shades,
)
from memscal.model.apparatus import ApparatusData, Reconvolution
from memscal.model.arrays import ArrayPair, FloatArray, Values
from memscal.model.checks import REPEAT_CENTRES
from memscal.model.film import LINEAR
from memscal.model.indenter import Rod
from memscal.model.quantities import KPA, MM
from memscal.summaries.calibration import Loads

_Look = tuple[str, str]  # colour and marker
MOST_PANELS = 6
"""Loads that are drawn in panels of their own and named."""


def _draw_scan(axes: Axes, data: ApparatusData, look: _Look) -> Any:
    """Draw the scan, and on the right-hand axis U/A in kPa; return the drawn points."""
    scan = data.reconvolution
    label = "scan" if scan.x.size > SCATTER_THRESHOLD else f"scan, ±{coverage():g}u"
    points = _draw_measured(axes, data, scan.u_zz, look, label)
    _draw_predictions(axes, data)
    _draw_reference(axes, data)
    _draw_indenter(axes, data)
    _limit_to_scan(axes, scan.x)
    word = "voltage" if data.reading.si == "V" else "reading"
    axes.set_ylabel(f"{word} $U_{{{channel_indices(data)}}}$ ({data.reading.unit})")
    _stress_axis(axes, data, baseline=_baseline(data))
    return points


def draw_scans(panels: Sequence[Axes], loads: Loads) -> None:
    """Draw the scan; of several loads each in a panel of its own, with one label in the middle."""
    looks = _looks(loads, MEASURED)
    drawn = []
    for axes, (load, part), look in zip(panels, loads, looks, strict=False):
        drawn.append(_draw_scan(axes, part, look))
        if len(drawn) == MOST_PANELS < len(loads):
            load += f"\nand {len(loads) - MOST_PANELS} more loads"
        axes.text(0.98, 0.92, load, ha="right", va="top", color=look[0], transform=axes.transAxes)
    if len(panels) > 1:
        # The labels of the vertical axes stand once, in the middle of the panels.
        for i, axes in enumerate(panels):
            for labelled in (axes, *axes.child_axes):
                label = labelled.yaxis.label
                label.set(visible=i == len(panels) // 2, y=0.5 if len(panels) % 2 else 1.0)
                labelled.set_in_layout(labelled is axes)
                labelled.yaxis.labelpad = 10  # clear of the longer numbers of other panels
    legend_above(panels[0], points=loads[0][1].reconvolution.x.size, first=drawn[0])


def draw_scan_log(axes: Axes, data: ApparatusData, loads: Loads) -> None:
    """Draw the scan less its baseline, logarithmic, each load in its colour."""
    axes.set_yscale("log")
    named: list[Any] = []
    limits = []
    heights = []
    for (load, part), look in zip(loads, _looks(loads, MEASURED), strict=True):
        signal, limit = _signal_and_limit(part)
        heights += [signal, limit]
        points = _draw_measured(axes, part, signal, look, load or "_points")
        if load and len(named) < MOST_PANELS:
            named.append(points)
        if np.isfinite(limit).any():
            x = part.reconvolution.x
            limits += axes.plot(
                x / MM,
                limit / part.reading.scale,
                "v",
                mfc="none",
                mew=0.7,
                color=MUTED,
                ms=0.8 * marker_size(x.size),
                label=f"less than {coverage():g}u: upper limit, U + {coverage():g}u",
                rasterized=x.size > SCATTER_THRESHOLD,
            )
        _draw_predictions(axes, part, net=True)
        heights.append(_draw_reference(axes, part, net=True))
    shown = np.concatenate(heights)
    shown = shown[np.isfinite(shown)] / data.reading.scale
    if shown.size:
        axes.set_ylim(0.5 * shown.min(), 2.0 * shown.max())
    _draw_indenter(axes, data)
    _limit_to_scan(axes, data.reconvolution.x)
    axes.set_xlabel(position_label(data))
    bar = "|" if _tangential(data) else ""
    unit = data.reading.unit
    axes.set_ylabel(f"{bar}$U_{{{channel_indices(data)}}}$ less baseline{bar} ({unit})")
    _stress_axis(axes, data, baseline=0.0)
    handles = [*limits[:1], *named]  # the lines are those of the panel above
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1), borderpad=0.2, ncols=2)


def position_label(data: ApparatusData) -> str:
    """Say along what the points of a scan are drawn, with its unit."""
    along = "y" if data.process.configuration.get("direction") == "y" else "x"
    aligned = ", repeats moved to one centre" if _aligned(data) else ""
    return ALONG_RADIUS if _by_distance(data) else f"position ${along}$ (mm){aligned}"


def _signal_and_limit(data: ApparatusData) -> ArrayPair:
    """Return voltages less baseline, and of those below 2u the upper limit; else NaN, each."""
    scan = data.reconvolution
    signal = _turned(data, scan.x) * (scan.u_zz - _background(data, scan.x))
    errors = _bars(data)
    limit = np.maximum(signal, 0.0) + errors
    clear = (signal > errors) & (signal > 0)
    limited = ~clear & (limit > 0)
    return np.where(clear, signal, np.nan), np.where(limited, limit, np.nan)


def _draw_measured(axes: Axes, data: ApparatusData, u: FloatArray, look: _Look, label: str) -> Any:
    """Draw voltages (V) at the scan's points, with their expanded uncertainties; return them."""
    x = data.reconvolution.x / MM
    colour, marker = look
    return draw_measured(
        axes,
        x,
        u / data.reading.scale,
        _bars(data) / data.reading.scale,
        many=x.size > SCATTER_THRESHOLD,
        ls="none",
        marker=marker,
        ms=marker_size(x.size),
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
    colours = shades(len(loads), 0.25) if len(loads) > 1 else [alone]
    return list(zip(colours, cycle("o^DvP*"), strict=False))


def _draw_predictions(axes: Axes, data: ApparatusData, *, net: bool = False) -> None:
    """Draw both reconvolutions; ``net``: less baseline and drift, and only where positive."""
    scan = data.reconvolution
    background = _background(data, scan.x) if net else np.zeros(scan.x.shape)
    gaps = np.diff(np.unique(scan.x))
    # Moved to one centre, repeats stand beside each other; a single pass does not.
    interleaved = _aligned(data) and gaps.min() < 0.3 * np.median(gaps)
    mixed = scan.offset_x is not None or _joint(data) or interleaved
    for u, colour, label, dashes, marker in (
        (scan.u_zz_predicted, DECONVOLVED, "reconvolved, G", "-", "o"),
        (scan.u_zz_gaussian, GAUSSIAN, "reconvolved, Gaussian", "--", "x"),
    ):
        x, curve = _as_curve(scan.x, u - background)
        if net:
            curve = _turned(data, x) * curve
            curve = np.where(curve > 0, curve, np.nan)
        curve = curve / data.reading.scale
        (line,) = axes.plot(x / MM, curve, dashes, color=colour, label=label, zorder=3)
        if mixed or np.any(np.diff(x) <= 0):  # many voltages near one x, which no line joins
            size = 1.2 if x.size > SCATTER_THRESHOLD else 2.5
            line.set(linestyle="none", marker=marker, markersize=size, rasterized=True)


def _as_curve(x: FloatArray, u: FloatArray) -> ArrayPair:
    """Return positions in order with one value for each, where repeats agree; else as given."""
    places, inverse = np.unique(x, return_inverse=True)
    mean = np.bincount(inverse, weights=u) / np.bincount(inverse)
    agree = abs(u - mean[inverse]).max() <= 1e-3 * np.ptp(u)
    return (places, mean) if agree else (x, u)


def _joint(data: ApparatusData) -> bool:
    """Whether several scans were fitted together: their points mix along x."""
    return "further_scans" in data.process.configuration


def _aligned(data: ApparatusData) -> bool:
    """Whether repeats with centres of their own are drawn about the first one's."""
    return any(message.kind == REPEAT_CENTRES for message in data.process.messages)


def _draw_reference(axes: Axes, data: ApparatusData, *, net: bool = False) -> FloatArray:
    """Draw baseline + A sigma_zz about the centre (``net``: only the latter); return its peak."""
    reference = data.reference
    constant = data.conversion_constant
    stress = _seen_stress(data)
    curved = data.film and data.film.law not in ("", LINEAR)
    # Of a curved law the stress at another load has another shape.
    other = curved and data.load and loads_differ((data.load, reference.load))
    # A point is nothing beside its axis.
    if stress is None or not stress.any() or other or not 0 < constant < np.inf:
        return np.array([])
    voltage = constant * stress
    peak = voltage.max(keepdims=True)
    if net:
        voltage = np.where(voltage > 0, voltage, np.nan)
    x = _centre(data) + np.append(-reference.r[::-1], reference.r)
    curve = np.append(voltage[::-1], voltage)
    if not net:
        curve = _turned(data, x) * curve + _background(data, x)
    axes.plot(
        x / MM,
        curve / data.reading.scale,
        "-.",
        lw=1.0,
        zorder=1.5,
        color=REFERENCE,
        label=rf"reference $\sigma_{{{channel_indices(data)}}}$ (right axis)",
    )
    return np.asarray(peak)


def _tangential(data: ApparatusData) -> bool:
    return channel_indices(data) != "zz"


def _seen_stress(data: ApparatusData) -> FloatArray | None:
    """The reference at the load, as the channel sees it where its voltage is positive, in Pa."""
    reference = data.reference
    factor = (data.load or reference.load) / reference.load
    if data.reading.relative:
        factor = 1 / (abs(reference.sigma_zz).max() or 1.0)
    if not _tangential(data):
        return reference.sigma_zz * factor
    return None if reference.sigma_rz is None else -reference.sigma_rz * factor


def _turned(data: ApparatusData, x: FloatArray) -> FloatArray:
    """One; of a tangential channel -1 where the indenter stands beyond the sensor."""
    return np.where((x > _centre(data)) & _tangential(data), -1.0, 1.0)


def _draw_indenter(axes: Axes, data: ApparatusData) -> None:
    """Draw the rod's diameter (or the sphere's contact) as the paper's black patch."""
    form = "contact"
    radius = data.reference.contact_radius
    if isinstance(data.indenter, Rod):
        form = "rod"
        radius = data.indenter.radius
    if radius is None:
        return
    left = (_centre(data) - radius) / MM
    diameter = 2 * radius / MM
    label = f"{form}, diameter {diameter:.3g} mm"
    axes.axvspan(left, left + diameter, ymax=0.035, color="black", lw=0, zorder=4, label=label)


def _stress_axis(axes: Axes, data: ApparatusData, *, baseline: float) -> None:
    """Add the right-hand axis (U - baseline)/A in kPa; without a positive A there is none."""
    constant = data.conversion_constant
    if not 0 < constant < np.inf:
        return
    unit = data.reading
    pascals = unit.per == "Pa"
    per_unit = unit.scale / constant / (KPA if pascals else 1.0)
    offset = baseline / unit.scale
    both_ways = (lambda u: (u - offset) * per_unit, lambda stress: stress / per_unit + offset)
    right = axes.secondary_yaxis("right", functions=both_ways)
    indices = channel_indices(data)
    label = rf"blurred stress $S_{{{indices}}}$, $\sigma_{{{indices}}}$ (kPa)"
    right.set_ylabel(label if pascals else f"$U/A$ ({unit.per})")


def _centre(data: ApparatusData) -> float:
    """Return where the indenter's axis stands on the axis that is drawn, in m."""
    if _by_distance(data):
        return 0.0
    named = [name for name in ("centre", "centre_y") if name in data.parameters]
    return data.parameters[named[0]] if named else 0.0


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
    """Return baseline, drift from end to end and curvature at positions x, in V."""
    along = data.reconvolution.x
    stated = data.reconvolution.background
    if stated is not None:
        # Elsewhere than at the points: of a raster or several scans a line through all of them.
        return stated if x is along else np.polynomial.Polynomial.fit(along, stated, 1)(x)
    level = np.full(x.shape, _baseline(data))
    length = np.ptp(along)
    if "drift" in data.parameters and length > 0 and not _by_distance(data):
        middle = (along.max() + along.min()) / 2
        level += data.parameters["drift"] * (x - middle) / length
        if "baseline_curvature" in data.parameters:
            level += data.parameters["baseline_curvature"] * (2 * (x - middle) / length) ** 2
    return level


def _bars(data: ApparatusData) -> FloatArray:
    """Return the expanded uncertainties of the voltages, 0 where they are not stated."""
    return coverage() * np.nan_to_num(data.reconvolution.u_zz_errors, posinf=0.0)


def _limit_to_scan(axes: Axes, x: FloatArray) -> None:
    """Show the positions (m) of the scan, whatever the reference reaches."""
    margin = 0.03 * np.ptp(x) or MM
    axes.set_xlim((x.min() - margin) / MM, (x.max() + margin) / MM)


def draw_residuals(axes: Axes, data: ApparatusData, loads: Loads) -> None:
    """Draw residuals over each point's standard uncertainty; those beyond the axis at its edge."""
    scan = data.reconvolution
    x = scan.x
    with_g, with_gaussian, scale = standardised(scan)
    # One outlier cannot stretch the axis.
    sizes = np.abs([with_g, with_gaussian])
    limit = max(3.5, min(1.1 * sizes.max(), 2.0 * np.quantile(sizes, 0.9)))
    draw_residual_band(axes)
    many = x.size > SCATTER_THRESHOLD
    common = {
        "ls": "none",
        "ms": 1.2 if many else marker_size(x.size),
        "mew": 0.3 if many else 0.7,
        "rasterized": many,
    }
    gaussian = common | {"color": GAUSSIAN, "marker": "s", "mfc": "none"}
    _draw_residual_points(axes, x, with_gaussian, "Gaussian", limit, gaussian)
    looks = _looks(loads, DECONVOLVED)
    for i, ((load, part), (colour, marker)) in enumerate(zip(loads, looks, strict=True)):
        name = "_" * (i >= MOST_PANELS) + (load or "G")
        z, *_ = standardised(part.reconvolution)
        look = common | {"color": colour, "marker": marker, "mfc": colour}
        _draw_residual_points(axes, part.reconvolution.x, z, name, limit, look)
    axes.set_ylim(-limit, limit)
    axes.set_ylabel(f"residual / {scale}")
    _limit_to_scan(axes, x)
    legend_above(axes, points=x.size)


def _draw_residual_points(
    axes: Axes, x: FloatArray, z: FloatArray, name: str, limit: float, look: Values
) -> None:
    rms = np.sqrt(np.mean(z**2))
    axes.plot(x / MM, z, label=f"{name}: rms {rms:.2f}", **look)
    for side, edge_marker in ((1, "^"), (-1, "v")):
        beyond = x[side * z > limit] / MM
        if beyond.size:
            edge = np.full(beyond.size, 0.93 * side * limit)
            axes.plot(beyond, edge, edge_marker, color=look["color"], ms=4)


def standardised(scan: Reconvolution) -> tuple[FloatArray, FloatArray, str]:
    """Residuals with G and with the Gaussian over their standard uncertainty, and its symbol."""
    errors = scan.u_zz_errors
    scale = "$u$"
    if not np.all(np.isfinite(errors) & (errors > 0)):
        # Without a stated uncertainty residuals are shown over their own rms.
        rms = np.sqrt(np.mean(scan.residual**2))
        errors = np.full(errors.shape, rms if rms > 0 else 1.0)
        scale = "own rms"
    return scan.residual / errors, (scan.u_zz - scan.u_zz_gaussian) / errors, scale
