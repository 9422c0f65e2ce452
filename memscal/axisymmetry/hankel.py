r"""Radial functions and their Hankel transforms, of order zero and one.

The two-dimensional Fourier transform of an axisymmetric field is a Hankel transform,

.. math::

    \hat f(k) = 2\pi\int_0^\infty f(r)\,J_0(kr)\,r\,dr, \qquad
    f(r) = \frac{1}{2\pi}\int_0^\infty \hat f(k)\,J_0(kr)\,k\,dk,

so that :math:`\hat f(0)` is the integral of the field, and convolution is multiplication.

Of a radial vector field, such as the shear at the base, every component is
:math:`v(r)\cos\theta`, and its transform is one of order one, with :math:`J_1`.  Convolved with a
radial function it stays such a field, and the transforms are multiplied.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from scipy.special import j0, j1, jv

from memscal.errors import InputError
from memscal.model.arrays import (
    ArrayFunction,
    ArrayPair,
    FloatArray,
    array_record,
    floats,
    table_spline,
)


def gauss_panels(upper: float, longest: float, order: int = 16) -> ArrayPair:
    """Nodes and weights on [0, upper], in panels up to ``longest`` with ``order`` nodes each."""
    # To rounding 16 nodes integrate up to 16 rad of phase, 64 up to 100 rad.
    return gauss_between(np.linspace(0.0, upper, max(1, math.ceil(upper / longest)) + 1), order)


def gauss_between(edges: FloatArray, order: int) -> ArrayPair:
    """Return nodes and weights of Gauss-Legendre rules between increasing edges."""
    nodes, weights = _legendre(order)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (nodes + 1)).ravel(), (half * weights).ravel()


def ring_areas(r: FloatArray) -> FloatArray:
    """Weights (m^2) that integrate a radial function over the plane, on even radii from zero."""
    # The trapezoidal rule with the Euler-Maclaurin correction of its end on the axis.
    weights = 2 * np.pi * r * np.gradient(r)
    weights[0] += np.pi * (r[1] - r[0]) ** 2 / 6
    return weights


#: Order of a transform across lines: U(x) is the integral of U(k) cos(kx) dk/pi.
ACROSS = -1

_legendre = lru_cache(maxsize=8)(np.polynomial.legendre.leggauss)

# Panels of many nodes are nearly as good as one Gauss rule for all (pi nodes an oscillation),
# and their nodes are computed once.
_ORDER = 64
_PHASE = 90.0

# Two nodes for each interval of a table: more than a cubic spline through it can vary.
_TABLE_ORDER = 32
_INTERVALS_PER_PANEL = 16
_TABLE_PHASE = 40.0

#: Tables of Bessel functions of no more products are kept.
_MOST_KEPT = 300_000


@array_record
class Wavenumbers:
    r"""Quadrature nodes ``k`` (rad/m), weights :math:`k\,dk/2\pi` of the inverse transform."""

    k: FloatArray
    weights: FloatArray

    @classmethod
    def covering(cls, k_max: float, r_max: float) -> Wavenumbers:
        """Return nodes up to ``k_max`` (rad/m) that resolve radii up to ``r_max`` (m)."""
        k, dk = gauss_panels(k_max, _PHASE / r_max, _ORDER)
        return cls(k, k * dk / (2 * np.pi))

    def integrals(self, spectra: FloatArray) -> FloatArray:
        """Transforms (n,) or (n, m) at k = 0, by parabolas in k^2."""
        return np.asarray(np.polynomial.polynomial.polyfit(self.k[:3] ** 2, spectra[:3], 2)[0])

    def synthesise(self, spectrum: FloatArray, r: FloatArray, *, order: int = 0) -> FloatArray:
        """Evaluate the inverse transform at ``r`` (m); of spectra (n, m) along a last axis m."""
        radii = floats(r)
        if order == ACROSS:
            matrix = 2 * np.cos(np.multiply.outer(radii, self.k)) / self.k
        else:
            matrix = bessel_table(radii, self.k, order)
        return matrix @ (spectrum.T * self.weights).T


@array_record
class RadialSpectrum:
    """A radial function (a vector field's component for order 1) by its transform at nodes."""

    wavenumbers: Wavenumbers
    values: FloatArray
    order: int = 0  # ACROSS: of a field that is the same along lines, by the distance from one
    source: bool = False  # of a source that ends, not of a stress that decays as a film's does
    model: ClassVar[Any] = None  # of scans through it, where it is not the one of round fields

    @property
    def scalar(self) -> RadialSpectrum:
        r"""The scalar itself; of a vector field :math:`v = -\nabla\phi` its potential."""
        if self.order <= 0:
            return self
        return RadialSpectrum(self.wavenumbers, self.values / self.wavenumbers.k)

    @property
    def integral(self) -> float:
        """Integral of :attr:`scalar` over the plane: its transform at k = 0, by parabola in k^2."""
        return float(self.wavenumbers.integrals(self.scalar.values))

    def at(self, r: FloatArray) -> FloatArray:
        """Evaluate the function, or the vector's radial component, at radii ``r`` (m)."""
        return self.wavenumbers.synthesise(self.values, r, order=self.order)

    def plane(self, ky: FloatArray, kx: FloatArray) -> FloatArray:
        """Transform over the plane, (ky, kx); zero beyond the last node."""
        nodes = self.wavenumbers.k
        return up_to(nodes[-1], radial_spline(nodes, self.values), np.hypot.outer(ky, kx))


def radial_spline(r: FloatArray, f: FloatArray, *, order: int = 0) -> ArrayFunction:
    """Return an even (odd for ``order`` 1) cubic spline through a table, mirrored at the axis."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(*_mirrored(r, f, order))


def up_to(end: float, function: ArrayFunction, r: FloatArray) -> FloatArray:
    """Return a function's values at ``r``, zero beyond an end."""
    return np.where(r <= end, function(np.minimum(r, end)), 0.0)


def quotient(first: FloatArray | float, second: FloatArray) -> FloatArray:
    """Return one number over another, zero where that is zero: on an axis, or at a centre."""
    shape = np.broadcast(first, second).shape
    return np.divide(first, second, out=np.zeros(shape), where=second != 0)


def _mirrored(r: FloatArray, f: FloatArray, order: int) -> ArrayPair:
    """Continue a table beyond the axis by three radii."""
    if r.size < 4:
        raise InputError(
            f"A radial table of {r.size} radii cannot be interpolated.", cure="Give four or more."
        )
    inner = slice(3, 0, -1) if r[0] == 0 else slice(2, None, -1)
    sign = -1 if order else 1
    return np.append(-r[inner], r), np.concatenate([sign * f[inner], f])


def hankel_transform(r: FloatArray, f: FloatArray, k: FloatArray, *, order: int = 0) -> FloatArray:
    r"""Return :math:`2\pi\int f J_n(kr) r\,dr` at ``k`` of a table (r,) or (r, m) up to its end."""
    spline, sharp = table_spline(*_mirrored(r, f, order))
    knots = r if sharp else r[::_INTERVALS_PER_PANEL]
    knots = np.unique(np.concatenate([[0.0], knots, r[-1:]]))
    # Panels between knots that hold little of a phase.
    phases = np.diff(knots) * np.max(np.abs(k))
    pieces = np.maximum(np.ceil(phases / _TABLE_PHASE), 1).astype(int)
    places = np.append(0, np.cumsum(pieces))
    edges = np.interp(np.arange(places[-1] + 1), places, knots)
    nodes, weights = gauss_between(edges, _TABLE_ORDER)
    measure = 2 * np.pi * weights * nodes
    matrix = bessel(order, np.multiply.outer(k, nodes))
    return np.asarray(matrix @ (measure * spline(nodes).T).T)


def bessel(order: int, x: FloatArray, below: Sequence[FloatArray] = ()) -> FloatArray:
    """Bessel function of the first kind, of order zero or more; by those of two orders below."""
    if order < 2:
        return (j0, j1)[order](x)
    # Beyond the order the upward recurrence (DLMF 10.6.1) is stable, and faster.
    near = x <= order
    twice = 2 / np.where(near, 1.0, x)
    lower, value = below or (j0(x), j1(x))
    for n in range(order - 1 if below else 1, order):
        lower, value = value, n * twice * value - lower
    value[near] = jv(order, x[near])
    return value


def bessel_table(r: FloatArray, k: FloatArray, order: int = 0) -> FloatArray:
    """Bessel functions of all products, (r, k); scans of one layout share those that are kept."""
    if r.ndim != 1 or r.size * k.size > _MOST_KEPT:
        return bessel(order, np.multiply.outer(r, k))
    return _kept_table(r.tobytes(), k.tobytes(), order)


@lru_cache(maxsize=12)
def _kept_table(r: bytes, k: bytes, order: int) -> FloatArray:
    table = bessel(order, np.outer(np.frombuffer(r), np.frombuffer(k)))
    table.flags.writeable = False
    return table
