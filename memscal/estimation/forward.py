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

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ive, j0, j1

from memscal.axisymmetry.hankel import ACROSS, RadialSpectrum, bessel
from memscal.estimation.points import ScanPoints
from memscal.model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Geometry:
    """Distances of the points from a trial centre, and Bessel functions there."""

    radius: FloatArray  # (n,), in m
    towards: FloatArray  # (2, n): derivatives of the radius by the centre's x and y
    k: FloatArray  # (nodes,), in rad/m
    across: bool  # whether the scan crosses a slit: with cosines in place of Bessel functions

    @cached_property
    def bessel0(self) -> FloatArray:
        """Bessel function of order zero of all products k R, shape (n, nodes)."""
        return 2 * self._of_products(np.cos) / self.k if self.across else self._of_products(j0)

    @cached_property
    def bessel1(self) -> FloatArray:
        """The same of order one: its negative derivative by k R."""
        return 2 * self._of_products(np.sin) / self.k if self.across else self._of_products(j1)

    def _of_products(self, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
        # Repeats share their positions: each Bessel function is computed once.
        unique, back = np.unique(self.radius, return_inverse=True)
        return np.asarray(function(np.multiply.outer(unique, self.k))[back])


@dataclass(frozen=True, eq=False)
class ForwardModel:
    """Voltages at the points of a scan, for kernels given by their transforms."""

    points: ScanPoints
    # Transform of the base stress per newton for each scan, on the same nodes.
    references: tuple[RadialSpectrum, ...]

    @property
    def reference(self) -> RadialSpectrum:
        """The first scan's reference."""
        return self.references[0]

    def only(self, scan: int) -> ForwardModel:
        """Return the model of one of the scans."""
        return replace(self, points=self.points.only(scan), references=(self.references[scan],))

    @property
    def order(self) -> int:
        """Zero for the normal channel; one for a tangential one, a component of a vector."""
        return max(self.reference.order, 0)

    @property
    def axis(self) -> int:
        """Which component a tangential channel measures: 0 for x, 1 for y."""
        return int(self.points.channel == "yz")

    @property
    def k(self) -> FloatArray:
        """Quadrature nodes, in rad/m."""
        return self.reference.wavenumbers.k

    @cached_property
    def drift_columns(self) -> FloatArray:
        """Baseline and drift (from -1 to 1) along each scan, shape (n, 2 or 3 a scan)."""
        columns = []
        for i, free in enumerate(self.points.free):
            inside = self.points.scan == i
            columns.append(inside.astype(np.float64))
            for along, position in zip(free, (self.points.x, self.points.y), strict=True):
                if along:
                    columns.append(np.zeros_like(position))
                    columns[-1][inside] = _unit_range(position[inside])
        return np.stack(columns, axis=1)

    def table(self, order: int) -> tuple[FloatArray, FloatArray]:
        """Radii (t,) that reach beyond the scans, and a Bessel function there, (t, nodes)."""
        # Rounded up, so that parts of one raster share their tables.
        reach = 1.25e-3 * np.ceil(1e3 * np.hypot(np.ptp(self.points.x), np.ptp(self.points.y)))
        return bessel_table(order, float(reach), self.k.tobytes())

    def geometry(self, centres: FloatArray) -> Geometry:
        """Return distances and Bessel functions for trial centres, shape (scans, 2), in m."""
        centre = np.atleast_2d(centres)[self.points.scan].T
        dx, dy = self.points.x - centre[0], self.points.y - centre[1]
        radius = np.hypot(dx, dy)
        towards = -np.stack([dx, dy]) / np.where(radius > 0, radius, 1.0)
        return Geometry(radius, towards, self.k, self.reference.order == ACROSS)

    def cosines(self, centres: FloatArray) -> FloatArray:
        """Cosines between a channel's component and the points, for trial centres (m, 2)."""
        across = [self.points.x - centres[:, :1], self.points.y - centres[:, 1:]]
        radius = np.hypot(*across)
        return np.asarray(across[self.axis] / np.where(radius > 0, radius, 1.0))

    def synthesis(self, geometry: Geometry) -> FloatArray:
        """Voltages of single wavenumbers, shape (n, nodes): Bessel functions and their parity."""
        if self.order == 0:
            return geometry.bessel0
        return np.asarray(-geometry.towards[self.axis][:, None] * geometry.bessel1)

    def signal(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Voltages for kernels in V/Pa by their transforms, shape (nodes,) or (nodes, m)."""
        return self._summed(self.synthesis(geometry), kernel)

    def radial_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivative of :meth:`signal` by the distance from the centre, shape (n,), in V/m."""
        if self.order:
            slope, _ = self._vector_slopes(geometry, kernel)
            return np.asarray(-geometry.towards[self.axis] * slope)
        return -self._summed(geometry.bessel1, self.k * kernel)

    def shift_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by each point's centre, shape (2, n), in V/m."""
        # A vector's component changes by f/R across its direction, too.
        if self.order == 0:
            return np.asarray(geometry.towards * self.radial_derivative(geometry, kernel))
        slope, turn = self._vector_slopes(geometry, kernel)
        shift = geometry.towards[self.axis] * geometry.towards * (turn - slope)
        shift[self.axis] -= turn
        return np.asarray(shift)

    def centre_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by the free coordinates of all centres, shape (n, m)."""
        return self.by_free_centres(self.shift_derivative(geometry, kernel))

    def by_free_centres(self, shift: FloatArray) -> FloatArray:
        """Derivatives by the free coordinates of all centres (n, m), of those by each point's."""
        scan, free = self.points.scan, np.argwhere(self.points.free)
        return np.stack([np.where(scan == i, shift[axis], 0.0) for i, axis in free], axis=1)

    def elliptic(
        self, geometry: Geometry, places: list[FloatArray]
    ) -> tuple[list[FloatArray], FloatArray]:
        """Responses (n,) per A to s, e1 and e2; slopes (2, n) of the first by the centre."""
        from scipy.interpolate import CubicSpline

        points, count = self.points, len(places)
        radius, toward, across = geometry.radius, *geometry.towards
        angle = np.arctan2(-across, -toward)
        totals, (slope, turn) = np.zeros((count, radius.size)), np.zeros((2, radius.size))
        for m in range(_HARMONICS):
            table, matrix = self.table(2 * m)
            kernels, tilts = np.empty((self.k.size, count)), np.empty(count)
            for i, (sigma, *e) in enumerate(places):
                e1, e2 = bounded(np.array(e))
                half, size = 0.5 * (sigma * self.k) ** 2, float(np.hypot(e1, e2))
                kernels[:, i] = ive(m, half * size) * np.exp(-half * (1 - size))
                tilts[i] = 0.5 * np.arctan2(e2, e1)
            for scan, reference in enumerate(self.references):
                rows = points.scan == scan
                measure = reference.wavenumbers.weights * reference.values
                spline = CubicSpline(table, matrix @ (measure[:, None] * kernels))
                phase = 2 * m * np.subtract.outer(angle[rows], tilts)
                load = (1 if m == 0 else 2) * points.load[rows]
                profiles = spline(radius[rows])
                totals[:, rows] += (load[:, None] * np.cos(phase) * profiles).T
                slope[rows] += load * np.cos(phase[:, 0]) * spline(radius[rows], 1)[:, 0]
                turn[rows] -= 2 * m * load * np.sin(phase[:, 0]) * profiles[:, 0]
        around = np.stack([-geometry.towards[1], geometry.towards[0]])
        turned = np.divide(turn, radius, out=np.zeros_like(turn), where=radius > 0)
        return list(totals), geometry.towards * slope + around * turned

    def around(
        self, m: int, cosines: FloatArray, sines: FloatArray, centres: FloatArray
    ) -> FloatArray:
        """Voltages of kernels with cos or sin of m times the angle: (n, both), in V."""
        # ``cosines`` and ``sines``: their transforms of order m, (nodes, a) and (nodes, b), V/Pa.
        from scipy.interpolate import CubicSpline

        geometry, (table, matrix) = self.geometry(centres), self.table(m)
        angle = m * np.arctan2(-geometry.towards[1], -geometry.towards[0])
        kernels = np.hstack([cosines, sines])
        columns = np.empty((angle.size, kernels.shape[1]))
        for rows, measure in self._measures:
            spline = CubicSpline(table, matrix @ (measure[:, None] * kernels))
            columns[rows] = spline(geometry.radius[rows]) * self.points.load[rows, None]
        columns[:, : cosines.shape[1]] *= np.cos(angle)[:, None]
        columns[:, cosines.shape[1] :] *= np.sin(angle)[:, None]
        return columns

    def _vector_slopes(self, geometry: Geometry, kernel: FloatArray) -> list[FloatArray]:
        """Radial component f of a vector: its derivative by R, and f/R; on the axis the same."""
        x = np.multiply.outer(geometry.radius, self.k)
        turn = np.divide(geometry.bessel1, x, out=np.full_like(x, 0.5), where=x > 0)
        return [self._summed(m, self.k * kernel) for m in (geometry.bessel0 - turn, turn)]

    def _summed(self, matrix: FloatArray, kernel: FloatArray) -> FloatArray:
        """Voltages by kernels times single wavenumbers' (n, nodes), summed over the quadrature."""
        per_newton, load = np.empty((len(matrix), *kernel.shape[1:])), self.points.load
        for rows, measure in self._measures:
            spread = measure * kernel if kernel.ndim == 1 else measure[:, None] * kernel
            per_newton[rows] = matrix[rows] @ spread
        return np.asarray(per_newton * (load if kernel.ndim == 1 else load[:, None]))

    @property
    def _measures(self) -> list[tuple[slice | NDArray[np.bool_], FloatArray]]:
        """Rows of each scan, and the quadrature's weights times its reference."""
        measures = [ref.wavenumbers.weights * ref.values for ref in self.references]
        if len(measures) == 1:
            return [(slice(None), measures[0])]
        return [(self.points.scan == i, measure) for i, measure in enumerate(measures)]


@lru_cache(maxsize=32)
def bessel_table(order: int, reach: float, nodes: bytes) -> tuple[FloatArray, FloatArray]:
    """Even radii out to ``reach`` (m), and a Bessel function there for wavenumbers, (t, nodes)."""
    k = np.frombuffer(nodes)
    radii = np.linspace(0.0, reach, int(np.ceil(reach * k[-1] / _TABLE_PHASE)) + 4)
    return radii, bessel(order, np.multiply.outer(radii, k))


def forward_model(points: ScanPoints, references: Sequence[RadialSpectrum]) -> ForwardModel:
    """Return the model of scans, in two dimensions where a reference is not round."""
    models = [reference.model for reference in references if reference.model]
    model: ForwardModel = (models or [ForwardModel])[0](points, tuple(references))
    return model


def _unit_range(positions: FloatArray) -> FloatArray:
    middle = (positions.max() + positions.min()) / 2
    return np.asarray((positions - middle) / (np.ptp(positions) / 2))


# An elliptic Gaussian has the second moments s^2 [[1 + e1, e2], [e2, 1 - e1]], e = |(e1, e2)| and
# tan 2a = e2/e1, widths s sqrt(1 +- e), and the transform exp(-s^2 k^2/2) exp(-z cos 2(phi - a))
# with z = s^2 k^2 e/2.  By the Jacobi-Anger expansion (DLMF 10.35.2) its response at R and angle t
# is the sum over m of eps_m cos 2m(t - a) times 1/(2 pi) the integral of
# exp(-s^2 k^2/2) I_m(z) sigma(k) J_2m(kR) k dk, with eps_0 = 1, the others 2.
#: An ellipse's response is a sum of so many harmonics, its derivatives are by centred differences.
_HARMONICS = 5
_LARGEST = 0.95
#: Phase (rad) of the last wavenumber from one radius of a table to the next.
_TABLE_PHASE = 0.25
_STEP = 1e-4


def elliptic_columns(
    model: ForwardModel, geometry: Geometry, sigma: float, ellipticity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Response per A of an elliptic Gaussian and its derivatives by s, e1, e2; by the centre."""
    # Shapes (n, 4), and (2, n) of each point's own centre.
    here = np.concatenate([[sigma], ellipticity])
    steps = np.diag([_STEP * sigma, _STEP, _STEP])
    places = [here, *(here + step for step in steps), *(here - step for step in steps)]
    (values, *others), shift = model.elliptic(geometry, places)
    slopes = [
        (above - below) / (2 * step.sum())
        for above, below, step in zip(others[:3], others[3:], steps, strict=True)
    ]
    return np.stack([values, *slopes], axis=1), shift


def elliptic_departure(
    x: FloatArray, y: FloatArray, sigma: float, ellipticity: FloatArray
) -> FloatArray:
    """Elliptic Gaussian of unit integral less the round one of the same s, on a grid (y, x)."""
    e1, e2 = bounded(ellipticity)
    plane_x, plane_y = np.meshgrid(x, y)
    round_, determinant = plane_x**2 + plane_y**2, 1 - e1**2 - e2**2
    form = (1 - e1) * plane_x**2 - 2 * e2 * plane_x * plane_y + (1 + e1) * plane_y**2
    scale = 1 / (2 * np.pi * sigma**2)
    elliptic = np.exp(-0.5 * form / (determinant * sigma**2)) / np.sqrt(determinant)
    return np.asarray(scale * (elliptic - np.exp(-0.5 * round_ / sigma**2)))


def bounded(ellipticity: FloatArray) -> FloatArray:
    """Return an ellipticity (e1, e2) that an ellipse can have."""
    size = float(np.hypot(*ellipticity))
    return np.asarray(ellipticity * min(1.0, _LARGEST / size) if size > 0 else ellipticity)
