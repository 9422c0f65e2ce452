"""The likelihood of calculated contacts: what a sensor reads of them, and chi-square.

The voltages of one load are u = f(theta) + F beta + D(theta) xi + n, as docs/friction.md has it:
flat nuisance parameters beta of its own (baseline, drift, centre), systematic ones xi of unit
variance that all loads share, and noise n of covariance N.  With the residual rho = u - f,
chi-square is rho^T C^-1 rho, C = N + D D^T, the flat ones projected out.

What a tangential channel reads is the component of a vector field, by transforms of order one,
and changes its sign with the side of the centre.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag
from scipy.special import j0, j1

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import InputError
from memscal.friction.family import ProfileFamily
from memscal.friction.marginal_likelihood import Tables, log_likelihood
from memscal.measurement.posterior import (
    apparatus_changes,
    input_changes,
    sensor_transfer,
    shared_changes,
)
from memscal.model.arrays import FloatArray
from memscal.model.measured_stress import MeasuredProfile, MeasuredScan
from memscal.model.scan import Scan


@dataclass(frozen=True, eq=False)
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
    correlation: FloatArray | None = None  # (n, n): of the electronic noise
    # (n, m): one where a reading is of the contact; without it each is of its own.
    contacts: FloatArray | None = None

    @property
    def radius(self) -> FloatArray:
        """Distance from the centre, in m."""
        return np.abs(self.offset)

    @property
    def side(self) -> FloatArray:
        """Change of the distance for a shift of the centre: one, minus one, or zero."""
        return -np.sign(self.offset)

    @property
    def degrees(self) -> int:
        """Points less flat parameters."""
        return int(self.u.size - self.flat.shape[1]) - int(self.free_centre)

    def averaged(self) -> LoadPoints:
        """Return the mean of the repeats at each position, sorted by position."""
        rounded = np.round(self.offset, 12)
        order = np.argsort(rounded, kind="stable")
        places, starts, counts = np.unique(rounded[order], return_index=True, return_counts=True)

        def mean(values: FloatArray) -> FloatArray:
            return np.asarray((np.add.reduceat(values[order], starts, axis=0).T / counts).T)

        noise = np.sqrt(mean(self.noise**2) / counts)
        correlation = None
        if self.correlation is not None:
            single = np.outer(self.noise, self.noise) * self.correlation
            covariance = mean(mean(single).T)
            noise = np.sqrt(np.diag(covariance))
            correlation = covariance / np.outer(noise, noise)
        return replace(
            self,
            u=mean(self.u),
            offset=places,
            log_load=mean(self.log_load),
            noise=noise,
            load_errors=np.sqrt(mean(self.load_errors**2) / counts),
            # The stage errs alike in every repeat.
            x_errors=mean(self.x_errors),
            flat=mean(self.flat),
            correlation=correlation,
        )


#: Positions that spread across a line by less than this share of its length are on it.
_NARROW = 0.01


def require_line(name: str, x: FloatArray, y: FloatArray) -> None:
    """Refuse a contact that was scanned over a plane, or on a line across x and y."""
    spreads = np.ptp(x), np.ptp(y)
    if min(spreads) > _NARROW * max(spreads):
        why = "Contacts are compared along lines through their centre."
        cure = "Give a line scan along x or y; memscal restore takes a plane."
        raise InputError(f"{name} was scanned over x and y.", why=why, cure=cure)


def load_points(profile: MeasuredProfile, channel: str = "zz") -> LoadPoints:
    """Return the points of a measured profile, with the noise that is stated, or was estimated."""
    points = profile.points.get(channel)
    if not profile.points:
        problem = f"{profile.label}: the measured stress holds no measured points."
        why = "Its file is of version 1.0, which kept the profiles alone."
        cure = "Make it again with memscal apply, or give the scans."
        raise InputError(problem, why=why, cure=cure)
    require_line(profile.label, profile.x, profile.y)
    if points is None:
        raise InputError(
            f"{profile.label}: the measured stress holds no usable voltage u_{channel}.",
            why="The scan has none, or it does not change, or the scan does not run along "
            f"{channel[0]}: across it the shear is zero.",
            cure=f"Give a line scan along {channel[0]} through the sensor, with u_{channel}.",
        )
    if points.noise is None:
        problem = f"{profile.label}: the noise of u_{channel}, u_{channel}_errors, is missing."
        why = "Contacts are told apart by a chi-square."
        raise InputError(problem, why=why, cure=f"State the electronic noise of u_{channel}.")
    position = (points.x, points.y)[profile.axis]
    drift = (position - (position.max() + position.min()) / 2) / (np.ptp(position) / 2)
    return LoadPoints(
        u=points.u,
        offset=position - float(profile.centre[profile.axis]),
        log_load=np.log(points.load / profile.load),
        # A stated noise is not raised by a misfit: chi-square would not show it then.
        noise=np.asarray(points.noise / np.sqrt(points.weight)),
        load_errors=points.load_errors / profile.load,
        x_errors=points.x_errors,
        flat=np.stack([np.ones_like(position), drift], axis=1),
        load_share=(profile.load_uncertainty or 0.0) / profile.load,
        position_share=profile.scan.position_scale_uncertainty or 0.0,
        correlation=points.correlation,
    )


def points_at(
    offset: FloatArray, like: LoadPoints, u: ArrayLike = 0.0, noise: ArrayLike = 0.0
) -> LoadPoints:
    """Return points of the nominal load at places (n,), with the load's uncertainties of others."""
    nothing = np.zeros(offset.size)
    return LoadPoints(
        u=nothing + np.asarray(u),
        offset=offset,
        log_load=nothing,
        noise=nothing + np.asarray(noise),
        load_errors=nothing,
        x_errors=nothing,
        flat=np.zeros((offset.size, 0)),
        free_centre=False,
        load_share=like.load_share,
        position_share=like.position_share,
    )


