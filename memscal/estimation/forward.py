r"""Forward model in data space: voltages at the scan's points for a given G.

A radial kernel :math:`K` of transform :math:`\hat K(k)` gives, at distance :math:`R` from
the sensor's centre and per newton,

.. math::

    (K \otimes \sigma_{zz})(R) = \frac{1}{2\pi}\int \hat K(k)\,\hat\sigma(k)\,J_0(kR)\,k\,dk.

With a tangential channel it is one component of a radial vector field, of order one: for the base
shear :math:`\tau(r)\,\hat r` and the angle :math:`\theta` between the component and the way from
the sensor to the indenter,

.. math::

    (K \otimes \tau\,\hat r)_x = \cos\theta\,\frac{1}{2\pi}\int
    \hat K(k)\,\hat\tau(k)\,J_1(kR)\,k\,dk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.special import ive, j1

from memscal.axisymmetry.hankel import ACROSS, RadialSpectrum, bessel, quotient, radial_spline
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.points import ScanPoints
from memscal.estimation.voltage_map import BLOCK, DENSE
from memscal.extensions import hook
from memscal.model.arrays import (
    ArrayPair,
    ArrayTriple,
    BoolArray,
    FloatArray,
    array_record,
    floats,
    slices,
)
from memscal.model.sizes import too_large

if TYPE_CHECKING:
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_array

#: Above :data:`DENSE` points of lines, no more waves are decomposed: minutes and gigabytes.
_MOST_WAVES = 1000
#: In place of the order of a Bessel function: J_1(x)/x.
TURN = -1
#: Phase (rad) of the last wavenumber from one radius of a table to the next, and its splines: right
#: to 4e-10.
_TABLE_PHASE = 0.4
_DEGREE = 7
#: Few points read a table where its last phase (rad) is less.
_LONGEST_PHASE = 500.0
#: Radii of a table of a Gaussian's voltages, over its width.
_PER_WIDTH = 10
#: Combinations of waves whose voltages are below this share of the largest one's are left out.
_NOTHING = 1e-14
#: Combinations of waves are chosen to one of so many distances from the axis to the table's end.
_REACHES = 32
#: Waves with less than this share of the largest factor are not summed.
_NO_SHARE = 1e-17


def _wave(
    wave: int, r: FloatArray, k: FloatArray, across: bool, below: Sequence[FloatArray] = ()
) -> FloatArray:
    """A wave at all products of radii and wavenumbers: cosines and sines where it is a slit's."""
    x = np.outer(r, k)
    if across:
        return 2 * (np.cos, np.sin)[wave](x) / k
    if wave == TURN:
        return np.divide(j1(x), x, out=np.full_like(x, 0.5), where=x != 0)
    return bessel(wave, x, below)


@array_record
class WaveTable:
    """Waves on even radii, (t,), for all nodes, and the splines through them."""

    radii: FloatArray
    values: FloatArray  # (t, nodes)
    spline: BSpline  # with coefficients (t, nodes)

    def interpolation(self, radius: FloatArray) -> csr_array:
        """From coefficients to radii within the table, shape (n, t), sparse."""
        from scipy.interpolate import BSpline

        inside = np.clip(radius, self.radii[0], self.radii[-1])
        return BSpline.design_matrix(inside, self.spline.t, _DEGREE)


@lru_cache(maxsize=32)
def wave_table(wave: int, across: bool, reach: float, nodes: bytes) -> WaveTable:
    """Return the table of a wave out to ``reach`` (m), a little beyond both ends."""
    from scipy.interpolate import make_interp_spline

    k = np.frombuffer(nodes)
    count = math.ceil(reach * k[-1] / _TABLE_PHASE) + 1
    radii = reach / count * np.arange(-_DEGREE, count + _DEGREE + 1.0)
    lower = range(wave - 2, wave) if wave > 1 else ()
    below = [wave_table(order, across, reach, nodes).values for order in lower]
    values = _wave(wave, radii, k, across, below)
    return WaveTable(radii, values, make_interp_spline(radii, values, k=_DEGREE))


@lru_cache(maxsize=8)
def _seen_waves(
    wave: int, across: bool, reach: float, nodes: bytes, share: int, factors: bytes
) -> ArrayTriple:
    """Singular values (f,) and vectors (f, nodes) of a table times factors; splines (t, f)."""
    table = wave_table(wave, across, reach, nodes)
    factor = np.frombuffer(factors)
    inside = (table.radii >= 0) & (table.radii <= share / _REACHES * reach)
    _, size, right = np.linalg.svd(table.values[inside] * factor, full_matrices=False)
    size = size[size > _NOTHING * size[0]]
    right = right[: size.size]
    return size, right, table.spline.c @ ((factor[:, None] * right.T) / size)


