r"""From the restored stress of one load to its measured profile, with its covariance by source.

The voltages less baseline and drift, over A.  What is uncertain besides their noise: A, the same
for all; and centre, baseline and drift, with their joint covariance :math:`\Sigma` and the columns
:math:`J = -[\partial U/\partial c,\ 1,\ \xi]/A`.  Of :math:`J\Sigma J^T` the part that the centre
explains is its own, the rest the baseline's, so that both are covariances and their sum is exact.
That baseline and centre come from the same voltages is not counted: where the stress has decayed
it would make the uncertainties a little smaller.

The stress on the axis is the restored one, blurred by G.  An error of A or G changes what is
restored so that it still meets the voltages: blurred again, nothing is left of an error of G but
what the scan does not tell, and an error of A is left whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from memscal.apparatus import ApparatusFunction
from memscal.errors import FitError, InputError
from memscal.estimation.points import TANGENTIAL, ScanPoints, channel_signal, measured_points
from memscal.estimation.profile import NUMERICAL_FLOOR, ProfileEstimate
from memscal.measurement.posterior import apparatus_changes, sensor_transfer
from memscal.measurement.pressure import film_transfer
from memscal.measurement.restoration import Restoration
from memscal.measurement.restore import gaussian_pressure
from memscal.measurement.single_loads import ContactSignal, SingleLoad
from memscal.model.arrays import FloatArray
from memscal.model.measured_stress import MeasuredPoints, MeasuredProfile, MeasuredScan
from memscal.model.scan import Scan

__all__ = ["PreparedScan", "measured_profile", "measured_scan", "prepared_scan"]

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
            electronic, found = np.full_like(slope, _noise_of_load(estimate, of_load[kept])), True
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


def _noise_of_load(estimate: ProfileEstimate, of_load: FloatArray) -> float:
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


#: Radii of the smooth curve.
_CURVE = 301


def measured_scan(scan: Scan) -> MeasuredScan:
    """Return what is known of a scan beside its points."""
    return MeasuredScan(
        film=scan.film,
        indenter=scan.indenter,
        sensor=scan.sensor,
        width=float(np.hypot(np.ptp(scan.x), 0.0 if scan.y is None else np.ptp(scan.y))),
        lubrication=scan.lubrication,
        position_scale_uncertainty=scan.position_scale_uncertainty,
        synthetic=bool(scan.synthetic),
        source=scan.source,
    )


def measured_profile(
    scan: MeasuredScan,
    part: SingleLoad,
    prepared: PreparedScan,
    found: Restoration,
    signal: ContactSignal,
) -> MeasuredProfile:
    """Return the measured profile of one load of a scan from its restored stress."""
    a, estimate = found.apparatus.conversion_constant, found.posterior.estimate
    noise = found.noise / np.sqrt(estimate.outlier_weight)
    average, x, y = _averaging(found, noise)
    level = average @ (found.points.u - _background(found))
    r = np.hypot(x - found.centre[0], y - found.centre[1])
    order = np.argsort(r, kind="stable")
    average, s_zz = average[order], level[order] / a
    root = average @ (found.noise_root / a)
    relative = found.apparatus.parameters.uncertainty("conversion_constant") / a
    covariances = {
        "noise": root @ root.T,
        "conversion_constant": np.outer(s_zz, s_zz) * relative**2,
        **_of_place(found, average),
    }
    maximum, budget = _on_axis(found)
    curve_r = np.linspace(0.0, float(r[order][-1]), _CURVE)
    return MeasuredProfile(
        scan=scan,
        load=part.load,
        load_uncertainty=part.scan.load_uncertainty,
        x=x[order],
        y=y[order],
        r=r[order],
        s_zz=s_zz,
        covariances=covariances,
        force=found.force,
        force_budget=found.force_budget,
        maximum=maximum,
        maximum_budget=budget,
        centre=found.centre,
        centre_uncertainty=found.centre_uncertainty,
        baseline=found.baseline,
        baseline_uncertainty=found.baseline_uncertainty,
        contact_radius=signal.contact_radius,
        curve_r=curve_r,
        curve_s_zz=found.blurred_stress(curve_r),
        points=_points(part.scan, prepared, found),
    )


def _points(scan: Scan, prepared: PreparedScan, found: Restoration) -> Mapping[str, MeasuredPoints]:
    """Return the points of one load by channel, as they were measured."""
    normal = measured_points(scan)
    weight = found.posterior.estimate.outlier_weight
    noise = _noise_in_shape(prepared, found)[_kept(scan, "zz")]
    points = {"zz": _of_channel(scan, normal, noise, weight)}
    for channel in TANGENTIAL:
        try:
            shear = measured_points(scan, channel)
        except (InputError, FitError):
            # The normal stress does not need it; a comparison of the shear says what is missing.
            continue
        points[channel] = _of_channel(scan, shear, shear.u_errors, np.ones_like(shear.u))
    return points


def _of_channel(
    scan: Scan, points: ScanPoints, noise: FloatArray | None, weight: FloatArray
) -> MeasuredPoints:
    load_errors = np.zeros_like(points.u)
    if scan.normal_load_errors is not None:
        load_errors = np.nan_to_num(scan.normal_load_errors[_kept(scan, points.channel)])
    correlation = None
    if points.decorrelation is not None:
        root = np.linalg.inv(points.decorrelation)
        correlation = root @ root.T
    return MeasuredPoints(
        x=points.x,
        y=points.y,
        u=points.u,
        noise=noise,
        weight=weight,
        load=points.load,
        load_errors=load_errors,
        x_errors=points.x_errors,
        correlation=correlation,
    )


def _kept(scan: Scan, channel: str) -> NDArray[np.bool_]:
    """Which points of a channel were measured, shape of ``u_zz``."""
    u, errors = channel_signal(scan, channel)
    kept: NDArray[np.bool_] = np.isfinite(u)
    for other in (scan.normal_load, errors):
        if other is not None:
            kept &= np.isfinite(other)
    return kept


def _averaging(found: Restoration, noise: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Matrix (n, points) that averages repeats by their weight, and the n positions."""
    places = np.stack([found.points.x, found.points.y])
    unique, back = np.unique(places, axis=1, return_inverse=True)
    average = np.zeros((unique.shape[1], noise.size))
    average[back.ravel(), np.arange(noise.size)] = noise**-2
    return average / average.sum(axis=1, keepdims=True), unique[0], unique[1]