#: Directions in which A G changes the signal by less than this share of its largest are dropped.
_NEGLIGIBLE = 1e-4
#: Radii at which that is judged.
_RADII = 64


@dataclass(frozen=True, eq=False)
class Sensor:
    """A sensor at the nodes of a family."""

    wavenumbers: Wavenumbers
    transfer: FloatArray  # (K,): transform of A G, in V/Pa
    changes: FloatArray  # (K, q): its independent changes by one standard uncertainty
    conversion_constant: float  # A, in V/Pa
    order: int = 0  # one of a tangential channel
    # (K,): its changes by one uncertainty of what the contacts share, film and load, by source.
    shared: Mapping[str, FloatArray] = field(default_factory=dict)

    @cached_property
    def of_shape(self) -> Sensor:
        """The sensor with the changes of A G that those of G alone bring: its integral stays."""
        shared = {source: self._shaped(c[:, None])[:, 0] for source, c in self.shared.items()}
        return replace(self, changes=self._shaped(self.changes), shared=shared)

    def _shaped(self, changes: FloatArray) -> FloatArray:
        of_conversion = self.wavenumbers.integrals(changes)
        return np.asarray(
            changes - np.outer(self.transfer, of_conversion) / self.conversion_constant
        )


@dataclass(frozen=True, eq=False)
class Predicted:
    """Voltages (V) of the n points of one load at V values of a family's parameter, (V, n)."""

    signal: FloatArray  # A G convolved with the base stress at the point's load
    by_load: FloatArray  # its derivative by the logarithm of the load
    by_coordinate: FloatArray  # by the bounded coordinate
    slope: FloatArray  # by the distance from the centre, in V/m
    columns: Mapping[str, FloatArray]  # (V, n, q): changes by each systematic source's uncertainty


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
    middle = family.spectra[family.values.size // 2]
    shared = shared_changes(apparatus, scans, nodes.k)
    shared = {name: change for name, change in shared.items() if name in (*family.changes, "load")}
    of_rod = input_changes(apparatus, [name for name in common if name not in shared], nodes.k)
    changes = apparatus_changes(apparatus, nodes.k, [*shared, *of_rod])
    shared |= {f"calibration_{name}": change for name, change in of_rod.items()}
    bessel = j1 if family.order else j0
    kernel = bessel(np.multiply.outer(np.linspace(0.0, reach, _RADII), nodes.k)) * nodes.weights
    largest = np.abs(middle).max(axis=1) if family.order else middle[:, 0]
    shapes = middle / largest[:, None]
    signals = np.concatenate([(kernel * row) @ changes for row in shapes])
    # Any rotation of independent changes is another set of them: in this one few matter.
    if changes.shape[1]:
        _, sizes, axes = np.linalg.svd(signals, full_matrices=False)
        changes = changes @ axes[sizes > _NEGLIGIBLE * sizes[0]].T
    a = apparatus.conversion_constant
    transfer = a * sensor_transfer(apparatus, nodes.k)
    return Sensor(nodes, transfer, changes, a, family.order, shared)


def predict(points: LoadPoints, sensor: Sensor, members: ProfileFamily, load: int) -> Predicted:
    """Return what the sensor reads of members at the points of one load, by the load's index."""
    bessel = _Bessel.of(points, sensor)
    spectra = members.spectra[:, load]
    transfer = sensor.transfer
    by_load = bessel.values(transfer * members.by_load[:, load])
    slope = bessel.slopes(transfer * spectra)
    changed = [bessel.values(change * spectra) for change in sensor.changes.T]
    columns = {"apparatus": np.stack(changed, axis=-1)} if changed else {}
    of_contact = {**members.changes, "load": points.load_share * members.by_load}
    for source in dict.fromkeys([*of_contact, *sensor.shared]):
        change = sensor.shared.get(source, 0.0) * spectra
        if source in of_contact:
            change = change + transfer * of_contact[source][:, load]
        columns[source] = bessel.values(change)[..., None]
    columns["position_scale"] = (points.position_share * points.radius * slope)[..., None]
    return Predicted(
        signal=bessel.values(transfer * spectra) + by_load * points.log_load,
        by_load=by_load,
        by_coordinate=bessel.values(transfer * members.by_coordinate[:, load]),
        slope=slope,
        columns={source: column for source, column in columns.items() if column.any()},
    )


@dataclass(frozen=True, eq=False)
class _Bessel:
    """Inverse transforms at the distances of n points, and their slopes; repeats share theirs."""

    even: FloatArray  # (m, K): of a transform's value at the m different distances
    odd: FloatArray  # (m, K): of its derivative by the distance
    back: NDArray[np.intp]  # (n,): which of the distances is that of a point
    sign: FloatArray | float  # factor (n,) of both: of a vector, the side of the centre

    @classmethod
    def of(cls, points: LoadPoints, sensor: Sensor) -> _Bessel:
        """Return those of a scalar, or of a vector's component where the order is one."""
        radius, back = np.unique(points.radius, return_inverse=True)
        k = sensor.wavenumbers.k
        weights = sensor.wavenumbers.weights
        phase = np.multiply.outer(radius, k)
        if not sensor.order:
            return cls(j0(phase) * weights, -j1(phase) * weights * k, back, 1.0)
        turn = np.divide(j1(phase), phase, out=np.full_like(phase, 0.5), where=phase > 0)
        odd = (j0(phase) - turn) * weights * k
        return cls(j1(phase) * weights, odd, back, np.sign(points.offset))

    def values(self, spectra: FloatArray) -> FloatArray:
        """Values of transforms (V, K) at the points, shape (V, n)."""
        return np.asarray(self.sign * (spectra @ self.even.T)[:, self.back])

    def slopes(self, spectra: FloatArray) -> FloatArray:
        """Their derivatives by the distance, shape (V, n)."""
        return np.asarray(self.sign * (spectra @ self.odd.T)[:, self.back])


@dataclass(frozen=True, eq=False)
class Standardised:
    """One load at V parameter values: noise of unit variance, flat nuisances projected out."""

    residual: FloatArray  # (V, n): measured less calculated voltage
    slope: FloatArray  # (V, n): derivative by the bounded coordinate
    columns: Mapping[str, FloatArray]  # (V, n, q): systematic changes
    points: LoadPoints  # whose noise it is
    kinds: Mapping[str, FloatArray]  # (V, n): each kind of noise, in V
    volume: FloatArray  # (V,): log-determinants of N and of the flat information
    degrees: int

    def noises(self, index: int) -> dict[str, FloatArray]:
        """Roots of each kind's covariance at one value, in units of all noise: (n,) or (n, n)."""
        # Made when they are asked for: of all values, matrices over the points fill the memory.
        kinds = {name: kind[index : index + 1] for name, kind in self.kinds.items()}
        whitener = _whitener(self.points, kinds)
        return {name: _scaled(whitener, self.points, name, kinds[name])[0] for name in kinds}

    def held(self, count: int) -> Standardised:
        """Return the load with its parameter held at the first value, at ``count`` of others'."""

        def first(values: FloatArray) -> FloatArray:
            return np.broadcast_to(values[:1], (count, *values.shape[1:]))

        return Standardised(
            residual=first(self.residual),
            slope=np.zeros((count, *self.slope.shape[1:])),
            columns={source: first(column) for source, column in self.columns.items()},
            points=self.points,
            kinds={name: first(kind) for name, kind in self.kinds.items()},
            volume=first(self.volume),
            degrees=self.degrees,
        )


def stacked(
    normal: tuple[LoadPoints, Predicted], shear: tuple[LoadPoints, Predicted]
) -> tuple[LoadPoints, Predicted]:
    """Return what two channels read of the same contacts as the readings of one load."""
    # Common are the centre, the scatter of each contact's load and position, and all systematic
    # sources but what is left of each sensor; noise, baseline and drift are each channel's own.
    points = (normal[0], shear[0])
    predicted = (normal[1], shear[1])
    names = ("u", "offset", "log_load", "noise", "load_errors", "x_errors")
    both: dict[str, Any] = {
        name: np.concatenate([getattr(side, name) for side in points]) for name in names
    }
    own = [np.eye(p.u.size) if p.correlation is None else p.correlation for p in points]
    numbers: dict[tuple[float, int], int] = {}
    which = [numbers.setdefault(key, len(numbers)) for side in points for key in _contacts(side)]
    readings = replace(
        points[0],
        **both,
        flat=block_diag(*(side.flat for side in points)),
        correlation=block_diag(*own),
        contacts=np.eye(len(numbers))[which],
    )
    columns = [dict(side.columns) for side in predicted]
    if "apparatus" in columns[1]:
        columns[1]["apparatus_shear"] = columns[1].pop("apparatus")
    sources = {name: c.shape[-1] for side in columns for name, c in side.items()}

    def padded(name: str) -> FloatArray:
        empty = [np.zeros((*side.signal.shape, sources[name])) for side in predicted]
        pairs = zip(columns, empty, strict=True)
        return np.concatenate([side.get(name, nothing) for side, nothing in pairs], axis=1)

    arrays = ("signal", "by_load", "by_coordinate", "slope")
    return readings, Predicted(
        **{name: np.concatenate([getattr(p, name) for p in predicted], axis=1) for name in arrays},
        columns={name: padded(name) for name in sources},
    )


def _contacts(points: LoadPoints) -> Iterator[tuple[float, int]]:
    """Name the contact of each reading: its place, and which of those there it is."""
    count: Counter[float] = Counter()
    for place in np.round(points.offset, 12).tolist():
        yield place, count[place]
        count[place] += 1


def standardise(points: LoadPoints, predicted: Predicted) -> Standardised:
    """Divide by the noise, and project out what is flat."""
    kinds = {
        "noise": np.broadcast_to(points.noise, predicted.signal.shape),
        "load_scatter": predicted.by_load * points.load_errors,
        "position": predicted.slope * points.side * points.x_errors,
    }
    kinds = {name: kind for name, kind in kinds.items() if kind.any()}
    whitener = _whitener(points, kinds)
    flat = np.broadcast_to(points.flat, (*predicted.signal.shape, points.flat.shape[1]))
    if points.free_centre:
        flat = np.concatenate([flat, (predicted.slope * points.side)[..., None]], axis=-1)
    basis, triangle = np.linalg.qr(_times(whitener, flat))

    def projected(values: FloatArray) -> FloatArray:
        scaled = _times(whitener, values if values.ndim == 3 else values[..., None])
        left = scaled - basis @ (np.swapaxes(basis, -1, -2) @ scaled)
        return left if values.ndim == 3 else left[..., 0]

    diagonal = np.abs(np.diagonal(triangle, axis1=-2, axis2=-1))
    pivots = whitener if whitener.ndim == 2 else np.diagonal(whitener, axis1=-2, axis2=-1)
    return Standardised(
        residual=projected(points.u - predicted.signal),
        slope=projected(predicted.by_coordinate),
        columns={source: projected(column) for source, column in predicted.columns.items()},
        points=points,
        kinds=kinds,
        volume=2 * np.log(diagonal).sum(axis=-1) - 2 * np.log(pivots).sum(axis=-1),
        degrees=points.degrees,
    )


def _whitener(points: LoadPoints, kinds: Mapping[str, FloatArray]) -> FloatArray:
    """Inverse root of N, shape (V, n) where it is diagonal, else (V, n, n)."""
    if points.correlation is None:
        return np.asarray(1 / np.sqrt(np.sum([kind**2 for kind in kinds.values()], axis=0)))
    covariance = np.outer(points.noise, points.noise) * points.correlation
    rows = np.stack([np.zeros_like(kinds["noise"]), *(kinds[k] for k in kinds if k != "noise")])
    same = np.eye(points.u.size) if points.contacts is None else points.contacts @ points.contacts.T
    extra = np.einsum("svn,svm->vnm", rows, rows) * same
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance + extra)))


