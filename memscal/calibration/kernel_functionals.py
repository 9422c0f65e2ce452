"""Numbers read off G, with their derivatives: widths and the noise-equivalent area."""

from dataclasses import dataclass

import numpy as np

from memscal.axisymmetry.hankel import radial_spline, ring_areas
from memscal.axisymmetry.kernels import unit_gaussian, unit_gaussian_slope
from memscal.deconvolution.fourier_ratio import Field
from memscal.model.arrays import FloatArray

#: Points per step of the profile between which the half maximum is interpolated.
_FINE = 20


@dataclass(frozen=True, eq=False)
class Functional:
    """A number read off G: its parameter's name, its value, and its derivative by G(r)."""

    name: str
    value: float
    row: FloatArray


def kernel_functionals(field: Field, sigma: float) -> tuple[Functional, ...]:
    """Return the Gaussian width nearest to G, its half width and noise-equivalent area."""
    r, g = field.r, field.radial
    area = noise_area(r, g)
    of_noise = Functional("noise_equivalent_area", area, -2 * area**2 * ring_areas(r) * g)
    return (_gaussian_width(r, g, sigma), _half_width(r, g), of_noise)


def noise_area(r: FloatArray, g: FloatArray) -> float:
    """Noise-equivalent area (m^2) of G (1/m^2) at even radii: 4 pi sigma^2 of a Gaussian."""
    return float(1 / np.sum(ring_areas(r) * g**2))


def _gaussian_width(r: FloatArray, g: FloatArray, sigma: float) -> Functional:
    """Width of the Gaussian u nearest to G over the plane."""
    # Where the sum of r (u - G) u' vanishes: its change by G over its change by the width.
    slope, step = unit_gaussian_slope(r, sigma), 1e-4 * sigma
    bend = unit_gaussian_slope(r, sigma + step) - unit_gaussian_slope(r, sigma - step)
    left = unit_gaussian(r, sigma) - g
    row = r * slope / np.sum(r * (slope**2 + left * bend / (2 * step)))
    return Functional("gaussian_sigma_deconvolved", sigma, row)


def _half_width(r: FloatArray, g: FloatArray) -> Functional:
    """Diameter of the outermost circle where G is half of its maximum."""
    # With G(q) = G(m)/2, a change of G moves q by -(dG(q) - dG(m)/2) / G'(q).
    fine = np.linspace(r[0], r[-1], _FINE * r.size)
    values = radial_spline(r, g)(fine)
    top = int(np.argmax(values))
    last = min(int(np.flatnonzero(values >= values[top] / 2)[-1]), fine.size - 2)
    slope = (values[last + 1] - values[last]) / (fine[1] - fine[0])
    half = fine[last] + (values[top] / 2 - values[last]) / slope if slope else fine[last]
    row = _at(r, half) - 0.5 * _at(r, float(fine[top]))
    row = -2 * row / slope if slope else np.zeros_like(row)
    return Functional("fwhm", float(2 * half), row)


def _at(r: FloatArray, place: float) -> FloatArray:
    """Row that reads a profile at a radius, by linear interpolation."""
    row = np.zeros_like(r)
    i = int(np.clip(np.searchsorted(r, place) - 1, 0, r.size - 2))
    share = (place - r[i]) / (r[i + 1] - r[i])
    row[i], row[i + 1] = 1 - share, share
    return row
