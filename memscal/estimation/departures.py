r"""Departures from a Gaussian apparatus function: kernels, and their voltages in a reduced scan.

A departure is a sum of rings of radius q, blurred by a Gaussian of width b, with random
amplitudes; each has a closed form on both sides of the Hankel transform,

.. math::

    a\,(\delta_q \otimes g_b)(r) = \frac{a}{2\pi b^2}\,e^{-(r^2+q^2)/2b^2} I_0(rq/b^2),
    \qquad a\,J_0(kq)\,e^{-b^2k^2/2} .

Lengths are in units of the width of the best Gaussian; the strength is the expected size over the
Gaussian's, both as L2 norms over the plane.  Families (blurred discs, wide tails, rings) are no
small departures: the sensor of each that fits best stands in the Gaussian's place.  A scan is
reduced to as few rows as its model has columns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from memscal.axisymmetry import kernels
from memscal.axisymmetry.kernels import Rings
from memscal.estimation.angular import AngularDepartures, AngularRings
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.estimation.plane import PlaneDepartures, Spots
from memscal.estimation.voltage_map import SINGLE, Tall, VoltageMap, orthonormalised
from memscal.model.arrays import ArrayPair, FloatArray, array_record, value_record

#: Neighbouring rings overlap: this share of their blur apart.
_SPACING = 0.7
_FEWEST_RINGS = 6
#: A field is cut at this multiple of its extent, where its envelope has fallen to 1e-5.
_REACH = 2.2
_SCALES = 12


@value_record
class Shape:
    """A kind of departure, in units of the Gaussian's width."""

    name: str
    blur: float  # finest width of its components
    extent: float  # of a field, the radius where its envelope falls; of scales, the largest width
    scales: bool = False  # Gaussians of all widths from blur to extent, not rings of one blur

    def rings(self, width: float, amplitude: float) -> Rings:
        """Components about a Gaussian of a width (m) and amplitude (V/Pa), by its L2 norm."""
        # In units of the width at first.
        if self.scales:
            blur = np.geomspace(self.blur, self.extent, _SCALES)
            plain = Rings(np.zeros(_SCALES), blur, np.ones(_SCALES))
        else:
            reach = _REACH * self.extent
            count = max(_FEWEST_RINGS, math.ceil(reach / (_SPACING * self.blur)))
            q = (np.arange(count) + 0.5) * reach / count
            envelope = np.sqrt(q) * np.exp(-0.5 * (q / self.extent) ** 4)
            plain = Rings(q, np.full(count, self.blur), envelope)
        gaussian = 1 / (2 * np.sqrt(np.pi))
        size = amplitude * (plain.amplitude * gaussian / plain.size)
        return Rings(width * plain.radius, width * plain.blur, size)


#: Edges (a disc, a plateau), a core (a ring, a spike), and tails.
SHAPES = (
    Shape("edge", 0.65, 0.8),
    Shape("edge", 0.65, 1.2),
    Shape("rough edge", 0.4, 0.8),
    Shape("rough edge", 0.4, 1.2),
    Shape("rough edge", 0.5, 0.8),
    Shape("rough edge", 0.5, 1.2),
    Shape("core", 0.3, 2.0, scales=True),
    Shape("tail", 0.85, 1.8),
    Shape("tail", 0.85, 3.0),
)


@value_record
class Family:
    """Sensors that no departure from a Gaussian resembles: blurred discs, wide tails, rings."""

    name: str
    share: float  # of the disc in the mean square radius; of the second Gaussian in the integral
    spread: float  # standard deviation of the share within the family
    ratio: float = 0.0  # of the second Gaussian's width to the first's; none of a disc


#: Shares of discs and their spreads, about half the way to the next share.
_DISCS = ((0.35, 0.2), (0.6, 0.2), (0.8, 0.12), (0.92, 0.08), (0.98, 0.04))
FAMILIES = (
    *(Family("disc", share, spread) for share, spread in _DISCS),
    *(Family("wide tail", 0.15, 0.08, ratio) for ratio in (2.0, 2.4, 2.9)),
    Family("wide tail", 0.35, 0.12, 2.0),
    Family("ring", -0.3, 0.15, 0.5),
)
#: Step in ln(width) of the derivative by it.
_RELATIVE_STEP = 1e-3


