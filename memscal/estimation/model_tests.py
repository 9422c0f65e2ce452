"""Tests of the model's assumptions: symmetry, linearity in load, a round and Gaussian sensor.

Some add m columns to the fitted model: chi-square falls by a chi-square variable of m degrees
of freedom.  Others predict a group of points from the rest, or look for a ceiling of the voltage.
"""

from dataclasses import replace

import numpy as np
from scipy.special import chdtri, ndtri

from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.errors import FitError
from memscal.estimation import residuals
from memscal.estimation.bayesian import weigh_departures
from memscal.estimation.departures import ReducedScan, departure_basis
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.points import FEWEST_AT_CEILING, agreeing_tops
from memscal.estimation.profile import NUMERICAL_FLOOR, ProfileEstimate
from memscal.estimation.residuals import FEWEST_RESIDUALS, TestOutcome, ratio_outcome
from memscal.estimation.voltage_map import evenly, square_root, triangular
from memscal.model.arrays import TINY, BoolArray, FloatArray, IndexArray, array_record, value_record
from memscal.model.checks import FALSE_ALARM
from memscal.readings.find_places import clusters

#: More groups than this are held out several at a time.
_MOST_FOLDS = 10
#: Loads that differ by less of their mean are one load, recorded with scatter.
_SAME_LOAD = 0.05


@value_record
class HeldOut(TestOutcome):
    """The worst predicted of several groups: chi-square per degree, or F if no noise is stated."""

    worst: int  # its number among the groups, from zero
    folds: int  # how many groups were held out
    alone: bool  # whether each group was held out by itself: of more than ten, several are at once


def load_groups(load: FloatArray) -> IndexArray:
    """Number the loads: those closer than a twentieth of their mean are one, shape (n,)."""
    return clusters(load, _SAME_LOAD * load.mean())[0]


