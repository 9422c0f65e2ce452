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
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import ConvergenceError, DomainError, FitError, InputError
from memscal.estimation.points import TANGENTIAL, ScanPoints, measured_mask, measured_points
from memscal.estimation.profile import NUMERICAL_FLOOR, ProfileEstimate
from memscal.estimation.voltage_map import square_root
from memscal.measurement.posterior import (
    apparatus_changes,
    film_transfer,
    sensor_transfer,
    shared_changes,
)
from memscal.measurement.restoration import Restoration
from memscal.measurement.restore import gaussian_pressure, load_of, plain_pressure
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.mechanics.solver.refinement import RingRequest, solve_on_rings
from memscal.mechanics.solver.step import Load
from memscal.model.arrays import FloatArray
from memscal.model.correlation import is_banded
from memscal.model.indenter import Rod
from memscal.model.measured_stress import MeasuredPoints, MeasuredProfile, MeasuredScan
from memscal.model.scan import Scan

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


@dataclass(frozen=True, eq=False)
class ContactSignal:
    """The contact at a nominal load as the sensor reports it, without friction and sticking."""

    r: FloatArray  # (n,): distances from the centre, in m
    voltage: FloatArray  # (2, n), in V
    by_load: FloatArray  # (2, n): derivative by the logarithm of the load, in V
    contact_radius: float  # in m, without friction

    def slope(self, distance: FloatArray, sticking: float = 0.0) -> FloatArray:
        """Derivative of the voltage (V) by the logarithm of the load; ``sticking`` from 0 to 1."""
        between = (1 - sticking) * self.by_load[0] + sticking * self.by_load[1]
        return np.asarray(np.interp(distance, self.r, between))

    def sticking(self, distance: float, voltage: float) -> float:
        """How far from the frictionless voltage to the sticking one a measured one is, 0 to 1."""
        free, stuck = (float(np.interp(distance, self.r, curve)) for curve in self.voltage)
        return min(max((voltage - free) / (stuck - free), 0.0), 1.0) if stuck > free else 0.0


def contact_signals(loads: Sequence[Scan], apparatus: ApparatusFunction) -> list[ContactSignal]:
    """Calculate the contacts of a scan's nominal loads and near them, or raise a DomainError."""
    groups = [loads[i : i + _AT_ONCE] for i in range(0, len(loads), _AT_ONCE)]
    return [signal for group in groups for signal in _signals(group, apparatus)]


def _signals(loads: Sequence[Scan], apparatus: ApparatusFunction) -> list[ContactSignal]:
    try:
        return _signals_of_path(loads, apparatus)
    except (DomainError, ConvergenceError) as failure:
        if len(loads) > 1:
            # Each by itself shows which of them fails.
            return [signal for scan in loads for signal in _signals([scan], apparatus)]
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
    slides = scan.lubrication == "lubricated" or isinstance(scan.indenter, Rod)
    targets, places = np.unique(np.outer([s.stated_load for s in loads], near), return_inverse=True)
    paths = [_path(scan, targets, mu) for mu in ((0.0,) if slides else (0.0, math.inf))]
    signals = []
    for single, three in zip(loads, places.reshape(-1, near.size), strict=True):
        width = float(np.hypot(np.ptp(single.x), 0.0 if single.y is None else np.ptp(single.y)))
        r = np.linspace(0.0, 1.5 * width, _DISTANCES)
        nodes = Wavenumbers.covering(_LARGEST_KH / scan.set_up.film.thickness, 3 * width)
        through = apparatus.conversion_constant * sensor_transfer(apparatus, nodes.k)
        spectra = [through * path[i].base_spectrum(nodes.k) for path in paths for i in three]
        voltages = nodes.synthesise(np.stack(spectra, axis=1), r).T.reshape(-1, near.size, r.size)
        # Without friction both are the frictionless contact.
        below, at, above = np.moveaxis(voltages[[0, -1]], 1, 0)
        by_load = (above - below) / (2 * _LOAD_STEP)
        signals.append(ContactSignal(r, at, by_load, paths[0][three[1]].contact_radius))
    return signals


def _path(scan: Scan, loads: FloatArray, friction: float) -> Sequence[Contact]:
    film = scan.set_up.film
    indenter = scan.set_up.indenter
    if isinstance(indenter, Rod):
        return indent(film, indenter, load=loads, friction=friction, strain="linear")
    law = Interface()
    goals = tuple(map(Load, loads.tolist()))
    request = RingRequest(
        film, indenter, law, goals, friction, "incremental", "hankel", None, _RINGS, compared=False
    )
    return solve_on_rings(request)


