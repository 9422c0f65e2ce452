r"""Residuals of a scan that do not depend on the apparatus function, and tests of them.

The residuals of a fit with a prior for departures have no exact distribution.  These have one.
Weighted data :math:`z` are projected off a design :math:`X = QR` of all that an
apparatus function may do to first order: conversion constant, width, centre, baseline, drift,
and every combination of departures that stands above a share of the noise.  What is left,
:math:`(1 - QQ^T)z`, does not depend on G.
"""

import math
from functools import cached_property

import numpy as np
from scipy.linalg import orth
from scipy.sparse import csr_array, diags_array
from scipy.special import chdtrc, chdtri, fdtrc, fdtri, gammaincc, gammainccinv

from memscal.estimation.points import grouped
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.voltage_map import DENSE, orthonormalised, triangular
from memscal.model.arrays import TINY, FloatArray, IndexArray, array_record, slices, value_record
from memscal.model.checks import FALSE_ALARM, OUTLIER_WEIGHT

#: A departure of the expected size that moves no voltage by this share of its noise is left out.
_SHARE_OF_NOISE = 0.1
_CLIPPED = 4.0
#: Columns are dependent where a singular value is below this; so many are multiplied at a time.
_DEPENDENT = 1e-10
_COLUMNS = 8


@array_record
class FreeModel:
    """The scan's data and the linear model of every apparatus function that it can resolve."""

    # (m,): weighted residuals of the best Gaussian, without outliers: independent, and of unit
    # variance where the noise is stated.
    data: FloatArray
    design: FloatArray  # (m, r): weighted columns of the flat parameters, then of the departures
    point: IndexArray  # (m,): which points of the scan they are

    @cached_property
    def basis(self) -> FloatArray:
        """Orthonormal basis (m, q) of the design."""
        return orthonormal(self.design)

    @cached_property
    def left_over(self) -> FloatArray:
        """What the design leaves of the data, (m,)."""
        return self.data - self.basis @ (self.basis.T @ self.data)


def free_model(estimate: ProfileEstimate, *, clip_outliers: bool = False) -> FreeModel:
    """Linearise about the best Gaussian with all departures that can be resolved."""
    # ``clip_outliers`` keeps outliers, with residuals cut to four times their noise.
    points = estimate.points
    basis = estimate.departures
    ordinary = estimate.outlier_weight >= OUTLIER_WEIGHT
    weights = estimate.weights / estimate.outlier_weight
    u = points.u
    if clip_outliers:
        most = _CLIPPED * estimate.noise
        u = np.where(ordinary, u, estimate.predicted + np.clip(u - estimate.predicted, -most, most))
        ordinary = np.ones_like(ordinary)
    weights = np.where(ordinary, weights, estimate.weights)
    point = np.flatnonzero(ordinary)
    fit = estimate.gaussian
    model = estimate.model
    kernels = basis.kernels(model.k)[:, basis.flat :]
    first = [(u - fit.predicted)[:, None], fit.jacobian / np.linalg.norm(fit.jacobian, axis=0)]
    if basis.angular:
        first.append(basis.angular.components.signal(model, fit.centre))
    columns, mix = model.framed(fit.geometry, first)
    if mix is None:
        columns = np.hstack([columns, model.signal(fit.geometry, kernels)])
        mixed = np.eye(kernels.shape[1])
    else:
        mixed = mix @ kernels
    columns = points.standardised(columns, weights, out=columns)
    columns[~ordinary] = 0.0
    data = columns[point, 0]
    q, columns = orthonormalised(columns)
    # Angular departures are no parameters: what of them stands above the noise counts.
    _, flat, around, rings = np.split(
        columns, [1, 1 + fit.count, columns.shape[1] - len(mixed)], axis=1
    )
    if basis.angular:
        around = basis.angular.combined(around)
    rings = np.hstack([around, rings @ mixed])
    base = np.linalg.qr(flat)[0]
    left, singular, _ = np.linalg.svd(rings - base @ (base.T @ rings), full_matrices=False)
    noise = 1.0 if points.noise_stated else estimate.noise_scale
    resolved = singular > _SHARE_OF_NOISE * noise
    design = np.hstack([flat, left[:, resolved] * singular[resolved]])
    design = q @ design
    del q
    design = design if ordinary.all() else design[point]
    return FreeModel(data, design, point)


