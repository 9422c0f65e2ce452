r"""Departures that are free in the plane: an apparatus function that no centre orders.

They are sums of spots, round Gaussians of one width on a lattice about the best Gaussian, with
correlated amplitudes.  Their prior's standard deviation is an envelope; the correlation is Matern's
of order 1/2 or 5/2.  The first envelopes are elliptic, of several extents; further ones follow what
the scan shows, smoothed.  Envelopes, orders, lengths and logarithms of the strength are equally
probable at first; the covariance is averaged over their posterior.

What the scan cannot tell from a change of the Gaussian (A, width, centre, ellipse) is left to it.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from scipy.linalg import null_space
from scipy.special import logsumexp

from memscal.axisymmetry.kernels import Rings
from memscal.estimation.ellipse import bounded
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.model.arrays import BoolArray, FloatArray, array_record

#: Of more readings the columns of all spots take too much time and room.
MOST_READINGS = 20_000
#: Distance of spots over the Gaussian's smaller width, unless they are too many; their own width
#: over that.
_SPACING = 0.35
_MOST_SPOTS = 900
_BLUR = 0.7
#: Extents of the envelopes, in ellipses of the Gaussian; spots end at the cut.
_EXTENTS = (1.3, 2.3)
_CUT = 4.8
#: Lengths of the correlation, and of what an envelope follows, over the Gaussian's smaller width.
_LENGTHS = (0.4, 0.7, 1.2, 2.0)
_LOCAL = 1.5
_ROUNDS = 3
#: Expected sizes, over the Gaussian's L2 norm.
_STRENGTHS = np.geomspace(0.03, 3.0, 16)
#: Combinations that move no voltage by this share of the noise are not shown; kernels of less than
#: the second share of the largest variance are left out.
_SHOWN = 0.5
_NEGLIGIBLE = 1e-5


@array_record
class Spots:
    """Gaussians of unit integral on a lattice, and combinations of them that a scan shows."""

    axis: FloatArray  # (l,): of the lattice about the centre, in m
    used: BoolArray  # (l, l): by y and x, where there is one of the m spots
    width: float  # in m
    shown: FloatArray  # (m, c): orthonormal

    @classmethod
    def about(
        cls, fit: GaussianFit, model: ForwardModel, weights: FloatArray, noise: float
    ) -> Spots:
        """Spots about a Gaussian fit; ``noise`` is that of a point of weight one."""
        axes = np.linalg.eigvalsh(_moments(fit))
        step = max(
            _SPACING * np.sqrt(axes[0]),
            _CUT * np.sqrt(np.pi / _MOST_SPOTS) * np.prod(axes) ** 0.25,
        )
        half = np.ceil(_CUT * np.sqrt(axes[1]) / step)
        axis = step * np.arange(-half, half + 1)
        used = _ellipses(fit, np.stack(np.meshgrid(axis, axis), axis=-1)) < _CUT
        count = used.sum()
        every = cls(axis, used, _BLUR * step, np.eye(count))
        volts = fit.points.standardised(every.signal(model, fit.centre), weights)
        square, vectors = np.linalg.eigh(volts.T @ volts)
        # Of uncorrelated spots, as large together as the Gaussian.
        amplitude = fit.size * every.width * np.sqrt(4 * np.pi / count)
        shown = square * amplitude**2 > (_SHOWN * noise) ** 2
        return cls(axis, used, every.width, vectors[:, shown])

    @property
    def places(self) -> FloatArray:
        """Places from the centre, (2, m) in m."""
        return np.stack(np.meshgrid(self.axis, self.axis))[:, self.used]

    @property
    def rings(self) -> Rings:
        """The mean of each spot over directions."""
        radius = np.hypot(*self.places)
        return Rings(radius, np.full(radius.size, self.width), np.ones(radius.size))

    def signal(self, model: ForwardModel, centres: FloatArray) -> FloatArray:
        """Voltages of the combinations at the points, for centres (scans, 2) in m: (n, c), in V."""
        return model.spotted(self.places, self.width, centres) @ self.shown

    def at(self, x: FloatArray, y: FloatArray, amplitudes: FloatArray) -> FloatArray:
        """Sums of spots (m, c) on a grid about the centre: (y x, c), in units over m^2."""
        lattice = np.zeros((*self.used.shape, amplitudes.shape[1]))
        lattice[self.used] = amplitudes
        rows, columns = (
            np.exp(-0.5 * (np.subtract.outer(place, self.axis) / self.width) ** 2)
            for place in (y, x)
        )
        planes = rows @ np.moveaxis(lattice, 2, 0) @ (columns.T / (2 * np.pi * self.width**2))
        return planes.reshape(len(planes), -1).T


def _moments(fit: GaussianFit) -> FloatArray:
    """Second moments of the Gaussian, in m^2."""
    e1, e2 = bounded(fit.ellipticity)
    return fit.width**2 * np.array([[1 + e1, e2], [e2, 1 - e1]])


def _ellipses(fit: GaussianFit, places: FloatArray) -> FloatArray:
    """Distances of places (..., 2) from the centre, in ellipses of the Gaussian."""
    square = np.sum(places @ np.linalg.inv(_moments(fit)) * places, axis=-1)
    return np.asarray(np.sqrt(square))


@array_record
class PlaneDepartures:
    """Kernels of unit prior variance, each a sum of spots."""

    components: Spots
    amplitudes: FloatArray  # (m, count): of the spots, in V/Pa

    @property
    def count(self) -> int:
        """How many kernels there are."""
        return len(self.amplitudes.T)

    def mean(self, of: Callable[[Rings, FloatArray], FloatArray], place: FloatArray) -> FloatArray:
        """Means of the kernels over directions, or their transforms, at places (n,): (n, count)."""
        return of(self.components.rings, place) @ self.amplitudes

    def at(self, x: FloatArray, y: FloatArray, coefficients: FloatArray) -> FloatArray:
        """What of combinations (count, c) is not round, on a grid about the centre: (y x, c)."""
        from scipy.interpolate import CubicSpline

        spots = self.components
        amplitudes = self.amplitudes @ coefficients
        radius = np.hypot.outer(y, x).ravel()
        step = spots.width / _PER_WIDTH
        table = np.arange(0.0, radius.max(initial=0.0) + 4 * step, step)
        mean = CubicSpline(table, spots.rings.radial(table) @ amplitudes)(radius)
        return spots.at(x, y, amplitudes) - mean

    def signal(
        self, model: ForwardModel, centres: FloatArray, coefficients: FloatArray
    ) -> FloatArray:
        """Voltages of combinations (count, c) at the points, for centres in m: (n, c), in V."""
        return self.combined(self.components.signal(model, centres)) @ coefficients

    def combined(self, spots: FloatArray) -> FloatArray:
        """Columns (n, count) of the kernels by those of the spots' combinations, (n, c)."""
        return spots @ (self.components.shown.T @ self.amplitudes)


