r"""Measured profiles: the profile of the lines of one load, with its covariance.

A measured voltage less baseline and drift, over A.  Uncertain besides the noise are A, and
centre, baseline and drift with joint covariance :math:`\Sigma` and the columns
:math:`J = -[\partial U/\partial c,\ 1,\ \xi]/A`.  Of :math:`J\Sigma J^T` what the centre explains
is the centre's, the rest the baseline's.  That both come from the same voltages is not counted.
The stress on the axis is the restored one, blurred by G: an error of A is left whole, one of G
only where the scan does not determine it.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from typing import Any

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import ConvergenceError, DomainError, FitError, InputError
from memscal.estimation.forward import forward_model
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.points import TANGENTIAL, ScanPoints, measured_mask, measured_points
from memscal.estimation.profile import NUMERICAL_FLOOR, ProfileEstimate, stated_weights
from memscal.estimation.voltage_map import square_root
from memscal.extensions import hook
from memscal.measurement.posterior import columns_of, sensor_changes, shared_changes
from memscal.measurement.restoration import Restoration
from memscal.measurement.restore import gaussian_pressure, load_of, undetermined, unit_force
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.mechanics.solver.refinement import RingRequest, solve_on_rings
from memscal.mechanics.solver.step import Load
from memscal.model.arrays import Arrays, FloatArray, Values, array_record
from memscal.model.correlation import is_banded
from memscal.model.indenter import Rod
from memscal.model.measured_stress import MeasuredPoints, MeasuredProfile, MeasuredScan
from memscal.model.scan import DIRECTIONS, Scan

_LARGEST_KH = 20.0
_LOAD_STEP = 0.02
#: Without a comparison with fewer rings, in half the time: enough for 4e-4 of the derivative at
#: loads over a factor of 100 on a film of 2 mm, for 6e-3 on one of 0.1 mm.
_RINGS = 24
#: Loads on one path: rings crowd at the edge of each of its contacts.
_AT_ONCE = 6
#: Distances at which the profile is tabulated, out to the scan's width.
_DISTANCES = 401
#: What the calculated profile may have left at the ends of a scan, over its maximum.
_LARGEST_END = 0.05


@array_record
class ContactSignal:
    """The contact at a nominal load as the sensor reports it, without friction and sticking."""

    r: FloatArray  # (n,): distances from the centre, in m
    voltage: FloatArray  # (2, n), in V
    by_load: FloatArray  # (2, n): derivative by the logarithm of the load, in V
    contact_radius: float  # in m, without friction


def contact_signals(loads: Sequence[Scan], apparatus: ApparatusFunction) -> list[ContactSignal]:
    """Calculate the contacts of a scan's nominal loads and near them, or raise a DomainError."""
    if len(loads) > _AT_ONCE:
        first = contact_signals(loads[:_AT_ONCE], apparatus)
        return first + contact_signals(loads[_AT_ONCE:], apparatus)
    try:
        return _signals_of_path(loads, apparatus)
    except (DomainError, ConvergenceError) as failure:
        if len(loads) > 1:
            # Each by itself shows which of them fails.
            return [contact_signals([scan], apparatus)[0] for scan in loads]
        if isinstance(failure, ConvergenceError):
            raise
        raise DomainError(
            f"{load_of(loads[0])}: {failure.problem}",
            why="The measured stress is compared with a contact that the model cannot hold for.",
            cure="Leave that load out; check its unit.",
        ) from failure


def _signals_of_path(loads: Sequence[Scan], apparatus: ApparatusFunction) -> list[ContactSignal]:
    """Solve all loads on one path."""
    # Contacts at P and P(1 +- 2 %) give dU/d ln P.  One that sticks is stiffer, its derivative
    # larger by up to 40 % on the axis.  A lubricated contact, and a rod's, is frictionless.
    scan = loads[0]
    near = np.array([1 - _LOAD_STEP, 1.0, 1 + _LOAD_STEP])
    nominal = [single.stated_load for single in loads]
    targets, places = np.unique(np.outer(nominal, near), return_inverse=True)
    paths = [_path(scan, targets, 0.0)]
    if scan.lubrication != "lubricated" and not isinstance(scan.indenter, Rod):
        paths.append(_path(scan, targets, math.inf))
    signals = []
    for single, three in zip(loads, places.reshape(-1, near.size), strict=True):
        width = _width(single)
        r = np.linspace(0.0, 1.5 * width, _DISTANCES)
        nodes = Wavenumbers.covering(_LARGEST_KH / scan.set_up.film.thickness, 3 * width)
        transfer = apparatus.conversion_constant * sensor_changes(apparatus, nodes.k)[0]
        spectra = []
        for path in paths:
            spectra += [transfer * path[i].base_spectrum(nodes.k) for i in three]
        voltages = nodes.synthesise(np.column_stack(spectra), r).T
        voltages = voltages.reshape(-1, near.size, r.size)
        # Without friction both are the frictionless contact.
        below, at, above = np.moveaxis(voltages[[0, -1]], 1, 0)
        by_load = (above - below) / (2 * _LOAD_STEP)
        signals.append(ContactSignal(r, at, by_load, paths[0][three[1]].contact_radius))
    return signals


