"""The measured points of a scan, flattened and proven usable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import FitError, InputError
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["ScanPoints", "measured_points"]

#: Conversion constant, width, centre, baseline, slope; one more to estimate the noise.
MINIMUM_POSITIONS = 6


@dataclass(frozen=True, eq=False)
class ScanPoints:
    """Every measured point of a scan, missing ones left out.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Position of the indenter, in m; ``y`` is zero in a line scan.
    u : ndarray, shape (n,)
        Voltage, in V.
    load : ndarray, shape (n,)
        Load, in N.
    u_errors : ndarray, shape (n,), or None
        Stated standard uncertainty of each voltage, in V.
    repeat : ndarray of int, shape (n,)
        Which repeat each point belongs to.
    planar : bool
        Whether the positions spread over two dimensions (a raster).
    missing : int
        How many points of the scan were missing.
    """

    x: FloatArray
    y: FloatArray
    u: FloatArray
    load: FloatArray
    u_errors: FloatArray | None
    repeat: NDArray[np.intp]
    planar: bool
    missing: int

    @property
    def step(self) -> float:
        """Median distance of neighbouring positions along x, in m."""
        return float(np.median(np.diff(np.unique(self.x))))


def measured_points(scan: Scan) -> ScanPoints:
    """Flatten a scan to its measured points.

    Raises
    ------
    InputError
        If no point was measured, a load is not positive, or the voltage does not change or
        has the wrong sign.
    FitError
        If there are fewer positions than parameters.
    """
    u = scan.u_zz
    load = np.full(u.shape, scan.load) if scan.normal_load is None else scan.normal_load
    x, y, repeat = _positions(scan)
    keep: NDArray[np.bool_] = np.isfinite(u) & np.isfinite(load)
    errors = scan.u_zz_errors
    if errors is not None:
        keep &= np.isfinite(errors)
    if not keep.any():
        raise InputError(
            "Every point of u_zz is missing (NaN).",
            why="There is nothing to calibrate with.",
            cure="Check the voltage column and its import.",
        )
    points = ScanPoints(
        x=x[keep],
        y=y[keep],
        u=u[keep],
        load=load[keep],
        u_errors=_stated_errors(errors, keep),
        repeat=repeat[keep],
        planar=scan.kind == "raster",
        missing=int(u.size - keep.sum()),
    )
    _require_usable(points)
    return points


def _positions(scan: Scan) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
    shape = scan.u_zz.shape
    x = np.broadcast_to(scan.x, shape)
    if scan.y is not None:
        return x, np.broadcast_to(scan.y[:, None], shape), np.zeros(shape, dtype=np.intp)
    rows = np.arange(shape[0] if scan.kind == "repeats" else 1, dtype=np.intp)
    repeat = np.repeat(rows, scan.x.size).reshape(shape)
    return x, np.zeros(shape), repeat


def _stated_errors(errors: FloatArray | None, keep: NDArray[np.bool_]) -> FloatArray | None:
    if errors is None:
        return None
    if np.any(errors[keep] <= 0):
        raise InputError(
            "u_zz_errors holds a standard uncertainty of zero.",
            why="A point without noise would outweigh every other point.",
            cure="Give the electronic noise, or leave u_zz_errors out to have it estimated.",
        )
    return np.asarray(errors[keep])


def _require_usable(points: ScanPoints) -> None:
    positions = np.unique(np.stack([points.x, points.y]), axis=1).shape[1]
    needed = MINIMUM_POSITIONS + 2 * points.planar
    if positions < needed:
        raise FitError(
            f"The scan has {positions} measured positions; at least {needed} are needed.",
            why="Conversion constant, width, centre, baseline and noise are estimated from them.",
            cure="Scan more positions.",
        )
    _require_positive_peak(points)


def _require_positive_peak(points: ScanPoints) -> None:
    """Refuse a voltage that does not rise where the indenter is above the sensor."""
    u = points.u / points.load
    if np.ptp(points.u) == 0:
        raise InputError(
            f"Every voltage of the scan is {points.u[0]:g} V.",
            why="A calibration needs a voltage that follows the indenter.",
            cure="Check the channel.",
        )
    distance = np.hypot(points.x - np.median(points.x), points.y - np.median(points.y))
    baseline = np.median(u[distance >= np.quantile(distance, 0.75)])
    # Three points of a peak outvote single outliers of either sign.
    ordered = np.sort(u - baseline)
    rise, fall = np.median(ordered[-3:]), -np.median(ordered[:3])
    if fall > 1.5 * rise:
        raise InputError(
            f"The voltage falls by {fall * points.load.mean() * 1e3:.4g} mV where the indenter is "
            "above the sensor.",
            why="Normal stress is positive in compression, so the voltage must rise.",
            cure="Change the sign of u_zz (u_sign=-1; memscal import ... --u-sign -1), or swap the "
            "leads of the channel and measure again.",
        )
