r"""Bonded film by Hankel transforms: compliance of its surface, and the field below it.

The half-space's share of the compliance is in closed form (:mod:`memscal.mechanics.surface`).
What the rigid base adds falls off as :math:`(kh)^2 e^{-2kh}` and is summed by Gauss quadrature
over :math:`k`, in panels that resolve the oscillation of the Bessel functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import j0, j1

from memscal.axisymmetry.hankel import gauss_panels
from memscal.mechanics import film_response
from memscal.mechanics.film_response import HalfSpaceIntegrals, InterfaceTraction, RingTraction
from memscal.mechanics.surface import SurfaceCompliance, coupling_integrals, singular_integrals
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm

# x^2 exp(-2x) is below 1e-16 here: the layer's correction to the half-space ends.
_LARGEST_KH = 22.0
# Phase, in rad, that one panel of the k-quadrature may span.
_PHASE = 12.0


@dataclass(frozen=True, eq=False)
class HankelFilm:
    """A bonded film of infinite extent with tractions on rings of radii ``r`` (m), from 0."""

    film: ElasticFilm
    r: FloatArray

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Displacements of the rings under tractions on the rings."""
        film, r = self.film, self.r
        (w_by_p, u_by_q), (w_by_q, u_by_p) = singular_integrals(r, r), coupling_integrals(r, r)
        k, weights = _wavenumbers(film, 2 * r[-1])
        hats = film_response.hat_transforms(r, k)
        layer = _layer_integrals(film, r, (k, weights), hats)
        return SurfaceCompliance(r, *_displacements(film, (w_by_p, w_by_q, u_by_p, u_by_q), layer))

    @property
    def discretisation(self) -> str:
        """What was discretised, in words."""
        return "Hankel transforms, Gauss-Legendre in k"

    def field(self, pressure: FloatArray, shear: FloatArray) -> HankelField:
        """Return the field under ``pressure`` and ``shear`` (Pa) at the rings, shapes (n,)."""
        return HankelField(self.film, RingTraction(self.r, pressure, shear))


@dataclass(frozen=True, eq=False)
class HankelField:
    """The field in a film under a traction; see :class:`memscal.mechanics.surface.FilmField`."""

    film: ElasticFilm
    traction: InterfaceTraction

    def base_normal(self, r: FloatArray) -> FloatArray:
        """Return the normal stress at the base in Pa; zero where it is below 1e-13 of its peak."""
        return film_response.base_stress(self.film, self.traction, r)

    def base_shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction of the base on the film in Pa."""
        return film_response.base_stress(self.film, self.traction, r, order=1)

    def base_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\sigma_{zz}\,J_0(kr)\,r\,dr` at ``k`` (rad/m), in N."""
        return 2 * np.pi * film_response.base_spectrum(self.film, self.traction, k)

    def base_shear_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\tau\,J_1(kr)\,r\,dr` of the base shear at ``k``, in N."""
        return 2 * np.pi * film_response.base_spectrum(self.film, self.traction, k, order=1)

    def depression(self, r: FloatArray) -> FloatArray:
        """Return the normal displacement of the surface in m, positive into the film."""
        w_by_p, w_by_q, _, _ = self._surface(r)
        return np.asarray(w_by_p + w_by_q).reshape(np.shape(r))

    def outward(self, r: FloatArray) -> FloatArray:
        """Return the radial displacement of the surface in m, positive outward."""
        _, _, u_by_p, u_by_q = self._surface(r)
        return np.asarray(u_by_p + u_by_q).reshape(np.shape(r))

    def _surface(self, r: FloatArray) -> HalfSpaceIntegrals:
        x = np.ravel(np.asarray(r, dtype=np.float64))
        traction = self.traction
        k, weights = _wavenumbers(self.film, float(x.max(initial=0.0)) + traction.radius)
        transforms = traction.pressure_transform(k), traction.shear_transform(k)
        layer = _layer_integrals(self.film, x, (k, weights), transforms)
        return _displacements(self.film, traction.half_space_integrals(x), layer)


_Pair = tuple[FloatArray, FloatArray]


def _wavenumbers(film: ElasticFilm, reach: float) -> _Pair:
    """Return quadrature nodes for the layer's share, seen at distances up to ``reach``."""
    h = film.thickness
    return gauss_panels(_LARGEST_KH / h, min(1.5 / h, _PHASE / max(reach, h)))


def _layer_integrals(
    film: ElasticFilm, x: FloatArray, wavenumbers: _Pair, transforms: _Pair
) -> HalfSpaceIntegrals:
    """Return what the base takes from the surface's displacements at ``x``, times G/(1 - nu)."""
    (k, weights), (p, q) = wavenumbers, transforms
    kh, nu = k * film.thickness, film.poisson_ratio
    normal, radial = j0(np.multiply.outer(x, k)) * weights, j1(np.multiply.outer(x, k)) * weights
    coupling = film_response.coupling_correction(kh, nu)
    w_by_p = (normal * film_response.normal_correction(kh, nu)) @ p
    u_by_q = (radial * film_response.radial_correction(kh, nu)) @ q
    return w_by_p, (normal * coupling) @ q, (radial * coupling) @ p, u_by_q


def _displacements(
    film: ElasticFilm, half_space: HalfSpaceIntegrals, layer: HalfSpaceIntegrals
) -> HalfSpaceIntegrals:
    """Add both shares up to the depression by p and q, and the outward displacement by p and q."""
    nu = film.poisson_ratio
    scale, beta = (1 - nu) / film.shear_modulus, film_response.half_space_coupling(nu)
    return (
        scale * (half_space[0] + layer[0]),
        scale * (beta * half_space[1] + layer[1]),
        scale * (beta * half_space[2] + layer[2]),
        scale * (half_space[3] + layer[3]),
    )
