r"""A part of one load made ready to be restored: all points at the nominal load, all noise stated.

A point that was measured at :math:`P_i` in place of :math:`P` is brought to :math:`P` by
:math:`-\partial U/\partial\ln P\,\ln(P_i/P)`; its variance is

.. math::

    n_i^2 + \left(\frac{\partial U}{\partial\ln P}\,\frac{u(P_i)}{P}\right)^2 .

Electronic noise :math:`n` that is not stated is found from the scatter, by maximum likelihood: the
scatter of the loads is largest where the signal is, the electronic noise is the same everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.estimation.points import measured_points
from memscal.estimation.profile_estimate import NUMERICAL_FLOOR, ProfileEstimate
from memscal.measurement.contact_signal import ContactSignal
from memscal.measurement.procedure import gaussian_pressure
from memscal.measurement.single_loads import SingleLoad
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["PreparedScan", "prepared_scan"]

#: Centre and noise are found twice, the second time from what the first one made of the scan.
_ROUNDS = 2
#: Noises that are tried, over the scatter of the residuals.
_TRIED = np.geomspace(0.02, 2.0, 120)


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """A scan at one load, and the noise that its voltages have.

    ``scan``: voltages for the nominal load, ``u_zz_errors`` with the scatter of the loads;
    ``electronic``: electronic noise of each voltage, in V, zero where it is left to be found;
    ``noise_found``: whether it was found here.
    """

    scan: Scan
    electronic: FloatArray
    noise_found: bool


def prepared_scan(
    part: SingleLoad, apparatus: ApparatusFunction, signal: ContactSignal
) -> PreparedScan:
    """Bring every point of a part to its nominal load, and state its noise.

    Raises
    ------
    InputError, FitError
        If the part determines no centre.
    """
    scan = part.scan
    prepared = PreparedScan(_at_nominal(part, np.zeros_like(scan.u_zz)), _stated(scan), False)
    if scan.normal_load is None:
        return prepared
    for _ in range(_ROUNDS):
        points = measured_points(prepared.scan)
        estimate, _ = gaussian_pressure(prepared.scan, apparatus, points)
        slope = signal.slope(_distance(scan, estimate.centre), _sticking(estimate, signal))
        of_load = _load_noise(part, slope)
        electronic, found = _stated(scan), False
        if scan.u_zz_errors is None and of_load.any():
            kept = np.isfinite(prepared.scan.u_zz)
            electronic, found = np.full_like(slope, _electronic(estimate, of_load[kept])), True
        level = _at_nominal(part, slope)
        prepared = PreparedScan(_with_noise(level, electronic, of_load), electronic, found)
    return prepared


def _sticking(estimate: ProfileEstimate, signal: ContactSignal) -> float:
    """How far the measured voltage nearest to the axis is on the way to a contact that sticks."""
    nearest = int(np.argmin(estimate.distance))
    voltage = float((estimate.predicted - estimate.background)[nearest])
    return signal.sticking(float(estimate.distance[nearest]), voltage)


def _stated(scan: Scan) -> FloatArray:
    return np.zeros_like(scan.u_zz) if scan.u_zz_errors is None else scan.u_zz_errors


def _at_nominal(part: SingleLoad, slope: FloatArray) -> Scan:
    """Return the part at its nominal load; points without a load are missing."""
    scan = part.scan
    if scan.normal_load is None:
        return scan
    shift = slope * np.log(scan.normal_load / part.load)
    return replace(scan, u_zz=scan.u_zz - shift, normal_load=None, normal_load_errors=None)


def _load_noise(part: SingleLoad, slope: FloatArray) -> FloatArray:
    errors = part.scan.normal_load_errors
    share = 0.0 if errors is None else np.nan_to_num(errors) / part.load
    return np.abs(slope) * share


def _with_noise(scan: Scan, electronic: FloatArray, of_load: FloatArray) -> Scan:
    if not of_load.any():
        return scan
    total = np.hypot(electronic, of_load)
    correlation = scan.u_zz_correlation
    if correlation is not None:
        # The scatter of the loads is independent: it takes its share from the correlation.
        flat = total.reshape(-1, correlation.shape[0])
        ours = electronic.reshape(flat.shape)
        share = np.sqrt(np.nanmean(ours**2, axis=0) / np.nanmean(flat**2, axis=0))
        correlation = correlation * np.outer(share, share)
        np.fill_diagonal(correlation, 1.0)
    return replace(scan, u_zz_errors=total, u_zz_correlation=correlation)


def _electronic(estimate: ProfileEstimate, of_load: FloatArray) -> float:
    """Noise beside that of the loads, by maximum likelihood of the residuals."""
    residual, weight = estimate.weighed.residual, estimate.outlier_weight
    # What was fitted took its share of the scatter with it.
    taken = 3 + estimate.model.drift_columns.shape[1]
    square = weight * residual**2 * residual.size / max(residual.size - taken, 1)
    scatter = 1.4826 * float(np.median(np.abs(residual)))
    least = NUMERICAL_FLOOR * estimate.largest_signal
    tried = np.maximum(_TRIED * scatter, least)
    variance = tried[:, None] ** 2 + of_load**2
    deviance = np.sum(np.log(variance) + square / variance, axis=1)
    return float(tried[np.argmin(deviance)])


def _distance(scan: Scan, centre: FloatArray) -> FloatArray:
    """Distance of every point of a scan from a centre, shape of ``u_zz``, in m."""
    x, y = scan.positions
    if scan.planar:
        return np.asarray(np.hypot(x - centre[0], y - centre[1]))
    return np.asarray(np.abs(y - centre[1] if scan.direction == "y" else x - centre[0]))
