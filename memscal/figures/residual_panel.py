"""The panel of residuals, in units of each point's standard uncertainty."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from memscal.figures.scan_panels import limit_to_scan
from memscal.figures.style import COLOURS, SCATTER_THRESHOLD, legend_above, marker_size
from memscal.model.apparatus import ApparatusData
from memscal.model.quantities import MM
from memscal.model.validation import FloatArray

__all__ = ["draw_residuals"]

_EXPANDED = 2.0  # coverage factor of the grey band


def draw_residuals(axes: Axes, data: ApparatusData) -> None:
    """Draw measured minus predicted in units of each point's standard uncertainty.

    Points beyond the axis are drawn at its edge as triangles, never dropped.
    """
    scan = data.reconvolution
    errors, scale = _residual_scale(data)
    with_g, with_gaussian = (
        scan.residual / errors,
        (scan.u_zz - scan.u_zz_gaussian) / errors,
    )
    limit = _residual_limit(with_g, with_gaussian)
    axes.axhspan(-_EXPANDED, _EXPANDED, color="0.92", lw=0, label="_±2")
    axes.axhline(0.0, color="0.4", lw=0.6)
    many = scan.x.size > SCATTER_THRESHOLD
    size = 1.2 if many else marker_size(scan.x.size)
    for z, name, marker, face in (
        (with_gaussian, "gaussian", "s", "none"),
        (with_g, "deconvolved", "o", COLOURS["deconvolved"]),
    ):
        label = f"{'Gaussian' if name == 'gaussian' else 'G'}: rms {_rms(z):.2f}"
        (points,) = axes.plot(
            scan.x / MM, z, ls="none", marker=marker, ms=size, mew=0.3 if many else 0.7
        )
        points.set(color=COLOURS[name], markerfacecolor=face, label=label)
        points.set_rasterized(many)
        _mark_beyond(axes, scan.x, z, limit, COLOURS[name])
    axes.set_ylim(-limit, limit)
    axes.set_ylabel(f"residual / {scale}")
    limit_to_scan(axes, scan.x)
    legend_above(axes, points=scan.x.size)


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
            axes.plot(
                x[beyond] / MM,
                edge,
                marker,
                color=colour,
                ms=4,
                label="_beyond the axis",
            )
