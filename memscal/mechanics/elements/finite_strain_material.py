r"""A neo-Hookean solid in its axisymmetric, mixed form.

The energy per undeformed volume is a function of the deformation gradient :math:`F` and of the
pressure :math:`p`, which is an unknown of its own,

.. math::

    \psi = \tfrac{G}{2}(\operatorname{tr}F^TF - 3) - G\,(J - 1) + \tfrac{\kappa}{2}(J - 1)^2
           - p\,(J - 1) - \frac{p^2}{2(K - \kappa)},
    \qquad J = \det F,\ K = \lambda + G,

so that :math:`p = -(K - \kappa)(J - 1)` where the solid is compressible, and :math:`J = 1` where
:math:`1/K = 0`: then this is the neo-Hookean solid, whatever stands for its compressibility.  For
small strain it is Hooke's law with Lame's constants :math:`\lambda` and :math:`G`.  The Cauchy
stress is :math:`\sigma = \tfrac{G}{J}FF^T - (G + p - \kappa(J - 1))\,1`.

The share :math:`\kappa` of the bulk modulus does not change the solid.  It holds the volume of
finite elements between the few points where the pressure does: without it they buckle under a
pressure of several G, which no film does (Auricchio et al., International Journal for Numerical
Methods in Engineering 95, 2013, describe the effect).

The form without a logarithm (Smith, de Goes and Kim, ACM Transactions on Graphics 37, 2018, 12,
eq. 13) is a polynomial in :math:`F`: Newton's method may pass through trial states in which the
film is turned inside out at the edge of a rod, and needs far fewer load steps.

Gradients stand as five numbers: :math:`F_{rr}, F_{rz}, F_{zr}, F_{zz}, F_{\theta\theta}`, where
:math:`F_{rz} = \partial r/\partial Z`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.model.film import ElasticFilm
from memscal.model.validation import FloatArray

__all__ = ["NeoHookean", "cofactor", "determinant"]

_PASCAL_TO_MPA = 1e-6
# Share of the bulk modulus that does not go through the pressure, in shear moduli: enough to keep
# elements from buckling, and too little to make them lock.
_HELD = 1.0


def determinant(F: FloatArray) -> FloatArray:
    """Return the volume ratio J of gradients of shape (..., 5)."""
    return np.asarray((F[..., 0] * F[..., 3] - F[..., 1] * F[..., 2]) * F[..., 4])


def cofactor(F: FloatArray) -> FloatArray:
    """Return the derivative of J by the gradient, shape (..., 5)."""
    rr, rz, zr, zz, hoop = np.moveaxis(F, -1, 0)
    parts = [zz * hoop, -zr * hoop, -rz * hoop, rr * hoop, rr * zz - rz * zr]
    return np.stack(parts, axis=-1)


@dataclass(frozen=True)
class NeoHookean:
    r"""The film's material.

    Parameters
    ----------
    shear_modulus : float
        :math:`G`, in MPa: with lengths in mm, the unknowns are then of like size.
    held : float
        :math:`\kappa`, in MPa.
    softness : float
        :math:`1/(K - \kappa)`, in 1/MPa; 0 where the film is incompressible.
    """

    shear_modulus: float
    held: float
    softness: float

    @classmethod
    def of(cls, film: ElasticFilm) -> NeoHookean:
        r"""Return the material with the film's moduli at small strain: K = G / (1 - 2 nu)."""
        G = film.shear_modulus * _PASCAL_TO_MPA
        compliance = (1 - 2 * film.poisson_ratio) / G  # 1/K
        held = _HELD * G / (1 + 2 * _HELD * G * compliance)
        return cls(G, held, compliance / (1 - held * compliance))

    def energy(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the stored energy per undeformed volume, shape (...), where p has settled."""
        G = self.shear_modulus
        strain = (np.sum(F**2, axis=-1) - 3) / 2 - (determinant(F) - 1)
        swelling = self.held / 2 * (determinant(F) - 1) ** 2
        return np.asarray(G * strain + swelling + self.softness / 2 * p**2)

    def _pressing(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return G + p - held (J - 1): minus the factor of the cofactor in the stress."""
        return np.asarray(self.shear_modulus + p - self.held * (determinant(F) - 1))

    def stress(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the nominal (first Piola-Kirchhoff) stress, shape (..., 5)."""
        return np.asarray(self.shear_modulus * F - self._pressing(F, p)[..., None] * cofactor(F))

    def tangent(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the derivative of the nominal stress by the gradient, shape (..., 5, 5)."""
        rr, rz, zr, zz, hoop = np.moveaxis(F, -1, 0)
        cof, pressing = cofactor(F), self._pressing(F, p)
        stiffness = self.held * cof[..., :, None] * cof[..., None, :]
        pairs = ((0, 3, hoop), (1, 2, -hoop), (0, 4, zz), (3, 4, rr), (1, 4, -zr), (2, 4, -rz))
        for i, j, second in pairs:  # second derivatives of J
            stiffness[..., i, j] -= pressing * second
            stiffness[..., j, i] -= pressing * second
        stiffness[..., range(5), range(5)] += self.shear_modulus
        return np.asarray(stiffness)

    def cauchy(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the Cauchy stress rr, zz, hoop and rz, tension positive, shape (..., 4)."""
        rr, rz, zr, zz, hoop = np.moveaxis(F, -1, 0)
        b = np.stack([rr**2 + rz**2, zr**2 + zz**2, hoop**2, rr * zr + rz * zz], axis=-1)
        stress = (self.shear_modulus / determinant(F))[..., None] * b
        stress[..., :3] -= self._pressing(F, p)[..., None]
        return np.asarray(stress)
