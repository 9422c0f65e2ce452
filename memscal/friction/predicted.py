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
from memscal.friction.family import ProfileFamily
from memscal.friction.load_points import LoadPoints
from memscal.measurement.posterior import apparatus_changes, sensor_transfer
from memscal.model.validation import FloatArray

__all__ = ["Members", "Predicted", "Sensor", "members_of", "predict", "sensor_of"]

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