class Side(NamedTuple):
    """Functions of wavenumber, or of radius, of a width: all kernels are made of them."""

    gaussian: Callable[..., FloatArray]
    slope: Callable[..., FloatArray]  # by the width
    disc: Callable[..., FloatArray]
    rings: Callable[[Rings, FloatArray], FloatArray]


_TRANSFORMS = Side(
    kernels.gaussian_transfer,
    kernels.gaussian_transfer_slope,
    kernels.disc_transfer,
    Rings.transform,
)
_PROFILES = Side(
    kernels.unit_gaussian, kernels.unit_gaussian_slope, kernels.blurred_disc, Rings.radial
)


def _sensors(
    families: Sequence[Family],
    width: FloatArray,
    place: FloatArray,
    side: Side,
    offset: float = 0.0,
) -> FloatArray:
    """G of families for widths (m,), the shares off by some of their spreads: (place, m)."""
    share, spread, ratio = np.array([[f.share, f.spread, f.ratio] for f in families]).T
    share = share + offset * spread
    disc = ratio == 0
    x = place[:, None]
    columns = np.empty((place.size, width.size))
    core = width[disc]
    radius = 2 * core * np.sqrt(share[disc])
    columns[:, disc] = side.disc(x, radius, core * np.sqrt(1 - share[disc]))
    first = side.gaussian(x, width[~disc])
    second = side.gaussian(x, (ratio * width)[~disc])
    columns[:, ~disc] = (1 - share[~disc]) * first + share[~disc] * second
    return columns


@array_record
class FamilyFit:
    """The sensor of a family that fits the scan best."""

    family: Family
    conversion_constant: float  # in V/Pa
    width: float  # in m


@array_record
class ReducedScan:
    """Standardised voltages and their derivatives, Q' times those at the points (n), (r, ...)."""

    # Q is orthonormal and spans voltages and all columns, so that sums of squares are those of the
    # points.  Of few points it is the unit matrix.
    model: ForwardModel
    fit: GaussianFit
    data: FloatArray  # (r,): voltages that the fit leaves over
    flat: FloatArray  # (r, p): by the parameters of the fit
    components: FloatArray  # (r, a): of what is not round: angular rings, or spots in the plane
    weights: FloatArray  # (n,)
    synthesis: FloatArray | None  # (r, nodes): of kernels by their transforms
    right: Tall | None  # (n, r): the transposed standardisation of Q

    @classmethod
    def of(
        cls,
        model: ForwardModel,
        fit: GaussianFit,
        weights: FloatArray,
        components: AngularRings | Spots | None = None,
    ) -> ReducedScan:
        """Reduce a scan with weights (n,), with components of what is not round, or without."""
        points = model.points
        first = [(points.u - fit.predicted)[:, None], fit.jacobian]
        if components:
            first.append(components.signal(model, fit.centre))
        columns, mix = model.framed(fit.geometry, first)
        columns = points.standardised(columns, weights, out=columns)
        right = None
        last = columns.shape[1]
        synthesis = None
        if mix is not None:
            columns, reduced = orthonormalised(columns)
            last -= len(mix)
            synthesis = reduced[:, last:] @ mix
            right = points.unstandardise(columns, weights)
            right = right.astype(np.float32) if len(right) > SINGLE else right
            columns = reduced
        parts = columns[:, 0], columns[:, 1 : 1 + fit.count], columns[:, 1 + fit.count : last]
        return cls(model, fit, *parts, weights, synthesis, right)

    def signal(self, kernels: FloatArray) -> FloatArray:
        """Voltages (r, m) of round kernels by their transforms, (nodes, m)."""
        if self.synthesis is not None:
            return self.synthesis @ kernels
        voltages = self.model.signal(self.fit.geometry, kernels)
        return self.model.points.standardised(voltages, self.weights)

    def residual(self, basis: DepartureBasis, mean: FloatArray) -> FloatArray:
        """Voltages (n,) that a combination (p,) of all columns does not explain, in V."""
        model = self.model
        return model.points.u - self.fit.predicted - basis.voltages(model, self.fit, mean)

    def by_voltages(self, gain: FloatArray) -> VoltageMap:
        """Derivatives by the voltages (m, n) of numbers with these by the reduced data, (m, r)."""
        if self.right is not None:
            return VoltageMap(((gain, self.right),))
        right = self.model.points.unstandardise(gain.T.copy(), self.weights)
        return VoltageMap(((np.eye(len(gain)), right),))


