r"""What a sensor reads of calculated contacts, with what it changes by: A G against a family.

At a distance R from the centre, and for a load :math:`P` about the nominal :math:`P_j`,

.. math:: u = A\,(G \otimes \sigma)(R) + A\,\frac{\partial (G \otimes \sigma)}{\partial \ln P}
    \ln\frac{P}{P_j}.

Of a tangential channel it is the component of a vector field, by transforms of order one, and
changes its sign with the side of the centre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0, j1

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.errors import InputError
from memscal.friction.family import ProfileFamily
from memscal.measurement.posterior import apparatus_changes, sensor_transfer
from memscal.model.arrays import FloatArray
from memscal.model.measured_stress import MeasuredProfile

__all__ = [
    "LoadPoints",
    "Members",
    "Predicted",
    "Sensor",
    "load_points",
    "members_of",
    "predict",
    "sensor_of",
    "single_point",
]


@dataclass(frozen=True, eq=False)
class LoadPoints:
    """Voltages of one load of one scan, and what is known about each.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Voltage, in V.
    offset : ndarray, shape (n,)
        Position from the centre that was found, along the scan, in m.
    log_load : ndarray, shape (n,)
        Logarithm of the point's load over the nominal one.
    noise : ndarray, shape (n,)
        Standard deviation of the electronic noise, in V; outliers' is larger.
    load_errors : ndarray, shape (n,)
        Standard uncertainty of each load over the nominal one, independent from point to point.
    x_errors : ndarray, shape (n,)
        Standard uncertainty of each position, in m.
    flat : ndarray, shape (n, d)
        Columns of baseline and drift: of unknown size.
    free_centre : bool
        Whether the centre is to be found with them.
    load_share, position_share : float
        Relative standard uncertainty of all loads, and of the stage's scale.
    correlation : ndarray, shape (n, n), or None
        Correlation of the electronic noise.
    """

    u: FloatArray
    offset: FloatArray
    log_load: FloatArray
    noise: FloatArray
    load_errors: FloatArray
    x_errors: FloatArray
    flat: FloatArray
    free_centre: bool = True
    load_share: float = 0.0
    position_share: float = 0.0
    correlation: FloatArray | None = None

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
        places, back = np.unique(np.round(self.offset, 12), return_inverse=True)
        mean = np.zeros((places.size, self.u.size))
        mean[back, np.arange(self.u.size)] = 1.0
        mean /= mean.sum(axis=1, keepdims=True)
        inner = np.eye(self.u.size) if self.correlation is None else self.correlation
        covariance = mean @ (np.outer(self.noise, self.noise) * inner) @ mean.T
        noise = np.sqrt(np.diag(covariance))
        return replace(
            self,
            u=mean @ self.u,
            offset=places,
            log_load=mean @ self.log_load,
            noise=noise,
            load_errors=np.sqrt(mean**2 @ self.load_errors**2),
            # The stage errs alike in every repeat.
            x_errors=mean @ self.x_errors,
            flat=mean @ self.flat,
            correlation=None if self.correlation is None else covariance / np.outer(noise, noise),
        )


def load_points(profile: MeasuredProfile, channel: str = "zz") -> LoadPoints:
    """Return the points of a measured profile, with the noise that is stated, or was estimated.

    A stated noise is taken at its word: raised by a misfit, it would hide it.

    Raises
    ------
    InputError
        If the profile holds no points of the channel, or not their noise.
    """
    points = profile.points.get(channel)
    if points is None:
        raise _missing(profile, channel)
    if points.noise is None:
        raise InputError(
            f"{profile.label}: u_{channel} is there, but not its noise, u_{channel}_errors.",
            why="Contacts are told apart by a chi-square.",
            cure=f"State the electronic noise of u_{channel}.",
        )
    position = (points.x, points.y)[profile.axis]
    return LoadPoints(
        u=points.u,
        offset=position - float(profile.centre[profile.axis]),
        log_load=np.log(points.load / profile.load),
        noise=np.asarray(points.noise / np.sqrt(points.weight)),
        load_errors=points.load_errors / profile.load,
        x_errors=points.x_errors,
        flat=np.stack([np.ones_like(position), _unit_range(position)], axis=1),
        load_share=(profile.load_uncertainty or 0.0) / profile.load,
        position_share=profile.scan.position_scale_uncertainty or 0.0,
        correlation=points.correlation,
    )


def _missing(profile: MeasuredProfile, channel: str) -> InputError:
    """Say why a profile holds no points of a channel."""
    if not profile.points:
        return InputError(
            f"{profile.label}: the measured stress holds no measured points.",
            why="Its file is of version 1.0, which kept the profiles alone.",
            cure="Make it again with memscal apply, or give the scans.",
        )
    return InputError(
        f"{profile.label}: the measured stress holds no usable voltage u_{channel}.",
        why="The scan has none, or it does not change, or the scan does not run along "
        f"{channel[0]}: across it the shear is zero.",
        cure=f"Give a line scan along {channel[0]} through the sensor, with u_{channel}.",
    )


def single_point(u: float, noise: float, like: LoadPoints) -> LoadPoints:
    """Return the signal on the axis as the only point, with the uncertainties of others."""
    nothing = np.zeros(1)
    return LoadPoints(
        u=np.array([u]),
        offset=nothing,
        log_load=nothing,
        noise=np.array([noise]),
        load_errors=nothing,
        x_errors=nothing,
        flat=np.zeros((1, 0)),
        free_centre=False,
        load_share=like.load_share,
        position_share=like.position_share,
    )


def _unit_range(position: FloatArray) -> FloatArray:
    middle = (position.max() + position.min()) / 2
    return np.asarray((position - middle) / (np.ptp(position) / 2))


#: Directions in which A G changes the signal by less than this share of its worst are dropped.
_UNFELT = 1e-4
#: Radii at which that is judged.
_RADII = 64


@dataclass(frozen=True, eq=False)
class Sensor:
    """A sensor at the nodes of a family.

    ``transfer`` (K,): transform of A G, in V/Pa; ``changes`` (K, q): its independent changes by
    one standard uncertainty; ``conversion_constant``: A, in V/Pa; ``order``: zero, or one of a
    tangential channel.
    """

    wavenumbers: Wavenumbers
    transfer: FloatArray
    changes: FloatArray
    conversion_constant: float
    order: int = 0

    @property
    def of_shape(self) -> Sensor:
        """The sensor with the changes of A G that those of G alone bring: its integral stays."""
        of_conversion = [RadialSpectrum(self.wavenumbers, c).integral for c in self.changes.T]
        scaled = np.outer(self.transfer, of_conversion) / self.conversion_constant
        return replace(self, changes=self.changes - scaled.reshape(self.changes.shape))


@dataclass(frozen=True, eq=False)
class Members:
    """Members of a family at V values: transforms of shape (V, L, K), in N.

    Fields as in :class:`memscal.friction.family.FamilyMember`; ``coordinates`` (V,).
    """

    values: FloatArray
    coordinates: FloatArray
    spectra: FloatArray
    by_load: FloatArray
    by_coordinate: FloatArray
    changes: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Predicted:
    """Voltages of the points of one load at V values of a family's parameter.

    Parameters
    ----------
    signal : ndarray, shape (V, n)
        A G convolved with the base stress at the point's load, in V.
    by_load, by_coordinate : ndarray, shape (V, n)
        Its derivatives by the logarithm of the load and by the bounded coordinate, in V.
    slope : ndarray, shape (V, n)
        Its derivative by the distance from the centre, in V/m.
    columns : mapping of str to ndarray, shape (V, n, q)
        Its changes by one standard uncertainty of each systematic source, in V.
    """

    signal: FloatArray
    by_load: FloatArray
    by_coordinate: FloatArray
    slope: FloatArray
    columns: Mapping[str, FloatArray]


def members_of(family: ProfileFamily, values: FloatArray) -> Members:
    """Return a family's members at values (V,) of its parameter."""
    found = [family.at(float(value)) for value in values]
    return Members(
        values=np.asarray(values, dtype=np.float64),
        coordinates=np.array([family.coordinate(float(value)) for value in values]),
        spectra=np.stack([member.spectra for member in found]),
        by_load=np.stack([member.by_load for member in found]),
        by_coordinate=np.stack([member.by_coordinate for member in found]),
        changes={
            source: np.stack([member.changes[source] for member in found])
            for source in family.changes
        },
    )


