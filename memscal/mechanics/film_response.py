r"""Response of a bonded film to surface tractions, wavenumber by wavenumber.

An elastic film of thickness :math:`h` is bonded to a rigid base and loaded on its surface by
a pressure :math:`p(r)` (positive in compression) and a radial traction :math:`q(r)` (positive
outward).  With the Hankel transforms :math:`\hat p = \int p\,J_0(kr)\,r\,dr` and
:math:`\hat q = \int q\,J_1(kr)\,r\,dr`, every field is a product in Hankel space.  With
:math:`x = kh` and the shear modulus :math:`G`, the depression of the surface is :math:`w` and
its outward displacement :math:`u`:

.. math::

    \hat w &= \frac{1-\nu}{Gk} (W \hat p + X \hat q), \qquad
    \hat u  = \frac{1-\nu}{Gk} (X \hat p + Y \hat q), \\
    \hat\sigma_{zz} &= T \hat p - N \hat q, \qquad\qquad\quad
    \hat\sigma_{rz} = S \hat p + R \hat q \quad\text{(at the base)}.

The two appearances of the coupling :math:`X` are one function: Betti's reciprocity.

The functions below are the exact solution of Navier's equations with zero displacement at the
base.  With :math:`\kappa = 3 - 4\nu`, :math:`c = \cosh x`, :math:`s = \sinh x`,

.. math::

    D &= \kappa\cosh 2x + 2x^2 + 5 - 12\nu + 8\nu^2, \\
    W &= (\kappa\sinh 2x - 2x)/D, \qquad Y = (\kappa\sinh 2x + 2x)/D, \\
    X &= (x^2 - \kappa(1-2\nu)s^2)/((1-\nu)D),

which tend to those of the half-space, :math:`W = Y = 1` and :math:`X = -(1-2\nu)/2(1-\nu)`, for
large :math:`x`; a ``correction`` is the difference, free of cancellation.  They are evaluated with
decaying exponentials, so that nothing overflows, and by a Bessel function where the closed form
would cancel.  All take ``x`` of any shape, from 0 to infinity, and Poisson's ratio from 0 to 0.5.
(For :math:`W` and :math:`T` see also Frétigny and Chateauminois, J. Phys. D 40 (2007) 5418.)

In space the half-space's share of the surface's compliance is in closed form
(:mod:`memscal.mechanics.surface`).  What the rigid base adds falls off as
:math:`(kh)^2 e^{-2kh}` and is summed by Gauss quadrature over :math:`k`, in panels that resolve
the oscillation of the Bessel functions.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ive

from memscal.axisymmetry.hankel import bessel, gauss_between, gauss_panels
from memscal.mechanics.surface import (
    SurfaceCompliance,
    coupling_integrals,
    on_hats,
    singular_integrals,
)
from memscal.model.arrays import ArrayPair, ArrayTriple, FloatArray, array_record, floats, slices
from memscal.model.film import ElasticFilm

# exp(-2 * 340) is still a normal number; beyond, every response has long reached its limit.
_LARGEST_X = 340.0


def half_space_coupling(nu: float) -> float:
    r"""Coupling X of the half-space, :math:`-(1-2\nu)/2(1-\nu)`."""
    return -(1 - 2 * nu) / (2 * (1 - nu))


def corrections(x: ArrayLike, nu: float) -> ArrayTriple:
    r"""What the base adds to the half-space, :math:`W - 1, X + (1-2\nu)/2(1-\nu), Y - 1`."""
    # They decay as x^2 exp(-2x).
    x, decay, denominator, kappa = _prepare(x, nu)
    both = 2 * kappa * decay + 4 * x**2 + kappa**2 + 1
    normal = -decay * (both + 4 * x) / denominator
    coupling = 2 * decay * (2 * x**2 + 4 * (1 - 2 * nu) * (1 - nu)) / denominator
    radial = -decay * (both - 4 * x) / denominator
    return normal, coupling, radial


def base_response(x: ArrayLike, nu: float, order: int = 0) -> ArrayPair:
    r"""Base stress by a pressure, and tension by an outward traction: T (1 at x = 0) and N.

    :math:`T = 4(1-\nu)(2(1-\nu)c + xs)/D` and :math:`N = 4(1-\nu)(xc + (1-2\nu)s)/D`; of ``order``
    one the shear stress at the base by a pressure, and by a radial traction: S and R.
    :math:`S = 4(1-\nu)(xc - (1-2\nu)s)/D` and :math:`R = 4(1-\nu)(2(1-\nu)c - xs)/D`.
    """
    x, decay, denominator, _ = _prepare(x, nu)
    scale = 4 * (1 - nu) * np.exp(-x)
    rising = 2 * (1 - nu) * (1 + decay)
    falling = np.expm1(-2 * x)
    if order:
        # 2 exp(-x) (x cosh x - sinh x), free of cancellation: a spherical Bessel function.
        difference = np.sqrt(2 * np.pi) * x**1.5 * ive(1.5, x)
        by_pressure = (1 - 2 * nu) * difference + 2 * nu * x * (1 + decay)
        by_shear = rising + x * falling
    else:
        by_pressure = rising - x * falling
        by_shear = x * (1 + decay) - (1 - 2 * nu) * falling
    return scale * by_pressure / denominator, scale * by_shear / denominator


def _prepare(x: ArrayLike, nu: float) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return x, exp(-2x), 2 exp(-2x) D and kappa."""
    x = np.minimum(x, _LARGEST_X)
    kappa = 3 - 4 * nu
    decay = np.exp(-2 * x)
    return x, decay, kappa * (1 + decay**2) + decay * (4 * x**2 + kappa**2 + 1), kappa


