r"""Radial functions and their Hankel transforms, of order zero and one.

The two-dimensional Fourier transform of an axisymmetric field is a Hankel transform,

.. math::

    \hat f(k) = 2\pi\int_0^\infty f(r)\,J_0(kr)\,r\,dr, \qquad
    f(r) = \frac{1}{2\pi}\int_0^\infty \hat f(k)\,J_0(kr)\,k\,dk,

so that :math:`\hat f(0)` is the integral of the field, and convolution is multiplication.

Of a radial vector field :math:`v(r)\,\hat r`, such as the shear at the base, every component is
:math:`v(r)\cos\theta`, and its transform one of order one,

.. math::

    \hat v(k) = 2\pi\int_0^\infty v(r)\,J_1(kr)\,r\,dr, \qquad
    v(r) = \frac{1}{2\pi}\int_0^\infty \hat v(k)\,J_1(kr)\,k\,dk .

Convolved with a radial function it stays a radial vector field, and the transforms are
multiplied: :math:`(G \otimes v\,\hat r)\,\hat{} = \hat G\,\hat v`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import j0, j1

from memscal.errors import InputError
from memscal.model.arrays import FloatArray

__all__ = [
    "RadialSpectrum",
    "Wavenumbers",
    "gauss_between",
    "gauss_panels",
    "hankel_transform",
    "radial_spline",
    "ring_areas",
]


def gauss_panels(upper: float, longest: float, order: int = 16) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of a composite Gauss-Legendre rule on [0, upper].

    Parameters
    ----------
    upper : float
        End of the range.
    longest : float
        Longest panel allowed.  With 16 nodes a panel integrates one or two oscillations
        (up to 16 rad of phase) to rounding; with 64, up to 100 rad.
    order : int
        Nodes in each panel.

    Examples
    --------
    >>> k, weights = gauss_panels(np.pi, longest=1.0)
    >>> round(float(weights @ np.sin(k)), 14)
    2.0
    """
    count = max(1, math.ceil(upper / longest))
    nodes, weights = _legendre(order)
    width = upper / count
    starts = width * np.arange(count)
    k = (starts[:, None] + width * (nodes + 1) / 2).ravel()
    return k, np.tile(width / 2 * weights, count)


