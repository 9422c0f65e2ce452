"""Widths of G: of the nearest Gaussian, at half maximum, and its noise-equivalent area."""

import numpy as np

from memscal.axisymmetry.hankel import radial_spline, ring_areas
from memscal.axisymmetry.kernels import unit_gaussian, unit_gaussian_slope
from memscal.deconvolution.fourier_ratio import Field
from memscal.estimation.gaussian import gauss_newton, trust_region
from memscal.model.arrays import ArrayPair, FloatArray, array_record

#: Points per step of the profile between which the half maximum is interpolated.
_FINE = 20


def fit_gaussian(g: Field, start: float | None = None) -> float:
    r"""Width of the Gaussian of unit integral nearest to G over the plane: the paper's fit.

    Minimises :math:`\int (G - e^{-r^2/2\sigma^2}/2\pi\sigma^2)^2\, r\,dr`.  A width below half a
    step of the radial grid is not resolved.

    Parameters
    ----------
    g : Field
        G, in 1/m^2.
    start : float, optional
        Width from which the search starts, in m; by default that of a Gaussian with the same
        integral of the square.

    Returns
    -------
    float
        Standard deviation of the Gaussian, in m.

    Examples
    --------
    >>> import memscal, numpy as np
    >>> r = np.linspace(0, 6e-3, 241)
    >>> wide = memscal.lift(r, np.exp(-0.5 * (r / 0.6e-3) ** 2), 0.1e-3, 8e-3)
    >>> _, g = memscal.normalise(wide)
    >>> round(1e3 * memscal.fit_gaussian(g), 4)  # mm
    0.6
    """
    r = g.r
    root = np.sqrt(r)
    narrowest = 0.5 * float(r[1] - r[0])
    if start is None:
        start = float(1 / np.sqrt(4 * np.pi * g.grid.integrate(g.values**2)))
    start = max(start, 2 * narrowest)

    def linearise(scaled: FloatArray) -> ArrayPair:
        """Misfit at a width over ``start``, and its slope."""
        # A step may lead beyond the narrowest width, where the search with a bound takes over.
        sigma = max(scaled[0], narrowest / start) * start
        misfit = root * (unit_gaussian(r, sigma) - g.radial) * start**2
        slope = root * unit_gaussian_slope(r, sigma) * start**3
        return misfit, slope[:, None]

    begin = np.ones(1)
    width = gauss_newton(linearise, begin, tolerance=1e-10)
    if width is not None and width[0] * start > 2 * narrowest:
        return float(width[0] * start)
    bounds = (narrowest / start, np.inf)
    bounded = trust_region(linearise, begin, bounds=bounds, xtol=1e-12, ftol=1e-14, gtol=1e-14)
    return float(bounded.x[0] * start)


@array_record
class Functional:
    """A number read off G: its parameter's name, its value, and its derivative by G(r)."""

    name: str
    value: float
    row: FloatArray


def kernel_functionals(
    field: Field, sigma: float, hidden: FloatArray | float = 0.0
) -> tuple[Functional, ...]:
    """Return the Gaussian width nearest to G, its half width and noise-equivalent area."""
    # A window makes G wider: its half width is read with what the window hides.
    r = field.r
    g = field.radial
    # The noise-equivalent area is 4 pi sigma^2 of a Gaussian.
    rings = ring_areas(r)
    area = float(1 / np.sum(rings * g**2))
    noise_width = Functional("noise_equivalent_area", area, -2 * area**2 * rings * g)
    # The Gaussian u nearest to G over the plane: where the sum of r (u - G) u' vanishes, its change
    # by G over its change by the width.
    slope = unit_gaussian_slope(r, sigma)
    step = 1e-4 * sigma
    bend = unit_gaussian_slope(r, sigma + step) - unit_gaussian_slope(r, sigma - step)
    left = unit_gaussian(r, sigma) - g
    row = r * slope / np.sum(r * (slope**2 + left * bend / (2 * step)))
    nearest = Functional("gaussian_sigma_deconvolved", sigma, row)
    return nearest, _half_width(r, g + hidden), noise_width


def _half_width(r: FloatArray, g: FloatArray) -> Functional:
    """Diameter of the outermost circle where G is half of its maximum."""
    # With G(q) = G(m)/2, a change of G moves q by -(dG(q) - dG(m)/2) / G'(q).
    fine = np.linspace(r[0], r[-1], _FINE * r.size)
    values = radial_spline(r, g)(fine)
    top = np.argmax(values)
    last = min(np.flatnonzero(values >= values[top] / 2)[-1], fine.size - 2)
    slope = (values[last + 1] - values[last]) / (fine[1] - fine[0])
    half = fine[last] + (values[top] / 2 - values[last]) / slope if slope else fine[last]
    row = np.zeros_like(r)
    if slope:
        # A profile is read at a radius by linear interpolation, between even radii.
        for place, factor in ((half, -2 / slope), (fine[top], 1 / slope)):
            row += factor * np.maximum(1 - abs(place - r) / (r[1] - r[0]), 0.0)
    return Functional("fwhm", float(2 * half), row)
