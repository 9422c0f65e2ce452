r"""Rigid flat rod on a bonded film: the mixed boundary-value problem, frictionless or sticking.

Pressure and shear are sought as series whose Hankel transforms are spherical Bessel functions,

.. math::

    \hat p(k) = \frac{P}{2\pi} \sum_n a_n\, j_{2n}(ka), \qquad
    \hat q(k) = \frac{P}{2\pi} \sum_n b_n\, j_{2n+1}(ka),

which vanish outside the rod and carry the edge's square-root singularity: with
:math:`m = \sqrt{1 - r^2/a^2}` they are :math:`P_{2n}(m)/m` and :math:`(r/a)P'_{2n+1}(m)/m`.
Requiring the surface displacement to be :math:`\delta` (and the radial one to vanish, if the film
sticks) when weighted with each of these functions gives a symmetric, positive definite system.
The half-space's share of the matrix is known in closed form; the layer's share decays like
:math:`e^{-2kh}` and is summed by Gauss quadrature.

Convergence is exponential where the edge's singularity is the square root (frictionless, or
incompressible).  A sticking compressible film has an oscillating edge, exponents
:math:`-1/2 \pm i\ln(3-4\nu)/2\pi`: the number of terms is doubled until the base stress settles.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from memscal.axisymmetry.hankel import gauss_panels, quotient
from memscal.errors import ConvergenceError, DomainError
from memscal.mechanics.film_response import (
    HalfSpaceIntegrals,
    HankelField,
    corrections,
    half_space_coupling,
)
from memscal.model.arrays import BoolArray, FloatArray, array_record, slices
from memscal.model.film import ElasticFilm


def _series(terms: FloatArray, first: int) -> FloatArray:
    """Return the Legendre series of which every second term is given, from the first on."""
    series = np.zeros(2 * terms.size + 2)
    series[first:-2:2] = terms
    return series


def _alternating(terms: FloatArray) -> FloatArray:
    """Return terms of the finite Fourier transform: with signs that take turns."""
    return terms * (-1.0) ** np.arange(terms.size)


def spherical_bessel(count: int, x: FloatArray) -> FloatArray:
    """Return j_0 to j_(count-1) at ``x``, one row each: some hundred times faster than scipy."""
    # Miller's backward recurrence j_(l-1) = (2l+1) j_l/x - j_(l+1), normalised by the sum of
    # (2l+1) j_l^2, which is 1.  One sweep serves all orders.
    x = np.maximum(x, 1e-30)
    largest = np.max(x, initial=0.0)
    # From here upward the functions are below 1e-16 (Airy decay beyond the turning point).
    start = max(count, int(largest + 15 * (largest / 2) ** (1 / 3))) + 30
    rows = np.zeros((count, x.size))
    norm = np.zeros_like(x)
    above = np.zeros_like(x)
    current = np.ones_like(x)
    for order in range(start, -1, -1):
        if order < count:
            rows[order] = current
        norm += (2 * order + 1) * current**2
        below = (2 * order + 1) / x * current - above
        above = current
        current = below
        size = abs(current)
        if np.max(size, initial=0.0) > 1e100:
            scale = 1 / np.maximum(size, 1.0)
            above = above * scale
            current = current * scale
            norm = norm * scale**2
            rows[order:] *= scale
    return rows / np.sqrt(norm)


_FEWEST_TERMS = 8
_MOST_TERMS = 128
# Doubling of the terms stops when the stress at the base changes by less than this ...
_SETTLED = 1e-9
# ... and a solution that changes by more than this in the last doubling is refused.
_TOLERABLE = 1e-5
# A wider rod would need more terms; its film responds like a column at every point.
_WIDEST = 100.0
# x^2 exp(-2x) is below 1e-16 here: the layer's correction to the half-space ends.
_LARGEST_KH = 22.0
# Wavenumbers transformed together, which bounds the memory.
_CHUNK = 8192


@array_record
class RodTraction:
    """Traction under a rod of ``radius`` (m) and ``load`` (N): coefficients a_n and b_n."""

    radius: float
    load: float
    pressure_terms: FloatArray  # the first is 1
    shear_terms: FloatArray  # empty without friction

    def pressure(self, r: FloatArray) -> FloatArray:
        """Return the pressure at ``r`` (m) in Pa; zero from the edge outward."""
        _, m, under, scale = self._inside(r)
        # c_n = sqrt(pi) n! / Gamma(n + 1/2) gives each term the transform j_2n.
        series = _series(self.pressure_terms * _term_scale(self.pressure_terms.size), 0)
        return np.where(under, legendre.legval(m, series) / m * scale, 0.0)

    def shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction at ``r`` (m) in Pa; zero from the edge outward."""
        ratio, m, under, scale = self._inside(r)
        count = self.shear_terms.size
        series = _series(self.shear_terms * _term_scale(count) / (2 * np.arange(count) + 1), 1)
        values = ratio * legendre.legval(m, legendre.legder(series)) / m
        return np.where(under, values * scale, 0.0)

    def pressure_transform(self, k: FloatArray) -> FloatArray:
        """Return the pressure's Hankel transform at ``k`` (rad/m), in N."""
        return self._transform(self.pressure_terms, 0, k)

    def shear_transform(self, k: FloatArray) -> FloatArray:
        """Return the shear's Hankel transform at ``k`` (rad/m), in N."""
        return self._transform(self.shear_terms, 1, k)

    def half_space_integrals(self, r: FloatArray) -> HalfSpaceIntegrals:
        """Return the four integrals of :class:`InterfaceTraction` at ``r`` (m), in Pa m."""
        rho = r / self.radius
        # By j_2n(x) = (-1)^n int_0^1 P_2n(t) cos(xt) dt, of odd order with sines, and the Hankel
        # transforms of cosine and sine (Gradshteyn and Ryzhik 6.671); exact by Gauss quadrature.
        even = _series(_alternating(self.pressure_terms), 0)
        odd = _series(_alternating(self.shear_terms), 1)
        share, weights = gauss_panels(1.0, 1.0, even.size + 22)

        # t = c sin(theta) below c = min(rho, 1): the root sqrt(rho^2 - t^2) cancels against dt.
        inner = np.minimum(rho, 1.0)
        angle = np.arcsin(np.divide(inner, rho, out=np.ones_like(rho), where=rho > 0))
        t = rho[:, None] * np.sin(angle[:, None] * share)
        d_theta = angle[:, None] * weights
        pressed = legendre.legval(t, even)
        sheared = legendre.legval(t, odd)
        w_by_p = np.sum(d_theta * pressed, axis=1)
        inverse = quotient(1.0, rho)
        u_by_q = np.sum(d_theta * t * sheared, axis=1) * inverse

        # t^2 = rho^2 + s^2 beyond: the root sqrt(t^2 - rho^2) = s cancels against dt = s ds / t.
        top = np.sqrt(np.maximum(1 - rho**2, 0.0))
        t = np.sqrt(inner[:, None] ** 2 + (top[:, None] * share) ** 2)
        d_s = top[:, None] * weights
        w_by_q = np.sum(d_s * legendre.legval(t, odd) * quotient(1.0, t), axis=1)
        beyond = np.sum(d_s * legendre.legval(t, even), axis=1)
        u_by_p = (legendre.legval(1.0, legendre.legint(even, lbnd=0)) - beyond) * inverse
        unit = self.load / (2 * np.pi * self.radius)
        return w_by_p * unit, w_by_q * unit, u_by_p * unit, u_by_q * unit

    def _transform(self, terms: FloatArray, first: int, k: FloatArray) -> FloatArray:
        if terms.size == 0:
            return np.zeros(np.shape(k))
        flat = np.ravel(k) * self.radius
        sums = [
            terms @ spherical_bessel(2 * terms.size, flat[chunk])[first::2]
            for chunk in slices(flat.size, _CHUNK)
        ]
        values = self.load / (2 * np.pi) * np.concatenate(sums) if sums else flat
        return values.reshape(np.shape(k))

    def _inside(self, r: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, float]:
        """Return r/a, m, whether ``r`` is under the rod, and half the mean pressure in Pa."""
        ratio = r / self.radius
        under = ratio < 1
        m = np.sqrt(np.where(under, (1 - ratio) * (1 + ratio), 1.0))
        return ratio, m, under, self.load / (2 * np.pi * self.radius**2)