def gauss_between(edges: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of Gauss-Legendre rules between neighbouring edges.

    Parameters
    ----------
    edges : ndarray, shape (n + 1,)
        Increasing ends of the panels.
    order : int
        Nodes in each panel.

    Examples
    --------
    >>> x, weights = gauss_between(np.array([0.0, 1.0, 3.0]), order=4)
    >>> round(float(weights @ x**3), 12)
    20.25
    """
    nodes, weights = _legendre(order)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (nodes + 1)).ravel(), (half * weights).ravel()


def ring_areas(r: FloatArray) -> FloatArray:
    """Weights that integrate a radial function over the plane, on even radii from zero.

    The trapezoidal rule with the Euler-Maclaurin correction of its end on the axis.
    """
    weights = 2 * np.pi * r * np.gradient(r)
    weights[0] += np.pi * (r[1] - r[0]) ** 2 / 6
    return np.asarray(weights)


@lru_cache(maxsize=8)
def _legendre(order: int) -> tuple[FloatArray, FloatArray]:
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return nodes, weights


# Panels of many nodes are nearly as good as one Gauss rule for all (pi nodes an oscillation),
# and their nodes are computed once.
_ORDER = 64
_PHASE = 90.0

# Two nodes for each interval of a table: more than a cubic spline through it can vary.
_TABLE_ORDER = 32
_INTERVALS_PER_PANEL = 16
_TABLE_PHASE = 40.0


@dataclass(frozen=True, eq=False)
class Wavenumbers:
    r"""Quadrature nodes in :math:`k`, on which radial spectra are kept.

    Parameters
    ----------
    k : ndarray, shape (n,)
        Nodes, in rad/m.
    weights : ndarray, shape (n,)
        Weights :math:`k\,dk / 2\pi` of the inverse transform, in rad^2/m^2.
    """

    k: FloatArray
    weights: FloatArray

    @classmethod
    def covering(cls, k_max: float, r_max: float) -> Wavenumbers:
        """Return nodes up to ``k_max`` (rad/m) that resolve radii up to ``r_max`` (m)."""
        k, dk = gauss_panels(k_max, _PHASE / r_max, _ORDER)
        return cls(k, k * dk / (2 * np.pi))

    def synthesise(self, spectrum: FloatArray, r: FloatArray, *, order: int = 0) -> FloatArray:
        """Evaluate the inverse transform at radii ``r`` (m), any shape.

        Of several spectra, shape (n, m), the values have a last axis of m.  A transform of
        ``order`` one gives the radial component of a vector field.
        """
        radii = np.asarray(r, dtype=np.float64)
        matrix = _bessel(order, np.multiply.outer(radii, self.k))
        return np.asarray(matrix @ (spectrum.T * self.weights).T)


@dataclass(frozen=True, eq=False)
class RadialSpectrum:
    r"""A radial function, held as its Hankel transform on quadrature nodes.

    Parameters
    ----------
    wavenumbers : Wavenumbers
        The nodes.
    values : ndarray, shape (n,)
        The transform there.
    order : int
        Zero for a scalar; one for the radial component of a vector field.
    """

    wavenumbers: Wavenumbers
    values: FloatArray
    order: int = 0

    @property
    def scalar(self) -> RadialSpectrum:
        r"""The scalar itself; of a vector field :math:`v = -\nabla\phi` its potential.

        The potential has the transform :math:`\hat v(k)/k`, which is finite at k = 0.
        """
        if self.order == 0:
            return self
        return RadialSpectrum(self.wavenumbers, self.values / self.wavenumbers.k)

    @property
    def integral(self) -> float:
        """Integral of :attr:`scalar` over the plane: its transform at k = 0, by parabola in k^2."""
        k2 = self.wavenumbers.k[:3] ** 2
        return float(np.polynomial.polynomial.polyfit(k2, self.scalar.values[:3], 2)[0])

    def at(self, r: FloatArray) -> FloatArray:
        """Evaluate the function, or the vector's radial component, at radii ``r`` (m)."""
        return self.wavenumbers.synthesise(self.values, r, order=self.order)


def radial_spline(
    r: FloatArray, f: FloatArray, *, order: int = 0
) -> Callable[[FloatArray], FloatArray]:
    """Return an even cubic spline through a radial table, an odd one for ``order`` one.

    The table is mirrored, so that the spline has no kink on the axis.
    """
    from scipy.interpolate import CubicSpline

    if r.size < 4:
        raise InputError(
            f"A radial table of {r.size} radii cannot be interpolated.", cure="Give four or more."
        )
    inner = slice(1, 4) if r[0] == 0 else slice(0, 3)
    mirrored_r = np.concatenate([-r[inner][::-1], r])
    mirrored_f = np.concatenate([-f[inner][::-1] if order else f[inner][::-1], f])
    spline = CubicSpline(mirrored_r, mirrored_f)
    return lambda radius: np.asarray(spline(radius))


def hankel_transform(r: FloatArray, f: FloatArray, k: FloatArray, *, order: int = 0) -> FloatArray:
    r"""Hankel transform of a tabulated radial function.

    An even cubic spline (an odd one for order one) through the table is integrated from 0 to
    ``r[-1]`` by Gauss-Legendre quadrature fine enough for the table and for the largest ``k``;
    beyond the table the function counts as zero.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Increasing radii, in m.
    f : ndarray, shape (n,)
        Values of the function there.
    k : ndarray, shape (m,)
        Wavenumbers, in rad/m.
    order : int
        Zero for a scalar; one for the radial component of a vector field.

    Returns
    -------
    ndarray, shape (m,)
        :math:`2\pi\int f J_n(kr) r\,dr`, in the unit of ``f`` times m^2.

    Examples
    --------
    A Gaussian of unit integral has the transform exp(-s^2 k^2 / 2):

    >>> r = np.linspace(0, 8, 400)
    >>> gaussian = np.exp(-(r**2) / 2) / (2 * np.pi)
    >>> bool(np.isclose(hankel_transform(r, gaussian, np.array([1.0]))[0], np.exp(-0.5)))
    True

    Its radial derivative is a vector field, of transform -k exp(-s^2 k^2 / 2):

    >>> slope = hankel_transform(r, -r * gaussian, np.array([2.0]), order=1)
    >>> bool(np.isclose(slope[0], -2 * np.exp(-2)))
    True
    """
    spline = radial_spline(r, f, order=order)
    nodes, weights = gauss_between(_panel_edges(r, float(np.max(np.abs(k)))), _TABLE_ORDER)
    measure = 2 * np.pi * weights * nodes
    return np.asarray(_bessel(order, np.multiply.outer(k, nodes)) @ (measure * spline(nodes)))


def _bessel(order: int, x: FloatArray) -> FloatArray:
    """Bessel function of the first kind, of order zero or one."""
    return np.asarray(j1(x) if order else j0(x))


def _panel_edges(r: FloatArray, fastest: float) -> FloatArray:
    """Ends of panels that hold few intervals of a table, and little phase of the kernel."""
    knots = np.unique(np.concatenate([[0.0], r[::_INTERVALS_PER_PANEL], r[-1:]]))
    pieces = np.maximum(np.ceil(np.diff(knots) * fastest / _TABLE_PHASE), 1).astype(int)
    starts = np.repeat(knots[:-1], pieces)
    widths = np.repeat(np.diff(knots) / pieces, pieces)
    within = np.concatenate([np.arange(count) for count in pieces])
    return np.append(starts + within * widths, knots[-1])