#: At so many sets of wavenumbers or radii a basis keeps its columns.
_KEPT = 4


@array_record
class DepartureBasis:
    """The kernels that an estimate is a combination of, about the best Gaussian."""

    conversion_constant: float  # the Gaussian, in V/Pa and m
    sigma: float
    flat: int  # how many parameters have no prior: A, width, centre, baseline and drift
    rings: tuple[Rings, ...]  # the components of each of :data:`SHAPES`
    families: tuple[FamilyFit, ...]  # as many as fit the scan
    # The last flat ones: theirs is a prior of unit variance.
    angular: AngularDepartures | PlaneDepartures | None
    _tables: dict[tuple[Side, bytes], FloatArray] = field(default_factory=dict, init=False)

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Columns of each shape, then of each family: its sensor less the Gaussian, changes."""
        counts = [*(ring.radius.size for ring in self.rings), *(3 for _ in self.families)]
        ends = self.flat + np.cumsum([0, *counts])
        return tuple(slice(a, b) for a, b in pairwise(ends))

    def kernels(self, k: FloatArray) -> FloatArray:
        """Transforms of all columns at ``k`` (rad/m), shape (k, p)."""
        return self._at(k, _TRANSFORMS)

    def radial(self, r: FloatArray) -> FloatArray:
        """Values of all columns at radii ``r`` (m), shape (r, p)."""
        return self._at(r, _PROFILES)

    def columns(self, reduced: ReducedScan) -> FloatArray:
        """Voltages of all columns, standardised, of a reduced scan, (r, p)."""
        around = [self.angular.combined(reduced.components)] if self.angular else []
        kernels = self.kernels(reduced.model.k)[:, self.flat :]
        return np.hstack([reduced.flat, *around, reduced.signal(kernels)])

    def voltages(
        self, model: ForwardModel, fit: GaussianFit, coefficients: FloatArray
    ) -> FloatArray:
        """Voltages at the points of combinations of all columns, (p,) or (p, m): (n,) or (n, m)."""
        # Coefficients are few: of a million points there is no room for all columns.
        volts = fit.jacobian @ coefficients[: fit.count]
        if self.angular:
            angular = coefficients[fit.count : self.flat].reshape(self.angular.count, -1)
            volts += self.angular.signal(model, fit.centre, angular).reshape(volts.shape)
        kernels = self.kernels(model.k)[:, self.flat :]
        return volts + model.signal(fit.geometry, kernels @ coefficients[self.flat :])

    @cached_property
    def integrals(self) -> FloatArray:
        """Integrals of all columns over the plane, shape (p,)."""
        return np.asarray(self.kernels(np.zeros(1))[0])

    def _at(self, place: FloatArray, side: Side) -> FloatArray:
        """All columns at wavenumbers or radii; those of the last few are kept."""
        key = side, place.tobytes()
        if key not in self._tables:
            if len(self._tables) == _KEPT:
                self._tables.clear()
            # The first two are by A and width; parameters that move no kernel hold zeros.
            gaussian, slope = self._sensor(place, side)
            count = self.angular.count if self.angular else 0
            none = np.zeros((place.size, self.flat - count - 2))
            parts = [gaussian[:, None], slope[:, None], none]
            if self.angular:
                parts.append(self.angular.mean(side.rings, place))
            parts += [side.rings(rings, place) for rings in self.rings]
            if self.families:
                parts.append(self._families(gaussian[:, None], place, side))
            table = np.hstack(parts)
            table.flags.writeable = False
            self._tables[key] = table
        return self._tables[key]

    def _sensor(self, place: FloatArray, side: Side) -> ArrayPair:
        """Columns by A and width of the sensor that the others depart from."""
        slope = self.conversion_constant * side.slope(place, self.sigma)
        return side.gaussian(place, self.sigma), slope

    def _families(self, gaussian: FloatArray, place: FloatArray, side: Side) -> FloatArray:
        """Three columns of each: less the Gaussian; changes by ln(width), the share's spread."""
        families = [fit.family for fit in self.families]
        widths = np.array([fit.width for fit in self.families])
        a = np.array([fit.conversion_constant for fit in self.families])
        sensor = a * _sensors(families, widths, place, side)
        wider = a * _sensors(families, (1 + _RELATIVE_STEP) * widths, place, side)
        less = a * _sensors(families, widths, place, side, offset=-1.0)
        change = (wider - sensor) / _RELATIVE_STEP
        columns = [sensor - self.conversion_constant * gaussian, change, sensor - less]
        return np.stack(columns, axis=2).reshape(place.size, -1)