def _width(scan: Scan) -> float:
    """Width of a line, or diagonal of a raster, in m."""
    return math.hypot(np.ptp(scan.x), 0.0 if scan.y is None else np.ptp(scan.y))


def _path(scan: Scan, loads: FloatArray, friction: float) -> Sequence[Contact]:
    film = scan.set_up.film
    indenter = scan.set_up.indenter
    if isinstance(indenter, Rod):
        return indent(film, indenter, load=loads, friction=friction, strain="linear")
    targets = tuple(map(Load, loads.tolist()))
    how = ("incremental", "hankel", None, _RINGS)
    request = RingRequest(film, indenter, Interface(), targets, friction, *how, compared=False)
    return solve_on_rings(request)


def require_points(scan: Scan, signal: ContactSignal) -> None:
    """Refuse a load whose points are all missing (NaN), or over more than a contact's radius."""
    complete = np.isfinite(scan.u_zz)
    if scan.normal_load is not None:
        complete &= np.isfinite(scan.normal_load)
    if not complete.any():
        raise InputError(
            f"{load_of(scan)}: all {complete.size} points are missing (NaN).",
            why="A load without voltages has no profile.",
            cure="Check the import, or leave the lines of that load out.",
        )
    if scan.y is not None:
        return
    order = np.argsort(scan.x)
    x = scan.x[order]
    places = np.flatnonzero(complete.reshape(-1, scan.x.size)[:, order].any(axis=0))
    missing = np.diff(places) - 1
    gaps = np.where(missing > 0, np.diff(x[places]), 0.0)
    if gaps.size and gaps.max() > signal.contact_radius:
        i = np.argmax(gaps)
        first = x[places[i] + 1]
        last = x[places[i + 1] - 1]
        raise InputError(
            f"{load_of(scan)}: {missing[i]} neighbouring points are missing (NaN), from "
            f"{first * 1e3:.4g} to {last * 1e3:.4g} mm.",
            why=f"The gap is wider than the contact's radius, {signal.contact_radius * 1e3:.3g} "
            "mm: the profile within it would be the model's, not measured.",
            cure="Measure these points again, or leave the lines of that load out.",
        )


def require_ends(scan: Scan, signal: ContactSignal, centre: FloatArray) -> None:
    """Refuse a scan whose profile exceeds 5 % at its ends: its baseline is undetermined."""
    if scan.y is None:
        measured = np.isfinite(scan.u_zz).reshape(-1, scan.x.size).any(axis=0)
        axes = [(scan.x[measured], centre[0 if scan.direction == "x" else 1])]
    else:
        axes = [(scan.x, centre[0]), (scan.y, centre[1])]
    ends = np.abs([[axis.min() - middle, axis.max() - middle] for axis, middle in axes]).ravel()
    calculated = signal.voltage[0]
    left = np.interp(ends, signal.r, calculated).max() / calculated.max()
    if left > _LARGEST_END:
        raise FitError(
            f"{load_of(scan)}: the scan ends {ends.min() * 1e3:.3g} mm from its centre, "
            f"where the calculated profile still has {left:.0%} of its maximum.",
            why="The voltage never comes down to the baseline, so that it cannot be told from the "
            "stress.",
            cure="Scan farther on that side; to where the profile has decayed.",
        )


#: Noises that are tried, over the scatter of the residuals.
_TRIED = np.geomspace(0.02, 2.0, 120)


@array_record
class _Found:
    """Centre and signal of a scan, and what they leave of its n points; lengths in m, else V."""

    centre: FloatArray  # (2,)
    distance: FloatArray  # (n,): from the centre
    signal: FloatArray  # (n,)
    residual: FloatArray  # (n,)
    weight: FloatArray  # (n,): below one of an outlier
    parameters: int  # fitted
    estimate: ProfileEstimate | None = None


