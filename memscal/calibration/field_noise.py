r"""Noise of a measured field, which a raster carries into G component by component.

A line scan is lifted from a fitted profile; a raster is used as it is, so that the noise of
its points goes through the division.  Noise of one spectral component :math:`N` becomes
:math:`w N/\hat\sigma` in A G; over a lattice of area :math:`L^2` the azimuthal mean of G then
has the covariance

.. math::

    \mathrm{cov}(r, r') = \frac{1}{2\pi L^2}\int \Bigl(\frac{w N}{\hat\sigma}\Bigr)^2
    J_0(kr)\,J_0(kr')\,k\,dk .
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from memscal.calibration.solution import Solution
from memscal.model.validation import FloatArray

__all__ = ["FieldNoise", "field_noise"]


@dataclass(frozen=True, eq=False)
class FieldNoise:
    """What a raster's noise adds to the uncertainties.

    ``conversion_constant`` in V/Pa; ``radial`` (n, m): columns whose squares add up to the
    variance of G, in 1/m^2; ``transfer`` (p,): standard uncertainty of single components.
    """

    conversion_constant: float
    radial: FloatArray
    transfer: FloatArray


def field_noise(solution: Solution, wavenumbers: FloatArray) -> FieldNoise | None:
    """Return what a raster's noise adds; ``None`` for a line scan, which adds nothing.

    Parameters
    ----------
    solution : Solution
        The calibration's steps.
    wavenumbers : ndarray, shape (p,)
        Where the transfer function is stated, in rad/m.
    """
    estimate, deconvolution = solution.estimate, solution.deconvolution
    if not estimate.points.planar or estimate.points.scans > 1:
        return None
    k, weights = estimate.model.k, estimate.model.reference.wavenumbers.weights
    fields = solution.fields
    # Where both vanish, window and reference are divided on the grid, not interpolated apart.
    axis, window = fields.along_axis(deconvolution.quotient.window)
    reference = fields.along_axis(np.abs(fields.grid.forward(fields.stress.values)))[1]
    ratio = np.divide(window, reference, out=np.zeros_like(window), where=window > 0)
    amplified = solution.band.noise * np.interp(k, axis, ratio, right=0.0)
    area = fields.grid.cell_area * fields.voltage.values.size
    columns = j0(np.multiply.outer(deconvolution.g.r, k)) * (np.sqrt(weights / area) * amplified)
    return FieldNoise(
        conversion_constant=float(amplified[0]),
        radial=columns / deconvolution.conversion_constant,
        transfer=np.interp(wavenumbers, k, amplified) / deconvolution.conversion_constant,
    )