def departure_basis(
    fit: GaussianFit,
    reduced: ReducedScan | None = None,
    angular: AngularDepartures | PlaneDepartures | None = None,
) -> DepartureBasis:
    """Return the kernels of the fit's own parameters and of every shape about it."""
    # With the scan as reduced about the fit, of the families' best fits, too.
    rings: tuple[Rings, ...] = ()
    families: tuple[FamilyFit, ...] = ()
    if not isinstance(angular, PlaneDepartures):
        rings = tuple(shape.rings(fit.width, fit.conversion_constant) for shape in SHAPES)
        families = tuple(_fitted_families(reduced)) if reduced else ()
    flat = fit.count + (angular.count if angular else 0)
    return DepartureBasis(fit.conversion_constant, fit.sigma, flat, rings, families, angular)


#: Steps in ln(width) end below the first, are cut at the second; beyond the third factor from the
#: Gaussian's width a family does not fit the scan.
_FAMILY_ROUNDS = 8
_SETTLED = 1e-3
_LONGEST = 0.3
_FARTHEST = 2.5


def _fitted_families(reduced: ReducedScan) -> Iterator[FamilyFit]:
    """Fit A and width of every family, centre, baseline and drift by the way."""
    fit = reduced.fit
    start = fit.width
    k = reduced.model.k
    step = _RELATIVE_STEP
    rows, left = fit.prior
    others = np.linalg.qr(np.vstack([reduced.flat, rows])[:, 2:])[0]
    gaussian = fit.conversion_constant * kernels.gaussian_transfer(k, fit.sigma)
    data = reduced.data + reduced.signal(gaussian)
    data = np.append(data, left)
    data = data - others @ (others.T @ data)
    widths = np.full(len(FAMILIES), start)
    for _ in range(_FAMILY_ROUNDS):
        both = _sensors(2 * FAMILIES, np.append(widths, (1 + step) * widths), k, _TRANSFORMS)
        voltages = np.pad(reduced.signal(both), ((0, left.size), (0, 0)))
        signal, wider = np.hsplit(voltages - others @ (others.T @ voltages), 2)
        # Least squares in A and A d ln(width), of all families at once.
        columns = np.stack([signal, (wider - signal) / step]).T
        amplitudes, moved = (np.linalg.pinv(columns) @ data).T
        growth = np.clip(moved / amplitudes, -_LONGEST, _LONGEST)
        widths = widths * np.exp(growth)
        if abs(growth).max() < _SETTLED:
            break
    for family, width, amplitude in zip(FAMILIES, widths, amplitudes, strict=True):
        if amplitude > 0 and start / _FARTHEST < width < start * _FARTHEST:
            yield FamilyFit(family, amplitude, width)