@array_record
class Geometry:
    """Distances of the points from a trial centre, and sums of waves there."""

    radius: FloatArray  # (n,), in m
    towards: FloatArray  # (2, n): derivatives of the radius by the centre's x and y
    k: FloatArray  # (nodes,), in rad/m
    across: bool  # whether the scan crosses a slit: with cosines in place of Bessel functions
    reach: float  # of the tables, in m
    _waves: dict[int, FloatArray] = field(default_factory=dict, init=False)  # at the points
    _interpolations: dict[int, csr_array] = field(default_factory=dict, init=False)

    def summed(self, wave: int, spread: FloatArray, rows: slice | BoolArray) -> FloatArray:
        """Sum a wave over the nodes, by factors (nodes,) or (nodes, m), at some of the points."""
        if self.radius.size > DENSE or wave > 1:
            count = self._nodes_of(spread)
            sums = self.table(wave, count).spline.c @ spread[:count]
            return self.interpolation(count)[rows] @ sums
        if wave not in self._waves:
            # Repeats share their positions: each wave is computed once.
            unique, place = np.unique(self.radius, return_inverse=True)
            if self.reach * self.k[-1] < _LONGEST_PHASE:
                table = self.table(wave, self.k.size)
                values = table.spline(np.minimum(unique, table.radii[-1]))
            else:
                values = _wave(wave, unique, self.k, self.across)
            self._waves[wave] = values[place]
        return self._waves[wave][rows] @ spread

    def table(self, wave: int, count: int) -> WaveTable:
        """The table of a wave for the first nodes."""
        return wave_table(wave, self.across, self.reach, self.k[:count].tobytes())

    def interpolation(self, count: int) -> csr_array:
        """From coefficients of the tables' splines to the points, shape (n, t), sparse."""
        if count not in self._interpolations:
            self._interpolations[count] = self.table(0, count).interpolation(self.radius)
        return self._interpolations[count]

    def _nodes_of(self, spread: FloatArray) -> int:
        """How many first nodes factors need: all, a half, a quarter and so on."""
        # A source with an edge has many waves, of which a wide kernel passes few.
        size = abs(spread)
        used = np.nonzero(size > _NO_SHARE * size.max(initial=0.0))[0]
        needed = 1 + used.max(initial=0)
        halvings = int(np.log2(self.k.size / needed))
        return int(np.ceil(self.k.size / 2**halvings))


# An elliptic Gaussian has the second moments s^2 [[1 + e1, e2], [e2, 1 - e1]], e = |(e1, e2)| and
# tan 2a = e2/e1, widths s sqrt(1 +- e), and the transform exp(-s^2 k^2/2) exp(-z cos 2(phi - a))
# with z = s^2 k^2 e/2.  By the Jacobi-Anger expansion (DLMF 10.35.2) its response at R and angle t
# is the sum over m of eps_m cos 2m(t - a) times 1/(2 pi) the integral of
# exp(-s^2 k^2/2) I_m(z) sigma(k) J_2m(kR) k dk, with eps_0 = 1, the others 2.
#: An ellipse's response is a sum of so many harmonics.
_HARMONICS = 5