def _times(whitener: FloatArray, values: FloatArray) -> FloatArray:
    return whitener[..., None] * values if whitener.ndim == 2 else whitener @ values


def _scaled(whitener: FloatArray, points: LoadPoints, name: str, kind: FloatArray) -> FloatArray:
    """Root of one kind of noise in the units of all of it."""
    if whitener.ndim == 2:
        return whitener * kind
    if name != "noise" or points.correlation is None:
        root = whitener * kind[:, None, :]
        return root if points.contacts is None else root @ points.contacts
    return whitener @ (points.noise[:, None] * np.linalg.cholesky(points.correlation))


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Likelihood of one load or several along V values of one parameter."""

    values: FloatArray
    coordinates: FloatArray
    loads: tuple[Standardised, ...]
    tables: Tables  # what each load tells, as chi-square and the evidence of laws are made of

    def only(self, chosen: Sequence[int]) -> Likelihood:
        """Return the likelihood of some of the loads."""
        loads = tuple(self.loads[i] for i in chosen)
        return replace(self, loads=loads, tables=self.tables.only(chosen))

    def beside(self, held: Likelihood) -> Likelihood:
        """Add loads whose parameter is held at their first value; all share systematic errors."""
        loads = (*self.loads, *(load.held(self.values.size) for load in held.loads))
        return replace(self, loads=loads, tables=_tables(loads))

    @property
    def degrees(self) -> int:
        """Points less flat parameters; the parameter itself is not counted."""
        return sum(load.degrees for load in self.loads)

    @cached_property
    def chi_square(self) -> FloatArray:
        """Least chi-square over all nuisances, shape (V,)."""
        return self._logs[1]

    @property
    def deviance(self) -> FloatArray:
        r""":math:`-2 \ln p(u | \theta)`, (V,): the noise depends on the value, by loads, too."""
        # Chi-square alone would prefer the value with the larger error bars.
        return -2 * self._logs[0]

    @cached_property
    def _logs(self) -> tuple[FloatArray, FloatArray]:
        logs, chi_square = log_likelihood(self.tables.together())
        return logs[:, 0], chi_square[:, 0]

    @cached_property
    def information(self) -> FloatArray:
        """Inverse variance of the bounded coordinate that the likelihood's slope tells, (V,)."""
        slope = np.concatenate([load.slope for load in self.loads], axis=1)
        return np.asarray(np.einsum("vn,vn->v", slope, self._inverse_times(slope)))

    def budget(self, index: int) -> dict[str, float]:
        """Contribution of each source to the coordinate's uncertainty: their squares add up."""
        slope = np.concatenate([load.slope for load in self.loads], axis=1)
        information = float(self.information[index])
        if not information > 0:
            return {}
        # The gain by which the best coordinate follows the voltages.
        gain = self._inverse_times(slope)[index] / information
        shares: dict[str, float] = {}
        pieces = np.split(gain, np.cumsum([load.residual.shape[1] for load in self.loads])[:-1])
        for piece, load in zip(pieces, self.loads, strict=True):
            for name, root in load.noises(index).items():
                share = root * piece if root.ndim == 1 else root.T @ piece
                shares[name] = float(np.hypot(shares.get(name, 0.0), np.linalg.norm(share)))
        columns = self._systematic[0][index]
        start = 0
        for source, width in _widths(self.loads).items():
            shares[source] = float(np.linalg.norm(gain @ columns[:, start : start + width]))
            start += width
        return shares

    @cached_property
    def _systematic(self) -> tuple[FloatArray, FloatArray]:
        """Columns of all sources, shape (V, n, q), and the inverse of 1 + D^T D."""
        columns = np.concatenate(_columns(self.loads), axis=1)
        grip = np.swapaxes(columns, -1, -2) @ columns
        return columns, np.asarray(np.linalg.inv(grip + np.eye(columns.shape[-1])), np.float64)

    def _inverse_times(self, values: FloatArray) -> FloatArray:
        """C^-1 times vectors (V, n), by Woodbury's identity."""
        columns, inverse = self._systematic
        pull = np.swapaxes(columns, -1, -2) @ values[..., None]
        return np.asarray(values - (columns @ (inverse @ pull))[..., 0])


