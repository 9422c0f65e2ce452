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

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fftfreq, fftshift, ifftshift, irfft2, rfft2, rfftfreq
from scipy.linalg import block_diag

from memscal.calibration.fields import cosine_taper
from memscal.calibration.stages import Solution
from memscal.calibration.uncertainty import Correlations, Effects, correlation_matrix
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.voltage_map import BLOCK, square_root
from memscal.model.arrays import (
    ArrayFunction,
    ArrayPair,
    ArrayTriple,
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    slices,
)
from memscal.progress import Task

ComplexArray = NDArray[np.complex128]

#: Windows below this have closed: what they pass of the noise's variance is no larger.
_CLOSED = 1e-6
#: Nodes of the errors for each Gaussian width: splines through them are right to 2 % of the largest
#: error.  Radii of a table for each node; columns that are made at a time.
_PER_WIDTH = 4.0
_PER_NODE = 3
_COLUMNS = 16


def field_errors(solution: Solution, effects: Effects, correlations: Correlations) -> FloatArray:
    """Standard uncertainty of G on its grid (2, m, n), in 1/m^2: of noise alone, and in all."""
    from scipy.interpolate import RectBivariateSpline

    fields: Any = solution.fields
    estimate = solution.estimate
    deconvolution = solution.deconvolution
    g = deconvolution.g
    inputs = np.zeros((estimate.points.u.size, 0))
    if effects:
        voltages = np.array([effect.voltage for effect in effects.values()])
        inputs = voltages.T @ square_root(correlation_matrix(list(effects), correlations))
    reach = np.inf if deconvolution.divided else fields.support + 4 * fields.step
    x, y = (_nodes(axis, estimate.gaussian.sigma, reach) for axis in fields.central.axes)
    # Beyond its axes the spline keeps its last values.
    at_nodes = RectBivariateSpline(g.y, g.x, g.image)(y, x)
    at_nodes[np.hypot.outer(y, x) >= fields.support] = 0.0
    variances_of = _division_variances if deconvolution.divided else _posterior_variances
    variances = variances_of(solution, (x, y), at_nodes.ravel(), inputs)
    variances[0] *= solution.band.excess**2
    errors = np.sqrt(np.maximum(np.cumsum(variances, axis=0), 0.0))
    curved, straight = (
        [RectBivariateSpline(y, x, e.reshape(y.size, x.size), kx=k, ky=k)(g.y, g.x) for e in errors]
        for k in (3, 1)
    )
    # Where kernels end, a cubic spline falls below zero.
    return np.maximum.accumulate(np.where(curved < np.divide(straight, 2), straight, curved))