def sensor_of(apparatus: ApparatusFunction, family: ProfileFamily, reach: float) -> Sensor:
    """Return a sensor at a family's nodes, with the changes of A G that its stresses feel.

    Any rotation of independent changes is another set of them: one is taken in which few matter.
    """
    nodes = family.wavenumbers
    middle = family.spectra[family.values.size // 2]
    changes = apparatus_changes(apparatus, nodes.k)
    bessel = j1 if family.order else j0
    kernel = bessel(np.multiply.outer(np.linspace(0.0, reach, _RADII), nodes.k)) * nodes.weights
    largest = np.abs(middle).max(axis=1) if family.order else middle[:, 0]
    shapes = middle / largest[:, None]
    felt = np.concatenate([(kernel * row) @ changes for row in shapes])
    if changes.shape[1]:
        _, sizes, axes = np.linalg.svd(felt, full_matrices=False)
        changes = changes @ axes[sizes > _UNFELT * sizes[0]].T
    a = apparatus.conversion_constant
    return Sensor(nodes, a * sensor_transfer(apparatus, nodes.k), changes, a, family.order)


def predict(points: LoadPoints, sensor: Sensor, members: Members, load: int) -> Predicted:
    """Return what the sensor reads at the points of one load, by the load's index."""
    bessel = _Bessel(points.radius, sensor.wavenumbers)
    if sensor.order:
        bessel = _VectorBessel(points.radius, sensor.wavenumbers, np.sign(points.offset))
    spectra, transfer = members.spectra[:, load], sensor.transfer
    by_load = bessel.values(transfer * members.by_load[:, load])
    slope = bessel.slopes(transfer * spectra)
    felt = [bessel.values(change * spectra) for change in sensor.changes.T]
    columns = {"apparatus": np.stack(felt, axis=-1)} if felt else {}
    for source, change in members.changes.items():
        columns[source] = bessel.values(transfer * change[:, load])[..., None]
    columns["load"] = (points.load_share * by_load)[..., None]
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
    """Inverse transforms at distances (n,) in m, and their slopes; repeats share theirs."""

    radius: FloatArray
    wavenumbers: Wavenumbers

    def values(self, spectra: FloatArray) -> FloatArray:
        """Values of transforms (V, K) at the distances, shape (V, n)."""
        return np.asarray((spectra @ self._even.T)[:, self._unique[1]])

    def slopes(self, spectra: FloatArray) -> FloatArray:
        """Their derivatives by the distance, shape (V, n)."""
        return np.asarray((spectra @ self._odd.T)[:, self._unique[1]])

    @cached_property
    def _unique(self) -> tuple[FloatArray, NDArray[np.intp]]:
        return np.unique(self.radius, return_inverse=True)

    @cached_property
    def _even(self) -> FloatArray:
        phase = np.multiply.outer(self._unique[0], self.wavenumbers.k)
        return np.asarray(j0(phase) * self.wavenumbers.weights)

    @cached_property
    def _odd(self) -> FloatArray:
        phase = np.multiply.outer(self._unique[0], self.wavenumbers.k)
        return np.asarray(-j1(phase) * self.wavenumbers.weights * self.wavenumbers.k)


@dataclass(frozen=True, eq=False)
class _VectorBessel(_Bessel):
    """The same of a vector's component, of order one; ``sign`` (n,): the side of the centre."""

    sign: FloatArray

    def values(self, spectra: FloatArray) -> FloatArray:
        return np.asarray(self.sign * super().values(spectra))

    def slopes(self, spectra: FloatArray) -> FloatArray:
        return np.asarray(self.sign * super().slopes(spectra))

    @cached_property
    def _even(self) -> FloatArray:
        phase = np.multiply.outer(self._unique[0], self.wavenumbers.k)
        return np.asarray(j1(phase) * self.wavenumbers.weights)

    @cached_property
    def _odd(self) -> FloatArray:
        phase = np.multiply.outer(self._unique[0], self.wavenumbers.k)
        turn = np.divide(j1(phase), phase, out=np.full_like(phase, 0.5), where=phase > 0)
        return np.asarray((j0(phase) - turn) * self.wavenumbers.weights * self.wavenumbers.k)