def require_points(scan: Scan, signal: ContactSignal) -> None:
    """Refuse a load whose points are all missing (NaN), or over more than a contact's radius."""
    complete = np.isfinite(scan.u_zz)
    if scan.normal_load is not None:
        complete &= np.isfinite(scan.normal_load)
    if not complete.any():
        problem = f"{load_of(scan)}: all {complete.size} points are missing (NaN)."
        cure = "Check the import, or leave the lines of that load out."
        raise InputError(problem, why="A load without voltages has no profile.", cure=cure)
    if scan.y is not None:
        return
    order = np.argsort(scan.x)
    measured = (complete.reshape(-1, scan.x.size).sum(axis=0) > 0)[order]
    x = scan.x[order]
    places = np.flatnonzero(measured)
    missing = np.diff(places) - 1
    gaps = np.where(missing > 0, np.diff(x[places]), 0.0)
    if gaps.size and gaps.max() > signal.contact_radius:
        i = int(np.argmax(gaps))
        raise InputError(
            f"{load_of(scan)}: {missing[i]} neighbouring points are missing (NaN), from "
            f"{x[places[i] + 1] * 1e3:.4g} to {x[places[i + 1] - 1] * 1e3:.4g} mm.",
            why=f"The gap is wider than the contact's radius, {signal.contact_radius * 1e3:.3g} "
            "mm: the profile within it would be the model's, not measured.",
            cure="Measure these points again, or leave the lines of that load out.",
        )


def require_ends(scan: Scan, signal: ContactSignal, centre: FloatArray) -> None:
    """Refuse a scan whose profile exceeds 5 % at its ends: its baseline is undetermined."""
    measured = np.isfinite(scan.u_zz)
    if scan.y is None:
        x = scan.x[measured.reshape(-1, scan.x.size).any(axis=0)]
        axes = [(x, centre[0 if scan.direction == "x" else 1])]
    else:
        axes = [(scan.x, centre[0]), (scan.y, centre[1])]
    ends = [abs(float(end - c)) for a, c in axes for end in (a.min(), a.max())]
    calculated = signal.voltage[0]
    left = float(np.interp(ends, signal.r, calculated).max() / calculated.max())
    if left > _LARGEST_END:
        raise FitError(
            f"{load_of(scan)}: the scan ends {min(ends) * 1e3:.3g} mm from its centre, "
            f"where the calculated profile still has {left:.0%} of its maximum.",
            why="The voltage never comes down to the baseline, so that it cannot be told from the "
            "stress.",
            cure="Scan farther on that side; to where the profile has decayed.",
        )


#: Noises that are tried, over the scatter of the residuals.
_TRIED = np.geomspace(0.02, 2.0, 120)


@dataclass(frozen=True, eq=False)
class _Found:
    """Centre and signal of a scan, and what they leave of its n points; lengths in m, else V."""

    centre: FloatArray  # (2,)
    distance: FloatArray  # (n,): from the centre
    signal: FloatArray  # (n,)
    residual: FloatArray  # (n,)
    weight: FloatArray  # (n,): below one of an outlier
    parameters: int  # fitted
    estimate: ProfileEstimate | None = None


def _found(scan: Scan, apparatus: ApparatusFunction, points: ScanPoints) -> _Found:
    estimate, _ = gaussian_pressure(scan, apparatus, points)
    signal = estimate.predicted - estimate.background
    rest = estimate.weighed.residual
    weight = estimate.outlier_weight
    count = estimate.gaussian.jacobian.shape[1]
    return _Found(estimate.centre, estimate.distance, signal, rest, weight, count, estimate)


def _found_quickly(scan: Scan, apparatus: ApparatusFunction, points: ScanPoints) -> _Found:
    fit = plain_pressure(scan, apparatus, points)
    signal = fit.conversion_constant * fit.jacobian[:, 0]
    rest = points.u - fit.predicted
    count = fit.jacobian.shape[1]
    return _Found(fit.centre[0], fit.geometry.radius, signal, rest, np.ones_like(rest), count)


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """A scan whose points were brought to its nominal load."""

    scan: Scan
    electronic: FloatArray  # noise of its points beside that of their loads, in V
    estimate: ProfileEstimate | None = None  # of nearly the same voltages


