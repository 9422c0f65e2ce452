r"""Surface of a half-space under a rod's traction, inside and outside its edge.

A spherical Bessel function is a finite Fourier transform of a Legendre polynomial,

.. math::

    j_{2n}(\xi) = (-1)^n \int_0^1 P_{2n}(t)\cos\xi t\,dt, \qquad
    j_{2n+1}(\xi) = (-1)^n \int_0^1 P_{2n+1}(t)\sin\xi t\,dt,

and the Hankel transforms of :math:`\cos\xi t` and :math:`\sin\xi t` are elementary, with a square
root at :math:`t = \rho` (Gradshteyn and Ryzhik 6.671).  With it taken out by a substitution,
Gauss quadrature in :math:`t` is exact to rounding at every radius.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from memscal.mechanics.traction import HalfSpaceIntegrals
from memscal.model.validation import FloatArray

__all__ = ["rod_integrals"]


def rod_integrals(
    rho: FloatArray, pressure_terms: FloatArray, shear_terms: FloatArray
) -> HalfSpaceIntegrals:
    r"""Return the integrals over :math:`\xi` of the transforms times :math:`J_0, J_1(\xi\rho)`.

    Parameters
    ----------
    rho : ndarray, shape (m,)
        Radii in units of the rod's.
    pressure_terms, shear_terms : ndarray, shape (n,)
        Coefficients of the even and the odd spherical Bessel functions.

    Returns
    -------
    tuple of four ndarray, shape (m,): of the pressure with J0, the shear with J0, the pressure
    with J1, and the shear with J1.
    """
    even, odd = _series(pressure_terms, 0), _series(shear_terms, 1)
    nodes, weights = np.polynomial.legendre.leggauss(max(even.size, odd.size) + 24)
    share, weights = (nodes + 1) / 2, weights / 2

    # t = c sin(theta) below c = min(rho, 1): the root sqrt(rho^2 - t^2) cancels against dt.
    inner = np.minimum(rho, 1.0)
    angle = np.arcsin(np.divide(inner, rho, out=np.ones_like(rho), where=rho > 0))
    theta = angle[:, None] * share
    t = rho[:, None] * np.sin(theta)
    d_theta = angle[:, None] * weights
    pressed, sheared = legendre.legval(t, even), legendre.legval(t, odd)
    w_by_p = np.sum(d_theta * pressed, axis=1)
    inverse = np.divide(1.0, rho, out=np.zeros_like(rho), where=rho > 0)
    u_by_q = np.sum(d_theta * t * sheared, axis=1) * inverse

    # t^2 = rho^2 + s^2 beyond: the root sqrt(t^2 - rho^2) = s cancels against dt = s ds / t.
    top = np.sqrt(np.maximum(1 - rho**2, 0.0))
    s = top[:, None] * share
    t = np.sqrt(inner[:, None] ** 2 + s**2)
    d_s = top[:, None] * weights
    reciprocal = np.divide(1.0, t, out=np.zeros_like(t), where=t > 0)
    w_by_q = np.sum(d_s * legendre.legval(t, odd) * reciprocal, axis=1)
    beyond = np.sum(d_s * legendre.legval(t, even), axis=1)
    whole = legendre.legval(1.0, legendre.legint(even, lbnd=0))
    u_by_p = (whole - beyond) * inverse
    return w_by_p, w_by_q, u_by_p, u_by_q


def _series(terms: FloatArray, first: int) -> FloatArray:
    """Return the Legendre series of the finite Fourier transform."""
    series = np.zeros(2 * max(terms.size, 1))
    if terms.size:
        series[first::2] = terms * (-1.0) ** np.arange(terms.size)
    return series