@array_record
class RodSolution:
    """Solution of the rod problem for one geometry, free of load and modulus."""

    stiffness_factor: float  # P / (2 E* a delta), the kappa of Hayes et al. (1972); 1: half-space
    pressure_terms: FloatArray
    shear_terms: FloatArray
    convergence: float  # of stiffness and base stress, from half the terms and a coarser rule

    def traction(self, radius: float, load: float) -> RodTraction:
        """Return the traction for a rod of ``radius`` (m) under ``load`` (N)."""
        return RodTraction(radius, load, self.pressure_terms, self.shear_terms)


@lru_cache(maxsize=256)
def solve_rod(radius_ratio: float, poisson_ratio: float, *, sticking: bool) -> RodSolution:
    """Solve for a rod of radius a on a film of thickness h; ``radius_ratio`` is a/h."""
    if radius_ratio > _WIDEST:
        raise DomainError(
            f"The rod's radius is {radius_ratio:g} times the film's thickness, but this solution "
            f"goes to {_WIDEST:g} times.",
            cure="Check the radius and the thickness, and their units.",
        )
    terms = _FEWEST_TERMS
    while True:
        coarse = _solve(radius_ratio, poisson_ratio, sticking, terms, order=12)
        terms = 2 * terms
        fine = _solve(radius_ratio, poisson_ratio, sticking, terms, order=16)
        change = _largest_change(fine, coarse, radius_ratio, poisson_ratio)
        if change < _SETTLED or terms == _MOST_TERMS:
            break
    if change > _TOLERABLE:
        raise ConvergenceError(
            f"Under a rod whose radius is {radius_ratio:g} times the film's thickness, the base "
            f"stress changes by {change:.1g} of its maximum in the last refinement.",
            why=f"The largest change allowed is {_TOLERABLE:g}.",
            cure="Use a narrower rod, a thicker film, or a rod that slides freely (friction 0).",
        )
    return replace(fine, convergence=change)