#: Radii of a table over the width of a spot.
_PER_WIDTH = 10


def plane_departures(
    spots: Spots, fit: GaussianFit, columns: tuple[FloatArray, ...], noise: float
) -> PlaneDepartures:
    """Choose the kernels about a Gaussian fit; ``noise`` is that of a point of weight one."""
    # ``columns``, standardised: data (n,), of the fit's parameters (n, p) and the spots (n, c).
    data, flat, by_spots = (values / noise for values in columns)
    base = np.linalg.qr(flat / np.linalg.norm(flat, axis=0))[0]
    left, singular, right = np.linalg.svd(
        by_spots - base @ (base.T @ by_spots), full_matrices=False
    )
    seen = (singular[:, None] * right) @ spots.shown.T
    square, vectors = np.linalg.eigh(_expected_covariance(spots, fit, seen, left.T @ data))
    kept = square > _NEGLIGIBLE * square[-1]
    amplitudes = vectors[:, kept] * np.sqrt(square[kept])
    # All combinations that the scan can tell from the Gaussian's parameters.
    parameters = np.hstack([flat[:, :2], fit.shifts(flat), flat[:, -2:]])
    parameters = parameters / np.linalg.norm(parameters, axis=0)
    alike = parameters.T @ by_spots @ (spots.shown.T @ amplitudes)
    return PlaneDepartures(spots, amplitudes @ null_space(alike))


def _expected_covariance(
    spots: Spots, fit: GaussianFit, seen: FloatArray, data: FloatArray
) -> FloatArray:
    """Covariance (m, m) of the amplitudes, averaged over the posterior of what makes it."""
    # ``seen`` (s, m), in units of the noise: voltages of the spots along what data (s,) are.
    places = spots.places
    apart = np.hypot(*(np.subtract.outer(place, place) for place in places))
    overlap = np.exp(-0.25 * (apart / spots.width) ** 2) / (4 * np.pi * spots.width**2)
    apart /= np.sqrt(np.linalg.eigvalsh(_moments(fit))[0])
    near = np.exp(-0.5 * (apart / _LOCAL) ** 2)
    distance = _ellipses(fit, places.T)
    envelopes = [1 / (1 + (distance / extent) ** 4) for extent in _EXTENTS]
    covariances = []
    logs = []
    for _ in range(_ROUNDS):
        for envelope, length, smooth in product(envelopes, _LENGTHS, (0, 1)):
            far = np.sqrt(1 + 4 * smooth) * apart / length
            form = (1 + smooth * (far + far**2 / 3)) * np.exp(-far)
            covariance = form * np.outer(envelope, envelope)
            covariances.append(covariance * (fit.size**2 / np.sum(covariance * overlap)))
            variance, turn = np.linalg.eigh(seen @ covariances[-1] @ seen.T)
            growth = 1 + np.outer(_STRENGTHS**2, np.maximum(variance, 0.0))
            logs.append(-0.5 * np.sum(np.log(growth) + (turn.T @ data) ** 2 / growth, axis=1))
        share = np.exp(np.array(logs) - logsumexp(logs)) @ _STRENGTHS**2
        expected = np.tensordot(share, covariances, 1)
        # The posterior mean's square over what this prior expects of it.
        by_data = expected @ seen.T
        gain = np.linalg.solve(seen @ by_data + np.eye(len(seen)), by_data.T).T
        growth = (near @ (gain @ data) ** 2) / (near @ np.sum(gain * by_data, axis=1))
        envelopes = [np.sqrt(np.diag(expected) * growth)]
    return expected
