r"""How an apparatus function may depart from a Gaussian: shapes of a few components each.

Every component is a ring of radius q, blurred by a Gaussian of width b, which has a closed form
on both sides of the Hankel transform,

.. math::

    a\,(\delta_q \otimes g_b)(r) = \frac{a}{2\pi b^2}\,e^{-(r^2+q^2)/2b^2} I_0(rq/b^2),
    \qquad a\,J_0(kq)\,e^{-b^2k^2/2} .

Components with random amplitudes make a random radial field: of correlation length
:math:`\sqrt2\,b` within an extent w, or, for rings of radius zero and many widths, one that
varies fast at the axis and slowly far from it.  Lengths are in units of the width of the best
Gaussian; a shape's strength is its expected size over the Gaussian's, both as root of the
integral of the square over the plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.special import i0e, j0

from memscal.axisymmetry.kernels import gaussian_transfer, unit_gaussian, unit_gaussian_slope
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.model.arrays import FloatArray

__all__ = ["SHAPES", "DepartureBasis", "Rings", "Shape", "departure_basis"]

#: A width below the sampling is not seen: rings are never narrower than this many steps.
_SMALLEST_WIDTH_IN_STEPS = 0.5
#: Neighbouring rings overlap: this share of their blur apart.
_SPACING = 0.7
_FEWEST_RINGS = 6
#: A field is cut at this multiple of its extent, where its envelope has fallen to 1e-5.
_REACH = 2.2
_SCALES = 12


@dataclass(frozen=True, eq=False)
class Rings:
    """Blurred rings: ``radius`` and ``blur`` in m, ``amplitude`` in V/Pa; each of shape (m,)."""

    radius: FloatArray
    blur: FloatArray
    amplitude: FloatArray

    def transform(self, k: FloatArray) -> FloatArray:
        """Hankel transforms at ``k`` (rad/m), shape (k, m)."""
        blurred = np.exp(-0.5 * np.multiply.outer(k, self.blur) ** 2)
        return np.asarray(self.amplitude * blurred * j0(np.multiply.outer(k, self.radius)))

    def radial(self, r: FloatArray) -> FloatArray:
        """Values at radii ``r`` (m), shape (r, m), in V/Pa/m^2."""
        square = self.blur**2
        # The scaled Bessel function carries exp(-rq/b^2), which completes the square.
        near = np.exp(-0.5 * np.subtract.outer(r, self.radius) ** 2 / square)
        bessel = i0e(np.multiply.outer(r, self.radius / square))
        return np.asarray(self.amplitude / (2 * np.pi * square) * near * bessel)

    @property
    def size(self) -> float:
        """Expected L2 norm over the plane of the sum with random signs, in V/Pa/m."""
        square = i0e(self.radius**2 / (2 * self.blur**2)) / (4 * np.pi * self.blur**2)
        return float(np.sqrt(np.sum(self.amplitude**2 * square)))


@dataclass(frozen=True)
class Shape:
    """A kind of departure, in units of the Gaussian's width.

    Parameters
    ----------
    name : str
        What it looks like.
    blur : float
        Finest width of its components.
    extent : float
        How far it reaches: of a field, the radius where its envelope falls; of scales, the
        largest width.
    scales : bool
        Gaussians of all widths from ``blur`` to ``extent`` about the axis, in place of rings of
        one blur.
    """

    name: str
    blur: float
    extent: float
    scales: bool = False

    def rings(self, width: float, amplitude: float) -> Rings:
        """Return its components about a Gaussian of a width (m) and an amplitude (V/Pa).

        They are scaled to the Gaussian's own L2 norm, so that a strength of one is as large.
        """
        if self.scales:
            blur = width * np.geomspace(self.blur, self.extent, _SCALES)
            plain = Rings(np.zeros(_SCALES), blur, np.ones(_SCALES))
        else:
            reach = _REACH * self.extent
            count = max(_FEWEST_RINGS, math.ceil(reach / (_SPACING * self.blur)))
            q = (np.arange(count) + 0.5) * reach / count
            envelope = np.sqrt(q) * np.exp(-0.5 * (q / self.extent) ** 4)
            plain = Rings(width * q, np.full(count, width * self.blur), envelope)
        gaussian = amplitude / (2 * np.sqrt(np.pi) * width)
        return Rings(plain.radius, plain.blur, plain.amplitude * gaussian / plain.size)


#: Edges (a disc, a plateau), a core of its own (a ring, a spike), and tails.
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


@dataclass(frozen=True, eq=False)
class DepartureBasis:
    """The kernels that an estimate is a combination of, about the best Gaussian.

    Parameters
    ----------
    conversion_constant, sigma : float
        The Gaussian, in V/Pa and m.
    flat : int
        How many parameters have no prior: A, width, centre, baseline and drift.
    rings : tuple of Rings
        The components of each of :data:`SHAPES`.
    """

    conversion_constant: float
    sigma: float
    flat: int
    rings: tuple[Rings, ...]

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Columns of each shape."""
        ends = self.flat + np.cumsum([0, *(ring.radius.size for ring in self.rings)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    def kernels(self, k: FloatArray) -> FloatArray:
        """Transforms of all columns at ``k`` (rad/m), shape (k, p).

        The first two are the derivatives of the Gaussian's by A and width; the other parameters
        without prior move no kernel and hold zeros.
        """
        gaussian = gaussian_transfer(k, self.sigma)
        widening = -self.conversion_constant * self.sigma * k**2 * gaussian
        return self._columns(gaussian, widening, [ring.transform(k) for ring in self.rings])

    def radial(self, r: FloatArray) -> FloatArray:
        """Values of all columns at radii ``r`` (m), shape (r, p)."""
        gaussian = unit_gaussian(r, self.sigma)
        widening = self.conversion_constant * unit_gaussian_slope(r, self.sigma)
        return self._columns(gaussian, widening, [ring.radial(r) for ring in self.rings])

    @cached_property
    def integrals(self) -> FloatArray:
        """Integrals of all columns over the plane, shape (p,)."""
        return np.asarray(self.kernels(np.zeros(1))[0])

    def _columns(
        self, gaussian: FloatArray, widening: FloatArray, rings: list[FloatArray]
    ) -> FloatArray:
        unmoved = np.zeros((gaussian.size, self.flat - 2))
        return np.hstack([gaussian[:, None], widening[:, None], unmoved, *rings])


def departure_basis(model: ForwardModel, fit: GaussianFit) -> DepartureBasis:
    """Return the kernels of the fit's own parameters and of every shape about it."""
    width = max(fit.sigma, _SMALLEST_WIDTH_IN_STEPS * model.points.step)
    rings = tuple(shape.rings(width, fit.conversion_constant) for shape in SHAPES)
    return DepartureBasis(fit.conversion_constant, fit.sigma, fit.jacobian.shape[1], rings)