def _solve(ratio: float, nu: float, sticking: bool, terms: int, order: int) -> RodSolution:
    r"""Return the Galerkin solution, of unknown convergence.

    Its matrix is :math:`\int j_m(\xi) j_n(\xi) \{W, X, Y\}(\xi h/a)\,d\xi`, even rows before odd.
    """
    # The integrand turns at the rate 2 a in k, and the poles lie 0.74/h off the axis.
    xi, weights = gauss_panels(_LARGEST_KH * ratio, min(1.5 * ratio, 6.0), order)
    x = xi / ratio
    orders = spherical_bessel(2 * terms, xi)
    even = orders[::2]
    odd = orders[1::2]
    # Of the half-space: the integral of j_l^2 is pi/2(2l + 1).
    even_orders = 2 * np.arange(terms)
    matrix = np.diag(np.pi / (4 * even_orders + 2))
    by_normal, by_coupling, by_radial = corrections(x, nu)
    matrix += (even * (weights * by_normal)) @ even.T
    if sticking:
        radial = np.diag(np.pi / (4 * even_orders + 6))
        radial += (odd * (weights * by_radial)) @ odd.T
        # Of the half-space: the integral of j_l j_m is sin((l - m) pi/2)/((l - m)(l + m + 1)).
        apart = even_orders[:, None] - even_orders - 1
        both = even_orders[:, None] + even_orders + 1
        products = np.where(apart % 4 == 1, 1.0, -1.0) / (apart * (both + 1))
        coupling = half_space_coupling(nu) * products
        coupling += (even * (weights * by_coupling)) @ odd.T
        matrix = np.block([[matrix, coupling], [coupling.T, radial]])
    solution = np.linalg.solve(matrix, np.eye(1, len(matrix))[0])
    scaled = solution / solution[0]
    scaled.setflags(write=False)
    return RodSolution(float(np.pi / 2 * solution[0]), scaled[:terms], scaled[terms:], np.nan)


def _largest_change(fine: RodSolution, coarse: RodSolution, ratio: float, nu: float) -> float:
    """Return the relative change of stiffness and of the base stress under the same load."""
    # Of a usual size, in powers of two: nothing is rounded otherwise than of size one.
    h = 2.0**-10
    film = ElasticFilm(young_modulus=2.0**20, poisson_ratio=nu, thickness=h)
    r = h * np.linspace(0.0, ratio + 4.0, 60)
    tractions = (rod.traction(h * ratio, 1.0) for rod in (fine, coarse))
    new, old = (HankelField(film, traction).base(r, 0) for traction in tractions)
    by_stress = np.max(abs(new - old)) / np.max(abs(new))
    return float(max(by_stress, abs(fine.stiffness_factor / coarse.stiffness_factor - 1)))


def _term_scale(count: int) -> FloatArray:
    """Return sqrt(pi) n! / Gamma(n + 1/2) for n below ``count``."""
    n = np.arange(1, count)
    return np.append(1.0, np.cumprod(n / (n - 0.5)))