@array_record
class ForwardModel:
    """Voltages at the points of a scan, for kernels given by their transforms."""

    points: ScanPoints
    # Transform of the base stress per newton for each scan, on the same nodes.
    references: tuple[RadialSpectrum, ...]
    sums_waves: ClassVar[bool] = True  # voltages are sums of waves around a centre
    round_references: ClassVar[bool] = True

    @property
    def reference(self) -> RadialSpectrum:
        """The first scan's reference."""
        return self.references[0]

    @property
    def axis(self) -> int:
        """Which component a tangential channel measures: 0 for x, 1 for y."""
        return int(self.points.channel == "yz")

    @property
    def k(self) -> FloatArray:
        """Quadrature nodes, in rad/m."""
        return self.reference.wavenumbers.k

    @cached_property
    def alike(self) -> list[list[int]]:
        """Numbers of the scans, of equal references together."""
        scans: dict[bytes, list[int]] = {}
        for scan, reference in enumerate(self.references):
            scans.setdefault(reference.values.tobytes(), []).append(scan)
        return [*scans.values()]

    @cached_property
    def drift_columns(self) -> FloatArray:
        """Baseline and drift along each scan, then curvatures of baselines that may be curved."""
        return np.hstack([self.straight_columns, self.curvature_columns])

    @cached_property
    def curvature_columns(self) -> FloatArray:
        """Parabola of each scan whose baseline may be curved, shape (n, c)."""
        return self.parabola[:, None] * np.equal.outer(self.points.scan, self.points.curved)

    @cached_property
    def _within(self) -> FloatArray:
        """Positions along x and y from the middle of each scan over its half ranges, (2, n)."""
        within = np.zeros_like(self.points.positions)
        for inside in self.points.inside:
            positions = self.points.positions[:, inside]
            half = np.ptp(positions, axis=1, keepdims=True) / 2
            middle = positions.min(axis=1, keepdims=True) + half
            within[:, inside] = quotient(positions - middle, half)
        return within

    @property
    def parabola(self) -> FloatArray:
        """Square of the distance from the middle of each scan over its half range, (n,)."""
        return floats(np.sum(self._within**2, axis=0))

    @cached_property
    def straight_columns(self) -> FloatArray:
        """Baseline and drift (from -1 to 1) along each scan, shape (n, 2 or 3 a scan)."""
        columns = []
        for inside, free in zip(self.points.inside, self.points.free, strict=True):
            columns += [inside, *(self._within[free] * inside)]
        return np.column_stack(columns)

    @cached_property
    def reach(self) -> float:
        """Beyond the distances of all points from any centre, in m."""
        # Rounded up, so that parts of one raster share their tables.
        return float(1.25e-3 * np.ceil(1e3 * self.points.span))

    @cached_property
    def _measures(self) -> list[FloatArray]:
        """Weights of the quadrature times the reference of each scan."""
        return [ref.wavenumbers.weights * ref.values for ref in self.references]

    def offset(self, centres: FloatArray) -> FloatArray:
        """Positions of the points from centres, shape (scans, 2), in m: (2, n)."""
        return self.points.positions - np.atleast_2d(centres)[self.points.scan].T

    def geometry(self, centres: FloatArray) -> Geometry:
        """Return distances and Bessel functions for trial centres, shape (scans, 2), in m."""
        offset = self.offset(centres)
        radius = np.hypot(*offset)
        towards = -quotient(offset, radius)
        return Geometry(radius, towards, self.k, self.reference.order == ACROSS, self.reach)

    def signal(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Voltages for kernels in V/Pa by their transforms, shape (nodes,) or (nodes, m)."""
        voltages = self._summed(geometry, self.points.order, kernel)
        if self.points.order == 0:
            return voltages
        return floats(-(geometry.towards[self.axis] * voltages.T).T)

    def framed(
        self, geometry: Geometry, first: Sequence[FloatArray]
    ) -> tuple[FloatArray, FloatArray | None]:
        """Columns (n, b + f): the ``first``, then F; and C (f, nodes): kernels K make F C K."""
        # By singular values: a film transmits few combinations of all waves.  No F and C where
        # there are not more points than columns.
        points = self.points
        if points.u.size <= DENSE or not self.sums_waves:
            return np.hstack(first), None
        strongest = np.abs(self._measures).max(axis=0)
        reach = _REACHES * geometry.radius.max() / geometry.reach
        size, right, splines = _seen_waves(
            points.order,
            geometry.across,
            geometry.reach,
            self.k.tobytes(),
            math.ceil(reach),
            strongest.tobytes(),
        )
        interpolation = geometry.interpolation(self.k.size)
        factor = points.load
        if points.order:
            factor = -factor * geometry.towards[self.axis]
        start = sum(columns.shape[1] for columns in first)
        columns = np.zeros((factor.size, start + size.size * len(self.alike)))
        mixes = []
        np.concatenate(first, axis=1, out=columns[:, :start])
        for scans in self.alike:
            place = slice(start, start + size.size)
            own_factor = np.where(np.isin(points.scan, scans), factor, 0.0)
            for block in slices(factor.size, BLOCK):
                waves = interpolation[block] @ splines
                columns[block, place] = waves * own_factor[block, None]
            share = quotient(self._measures[scans[0]], strongest)
            mixes.append(size[:, None] * right * share)
            start += size.size
        return columns, np.vstack(mixes)

    def radial_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivative of :meth:`signal` by the distance from the centre, in V/m."""
        if self.points.order or not self.sums_waves:
            shift = self.shift_derivative(geometry, kernel)
            return floats(np.sum(geometry.towards * shift, axis=0))
        return -self._summed(geometry, 1, (self.k * kernel.T).T)

    def shift_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by each point's centre, shape (2, n), in V/m."""
        if self.points.order == 0:
            return geometry.towards * self.radial_derivative(geometry, kernel)
        # A vector's radial component f changes by f/R across its direction, too; on the axis by the
        # same.
        turn = self._summed(geometry, TURN, self.k * kernel)
        slope = self._summed(geometry, 0, self.k * kernel) - turn
        shift = geometry.towards[self.axis] * geometry.towards * (turn - slope)
        shift[self.axis] -= turn
        return floats(shift)

    def centre_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by the free coordinates of all centres, shape (n, m)."""
        return self.by_free_centres(self.shift_derivative(geometry, kernel))

    def by_free_centres(self, shift: FloatArray) -> FloatArray:
        """Derivatives by the free coordinates of all centres (n, m), of those by each point's."""
        inside = self.points.inside
        free = np.argwhere(self.points.free)
        return np.column_stack([np.where(inside[i], shift[axis], 0.0) for i, axis in free])

    def elliptic(self, geometry: Geometry, ellipses: FloatArray) -> ArrayPair:
        """Responses (m, n) per A to (s, e1, e2), (m, 3); slopes (2, n) of the first by place."""
        toward, across = geometry.towards
        angle = np.arctan2(-across, -toward)
        sigma, e1, e2 = ellipses.T
        size = np.hypot(e1, e2)
        tilt = 0.5 * np.arctan2(e2, e1)
        half = 0.5 * np.outer(self.k, sigma) ** 2
        step = np.exp(2j * np.subtract.outer(angle, tilt))
        phasor = np.ones_like(step)
        responses = np.zeros((len(ellipses), angle.size))
        slope = np.zeros_like(angle)
        turn = np.zeros_like(angle)
        for m in range(_HARMONICS):
            kernels = ive(m, half * size) * np.exp(-half * (1 - size))
            profiles = (1 if m == 0 else 2) * self._summed(geometry, 2 * m, kernels)
            responses += (phasor.real * profiles).T
            # By J_n' = (J_(n-1) - J_(n+1))/2.
            steeper = self.k * kernels[:, 0]
            steepness = -self._summed(geometry, 2 * m + 1, steeper)
            if m > 0:
                steepness += self._summed(geometry, 2 * m - 1, steeper)
            slope += phasor.real[:, 0] * steepness
            turn -= 2 * m * phasor.imag[:, 0] * profiles[:, 0]
            phasor *= step
        turn = quotient(turn, geometry.radius)
        return responses, geometry.towards * slope + np.stack([-across, toward]) * turn

    def around(
        self, m: int, cosines: FloatArray, sines: FloatArray, centres: FloatArray
    ) -> FloatArray:
        """Voltages of kernels with cos or sin of m times the angle: (n, both), in V."""
        # ``cosines`` and ``sines``: their transforms of order m, (nodes, a) and (nodes, b), V/Pa.
        geometry = self.geometry(centres)
        angle = m * np.arctan2(-geometry.towards[1], -geometry.towards[0])
        columns = self._summed(geometry, m, np.hstack([cosines, sines]))
        columns[:, : cosines.shape[1]] *= np.cos(angle)[:, None]
        columns[:, cosines.shape[1] :] *= np.sin(angle)[:, None]
        return columns

    def spotted(self, places: FloatArray, width: float, centres: FloatArray) -> FloatArray:
        """Voltages of Gaussians of unit integral at places (2, m) from centres, in m: (n, m)."""
        distance = np.hypot(*(self.offset(centres)[:, :, None] - places[:, None]))
        table = np.arange(0.0, distance.max() + width, width / _PER_WIDTH)
        volts = np.empty(distance.shape)
        for scan, reference in enumerate(self.references):
            values = reference.values * gaussian_transfer(self.k, width)
            profile = reference.wavenumbers.synthesise(values, table)
            rows = self.points.scan == scan
            volts[rows] = radial_spline(table, profile)(distance[rows])
        return self.points.load[:, None] * volts

    def _summed(self, geometry: Geometry, wave: int, kernel: FloatArray) -> FloatArray:
        """Voltages by kernels, each scan through its reference: a wave summed over the nodes."""
        per_newton = np.empty((self.points.u.size, *kernel.shape[1:]))
        for scan, measure in enumerate(self._measures):
            rows = slice(None) if len(self.references) == 1 else self.points.scan == scan
            per_newton[rows] = geometry.summed(wave, (kernel.T * measure).T, rows)
        return (per_newton.T * self.points.load).T


def forward_model(points: ScanPoints, references: Sequence[RadialSpectrum]) -> ForwardModel:
    """Return the model of scans, in two dimensions where a reference is not round."""
    nodes = references[0].wavenumbers.k.size
    size = points.u.size
    if nodes > _MOST_WAVES and size > DENSE and not points.planar:
        raise too_large(
            "The scan",
            size,
            DENSE,
            "points for such a reference",
            cure="Average neighbouring readings, or give a source without an edge (gaussian:S).",
            why=f"A source with an edge takes {nodes:,} wavenumbers, where a film takes some "
            "hundred.",
        )
    models = [reference.model for reference in references if reference.model]
    model: ForwardModel = [*models, ForwardModel][0](points, tuple(references))
    return hook("moving_model")(model) if points.in_motion else model