def _found(scan: Scan, apparatus: ApparatusFunction) -> _Found:
    estimate = gaussian_pressure(scan, apparatus)
    return _Found(
        estimate.centre,
        estimate.distance,
        estimate.signal,
        estimate.weighed.residual,
        estimate.outlier_weight,
        estimate.gaussian.jacobian.shape[1],
        estimate,
    )


def _found_quickly(scan: Scan, apparatus: ApparatusFunction) -> _Found:
    # Without departures, in a tenth of the time.
    points = measured_points(scan)
    model = forward_model(points, [unit_force(scan, apparatus, points)])
    with undetermined():
        fit = fit_gaussian_to_points(model, stated_weights(points))
    signal = fit.conversion_constant * fit.jacobian[:, 0]
    rest = points.u - fit.predicted
    count = fit.jacobian.shape[1]
    distance = np.hypot(*model.offset(fit.centre))
    return _Found(fit.centre[0], distance, signal, rest, np.ones_like(rest), count)


@array_record
class PreparedScan:
    """A scan whose points were brought to its nominal load."""

    scan: Scan
    electronic: FloatArray  # noise of its points beside that of their loads, in V
    estimate: ProfileEstimate | None = None  # of nearly the same voltages


def prepared_scan(scan: Scan, apparatus: ApparatusFunction, signal: ContactSignal) -> PreparedScan:
    """Bring every point to its nominal load; points without a load are missing."""
    # From P_i to P by -dU/d ln P ln(P_i/P); the variance is n_i^2 + (dU/d ln P u(P_i)/P)^2.
    stated = np.zeros_like(scan.u_zz) if scan.u_zz_errors is None else scan.u_zz_errors
    if scan.normal_load is None:
        return PreparedScan(scan, stated)
    excess = np.log(scan.normal_load / scan.stated_load)
    nominal = replace(scan, normal_load=None, normal_load_errors=None)
    errors = scan.normal_load_errors
    load_share = 0.0 if errors is None else np.nan_to_num(errors) / scan.stated_load
    x, y = scan.positions
    level = replace(nominal, u_zz=scan.u_zz - 0.0 * excess)
    # Centre and noise are estimated twice, the second time from the first one's scan.
    for find in (_found_quickly, _found):
        found = find(level, apparatus)
        distance = np.hypot(x - found.centre[0], y - found.centre[1])
        slope = np.interp(distance, signal.r, _slope(signal, found))
        load_noise = abs(slope) * load_share
        electronic = stated
        if scan.u_zz_errors is None and load_noise.any():
            noise = _electronic_noise(found, load_noise[np.isfinite(level.u_zz)])
            electronic = np.full_like(slope, noise)
        level = replace(nominal, u_zz=scan.u_zz - slope * excess)
        level = _with_noise(level, electronic, load_noise)
    return PreparedScan(level, electronic, found.estimate)


def _slope(signal: ContactSignal, found: _Found) -> FloatArray:
    """Derivative of the voltage by ln of the load, in V, between no friction and full stick."""
    # As far as the voltage nearest to the axis is from the one to the other.
    nearest = found.distance.argmin()
    free, stuck = (np.interp(found.distance[nearest], signal.r, u) for u in signal.voltage)
    sticking = 0.0
    if stuck > free:
        sticking = np.clip((found.signal[nearest] - free) / (stuck - free), 0.0, 1.0)
    sliding, stuck = signal.by_load
    return np.asarray((1 - sticking) * sliding + sticking * stuck)


def _with_noise(scan: Scan, electronic: FloatArray, load_noise: FloatArray) -> Scan:
    if not load_noise.any():
        return scan
    total = np.hypot(electronic, load_noise)
    correlation = scan.u_zz_correlation
    if correlation is not None:
        # The scatter of the loads is independent: it takes its share from the correlation.
        shape = (-1, len(correlation))
        electronic_variance = np.nanmean(electronic.reshape(shape) ** 2, axis=0)
        variance = np.nanmean(total.reshape(shape) ** 2, axis=0)
        correlation = _scaled(correlation, np.sqrt(electronic_variance / variance))
    return replace(scan, u_zz_errors=total, u_zz_correlation=correlation)


