r"""The forward model in data space: voltages at the scan's points for a given G.

A radial kernel :math:`K` of transform :math:`\hat K(k)` gives, at distance :math:`R` from
the sensor's centre and per newton,

.. math::

    (K \otimes \sigma_{zz})(R) = \frac{1}{2\pi}\int \hat K(k)\,\hat\sigma(k)\,J_0(kR)\,k\,dk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import j0, j1

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.estimation.points import ScanPoints
from memscal.model.validation import FloatArray

__all__ = [
    "ForwardModel",
    "Geometry",
    "gaussian_transfer",
    "unit_gaussian",
    "unit_gaussian_slope",
]


def gaussian_transfer(k: FloatArray, sigma: float) -> FloatArray:
    r"""Transform :math:`\exp(-\sigma^2 k^2 / 2)` of the Gaussian of unit integral."""
    return np.asarray(np.exp(-0.5 * (sigma * k) ** 2))


def unit_gaussian(r: FloatArray, sigma: float) -> FloatArray:
    """Gaussian of unit integral over the plane, in 1/m^2."""
    return np.asarray(np.exp(-0.5 * (r / sigma) ** 2) / (2 * np.pi * sigma**2))


def unit_gaussian_slope(r: FloatArray, sigma: float) -> FloatArray:
    """Derivative of :func:`unit_gaussian` by its width, in 1/m^3."""
    return np.asarray(unit_gaussian(r, sigma) * ((r / sigma) ** 2 - 2) / sigma)


@dataclass(frozen=True, eq=False)
class Geometry:
    """Distances of the points from a trial centre, and Bessel functions there.

    ``radius`` (n,) in m; ``towards`` (2, n): derivatives of the radius by the centre's x
    and y; ``bessel0`` and ``bessel1`` (n, nodes).
    """

    radius: FloatArray
    towards: FloatArray
    bessel0: FloatArray
    bessel1: FloatArray


@dataclass(frozen=True, eq=False)
class ForwardModel:
    """Voltages at the points of a scan, for kernels given by their transforms.

    Parameters
    ----------
    points : ScanPoints
        Where and at what load.
    reference : RadialSpectrum
        Transform of the base stress per newton, dimensionless.
    """

    points: ScanPoints
    reference: RadialSpectrum

    @property
    def k(self) -> FloatArray:
        """Quadrature nodes, in rad/m."""
        return self.reference.wavenumbers.k

    @property
    def drift_columns(self) -> FloatArray:
        """Constant baseline and its linear drift across the scan, shape (n, 2 or 3).

        The drift's coordinates run from -1 to 1, so that every coefficient is in V.
        """
        columns = [np.ones_like(self.points.u), _unit_range(self.points.x)]
        if self.points.planar:
            columns.append(_unit_range(self.points.y))
        return np.stack(columns, axis=1)

    def geometry(self, centre: FloatArray) -> Geometry:
        """Return distances and Bessel functions for a trial centre (x0, y0), in m."""
        dx, dy = self.points.x - centre[0], self.points.y - centre[1]
        radius = np.hypot(dx, dy)
        # Repeats share their positions: each Bessel function is computed once.
        unique, back = np.unique(radius, return_inverse=True)
        argument = np.multiply.outer(unique, self.k)
        safe = np.where(radius > 0, radius, 1.0)
        towards = -np.stack([dx, dy]) / safe
        return Geometry(radius, towards, j0(argument)[back], j1(argument)[back])

    def signal(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Voltages for kernels in V/Pa by their transforms, shape (nodes,) or (nodes, m)."""
        measure = self.reference.wavenumbers.weights * self.reference.values
        spread = measure * kernel if kernel.ndim == 1 else measure[:, None] * kernel
        per_newton = geometry.bessel0 @ spread
        return self._times_load(per_newton)

    def centre_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by the centre, shape (n, 1), or (n, 2) in a raster."""
        measure = self.reference.wavenumbers.weights * self.reference.values
        slope = -(geometry.bessel1 @ (measure * self.k * kernel))
        both = (geometry.towards * slope * self.points.load).T
        return both if self.points.planar else both[:, :1]

    def _times_load(self, per_newton: FloatArray) -> FloatArray:
        load = self.points.load
        return np.asarray(per_newton * (load if per_newton.ndim == 1 else load[:, None]))


def _unit_range(positions: FloatArray) -> FloatArray:
    middle = (positions.max() + positions.min()) / 2
    return np.asarray((positions - middle) / (np.ptp(positions) / 2))
