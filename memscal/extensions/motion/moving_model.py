r"""Forward model of readings in motion: means along the scan, by a sensor that follows slowly.

What a still sensor reads along a line, :math:`u(x)`, has no wavenumber beyond the last one that the
film passes.  A sensor over which the film moves with the speed V reads

.. math::

    u_V(x) = \mathcal F^{-1}\{\hat u(k)\,H(kV/2\pi)\,\mathrm{sinc}(kD/2)\},

with its transfer function H (:mod:`memscal.extensions.motion.transfer`), and D the way over which
each reading is the mean.  So each reading is a sum, with fixed weights, of the still sensor's on
an even grid along the line.  H is complex: a reading lags, and a line is no longer even.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import ClassVar, NamedTuple

import numpy as np

from memscal.estimation.forward import ForwardModel, Geometry, forward_model
from memscal.estimation.points import ScanPoints, grouped
from memscal.extensions.motion.transfer import settling_time, transfer, varied
from memscal.model.arrays import ArrayPair, Arrays, FloatArray, IndexArray, array_record, floats
from memscal.model.instrument import Dynamics

#: Points of a grid for each half wave of the last wavenumber.
_OVERSAMPLING = 1.25
#: A grid reaches this share of a line's length beyond both of its ends, and so many steps at least.
_BEYOND = 0.5
_LEAST = 60
#: Points of a mean, where a line has so few readings that they are fewer than those of its grid.
_NODES = 8
#: A period is at most so many times longer: what is left of its other end is then a straight line.
_LONGEST = 16


class _Line(NamedTuple):
    """Readings of one line of a scan, and the points of its grid."""

    rows: IndexArray  # (n,): which readings
    columns: slice  # of the grid of all lines
    x: FloatArray  # (m,): positions of the grid along the line, in m
    weights: FloatArray  # (n, m)


@array_record
class MovingModel(ForwardModel):
    """Voltages at the points of scans that were made in motion."""

    sums_waves: ClassVar[bool] = False

    @property
    def round_references(self) -> bool:  # type: ignore[override]
        """Whether the still sensor's references are round."""
        return self.still.round_references

    @cached_property
    def still(self) -> ForwardModel:
        """Voltages of a still sensor on the grids of all lines, per newton."""
        points = self.points
        lines = [*self._lines(points.dynamics)]
        first = [line.rows[0] for line in lines]
        whole = points.selected(np.repeat(first, [line.x.size for line in lines]))
        positions = whole.positions
        axis = _axes(whole)
        positions[axis, np.arange(axis.size)] = np.concatenate([line.x for line in lines])
        x, y = positions
        own = {"averaging": 0 * points.averaging, "velocity": 0 * x, "load": np.ones_like(x)}
        return forward_model(replace(whole, x=x, y=y, **own), self.references)

    def geometry(self, centres: FloatArray) -> Geometry:
        """Return that of the still sensor on the grids."""
        return self.still.geometry(centres)

    def read(self, still: FloatArray, dynamics: Dynamics | None) -> FloatArray:
        """Return what is read, (n,) or (n, m), of what a still sensor reads on the grids."""
        voltages = np.empty((self.points.u.size, *still.shape[1:]))
        for line in self._lines(dynamics):
            voltages[line.rows] = line.weights @ still[line.columns]
        return (voltages.T * self.points.load).T

    def _lines(self, dynamics: Dynamics | None) -> Iterator[_Line]:
        """Yield the lines of all scans, read by a sensor of some dynamics."""
        points = self.points
        axis = _axes(points)
        every = np.arange(axis.size)
        along = points.positions[axis, every]
        across = points.positions[1 - axis, every].round(9)
        line = grouped(points.scan, across)
        start = 0
        for number in range(line.max() + 1):
            rows = np.flatnonzero(line == number)
            averaging = points.averaging[points.scan[rows[0]]].max()
            arrays = (along[rows].tobytes(), points.velocity[rows].tobytes())
            x, weights = _weights(*arrays, self.k[-1], averaging, dynamics)
            yield _Line(rows, slice(start, start + x.size), x, weights)
            start += x.size

    def _moving(self, still: FloatArray) -> FloatArray:
        return self.read(still, self.points.dynamics)

    def signal(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Voltages for kernels in V/Pa by their transforms, shape (nodes,) or (nodes, m)."""
        return self._moving(self.still.signal(geometry, kernel))

    def radial_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivative of :meth:`signal` by the distance from the centre, in V/m."""
        return self._moving(self.still.radial_derivative(geometry, kernel))

    def shift_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by each point's centre, shape (2, n), in V/m."""
        return self._moving(self.still.shift_derivative(geometry, kernel).T).T

    def elliptic(self, geometry: Geometry, ellipses: FloatArray) -> ArrayPair:
        """Responses (m, n) per A to (s, e1, e2), (m, 3); slopes (2, n) of the first by place."""
        responses, slopes = self.still.elliptic(geometry, ellipses)
        return self._moving(responses.T).T, self._moving(slopes.T).T

    def around(
        self, m: int, cosines: FloatArray, sines: FloatArray, centres: FloatArray
    ) -> FloatArray:
        """Voltages of kernels with cos or sin of m times the angle: (n, both), in V."""
        return self._moving(self.still.around(m, cosines, sines, centres))

    def spotted(self, places: FloatArray, width: float, centres: FloatArray) -> FloatArray:
        """Voltages of Gaussians of unit integral at places (2, m) from centres, in m: (n, m)."""
        return self._moving(self.still.spotted(places, width, centres))


def moving_model(still: ForwardModel) -> ForwardModel:
    """Return the model of readings in motion, of that of a still sensor at their positions."""
    return MovingModel(still.points, still.references)


def changes_by_dynamics(model: MovingModel, geometry: Geometry, kernel: FloatArray) -> Arrays:
    """Return changes (n,) of a signal, in V, by one u of each number of a sensor's dynamics."""
    still = model.still.signal(geometry, kernel)
    changes = {}
    for name, more, less in varied(model.points.dynamics):
        changes[name] = model.read(still, more) - model.read(still, less)
    return changes


def _axes(points: ScanPoints) -> IndexArray:
    """Return along which axis the line of each point runs: 0 for x, 1 for y."""
    return np.where(points.free[points.scan, 0], 0, 1)


@lru_cache(maxsize=256)
def _weights(
    along: bytes, velocity: bytes, last: float, averaging: float, dynamics: Dynamics | None
) -> ArrayPair:
    """Return the even grid (m,) of a line, and what each reading takes of it, (n, m)."""
    positions = np.frombuffer(along)
    speed = np.frombuffer(velocity)
    step = np.pi / (_OVERSAMPLING * last)
    reach = max(_BEYOND * np.ptp(positions), _LEAST * step)
    count = int(np.ceil((np.ptp(positions) + 2 * reach) / step)) + 1
    if not speed.any() and _NODES * positions.size < count + _NODES:
        nodes, shares = np.polynomial.legendre.leggauss(_NODES)
        x = np.add.outer(positions, averaging / 2 * nodes).ravel()
        return floats(x), floats(np.kron(np.eye(positions.size), shares / 2))
    x = positions.min() - reach + step * np.arange(count)
    # Waves of a period that is so much longer that nothing of its other end is left.
    settling = settling_time(dynamics) * abs(speed).max() if dynamics else 0.0
    beyond = min(settling + averaging, _LONGEST * count * step)
    half = (count + int(np.ceil(beyond / step))) // 2 + 1
    period = 2 * half + 1
    k = 2 * np.pi / (period * step) * np.arange(half + 1)
    waves = np.exp(1j * np.outer(positions, k)) * np.sinc(k * averaging / (2 * np.pi))
    if dynamics:
        waves *= transfer(dynamics, np.outer(speed, k) / (2 * np.pi))
    waves[:, 1:] *= 2
    return x, (waves @ np.exp(-1j * np.outer(k, x))).real / period
