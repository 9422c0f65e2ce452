"""Results of many replicates of a scan: A, widths, area and G(r), as of the calibration itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from memscal.axisymmetry.hankel import radial_spline
from memscal.axisymmetry.quadrature import ring_areas
from memscal.calibration.solution import Solution
from memscal.estimation.forward import unit_gaussian
from memscal.estimation.replicates import Replicates
from memscal.model.validation import FloatArray

__all__ = ["REPLICATED", "ReplicateResults"]

#: Scalars that are found of every replicate.
REPLICATED = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "fwhm",
    "noise_equivalent_area",
)
_FINE = 20
_STEPS = 12


@dataclass(frozen=True, eq=False)
class ReplicateResults:
    r"""Reads the results of replicates as the calibration reads its own.

    The profile of A G, through the method's window where it has one, is confined to the support
    of G, and split so that G has a unit integral.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Radii of G, in m.
    confined : ndarray, shape (n,)
        Taper times the factor that makes the calibration's own profile its G times its A.
    synthesis : ndarray, shape (n, nodes), or None
        From a transform to a profile through the window; ``None`` where nothing is windowed.
    wavenumbers : ndarray, shape (nodes,)
        Where the transform is taken, in rad/m.
    integral : ndarray, shape (n,)
        Weights that integrate a confined profile over the plane.
    """

    r: FloatArray
    confined: FloatArray
    synthesis: FloatArray | None
    wavenumbers: FloatArray
    integral: FloatArray

    @classmethod
    def of(cls, solution: Solution) -> ReplicateResults:
        """Set up for the replicates of a solution's scan."""
        kernel, model = solution.deconvolution, solution.estimate.model
        r, window = kernel.g.r, solution.window_at_nodes
        synthesis = None
        if np.any(solution.deconvolution.quotient.window < 1):
            synthesis = j0(np.multiply.outer(r, model.k)) * (
                model.reference.wavenumbers.weights * window
            )
        support = solution.choice.support
        phase = np.clip(2 * r / support - 1, 0.0, 1.0)
        ring = ring_areas(r)
        # Rings miss a share of the plane that does not change from replicate to replicate.
        ring = ring / float(ring @ kernel.g.radial)
        return cls(r, (1 + np.cos(np.pi * phase)) / 2, synthesis, model.k, ring)

    def read(
        self, replicates: Replicates, scaling: FloatArray | float = 1.0
    ) -> tuple[FloatArray, FloatArray]:
        """Read scalars and G of replicates.

        Parameters
        ----------
        replicates : Replicates
            Their estimates.
        scaling : ndarray, shape (replicates,), optional
            Factor on A beside them.

        Returns
        -------
        scalars : ndarray, shape (replicates, 5)
            :data:`REPLICATED`, in SI units.
        g : ndarray, shape (replicates, n)
            G at the radii, in 1/m^2.
        """
        if self.synthesis is None:
            profile = replicates.radial(self.r)
        else:
            profile = replicates.kernel(self.wavenumbers) @ self.synthesis.T
        profile = profile * self.confined
        a = profile @ self.integral
        g = profile / a[:, None]
        columns = [
            a * scaling,
            replicates.sigma,
            _nearest_width(self.r, g, replicates.sigma),
            _full_width(self.r, g),
            1 / ((g**2) @ ring_areas(self.r)),
        ]
        return np.stack(columns, axis=1), g


def _nearest_width(r: FloatArray, g: FloatArray, start: FloatArray) -> FloatArray:
    """Width of the Gaussian of unit integral nearest to each G over the plane."""
    width = np.maximum(start, float(r[1] - r[0]))
    for _ in range(_STEPS):
        sigma = width[:, None]
        slope = unit_gaussian(r, sigma) * ((r / sigma) ** 2 - 2) / sigma
        off = g - unit_gaussian(r, sigma)
        step = np.sum(r * slope * off, axis=1) / np.sum(r * slope**2, axis=1)
        width = width + np.clip(step, -width / 3, width / 3)
    return np.asarray(width)


def _full_width(r: FloatArray, g: FloatArray) -> FloatArray:
    """Diameter of the outermost circle where each G is half of its maximum."""
    fine = np.linspace(r[0], r[-1], _FINE * r.size)
    values = radial_spline(r, g.T)(fine)
    half = values.max(axis=0) / 2
    last = fine.size - 1 - np.argmax(values[::-1] >= half, axis=0)
    last = np.minimum(last, fine.size - 2)
    column = np.arange(g.shape[0])
    near, far = values[last, column], values[last + 1, column]
    share = np.divide(half - near, far - near, out=np.zeros_like(half), where=far != near)
    return np.asarray(2 * (fine[last] + share * (fine[1] - fine[0])))