#: Weight of the correlation from one step to the next: half as much for each step farther.
_DECAY = 0.5
_FARTHEST = 8
_LEAST_SKEWNESS = 1e-3
#: Columns of the design differ within a place where more than this share of them does.
_APART = 1e-6
#: A step of which less is left, squared, is not tested.
_LEAST_STEP = 0.1
#: Power in a ring of wavenumbers that differs from the noise's by too little to matter.
_NEGLIGIBLE = 1.2
#: With fewer independent residuals there is nothing to test.
FEWEST_RESIDUALS = 3


@value_record
class TestOutcome:
    """A test's value, what it exceeds by chance once in a thousand, and its p-value."""

    #: Not a test case of pytest.
    __test__ = False

    value: float
    limit: float
    p_value: float


@array_record
class Residuals:
    """Residuals after projection, in the order of the scan."""

    values: FloatArray  # (n,): weighted; of unit variance before the projection, if as stated
    basis: FloatArray  # (n, r): orthonormal basis of what was projected out
    point: IndexArray  # (n,): the point of the scan that each belongs to
    place: IndexArray  # (n,): its place along the scan, outliers counted
    sequence: IndexArray  # (n,): which pass over the sensor: a repeat, or a raster's row
    stated: bool  # whether the noise is stated
    degrees: int  # how many of them are independent


def residuals_of(estimate: ProfileEstimate, model: FreeModel | None = None) -> Residuals:
    """Project a scan off all voltages that an apparatus function can make."""
    model = model or free_model(estimate)
    points = estimate.points
    # A line along y has a row for each place.
    across = points.free[points.scan, 0] * points.place_numbers("row")
    order = np.lexsort((points.along(points.positions), across, points.repeat, points.scan))
    place = np.argsort(order)
    sequence = grouped(across, points.repeat, points.scan)
    order = np.argsort(place[model.point])
    point = model.point[order]
    basis = model.basis[order]
    values = model.left_over[order]
    degrees = len(basis) - basis.shape[1]
    stated = points.noise_stated
    return Residuals(values, basis, point, place[point], sequence[point], stated, degrees)


def chi_square_test(residuals: Residuals) -> TestOutcome:
    """Test the residuals' size against the stated noise: chi-square per degree of freedom."""
    total = float(residuals.values @ residuals.values)
    return ratio_outcome(total / residuals.degrees, residuals.degrees, None)


def pure_error_test(estimate: ProfileEstimate, model: FreeModel) -> TestOutcome | None:
    """Test the misfit against the scatter of repeats: F(l, m) of lack of fit over pure error."""
    # Repeats at one place and load scatter by noise alone.  A mean for each place beside the design
    # leaves m degrees of pure error; the means take l.  This is exact also where repeats lie only
    # near each other (Christensen, Ann. Stat. 17, 1989): the design contains their difference.
    points = estimate.points
    keys = (points.scan, points.place_numbers("index"), points.load)
    group = grouped(*(key[model.point] for key in keys))
    if points.decorrelation or group.max() + 1 == group.size:
        return None
    weight = np.sqrt(estimate.weights / estimate.outlier_weight)[model.point]
    square = np.bincount(group, weight**2)

    def within(columns: FloatArray) -> FloatArray:
        """Subtract from each column its weighted mean at each place."""
        sums = np.column_stack([np.bincount(group, weight * c) for c in columns.T])
        return columns - weight[:, None] * (sums / square[:, None])[group]

    moved = within(model.basis)
    _, singular, right = np.linalg.svd(triangular(moved), full_matrices=False)
    apart = singular > _APART
    near = moved @ (right[apart].T / singular[apart])
    scatter = within(model.data[:, None])[:, 0]
    scatter -= near @ (near.T @ scatter)
    pure = scatter @ scatter
    pure_degrees = group.size - group.max() - 1 - near.shape[1]
    misfit = max(model.left_over @ model.left_over - pure, 0.0)
    degrees = group.size - model.basis.shape[1] - pure_degrees
    if degrees < FEWEST_RESIDUALS or pure_degrees < FEWEST_RESIDUALS or pure == 0.0:
        return None
    return ratio_outcome(misfit / degrees / (pure / pure_degrees), degrees, pure_degrees)


