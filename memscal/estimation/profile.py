"""Estimate of a radial profile from the points of scans: centre, baseline, noise and outliers."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.axisymmetry.kernels import gaussian_transfer, unit_gaussian
from memscal.errors import FitError
from memscal.estimation import bayesian
from memscal.estimation.angular import AngularRings, angular_departures
from memscal.estimation.bayesian import WeighedFit
from memscal.estimation.decorrelation import Decorrelation, SlowNoise
from memscal.estimation.departures import DepartureBasis, ReducedScan, departure_basis
from memscal.estimation.ellipse import elliptic_departure
from memscal.estimation.forward import ForwardModel, forward_model
from memscal.estimation.gaussian import GaussianFit, fit_gaussian_to_points
from memscal.estimation.outliers import (
    OUTLIER_THRESHOLD,
    RasterNoise,
    point_weights,
    raster_noise,
    variances_nearby,
)
from memscal.estimation.plane import MOST_READINGS, Spots, plane_departures
from memscal.estimation.points import ScanPoints
from memscal.estimation.voltage_map import DENSE, VoltageMap, square_root
from memscal.extensions import hook
from memscal.model.arrays import (
    TINY,
    Arrays,
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    floats,
)
from memscal.model.checks import OUTLIER_WEIGHT, Message
from memscal.progress import done_with

#: Error of the reference and of its transforms, relative to the largest signal.
NUMERICAL_FLOOR = 1e-6
#: A conversion constant must exceed this many standard uncertainties by noise, and of all that a
#: scan leaves open this many: what form G has may be unsure where the signal is not.
LEAST_SIGNIFICANCE = 5.0
LEAST_DISTINCT = 3.0
_WEIGHING_ROUNDS = 4
#: Noise that is not stated is found to this share.
_SAME_NOISE = 0.1
#: Relative step of the derivatives of an ellipse.
_STEP = 1e-4
#: A G that is free in the plane is taken where its log evidence is so much larger.
_CLEARLY = 10.0
#: Noise is even if its variance, from such a share of the largest signal on, is at most so many
#: times the mean.
_SEEN = 0.1
_EVEN = 1.4


class CentreError(FitError):
    """A scan that does not cross the centre of its sensor."""


@array_record
class ProfileEstimate:
    """Posterior of the radial profile A G in data space, before any division."""

    model: ForwardModel
    gaussian: GaussianFit
    basis: DepartureBasis  # the kernels that it combines, about the Gaussian
    weighed: WeighedFit  # their posterior
    weights: FloatArray  # (n,): relative weight of each point, the outliers' below one included
    outlier_weight: FloatArray  # (n,): one for ordinary points; less for outliers
    departures: DepartureBasis  # all kernels, of negligible probability too
    raster_noise: RasterNoise | None = None
    slow: SlowNoise | None = None  # that is counted beside the estimate, which takes noise as white

    @property
    def free(self) -> bool:
        """Whether G is free in the plane, and has no shape about one centre."""
        return self.weighed.free > -np.inf

    @property
    def points(self) -> ScanPoints:
        """The measured points."""
        return self.model.points

    @property
    def noise(self) -> FloatArray:
        """Adopted noise of each voltage, shape (n,), in V, uncertain positions included."""
        return self.noise_scale / np.sqrt(self.weights / self.outlier_weight)

    @property
    def correlation(self) -> Decorrelation | None:
        """Correlation of the noise: as stated, or as found where none is."""
        return self.slow.covariance if self.slow else self.points.decorrelation

    @cached_property
    def scatter(self) -> FloatArray:
        """Noise (n,) of each voltage from scan to scan, in V: as adopted, of a raster as found."""
        noise = self.noise / self.outlier_weight**0.5
        if not self.raster_noise:
            return noise
        # Errors of the stage make more noise where the voltage is steep; outliers count little.
        residual = self.outlier_weight**0.5 * self.weighed.residual
        near = variances_nearby(self.points, residual)
        return np.where(near > 0, np.sqrt(near / self.outlier_weight), noise)

    def scattered(self, numbers: VoltageMap) -> FloatArray:
        """Columns (m, c) of a root of the covariance of numbers, by the voltages' noise."""
        return _root(numbers, self.scatter, self.correlation)

    @cached_property
    def fixed_root(self) -> FloatArray:
        """Square root of what of the posterior's covariance does not scatter between scans."""
        return np.hstack([self.hidden_root, self.curving])

    @cached_property
    def curving(self) -> FloatArray:
        """Errors (p, c) of the posterior's mean where a baseline is curved by its deviation."""
        return self.curved(self.weighed.gain, self.points.curvatures)

    def curved(self, numbers: VoltageMap, own: slice | list[int]) -> FloatArray:
        """Errors (m, c) of numbers, the curvatures ``own`` among them, by curved baselines."""
        deviation = self.points.curvature[self.points.curved]
        errors = numbers @ (self.model.curvature_columns * deviation)
        errors[own] -= np.diag(deviation)
        return errors

    @cached_property
    def hidden_root(self) -> FloatArray:
        """Square root of what of the covariance neither noise nor a curved baseline makes."""
        noise = self.noise / self.outlier_weight**0.5
        white = _root(self.weighed.gain, noise, self.points.decorrelation)
        known = np.hstack([white, self.curving])
        covariance = self.weighed.covariance
        return square_root(covariance - known @ known.T, np.diag(covariance))

    @cached_property
    def noise_scale(self) -> float:
        """Noise of a point (V); with stated uncertainties, the factor they must grow by (Birge)."""
        return self.adopted_noise(self.weighed.noise)

    def adopted_noise(self, scatter: float) -> float:
        """Noise of a point of weight one: stated uncertainties are adopted until exceeded."""
        if self.raster_noise:
            scatter = self.raster_noise.deviation
        scatter = max(scatter, NUMERICAL_FLOOR * self.largest_signal)
        return max(scatter, 1.0) if self.points.noise_stated else scatter

    @cached_property
    def kernel(self) -> FloatArray:
        """Transform of A G at the quadrature nodes, in V/Pa."""
        gaussian = gaussian_transfer(self.model.k, self.gaussian.sigma)
        correction = self.basis.kernels(self.model.k) @ self.weighed.mean
        return self.gaussian.conversion_constant * gaussian + correction

    def radial(self, r: FloatArray) -> FloatArray:
        """A G at radii ``r`` (m), in V/Pa/m^2."""
        gaussian = self.gaussian.conversion_constant * unit_gaussian(r, self.gaussian.sigma)
        return gaussian + self.basis.radial(r) @ self.weighed.mean

    @property
    def spectrum(self) -> RadialSpectrum:
        """Transform of the voltage's radial profile per newton, in V m^2 / N."""
        return replace(self.model.reference, values=self.kernel * self.model.reference.values)

    @property
    def conversion_constant(self) -> float:
        """Integral of A G over the plane: A without any division, in V/Pa."""
        return float(self.gaussian.conversion_constant + self.basis.integrals @ self.weighed.mean)

    @property
    def centres(self) -> FloatArray:
        """Centre of the sensor in each scan, shape (scans, 2), in m, departures allowed for."""
        corrected = self.gaussian.centre.copy()
        corrected[self.points.free] += self.weighed.mean[self.points.centres]
        return corrected

    @property
    def centre(self) -> FloatArray:
        """Centre of the sensor (x0, y0) in the first scan, in m."""
        return floats(self.centres[0])

    @property
    def drifts(self) -> FloatArray:
        """Each scan's baseline and change over half the range along x (and y); curvatures (V)."""
        drifts = slice(self.points.centres.stop, self.points.curvatures.stop)
        return self.gaussian.drift + self.weighed.mean[drifts]

    def oval_kernel(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """What of A G is not round, on a grid (y, x) about the centre, in V/Pa/m^2."""
        fit = self.gaussian
        kernel = fit.conversion_constant * elliptic_departure(x, y, fit.sigma, fit.ellipticity)
        return kernel + self.oval_changes(x, y, self.weighed.mean[:, None]).reshape(kernel.shape)

    def oval_changes(self, x: FloatArray, y: FloatArray, coefficients: FloatArray) -> FloatArray:
        """What of combinations (p, c) of the posterior's kernels is not round: (y x, c)."""
        fit = self.gaussian
        angular = self.basis.angular
        flat = self.basis.flat
        changes = np.zeros((y.size * x.size, coefficients.shape[1]))
        if self.points.ellipse:
            ellipse = np.append(fit.sigma, fit.ellipticity)
            oval = elliptic_departure(x, y, fit.sigma, fit.ellipticity).ravel()
            changes += np.outer(oval, coefficients[0])
            end = fit.count
            for i, row in enumerate((1, end - 2, end - 1)):
                step = _STEP * (fit.sigma if row == 1 else 1.0)
                moved = ellipse.copy()
                moved[i] += step
                other = elliptic_departure(x, y, moved[0], moved[1:]).ravel()
                slope = fit.conversion_constant * (other - oval) / step
                changes += np.outer(slope, coefficients[row])
        if angular:
            changes += angular.at(x, y, coefficients[flat - angular.count : flat])
        return changes

    @property
    def oval(self) -> FloatArray:
        """What a sensor that is not round adds to the radial profile's voltages, (n,), in V."""
        if not self.points.ellipse:
            return np.zeros_like(self.points.u)
        return self.signal - self.model.signal(self.model.geometry(self.centres), self.kernel)

    @property
    def uneven(self) -> FloatArray:
        """What references that are not round, or motion, add to the voltages, (n,), in V."""
        if self.model.sums_waves:
            return np.zeros_like(self.points.u)
        even = ForwardModel(self.points, self.model.references)
        whole = self.model.signal(self.model.geometry(self.centres), self.kernel)
        return whole - even.signal(even.geometry(self.centres), self.kernel)

    @property
    def offset(self) -> FloatArray:
        """Position of each point from its scan's centre, shape (2, n), in m."""
        return self.model.offset(self.centres)

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of each point from its scan's centre, shape (n,), in m."""
        return floats(np.hypot(*self.offset))

    @cached_property
    def background(self) -> FloatArray:
        """Baseline, drift and curvature at each point, shape (n,), in V."""
        return self.model.drift_columns @ self.drifts

    @property
    def predicted(self) -> FloatArray:
        """Voltage at each point, shape (n,), in V."""
        return self.points.u - self.weighed.residual

    @property
    def signal(self) -> FloatArray:
        """Predicted voltage above the background at each point, shape (n,), in V."""
        return self.predicted - self.background

    @property
    def largest_signal(self) -> float:
        """Largest voltage above the background, in V."""
        return float(abs(self.signal).max())


def _root(numbers: VoltageMap, noise: FloatArray, factor: Decorrelation | None) -> FloatArray:
    """Columns (m, c) of a root of the covariance of numbers, by a noise and its correlation."""
    if noise.size > DENSE:
        return square_root(numbers.covariance(noise, factor))
    scaled = noise * numbers.dense()
    return factor.correlate_adjoint(scaled.T).T if factor else scaled


def dynamics_changes(estimate: ProfileEstimate, kernel: FloatArray) -> Arrays:
    """Return changes (n,) of the voltages, in V, by one u of each number of a sensor's dynamics."""
    changes = {}
    if estimate.points.in_motion:
        changes = hook("changes_by_dynamics")(estimate.model, estimate.gaussian.geometry, kernel)
    return changes


def estimate_profile(
    points: ScanPoints,
    *references: RadialSpectrum,
    angular: bool = False,
    start: ProfileEstimate | None = None,
    begin_with: BoolArray | bool = True,
) -> ProfileEstimate:
    """Estimate the radial profile, the centre and baseline of each scan, noise and outliers."""
    # With ``angular`` also what of a sensor that was scanned over the plane is not round.
    # ``start``, of nearly the same voltages at the same points, spares the search, which is among
    # the points (n,) to ``begin_with``.
    model = forward_model(points, references)
    if start:
        fit = start.gaussian
    else:
        fit = fit_gaussian_to_points(model, stated_weights(points) * begin_with)
    kernel = fit.conversion_constant * gaussian_transfer(model.k, fit.sigma)
    slope = model.shift_derivative(fit.geometry, kernel)
    # A raster's positions are uncertain along x; how much of that is radial depends on the place.
    # Uncertain positions make noise where U is steep.
    moved = points.along(slope) * points.x_errors
    stated = stated_weights(points, moved)
    points = points.sharing_positions(moved, stated)
    model = replace(model, points=points)
    residual = points.u - fit.predicted
    noise = _least_noise(fit)
    angular = angular and points.planar and not points.order
    if start:
        outlier = start.outlier_weight
    else:
        outlier = point_weights(points, residual, stated, 2 * OUTLIER_THRESHOLD)
    for rounds_left in reversed(range(_WEIGHING_ROUNDS)):
        weights = stated * outlier
        fit = fit_gaussian_to_points(model, weights, start=fit)
        done_with("Gaussian fit")
        if angular:
            found = raster_noise(points, residual, outlier)
            noise = found.deviation if found else noise
        count = outlier.sum()
        basis, weighed = _weighed(fit, model, weights, count, noise, angular=angular)
        residual = weighed.residual
        updated = point_weights(points, residual, stated, OUTLIER_THRESHOLD)
        # The noise of the voltages alone: a curvature beyond its prior is none.
        left = points.standardised(residual, weights)
        freedom = max(count - fit.count, 1.0)
        unit = max(np.sqrt(left @ left / freedom), noise)
        # A residual counts by the root of its weight.
        weighed_alike = np.allclose(updated**0.5, outlier**0.5, atol=0.02)
        # By the noise the prior of a curvature is weighed.
        same_noise = not points.curved.size or np.isclose(unit, points.unit, rtol=_SAME_NOISE)
        if rounds_left and not (weighed_alike and same_noise):
            outlier = updated
            points = replace(points, unit=unit)
            model = replace(model, points=points)
            # Of many points there is room for one.
            del weighed
            continue
        break
    done_with("departures")
    within, averaged = bayesian.supported(basis, weighed)
    raster = raster_noise(points, residual, outlier) if angular else None
    estimate = ProfileEstimate(model, fit, within, averaged, weights, outlier, basis, raster)
    _require_determined(estimate)
    return estimate


def _weighed(
    fit: GaussianFit,
    model: ForwardModel,
    weights: FloatArray,
    count: float,
    noise: float,
    *,
    angular: bool,
) -> tuple[DepartureBasis, WeighedFit]:
    """Weigh departures from a fit for ``count`` readings and a least noise."""
    rings = AngularRings.about(fit) if angular else None
    reduced = ReducedScan.of(model, fit, weights, rings)
    basis = departure_basis(fit, reduced)
    if not rings:
        return basis, bayesian.weigh_departures(reduced, basis, count, noise).average()
    radial = reduced.signal(basis.kernels(model.k)[:, fit.count :])
    columns = (reduced.data, reduced.flat, radial, reduced.components)
    basis = departure_basis(fit, reduced, angular_departures(rings, fit, columns, noise))
    about_centre = bayesian.weigh_departures(reduced, basis, count, noise)
    if fit.points.u.size > MOST_READINGS:
        return basis, about_centre.average()
    spots = Spots.about(fit, model, weights, noise)
    reduced = ReducedScan.of(model, fit, weights, spots)
    free = plane_departures(spots, fit, (reduced.data, reduced.flat, reduced.components), noise)
    free_basis = departure_basis(fit, reduced, free)
    free_weighing = bayesian.weigh_departures(reduced, free_basis, count, noise)
    if free_weighing.evidence >= about_centre.evidence + _CLEARLY:
        weighed = free_weighing.average()
        # Noise that grows with the signal, as by errors of the stage, would be taken for G.
        left = fit.points.standardised(weighed.residual, weights)
        signal = fit.jacobian[:, 0]
        variance = variances_nearby(fit.points, left)[signal > _SEEN * signal.max()].mean()
        if variance <= _EVEN * noise**2:
            return free_basis, replace(
                weighed, log_marginals=about_centre.log_marginals, free=free_weighing.evidence
            )
    return basis, about_centre.average()


def log_marginal_likelihood(
    estimate: ProfileEstimate, inputs: FloatArray, noise: float
) -> FloatArray:
    """Logarithm of p(u) of all voltages by the references of an estimate, at its weights, (2,)."""
    # The first is by the hypotheses' priors of the estimate, the second by those of the
    # uncertainty. It is comparable between references for the same points, weights and ``noise``.
    # ``inputs`` (n, q), in V: what one standard uncertainty of each uncertain input changes, each a
    # Gaussian of unit variance that is integrated, beside ``noise``, that of a point of weight one.
    points = estimate.points
    weights = estimate.weights
    points, volume = points.sharing(points.standardised(inputs, weights) / noise)
    model = forward_model(points, estimate.model.references)
    fit = fit_gaussian_to_points(model, weights, start=estimate.gaussian)
    if not fit.has_width(weights, noise):
        # The flat prior of ln(width) has no end there, where the width changes no voltage.
        return np.full(2, -np.inf)
    angular = estimate.basis.angular
    reduced = ReducedScan.of(model, fit, weights, angular.components if angular else None)
    basis = departure_basis(fit, reduced, angular)
    least = _least_noise(fit)
    if estimate.raster_noise:
        least = max(least, estimate.raster_noise.deviation)
    count = estimate.outlier_weight.sum()
    weighing = bayesian.weigh_departures(reduced, basis, count, least_noise=least)
    return weighing.log_marginal_likelihoods - volume / 2


def gaussian_log_marginal(estimate: ProfileEstimate, fit: GaussianFit) -> float:
    """Logarithm of p(u) by a Gaussian sensor, fitted at an estimate's weights, as by hypotheses."""
    weights = estimate.weights
    if not fit.has_width(weights, estimate.noise_scale):
        return -math.inf
    # The prior of a curvature is a further reading.
    _, prior = fit.prior
    left = np.append(fit.points.standardised(fit.points.u - fit.predicted, weights), prior)
    freedom = estimate.outlier_weight.sum() + prior.size - fit.count
    variance = max(left @ left / freedom, _least_noise(fit) ** 2)
    loss = freedom * math.log(variance) + left @ left / variance
    # The flat priors are of ln A and ln(width).
    _, volume = np.linalg.slogdet(fit.covariance(weights, 1.0))
    return float(volume - loss) / 2 - math.log(fit.conversion_constant * fit.sigma)


def _least_noise(fit: GaussianFit) -> float:
    """Least noise of a point of weight one: as stated, or beyond rounding (V)."""
    if fit.points.noise_stated:
        return 1.0
    return NUMERICAL_FLOOR * float(abs(fit.predicted).max())


def stated_weights(points: ScanPoints, position_noise: float | FloatArray = 0.0) -> FloatArray:
    """Inverse variance of each voltage as stated; ones where nothing is."""
    if points.u_errors is None:
        return np.ones_like(points.u)
    return 1 / (points.u_errors**2 + position_noise**2)


def _require_determined(estimate: ProfileEstimate) -> None:
    """Refuse scans that do not cross their sensor, or whose signal is lost in noise."""
    points = estimate.points
    for scan, axis in np.argwhere(points.free):
        name = "xy"[axis]
        centre = estimate.centres[scan, axis]
        positions = points.positions[axis, points.scan == scan]
        if not positions.min() - points.step <= centre <= positions.max() + points.step:
            raise CentreError(
                f"The sensor's centre would lie at {name} = {centre * 1e3:.4g} mm, outside the "
                f"scan from {positions.min() * 1e3:.4g} mm to {positions.max() * 1e3:.4g} mm.",
                why="A centre that was not crossed is not determined, nor are A and G.",
                cure="Scan across the sensor.",
            )
    require_significant(
        estimate,
        "Check channel, positions, film and rod; scan farther; raise the load or average repeats.",
    )


def require_significant(estimate: ProfileEstimate, cure: str) -> None:
    """Refuse a conversion constant that is not distinct from zero, and say why."""
    a = estimate.conversion_constant
    integrals = estimate.basis.integrals
    # Rounding makes the variance of a scan without noise negative.
    uncertainty = np.sqrt(max(float(integrals @ estimate.weighed.covariance @ integrals), 0.0))
    if a > LEAST_SIGNIFICANCE * uncertainty:
        return
    of_a = integrals[None] @ estimate.weighed.gain
    columns = np.hstack([estimate.scattered(of_a), integrals[None] @ estimate.curving])
    scatter = float(np.linalg.norm(columns))
    shown = a > LEAST_SIGNIFICANCE * scatter
    if shown and a > LEAST_DISTINCT * uncertainty:
        return
    unit = estimate.points.reading
    wrong = "negative" if a < -LEAST_DISTINCT * uncertainty else "not distinct from zero"
    raise FitError(
        f"The conversion constant would be ({a / unit.scale:.2g} ± {uncertainty / unit.scale:.2g}) "
        f"{unit.over(unit.unit)}: it is {wrong}.",
        why=f"It is {a / scatter:.3g} standard uncertainties by noise (at least "
        f"{LEAST_SIGNIFICANCE:g} are needed) and {a / uncertainty:.3g} of all that the scan leaves "
        f"open (at least {LEAST_DISTINCT:g}). {_why_undetermined(estimate, shown=shown)}",
        cure=cure,
    )


#: A voltage that varies by less than this many times its noise is lost in it, and a scan that ends
#: with more than this share of its largest signal shows no baseline.
_LEAST_RISE = 6.0
_LEFT = 0.1


def _why_undetermined(estimate: ProfileEstimate, *, shown: bool) -> str:
    """Say what keeps A from being determined: the noise, or the parameter it is confused with."""
    # ``shown``: whether noise and baseline alone would leave it distinct from zero.
    base = np.linalg.qr(estimate.model.straight_columns)[0]
    rise = np.ptp(estimate.predicted - base @ (base.T @ estimate.predicted))
    ratio = rise / np.median(estimate.noise)
    varied = estimate.points.reading.text(rise)
    varies = f"Beside a line the voltage varies by {varied}, {ratio:.3g} times its noise"
    if ratio < _LEAST_RISE:
        return f"{varies}: it does not rise above its noise as the indenter passes."
    signal = abs(estimate.signal)
    farthest = np.argmax(estimate.distance)
    left = signal[farthest] / signal.max()
    if left > _LEFT:
        return (
            f"{varies}, but the scan is too short or off centre to show the baseline: "
            f"{estimate.distance[farthest] * 1e3:.3g} mm from the sensor's centre, where it ends, "
            f"{left:.0%} of the largest signal is left."
        )
    if shown:
        return (
            f"{varies}, but the forms that G may have differ in A by more than the noise: tails of "
            "G that fall slowly cannot be told from the baseline."
        )
    centres = estimate.points.centres.stop
    flat = estimate.basis.flat
    everything = np.arange(len(estimate.weighed.covariance))
    blocks = {
        "the baseline: the scan is too short to show the profile's tail": everything[centres:flat],
        "the width and shape of the apparatus function: the reference is too wide, or the step too "
        "coarse, to determine them": np.append(1, everything[flat:]),
    }
    confused = max(blocks, key=lambda name: _share(estimate, blocks[name]))
    return f"{varies}, but the conversion constant cannot be told from {confused}."


def _share(estimate: ProfileEstimate, block: IndexArray) -> float:
    """Share of the variance of A that would go if the parameters of a block were known."""
    covariance = estimate.weighed.covariance
    deviation = np.sqrt(np.maximum(np.diag(covariance)[block], TINY))
    with_a = (estimate.basis.integrals @ covariance)[block] / deviation
    correlation = covariance[np.ix_(block, block)] / np.outer(deviation, deviation)
    return float(with_a @ np.linalg.pinv(correlation, hermitian=True) @ with_a)


_RADII = 60
_REACH_IN_WIDTHS = 6.0
#: Beyond the reach a profile has ended; there the inequalities hold to this share of the peak.
_SLACK = 1e-6


def constrained_profile(
    estimate: ProfileEstimate, *, nonnegative: bool, monotone: bool
) -> ProfileEstimate:
    """Return the MAP estimate of A G under constraints; without any, the posterior mean."""
    if not (nonnegative or monotone):
        return estimate
    r = np.linspace(0.0, _REACH_IN_WIDTHS * estimate.gaussian.width, _RADII)
    profile = estimate.radial(r)
    columns = estimate.basis.radial(r)
    if monotone:
        # A profile that falls all the way to zero is nowhere negative.
        profile = np.append(profile[:-1] - profile[1:], profile[-1])
        columns = np.vstack([columns[:-1] - columns[1:], columns[-1:]])
    scale = abs(profile).max()
    root = square_root(estimate.weighed.covariance)
    z = _least_distance(columns @ root / scale, -profile / scale - _SLACK)
    weighed = replace(estimate.weighed, mean=estimate.weighed.mean + root @ z)
    return replace(estimate, weighed=weighed)


def _least_distance(matrix: FloatArray, bound: FloatArray) -> FloatArray:
    """Shortest z with ``matrix @ z >= bound``: least distance programming."""
    # Lawson and Hanson, Solving Least Squares Problems, chapter 23: by non-negative least squares.
    from scipy.optimize import nnls

    both = np.vstack([matrix.T, bound])
    target = np.append(np.zeros(matrix.shape[1]), 1.0)
    dual, _ = nnls(both, target, maxiter=50 * bound.size)
    residual = both @ dual - target
    if not residual[-1] < -1e-12:
        raise FitError(
            "No apparatus function that meets the constraint comes near the scan.",
            why="It would have to be negative, or to rise, somewhere.",
            cure="Leave out the constraint: nonnegative=false, monotone=false.",
        )
    return floats(-residual[:-1] / residual[-1])


#: Outliers that are listed one by one.
_MOST_LISTED = 10


def point_messages(estimate: ProfileEstimate) -> Iterator[Message]:
    """Say what was left out of a scan, and which points are outliers, the farthest first."""
    points = estimate.points
    if points.missing:
        text = f"{points.missing} points of the scan are missing and were left out."
        if points.missing == 1:
            text = "A point of the scan is missing and was left out."
        yield Message("missing_points", text)
    if estimate.basis.angular and points.u.size > MOST_READINGS:
        yield Message(
            "plane",
            f"Shapes of G that are free in the plane were left out: the raster has "
            f"{points.u.size:,} readings, and they are weighed for at most {MOST_READINGS:,}.",
        )
    elif estimate.free:
        yield Message(
            "plane",
            "G is free in the plane: the scan shows that it has no shape about one centre.",
        )
    weight = estimate.outlier_weight
    outliers = np.argsort(weight, kind="stable")[: (weight < OUTLIER_WEIGHT).sum()]
    for i in outliers[:_MOST_LISTED]:
        place = f"x = {points.x[i] * 1e3:.4g} mm"
        if points.planar:
            place += f", y = {points.y[i] * 1e3:.4g} mm"
        if points.repeat.any():
            place += f" of repeat {points.repeat[i] + 1}"
        seen = points.reading.text(points.u[i], ".4g")
        voltages = f"{seen} instead of {points.reading.text(estimate.predicted[i], '.4g')}"
        yield Message("outlier", f"Outlier at {place}: {voltages}; its weight is {weight[i]:.2g}.")
    more = outliers.size - _MOST_LISTED
    if more > 0:
        yield Message(
            "outlier",
            f"More outliers, which depart by less and have reduced weights, too: {more}.",
        )