def prepared_scan(scan: Scan, apparatus: ApparatusFunction, signal: ContactSignal) -> PreparedScan:
    """Bring every point to its nominal load."""
    # From P_i to P by -dU/d ln P ln(P_i/P); the variance is n_i^2 + (dU/d ln P u(P_i)/P)^2.
    stated = np.zeros_like(scan.u_zz) if scan.u_zz_errors is None else scan.u_zz_errors
    prepared = PreparedScan(_at_nominal(scan, np.zeros_like(scan.u_zz)), stated)
    if scan.normal_load is None:
        return prepared
    # Centre and noise are estimated twice, the second time from the first one's scan.
    errors = scan.normal_load_errors
    (x, y) = scan.positions
    load_share = 0.0 if errors is None else np.nan_to_num(errors) / scan.stated_load
    for find in (_found_quickly, _found):
        level = prepared.scan
        found = find(level, apparatus, measured_points(level))
        # How far the voltage nearest to the axis is on the way to a contact that sticks.
        nearest = int(np.argmin(found.distance))
        sticking = signal.sticking(float(found.distance[nearest]), float(found.signal[nearest]))
        slope = signal.slope(np.hypot(x - found.centre[0], y - found.centre[1]), sticking)
        of_load = np.abs(slope) * load_share
        electronic = stated
        if scan.u_zz_errors is None and of_load.any():
            noise = _noise_of_load(found, of_load[np.isfinite(level.u_zz)])
            electronic = np.full_like(slope, noise)
        level = _with_noise(_at_nominal(scan, slope), electronic, of_load)
        prepared = PreparedScan(level, electronic, found.estimate)
    return prepared


def _at_nominal(scan: Scan, slope: FloatArray) -> Scan:
    """Return the scan at its nominal load; points without a load are missing."""
    if scan.normal_load is None:
        return scan
    shift = slope * np.log(scan.normal_load / scan.stated_load)
    return replace(scan, u_zz=scan.u_zz - shift, normal_load=None, normal_load_errors=None)


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
        correlation = scaled(correlation, share)
    return replace(scan, u_zz_errors=total, u_zz_correlation=correlation)


def _noise_of_load(found: _Found, of_load: FloatArray) -> float:
    """Noise beside that of the loads, by maximum likelihood of the residuals."""
    count = found.residual.size
    residual = found.residual
    # The fitted parameters lower the scatter of the residuals.
    square = found.weight * residual**2 * count / max(count - found.parameters, 1)
    scatter = 1.4826 * float(np.median(np.abs(residual)))
    largest = float(np.abs(found.signal).max())
    tried = np.maximum(_TRIED * scatter, NUMERICAL_FLOOR * largest)
    variance = tried[:, None] ** 2 + of_load**2
    return float(tried[np.argmin(np.sum(np.log(variance) + square / variance, axis=1))])


def measured_scan(scan: Scan) -> MeasuredScan:
    """Return film, indenter, sensor and the other data of a scan without its points."""
    return MeasuredScan(
        film=scan.set_up.film,
        indenter=scan.set_up.indenter,
        sensor=scan.sensor,
        load_cell=scan.load_cell,
        width=float(np.hypot(np.ptp(scan.x), 0.0 if scan.y is None else np.ptp(scan.y))),
        lubrication=scan.lubrication,
        position_scale_uncertainty=scan.position_scale_uncertainty,
        synthetic=bool(scan.synthetic),
        source=scan.source,
        unit="" if scan.unit == "V" else scan.unit,
    )


def measured_profile(
    origin: MeasuredScan,
    scan: Scan,
    electronic: FloatArray,
    restored: Restoration,
    signal: ContactSignal,
) -> MeasuredProfile:
    """Return the measured profile of one load of a scan from its restored stress."""
    a = restored.apparatus.conversion_constant
    estimate = restored.posterior.estimate
    noise = restored.noise / np.sqrt(estimate.outlier_weight)
    average, x, y = _averaging(restored, noise)
    drift = restored.posterior.state[restored.posterior.nodes + int(restored.points.free.sum()) :]
    level = average @ (restored.points.u - estimate.model.drift_columns @ drift)
    r = np.hypot(x - restored.centre[0], y - restored.centre[1])
    order = np.argsort(r, kind="stable")
    average = average[order]
    s_zz = level[order] / a
    relative = restored.apparatus.parameters.uncertainty("conversion_constant") / a
    if (factor := restored.points.decorrelation) is None:
        of_noise = np.sqrt(average.power(2) @ noise**2)
    else:
        # Of repeats there are more columns than positions.
        correlated = noise[:, None] * factor.correlate(np.eye(noise.size))
        of_noise = np.linalg.qr((average @ correlated).T)[1].T
    roots = {
        "noise": of_noise / a,
        "conversion_constant": relative * s_zz[:, None],
        **_of_place(restored, average),
    }
    maximum, budget = _on_axis(restored)
    curve_r = np.linspace(0.0, float(r[order][-1]), 301)
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
        curve_r=curve_r,
        curve_s_zz=restored.blurred_stress(curve_r),
        points=_points(scan, electronic, restored),
    )