def ring_test(
    left: FloatArray, noise: FloatArray, index: tuple[IndexArray, IndexArray], rest: float
) -> TestOutcome:
    """Test a raster's residuals (n,) in rings of wavenumbers against noise known by ``rest``."""
    # In a ring of n components the power is chi-square of n degrees, F where the noise is
    # estimated; the least likely of several rings by Bonferroni.
    plane = np.zeros([np.ptp(i) + 1 for i in index])
    np.add.at(plane, tuple(i - i.min() for i in index), left)
    power = abs(np.fft.fft2(plane)) ** 2 / (noise @ noise)
    cycles = [np.fft.fftfreq(count) * max(plane.shape) for count in plane.shape]
    ring = np.rint(np.hypot.outer(*cycles)).astype(np.intp).ravel()
    count = np.bincount(ring)
    ratio = np.bincount(ring, power.ravel()) / count / _NEGLIGIBLE
    worst = np.argmax(ratio / fdtri(count, rest, 1 - FALSE_ALARM / count.size))
    return ratio_outcome(float(ratio[worst]), count[worst], rest, of=count.size)


def ratio_outcome(value: float, above: float, below: float | None, of: int = 1) -> TestOutcome:
    """Test an F ratio, or chi-square per degree where nothing below is estimated (``None``)."""
    # The least p-value of so many is their number times as likely (Bonferroni), whatever depends
    # on what.
    share = FALSE_ALARM / of
    if below is None:
        limit = chdtri(above, share) / above
        p_value = chdtrc(above, above * value)
    else:
        limit = fdtri(above, below, 1 - share)
        p_value = fdtrc(above, below, value)
    return TestOutcome(value, float(limit), min(of * float(p_value), 1.0))


def steps_test(residuals: Residuals) -> TestOutcome:
    """Test the largest step of the residuals within a pass, in standard deviations."""
    # A step has one degree of freedom, of which chi-square is exact (F, where no noise is stated);
    # the largest of several has the p-value of one times their number (Bonferroni).
    values = residuals.values
    starts = np.flatnonzero(np.diff(residuals.sequence, prepend=-1, append=-1))
    columns = np.column_stack([values, np.ones_like(values), residuals.basis])
    onward = np.vstack([np.cumsum(columns[::-1], axis=0)[::-1], np.zeros(columns.shape[1])])
    steps = onward[:-1] - np.repeat(onward[starts[1:]], np.diff(starts), axis=0)
    # What no baseline and no G takes of a step.
    square = steps[:, 1] - np.sum(steps[:, 2:] ** 2, axis=1)
    tested = square > _LEAST_STEP
    count = max(tested.sum(), 1)
    value = np.max(steps[tested, 0] ** 2 / square[tested], initial=0.0)
    rest = None
    if not residuals.stated:
        rest = residuals.degrees - 1
        value = rest * value / max(values @ values - value, TINY)
    outcome = ratio_outcome(value, 1, rest, of=count)
    return TestOutcome(math.sqrt(value), math.sqrt(outcome.limit), outcome.p_value)