def hold_out(estimate: ProfileEstimate, group: IndexArray) -> HeldOut | None:
    """Predict each group of points from the others; ``None`` with fewer than two such groups."""
    # The distance of the group's data from the prediction, in the covariance of noise and
    # parameters, is S(all) - S(others) of residual sums of squares (Chow, Econometrica 28, 1960).
    if np.unique(group).size < 2:
        return None
    # Clipped: many outliers in one group count together, and a single one counts little.
    model = residuals.free_model(estimate, clip_outliers=True)
    # Centre, baseline and drift are fitted to a held-out group by itself.
    nuisances = slice(2, estimate.points.centres.stop + estimate.model.straight_columns.shape[1])
    count = group.max() + 1
    # Of too many groups, neighbouring ones are joined.
    fold = (group * min(count, _MOST_FOLDS) // count)[model.point]
    # The triangular factors of each fold's design and data stand for them.
    both = np.column_stack([model.design, model.data])
    roots = {i: triangular(both[fold == i]) for i in np.unique(fold)}
    sizes = np.bincount(fold)
    ratios = {}
    for i in roots:
        ratio = _predict(estimate.points.noise_stated, roots, sizes, i, nuisances)
        if ratio:
            ratios[i] = ratio
    folds = len(ratios)
    if folds < 2:
        return None
    worst = min(ratios, key=lambda i: ratio_outcome(*ratios[i]).p_value)
    outcome = ratio_outcome(*ratios[worst], of=folds)
    return HeldOut(**vars(outcome), worst=worst, folds=folds, alone=count <= _MOST_FOLDS)


def _predict(
    stated: bool, roots: dict[int, FloatArray], sizes: IndexArray, out: int, nuisances: slice
) -> tuple[float, int, int | None] | None:
    """Chi-square per degree, its degrees, and those of the others if no noise is stated."""
    own = roots[out]
    rest = np.vstack([root for i, root in roots.items() if i != out])
    both = np.vstack([rest, own])
    # What a fold alone determines is zero in the others but for rounding.
    size = np.linalg.norm(both[:, :-1], axis=0)
    others, rank = _left_over(rest, size)
    others_degrees = sizes.sum() - sizes[out] - rank
    own_nuisances = both[:, nuisances].copy()
    own_nuisances[: len(rest)] = 0.0
    left, rank = _left_over(np.hstack([own_nuisances, both]), np.append(size[nuisances], size))
    degrees = sizes.sum() - rank - others_degrees
    if degrees < FEWEST_RESIDUALS or others_degrees < FEWEST_RESIDUALS:
        return None
    value = max(left - others, 0.0) / degrees
    if stated:
        return value, degrees, None
    return value / max(others / others_degrees, TINY), degrees, others_degrees


def _left_over(root: FloatArray, size: FloatArray) -> tuple[float, int]:
    """Residual sum of squares of the last column by others of a size; their rank."""
    basis = residuals.orthonormal(root[:, :-1], size)
    rest = root[:, -1] - basis @ (basis.T @ root[:, -1])
    return float(rest @ rest), basis.shape[1]


@array_record
class ExtraColumns:
    """Outcome of adding columns to the model."""

    fall: float  # of chi-square
    count: int  # of columns
    coefficients: FloatArray
    size: float  # largest voltage that the columns add, over the largest signal


def symmetry_test(estimate: ProfileEstimate) -> ExtraColumns:
    """Compare the left and right halves of a line scan by odd columns (even for a shear)."""
    side = estimate.points.along(estimate.offset)
    return _add(estimate, side[:, None] * _widened(estimate, (0.5, 1.0, 1.5)))


def axisymmetry_test(estimate: ProfileEstimate) -> ExtraColumns:
    """Test whether a raster is elliptic: columns that vary as cos 2a and sin 2a."""
    dx, dy = estimate.offset
    quadrupole = np.stack([dx**2 - dy**2, 2 * dx * dy])
    columns = [quadrupole * shape for shape in _widened(estimate, (0.5, 1.0)).T]
    return _add(estimate, np.vstack(columns).T)


def linearity_test(estimate: ProfileEstimate) -> ExtraColumns | None:
    r"""Fit eta of :math:`U \propto P (1 + \eta (P - \bar P)/\bar P)`; ``None`` for equal loads."""
    load = estimate.points.load
    mean = load.mean()
    if np.ptp(load) < _SAME_LOAD * mean:
        return None
    return _add(estimate, (estimate.signal * (load - mean) / mean)[:, None])


def _widened(estimate: ProfileEstimate, factors: tuple[float, ...]) -> FloatArray:
    """Profiles of Gaussians of several widths, shape (n, factors): smooth test functions."""
    fit = estimate.gaussian
    kernels = gaussian_transfer(estimate.model.k[:, None], fit.width * np.array(factors))
    return estimate.model.signal(fit.geometry, kernels)


def _add(estimate: ProfileEstimate, columns: FloatArray) -> ExtraColumns:
    """Fit the columns together with a round Gaussian, the departures subtracted as estimated."""
    weights = estimate.weights / estimate.noise_scale**2
    scale = abs(columns).max(axis=0)
    columns = columns / scale
    count = estimate.gaussian.count - estimate.points.ellipse
    round_ = estimate.gaussian.jacobian[:, :count]
    gaussian = round_ / np.linalg.norm(round_, axis=0)
    left = (estimate.weighed.residual + estimate.oval)[:, None]
    # What the triangular factor has below the rows of the round columns is free of them.
    root = triangular(estimate.points.standardised(np.hstack([gaussian, columns, left]), weights))
    free = root[count:, count:-1]
    residual = root[count:, -1]
    coefficients = np.linalg.lstsq(free, residual)[0]
    fall = float(residual @ free @ coefficients)
    size = abs(columns @ coefficients).max() / estimate.largest_signal
    return ExtraColumns(fall, columns.shape[1], coefficients / scale, size)


#: Readings at three places agree by chance so many times better than a fit has them differ once in
#: thousands of scans; those at more places agree less closely by chance, but not so many times.
_CLOSER = 50.0
_LEAST_CLOSER = 10.0
#: A fit is flat among readings where it changes by less than this share of the noise, or of the
#: largest signal.
_OF_NOISE = 0.5
_FLAT = 0.01
#: A profile through the others that rises by less than this share of it tells no ceiling; where the
#: fit is flat, by less than the second.
_RISEN = 0.005
_RISEN_OF_FLAT = 0.15
#: Points are a plateau while their scatter has at least this p-value; this weight leaves them out.
_ALIKE = 1e-3
_LITTLE = 1e-9
#: So many points of it, and of the others, are enough.
_ENOUGH = 10_000


def clipped_points(estimate: ProfileEstimate) -> BoolArray:
    """Say which points were held at a ceiling, shape (n,), of a channel that is no shear."""
    clipped = np.zeros(estimate.points.u.size, bool)
    for inside in estimate.points.inside:
        agreeing, top = _agreeing(estimate, inside)
        for flat in (agreeing, _plateau(estimate, inside)):
            if not top.any() and _risen_above(estimate, flat):
                top = flat
        clipped |= top
    return clipped


def _agreeing(estimate: ProfileEstimate, inside: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Highest readings (n,) of a scan that agree, and those far better than the fit has them."""
    rows = np.flatnonzero(inside)
    falling, counts, apart = agreeing_tops(estimate.points.u[rows])
    rows = rows[falling]
    u = estimate.points.u[rows]
    asked = estimate.predicted[rows]
    highest = np.maximum.accumulate(asked)
    differ = highest - np.minimum.accumulate(asked)
    # What moves a place moves all of its readings.
    new = np.zeros(u.size)
    new[np.unique(estimate.points.place_numbers("index")[rows], return_index=True)[1]] = 1.0
    places = np.maximum(np.cumsum(new), 2.0)
    closer = np.maximum(_CLOSER ** (2 / (places - 1)), _LEAST_CLOSER)
    least = max(_OF_NOISE * np.median(estimate.noise[inside]), _FLAT * estimate.largest_signal)
    better = (differ > closer * apart) & (differ > least) & (highest > u[0])
    place = np.full(inside.size, inside.size)
    place[rows] = np.arange(rows.size)
    return place < counts.max(initial=0), place < counts[better[counts - 1]].max(initial=0)


def _risen_above(estimate: ProfileEstimate, plateau: BoolArray) -> bool:
    """Whether the profile through all other points rises above a plateau of a scan."""
    if plateau.sum() < FEWEST_AT_CEILING:
        return False
    outlier = estimate.outlier_weight
    model = estimate.model
    points = estimate.points
    least_rise = _RISEN
    if np.ptp(estimate.predicted[plateau]) < _FLAT * estimate.largest_signal:
        # It may be so for it follows a clipped top, and leaves out as outliers what is beside it.
        least_rise = _RISEN_OF_FLAT
        outlier = np.ones_like(outlier)
    weights = np.where(plateau, _LITTLE, outlier / estimate.outlier_weight) * estimate.weights
    chosen = np.arange(plateau.size)
    if plateau.size > 2 * _ENOUGH and not points.decorrelation:
        # Some of the plateau, and of the others.
        some = evenly(np.flatnonzero(plateau), _ENOUGH)
        others = evenly(np.flatnonzero(~plateau), _ENOUGH)
        chosen = np.sort(np.append(some, others))
        model = replace(model, points=points.selected(chosen))
        weights = weights[chosen]
    try:
        fit = fit_gaussian_to_points(model, weights, start=estimate.gaussian)
    except FitError:
        return False
    angular = estimate.basis.angular
    reduced = ReducedScan.of(model, fit, weights, angular.components if angular else None)
    basis = departure_basis(fit, reduced, angular)
    count = (outlier * ~plateau)[chosen].sum()
    least = 1.0 if points.noise_stated else NUMERICAL_FLOOR * estimate.largest_signal
    weighed = weigh_departures(reduced, basis, count, least_noise=least).average()
    # Mean over the plateau of the prediction less the voltage, and its standard uncertainty.
    share = plateau[chosen] / plateau[chosen].sum()
    overshoot = -(share @ weighed.residual)
    spread = share @ basis.voltages(model, fit, square_root(weighed.covariance))
    variance = share**2 @ estimate.noise[chosen] ** 2 + spread @ spread
    least = max(-ndtri(FALSE_ALARM) * np.sqrt(variance), least_rise * estimate.largest_signal)
    return bool(overshoot > least)


def _plateau(estimate: ProfileEstimate, inside: BoolArray) -> BoolArray:
    """Points of a scan about its centre that are equal within the noise."""
    order = np.argsort(np.where(inside, estimate.distance, np.inf), kind="stable")
    u = estimate.points.u[order]
    plateau = np.zeros_like(inside)
    # Scatter about the mean of the first points, for every number of them.
    half = inside.sum() // 2
    weight = estimate.noise[order][:half] ** -2
    offset = u[:half] - u[:1]
    total, first, second = (np.cumsum(weight * offset**power) for power in range(3))
    scatter = second - first**2 / total
    count = np.arange(1, half + 1)
    beyond = (scatter > chdtri(np.maximum(count - 1, 1), _ALIKE)) & (count >= FEWEST_AT_CEILING)
    last = np.argmax(beyond) if beyond.any() else half - 1
    if last >= FEWEST_AT_CEILING:
        plateau[order[:last]] = True
    return plateau
