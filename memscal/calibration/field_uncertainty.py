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

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fftfreq, fftshift, ifftshift, irfft2, rfft2, rfftfreq

from memscal.calibration.stages import Deconvolution, Solution
from memscal.calibration.uncertainty import InputEffect, correlation_matrix
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.voltage_map import BLOCK, square_root
from memscal.model.arrays import BoolArray, FloatArray, IndexArray
from memscal.progress import counted

ComplexArray: TypeAlias = NDArray[np.complex128]

#: Windows below this have closed: what they pass of the noise's variance is no larger.
_CLOSED = 1e-6
#: Nodes of the posterior's errors for each Gaussian width; columns that are made at a time.
_PER_WIDTH = 6.0
_COLUMNS = 16


def field_errors(
    solution: Solution,
    deconvolution: Deconvolution,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
) -> FloatArray:
    """Standard uncertainties of G on its grid (2, m, n), in 1/m^2: of noise alone, and in all."""
    from scipy.interpolate import RectBivariateSpline

    fields: Any = solution.fields
    estimate = solution.estimate
    g = deconvolution.g
    inputs = np.zeros((estimate.points.u.size, 0))
    if effects:
        voltages = np.array([effect.voltage for effect in effects.values()])
        inputs = voltages.T @ square_root(correlation_matrix(list(effects), correlations))
    # As fine as the narrowest kernels: on some nodes of a lattice, the central one among them.
    finest = estimate.gaussian.sigma / _PER_WIDTH
    reach = np.inf if deconvolution.divided else fields.support + 4 * fields.step
    x, y = (
        axis[axis.size // 2 % (every := max(int(finest / (axis[1] - axis[0])), 1)) :: every]
        for axis in fields.central.axes
    )
    x, y = (axis[np.abs(axis) <= max(reach, 4 * axis[axis.size // 2 + 1])] for axis in (x, y))
    on_lattice = RectBivariateSpline(g.y, g.x, g.image)(
        np.clip(y, g.y[0], g.y[-1]), np.clip(x, g.x[0], g.x[-1])
    )
    on_lattice[np.hypot.outer(y, x) >= fields.support] = 0.0
    changes = _divided if deconvolution.divided else _of_posterior
    variances = changes(solution, deconvolution, (x, y), on_lattice, inputs)
    errors = np.sqrt(np.maximum(np.cumsum(variances, axis=0), 0.0))
    planes = [RectBivariateSpline(y, x, e.reshape(y.size, x.size))(g.y, g.x) for e in errors]
    return np.maximum.accumulate(np.maximum(planes, 0.0))


def _kernels(
    estimate: ProfileEstimate, x: FloatArray, y: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Return combinations (p, m) of the posterior's kernels on a grid about the centre."""
    from scipy.interpolate import CubicSpline

    radius = np.hypot.outer(y, x).ravel()
    step = min(x[1] - x[0], estimate.gaussian.sigma / _PER_WIDTH) / 2
    table = np.arange(0.0, float(radius.max()) + 4 * step, step)
    radial = estimate.basis.radial(table)
    rows = max(BLOCK // x.size, 1)

    def combined(coefficients: FloatArray) -> FloatArray:
        round_ = CubicSpline(table, radial @ coefficients)(radius)
        for start in range(0, y.size, rows):
            oval = estimate.oval_changes(x, y[start : start + rows], coefficients)
            first = start * x.size
            round_[first : first + len(oval)] += oval
        return round_

    return combined


def _of_posterior(
    solution: Solution,
    deconvolution: Deconvolution,
    axes: tuple[FloatArray, FloatArray],
    g: FloatArray,
    inputs: FloatArray,
) -> FloatArray:
    """Variances of G (2, nodes) by noise, and by the rest of the posterior and inputs (n, q)."""
    estimate = solution.estimate
    a = deconvolution.conversion_constant
    kernels = _kernels(estimate, *axes)
    gain = estimate.weighed.gain
    integrals = estimate.basis.integrals
    variances = []
    for columns in (estimate.scattered(gain), np.hstack([estimate.fixed_root, gain @ inputs])):
        changes = kernels(columns) - np.outer(g.ravel(), integrals @ columns)
        variances.append(np.sum(changes**2, axis=1) / a**2)
    return np.array(variances)


@dataclass(frozen=True, eq=False)
class _Band:
    """The wavenumbers that a division passes: Fourier sums of few components, by matrices."""

    ratio: ComplexArray  # (ky, kx): A G over the transform of the field of voltages
    window: FloatArray
    # Waves of each wavenumber along both axes: at all nodes, where G is stated, and at the points.
    at_nodes: tuple[ComplexArray, ComplexArray]  # (ky, m), (kx, n)
    at_g: tuple[ComplexArray, ComplexArray]
    at_points: tuple[ComplexArray, ComplexArray]
    nodes: tuple[IndexArray, IndexArray]  # rows and columns of G in the lattice
    twice: FloatArray  # (kx,): components of negative kx are the conjugates of the others
    every: int  # nodes of the lattice for each of the nodes
    count: int  # nodes of the lattice

    @classmethod
    def of(
        cls,
        fields: Any,
        ratio: ComplexArray,
        window: FloatArray,
        axes: tuple[FloatArray, FloatArray],
        stated: tuple[BoolArray, BoolArray],
    ) -> _Band:
        """Return the band in which a window is open; ``axes``, ``stated``: x and y of nodes."""
        open_ = window > _CLOSED
        rows, columns = (np.flatnonzero(open_.any(axis=axis)) for axis in (1, 0))
        dy, dx = fields.central.spacing
        m, n = fields.confinement.shape
        angles = 2 * np.pi * fftfreq(m)[rows], 2 * np.pi * rfftfreq(n)[columns]
        (x, y) = axes
        index = fields.index
        at = [np.rint(axis / step).astype(np.intp) for axis, step in ((y, dy), (x, dx))]
        nodes = []
        points = []
        for angle, offset, places in zip(angles, at, index, strict=True):
            between = np.arange(places.min(), places.max() + 1)
            nodes.append(np.exp(-1j * np.multiply.outer(angle, offset)))
            points.append(np.exp(-1j * np.multiply.outer(angle, between)))
        every = round((x[1] - x[0]) / dx) * round((y[1] - y[0]) / dy)
        return cls(
            ratio=ratio[np.ix_(rows, columns)],
            window=window[np.ix_(rows, columns)],
            at_nodes=(nodes[0], nodes[1]),
            at_g=(nodes[0][:, stated[1]], nodes[1][:, stated[0]]),
            at_points=(points[0], points[1]),
            nodes=(at[0][stated[1]] + m // 2, at[1][stated[0]] + n // 2),
            twice=np.where(columns == 0, 1.0, 2.0),
            every=every,
            count=m * n,
        )

    def passed(self, kernels: FloatArray) -> FloatArray:
        """What the window passes of kernels (nodes, q)."""
        rows, columns = self.at_nodes
        planes = kernels.T.reshape(-1, rows.shape[1], columns.shape[1])
        return self._at_g(self.window * self.every * _summed(planes, rows, columns))

    def divided(self, planes: FloatArray) -> FloatArray:
        """Divide fields (q, m, n), zero but at the points: A G where it is stated, (nodes, q)."""
        rows, columns = self.at_points
        return self._at_g(self.ratio * _summed(planes, rows, columns))

    def _at_g(self, spectra: ComplexArray) -> FloatArray:
        rows, columns = self.at_g
        along = spectra @ (self.twice[:, None] * columns.conj() / self.count)
        # The real part of the product.
        planes = rows.real.T @ along.real + rows.imag.T @ along.imag
        return planes.reshape(len(planes), -1).T


def _summed(planes: FloatArray, rows: ComplexArray, columns: ComplexArray) -> ComplexArray:
    """Fourier sums (q, ky, kx) of real planes (q, m, n)."""
    return (rows.real @ planes + 1j * (rows.imag @ planes)) @ columns.T


@dataclass(frozen=True, eq=False)
class _OfParameters:
    """What a division does to the posterior's kernels, and its mean, at the nodes."""

    beside: FloatArray  # (inside, p): changes of A G by errors of the parameters
    lost: FloatArray  # (inside, p + 1): what of kernels and mean the window takes away
    of_frame: FloatArray  # (p,) and (p + 1,): the same, summed over the nodes
    sums: FloatArray

    @classmethod
    def of(
        cls,
        estimate: ProfileEstimate,
        axes: tuple[FloatArray, FloatArray],
        inside: IndexArray,
        taper: FloatArray,
        band: _Band,
        divided: Callable[[FloatArray], FloatArray],
    ) -> _OfParameters:
        """Divide the voltages of each kernel, and hold it against the kernel."""
        # An error of the parameters moves what was fitted around the raster and the frame that G is
        # seen in.  Where nothing was measured these cancel.
        kernels = _kernels(estimate, *axes)
        radius = np.hypot.outer(*axes[::-1]).ravel()
        count = estimate.basis.integrals.size
        lost = np.empty((inside.size, count + 1))
        beside = np.empty((inside.size, count))
        sums = np.empty(count + 1)
        of_frame = np.empty(count)
        for some in counted(_chunks(count), "kernels", count, lambda some: some.stop - some.start):
            columns = kernels(unit := np.eye(count)[:, some])
            passed = band.passed(columns)
            voltages = estimate.basis.voltages(estimate.model, estimate.gaussian, unit)
            moved = passed - divided(voltages)
            beside[:, some] = moved
            of_frame[some] = taper @ moved
            taken = taper[:, None] * passed
            lost[:, some] = columns[inside] - taken
            sums[some] = columns.sum(axis=0) - taken.sum(axis=0)
        # The mean is the Gaussian fit and its corrections.
        mean = estimate.radial(radius) + estimate.oval_kernel(*axes).ravel()
        taken = taper * band.passed(mean[:, None])[:, 0]
        lost[:, -1] = mean[inside] - taken
        sums[-1] = mean.sum() - taken.sum()
        return cls(beside, lost, of_frame, sums)


def _divided(
    solution: Solution,
    deconvolution: Deconvolution,
    axes: tuple[FloatArray, FloatArray],
    g: FloatArray,
    inputs: FloatArray,
) -> FloatArray:
    """Variances of G (2, nodes) by noise, and by inputs (n, q) and what a division takes away."""
    fields: Any = solution.fields
    estimate = solution.estimate
    smoothed = solution.smoothed
    grid = fields.central
    gain = estimate.weighed.gain
    a = deconvolution.conversion_constant
    radius = np.hypot.outer(*axes[::-1]).ravel()
    # Nodes where G is stated.
    x, y = (np.abs(axis) <= fields.support + 3 * fields.step for axis in axes)
    inside = np.flatnonzero(np.logical_and.outer(y, x))
    window = deconvolution.quotient.window
    stress = grid.forward(fields.stress.values)
    ratio = np.divide(window, stress, out=np.zeros_like(stress), where=window > _CLOSED)
    band = _Band.of(fields, ratio, window, axes, (x, y))
    share = fields.share(smoothed)
    noise = estimate.noise**2 / estimate.outlier_weight
    taper = fields.taper(radius[inside])
    g = g.ravel()[inside]
    index = [places - places.min() for places in fields.index]
    box = [int(places.max()) + 1 for places in index]
    node = index[0] * box[1] + index[1]

    def divided(voltages: FloatArray) -> FloatArray:
        """Put columns (n, q) of the points on the lattice, and divide: (nodes, q)."""
        planes = [np.bincount(node, share * column, box[0] * box[1]) for column in voltages.T]
        return band.divided(np.reshape(planes, (-1, *box)))

    by = _OfParameters.of(estimate, axes, inside, taper, band, divided)
    beside = by.beside
    count = by.of_frame.size
    own = np.zeros(fields.confinement.shape)
    shape = fields.confinement.shape
    np.add.at(own, fields.index, share**2 * noise)
    squared = fftshift(irfft2(rfft2(irfft2(ratio, s=shape) ** 2) * rfft2(own), s=shape))
    variance = squared[np.ix_(*band.nodes)].ravel()
    for gains, right in gain.parts:
        of_points: Any = np.eye(share.size) if right is None else right
        for some in _chunks(of_points.shape[1]):
            moved = divided(noise[:, None] * of_points[:, some])
            variance += 2 * np.sum((beside @ gains[:, some]) * moved, axis=1)
    spread = square_root(gain.covariance(np.sqrt(noise)))
    for some in _chunks(count):
        variance += np.sum((beside @ spread[:, some]) ** 2, axis=1)
    # A is the sum of A G over the nodes.
    back = irfft2(np.conj(ratio) * rfft2(ifftshift(fields.confinement)), s=shape)
    by_frame = band.every * (by.of_frame[None, :] @ gain).dense()[0]
    of_a = grid.cell_area * (share * back[fields.index] + by_frame)

    def changed(voltages: FloatArray) -> FloatArray:
        fitted = beside @ (gain @ voltages)
        return np.asarray(taper[:, None] * (divided(voltages) + fitted))

    with_a = changed((noise * of_a)[:, None])[:, 0]
    variance = taper**2 * variance - 2 * g * with_a + g**2 * float(of_a**2 @ noise)
    rest = np.sum((changed(inputs) - np.outer(g, of_a @ inputs)) ** 2, axis=1)
    root = np.zeros((count + 1, count + 1))
    root[:-1, :-1] = square_root(estimate.covariance)
    root[-1, -1] = 1.0
    sums = grid.cell_area * band.every * (by.sums @ root)
    for some in _chunks(count + 1):
        rest += np.sum((by.lost @ root[:, some] - np.outer(g, sums[some])) ** 2, axis=1)
    planes = np.zeros((2, radius.size))
    planes[:, inside] = np.stack([variance, rest]) / a**2
    return planes


def _chunks(count: int) -> list[slice]:
    """Some columns at a time."""
    return [slice(start, min(start + _COLUMNS, count)) for start in range(0, count, _COLUMNS)]