def _scaled(correlation: FloatArray, factors: FloatArray) -> FloatArray:
    """Multiply the correlation of each pair of points by a factor (n,) of both."""
    if not is_banded(correlation):
        product = correlation * np.outer(factors, factors)
        np.fill_diagonal(product, 1.0)
        return product
    product = correlation.copy()
    for j in range(1, correlation.shape[1]):
        product[:-j, j] *= factors[:-j] * factors[j:]
    return product


def _electronic_noise(found: _Found, load_noise: FloatArray) -> float:
    """Noise beside that of the loads, by maximum likelihood of the residuals."""
    residual = found.residual
    # The fitted parameters lower the scatter of the residuals.
    square = found.weight * residual**2 * residual.size / max(residual.size - found.parameters, 1)
    scatter = 1.4826 * np.median(abs(residual))
    tried = np.maximum(_TRIED * scatter, NUMERICAL_FLOOR * abs(found.signal).max())
    variance = tried[:, None] ** 2 + load_noise**2
    deviance = np.sum(np.log(variance) + square / variance, axis=1)
    return float(tried[np.argmin(deviance)])


def measured_scan(scan: Scan) -> MeasuredScan:
    """Return film, indenter, sensor and the other data of a scan without its points."""
    alike: Values = {item.name: getattr(scan, item.name, None) for item in fields(MeasuredScan)}
    own = {
        "film": scan.set_up.film,
        "indenter": scan.set_up.indenter,
        "width": _width(scan),
        "speed": hook("sliding_speed")(scan) if scan.motion == "sliding" else scan.speed,
        "synthetic": bool(scan.synthetic),
        "unit": "" if scan.unit == "V" else scan.unit,
    }
    return MeasuredScan(**(alike | own))


def measured_profile(
    origin: MeasuredScan,
    scan: Scan,
    electronic: FloatArray,
    restored: Restoration,
    signal: ContactSignal,
) -> MeasuredProfile:
    """Return the measured profile of one load of a scan from its restored stress."""
    from scipy.sparse import csr_array

    a = restored.apparatus.conversion_constant
    posterior = restored.posterior
    noise = restored.noise / np.sqrt(posterior.estimate.outlier_weight)
    # The sparse matrix (n, points) averages repeats at the n positions, by their weight.
    places = np.stack([restored.points.x, restored.points.y])
    (x, y), place = np.unique(places, axis=1, return_inverse=True)
    place = place.ravel()
    share = noise**-2 / np.bincount(place, noise**-2)[place]
    average: Any = csr_array((share, (place, np.arange(noise.size))))
    r = np.hypot(x - restored.centre[0], y - restored.centre[1])
    order = np.argsort(r, kind="stable")
    estimate = posterior.estimate
    background = estimate.model.drift_columns @ posterior.drift
    average = average[order]
    s_zz = average @ (restored.points.u - estimate.uneven - background) / a
    decorrelation = restored.points.decorrelation
    if decorrelation:
        # Of repeats there are more columns than positions.
        correlated = noise[:, None] * decorrelation.correlate(np.eye(noise.size))
        noise_root = np.linalg.qr((average @ correlated).T)[1].T
    else:
        noise_root = np.sqrt(average.power(2) @ noise**2)
    u_a = restored.apparatus.parameters.uncertainty("conversion_constant")
    roots = {"noise": noise_root / a, "conversion_constant": u_a / a * s_zz[:, None]}
    roots |= _place_roots(restored, average)
    points = _points(scan, electronic, restored)
    if points["zz"].by_dynamics is not None:
        roots["dynamics"] = average @ points["zz"].by_dynamics.T / a
    maximum, budget = _on_axis(restored)
    curve_r = np.linspace(0.0, r[order][-1], 301)
    return MeasuredProfile(
        scan=origin,
        load=scan.stated_load,
        load_uncertainty=scan.load_uncertainty,
        x=x[order],
        y=y[order],
        r=r[order],
        s_zz=s_zz,
        roots=roots,
        force=restored.force,
        force_budget=restored.force_budget,
        maximum=maximum,
        maximum_budget=budget,
        centre=restored.centre,
        centre_uncertainty=restored.centre_uncertainty,
        baseline=restored.baseline,
        baseline_uncertainty=restored.baseline_uncertainty,
        contact_radius=signal.contact_radius,
        direction=sum(DIRECTIONS[word] for word in scan.directions),
        tangential_load=_tangential_load(scan),
        curve_r=curve_r,
        curve_s_zz=restored.blurred_stress(curve_r),
        points=points,
    )