def _background(found: Restoration) -> FloatArray:
    drift = found.posterior.state[found.posterior.nodes + int(found.points.free.sum()) :]
    return np.asarray(found.posterior.estimate.model.drift_columns @ drift)


def _of_place(found: Restoration, average: FloatArray) -> Mapping[str, FloatArray]:
    """Covariance that centre, baseline and drift bring, shared out without a rest."""
    posterior, model = found.posterior, found.posterior.estimate.model
    nodes, free = posterior.nodes, found.points.free
    geometry = model.geometry(np.atleast_2d(found.centre))
    pressure = posterior.state[:nodes] / found.scan.load / film_transfer(found.scan.film, model.k)
    columns = [model.centre_derivative(geometry, pressure), model.drift_columns]
    columns = [average @ column / found.apparatus.conversion_constant for column in columns]
    sigma, n = posterior.covariance[nodes:, nodes:], int(free.sum())
    carried = np.linalg.solve(sigma[:n, :n], sigma[:n, n:])
    of_centre = columns[0] + columns[1] @ carried.T
    rest = sigma[n:, n:] - sigma[n:, :n] @ carried
    return {
        "centre": of_centre @ sigma[:n, :n] @ of_centre.T,
        "baseline": columns[1] @ rest @ columns[1].T,
    }


def _on_axis(found: Restoration) -> tuple[float, Mapping[str, float]]:
    """Return the blurred stress on the axis and its standard uncertainty by source, in Pa."""
    posterior, apparatus = found.posterior, found.apparatus
    wavenumbers = posterior.estimate.model.reference.wavenumbers
    nodes, k = posterior.nodes, wavenumbers.k
    on_axis = wavenumbers.synthesise(np.eye(nodes), np.zeros(1))[0]
    transfer = sensor_transfer(apparatus, k)
    row, state = on_axis * transfer, posterior.state[:nodes]
    maximum, a = float(row @ state), apparatus.conversion_constant
    changes = {source: row @ columns[:nodes] for source, columns in posterior.changes.items()}
    of_sensor = apparatus_changes(apparatus, np.append(k, 0.0))
    # G = (A G)/A: its own change beside that of what was restored with it.
    of_g = (of_sensor[:-1] - transfer[:, None] * of_sensor[-1]) / a
    changes["apparatus"] = changes["apparatus"] + on_axis * state @ of_g
    budget = {source: float(np.linalg.norm(change)) for source, change in changes.items()}
    noise = float(row @ posterior.covariances["scan"][:nodes, :nodes] @ row)
    return maximum, {"noise": float(np.sqrt(max(noise, 0.0))), **budget}


def _noise_in_shape(prepared: PreparedScan, found: Restoration) -> FloatArray:
    """Electronic noise of every voltage: where nothing else scatters, what restoration found."""
    if prepared.electronic.any():
        return prepared.electronic
    return np.full(prepared.scan.u_zz.shape, float(found.noise.min()))
