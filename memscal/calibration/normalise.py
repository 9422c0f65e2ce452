"""From the quotient of the fields to A and G, and the Gaussian fitted to G."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.calibration.fields import KernelView
from memscal.errors import FitError
from memscal.estimation.forward import unit_gaussian, unit_gaussian_slope
from memscal.estimation.newton import gauss_newton
from memscal.model.validation import FloatArray

__all__ = ["NormalisedKernel", "fit_gaussian_to_kernel", "normalise"]


@dataclass(frozen=True, eq=False)
class NormalisedKernel:
    """A and G, from the quotient of the fields.

    Parameters
    ----------
    conversion_constant : float
        Integral of A G over the support, in V/Pa.
    view : KernelView
        G on its support, of integral one, in 1/m^2.
    gaussian_sigma : float
        Standard deviation of the Gaussian of unit integral nearest to G, in m.
    """

    conversion_constant: float
    view: KernelView
    gaussian_sigma: float


def normalise(view: KernelView, start: float) -> NormalisedKernel:
    """Split A G so that G integrates to one: the paper's definition of A.

    Parameters
    ----------
    view : KernelView
        A G on its support, in V/Pa/m^2.
    start : float
        Width from which the fit of the Gaussian starts, in m.

    Raises
    ------
    FitError
        If A G does not add up to a positive number.
    """
    a = view.integral
    if not a > 0:
        raise FitError(
            f"The quotient of the fields adds up to {a:.3g} V/Pa.",
            why="A conversion constant is positive.",
            cure="Look at the deconvolved field; choose another method or less regularisation.",
        )
    unit = KernelView(view.x, view.y, view.plane / a, view.r, view.radial / a, 1.0)
    return NormalisedKernel(a, unit, fit_gaussian_to_kernel(unit.r, unit.radial, start))


def fit_gaussian_to_kernel(r: FloatArray, g: FloatArray, start: float) -> float:
    """Width of the Gaussian of unit integral nearest to G over the plane, in m.

    Minimises the integral of the squared difference, with weight r: the paper's fit.  No width
    below half a step of the radial grid is told apart from a point.
    """
    root = np.sqrt(r)

    def misfit(scaled: FloatArray) -> FloatArray:
        return root * (unit_gaussian(r, scaled[0] * start) - g) * start**2

    def slope(scaled: FloatArray) -> FloatArray:
        return (root * unit_gaussian_slope(r, scaled[0] * start) * start**3)[:, None]

    narrowest = 0.5 * float(r[1] - r[0])
    begin = np.array([max(start, 2 * narrowest) / start])

    def linearise(scaled: FloatArray) -> tuple[FloatArray, FloatArray]:
        # A step may lead beyond the narrowest width, where the search with a bound takes over.
        inside = np.maximum(scaled, narrowest / start)
        return misfit(inside), slope(inside)

    near = gauss_newton(linearise, begin, tolerance=1e-10)
    if near is not None and near[0] * start > 2 * narrowest:
        return float(near[0] * start)
    from scipy.optimize import least_squares

    found = least_squares(
        misfit,
        begin,
        jac=slope,
        bounds=(narrowest / start, np.inf),
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-14,
    )
    return float(found.x[0] * start)