def _tangential_load(scan: Scan) -> float | None:
    """Mean tangential load, in N, where one was recorded."""
    if scan.tangential_load is None or np.isnan(scan.tangential_load).all():
        return None
    return float(np.nanmean(scan.tangential_load))


def _points(scan: Scan, noise: FloatArray, restored: Restoration) -> Mapping[str, MeasuredPoints]:
    # Readings in motion count as those of a still sensor.
    normal = measured_points(scan)
    normal = replace(normal, u=normal.u - restored.posterior.estimate.uneven)
    if not noise.any():
        # Only the electronic noise scatters: it is that of the restoration.
        noise = np.full_like(noise, restored.noise.min())
    weight = restored.posterior.estimate.outlier_weight
    zz = _channel_points(scan, normal, noise[measured_mask(scan)], weight)
    by_dynamics = restored.posterior.shifts.get("dynamics")
    if by_dynamics is not None:
        zz = replace(zz, by_dynamics=-by_dynamics.T)
    points = {"zz": zz}
    for channel in TANGENTIAL:
        if f"u_{channel}" in scan.channels:
            # The normal stress does not need it; a comparison of the shear states what is missing.
            with suppress(InputError, FitError):
                shear = measured_points(scan, channel)
                points[channel] = _channel_points(
                    scan, shear, shear.u_errors, np.ones_like(shear.u)
                )
    return points


def _channel_points(
    scan: Scan, points: ScanPoints, noise: FloatArray | None, weight: FloatArray
) -> MeasuredPoints:
    load_errors = np.zeros_like(points.u)
    if scan.normal_load_errors is not None:
        load_errors = np.nan_to_num(scan.normal_load_errors[measured_mask(scan, points.channel)])
    correlation = None
    if points.decorrelation:
        root = points.decorrelation.correlate(np.eye(points.u.size))
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


def _place_roots(restored: Restoration, average: Any) -> Arrays:
    """Roots of the covariance that centre, baseline and drift bring, shared out without a rest."""
    posterior = restored.posterior
    model = posterior.estimate.model
    pressure = posterior.stress / restored.scan.stated_load / posterior.film
    a = restored.apparatus.conversion_constant
    geometry = model.geometry(restored.centre)
    by_centre = average @ model.centre_derivative(geometry, pressure) / a
    by_drift = average @ model.drift_columns / a
    covariance = posterior.covariance[posterior.nodes :, posterior.nodes :]
    n = by_centre.shape[1]
    carried = np.linalg.solve(covariance[:n, :n], covariance[:n, n:])
    left = covariance[n:, n:] - covariance[n:, :n] @ carried
    by_centre = by_centre + by_drift @ carried.T
    centre = by_centre @ square_root(covariance[:n, :n])
    return {"centre": centre, "baseline": by_drift @ square_root(left)}


def _on_axis(restored: Restoration) -> tuple[float, Mapping[str, float]]:
    """Return the blurred stress on the axis and its standard uncertainty by source, in Pa."""
    posterior = restored.posterior
    apparatus = restored.apparatus
    nodes = posterior.nodes
    k = posterior.wavenumbers.k
    on_axis = posterior.wavenumbers.synthesise(np.eye(nodes), np.zeros(1))[0]
    transfer, _ = sensor_changes(apparatus, k)
    row = on_axis * transfer
    changes = {source: row @ columns[:nodes] for source, columns in posterior.changes.items()}
    k_and_zero = np.append(k, 0.0)
    shared = shared_changes(apparatus, [restored.scan], k_and_zero)
    kernel_changes = {
        "apparatus": sensor_changes(apparatus, k_and_zero, shared)[1],
        "film": columns_of(shared, posterior.film_inputs, k_and_zero.size),
    }
    if "load" in shared:
        kernel_changes["load"] = shared["load"][:, None]
    for source, change in kernel_changes.items():
        # G = (A G)/A: its own change beside that of what was restored with it.
        by_kernel = change[:-1] - transfer[:, None] * change[-1]
        by_kernel = on_axis * posterior.stress @ by_kernel / apparatus.conversion_constant
        changes[source] = changes[source] + by_kernel
    variance = row @ posterior.covariances["scan"][:nodes, :nodes] @ row
    budget = {"noise": math.sqrt(max(variance, 0.0))}
    for source, change in changes.items():
        budget[source] = float(np.linalg.norm(change))
    return float(row @ posterior.stress), budget
