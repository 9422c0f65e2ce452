r"""Uncertainty of G over the plane, of a scan that is used as a raster.

Method ``bayesian`` takes it from the posterior: G is a linear combination of its kernels.

A division is a filter :math:`f = \mathcal F^{-1}\{w/\hat\sigma\}` of the field of voltages.  At the
measured nodes that field has the noise of the readings, elsewhere that of what was fitted:
:math:`\delta U = E\,n + L\,g\,n` for the noise n, the nodes E of the readings, the signals L of the
posterior's parameters where nothing was measured, and their gain g.  With
:math:`\Phi = f \otimes L` the variance of A G at :math:`\rho` is

.. math::

    \sum_i f(\rho - x_i)^2 v_i + 2 \sum_j \Phi_j(\rho)\,(f \otimes E N g_j)(\rho)
    + \Phi(\rho)\,g N g^T\,\Phi(\rho)^T, \qquad N = \langle n\,n^T \rangle .

An error of the centre moves G by its slope.  What the filter takes away of the posterior's kernels
is counted beside that, as it is for the profile (``window``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.fft import fftshift, ifftshift, irfft2, rfft2

from memscal.calibration.stages import Deconvolution, Solution
from memscal.calibration.uncertainty import InputEffect, correlation_matrix, square_root
from memscal.model.arrays import FloatArray

#: Windows below this have closed.
_CLOSED = 1e-9


def field_errors(
    solution: Solution,
    deconvolution: Deconvolution,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
) -> FloatArray:
    """Standard uncertainties of G on its grid (2, m, n), in 1/m^2: of noise alone, and in all."""
    from scipy.interpolate import CubicSpline, RectBivariateSpline

    fields: Any = solution.fields
    estimate, g = solution.estimate, deconvolution.g
    voltages = np.array([effect.voltage for effect in effects.values()])
    inputs = np.zeros((estimate.points.u.size, 0))
    if effects:
        inputs = voltages.T @ square_root(correlation_matrix(list(effects), correlations))
    x, y = fields.central.axes
    # Kernels of all parameters about the centre on the lattice, (nodes, p).
    radius = fields.central.radius
    table = np.arange(0.0, float(radius.max()) + 4 * fields.step, fields.step)
    kernels = CubicSpline(table, estimate.basis.radial(table))(radius.ravel())
    kernels = kernels + estimate.oval_columns(x, y)
    on_lattice = RectBivariateSpline(g.y, g.x, g.image)(
        np.clip(y, g.y[0], g.y[-1]), np.clip(x, g.x[0], g.x[-1])
    )
    on_lattice[fields.confinement == 0] = 0.0
    changes = _divided if deconvolution.divided else _of_posterior
    variances = changes(solution, deconvolution, kernels, on_lattice.ravel(), inputs)
    errors = np.sqrt(np.maximum(np.cumsum(variances, axis=0), 0.0))
    planes = [RectBivariateSpline(y, x, e.reshape(y.size, x.size))(g.y, g.x) for e in errors]
    return np.maximum.accumulate(np.maximum(planes, 0.0))


def _of_posterior(
    solution: Solution,
    deconvolution: Deconvolution,
    kernels: FloatArray,
    g: FloatArray,
    inputs: FloatArray,
) -> FloatArray:
    """Variances of G (2, nodes) by noise, and by the rest of the posterior and inputs (n, q)."""
    estimate, a = solution.estimate, deconvolution.conversion_constant
    rows = (kernels - np.outer(g, estimate.basis.integrals)) / a
    gain, scattered = estimate.weighed.gain, estimate.scattered(estimate.weighed.gain)
    random = scattered @ scattered.T
    scatter = np.sum((rows @ random) * rows, axis=1)
    rest = np.sum((rows @ (estimate.covariance - random)) * rows, axis=1)
    return np.stack([scatter, rest + np.sum((rows @ (gain @ inputs)) ** 2, axis=1)])


def _divided(
    solution: Solution,
    deconvolution: Deconvolution,
    kernels: FloatArray,
    g: FloatArray,
    inputs: FloatArray,
) -> FloatArray:
    """Variances of G (2, nodes) by noise, and by inputs (n, q) and what a division takes away."""
    fields: Any = solution.fields
    estimate, smoothed = solution.estimate, solution.smoothed
    grid, gain, a = fields.central, estimate.weighed.gain, deconvolution.conversion_constant
    shape, taper = fields.confinement.shape, fields.confinement.ravel()
    window, stress = deconvolution.quotient.window, grid.forward(fields.stress.values)
    ratio = np.divide(window, stress, out=np.zeros_like(stress), where=window > _CLOSED)
    share = fields.share(smoothed)
    noise = estimate.noise**2 / estimate.outlier_weight

    def placed(values: FloatArray) -> FloatArray:
        """Put columns (n, q) of the points on the lattice, (q, m, n)."""
        planes = np.zeros((values.shape[1], *shape))
        for plane, column in zip(planes, values.T, strict=True):
            np.add.at(plane, fields.index, share * column)
        return planes

    def filtered(planes: FloatArray, spectrum: FloatArray = ratio) -> FloatArray:
        """Filter planes (q, m, n) to A G: (nodes, q)."""
        plane = fftshift(irfft2(spectrum * rfft2(planes), s=shape), axes=(1, 2))
        return plane.reshape(len(planes), -1).T

    mean = fields.kernel(estimate.radial).ravel()
    columns = np.column_stack([kernels, mean])
    passed = filtered(ifftshift(columns.T.reshape(-1, *shape), axes=(1, 2)), window)
    lost, passed = columns - taper[:, None] * passed, passed[:, :-1]
    # An error of the centre moves what was fitted around the raster, and the frame that G is seen
    # in: where nothing was measured they cancel.
    signals = estimate.basis.signals(estimate.model, estimate.gaussian)
    beside = passed - filtered(placed(signals))
    weighted = noise * gain
    own = np.zeros(shape)
    np.add.at(own, fields.index, share**2 * noise)
    squared = rfft2(irfft2(ratio, s=shape) ** 2) * rfft2(own)
    variance = fftshift(irfft2(squared, s=shape)).ravel()
    variance += 2 * np.sum(beside * filtered(placed(weighted.T)), axis=1)
    variance += np.sum((beside @ (weighted @ gain.T)) * beside, axis=1)
    # A is the sum of A G over the nodes.
    back = irfft2(np.conj(ratio) * rfft2(ifftshift(fields.confinement)), s=shape)
    of_a = grid.cell_area * (share * back[fields.index] + (taper @ beside) @ gain)

    def changed(voltages: FloatArray) -> FloatArray:
        fitted = beside @ (gain @ voltages)
        return np.asarray(taper[:, None] * (filtered(placed(voltages)) + fitted))

    with_a = changed((noise * of_a)[:, None])[:, 0]
    variance = taper**2 * variance - 2 * g * with_a + g**2 * float(of_a**2 @ noise)
    hidden = np.column_stack([lost[:, -1], lost[:, :-1] @ square_root(estimate.covariance)])
    columns = np.hstack([changed(inputs), hidden])
    sums = np.append(of_a @ inputs, grid.cell_area * hidden.sum(axis=0))
    rest = np.sum((columns - np.outer(g, sums)) ** 2, axis=1)
    return np.stack([variance, rest]) / a**2