def _nodes(axis: FloatArray, width: float, reach: float) -> FloatArray:
    """Some nodes of a lattice's axis as far as G reaches, the central one among them."""
    middle = axis.size // 2
    every = max(int(width / _PER_WIDTH / (axis[1] - axis[0])), 1)
    nodes: FloatArray = axis[middle % every :: every]
    near: BoolArray = abs(nodes) <= max(reach, 4 * nodes[nodes.size // 2 + 1])
    return nodes[near]


def _kernels(estimate: ProfileEstimate, x: FloatArray, y: FloatArray) -> ArrayFunction:
    """Return combinations (p, m) of the posterior's kernels on a grid about the centre."""
    from scipy.interpolate import CubicSpline

    radius = np.hypot.outer(y, x).ravel()
    step = min(x[1] - x[0], estimate.gaussian.sigma / _PER_WIDTH) / _PER_NODE
    table = np.arange(0.0, radius.max() + 4 * step, step)
    radial = estimate.basis.radial(table)
    rows = max(BLOCK // x.size, 1)

    def combined(coefficients: FloatArray) -> FloatArray:
        columns: FloatArray = CubicSpline(table, radial @ coefficients)(radius)
        for start in range(0, y.size, rows):
            part = slice(start * x.size, (start + rows) * x.size)
            columns[part] += estimate.oval_changes(x, y[start : start + rows], coefficients)
        return columns

    return combined


def _posterior_variances(
    solution: Solution, axes: ArrayPair, g: FloatArray, inputs: FloatArray
) -> FloatArray:
    """Variances of G (2, nodes) by noise, and by the rest of the posterior and inputs (n, q)."""
    estimate = solution.estimate
    kernels = _kernels(estimate, *axes)
    gain = estimate.weighed.gain
    variances = []
    for columns in (estimate.scattered(gain), np.hstack([estimate.fixed_root, gain @ inputs])):
        changes = kernels(columns) - np.outer(g, estimate.basis.integrals @ columns)
        variances.append(np.sum(changes**2, axis=1))
    return np.array(variances) / solution.deconvolution.conversion_constant**2


@array_record
class _Filter:
    """A division as a filter: Fourier sums of the few components that it passes, by matrices."""

    ratio: ComplexArray  # (ky, kx): A G over the transform of the field of voltages
    window: FloatArray
    # Waves of each wavenumber along both axes: at all nodes, where G is stated, and at the points.
    at_nodes: list[ComplexArray]  # (ky, m), (kx, n)
    at_g: list[ComplexArray]
    at_points: list[ComplexArray]
    # (kx,), over the nodes of the lattice: components of negative kx are conjugates of the others.
    weights: FloatArray
    every: int  # nodes of the lattice for each of the nodes
    share: FloatArray  # (n,): what a reading adds to its node, over its voltage
    places: IndexArray  # (n,): of the readings' nodes in the box that holds them all

    @classmethod
    def of(
        cls,
        fields: Any,
        ratio: ComplexArray,
        window: FloatArray,
        axes: ArrayPair,
        stated: tuple[BoolArray, BoolArray],
    ) -> _Filter:
        """Return the band in which a window is open; ``axes``, ``stated``: y and x of nodes."""
        passes = window > _CLOSED
        band = [np.flatnonzero(passes.any(axis=1)), np.flatnonzero(passes.any(axis=0))]
        m, n = fields.confinement.shape
        frequencies = (fftfreq(m), rfftfreq(n))
        at_nodes = []
        at_g = []
        at_points = []
        index = []
        every = 1
        for i, step in enumerate(fields.central.spacing):
            angle = 2 * np.pi * frequencies[i][band[i]]
            waves = np.exp(-1j * np.outer(angle, np.rint(axes[i] / step)))
            first = fields.index[i].min()
            nodes = np.arange(first, fields.index[i].max() + 1)
            at_nodes.append(waves)
            at_g.append(waves[:, stated[i]])
            at_points.append(np.exp(-1j * np.outer(angle, nodes)))
            index.append(fields.index[i] - first)
            every *= round((axes[i][1] - axes[i][0]) / step)
        box = (at_points[0].shape[1], at_points[1].shape[1])
        open_ = np.ix_(*band)
        weights = np.where(band[1] == 0, 1.0, 2.0) / (m * n)
        places = np.ravel_multi_index(index, box)
        passing = (ratio[open_], window[open_])
        return cls(*passing, at_nodes, at_g, at_points, weights, every, fields.share, places)

    def passed(self, kernels: FloatArray) -> FloatArray:
        """What the window passes of kernels (nodes, q), where G is stated."""
        return self._at_g(self.window * self.every * _summed(kernels.T, self.at_nodes))

    def divided(self, voltages: FloatArray) -> FloatArray:
        """Put columns (n, q) of the points on the lattice, and divide: A G where it is stated."""
        size = self.at_points[0].shape[1] * self.at_points[1].shape[1]
        planes = [np.bincount(self.places, self.share * each, size) for each in voltages.T]
        return self._at_g(self.ratio * _summed(np.reshape(planes, (-1, size)), self.at_points))

    def _at_g(self, spectra: ComplexArray) -> FloatArray:
        rows, columns = self.at_g
        along = spectra @ (self.weights[:, None] * columns.conj())
        # The real part of the product.
        planes = rows.real.T @ along.real + rows.imag.T @ along.imag
        return planes.reshape(len(planes), -1).T


def _summed(planes: FloatArray, waves: list[ComplexArray]) -> ComplexArray:
    """Fourier sums (q, ky, kx) of real planes (q, nodes)."""
    rows, columns = waves
    planes = planes.reshape(-1, rows.shape[1], columns.shape[1])
    return (rows.real @ planes + 1j * (rows.imag @ planes)) @ columns.T


def _by_parameters(
    estimate: ProfileEstimate,
    axes: ArrayPair,
    inside: IndexArray,
    taper: FloatArray,
    division: _Filter,
) -> ArrayTriple:
    """What errors of the parameters do to A G (inside, p); what the window hides, and its sums."""
    # Hidden of the posterior's kernels and of its mean, (inside, p + 1) and summed over all nodes.
    # An error of the parameters moves what was fitted around the raster and the frame that G is
    # seen in.  Where nothing was measured these cancel.
    kernels = _kernels(estimate, *axes)
    count = estimate.basis.integrals.size
    moved = np.empty((inside.size, count))
    hidden = np.empty((inside.size, count + 1))
    sums = np.empty(count + 1)

    def compare(columns: FloatArray, some: slice) -> FloatArray:
        passed = division.passed(columns)
        tapered = taper[:, None] * passed
        hidden[:, some] = columns[inside] - tapered
        sums[some] = columns.sum(axis=0) - tapered.sum(axis=0)
        return passed

    task = Task("kernels", count)
    for some in task.counted(slices(count, _COLUMNS), lambda some: some.stop - some.start):
        unit = np.eye(count)[:, some]
        voltages = estimate.basis.voltages(estimate.model, estimate.gaussian, unit)
        moved[:, some] = compare(kernels(unit), some) - division.divided(voltages)
    # The mean is the Gaussian fit and its corrections.
    radius = np.hypot.outer(axes[1], axes[0]).ravel()
    mean = estimate.radial(radius) + estimate.oval_kernel(*axes).ravel()
    compare(mean[:, None], slice(count, count + 1))
    return moved, hidden, sums


def _division_variances(
    solution: Solution, axes: ArrayPair, g: FloatArray, inputs: FloatArray
) -> FloatArray:
    """Variances of G (2, nodes) by noise, and by inputs (n, q) and what a division takes away."""
    fields: Any = solution.fields
    estimate = solution.estimate
    deconvolution = solution.deconvolution
    grid = fields.central
    shape = fields.confinement.shape
    x, y = axes
    # Nodes where G is stated.
    most = fields.support + 3 * fields.step
    stated = (abs(y) <= most, abs(x) <= most)
    inside = np.flatnonzero(np.logical_and.outer(*stated))
    window = deconvolution.quotient.window
    stress = grid.forward(fields.stress.values)
    ratio = np.divide(window, stress, out=np.zeros_like(stress), where=window > _CLOSED)
    share = fields.share
    division = _Filter.of(fields, ratio, window, (y, x), stated)
    taper = cosine_taper(np.hypot.outer(y, x).ravel()[inside], fields.support)
    moved, hidden, sums = _by_parameters(estimate, axes, inside, taper, division)
    count = moved.shape[1]
    gain = estimate.weighed.gain
    noise = estimate.scatter**2
    # Of A G: of the readings themselves, of these with what was fitted to them, of the latter.
    own = np.zeros(shape)
    np.add.at(own, fields.index, share**2 * noise)
    squared = irfft2(ratio, s=shape) ** 2
    own = fftshift(irfft2(rfft2(squared) * rfft2(own), s=shape))
    dy, dx = grid.spacing
    rows = np.rint(y / dy).astype(np.intp) + shape[0] // 2
    columns = np.rint(x / dx).astype(np.intp) + shape[1] // 2
    variance = own[np.ix_(rows[stated[0]], columns[stated[1]])].ravel()
    for left, right in gain.parts:
        for some in slices(right.shape[1], _COLUMNS):
            readings = division.divided(noise[:, None] * np.asarray(right[:, some]))
            variance += 2 * np.sum((moved @ left[:, some]) * readings, axis=1)
    fitted = square_root(gain.covariance(estimate.scatter))
    for some in slices(count, _COLUMNS):
        variance += np.sum((moved @ fitted[:, some]) ** 2, axis=1)
    # A is the sum of A G over the nodes.
    back = irfft2(np.conj(ratio) * rfft2(ifftshift(fields.confinement)), s=shape)
    by_frame = division.every * ((taper @ moved)[None, :] @ gain).dense()[0]
    by_a = grid.cell_area * (share * back[fields.index] + by_frame)

    def changed(voltages: FloatArray) -> FloatArray:
        return taper[:, None] * (division.divided(voltages) + moved @ (gain @ voltages))

    g = g[inside]
    with_a = changed((noise * by_a)[:, None])[:, 0]
    variance = taper**2 * variance - 2 * g * with_a + g**2 * (by_a**2 @ noise)
    rest = np.sum((changed(inputs) - np.outer(g, by_a @ inputs)) ** 2, axis=1)
    root = block_diag(square_root(estimate.weighed.covariance), [1.0])
    sums = grid.cell_area * division.every * (sums @ root)
    for some in slices(count + 1, _COLUMNS):
        rest += np.sum((hidden @ root[:, some] - np.outer(g, sums[some])) ** 2, axis=1)
    variances = np.zeros((2, x.size * y.size))
    variances[:, inside] = np.stack([variance, rest]) / deconvolution.conversion_constant**2
    return variances
