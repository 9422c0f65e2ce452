r"""Angular departures: what of an apparatus function is not round; noise and outliers beside it.

Beside the radial departures a sensor that was scanned over the plane has those that vary around
its centre: rings of radius q, blurred by a Gaussian of width b, with random amplitudes of
:math:`\cos m\varphi` and :math:`\sin m\varphi`.  Both sides of the transform have a closed form,

.. math::

    \frac{1}{2\pi b^2}\,e^{-(r^2+q^2)/2b^2}\,I_m(rq/b^2)\,\cos m\varphi, \qquad
    (-i)^m J_m(kq)\,e^{-b^2k^2/2}\,\cos m\varphi_k ,

and their convolution with a round base stress is
:math:`\cos m\theta\,\frac{1}{2\pi}\int J_m(kq)\,e^{-b^2k^2/2}\,\hat\sigma(k)\,J_m(kR)\,k\,dk`.
None has an integral: they do not change A.

Order 1 leaves out what the scan cannot tell from a shift of the Gaussian, which is the centre's,
and order 2 what it cannot tell from its ellipse: both are parameters without a prior.  The expected
size of each order is the root mean square over its posterior, its logarithm with a flat prior.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from memscal.axisymmetry.kernels import Rings
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.model.arrays import FloatArray, IndexArray, array_record

ORDERS = (1, 2, 3, 4)
#: In units of the Gaussian's width: blur of the rings, their distance, and where the envelope of
#: their amplitudes falls; it is cut where it has fallen to 1e-5.
_BLUR = 0.45
_SPACING = 0.3
_EXTENT = 2.5
_CUT = 2.2
#: Radii of the tables, over the blur; a ring has ended so many of them farther out.
_PER_BLUR = 10
_BLURS = 7.0
#: Radial departures that move no voltage by this share of its noise are not told from angular ones.
_RESOLVED = 0.1
#: Expected sizes of an order, over the Gaussian's L2 norm.
_STRENGTHS = np.geomspace(0.003, 2.0, 16)
_FIRST = 0.1
_SWEEPS = 2


@array_record
class AngularRings(Rings):
    """Blurred rings of unit amplitude: of each order those with a cosine, then with a sine."""

    @classmethod
    def about(cls, fit: GaussianFit) -> AngularRings:
        """Rings about a Gaussian fit."""
        radius = fit.width * np.arange(_SPACING / 2, _CUT * _EXTENT, _SPACING)
        return cls(radius, np.full(radius.size, _BLUR * fit.width), np.ones(radius.size))

    def signal(self, model: ForwardModel, centres: FloatArray) -> FloatArray:
        """Voltages at the points, for centres (scans, 2) in m: (n, 8 q), in V."""
        rings = [(m, self.transform(model.k, m)) for m in ORDERS]
        return np.hstack([model.around(m, each, each, centres) for m, each in rings])


@array_record
class AngularDepartures:
    """Kernels of unit prior variance: of each order those with a cosine, then those with a sine."""

    components: AngularRings
    amplitudes: FloatArray  # (8 q, count): of the rings in each kernel, in V/Pa

    @property
    def count(self) -> int:
        """How many kernels there are."""
        return len(self.amplitudes.T)

    def mean(self, _: Callable[..., FloatArray], place: FloatArray) -> FloatArray:
        """Means of the kernels over directions, or their transforms, at places (n,): none."""
        return np.zeros((place.size, self.count))

    def at(self, x: FloatArray, y: FloatArray, coefficients: FloatArray) -> FloatArray:
        """Combinations (count, c) on a grid about the centre, in m: (y x, c), in V/Pa/m^2."""
        from scipy.interpolate import CubicSpline

        rings = self.components
        radius = np.hypot.outer(y, x).ravel()
        total = np.zeros((radius.size, coefficients.shape[1]))
        blur = rings.blur[0]
        step = blur / _PER_BLUR
        near = radius < rings.radius[-1] + _BLURS * blur
        r = radius[near]
        angle = np.arctan2.outer(y, x).ravel()[near]
        table = step * np.arange(np.ceil(r.max(initial=0.0) / step) + 4)
        for i, amplitudes in enumerate(self._by_rings(coefficients)):
            m = ORDERS[i // 2]
            turn = (np.cos, np.sin)[i % 2]
            profiles = rings.radial(table, m) @ amplitudes
            total[near] += turn(m * angle)[:, None] * CubicSpline(table, profiles)(r)
        return total

    def signal(
        self, model: ForwardModel, centres: FloatArray, coefficients: FloatArray
    ) -> FloatArray:
        """Voltages of combinations (count, c) at the points, for centres in m: (n, c), in V."""
        parts = self._by_rings(coefficients)
        total = np.zeros((model.points.u.size, coefficients.shape[1]))
        for i, m in enumerate(ORDERS):
            rings = self.components.transform(model.k, m)
            both = model.around(m, rings @ parts[2 * i], rings @ parts[2 * i + 1], centres)
            total += np.add(*np.hsplit(both, 2))
        return total

    def _by_rings(self, coefficients: FloatArray) -> list[FloatArray]:
        """Amplitudes (q, c) of the rings in combinations of the kernels, cosine and sine."""
        return np.split(self.amplitudes @ coefficients, 2 * len(ORDERS))

    def combined(self, rings: FloatArray) -> FloatArray:
        """Columns (n, count) of the kernels by those of the rings, (n, 8 q)."""
        return rings @ self.amplitudes


def angular_departures(
    rings: AngularRings, fit: GaussianFit, columns: tuple[FloatArray, ...], noise: float
) -> AngularDepartures:
    """Choose the kernels about a Gaussian fit; ``noise`` is that of a point of weight one."""
    # ``columns``, standardised: data (n,), of the fit's parameters, of all radial departures and
    # of the rings, (n, p).
    from scipy.linalg import block_diag, null_space

    data, flat, radial, by_rings = (values / noise for values in columns)
    units = _unit_amplitudes(rings, fit.width)
    # Shifts of all scans along x and y, then the ellipse along x and along the diagonals.
    parameters = [*fit.shifts(flat).T, *flat[:, -2:].T]
    blocks = []
    for i, block in enumerate(np.split(by_rings, 2 * len(ORDERS), axis=1)):
        kernels = np.diag(fit.size * units[i // 2])
        if i < len(parameters):
            # All combinations that the scan can tell from that parameter.
            alike = parameters[i] @ (block @ kernels)
            kernels = kernels @ null_space(alike[None])
        blocks.append(kernels)
    order = np.repeat(np.arange(len(blocks)) // 2, [kernels.shape[1] for kernels in blocks])
    amplitudes = block_diag(*blocks)
    left, singular, _ = np.linalg.svd(np.hstack([flat, radial]), full_matrices=False)
    base = left[:, singular > _RESOLVED]
    free = by_rings @ amplitudes
    free -= base @ (base.T @ free)
    data -= base @ (base.T @ data)
    return AngularDepartures(rings, amplitudes * _expected_strengths(free, data, order)[order])


def _unit_amplitudes(rings: AngularRings, width: float) -> list[FloatArray]:
    """Amplitudes (q,) of the rings of each order whose expected L2 norm over the plane is one."""
    extent = _EXTENT * width
    r = np.linspace(0.0, 2 * _CUT * extent, 800)
    envelope = np.sqrt(rings.radius) * np.exp(-0.5 * (rings.radius / extent) ** 4)
    measure = np.pi * r * np.gradient(r)  # half of the plane's: that of a squared cosine
    profiles = [rings.radial(r, m) * envelope for m in ORDERS]
    return [envelope / np.sqrt(np.sum(measure @ each**2)) for each in profiles]


def _expected_strengths(columns: FloatArray, data: FloatArray, order: IndexArray) -> FloatArray:
    """Root mean square of each order's strength over its posterior, given the others'."""
    # With an ellipse orders mix: its shift has one of 1 and one of 3.
    square = columns.T @ columns
    product = columns.T @ data
    strengths = np.full(len(ORDERS), _FIRST)

    def log_marginal(trial: FloatArray) -> float:
        size = trial[order]
        root = np.linalg.cholesky(np.eye(size.size) + np.outer(size, size) * square)
        explained = np.linalg.solve(root, size * product)
        return float(0.5 * explained @ explained - np.log(np.diag(root)).sum())

    for _ in range(_SWEEPS):
        for i in range(strengths.size):
            trials = np.tile(strengths, (_STRENGTHS.size, 1))
            trials[:, i] = _STRENGTHS
            logs = np.array([log_marginal(trial) for trial in trials])
            probability = np.exp(logs - logs.max())
            strengths[i] = np.sqrt(probability @ _STRENGTHS**2 / probability.sum())
    return strengths
