r"""Surface of a film and of a half-space under tractions that are linear between rings.

A contact solver needs the displacements under pressure and radial shear that are linear between
the radii :math:`r_j` of concentric rings (the *hat* functions), taken at the same radii,
:math:`w_i = \sum_j C^{wp}_{ij}\,p_j + C^{wq}_{ij}\,q_j` and
:math:`u_i = \sum_j C^{up}_{ij}\,p_j + C^{uq}_{ij}\,q_j`, with the depression :math:`w` (positive
into the film) and the outward displacement :math:`u`.  Of a half-space they are, with
:math:`\beta = (1-2\nu)/2(1-\nu)`,

.. math::

    w(x) &= \frac{1-\nu}{G}\Big[\int L_{00}(x, s)\,p\,s\,ds - \beta\int_x^\infty q\,ds\Big], \\
    u(x) &= \frac{1-\nu}{G}\Big[\int L_{11}(x, s)\,q\,s\,ds
            - \frac{\beta}{x}\int_0^x p\,s\,ds\Big], \\
    L_{00} &= \frac{2}{\pi\max}\,K(t), \qquad L_{11} = \frac{2}{\pi\min}\,[K(t) - E(t)], \qquad
    t = \min(x, s)/\max(x, s)

(Johnson, Contact Mechanics, 1985, chapter 3).  Elements near the logarithmic singularity are
integrated with nodes that crowd there, others by a plain Gauss rule; both to about 1e-11.
"""

from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.special import ellipe, ellipkm1

from memscal.axisymmetry.hankel import gauss_panels, quotient
from memscal.model.arrays import ArrayPair, BoolArray, FloatArray, IndexArray, array_record


@array_record
class SurfaceCompliance:
    """Displacements at the rings by unit traction of every ring, in m/Pa."""

    r: FloatArray  # m, increasing from 0; a traction of the last ring falls to zero as a step
    whole: FloatArray  # depressions, then outward displacements, by pressures, then shears

    @property
    def radial(self) -> FloatArray:
        """Each ring's outward displacement by its own shear."""
        return np.diagonal(self.whole)[self.r.size :]

    @cached_property
    def products(self) -> FloatArray:
        r"""Integrals of products of hats over the surface, (n, n) in m^2."""
        left = self.r[:-1]
        right = self.r[1:]
        width = np.diff(self.r) * np.pi / 6
        inner, outer, across = (width * (a * left + b * right) for a, b in ((3, 1), (1, 3), (1, 1)))
        return np.diag(on_hats(inner, outer)) + np.diag(across, 1) + np.diag(across, -1)

    @cached_property
    def areas(self) -> FloatArray:
        r"""Integrals of the hats over the surface, in m^2: the load is ``areas @ p``."""
        return np.asarray(self.products.sum(axis=1))


class FilmField(Protocol):
    """The field in a film under given tractions at its two faces; radii in m, of any shape.

    Of order zero it is the normal component, of order one the radial one.
    """

    def base(self, r: FloatArray, order: int) -> FloatArray:
        """Return the stress at the base in Pa: in compression, or outward on the film."""

    def spectrum(self, k: FloatArray, order: int) -> FloatArray:
        r"""Return :math:`2\pi\int\sigma\,J_n(kr)\,r\,dr` of that stress at ``k`` (rad/m), in N."""

    def surface(self, r: FloatArray, order: int) -> FloatArray:
        """Return the displacement of the surface in m: into the film, or outward."""


def anticlockwise(points: FloatArray, triangles: IndexArray) -> IndexArray:
    """Return quadratic triangles (m, 6) of points (n, 2) with their nodes anticlockwise."""
    first, second, third = np.moveaxis(points[triangles[:, :3]], 1, 0)
    x, y = (second - first).T
    u, v = (third - first).T
    return np.where((x * v < u * y)[:, None], triangles[:, [0, 2, 1, 5, 4, 3]], triangles)


# Nodes of the plain rule: an element that is at least its own length away is exact to 1e-12.
_ORDER = 8
# Below this ratio of the radii a series is exact to 1e-13, above it the difference to 1e-11.
_ALIKE = 0.01
# Crowding: nodes v^5 with 24 Gauss points in v take the logarithm to 1e-12.
_NEAR_ORDER = 24
_CROWDING = 5


