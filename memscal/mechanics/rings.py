"""Tractions that are linear between concentric rings, and their Hankel transforms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import j0, j1

from memscal.axisymmetry.hankel import gauss_between
from memscal.mechanics.base_stress import HalfSpaceIntegrals
from memscal.mechanics.half_space import coupling_integrals, on_hats, singular_integrals
from memscal.model.arrays import FloatArray

# Bessel functions evaluated together, which bounds the memory.
_CHUNK = 4_000_000


@dataclass(frozen=True, eq=False)
class RingTraction:
    """Pressure and outward shear (Pa) linear between rings (m, from 0), zero beyond the last."""

    rings: FloatArray
    pressures: FloatArray
    shears: FloatArray

    @property
    def radius(self) -> float:
        """Radius outside which there is no traction, in m."""
        loaded = np.flatnonzero((self.pressures != 0) | (self.shears != 0))
        last = loaded[-1] + 1 if loaded.size else 0
        return float(self.rings[min(last, self.rings.size - 1)])

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
        singular = singular_integrals(r, self.rings)
        beyond, within = coupling_integrals(r, self.rings)
        return (
            singular[0] @ self.pressures,
            beyond @ self.shears,
            within @ self.pressures,
            singular[1] @ self.shears,
        )

    def _transform(self, values: FloatArray, k: FloatArray, order: int) -> FloatArray:
        flat = np.ravel(np.asarray(k, dtype=np.float64))
        transform = np.zeros_like(flat)
        if flat.size and np.any(values):
            used = self.rings <= self.radius
            rings = self.rings[used]
            s, weights = _nodes(rings, float(flat.max()))
            density = weights * s * np.interp(s, rings, values[used])
            bessel = (j0, j1)[order]
            size = max(1, _CHUNK // s.size)
            for start in range(0, flat.size, size):
                chunk = slice(start, start + size)
                transform[chunk] = bessel(np.multiply.outer(flat[chunk], s)) @ density
        return transform.reshape(np.shape(k))


def hat_transforms(rings: FloatArray, k: FloatArray) -> tuple[FloatArray, FloatArray]:
    r"""Return :math:`\int\phi_j\,J_n(kr)\,r\,dr` n = 0 and 1, shapes (k, rings), in m^2."""
    s, weights = _nodes(rings, float(k.max()))
    elements = rings.size - 1
    rising = ((s.reshape(elements, -1) - rings[:-1, None]) / np.diff(rings)[:, None]).ravel()
    transforms = []
    for bessel in (j0, j1):
        waves = bessel(np.multiply.outer(k, s)) * (weights * s)
        right = np.add.reduceat(waves * rising, np.arange(0, s.size, s.size // elements), axis=1)
        both = np.add.reduceat(waves, np.arange(0, s.size, s.size // elements), axis=1)
        transforms.append(on_hats(both - right, right))
    return transforms[0], transforms[1]


def _nodes(rings: FloatArray, fastest: float) -> tuple[FloatArray, FloatArray]:
    """Return Gauss nodes between the rings, enough for ``fastest`` rad/m in the widest gap."""
    phase = fastest * float(np.diff(rings).max())
    return gauss_between(rings, order=4 + math.ceil(0.7 * phase))