def _points(scan: Scan, noise: FloatArray, restored: Restoration) -> Mapping[str, MeasuredPoints]:
    normal = measured_points(scan)
    weight = restored.posterior.estimate.outlier_weight
    if not noise.any():
        # Only the electronic noise scatters: it is that of the restoration.
        noise = np.full_like(noise, restored.noise.min())
    points = {"zz": _of_channel(scan, normal, noise[measured_mask(scan)], weight)}
    for channel in (name for name in TANGENTIAL if f"u_{name}" in scan.channels):
        try:
            shear = measured_points(scan, channel)
        except (InputError, FitError):
            # The normal stress does not need it; a comparison of the shear states what is missing.
            continue
        points[channel] = _of_channel(scan, shear, shear.u_errors, np.ones_like(shear.u))
    return points


def _of_channel(
    scan: Scan, points: ScanPoints, noise: FloatArray | None, weight: FloatArray
) -> MeasuredPoints:
    load_errors = np.zeros_like(points.u)
    if scan.normal_load_errors is not None:
        load_errors = np.nan_to_num(scan.normal_load_errors[measured_mask(scan, points.channel)])
    correlation = None
    if points.decorrelation is not None:
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


def _averaging(restored: Restoration, noise: FloatArray) -> tuple[Any, FloatArray, FloatArray]:
    """Sparse matrix (n, points) that averages repeats by their weight, and the n positions."""
    from scipy.sparse import csr_array

    places = np.stack([restored.points.x, restored.points.y])
    unique, back = np.unique(places, axis=1, return_inverse=True)
    share = noise**-2 / np.bincount(back := back.ravel(), noise**-2)[back]
    return csr_array((share, (back, np.arange(noise.size)))), unique[0], unique[1]


def _of_place(restored: Restoration, average: Any) -> Mapping[str, FloatArray]:
    """Roots of the covariance that centre, baseline and drift bring, shared out without a rest."""
    model = restored.posterior.estimate.model
    posterior = restored.posterior
    nodes = posterior.nodes
    free = restored.points.free
    geometry = model.geometry(np.atleast_2d(restored.centre))
    film = film_transfer(restored.scan, model.reference.wavenumbers)
    pressure = posterior.state[:nodes] / restored.scan.stated_load / film
    columns = [model.centre_derivative(geometry, pressure), model.drift_columns]
    columns = [average @ column / restored.apparatus.conversion_constant for column in columns]
    sigma = posterior.covariance[nodes:, nodes:]
    n = int(free.sum())
    carried = np.linalg.solve(sigma[:n, :n], sigma[:n, n:])
    of_centre = columns[0] + columns[1] @ carried.T
    return {
        "centre": of_centre @ square_root(sigma[:n, :n]),
        "baseline": columns[1] @ square_root(sigma[n:, n:] - sigma[n:, :n] @ carried),
    }


def _on_axis(restored: Restoration) -> tuple[float, Mapping[str, float]]:
    """Return the blurred stress on the axis and its standard uncertainty by source, in Pa."""
    posterior = restored.posterior
    apparatus = restored.apparatus
    wavenumbers = posterior.estimate.model.reference.wavenumbers
    nodes = posterior.nodes
    k = wavenumbers.k
    on_axis = wavenumbers.synthesise(np.eye(nodes), np.zeros(1))[0]
    transfer = sensor_transfer(apparatus, k)
    row = on_axis * transfer
    state = posterior.state[:nodes]
    maximum = float(row @ state)
    a = apparatus.conversion_constant
    changes = {source: row @ columns[:nodes] for source, columns in posterior.changes.items()}
    shared = shared_changes(apparatus, [restored.scan], np.append(k, 0.0))
    of_film = [shared.get(name, np.zeros(k.size + 1)) for name in posterior.film_inputs]
    of_kernel = {
        "apparatus": apparatus_changes(apparatus, np.append(k, 0.0), shared),
        "film": np.reshape(of_film, (-1, k.size + 1)).T,
        **({"load": shared["load"][:, None]} if "load" in shared else {}),
    }
    for source, change in of_kernel.items():
        # G = (A G)/A: its own change beside that of what was restored with it.
        of_g = (change[:-1] - transfer[:, None] * change[-1]) / a
        changes[source] = changes[source] + on_axis * state @ of_g
    budget = {source: float(np.linalg.norm(change)) for source, change in changes.items()}
    noise = float(row @ posterior.covariances["scan"][:nodes, :nodes] @ row)
    return maximum, {"noise": float(np.sqrt(max(noise, 0.0))), **budget}


def scaled(correlation: FloatArray, factors: FloatArray) -> FloatArray:
    """Multiply the correlation of each pair of points by a factor (n,) of both."""
    if not is_banded(correlation):
        product = correlation * np.outer(factors, factors)
        np.fill_diagonal(product, 1.0)
        return product
    product = correlation.copy()
    for j in range(1, correlation.shape[1]):
        product[:-j, j] *= factors[:-j] * factors[j:]
    return product
