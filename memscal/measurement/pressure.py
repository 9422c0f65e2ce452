r"""Shapes of a contact's pressure and shear, by which a film is pressed.

A pressure :math:`p(r) \propto (1 - r^2/a^2)^m` of unit force has the transform

.. math::

    \Lambda_m(ka) = \Gamma(m+2)\,(2/ka)^{m+1} J_{m+1}(ka) = {}_0F_1(m+2;\,-k^2a^2/4),

from a flat punch (m = -1/2) over a sphere on a thick film (1/2) to one on a thin film that is
compressible (1) or not (2), and to a Gaussian (:math:`m \to \infty`).  With the width
:math:`s = a/\sqrt{2(m+2)}`, half of whose square is the mean square radius of each, the derivative
is :math:`\partial\Lambda_m/\partial s = -s k^2 \Lambda_{m+1}`.

Friction adds a shear :math:`q(r) = c\,p(r)\,r/2s`, whose transform of order one per newton is
:math:`c\,ks\,\Lambda_{m+1}/2`.  At the base it counts as the pressure :math:`-(N/T)\,q` with the
film's transfer functions (:mod:`memscal.mechanics.film_response`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import hyp0f1

from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.mechanics.film_response import base_normal_from_pressure, base_normal_from_shear
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm

__all__ = ["PressureShape", "film_transfer", "pressure_shapes"]

_EXPONENTS = (-0.5, 0.0, 0.5, 1.0, 2.0, math.inf)
#: Shears from none to full stick: spheres of a contact radius from half to twice the thickness.
_SHEARS_INCOMPRESSIBLE = (0.0, -0.2, -0.4)
_SHEARS_COMPRESSIBLE = (0.0, 0.1, 0.2)
#: Above this Poisson's ratio a pressed film flows outward under the indenter.
_FLOWING = 0.4


def film_transfer(film: ElasticFilm, k: FloatArray) -> FloatArray:
    """Transform of the base's normal stress under a pressure of unit transform."""
    return base_normal_from_pressure(k * film.thickness, film.poisson_ratio)


@dataclass(frozen=True)
class PressureShape:
    """A pressure of unit force with its shear, as an equivalent pressure on a film.

    Parameters
    ----------
    exponent : float
        m: how softly the pressure ends; infinite for a Gaussian.
    shear : float
        c: outward shear over pressure at the radius of two widths.
    film : ElasticFilm
        What is pressed.
    """

    exponent: float
    shear: float
    film: ElasticFilm

    def transform(self, k: FloatArray, width: float) -> FloatArray:
        """Transform at ``k`` (rad/m) for a width (m); one at k = 0."""
        plain = self._order(0, k, width)
        if self.shear == 0.0:
            return plain
        return np.asarray(plain - 0.5 * self._share(k) * k * width * self._order(1, k, width))

    def widening(self, k: FloatArray, width: float) -> FloatArray:
        """Derivative of :meth:`transform` by the width, in 1/m."""
        first = self._order(1, k, width)
        slope = -width * k**2 * first
        if self.shear == 0.0:
            return np.asarray(slope)
        m = self.exponent
        ratio = 1.0 if math.isinf(m) else (m + 2) / (m + 3)
        second = self._order(2, k, width)
        rise = k * first - ratio * width**2 * k**3 * second
        return np.asarray(slope - 0.5 * self._share(k) * rise)

    def _order(self, further: int, k: FloatArray, width: float) -> FloatArray:
        """Return the transform of the exponent m + further, at the radius a of this shape."""
        if math.isinf(self.exponent):
            return gaussian_transfer(k, width)
        square = 2 * (self.exponent + 2) * width**2
        return np.asarray(hyp0f1(self.exponent + further + 2, -square * k**2 / 4))

    def _share(self, k: FloatArray) -> FloatArray:
        x, nu = k * self.film.thickness, self.film.poisson_ratio
        ratio = base_normal_from_shear(x, nu) / base_normal_from_pressure(x, nu)
        return self.shear * ratio


def pressure_shapes(film: ElasticFilm) -> tuple[PressureShape, ...]:
    """Return the shapes that a restoration weighs against each other."""
    flowing = film.poisson_ratio > _FLOWING
    shears = _SHEARS_INCOMPRESSIBLE if flowing else _SHEARS_COMPRESSIBLE
    return tuple(PressureShape(m, c, film) for m in _EXPONENTS for c in shears)
