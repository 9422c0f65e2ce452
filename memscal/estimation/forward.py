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
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import ive, j0, j1

from memscal.axisymmetry.hankel import ACROSS, RadialSpectrum
from memscal.estimation.points import ScanPoints
from memscal.model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Geometry:
    """Distances of the points from a trial centre, and Bessel functions there."""

    radius: FloatArray  # (n,), in m
    towards: FloatArray  # (2, n): derivatives of the radius by the centre's x and y
    bessel0: FloatArray  # (n, nodes)
    bessel1: FloatArray


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

    def geometry(self, centres: FloatArray) -> Geometry:
        """Return distances and Bessel functions for trial centres, shape (scans, 2), in m."""
        centre = np.atleast_2d(centres)[self.points.scan].T
        dx, dy = self.points.x - centre[0], self.points.y - centre[1]
        radius = np.hypot(dx, dy)
        # Repeats share their positions: each Bessel function is computed once.
        unique, back = np.unique(radius, return_inverse=True)
        argument = np.multiply.outer(unique, self.k)
        towards = -np.stack([dx, dy]) / np.where(radius > 0, radius, 1.0)
        if self.reference.order == ACROSS:
            waves = 2 * np.cos(argument) / self.k, 2 * np.sin(argument) / self.k
            return Geometry(radius, towards, waves[0][back], waves[1][back])
        return Geometry(radius, towards, j0(argument)[back], j1(argument)[back])

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
        per_newton = np.empty((geometry.radius.size, *kernel.shape[1:]))
        synthesis, load = self.synthesis(geometry), self.points.load
        for rows, measure in self._measures:
            spread = measure * kernel if kernel.ndim == 1 else measure[:, None] * kernel
            per_newton[rows] = synthesis[rows] @ spread
        return np.asarray(per_newton * (load if kernel.ndim == 1 else load[:, None]))

    def radial_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivative of :meth:`signal` by the distance from the centre, shape (n,), in V/m."""
        if self.order:
            slope, _ = self._vector_slopes(geometry, kernel)
            return np.asarray(-geometry.towards[self.axis] * slope)
        return -self._summed(geometry.bessel1, kernel)

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
        shift, scan = self.shift_derivative(geometry, kernel), self.points.scan
        free = np.argwhere(self.points.free)
        return np.stack([np.where(scan == i, shift[axis], 0.0) for i, axis in free], axis=1)

    def elliptic(self, geometry: Geometry) -> Callable[[FloatArray], FloatArray]:
        """Return the response per A of an elliptic Gaussian to its s, e1 and e2."""
        return partial(_response, self, geometry, _bessel(geometry, self.k))

    def _vector_slopes(self, geometry: Geometry, kernel: FloatArray) -> list[FloatArray]:
        """Radial component f of a vector: its derivative by R, and f/R; on the axis the same."""
        x = np.multiply.outer(geometry.radius, self.k)
        turn = np.divide(geometry.bessel1, x, out=np.full_like(x, 0.5), where=x > 0)
        return [self._summed(matrix, kernel) for matrix in (geometry.bessel0 - turn, turn)]

    def _summed(self, matrix: FloatArray, kernel: FloatArray) -> FloatArray:
        """Voltages by k times a kernel, summed over the quadrature, shape (n,)."""
        per_newton = np.empty(len(matrix))
        for rows, measure in self._measures:
            per_newton[rows] = matrix[rows] @ (measure * self.k * kernel)
        return np.asarray(per_newton * self.points.load)

    @property
    def _measures(self) -> list[tuple[slice | NDArray[np.bool_], FloatArray]]:
        """Rows of each scan, and the quadrature's weights times its reference."""
        measures = [ref.wavenumbers.weights * ref.values for ref in self.references]
        if len(measures) == 1:
            return [(slice(None), measures[0])]
        return [(self.points.scan == i, measure) for i, measure in enumerate(measures)]


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
_STEP = 1e-4


def elliptic_columns(
    model: ForwardModel, geometry: Geometry, sigma: float, ellipticity: FloatArray
) -> FloatArray:
    """Response per A of an elliptic Gaussian, and its derivatives by s, e1 and e2."""
    here = np.concatenate([[sigma], ellipticity])
    response = model.elliptic(geometry)
    steps = np.diag([_STEP * sigma, _STEP, _STEP])
    slopes = [(response(here + s) - response(here - s)) / (2 * s.sum()) for s in steps]
    return np.stack([response(here), *slopes], axis=1)


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


def _response(
    model: ForwardModel, geometry: Geometry, harmonics: list[FloatArray], place: FloatArray
) -> FloatArray:
    sigma, (e1, e2) = float(place[0]), bounded(place[1:])
    e = float(np.hypot(e1, e2))
    half = 0.5 * (sigma * model.k) ** 2
    # The derivatives of the radius by the centre point to it: their angle is the direction's.
    angle = np.arctan2(-geometry.towards[1], -geometry.towards[0]) - 0.5 * np.arctan2(e2, e1)
    total = np.zeros_like(geometry.radius)
    for m, bessel in enumerate(harmonics):
        kernel = ive(m, half * e) * np.exp(-half * (1 - e))
        around = Geometry(geometry.radius, geometry.towards, bessel, bessel)
        total += (1 if m == 0 else 2) * np.cos(2 * m * angle) * model.signal(around, kernel)
    return total


def _bessel(geometry: Geometry, k: FloatArray) -> list[FloatArray]:
    """Bessel functions of even order by upward recurrence; at small arguments their first term."""
    # Repeats share their positions.
    unique, first, back = np.unique(geometry.radius, return_index=True, return_inverse=True)
    x, factorial = np.multiply.outer(unique, k), 1.0
    even, below, above = [geometry.bessel0], geometry.bessel0[first], geometry.bessel1[first]
    for order in range(2, 2 * _HARMONICS):
        small = x < 0.1 * order
        safe = np.where(small, 1.0, x)
        factorial *= order
        series = (x / 2) ** order / factorial
        below, above = above, np.where(small, series, 2 * (order - 1) / safe * above - below)
        if order % 2 == 0:
            even.append(above[back])
    return even
