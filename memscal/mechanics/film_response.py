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
large :math:`x`; a ``correction`` is the difference, free of cancellation.
They are evaluated with decaying exponentials, so that nothing overflows, and by a series where the
closed form would cancel.  All take ``x`` of any shape, from 0 to infinity, and Poisson's
ratio from 0 up to and including 0.5.  (For :math:`W` and :math:`T` see also Frétigny and
Chateauminois, J. Phys. D 40 (2007) 5418.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from memscal.model.arrays import FloatArray

# exp(-2 * 340) is still a normal number; beyond, every response has long reached its limit.
_LARGEST_X = 340.0
# Below this x a difference is summed as a series, exact to rounding with these terms.
_SERIES_BELOW = 0.5
_TERMS = 9


def half_space_coupling(poisson_ratio: float) -> float:
    r"""Coupling X of the half-space, :math:`-(1-2\nu)/2(1-\nu)`."""
    return -(1 - 2 * poisson_ratio) / (2 * (1 - poisson_ratio))


def normal_correction(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    """What the base takes from the half-space, :math:`W - 1`; decays as :math:`x^2 e^{-2x}`."""
    x, decay, denominator, kappa = _prepare(x, poisson_ratio)
    rest = kappa * decay + 2 * x + 2 * x**2 + (kappa**2 + 1) / 2
    return -2 * decay * rest / denominator


def radial_correction(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    r"""What the base takes from the half-space's compliance, :math:`Y - 1`."""
    x, decay, denominator, kappa = _prepare(x, poisson_ratio)
    rest = kappa * decay - 2 * x + 2 * x**2 + (kappa**2 + 1) / 2
    return -2 * decay * rest / denominator


def coupling_correction(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    r"""What the base adds to the half-space's coupling, :math:`X + (1-2\nu)/2(1-\nu)`."""
    nu = poisson_ratio
    x, decay, denominator, _ = _prepare(x, nu)
    return 2 * decay * (2 * x**2 + 4 * (1 - 2 * nu) * (1 - nu)) / denominator


def base_normal_from_pressure(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    r"""Base stress under a pressure, :math:`T = 4(1-\nu)(2(1-\nu)c + xs)/D`; 1 at x = 0."""
    nu = poisson_ratio
    x, decay, denominator, _ = _prepare(x, nu)
    numerator = 2 * (1 - nu) * (1 + decay) - x * np.expm1(-2 * x)
    return 4 * (1 - nu) * np.exp(-x) * numerator / denominator


def base_shear_from_pressure(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    r"""Shear stress at the base under a pressure, :math:`S = 4(1-\nu)(xc - (1-2\nu)s)/D`."""
    nu = poisson_ratio
    x, decay, denominator, _ = _prepare(x, nu)
    numerator = (1 - 2 * nu) * _x_cosh_minus_sinh(x, decay) + 2 * nu * x * (1 + decay)
    return 4 * (1 - nu) * np.exp(-x) * numerator / denominator


def base_normal_from_shear(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    r"""Base tension under an outward traction, :math:`N = 4(1-\nu)(xc + (1-2\nu)s)/D`."""
    nu = poisson_ratio
    x, decay, denominator, _ = _prepare(x, nu)
    numerator = x * (1 + decay) - (1 - 2 * nu) * np.expm1(-2 * x)
    return 4 * (1 - nu) * np.exp(-x) * numerator / denominator


def base_shear_from_shear(x: ArrayLike, poisson_ratio: float) -> FloatArray:
    r"""Base shear under a radial traction, :math:`R = 4(1-\nu)(2(1-\nu)c - xs)/D`."""
    nu = poisson_ratio
    x, decay, denominator, _ = _prepare(x, nu)
    numerator = 2 * (1 - nu) * (1 + decay) + x * np.expm1(-2 * x)
    return 4 * (1 - nu) * np.exp(-x) * numerator / denominator


def _prepare(
    x: ArrayLike, poisson_ratio: float
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return x, exp(-2x), 2 exp(-2x) D and kappa."""
    x = np.minimum(np.asarray(x, dtype=np.float64), _LARGEST_X)
    kappa = 3 - 4 * poisson_ratio
    decay = np.exp(-2 * x)
    denominator = kappa * (1 + decay**2) + decay * (4 * x**2 + kappa**2 + 1)
    return x, decay, denominator, kappa


def _x_cosh_minus_sinh(x: FloatArray, decay: FloatArray) -> FloatArray:
    """Return 2 exp(-x) (x cosh x - sinh x); below some x by its power series."""
    series = np.ones_like(x)
    for j in range(_TERMS - 1, 0, -1):
        series = 1 + x**2 / (2 * j * (2 * j + 3)) * series
    series *= 2 / 3 * np.exp(-x) * x**3
    return np.where(x < _SERIES_BELOW, series, x * (1 + decay) + np.expm1(-2 * x))
