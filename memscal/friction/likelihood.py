"""The likelihood of calculated contacts: what a sensor reads of them, and chi-square.

The voltages of one load are u = f(theta) + F beta + D(theta) xi + n (docs/friction_model.md): flat
nuisance parameters beta of its own (baseline, drift, centre), systematic ones xi of unit
variance that all loads share, and noise n of covariance N.  With the residual rho = u - f,
chi-square is rho^T C^-1 rho, C = N + D D^T, the flat ones projected out.

What a tangential channel reads is the component of a vector field, by transforms of order one,
and changes its sign with the side of the centre.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag
from scipy.special import j0, j1, logsumexp

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import Wavenumbers, bessel
from memscal.errors import InputError
from memscal.friction.family import ProfileFamily
from memscal.friction.marginal_likelihood import Statistics, added, log_likelihood
from memscal.measurement.posterior import input_changes, sensor_changes, shared_changes
from memscal.model.arrays import (
    ArrayFunction,
    ArrayPair,
    Arrays,
    ArrayTriple,
    FloatArray,
    IndexArray,
    Values,
    array_record,
    floats,
)
from memscal.model.measured_stress import MeasuredProfile, MeasuredScan
from memscal.model.scan import Scan


@array_record
class LoadPoints:
    """Voltages (n,) of one load of one scan, and what is known about each."""

    u: FloatArray  # in V
    offset: FloatArray  # position from the centre along the scan, in m
    log_load: FloatArray  # logarithm of the point's load over the nominal one
    noise: FloatArray  # standard deviation in V, larger for outliers
    load_errors: FloatArray  # independent standard uncertainties, relative
    x_errors: FloatArray  # likewise, in m
    flat: FloatArray  # (n, d): baseline and drift, of unknown size
    free_centre: bool = True
    load_share: float = 0.0  # relative standard uncertainty of all loads
    position_share: float = 0.0  # likewise of the stage's scale
    gain_share: float = 0.0  # likewise of the sensor's chain, common to all scans
    own_gain: float = 0.0  # likewise of this scan only
    # Which of the scans, and of the load cells, it is of: one there, zero elsewhere.
    scan: FloatArray = field(default_factory=lambda: np.ones(1))
    load_cell: FloatArray = field(default_factory=lambda: np.ones(1))
    correlation: FloatArray | None = None  # (n, n): of the electronic noise
    # (n, m): one where a reading is of the contact; without it each is of its own.
    contacts: FloatArray | None = None
    # (n, p): one where a reading is at the place, whose error it shares; without it none does.
    places: FloatArray | None = None
    by_dynamics: FloatArray | None = None  # (q, n): changes by the sensor's dynamics, in V

    @property
    def radius(self) -> FloatArray:
        """Distance from the centre, in m."""
        return abs(self.offset)

    def shared_noise(self) -> tuple[IndexArray, Arrays]:
        """Order of the readings, and correlations (m, m) of kinds of noise in m that follow."""
        places = self.places
        order = np.arange(self.u.size)
        shared = {}
        if self.correlation is not None:
            shared["noise"] = self.correlation
        if self.contacts is not None:
            shared["load_scatter"] = self.contacts @ self.contacts.T
            shared["position"] = shared["load_scatter"]
        if places is not None:
            readings = places.sum(axis=0)
            most = int(readings.max())
            if shared or np.ptp(readings):
                shared["position"] = places @ places.T
            elif most > 1:
                order = np.argsort(places.argmax(axis=1), kind="stable")
                shared["position"] = np.ones((most, most))
        return order, shared

    @property
    def degrees(self) -> int:
        """Points less flat parameters."""
        return int(self.u.size - self.flat.shape[1] - self.free_centre)


#: Positions that spread across a line by less than this share of its length are on it.
_NARROW = 0.01


def require_line(name: str, x: FloatArray, y: FloatArray) -> None:
    """Refuse a contact that was scanned over a plane, or on a line across x and y."""
    spreads = np.ptp(x), np.ptp(y)
    if min(spreads) > _NARROW * max(spreads):
        raise InputError(
            f"{name} was scanned over x and y.",
            why="Contacts are compared along lines through their centre.",
            cure="Give a line scan along x or y; memscal restore takes a plane.",
        )


def load_points(profile: MeasuredProfile, channel: str = "zz") -> LoadPoints:
    """Return the points of a measured profile, with the noise that is stated, or was estimated."""
    points = profile.points.get(channel)
    if not profile.points:
        raise InputError(
            f"{profile.label}: the measured stress holds no measured points.",
            why="Its file is of version 1.0, which kept the profiles alone.",
            cure="Make it again with memscal apply, or give the scans.",
        )
    require_line(profile.label, profile.x, profile.y)
    if not points:
        raise InputError(
            f"{profile.label}: the measured stress holds no usable voltage u_{channel}.",
            why="The scan has none, or it does not change, or the scan does not run along "
            f"{channel[0]}: across it the shear is zero.",
            cure=f"Give a line scan along {channel[0]} through the sensor, with u_{channel}.",
        )
    if points.noise is None:
        raise InputError(
            f"{profile.label}: the noise of u_{channel}, u_{channel}_errors, is missing.",
            why="Contacts are told apart by a chi-square.",
            cure=f"State the electronic noise of u_{channel}.",
        )
    position = (points.x, points.y)[profile.axis]
    middle = (position.max() + position.min()) / 2
    drift = (position - middle) / (np.ptp(position) / 2)
    places = None
    if points.x_errors.any() and not profile.scan.position_errors_by_repeat:
        places = indicators(position.round(12).tolist())
    return LoadPoints(
        u=points.u,
        offset=position - profile.centre[profile.axis],
        log_load=np.log(points.load / profile.load),
        # A stated noise is not raised by a misfit: chi-square would not show it then.
        noise=points.noise / np.sqrt(points.weight),
        load_errors=points.load_errors / profile.load,
        x_errors=points.x_errors,
        flat=np.column_stack([np.ones_like(position), drift]),
        load_share=(profile.load_uncertainty or 0.0) / profile.load,
        position_share=profile.scan.position_scale_uncertainty or 0.0,
        gain_share=profile.scan.gain_uncertainty or 0.0,
        correlation=points.correlation,
        places=places,
        by_dynamics=points.by_dynamics,
    )


#: Relative standard uncertainty of a scan's gain that others do not share.
BETWEEN_SCAN_GAIN = 0.005


def points_of(
    profiles: Sequence[MeasuredProfile],
    channel: str = "zz",
    between_scan_gain: float = BETWEEN_SCAN_GAIN,
) -> list[LoadPoints]:
    """Return the points of profiles, with what each scan and each load cell has for itself."""
    scans = indicators([id(profile.scan) for profile in profiles])
    # A load cell that is not named is none of the others.
    cells = []
    for profile in profiles:
        cell = profile.scan.load_cell
        cells.append(cell.serial_number or cell.name or id(profile.scan))
    return [
        replace(
            load_points(profile, channel),
            own_gain=between_scan_gain,
            scan=scan,
            load_cell=load_cell,
        )
        for profile, scan, load_cell in zip(profiles, scans, indicators(cells), strict=True)
    ]


def indicators(keys: Sequence[Hashable]) -> FloatArray:
    """Return a row for each of the keys: one in the column of its kind."""
    kinds = list(dict.fromkeys(keys))
    return np.eye(len(kinds))[[kinds.index(key) for key in keys]]


def points_at(
    offset: FloatArray,
    like: LoadPoints,
    u: FloatArray | float = 0.0,
    noise: FloatArray | float = 0.0,
) -> LoadPoints:
    """Return points of the nominal load at places (n,), with the load's uncertainties of others."""
    nothing = np.zeros(offset.size)
    return replace(
        like,
        u=nothing + u,
        offset=offset,
        log_load=nothing,
        noise=nothing + noise,
        load_errors=nothing,
        x_errors=nothing,
        flat=np.zeros((offset.size, 0)),
        free_centre=False,
        correlation=None,
        contacts=None,
        places=None,
        by_dynamics=None,
    )


