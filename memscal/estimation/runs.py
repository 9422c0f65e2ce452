"""Tests of what scans, repeats and branches that are calibrated together have in common.

All are of the weighted scan beside every voltage that an apparatus function can make, and of the
scatter that is left when what differs is fitted: a difference that is looked for is not its noise.
"""

import numpy as np
from scipy.special import fdtrc

from memscal.axisymmetry.kernels import gaussian_transfer_slope
from memscal.estimation import residuals
from memscal.estimation.points import MINIMUM_POSITIONS, ScanPoints, grouped
from memscal.estimation.profile import NUMERICAL_FLOOR, ProfileEstimate
from memscal.estimation.residuals import FEWEST_RESIDUALS, TestOutcome, ratio_outcome
from memscal.estimation.voltage_map import triangular
from memscal.model.arrays import TINY, FloatArray, IndexArray, array_record, value_record

#: Repeats of one branch differ from each other, too, beyond this p-value.
_WANDERS = 0.05
#: Columns are dependent below this share of the largest.
_DEPENDENT = 1e-10


@array_record
class _Fit:
    """A scan fitted by every apparatus function and further columns."""

    coefficients: FloatArray  # (p,): of the flat parameters and departures, then of the columns
    root: FloatArray  # (p, p): of their covariance, by the scatter that is left
    left: FloatArray  # (m,): what is left of the weighted data
    leverage: FloatArray  # (m,): share of each reading's noise that the fit takes up
    point: IndexArray  # (m,): which points of the scan they are
    degrees: int

    @classmethod
    def of(cls, estimate: ProfileEstimate, columns: FloatArray) -> "_Fit | None":
        """Fit with columns (n, q), in V; ``None`` if too little is left."""
        # Of many outliers together each counts, a single one counts little.
        model = residuals.free_model(estimate, clip_outliers=True)
        weights = estimate.weights / estimate.outlier_weight
        added = estimate.points.standardised(columns, weights)[model.point]
        design = np.hstack([model.design, added])
        size = np.maximum(np.linalg.norm(design, axis=0), TINY)
        root = np.linalg.pinv(triangular(design) / size, rcond=_DEPENDENT) / size[:, None]
        basis = design @ root
        along = basis.T @ model.data
        left = model.data - basis @ along
        # The first parameters are by columns of unit length.
        flat = np.linalg.norm(estimate.gaussian.jacobian, axis=0)
        root[: flat.size] /= flat[:, None]
        leverage = np.sum(basis**2, axis=1)
        degrees = leverage.size - round(leverage.sum())
        if degrees < FEWEST_RESIDUALS:
            return None
        scaled = root * np.linalg.norm(left) / np.sqrt(degrees)
        return cls(root @ along, scaled, left, leverage, model.point, degrees)

    def tested(self, values: FloatArray, rows: FloatArray, of: int = 1) -> TestOutcome:
        """Test sums of coefficients, by those of the root, as one of so many tests: an F ratio."""
        z = np.linalg.lstsq(rows, values)[0]
        return ratio_outcome(float(z @ z) / len(rows), len(rows), self.degrees, of)


@value_record
class CentresApart(TestOutcome):
    """Test of whether the repeats of a line have centres of their own: an F ratio."""

    distance: float  # of the two repeats of a scan that are farthest apart, in m


def repeat_centres_test(estimate: ProfileEstimate) -> CentresApart | None:
    """Shift each repeat of line scans, whatever G; ``None`` without repeats that can be shifted."""
    points = estimate.points
    first, number, readings = _runs(points)
    count = readings.size
    if points.planar or count == points.scans or readings.min() < MINIMUM_POSITIONS:
        return None
    own = np.eye(count)[number]
    along = points.along(points.positions)[:, None]
    shift = estimate.model.shift_derivative(estimate.gaussian.geometry, estimate.kernel)
    # The first repeat of each scan has the scan's centre, the others are shifted from it.  Each has
    # a baseline and a drift of its own, as it has where it has a centre of its own.
    scan = points.scan[first]
    shifted = np.diff(scan, prepend=-1) == 0
    shifts = own[:, shifted] * points.along(shift)[:, None]
    fit = _Fit.of(estimate, np.hstack([own, own * along, shifts]))
    if not fit:
        return None
    places = np.zeros(count)
    moved = fit.coefficients[-shifts.shape[1] :]
    places[shifted] = moved
    return CentresApart(
        **vars(fit.tested(moved, fit.root[-moved.size :])),
        distance=max(np.ptp(places[scan == i]) for i in range(points.scans)),
    )


def _runs(points: ScanPoints) -> tuple[IndexArray, IndexArray, IndexArray]:
    """First reading of each run, the number of the run of each reading, and its readings."""
    return np.unique(points.repeat, return_index=True, return_inverse=True, return_counts=True)[1:]


@array_record
class BranchesApart:
    """What approach and retreat differ by, with its uncertainty; the test is an F ratio."""

    outcome: TestOutcome
    values: FloatArray
    errors: FloatArray