def _widths(loads: Sequence[Standardised]) -> dict[str, int]:
    """Return the number of systematic columns of each source."""
    every = (item for load in loads for item in load.columns.items())
    return {source: columns.shape[-1] for source, columns in every}


def _columns(loads: Sequence[Standardised]) -> list[FloatArray]:
    """Return all sources' columns (V, n, q) of each load, zero where it does not know a source."""
    widths = _widths(loads)
    stacked = []
    for load in loads:
        shape = load.residual.shape
        columns = [load.columns.get(name, np.zeros((*shape, q))) for name, q in widths.items()]
        stacked.append(np.concatenate([np.zeros((*shape, 0)), *columns], axis=-1))
    return stacked


def _tables(loads: Sequence[Standardised]) -> Tables:
    columns = _columns(loads)
    pairs = zip(columns, loads, strict=True)
    pulls = [(load.residual[:, None] @ column)[:, 0] for column, load in pairs]
    return Tables(
        squares=np.stack([np.sum(load.residual**2, axis=-1) for load in loads], axis=1),
        pulls=np.stack(pulls, axis=1),
        grips=np.stack([np.swapaxes(column, -1, -2) @ column for column in columns], axis=1),
        volumes=np.stack([load.volume for load in loads], axis=1),
    )


@dataclass(frozen=True, eq=False)
class Channel:
    """What one channel of a sensor reads of several loads."""

    points: Sequence[LoadPoints]
    sensor: Sensor
    family: ProfileFamily

    def only(self, chosen: Sequence[int]) -> Channel:
        """Return some of the loads."""
        return replace(self, points=[self.points[i] for i in chosen])


def likelihood(
    points: Sequence[LoadPoints],
    sensor: Sensor,
    members: ProfileFamily,
    loads: Sequence[int],
    shear: Channel | None = None,
) -> Likelihood:
    """Return the likelihood of loads, each with the index of its load in the family."""
    readings = [
        (of_load, predict(of_load, sensor, members, load))
        for of_load, load in zip(points, loads, strict=True)
    ]
    if shear is not None:
        sheared = shear.family.at(members.values)
        readings = [
            stacked(reading, (of_load, predict(of_load, shear.sensor, sheared, load)))
            for reading, of_load, load in zip(readings, shear.points, loads, strict=True)
        ]
    standardised = tuple(standardise(*reading) for reading in readings)
    return Likelihood(members.values, members.coordinates, standardised, _tables(standardised))