# Depression by pressure and by shear, outward displacement by pressure and by shear.
HalfSpaceIntegrals = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


class InterfaceTraction(Protocol):
    """Axisymmetric pressure and radial shear on the surface; zero beyond ``radius``.

    Examples
    --------
    >>> import memscal
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = memscal.indent(film, memscal.Sphere(radius=0.1), load=0.5, friction=0.1)
    >>> float(contact.traction.pressure(2 * contact.traction.radius))  # outside of the contact, Pa
    0.0
    """

    @property
    def radius(self) -> float:
        """Radius outside which there is no traction, in m."""

    def pressure(self, r: FloatArray) -> FloatArray:
        """Return the pressure at the radii ``r`` (m), in Pa, positive in compression."""

    def shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction on the film at ``r`` (m), in Pa, positive outward."""

    def pressure_transform(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`\int p\,J_0(kr)\,r\,dr` at ``k`` (rad/m), in N."""

    def shear_transform(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`\int q\,J_1(kr)\,r\,dr` at ``k`` (rad/m), in N."""

    def half_space_integrals(self, r: FloatArray) -> HalfSpaceIntegrals:
        """Integrals over k of p, q times J0, then of p, q times J1, at ``r`` (m), in Pa m."""


# k h exp(-k h) is below 1e-15 here; the layer's correction to the half-space ends at 22.
_LARGEST_KH = 38.0
# Phase, in rad, that one panel of the k-quadrature may span.
_PHASE = 12.0
# Distance from the contact, in thicknesses, beyond which the stress is below 1e-13 of its maximum:
# it decays as exp(-eta r/h), where i eta is the denominator's zero nearest to the real axis; eta
# falls from 1.19 at nu = 0 to 0.739 at nu = 1/2.
_DECAYED = 45.0
# Radii treated together: bounds the memory and lets near radii use fewer wavenumbers.
_BASE_STRESS_CHUNK = 128


@array_record
class RingTraction:
    """Pressure and outward shear (Pa) linear between rings (m, from 0), zero beyond the last."""

    rings: FloatArray
    pressures: FloatArray  # (n,), or (n, m) of several tractions
    shears: FloatArray

    @property
    def radius(self) -> float:
        """Radius outside which there is no traction, in m."""
        loaded = np.flatnonzero((self.pressures != 0) | (self.shears != 0))
        return float(self.rings[min(loaded.max(initial=-1) + 1, self.rings.size - 1)])

    def pressure(self, r: FloatArray) -> FloatArray:
        """Return the pressure at ``r`` (m), in Pa."""
        return np.interp(r, self.rings, self.pressures, right=0.0)

    def shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction on the film at ``r`` (m), in Pa, positive outward."""
        return np.interp(r, self.rings, self.shears, right=0.0)

    def pressure_transform(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`\int p\,J_0(kr)\,r\,dr` at ``k`` (rad/m), in N."""
        return self._transform(self.pressures, k, order=0)

    def shear_transform(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`\int q\,J_1(kr)\,r\,dr` at ``k`` (rad/m), in N."""
        return self._transform(self.shears, k, order=1)

    def half_space_integrals(self, r: FloatArray) -> HalfSpaceIntegrals:
        """Return the four integrals of :class:`InterfaceTraction` at ``r`` (m), in Pa m."""
        q = self.shears
        singular = singular_integrals(r, self.rings)
        beyond, within = coupling_integrals(r, self.rings)
        return singular[0] @ self.pressures, beyond @ q, within @ self.pressures, singular[1] @ q

    def _transform(self, values: FloatArray, k: FloatArray, order: int) -> FloatArray:
        flat = np.ravel(floats(k))
        several = values.shape[1:]
        transform = np.zeros((flat.size, *several))
        if np.any(values):
            for chunk in slices(flat.size, _CHUNK):
                hats = hat_transform(self.rings.tobytes(), flat[chunk].tobytes(), order)
                transform[chunk] = hats @ values
        return transform.reshape(np.shape(k) + several)


#: Wavenumbers that are treated together: bounds the memory.
_CHUNK = 2048


@lru_cache(maxsize=8)
def hat_transform(ring_bytes: bytes, k_bytes: bytes, order: int) -> FloatArray:
    r"""Return :math:`\int\phi_j\,J_n(kr)\,r\,dr` of an order n, shape (k, rings), in m^2."""
    # The contacts of a path share them: the arguments are the arrays' content.
    rings = np.frombuffer(ring_bytes)
    k = np.frombuffer(k_bytes)
    widths = np.diff(rings)
    # Gauss nodes between the rings, enough for the largest wavenumber in the widest gap.
    count = 4 + math.ceil(0.7 * (k.max() * widths.max()))
    s, weights = gauss_between(rings, count)
    waves = bessel(order, np.outer(k, s)) * (weights * s)
    waves = waves.reshape(k.size, widths.size, count)
    rising, _ = gauss_panels(1.0, 1.0, count)
    right = waves @ rising
    return on_hats(waves.sum(axis=2) - right, right)


@array_record
class HankelFilm:
    """A bonded film of infinite extent with tractions on rings of radii ``r`` (m), from 0."""

    film: ElasticFilm
    r: FloatArray

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Displacements of the rings under tractions on the rings."""
        unit = np.eye(self.r.size)
        moved = self.field(unit, unit).displacements(self.r)
        return SurfaceCompliance(self.r, np.block([[*moved[:2]], [*moved[2:]]]))

    discretisation = "Hankel transforms, Gauss-Legendre in k"

    def field(self, pressure: FloatArray, shear: FloatArray) -> HankelField:
        """Return the field under ``pressure`` and ``shear`` (Pa) at the rings, shapes (n,)."""
        return HankelField(self.film, RingTraction(self.r, pressure, shear))


@array_record
class HankelField:
    """The field in a film under a traction; base stresses below 1e-13 of their peak are zero."""

    film: ElasticFilm
    traction: InterfaceTraction

    def base(self, r: FloatArray, order: int) -> FloatArray:
        """Return normal stress or outward traction at the base in Pa."""
        flat = np.ravel(r)
        reach = self.traction.radius
        inside = np.flatnonzero(flat <= reach + _DECAYED * self.film.thickness)
        sorting = inside[np.argsort(flat[inside], kind="stable")]
        stress = np.zeros_like(flat)
        for some in slices(sorting.size, _BASE_STRESS_CHUNK):
            chunk = sorting[some]
            # The integrand turns at the rate r (Bessel function) + reach (the transform).
            k, weights = _wavenumbers(self.film, flat[chunk[-1]] + reach)
            density = weights * k * self._transform(k, order)
            stress[chunk] = bessel(order, np.outer(flat[chunk], k)) @ density
        return stress.reshape(np.shape(r))

    def spectrum(self, k: FloatArray, order: int) -> FloatArray:
        """Return the transform of normal stress or traction at ``k`` (rad/m), in N."""
        return 2 * np.pi * self._transform(k, order)

    def _transform(self, k: FloatArray, order: int) -> FloatArray:
        r"""Return :math:`T\hat p - N\hat q`; of order one :math:`-(S\hat p + R\hat q)`; in N."""
        by_pressure, by_shear = base_response(
            k * self.film.thickness, self.film.poisson_ratio, order
        )
        pressed = by_pressure * self.traction.pressure_transform(k)
        sheared = by_shear * self.traction.shear_transform(k)
        return -(pressed + sheared) if order else pressed - sheared

    def surface(self, r: FloatArray, order: int) -> FloatArray:
        """Return depression or outward displacement of the surface in m."""
        by_pressure, by_shear = self.displacements(np.ravel(r))[2 * order : 2 * order + 2]
        return (by_pressure + by_shear).reshape(np.shape(r))

    def displacements(self, x: FloatArray) -> HalfSpaceIntegrals:
        """Return depression by pressure and by shear, then outward displacement, at ``x`` (m)."""
        film = self.film
        traction = self.traction
        nu = film.poisson_ratio
        scale = (1 - nu) / film.shear_modulus
        beta = half_space_coupling(nu)
        k, weights = _wavenumbers(film, x.max(initial=0.0) + traction.radius)
        p = traction.pressure_transform(k)
        q = traction.shear_transform(k)
        half_space = traction.half_space_integrals(x)
        by_normal, coupling, by_radial = corrections(k * film.thickness, nu)
        normal, radial = (bessel(order, np.outer(x, k)) * weights for order in (0, 1))
        return (
            scale * (half_space[0] + (normal * by_normal) @ p),
            scale * (beta * half_space[1] + (normal * coupling) @ q),
            scale * (beta * half_space[2] + (radial * coupling) @ p),
            scale * (half_space[3] + (radial * by_radial) @ q),
        )


def _wavenumbers(film: ElasticFilm, reach: float) -> ArrayPair:
    """Return quadrature nodes for layer and base, seen at distances up to ``reach``."""
    # 1.5/h keeps the panels short beside the distance of the transfer functions' poles.
    h = film.thickness
    return gauss_panels(_LARGEST_KH / h, min(1.5 / h, _PHASE / max(reach, h)))