def singular_integrals(x: FloatArray, rings: FloatArray) -> ArrayPair:
    r"""Return :math:`\int L_{nn}(x_i, s)\,\phi_j\,s\,ds`, n = 0 and 1, shapes (x, rings), in m."""
    starts = rings[:-1]
    ends = rings[1:]
    lengths = ends - starts
    share, weights = gauss_panels(1.0, 1.0, _ORDER)
    s = starts[:, None] + lengths[:, None] * share
    hats = np.stack([1 - share, share])[:, None] * (s * lengths[:, None] * weights)
    kernels = _kernels(x[:, None, None], s[None], abs(x[:, None, None] - s))
    integrals = np.einsum("kmeo,heo->hkme", kernels, hats)
    near = np.maximum(starts - x[:, None], x[:, None] - ends) < lengths
    integrals[..., near] = _near_integrals(x, starts, ends, near)
    normal, radial = on_hats(*integrals)
    return normal, radial


def coupling_integrals(x: FloatArray, rings: FloatArray) -> ArrayPair:
    r"""Return :math:`\int_{x_i}^\infty\phi_j\,ds` and :math:`\int_0^{x_i}\phi_j\,s\,ds/x_i`."""
    starts = rings[:-1]
    lengths = rings[1:] - starts
    reach = np.clip((x[:, None] - starts) / lengths, 0.0, 1.0)
    # Integrals of 1 - v and v, and of their products with s = start + length v, up to ``reach``.
    falling = reach - reach**2 / 2
    rising = reach**2 / 2
    beyond = on_hats(lengths * (0.5 - falling), lengths * (0.5 - rising))
    left = lengths * (starts * falling + lengths * (rising - reach**3 / 3))
    within = on_hats(left, lengths * (starts * rising + lengths * reach**3 / 3))
    return beyond, quotient(within, x[:, None])


def on_hats(left: FloatArray, right: FloatArray) -> FloatArray:
    """Add the integrals of elements (last axis) with their falling and rising hats up to rings."""
    nothing = np.zeros_like(left[..., :1])
    return np.append(left, nothing, axis=-1) + np.append(nothing, right, axis=-1)


def _kernels(x: FloatArray, s: FloatArray, distance: FloatArray) -> ArrayPair:
    """Return L00 and L11; free of cancellation, also where x and s are close or far apart."""
    larger = np.maximum(x, s)
    smaller = np.minimum(x, s)
    complement = distance * (larger + smaller) / larger**2
    t = smaller / larger
    whole = ellipkm1(complement)
    # (K - E)/t, by its series where both are nearly equal.
    series = np.pi / 4 * t * (1 + 3 / 8 * t**2 + 15 / 64 * t**4)
    difference = (whole - ellipe(1 - complement)) / np.maximum(t, _ALIKE)
    scale = 2 / (np.pi * larger)
    return scale * whole, scale * np.where(t < _ALIKE, series, difference)


def _near_integrals(
    x: FloatArray, starts: FloatArray, ends: FloatArray, near: BoolArray
) -> FloatArray:
    """Integrate falling and rising hats over near elements, cut at the point, by each kernel."""
    point, element = np.nonzero(near)
    start = starts[element]
    end = ends[element]
    at = x[point]
    cut = np.clip(at, start, end)
    # Nodes on (0, 1) that crowd towards 0.
    u, weights = gauss_panels(1.0, 1.0, _NEAR_ORDER)
    v = u**_CROWDING
    weights = weights * _CROWDING * u ** (_CROWDING - 1)
    totals = np.zeros((2, 2, point.size))
    for side in (start, end):
        outside = np.flatnonzero(side != cut)
        width = (side - cut)[outside, None]
        s = cut[outside, None] + width * v
        distance = abs(at - cut)[outside, None] + abs(width) * v
        rising = (s - start[outside, None]) / (end - start)[outside, None]
        hats = np.stack([1 - rising, rising]) * (abs(width) * weights * s)
        kernels = _kernels(at[outside, None], s, distance)
        totals[..., outside] += np.einsum("kmo,hmo->hkm", kernels, hats)
    return totals
