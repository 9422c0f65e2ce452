r"""Smoothing spline through the voltages of a scan: the profile that a division of fields divides.

Centre, baseline and drift are removed.  What is left, per newton of load, is a radial function
:math:`f(r)`, even about the axis, of both sides and all repeats: the quintic spline that
minimises

.. math::

    \sum_i w_i\,\bigl(y_i - f(r_i)\bigr)^2
    + \lambda \int_0^R \rho(r)\,\bigl(f'''(r)\bigr)^2\,dr .

Its one parameter :math:`\lambda` maximises the restricted likelihood of the voltages (Wahba, Ann.
Stat. 13 (1985) 1378).  The curvature of what a film transmits falls off as its stress does, so
that :math:`\rho` is the inverse square of the reference's own profile.  Beyond R, the distance of
the last point rounded up to half a step, the profile goes on as the film's own decay, that of the
reference: its amplitude is fitted with the spline, whose logarithmic slope at R is that of the
reference.

For given centre, weights and :math:`\lambda` the result is linear in the voltages.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse import block_diag, csr_array, eye_array, vstack
from scipy.special import j0, j1

from memscal.axisymmetry.hankel import ACROSS, RadialSpectrum, Wavenumbers, gauss_between
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.voltage_map import DENSE, VoltageMap
from memscal.model.arrays import ArrayTriple, FloatArray, IndexArray, array_record
from memscal.model.checks import OUTLIER_WEIGHT

Splines = Callable[[FloatArray, int], csr_array]
#: Order of the derivative that is penalised; the spline is of degree 2 m - 1.
_ORDER = 3
_DEGREE = 2 * _ORDER - 1
#: Intervals of the spline: so many for each step of the scan, for each radian of the last
#: wavenumber, and at most.
_PER_STEP = 2
_PER_RADIAN = 2
_MOST_INTERVALS = 400
#: Error of a spline, relative to the largest voltage: what it leaves of a scan without noise.
_FLOOR_OF_NOISE = 5e-6
#: The reference's profile counts as no less than this share of its maximum.
_FLOOR = 0.01
#: Weight of the spline itself beside its third derivative, in units of the scan's step.
_NEXT_TO_NOTHING = 1e-6
#: Nodes of the quadrature in each interval.
_NODES = 8
#: Rounds in which the smoothing parameter's logarithm is found, each to a ninth.
_SECTIONS = 14
#: Misfit of a scan without noise, relative to its signal.
_LEAST = 1e-14


@array_record
class SmoothedProfile:
    """The radial profile of the voltages, per newton, as a linear function of them."""

    estimate: ProfileEstimate  # whose centre, baseline, drift and noise it takes
    signal: FloatArray  # (n,): voltages of what is round alone, in V
    gain: VoltageMap  # (k, n): derivative of the profile's transform by the voltages, in m^2/N
    spectrum: RadialSpectrum  # transform of the profile per newton, in V m^2/N
    predicted: FloatArray  # (n,): the smoothed signal at the points, in V

    @cached_property
    def noise(self) -> FloatArray:
        """Standard uncertainty of each component of the transform from noise, in V m^2/N."""
        ordinary = self.estimate.outlier_weight >= OUTLIER_WEIGHT
        floor = _FLOOR_OF_NOISE * abs(self.signal[ordinary]).max()
        electronic = np.sum(self.estimate.scattered(self.gain) ** 2, axis=1)
        plain = np.diag(self.gain.covariance(np.ones_like(self.signal)))
        variance: FloatArray = electronic + floor**2 * plain
        return np.sqrt(variance)


def smooth_profile(estimate: ProfileEstimate) -> SmoothedProfile:
    """Smooth the voltages of scans about their centres; of several references, put together."""
    points = estimate.points
    references = estimate.model.references
    # Less the background and what of sensor and reference is not round.
    signal = points.u - estimate.background - estimate.oval - estimate.uneven
    predicted = np.zeros(points.u.size)
    gains = []
    for scans in estimate.model.alike:
        reference = references[scans[0]]
        rows = np.flatnonzero(np.isin(points.scan, scans))
        load = points.load[rows]
        gain, smoothed = _fitted(estimate, signal[rows], reference, rows)
        predicted[rows] = load * smoothed
        gains.append((reference.values, gain.over(1 / load, rows, points.u.size)))
    gain = _joined(gains, estimate) if len(gains) > 1 else gains[0][1]
    spectrum = replace(references[0], values=gain @ signal)
    return SmoothedProfile(estimate, signal, gain, spectrum, predicted)


def _joined(
    gains: Sequence[tuple[FloatArray, VoltageMap]], estimate: ProfileEstimate
) -> VoltageMap:
    r"""Join profiles of several references to that of the first, by least squares at each k.

    .. math:: \hat U = \hat\sigma_1 \sum_s \hat\sigma_s \hat U_s / v_s
              \Big/ \sum_s \hat\sigma_s^2 / v_s
    """
    first = gains[0][0]
    above = VoltageMap(())
    below = np.zeros_like(first)
    for stress, gain in gains:
        share = stress / np.sum(estimate.scattered(gain) ** 2, axis=1)
        above += gain * share
        below += stress * share
    return above * (first / below)


def _fitted(
    estimate: ProfileEstimate, signal: FloatArray, reference: RadialSpectrum, rows: IndexArray
) -> tuple[VoltageMap, FloatArray]:
    """Fit the points of one reference, at their weights: the transform by voltages, the fit."""
    # By voltages per newton.
    points = estimate.points
    y = signal / points.load[rows]
    noise = (estimate.noise / estimate.outlier_weight**0.5)[rows] / points.load[rows]
    # An outlier may be a thousand times the signal.
    ordinary = estimate.outlier_weight[rows] >= OUTLIER_WEIGHT
    weight = 1 / (noise**2 + (_FLOOR_OF_NOISE * abs(y[ordinary]).max()) ** 2)
    if reference.source:
        # A source ends: what decays is G about it.
        blurred = gaussian_transfer(estimate.model.k, estimate.gaussian.sigma)
        reference = replace(reference, values=reference.values * blurred)
    radius = estimate.distance[rows]
    reach = (1 + 2e-9) * rounded_reach(radius.max(), points.step)
    nodes = reference.wavenumbers
    arrays = (array.tobytes() for array in (nodes.k, nodes.weights, reference.values))
    basis, intervals, free, penalty, transform = _layout(
        reach, points.step, reference.order, reference.source, *arrays
    )
    interval = np.minimum((radius / reach * intervals).astype(np.intp), intervals - 1)
    splines = basis(radius, 0)
    gain = _smoothed(splines, interval, free, penalty, y, weight)
    return transform @ gain, splines @ (free @ (gain @ y))


def _smoothed(
    splines: csr_array,
    interval: IndexArray,
    free: FloatArray,
    penalty: FloatArray,
    y: FloatArray,
    weight: FloatArray,
) -> VoltageMap:
    """Smooth y (n,) by the restricted likelihood: coefficients of the free splines by y."""
    # ``splines`` (n, b) at the points, which lie in an ``interval`` each; ``free`` (b, m) of them,
    # and the triangular root (m, m) of their penalty.
    root = np.sqrt(weight)
    weighted = splines.multiply(root[:, None]).tocsr()
    # Between two knots few splines differ from zero: each interval has few rows in R.
    if root.size > DENSE:
        cells, reduced = _by_intervals(weighted, interval)
    else:
        cells = eye_array(root.size, format="csr")
        reduced = weighted.toarray()
    design = solve_triangular(penalty, (reduced @ free).T, trans="T").T
    left, values, right = np.linalg.svd(design, full_matrices=False)
    data = root * y
    along = left.T @ (cells.T @ data)
    smoothing = _restricted_likelihood(values, along, float(data @ data), y.size)
    filters = values / (values**2 + smoothing)
    # The data, by the rows of the reduced design, to the coefficients.
    back = solve_triangular(penalty, (right.T * filters) @ left.T)
    return VoltageMap(((back, cells.multiply(root[:, None]).tocsr()),))


def _by_intervals(weighted: csr_array, interval: IndexArray) -> tuple[csr_array, FloatArray]:
    """QR decomposition of B-splines at points, interval by interval: Q (n, r) and R (r, b)."""
    order = np.argsort(interval, kind="stable")
    starts = np.flatnonzero(np.diff(interval[order])) + 1
    factors = []
    roots = []
    for rows in np.split(order, starts):
        block = weighted[rows]
        columns = np.unique(block.indices)
        q, r = np.linalg.qr(block[:, columns].toarray())
        whole = np.zeros((len(r), weighted.shape[1]))
        whole[:, columns] = r
        factors.append(q)
        roots.append(whole)
    return csr_array(block_diag(factors, format="csr"))[np.argsort(order)], np.vstack(roots)


def _restricted_likelihood(values: FloatArray, data: FloatArray, total: float, count: int) -> float:
    """Return the smoothing parameter of the largest restricted likelihood, its noise free."""
    # ``values``: singular values of the weighted splines over the root of the penalty; ``data``:
    # the voltages along their vectors; ``total``: sum of the squares of all ``count``.
    relative = values**2 / values[0] ** 2
    power = data**2

    def ratios(logarithms: FloatArray) -> ArrayTriple:
        ratio = relative / np.exp(logarithms)[:, None]
        kept = ratio / (1 + ratio)
        return ratio, kept, np.maximum(total - kept @ power, _LEAST * total)

    grid = np.arange(-80.0, 11.0, 1.0)
    ratio, _, misfit = ratios(grid)
    best = grid[np.argmin(count * np.log(misfit) + np.log1p(ratio).sum(axis=1))]
    # There the loss's slope crosses zero upwards: between which of ten places, again and again.
    places = np.linspace(best - 1.0, best + 1.0, 10)
    for _ in range(_SECTIONS):
        ratio, kept, misfit = ratios(places)
        slope = count * ((kept / (1 + ratio)) @ power) / misfit - kept.sum(axis=1)
        first = np.argmax(np.append(slope[1:-1] > 0, True))
        places = np.linspace(places[first], places[first + 1], 10)
    return float(values[0] ** 2 * np.exp(places.mean()))


def rounded_reach(distance: float, step: float) -> float:
    """Round a distance up to half steps of a scan: those of one layout share what depends on it."""
    return float(np.ceil((1 - 1e-9) * distance / (step / 2)) * step / 2)


@lru_cache(maxsize=8)
def _layout(
    reach: float, step: float, order: int, source: bool, *arrays: bytes
) -> tuple[Splines, int, FloatArray, FloatArray, FloatArray]:
    """Splines by radii and derivative, their intervals; free ones, root and transforms of these."""
    # ``arrays``: the reference's wavenumbers with their weights, and its values.
    k, measure, per_newton = map(np.frombuffer, arrays)
    reference = RadialSpectrum(Wavenumbers(k, measure), per_newton, order)
    finest = min(_PER_STEP / step, _PER_RADIAN * k[-1])
    intervals = int(np.clip(np.ceil(finest * reach), _DEGREE, _MOST_INTERVALS))
    knots = np.linspace(0.0, reach, intervals + 1)
    basis = _even_splines(knots)
    nodes, weights = gauss_between(knots, _NODES)
    stress = reference.at(nodes)
    peak, end = reference.at(np.array([0.0, reach]))
    slope = -(measure * k * per_newton) @ j1(k * reach)
    # At R a spline has the logarithmic slope of the tail, which goes on from there.
    last = np.array([reach])
    ending = basis(last, 0).toarray()
    tied = step * (end * basis(last, 1).toarray() - slope * ending)
    # A source that ends inside has no tail to go on with: the spline ends with the scan.
    free = np.eye(tied.size) if source else np.linalg.svd(tied)[2][1:].T
    curved = basis(nodes, _ORDER).toarray() * step**_ORDER
    values = basis(nodes, 0).toarray()
    rho = 1 / (abs(stress) / peak + _FLOOR) ** 2
    # What no penalty holds, a parabola, is held by next to nothing.
    rows = np.vstack([curved, _NEXT_TO_NOTHING * values]) @ free
    rows *= np.tile(np.sqrt(weights * rho), 2)[:, None]
    phase = np.outer(k, nodes)
    bessel = 2 * np.cos(phase) if order == ACROSS else 2 * np.pi * j0(phase) * nodes
    bessel *= weights
    transform = bessel @ values @ free
    if not source:
        transform += np.outer((per_newton - bessel @ stress) / end, ending @ free)
    return basis, intervals, free, np.linalg.qr(rows)[1], transform


def _even_splines(knots: FloatArray) -> Splines:
    """Return even B-splines on even knots from zero: their derivatives at radii, (n, m)."""
    from scipy.interpolate import BSpline

    right = np.append(knots, knots[-1] + knots[1] * np.arange(1, _DEGREE + 1))
    extended = np.append(-right[:0:-1], right)
    count = extended.size - _DEGREE - 1
    spline = BSpline(extended, np.eye(count), _DEGREE)
    middle = count // 2
    # The even half of them: each spline with its mirror image.
    upper = eye_array(count - middle).tocsr()
    folding = vstack([upper[count % 2 :][::-1], upper]).tocsr()

    def values(radius: FloatArray, derivative: int) -> csr_array:
        if derivative == 0:
            return csr_array(BSpline.design_matrix(radius, extended, _DEGREE) @ folding)
        return csr_array(spline(radius, nu=derivative) @ folding)

    return values
