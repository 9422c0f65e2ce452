"""Panels of a scan: measured voltage, reconvolutions, reference, residuals."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from memscal.figures import style
from memscal.figures.style import COLOURS, channel_indices
from memscal.model.apparatus import ApparatusData
from memscal.model.arrays import FloatArray
from memscal.model.checks import REPEAT_CENTRES
from memscal.model.quantities import KPA, MM, MV

_EXPANDED = 2.0  # coverage factor of everything that is drawn as a band or a limit


def draw_scan(axes: Axes, data: ApparatusData) -> None:
    """Draw the scan on a linear axis, in mV; the right-hand axis reads U/A in kPa."""
    scan = data.reconvolution
    _draw_measured(axes, scan.x, scan.u_zz, _finite_errors(scan.u_zz_errors))
    _draw_predictions(axes, data)
    _draw_reference(axes, data)
    _draw_indenter(axes, data)
    limit_to_scan(axes, scan.x)
    axes.set_ylabel(f"voltage $U_{{{channel_indices(data)}}}$ (mV)")
    _stress_axis(axes, data, baseline=_baseline(data))
    style.legend_above(axes, points=scan.x.size)


def draw_scan_log(axes: Axes, data: ApparatusData) -> None:
    """Draw the scan less its baseline on a logarithmic axis.

    Of a point below 2u the upper limit, max(U, 0) + 2u, is drawn as an open triangle.  Of a
    tangential channel, the side where the voltage is negative is turned over.
    """
    scan = data.reconvolution
    signal = _turned(data, scan.x) * (scan.u_zz - _background(data, scan.x))
    errors = _finite_errors(scan.u_zz_errors)
    clear = (signal > _EXPANDED * errors) & (signal > 0)
    limit = np.where(clear, np.nan, np.maximum(signal, 0.0) + _EXPANDED * errors)
    limit[~(limit > 0)] = np.nan
    _draw_measured(axes, scan.x, np.where(clear, signal, np.nan), errors, label="_measured")
    if np.any(np.isfinite(limit)):
        (limits,) = axes.plot(scan.x / MM, limit / MV, "v", mfc="none", mew=0.7)
        limits.set(color=COLOURS["muted"], markersize=0.8 * style.marker_size(scan.x.size))
        limits.set(label="less than 2u: upper limit, U + 2u")
        limits.set_rasterized(scan.x.size > style.SCATTER_THRESHOLD)
    _draw_predictions(axes, data, net=True)
    _draw_reference(axes, data, net=True)
    axes.set_yscale("log")
    heights = np.concatenate([signal[clear], limit[np.isfinite(limit)]])
    if heights.size:
        top = max(float(np.max(heights)), _reference_peak(data))
        axes.set_ylim(0.5 * float(np.min(heights)) / MV, 2.0 * top / MV)
    _draw_indenter(axes, data)
    limit_to_scan(axes, scan.x)
    along = "distance from the centre $r$" if _by_distance(data) else "position $x$"
    aligned = ", repeats moved to one centre" if _aligned(data) and not _by_distance(data) else ""
    axes.set_xlabel(f"{along} (mm){aligned}")
    bar = "|" if _tangential(data) else ""
    axes.set_ylabel(f"{bar}$U_{{{channel_indices(data)}}}$ less baseline{bar} (mV)")
    _stress_axis(axes, data, baseline=0.0)
    if np.any(np.isfinite(limit)):
        axes.legend(handles=[limits], loc="lower left", bbox_to_anchor=(0, 1), borderpad=0.2)


def _draw_measured(
    axes: Axes, x: FloatArray, u: FloatArray, errors: FloatArray, label: str = "scan, ±u"
) -> None:
    size, colour = style.marker_size(x.size), COLOURS["measured"]
    if x.size > style.SCATTER_THRESHOLD:
        (points,) = axes.plot(x / MM, u / MV, ".", color=colour, ms=1.5, mew=0, label="scan")
        points.set_rasterized(True)
        points.set_label("scan" if not label.startswith("_") else label)
        return
    axes.errorbar(
        x / MM, u / MV, errors / MV, fmt="o", ms=size, mfc="white", mew=0.7, color=colour,
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
        line_like = single_valued and not _joint(data) and not _aligned(data)
        (line,) = axes.plot(x / MM, curve / MV, dashes, color=COLOURS[name], label=label, zorder=3)
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
    alike = np.max(np.abs(u - mean[inverse])) <= 1e-3 * np.ptp(u)
    return (places, mean) if alike else (x, u)


def _joint(data: ApparatusData) -> bool:
    """Whether several scans were fitted together: their points mix along x."""
    return "further_scans" in data.process.configuration


def _aligned(data: ApparatusData) -> bool:
    """Whether repeats with centres of their own are drawn about the first one's."""
    return any(message.kind == REPEAT_CENTRES for message in data.process.messages)


def _draw_reference(axes: Axes, data: ApparatusData, *, net: bool = False) -> None:
    """Draw baseline + A sigma_zz for the scan's load about the centre; ``net``: only A sigma_zz."""
    reference, constant = data.reference, data.conversion_constant
    stress = _seen_stress(data)
    if not (np.isfinite(constant) and constant > 0) or stress is None:
        return
    voltage = constant * stress * (data.load / reference.load)
    if net:
        voltage = np.where(voltage > 0, voltage, np.nan)
    x = _centre(data) + np.concatenate([-reference.r[::-1], reference.r])
    curve = np.concatenate([voltage[::-1], voltage])
    if not net:
        curve = _turned(data, x) * curve + _background(data, x)
    (line,) = axes.plot(x / MM, curve / MV, "-.", color=COLOURS["reference"], lw=1.0, zorder=1.5)
    line.set_label(rf"reference $\sigma_{{{channel_indices(data)}}}$ (right axis)")


