"""Tests of what scans, repeats and branches that are calibrated together have in common.

All are of the weighted scan beside every voltage that an apparatus function can make, and of the
scatter that is left when what differs is fitted: a difference that is looked for is not its noise.
"""

import numpy as np
from scipy.special import fdtrc, fdtri

from memscal.axisymmetry.kernels import gaussian_transfer_slope
from memscal.estimation import residuals
from memscal.estimation.points import grouped
from memscal.estimation.profile import NUMERICAL_FLOOR, ProfileEstimate
from memscal.estimation.residuals import FEWEST_RESIDUALS, TestOutcome
from memscal.estimation.voltage_map import triangular
from memscal.model.arrays import FloatArray, IndexArray, array_record
from memscal.model.checks import FALSE_ALARM

#: Repeats of one branch differ from each other, too, beyond this p-value.
_WANDERS = 0.05
#: Columns are dependent below this share of the largest.
_DEPENDENT = 1e-10


@array_record
class _Fit:
    """A scan fitted by every apparatus function and further columns."""

    coefficients: FloatArray  # (p,): of the flat parameters and departures, then of the columns
    root: FloatArray  # (p, p): of their covariance, for noise of unit variance
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
        root = np.asarray(np.linalg.pinv(triangular(design), rcond=_DEPENDENT), dtype=np.float64)
        basis = design @ root
        along = basis.T @ model.data
        left = model.data - basis @ along
        # The first parameters are by columns of unit length.
        flat = np.linalg.norm(estimate.gaussian.jacobian, axis=0)
        root[: flat.size] /= flat[:, None]
        leverage = np.sum(basis**2, axis=1)
        degrees = leverage.size - round(float(leverage.sum()))
        if degrees < FEWEST_RESIDUALS:
            return None
        return cls(root @ along, root, left, leverage, model.point, degrees)

    def errors(self, rows: FloatArray) -> FloatArray:
        """Standard uncertainties of sums of the coefficients, by the same sums of the root."""
        variance = self.left @ self.left / self.degrees
        return np.asarray(np.sqrt(variance) * np.linalg.norm(rows, axis=-1))

    def tested(self, values: FloatArray, rows: FloatArray, of: int = 1) -> TestOutcome:
        """Test sums of the coefficients, all at once, as one of so many tests: an F ratio."""
        z = np.linalg.lstsq(rows, values, rcond=None)[0]
        count = len(rows)
        value = z @ z / count / (self.left @ self.left / self.degrees)
        return _ratio_outcome(float(value), count, self.degrees, of)


def _ratio_outcome(value: float, above: float, below: float, of: int) -> TestOutcome:
    """Test an F ratio; the least p-value of so many is their number times as likely."""
    limit = float(fdtri(above, below, 1 - FALSE_ALARM / of))
    return TestOutcome(value, limit, min(of * float(fdtrc(above, below, value)), 1.0))


@array_record
class BranchesApart:
    """What approach and retreat differ by, with its uncertainty; the test is an F ratio."""

    outcome: TestOutcome
    values: FloatArray
    errors: FloatArray


def hysteresis_test(
    estimate: ProfileEstimate, owner: IndexArray | None = None
) -> BranchesApart | None:
    """Compare approach and retreat within each scan that has both; ``None`` without any."""
    # Each approach minus retreat: of A and of the width, relative; of the centre along the scan, in
    # m; and, where both have one baseline, of that, in V, whose step would else count as one of A.
    # ``owner`` (n,): the scan, its repeats included.
    points = estimate.points
    owner = points.scan if owner is None else owner
    sign = 0.5 * (points.branch == 1) - 0.5 * (points.branch == 2)
    for scan in np.unique(owner):
        inside = owner == scan
        if np.ptp(sign[inside]) < 1:
            sign[inside] = 0
    if not sign.any():
        return None
    model = estimate.model
    geometry = model.geometry(estimate.centres)
    sigma = estimate.gaussian.sigma
    wider = estimate.conversion_constant * sigma * gaussian_transfer_slope(model.k, sigma)
    columns = [estimate.predicted - estimate.background, model.signal(geometry, wider)]
    mean = np.bincount(points.scan, sign) / np.bincount(points.scan)
    both = np.abs(mean)[points.scan] < np.abs(sign)
    if both.any():
        shift = model.shift_derivative(geometry, estimate.kernel)
        along = np.argmax(points.free[points.scan], axis=1)
        columns += [both * shift[along, range(sign.size)], both]
    fit = _Fit.of(estimate, sign[:, None] * np.stack(columns, axis=1))
    if fit is None:
        return None
    values = fit.coefficients[-len(columns) :]
    rows = fit.root[-len(columns) :]
    errors = fit.errors(rows)
    if both.any():
        return BranchesApart(fit.tested(values, rows), values, errors)
    place, side, group, centres = _centres_of_branches(estimate, fit, sign, owner)
    share = 4 * side / np.bincount(group)[group] / (group.max() + 1)
    row = share @ fit.root[place]
    values = np.append(values, share @ centres)
    error = float(fit.errors(row))
    # Repeats that wander differ within a branch as they do between the branches.
    inside = centres - (np.bincount(group, centres) / np.bincount(group))[group]
    freedom = group.size - group.max() - 1
    noise = np.mean(fit.errors(fit.root[place]) ** 2)
    scatter = inside @ inside / max(freedom, 1)
    if freedom and fdtrc(freedom, fit.degrees, scatter / noise) < _WANDERS:
        error = float(np.sqrt(scatter * share @ share))
        outcomes = (
            fit.tested(values[:-1], rows, of=2),
            _ratio_outcome((values[-1] / error) ** 2, 1, freedom, of=2),
        )
        outcome = min(outcomes, key=lambda outcome: outcome.p_value)
    else:
        outcome = fit.tested(values, np.vstack([rows, row]))
    return BranchesApart(outcome, values, np.append(errors, error))


