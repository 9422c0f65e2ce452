r"""Stress at the base of the film under a given surface traction.

.. math::

    \sigma_{zz}(r) &= \int_0^\infty (T\hat p - N\hat q)\,J_0(kr)\,k\,dk, \\
    \sigma_{rz}(r) &= -\int_0^\infty (S\hat p + R\hat q)\,J_1(kr)\,k\,dk,

the tractions of the base on the film (up and outward), with the transfer functions of
:mod:`memscal.mechanics.film_response`.  They fall like :math:`e^{-kh}`, so that a
finite range of wavenumbers carries everything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.special import j0, j1

from memscal.axisymmetry.hankel import gauss_panels
from memscal.mechanics.film_response import (
    base_normal_from_pressure,
    base_normal_from_shear,
    base_shear_from_pressure,
    base_shear_from_shear,
)
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm

# Depression by pressure and by shear, outward displacement by pressure and by shear.
HalfSpaceIntegrals = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


class InterfaceTraction(Protocol):
    """Axisymmetric pressure and radial shear on the surface; zero beyond ``radius``."""

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


# k h exp(-k h) is below 1e-15 here.
_LARGEST_KH = 38.0
# Phase, in rad, that one panel of the k-quadrature may span.
_PHASE = 14.0
# Distance from the contact, in thicknesses, beyond which the stress is below 1e-13 of its maximum:
# it decays as exp(-eta r/h), where i eta is the denominator's zero nearest to the real axis; eta
# falls from 1.19 at nu = 0 to 0.739 at nu = 1/2.
_DECAYED = 45.0
# Radii treated together: bounds the memory and lets near radii use fewer wavenumbers.
_CHUNK = 128


def base_normal_stress(
    elastic_film: ElasticFilm, traction: InterfaceTraction, r: FloatArray
) -> FloatArray:
    """Return the normal stress at the base at ``r`` (m) in Pa, accurate to 1e-13 of its maximum."""
    return _hankel_synthesis(
        elastic_film, traction, r, lambda k: base_normal_spectrum(elastic_film, traction, k), j0
    )


def base_normal_spectrum(
    elastic_film: ElasticFilm, traction: InterfaceTraction, k: FloatArray
) -> FloatArray:
    r"""Return :math:`\int\sigma_{zz}\,J_0(kr)\,r\,dr` of the base at ``k`` (rad/m), in N."""
    x, nu = k * elastic_film.thickness, elastic_film.poisson_ratio
    pressed = base_normal_from_pressure(x, nu) * traction.pressure_transform(k)
    return pressed - base_normal_from_shear(x, nu) * traction.shear_transform(k)


def base_shear_stress(
    elastic_film: ElasticFilm, traction: InterfaceTraction, r: FloatArray
) -> FloatArray:
    """Return the radial traction of the base on the film at ``r`` (m) in Pa, positive outward."""
    return _hankel_synthesis(
        elastic_film, traction, r, lambda k: base_shear_spectrum(elastic_film, traction, k), j1
    )


def base_shear_spectrum(
    elastic_film: ElasticFilm, traction: InterfaceTraction, k: FloatArray
) -> FloatArray:
    r"""Return :math:`\int\tau\,J_1(kr)\,r\,dr` of the base's traction on the film, in N."""
    x, nu = k * elastic_film.thickness, elastic_film.poisson_ratio
    pressed = base_shear_from_pressure(x, nu) * traction.pressure_transform(k)
    return -(pressed + base_shear_from_shear(x, nu) * traction.shear_transform(k))


def _hankel_synthesis(
    elastic_film: ElasticFilm,
    traction: InterfaceTraction,
    r: FloatArray,
    spectrum: Callable[[FloatArray], FloatArray],
    bessel: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Sum ``spectrum(k) bessel(k r) k dk`` at all radii, chunk by chunk of similar radii."""
    h = elastic_film.thickness
    flat = np.ravel(r)
    inside = np.flatnonzero(flat <= traction.radius + _DECAYED * h)
    order = inside[np.argsort(flat[inside], kind="stable")]
    stress = np.zeros_like(flat)
    for start in range(0, order.size, _CHUNK):
        chunk = order[start : start + _CHUNK]
        # The integrand turns at the rate r (Bessel function) + radius (transform of the traction);
        # 1.5/h keeps the panels short beside the distance of the transfer functions' poles.
        rate = flat[chunk[-1]] + traction.radius
        k, weights = gauss_panels(_LARGEST_KH / h, min(1.5 / h, _PHASE / rate))
        stress[chunk] = bessel(np.outer(flat[chunk], k)) @ (weights * k * spectrum(k))
    return stress.reshape(np.shape(r))
