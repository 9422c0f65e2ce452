"""An array of sensors whose fields are measured: ``calibrate_array(scan, kernel="measured")``."""

from typing import Any, cast

import numpy as np

from memscal.errors import InputError
from memscal.extensions.arrays.array_data import ArrayReadings, KernelModes
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.model.arrays import BoolArray, IndexArray, floats
from memscal.model.checks import Message
from memscal.model.provenance import Process
from memscal.model.scan import Scan

#: Places that differ by less, in m, are one node of the raster.
_SAME = 1e-6
#: A sensor works if its readings vary by more than so many standard deviations of them; it has an
#: offset if at the rim of the raster it reads more than this share of that.
_ALIVE = 8.0
_OFFSET = 0.2


def measured_array(scan: Scan) -> SensorArray:
    """Return an array by the measured field of each sensor, from a repeated raster of presses.

    Raises
    ------
    InputError
        If the presses are no full raster, or were not repeated.
    """
    from scipy.interpolate import RectBivariateSpline

    u = scan.u_zz.reshape(len(scan.sensors), -1)
    seen: BoolArray = np.isfinite(u)
    used: BoolArray = np.logical_or.reduce(seen, axis=1)
    used &= True if scan.used is None else scan.used
    # A press is one of all sensors.
    kept = seen[used].all(axis=0)
    u = np.where(used[:, None], u, 0.0)[:, kept]
    places = [np.round(axis.ravel()[kept] / _SAME) * _SAME for axis in scan.positions]
    (x, i), (y, j) = (np.unique(axis, return_inverse=True) for axis in places)
    node = i * y.size + j
    counts = np.bincount(node, minlength=x.size * y.size)
    _require_raster(x.size, y.size, counts)
    mean = floats([np.bincount(node, row, counts.size) for row in u]) / counts
    away = u - mean[:, node]
    noise = away @ away.T / (u.shape[1] - counts.size)
    n = len(u)
    size = np.ptp(mean, axis=1)
    used &= size > _ALIVE * np.sqrt(np.diag(noise))
    predicted = np.full_like(mean, np.nan)
    root = np.zeros((3 * n, 1))
    for one in np.flatnonzero(used).tolist():
        variance = float(noise[one, one])
        field = mean[one].reshape(x.size, y.size)
        spline = RectBivariateSpline(x, y, field, s=variance * np.sum(1 / counts))
        predicted[one] = spline(x, y).ravel()
        root[one] = np.sqrt(variance * spline.get_coeffs().size / u.shape[1])
    at_x, at_y = (floats(grid.ravel()) for grid in np.meshgrid(x, y, indexing="ij"))
    rim = np.isin(at_x, x[[0, -1]]) | np.isin(at_y, y[[0, -1]])
    around = abs(np.median(mean[:, rim], axis=1))
    messages = _offset(scan, used & (around > _OFFSET * size))
    top = np.abs(predicted).argmax(axis=1)
    unknown = np.full(n, np.nan)
    return SensorArray(
        sensors=scan.sensors,
        used=used,
        conversion_constants=unknown,
        centres=np.where(used, [at_x[top], at_y[top]], np.nan).T,
        crosstalk=np.eye(n),
        estimated=np.zeros((n, n), bool),
        gaussian_sigmas=unknown,
        baselines=np.zeros(n),
        noise=noise,
        k=np.arange(4.0),
        kernels=np.zeros((1, 4)),
        modes=KernelModes(np.zeros((0, 4)), np.zeros(0, np.intp)),
        root=root,
        effects={},
        # None, where the scan states none.
        film=cast(Any, scan.film),
        indenter=cast(Any, scan.indenter),
        load=1.0,
        readings=ArrayReadings(at_x, at_y, np.ones(at_x.size), mean, predicted, 0 * mean),
        kernel="measured",
        reading_low=scan.reading_low,
        reading_high=scan.reading_high,
        reading=scan.reading,
        process=Process.of_now(messages=messages, input_scan=scan.source),
    )


def _require_raster(width: int, height: int, counts: IndexArray) -> None:
    """Refuse presses of a raster that is not full, or was not repeated."""
    if min(width, height) < 4 or counts.min() == 0 or counts.max() == 1:
        raise InputError(
            f"Of {width} x {height} places {np.sum(counts > 0)} were pressed, one of them "
            f"{counts.max()} times.",
            why="The field of each sensor is measured by a full raster, and its error by repeats.",
            cure="Press each place of a raster, two times or more.",
        )


def _offset(scan: Scan, offset: BoolArray) -> tuple[Message, ...]:
    """Name the sensors that are not zero around the raster."""
    if not offset.any():
        return ()
    names = ", ".join(np.array(scan.sensors)[offset])
    text = f"Not zero around the raster, which is taken for the field: tare {names}."
    return (Message("baseline", text, "warning"),)