#: Directions in which A G changes the signal by less than this share of its largest are dropped.
_NEGLIGIBLE = 1e-4
#: Radii at which that is judged.
_RADII = 64


@array_record
class Sensor:
    """A sensor at the nodes of a family."""

    wavenumbers: Wavenumbers
    transfer: FloatArray  # (K,): transform of A G, in V/Pa
    changes: FloatArray  # (K, q): its independent changes by one standard uncertainty
    conversion_constant: float  # A, in V/Pa
    order: int = 0  # one of a tangential channel
    # (K,): its changes by one uncertainty of what the contacts share, film and load, by source.
    shared: Arrays = field(default_factory=dict)

    def with_exact_constant(self) -> Sensor:
        """Return the sensor as if A were exact: with the changes of G alone."""
        exact = {}
        for source, changes in {"": self.changes, **self.shared}.items():
            relative = self.wavenumbers.integrals(changes) / self.conversion_constant
            exact[source] = changes - np.multiply.outer(self.transfer, relative)
        return replace(self, changes=exact.pop(""), shared=exact)


def sensor_of(
    apparatus: ApparatusFunction,
    family: ProfileFamily,
    reach: float,
    scans: Sequence[MeasuredScan | Scan],
    common: Sequence[str] = (),
) -> Sensor:
    """Return a sensor at a family's nodes, with the changes of A G that change the signal."""
    # What the contacts' ``scans`` share with the calibration, film and load cell, counts once, as
    # do ``common`` inputs of the calibrations of two channels.
    nodes = family.wavenumbers
    k = nodes.k
    known = shared_changes(apparatus, scans, k)
    shared = {name: change for name, change in known.items() if name in (*family.changes, "load")}
    alike = []
    if all(scan.stage.same_as(apparatus.stage) for scan in scans):
        alike.append("position_scale")
    # The sensor is the same, and so is its chain.
    if all(scan.gain_uncertainty is not None for scan in scans):
        alike.append("gain")
    shared |= input_changes(apparatus, alike, k)
    inputs = [name for name in common if name not in shared]
    calibration = input_changes(apparatus, inputs, k)
    transfer, changes = sensor_changes(apparatus, k, [*shared, *calibration])
    shared |= {f"calibration_{name}": change for name, change in calibration.items()}
    if changes.shape[1]:
        # Any rotation of independent changes is another set of them: in this one few matter.
        radii = np.linspace(0.0, reach, _RADII)
        middle = family.spectra[family.values.size // 2]
        largest = abs(middle).max(axis=1) if family.order else middle[:, 0]
        signals = [
            nodes.synthesise(shape[:, None] * changes, radii, order=family.order)
            for shape in middle / largest[:, None]
        ]
        _, sizes, axes = np.linalg.svd(np.concatenate(signals), full_matrices=False)
        changes = changes @ axes[sizes > _NEGLIGIBLE * sizes[0]].T
    constant = apparatus.conversion_constant
    return Sensor(nodes, constant * transfer, changes, constant, family.order, shared)


@array_record
class Predicted:
    """Voltages (V) of the n points of one load at V values of a family's parameter, (V, n)."""

    signal: FloatArray  # A G convolved with the base stress at the point's load
    by_load: FloatArray  # its derivative by the logarithm of the load
    by_coordinate: FloatArray  # by the bounded coordinate
    slope: FloatArray  # by the distance from the centre, in V/m
    columns: Arrays  # (V, n, q): changes by each systematic source's uncertainty


def predict(points: LoadPoints, sensor: Sensor, members: ProfileFamily, load: int) -> Predicted:
    """Return what the sensor reads of members at the points of one load, by the load's index."""
    k = sensor.wavenumbers.k
    weights = sensor.wavenumbers.weights
    # Repeats share the transforms at their distance from the centre.
    radius, place = np.unique(points.radius, return_inverse=True)
    phase = np.outer(radius, k)
    kernel = bessel(sensor.order, phase)
    derivative = -j1(phase)
    if sensor.order:
        ratio = np.divide(kernel, phase, out=np.full_like(phase, 0.5), where=phase > 0)
        derivative = j0(phase) - ratio
    # The component of a vector along the scan changes its sign with the side of the centre.
    sign = np.sign(points.offset) ** sensor.order

    def at_points(spectra: FloatArray, kernel: FloatArray = kernel * weights) -> FloatArray:
        """Inverse transforms (V, n) of spectra (V, K)."""
        return sign * (spectra @ kernel.T)[:, place]

    slope = at_points(sensor.transfer * members.spectra[:, load], derivative * weights * k)
    return changes_at(points, sensor, members, load, at_points, slope)


def changes_at(
    points: LoadPoints,
    sensor: Sensor,
    members: ProfileFamily,
    load: int,
    at_points: ArrayFunction,  # from spectra (V, K) to voltages (V, n)
    slope: FloatArray,  # (V, n), in V/m
) -> Predicted:
    """Return what the sensor reads of members, with its changes, by their inverse transforms."""
    transfer = sensor.transfer
    spectra = members.spectra[:, load]
    by_load = at_points(transfer * members.by_load[:, load])
    columns = {}
    if sensor.changes.size:
        changed = [at_points(change * spectra) for change in sensor.changes.T]
        columns["apparatus"] = np.stack(changed, axis=-1)
    contact = {name: change[:, load] for name, change in members.changes.items()}
    contact["load"] = points.load_share * members.by_load[:, load]
    contact["gain"] = points.gain_share * spectra
    for source in dict.fromkeys([*contact, *sensor.shared]):
        change = sensor.shared.get(source, 0.0) * spectra
        if source in contact:
            change = change + transfer * contact[source]
        columns[source] = at_points(change)[..., None]
    columns["load"] = columns["load"] * points.load_cell
    stretched = (points.position_share * points.radius * slope)[..., None]
    columns["position_scale"] = columns.get("position_scale", 0.0) + stretched
    signal = at_points(transfer * spectra) + by_load * points.log_load
    columns["between_scan_gain"] = points.own_gain * signal[..., None] * points.scan
    if points.by_dynamics is not None:
        changes = np.broadcast_to(points.by_dynamics.T, (*signal.shape, len(points.by_dynamics)))
        columns["dynamics"] = changes
    return Predicted(
        signal=signal,
        by_load=by_load,
        by_coordinate=at_points(transfer * members.by_coordinate[:, load]),
        slope=slope,
        columns=columns,
    )


Readings = tuple[LoadPoints, Predicted]
"""Points of a load, and what the sensor reads of its contacts there."""


def stacked(normal: Readings, shear: Readings) -> Readings:
    """Return what two channels read of the same contacts as the readings of one load."""
    # Common are the centre, the scatter of each contact's load and position, and all systematic
    # sources but what is left of each sensor; noise, baseline and drift are each channel's own.
    points = (normal[0], shear[0])
    predicted = (normal[1], shear[1])

    def joined(pair: Sequence[Any], names: Sequence[str], axis: int) -> Values:
        """Arrays of both channels, one after the other."""
        return {
            name: np.concatenate([getattr(channel, name) for channel in pair], axis=axis)
            for name in names
        }

    correlations = []
    contacts = []
    for channel in points:
        own = np.eye(channel.u.size) if channel.correlation is None else channel.correlation
        correlations.append(own)
        # A contact is known by its place, and by which of those there it is.
        count = Counter[float]()
        for place in channel.offset.round(12).tolist():
            contacts.append((place, count[place]))
            count[place] += 1
    names = ("u", "offset", "log_load", "noise", "load_errors", "x_errors")
    together = replace(
        points[0],
        **joined(points, names, axis=0),
        flat=block_diag(normal[0].flat, shear[0].flat),
        correlation=block_diag(*correlations),
        contacts=indicators(contacts),
    )
    if points[0].places is not None:
        together = replace(together, places=indicators(together.offset.round(12).tolist()))
    columns = [dict(channel.columns) for channel in predicted]
    if "apparatus" in columns[1]:
        columns[1]["apparatus_shear"] = columns[1].pop("apparatus")
    padded = {}
    for source in dict.fromkeys([*columns[0], *columns[1]]):
        width = next(changes[source].shape[-1] for changes in columns if source in changes)
        both = [
            changes.get(source, np.zeros((*reading.signal.shape, width)))
            for reading, changes in zip(predicted, columns, strict=True)
        ]
        padded[source] = np.concatenate(both, axis=1)
    arrays = joined(predicted, ("signal", "by_load", "by_coordinate", "slope"), axis=1)
    return together, Predicted(**arrays, columns=padded)


@array_record
class Noise:
    """Independent kinds of noise of the n readings of one load, at V values of the parameter."""

    kinds: Arrays  # (V, n): standard deviations in V
    # (m, m): correlation of kinds within each m readings that follow each other, if there is any.
    shared: Arrays

    def inverse_root(self) -> FloatArray:
        """Return W, with W N W^T = 1, in B blocks of readings that share noise: (V, B, m, m)."""
        if not self.shared:
            variance = np.sum([kind**2 for kind in self.kinds.values()], axis=0)
            return floats(1 / np.sqrt(variance))[..., None, None]
        size = len(next(iter(self.shared.values())))
        covariance = np.zeros(())
        for name, kind in self.kinds.items():
            block = kind.reshape(len(kind), -1, size)
            correlation = self.shared.get(name, np.eye(size))
            covariance = covariance + block[..., None] * block[..., None, :] * correlation
        return np.linalg.inv(np.linalg.cholesky(covariance))

    def shares(self, gain: FloatArray) -> dict[str, float]:
        """Return the standard deviation by kind of a sum of whitened readings, at one value."""
        # Not kept with the readings: at all values the matrices fill the memory.
        root = self.inverse_root()[0]
        weights = (gain.reshape(len(root), 1, -1) @ root)[:, 0]
        shares = {}
        for name, kind in self.kinds.items():
            share = weights * kind[0].reshape(weights.shape)
            correlation = self.shared.get(name, np.eye(weights.shape[1]))
            shares[name] = np.sqrt(np.sum(share @ correlation * share))
        return shares


@array_record
class Standardised:
    """One load at V parameter values: noise of unit variance, flat nuisances projected out."""

    residual: FloatArray  # (V, n): measured less calculated voltage
    slope: FloatArray  # (V, n): derivative by the bounded coordinate
    columns: FloatArray  # (V, n, q): systematic changes
    widths: Mapping[str, int]  # how many of the q are of each source
    noise: Noise
    log_determinant: FloatArray  # (V,): of N and of the flat information
    degrees: int

    def with_lubricated_friction(self, spread: float) -> Standardised:
        """Return the load with one systematic column more, for a ``spread`` of its coordinate."""
        columns = np.concatenate([self.columns, spread * self.slope[..., None]], axis=-1)
        return replace(self, columns=columns, widths={**self.widths, LUBRICATED_FRICTION: 1})

    @cached_property
    def statistics(self) -> Statistics:
        """What the load tells about the parameter and the systematic errors, shape (V,)."""
        transposed = np.swapaxes(self.columns, -1, -2)
        chi_square = np.sum(self.residual**2, axis=-1)
        projection = (transposed @ self.residual[..., None])[..., 0]
        information = transposed @ self.columns
        return Statistics(chi_square, projection, information, self.log_determinant)


def standardise(points: LoadPoints, predicted: Predicted) -> Standardised:
    """Divide by the noise, and project out what is flat."""
    shape = predicted.signal.shape
    by_centre = -predicted.slope * np.sign(points.offset)
    kinds = {
        "noise": np.broadcast_to(points.noise, shape),
        "load_scatter": predicted.by_load * points.load_errors,
        "position": by_centre * points.x_errors,
    }
    order, shared = points.shared_noise()
    noise = Noise({name: kind[:, order] for name, kind in kinds.items()}, shared)
    root = noise.inverse_root()

    def whitened(values: FloatArray) -> FloatArray:
        """Values (V, n, q) in units of the noise, in its order."""
        blocks = values[:, order].reshape(*root.shape[:-1], values.shape[-1])
        return (root @ blocks).reshape(values.shape)

    flat = np.broadcast_to(points.flat, (*shape, points.flat.shape[1]))
    if points.free_centre:
        flat = np.concatenate([flat, by_centre[..., None]], axis=-1)
    basis, triangle = np.linalg.qr(whitened(flat))
    residual = points.u - predicted.signal
    vectors = [residual[..., None], predicted.by_coordinate[..., None], *predicted.columns.values()]
    scaled = whitened(np.concatenate(vectors, axis=-1))
    projected = scaled - basis @ (np.swapaxes(basis, -1, -2) @ scaled)
    # The diagonals of triangular roots give the determinants.
    pivots = abs(np.diagonal(triangle, axis1=-2, axis2=-1))
    log_flat = 2 * np.log(pivots).sum(axis=-1)
    pivots = np.diagonal(root, axis1=-2, axis2=-1)
    log_noise = -2 * np.log(pivots).sum(axis=(-2, -1))
    return Standardised(
        residual=projected[..., 0],
        slope=projected[..., 1],
        columns=projected[..., 2:],
        widths={source: column.shape[-1] for source, column in predicted.columns.items()},
        noise=noise,
        log_determinant=log_noise + log_flat,
        degrees=points.degrees,
    )


#: Source of the uncertainty by the friction of lubricated loads.
LUBRICATED_FRICTION = "lubricated_friction"


@array_record
class Likelihood:
    """Likelihood of one load or several along V values of one parameter."""

    values: FloatArray
    coordinates: FloatArray
    loads: Sequence[Standardised]

    def only(self, chosen: Sequence[int]) -> Likelihood:
        """Return the likelihood of some of the loads."""
        return replace(self, loads=[self.loads[i] for i in chosen])

    def with_held(self, held: Likelihood, spread: float) -> Likelihood:
        """Add loads that are held at one value; all share systematic errors.

        ``spread`` is the standard uncertainty of that value, in the bounded coordinate.
        """
        loads = [load.with_lubricated_friction(0.0) for load in self.loads]
        for load in held.loads:
            moved = load.with_lubricated_friction(spread)
            loads.append(replace(moved, slope=np.zeros_like(load.slope)))
        return replace(self, loads=loads)

    def averaged_over(self, held: Likelihood, weights: FloatArray) -> ArrayTriple:
        """Average the likelihood over values (W,) of other loads; all share systematic errors.

        Return log likelihood and mean chi-square, (V,), and the mean of the other loads' value.
        """
        among = np.flatnonzero(weights)
        both = added([self.statistics.at(np.s_[:, None]), held.statistics.at(among)])
        logs, chi_square = log_likelihood(both)
        weighed = logs + np.log(weights[among])
        whole = logsumexp(weighed, axis=1)
        shares = np.exp(weighed - whole[:, None])
        return whole, np.sum(shares * chi_square, axis=1), shares @ held.values[among]

    @cached_property
    def statistics(self) -> Statistics:
        """What all loads tell together, one parameter for all of them, shape (V,)."""
        return added([load.statistics for load in self.loads])

    @property
    def chi_square(self) -> FloatArray:
        """Least chi-square over all nuisances, shape (V,)."""
        return log_likelihood(self.statistics)[1]

    @property
    def deviance(self) -> FloatArray:
        r""":math:`-2 \ln p(u | \theta)`, (V,): the noise depends on the value, by loads, too."""
        # Chi-square alone would prefer the value with the larger error bars.
        return -2 * log_likelihood(self.statistics)[0]

    def slope_fit(self) -> ArrayPair:
        """Fit the slopes by the systematic columns: what is left, squared, and coefficients."""
        # What is left, (V,), is the inverse variance of the bounded coordinate.  By Woodbury's
        # identity, C^-1 = 1 - D (1 + D^T D)^-1 D^T.
        information = self.statistics.information
        square = np.zeros(())
        projection = np.zeros(())
        for load in self.loads:
            square = square + np.sum(load.slope**2, axis=-1)
            projection = projection + (load.slope[:, None] @ load.columns)[:, 0]
        prior = np.eye(information.shape[-1])
        response = floats(np.linalg.solve(information + prior, projection[..., None]))[..., 0]
        return square - np.sum(projection * response, axis=-1), response

    def budget(self) -> dict[str, float]:
        """Contribution of each source to the coordinate's uncertainty, at the first value."""
        (information, *_), (response, *_) = self.slope_fit()
        if not information > 0:
            return {}
        kinds: dict[str, list[float]] = {}
        for load in self.loads:
            # The gain by which the best coordinate follows the voltages.
            gain = (load.slope[0] - load.columns[0] @ response) / information
            for name, share in load.noise.shares(gain).items():
                kinds.setdefault(name, []).append(share)
        shares = {name: math.hypot(*each) for name, each in kinds.items()}
        widths = self.loads[0].widths
        parts = np.split(response / information, np.cumsum([*widths.values()])[:-1])
        for source, part in zip(widths, parts, strict=True):
            shares[source] = float(np.linalg.norm(part))
        return {source: share for source, share in shares.items() if share > 0}


@array_record
class Channel:
    """What one channel of a sensor reads of several loads, and their calculated contacts."""

    points: Sequence[LoadPoints]
    sensor: Sensor
    family: ProfileFamily  # at the load of each of the points

    def only(self, chosen: Sequence[int]) -> Channel:
        """Return some of the loads."""
        points = [self.points[i] for i in chosen]
        return replace(self, points=points, family=self.family.only(chosen))

    def at(self, values: ArrayLike) -> Channel:
        """Return the channel with the contacts at some values of the family's parameter."""
        return replace(self, family=self.family.at(values))

    def readings(self, load: int) -> Readings:
        """Return the points of a load, by its index, and what is predicted there."""
        points = self.points[load]
        return points, predict(points, self.sensor, self.family, load)


def likelihood(channel: Channel, *shear: Channel) -> Likelihood:
    """Return the likelihood of the loads of a channel, or of two, at the values of its family."""
    loads = []
    for i in range(len(channel.points)):
        both = [each.readings(i) for each in (channel, *shear)]
        loads.append(standardise(*reduce(stacked, both)))
    return Likelihood(channel.family.values, channel.family.coordinates, loads)