def neighbour_correlation_test(residuals: Residuals) -> TestOutcome:
    """Test whether neighbouring residuals are alike, whatever the size of the noise."""
    # T = sum_l 2^-l sum_i e_i e_(i+l) / sum_i e_i^2 = e'We / e'e (Durbin and Watson, Biometrika 37,
    # 1950, with more lags).  Normal noise of nu degrees gives it the mean S1/nu and the central
    # moments 2 S2 / nu(nu+2) and 8 S3 / nu(nu+2)(nu+4), where S1 = tr (1 - QQ')W and
    # Sp = tr [(1 - QQ')(W - S1/nu)]^p; the p-value is that of a gamma distribution (Pearson III).
    nu = residuals.degrees
    values = residuals.values
    place = residuals.place
    sequence = residuals.sequence
    # Weights of the pairs of residuals that follow each other in one pass, by their distance.
    neighbours = []
    for i in range(1, min(_FARTHEST, place.size - 1) + 1):
        weights = 0.5 * _DECAY ** (place[i:] - place[:-i])
        neighbours.append(weights * (sequence[i:] == sequence[:-i]))
    upper = diags_array(neighbours, offsets=range(1, len(neighbours) + 1)).tocsr()
    pairs = upper + upper.T
    first, second, third = _traces(pairs, residuals.basis)
    mean = first / nu
    third += 2 * nu * mean**3 - 3 * mean * second
    second -= nu * mean**2
    if not second > 0:
        return TestOutcome(0.0, 1.0, 1.0)
    deviation = np.sqrt(2 * second / (nu * (nu + 2)))
    skewness = max(8 * third / (nu * (nu + 2) * (nu + 4)) / deviation**3, _LEAST_SKEWNESS)
    shape = 4 / skewness**2
    value = float(values @ (pairs @ values) / (values @ values)) - mean
    limit = deviation * (gammainccinv(shape, FALSE_ALARM) - shape) / np.sqrt(shape)
    p_value = gammaincc(shape, max(shape + np.sqrt(shape) * value / deviation, 0.0))
    return TestOutcome(value, float(limit), float(p_value))


def scatter_of_means(residuals: Residuals, scatter: float) -> float:
    """Scatter of readings over the stated noise, of means of many where neighbours are alike."""
    if residuals.degrees < FEWEST_RESIDUALS:
        return scatter
    outcome = neighbour_correlation_test(residuals)
    if outcome.value <= outcome.limit:
        return scatter
    values = residuals.values
    follows = np.diff(residuals.sequence) == 0
    alike = np.mean((values[1:] * values[:-1])[follows]) / np.mean(values**2)
    # The variance of a mean of readings of correlation a^|i - j| over that of independent ones.
    return scatter * math.sqrt((1 + alike) / (1 - alike))


def _traces(pairs: csr_array, basis: FloatArray) -> tuple[float, float, float]:
    """Traces of the first three powers of (1 - QQ') W, for a symmetric W without diagonal."""
    squared = pairs.multiply(pairs).sum()
    cubed = (pairs @ pairs).multiply(pairs).sum()
    # Q'WQ, Q'W^2 Q and Q'W^3 Q, some columns at a time.
    products = np.zeros((3, basis.shape[1], basis.shape[1]))
    for some in slices(basis.shape[1], _COLUMNS):
        moved = basis[:, some]
        for product in products:
            moved = pairs @ moved
            product[some] = moved.T @ basis
    first, second, third = products
    squared += np.sum(first * first.T) - 2 * np.trace(second)
    cubed += 3 * np.sum(first * second) - 3 * np.trace(third) - np.trace(first @ first @ first)
    return -np.trace(first), squared, cubed


def orthonormal(design: FloatArray, size: FloatArray | None = None) -> FloatArray:
    """Orthonormal basis of the columns' span; they are scaled by their size or norms first."""
    size = np.linalg.norm(design, axis=0) if size is None else size
    scaled = design / np.where(size > 0, size, 1.0)
    if len(scaled) > DENSE:
        return orthonormalised(scaled, np.ones_like(size), _DEPENDENT)[0]
    return orth(scaled, rcond=_DEPENDENT)