def hysteresis_test(estimate: ProfileEstimate) -> BranchesApart | None:
    """Compare approach and retreat within each scan that has both; ``None`` without any."""
    # Each approach minus retreat: of A and of the width, relative; of the centre along the scan, in
    # m; and, where both have one baseline, of that, in V, whose step would else count as one of A.
    points = estimate.points
    sign = 0.5 * (points.branch == 1) - 0.5 * (points.branch == 2)
    for scan in np.unique(points.owner):
        inside = points.owner == scan
        if np.ptp(sign[inside]) < 1:
            sign[inside] = 0
    if not sign.any():
        return None
    model = estimate.model
    geometry = model.geometry(estimate.centres)
    sigma = estimate.gaussian.sigma
    wider = estimate.conversion_constant * sigma * gaussian_transfer_slope(model.k, sigma)
    columns = [estimate.signal, model.signal(geometry, wider)]
    mean = np.bincount(points.scan, sign) / np.bincount(points.scan)
    both = abs(mean)[points.scan] < abs(sign)
    if both.any():
        columns += [both * points.along(model.shift_derivative(geometry, estimate.kernel)), both]
    fit = _Fit.of(estimate, sign[:, None] * np.column_stack(columns))
    if not fit:
        return None
    values = fit.coefficients[-len(columns) :]
    rows = fit.root[-len(columns) :]
    errors = np.linalg.norm(rows, axis=1)
    if both.any():
        return BranchesApart(fit.tested(values, rows), values, errors)
    distance, error, degrees = _centres_apart(estimate, fit, sign)
    outcome = min(
        fit.tested(values, rows, of=2),
        ratio_outcome((distance / error) ** 2, 1, degrees, of=2),
        key=lambda outcome: outcome.p_value,
    )
    return BranchesApart(outcome, np.append(values, distance), np.append(errors, error))


def _centres_apart(
    estimate: ProfileEstimate, fit: _Fit, sign: FloatArray
) -> tuple[float, float, int]:
    """Distance (m) of branches whose repeats have their own centres; its error; of what degrees."""
    points = estimate.points
    start = np.unique(points.scan, return_index=True)[1]
    chosen = np.flatnonzero(sign[start])
    side = sign[start][chosen]
    group = grouped(points.owner[start][chosen], side)
    count = np.bincount(group)
    free = points.free.sum(axis=1)
    first = (np.cumsum(free) - free)[chosen]
    centres = estimate.gaussian.centre[points.free][first] + fit.coefficients[2 + first]
    root = fit.root[2 + first]
    share = 4 * side / count[group] / count.size
    error = float(np.linalg.norm(share @ root))
    degrees = fit.degrees
    # Repeats that wander differ within a branch as they do between the branches.
    inside = centres - (np.bincount(group, centres) / count)[group]
    freedom = group.size - count.size
    scatter = inside @ inside / max(freedom, 1)
    noise = np.sum(root**2) / group.size
    if freedom and fdtrc(freedom, degrees, scatter / noise) < _WANDERS:
        error = np.sqrt(scatter * share @ share)
        degrees = freedom
    return share @ centres, error, degrees


@array_record
class RunsApart:
    """Baselines and noise of runs, each repeat of each scan one, compared with all others'."""

    count: int
    offset: TestOutcome  # of the run that is farthest from the mean of the others: an F ratio
    moved: int  # its number
    distance: float  # of it, in V
    error: float  # standard uncertainty of that
    noise: TestOutcome  # ratio of variances of the run that differs most and of the others, or back
    noisy: int  # its number
    louder: bool  # whether its own is the larger one


def compare_runs(estimate: ProfileEstimate) -> RunsApart | None:
    """Compare the runs' baselines, each with a gain of its own, and what is left of each."""
    points = estimate.points
    start, number, readings = _runs(points)
    count = readings.size
    if count == 1:
        return None
    own = np.eye(count)[number]
    fit = _Fit.of(estimate, np.hstack([own[:, 1:] * estimate.signal[:, None], own]))
    if not fit:
        return None
    # A run's baseline is its scan's and its own, whatever share of both is which.
    straight = 1 + points.free.sum(axis=1)
    place = (np.cumsum(straight) - straight)[points.scan[start]]
    baselines = estimate.gaussian.drift[place] + fit.coefficients[-count:]
    place += points.centres.stop
    baselines += fit.coefficients[place]
    rows = fit.root[place] + fit.root[-count:]
    # Of two runs there is one difference.
    tests = count if count > 2 else 1
    others = count / (count - 1)
    rows = others * (rows - rows.mean(axis=0))
    distances = others * (baselines - baselines.mean())
    errors = np.linalg.norm(rows, axis=1)
    moved = int(np.argmax(abs(distances[:tests] / errors[:tests])))
    offset = fit.tested(distances[[moved]], rows[[moved]], of=tests)
    run = number[fit.point]
    # Of scans without noise rounding is left.
    floor = NUMERICAL_FLOOR * estimate.largest_signal * estimate.weights.max() ** 0.5
    square = np.bincount(run, fit.left**2 + floor**2, count)
    degrees = np.maximum(np.bincount(run, 1 - fit.leverage, count), 1.0)
    ratio = np.log(square / degrees / ((square.sum() - square) / (degrees.sum() - degrees)))
    noisy = int(np.argmax(abs(ratio[:tests])))
    louder = bool(ratio[noisy] > 0)
    pair = (degrees[noisy], degrees.sum() - degrees[noisy])
    larger = float(np.exp(abs(ratio[noisy])))
    noise = ratio_outcome(larger, *(pair if louder else pair[::-1]), of=2 * tests)
    distance = float(distances[moved])
    return RunsApart(count, offset, moved, distance, float(errors[moved]), noise, noisy, louder)