def _reference_peak(data: ApparatusData) -> float:
    stress = _seen_stress(data)
    if stress is None:
        return 0.0
    peak = float(data.conversion_constant * np.max(stress) / data.reference.load * data.load)
    return peak if np.isfinite(peak) else 0.0


def _tangential(data: ApparatusData) -> bool:
    return channel_indices(data) != "zz"


def _seen_stress(data: ApparatusData) -> FloatArray | None:
    """The reference as the channel sees it where its voltage is positive, in Pa."""
    reference = data.reference
    if not _tangential(data):
        return reference.sigma_zz
    return None if reference.sigma_rz is None else -reference.sigma_rz


def _turned(data: ApparatusData, x: FloatArray) -> FloatArray:
    """One; of a tangential channel -1 where the indenter stands beyond the sensor."""
    return np.where((x > _centre(data)) & _tangential(data), -1.0, 1.0)


def _draw_indenter(axes: Axes, data: ApparatusData) -> None:
    """Draw the rod's diameter (or the sphere's contact) as the paper's black patch."""
    radius: float | None = data.indenter.radius
    form = "rod"
    if data.indenter.shape != "rod":
        radius, form = data.reference.contact_radius, "contact"
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
    per_mv, offset = MV / constant / KPA, baseline / MV

    def stress(voltage: ArrayLike) -> FloatArray:
        return (np.asarray(voltage, dtype=float) - offset) * per_mv

    def voltage(stress: ArrayLike) -> FloatArray:
        return np.asarray(stress, dtype=float) / per_mv + offset

    right = axes.secondary_yaxis("right", functions=(stress, voltage))
    right.set_ylabel(rf"stress $\sigma_{{{channel_indices(data)}}}$, $U/A$ (kPa)")


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
    stated = "baseline" in data.parameters
    return data.parameters["baseline"] if stated else 0.0


def _background(data: ApparatusData, x: FloatArray) -> FloatArray:
    """Return baseline and drift, its change from end to end, at positions x, in V."""
    level = np.full(x.shape, _baseline(data))
    along = data.reconvolution.x
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


def draw_residuals(axes: Axes, data: ApparatusData) -> None:
    """Draw residuals over each point's standard uncertainty; those beyond the axis at its edge."""
    scan = data.reconvolution
    errors, scale = _residual_scale(data)
    with_g, with_gaussian = scan.residual / errors, (scan.u_zz - scan.u_zz_gaussian) / errors
    limit = _residual_limit(with_g, with_gaussian)
    axes.axhspan(-_EXPANDED, _EXPANDED, color="0.92", lw=0, label="_±2")
    axes.axhline(0.0, color="0.4", lw=0.6)
    many = scan.x.size > style.SCATTER_THRESHOLD
    size = 1.2 if many else style.marker_size(scan.x.size)
    for z, name, marker, face in (
        (with_gaussian, "gaussian", "s", "none"),
        (with_g, "deconvolved", "o", COLOURS["deconvolved"]),
    ):
        label = f"{'Gaussian' if name == 'gaussian' else 'G'}: rms {_rms(z):.2f}"
        (points,) = axes.plot(scan.x / MM, z, ls="none", marker=marker, ms=size)
        points.set(color=COLOURS[name], markerfacecolor=face, label=label)
        points.set(rasterized=many, markeredgewidth=0.3 if many else 0.7)
        _mark_beyond(axes, scan.x, z, limit, COLOURS[name])
    axes.set_ylim(-limit, limit)
    axes.set_ylabel(f"residual / {scale}")
    limit_to_scan(axes, scan.x)
    style.legend_above(axes, points=scan.x.size)


def _residual_scale(data: ApparatusData) -> tuple[FloatArray, str]:
    """Return what residuals are divided by: the stated uncertainty, or else their own rms."""
    errors = data.reconvolution.u_zz_errors
    if np.all(np.isfinite(errors) & (errors > 0)):
        return errors, "$u$"
    rms = _rms(data.reconvolution.residual)
    return np.full(errors.shape, rms if rms > 0 else 1.0), "own rms"


def _rms(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def _residual_limit(*residuals: FloatArray) -> float:
    """Return an axis limit that one outlier cannot stretch."""
    sizes = np.abs(np.concatenate(residuals))
    sizes = sizes[np.isfinite(sizes)]
    if not sizes.size:
        return 3.5
    return float(max(3.5, min(1.1 * np.max(sizes), 2.0 * np.quantile(sizes, 0.9))))


def _mark_beyond(axes: Axes, x: FloatArray, z: FloatArray, limit: float, colour: str) -> None:
    for side, marker in ((1, "^"), (-1, "v")):
        beyond = side * z > limit
        if np.any(beyond):
            edge = np.full(int(np.sum(beyond)), 0.93 * side * limit)
            axes.plot(x[beyond] / MM, edge, marker, color=colour, ms=4, label="_beyond the axis")