def _centres_of_branches(
    estimate: ProfileEstimate, fit: _Fit, sign: FloatArray, owner: IndexArray
) -> tuple[IndexArray, FloatArray, IndexArray, FloatArray]:
    """Repeats of a branch: their centres' places in the fit, branches, groups, and centres (m)."""
    points = estimate.points
    _, start = np.unique(points.scan, return_index=True)
    chosen = np.flatnonzero(sign[start])
    side = sign[start][chosen]
    free = points.free.sum(axis=1)
    first = (np.cumsum(free) - free)[chosen]
    centres = estimate.gaussian.centre[points.free][first] + fit.coefficients[2 + first]
    return 2 + first, side, grouped(owner[start][chosen], side), centres


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
    runs, start, number = np.unique(points.repeat, return_index=True, return_inverse=True)
    count = runs.size
    if count == 1:
        return None
    # The first run of each scan has the scan's baseline, the others differ from it.
    scan = points.scan[start]
    shared = np.diff(scan, prepend=-1) == 0
    own = np.equal.outer(number, np.arange(count)).astype(np.float64)
    signal = estimate.predicted - estimate.background
    gains = own[:, 1:] * signal[:, None]
    fit = _Fit.of(estimate, np.hstack([gains, own[:, shared]]))
    if fit is None:
        return None
    straight = 1 + points.free.sum(axis=1)
    place = (np.cumsum(straight) - straight)[scan]
    baselines = estimate.gaussian.drift[place]
    place += 2 + int(points.free.sum())
    baselines = baselines + fit.coefficients[place]
    rows = fit.root[place]
    last = fit.coefficients.size - int(shared.sum())
    baselines[shared] += fit.coefficients[last:]
    rows[shared] += fit.root[last:]
    # Of two runs there is one difference.
    tests = count if count > 2 else 1
    others = count / (count - 1)
    rows = others * (rows - rows.mean(axis=0))
    distances = others * (baselines - baselines.mean())
    errors = fit.errors(rows)
    moved = int(np.argmax(np.abs(distances[:tests] / errors[:tests])))
    offset = fit.tested(distances[[moved]], rows[[moved]], of=tests)
    run = number[fit.point]
    # Of scans without noise rounding is left.
    floor = NUMERICAL_FLOOR * estimate.largest_signal * estimate.weights.max() ** 0.5
    square = np.bincount(run, fit.left**2 + floor**2, count)
    degrees = np.maximum(np.bincount(run, 1 - fit.leverage, count), 1.0)
    ratio = np.log(square / degrees / ((square.sum() - square) / (degrees.sum() - degrees)))
    noisy = int(np.argmax(np.abs(ratio[:tests])))
    louder = bool(ratio[noisy] > 0)
    pair = (degrees[noisy], degrees.sum() - degrees[noisy])
    larger = float(np.exp(np.abs(ratio[noisy])))
    noise = _ratio_outcome(larger, *(pair if louder else pair[::-1]), of=2 * tests)
    distance = float(distances[moved])
    return RunsApart(count, offset, moved, distance, float(errors[moved]), noise, noisy, louder)
