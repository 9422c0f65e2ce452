"""Gaussian apparatus function that fits the scan best, in data space.

It is fitted by weighted least squares, with A, centre, baseline and linear drift.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import quotient
from memscal.axisymmetry.kernels import gaussian_transfer, gaussian_transfer_slope
from memscal.errors import FitError, InputError
from memscal.estimation.ellipse import elliptic_columns
from memscal.estimation.forward import ForwardModel, Geometry
from memscal.estimation.outliers import robust_scale
from memscal.estimation.points import ScanPoints
from memscal.estimation.voltage_map import VoltageMap, evenly, triangular
from memscal.model.arrays import (
    TINY,
    ArrayPair,
    ArrayTriple,
    FloatArray,
    IndexArray,
    array_record,
    floats,
)

_MOST_STEPS = 20
_MOST_HALVINGS = 5
#: Steps end here, in units of the parameters' typical sizes: the model is no longer linear.
_LONGEST_STEP = 1.0
#: Rounding may raise a cost that has settled by this share.
_ROUNDING = 1e-10

Linearised = Callable[[FloatArray], ArrayPair]


def gauss_newton(
    linearise: Linearised, start: FloatArray, *, tolerance: float, knee: float = np.inf
) -> FloatArray | None:
    """Minimise the loss of the residuals (n,) of a nearly linear model; ``None`` if it fails."""
    # Parameters are scaled to numbers near one.  Steps d of (J'WJ) d = -J'W r, with
    # W = (1 + r^2/c^2)^(-1/2), minimise the soft L1 loss sum 2 c^2 (sqrt(1 + r^2/c^2) - 1), linear
    # from the residual c, ``knee``, on.
    place = start
    step = np.zeros_like(start)
    cost = np.inf
    halvings = 0
    for _ in range(_MOST_STEPS):
        residual, slope = linearise(place)
        stretch = np.sqrt(1 + (residual / knee) ** 2)
        # The loss, in a form without cancellation where the knee is far away.
        loss = np.sum(2 * residual**2 / (1 + stretch))
        if not loss <= cost * (1 + _ROUNDING):
            halvings += 1
            if halvings > _MOST_HALVINGS:
                return None
            step = step / 2
            place = place - step
            continue
        root = stretch**-0.5
        # The triangular factor of both stands for them.
        both = triangular(np.column_stack([slope * root[:, None], -residual * root]))
        whole = np.linalg.lstsq(both[:, :-1], both[:, -1])[0]
        longest = abs(whole).max()
        step = floats(whole * (_LONGEST_STEP / max(longest, _LONGEST_STEP)))
        place = place + step
        cost = loss
        if longest < tolerance:
            return place
    return None


#: A shape of the wrong parity or sign must leave less than this share of what the right one does.
_CLEARLY = 0.7


def _require_parity(points: ScanPoints, odd: ArrayPair, even: ArrayPair) -> None:
    """Refuse a voltage that a shear of the other sign, or an even signal, fits far better."""
    # ``odd`` and ``even``: amplitudes of trial signals, and sums of absolute residuals, shape (m,).
    amplitudes, costs = odd
    right = np.min(costs, where=amplitudes > 0, initial=np.inf)
    turned = np.min(costs, where=amplitudes < 0, initial=np.inf)
    name = f"u_{points.channel}"
    along = points.channel[0]
    if even[1].min() < _CLEARLY * min(right, turned):
        raise InputError(
            f"{name} is the same on both sides of the sensor.",
            why="A shear changes its sign where the indenter passes the sensor; a normal stress "
            "does not.",
            cure="Check the channels: this looks like u_zz.",
        )
    if turned < _CLEARLY * right:
        raise InputError(
            f"{name} has the wrong sign: it rises where the indenter stands at larger {along} "
            "than the sensor.",
            why="A squeezed film pulls the base away from the indenter: the traction on the "
            f"sensor along {along} is then negative.",
            cure=f"Change the sign of {name}, or of {along} if it is the sensor that was moved: "
            f"{along} is the indenter's position from the sensor.",
        )


#: Widths from which the search starts, in units of the film's smoothing length.
_STARTING_WIDTHS = (0.1, 0.3, 0.8)
#: Of more points as many are fitted at first.
MOST_AT_START = 5000
#: Where no film blurs: so many from half a step to a quarter of the span.
_SOURCE_WIDTHS = 8


def some_points(points: ScanPoints) -> IndexArray:
    """Numbers of the points that are fitted at first, evenly chosen along the scans."""
    return np.sort(evenly(np.lexsort((points.x, points.y, points.scan)), MOST_AT_START))


def _robust_start(model: ForwardModel, weights: FloatArray) -> FloatArray:
    """Parameters to start from: each scan's own, but A and the width at the medians of all."""
    points = model.points
    starts = []
    for scan, reference in enumerate(model.references):
        own = replace(model, points=points.only(scan), references=(reference,))
        starts.append(_robust_start_of_scan(own, weights[points.scan == scan]))
    shapes, centres, drifts = zip(*starts, strict=True)
    others = np.zeros(points.curved.size + points.ellipse)
    return np.concatenate([np.median(shapes, axis=0), *centres, *drifts, others])


def _robust_start_of_scan(model: ForwardModel, weights: FloatArray) -> ArrayTriple:
    """A and width, centre, and drift of the best of a grid, by the sum of absolute residuals."""
    # A single outlier can be the largest voltage of a scan: positions are tried, not read off.
    points = model.points
    centres = _trial_centres(model)
    distances = np.hypot(points.x - centres[:, :1], points.y - centres[:, 1:])
    radii = np.linspace(0.0, 2 * np.ptp(points.x) + 2 * np.ptp(points.y), 400)
    widths = _smoothing_length(model) * np.array(_STARTING_WIDTHS)
    if model.reference.source:
        # A source may be far narrower than G.
        widths = np.geomspace(0.5 * points.step, 0.25 * points.span, _SOURCE_WIDTHS)
    # Profiles per newton of every width, on a table for quick trials.
    spectra = model.reference.values[:, None] * gaussian_transfer(model.k[:, None], widths)
    wavenumbers = model.reference.wavenumbers
    tables = wavenumbers.synthesise(spectra, radii, order=model.reference.order).T
    root = np.sqrt(weights)
    data = root * points.u
    drift = root[:, None] * model.straight_columns
    factors = points.load * root
    odd = factors
    if points.order:
        along = points.positions[model.axis] - centres[:, model.axis, None]
        odd = factors * quotient(along, distances)
    shapes = np.concatenate([np.interp(distances, radii, table) * odd for table in tables])
    amplitudes, costs = _amplitudes(shapes, data, drift)
    if points.order:
        # The potential of a shear looks much as the normal stress does.
        potentials = wavenumbers.synthesise(spectra / model.k[:, None], radii).T
        even = [np.interp(distances, radii, table) * factors for table in potentials]
        _require_parity(points, (amplitudes, costs), _amplitudes(np.concatenate(even), data, drift))
    i = np.argmin(np.where(amplitudes > 0, costs, np.inf))
    if not amplitudes[i] > 0:
        raise _undetermined(model)
    baseline = np.linalg.lstsq(drift, data - amplitudes[i] * shapes[i])[0]
    shape = np.array([amplitudes[i], widths[i // len(centres)]])
    return shape, centres[i % len(centres)][points.free[0]], baseline


def _amplitudes(shapes: FloatArray, data: FloatArray, drift: FloatArray) -> ArrayPair:
    """Fit each row of shapes beside the drift: its amplitude, the sum of absolute residuals."""
    base = np.linalg.qr(drift)[0]
    free = shapes - (shapes @ base) @ base.T
    rest = data - base @ (base.T @ data)
    square = np.sum(free**2, axis=1)
    amplitudes = quotient(free @ rest, square)
    return amplitudes, abs(rest - amplitudes[:, None] * free).sum(axis=1)


def _trial_centres(model: ForwardModel) -> FloatArray:
    """At most 40 candidates per axis: the positions themselves, less the outer tenth."""
    points = model.points
    along = [np.zeros(1), np.zeros(1)]
    for axis in np.flatnonzero(points.free[0]):
        unique = np.unique(points.positions[axis])
        margin = unique.size // 10
        central = unique[margin : unique.size - margin]
        if points.missing:  # at a ceiling, those at the centre
            central = np.union1d(central, np.arange(central[0], central[-1], points.step))
        along[axis] = central[:: int(np.ceil(central.size / (12 if points.planar else 40)))]
    return np.column_stack([axis.ravel() for axis in np.meshgrid(*along)])


def _smoothing_length(model: ForwardModel) -> float:
    r"""Length over which the film blurs: :math:`1/k` where the reference has fallen to half."""
    values = model.reference.scalar.values
    fallen = np.flatnonzero(values / values[0] < 0.5)
    # A point's never falls.
    return float(1 / model.k[fallen[0] if fallen.size else -1])


def _undetermined(model: ForwardModel, conversion_constant: float | None = None) -> FitError:
    end = ""
    if conversion_constant is not None:
        end = f" (it stopped at A = {model.points.reading.constant(conversion_constant)})"
    return FitError(
        f"No Gaussian apparatus function fits the scan of {model.points.u.size} points{end}.",
        why="The voltage does not rise and fall with the distance from one centre.",
        cure="Look at the scan; check its channel, its positions and that it crosses the sensor.",
    )


#: Scale of the ellipticity in the solver.
_TYPICAL_ELLIPTICITY = 0.2
#: Standardised residual from which on the robust fit's loss grows linearly.
_KNEE = 3.0
#: A width below this share of its typical size is left to a search with a trust region.
_NARROWEST = 0.05
#: A width below this share of its standard uncertainty is zero.  Of a sensor that the film hides
#: entirely, half of the scans give such a width.
_NO_WIDTH = 0.1


@array_record
class GaussianFit:
    """Best Gaussian in data space, and the model linearised about it."""

    theta: FloatArray  # (p,): all parameters, in the order of the jacobian
    conversion_constant: float  # A, in V/Pa
    sigma: float  # standard deviation of the Gaussian, in m
    centre: FloatArray  # (scans, 2): of the sensor, in m; zero across a line
    # Baseline, and its change over half the range along x (and y), scan by scan; curvatures.
    drift: FloatArray
    ellipticity: FloatArray  # (2,): e1 (along x against y) and e2 (along the diagonals)
    points: ScanPoints
    geometry: Geometry
    jacobian: FloatArray  # (n, p): voltages by A, sigma, centre, drift and ellipticity
    predicted: FloatArray  # (n,): voltages of the fit, in V

    @property
    def width(self) -> float:
        """Its width in m, at least half a step: one below the sampling is not resolved."""
        return max(self.sigma, 0.5 * self.points.step)

    @property
    def size(self) -> float:
        """L2 norm of the round Gaussian of that width, in V/Pa/m."""
        return float(self.conversion_constant / (2 * np.sqrt(np.pi) * self.width))

    @property
    def count(self) -> int:
        """How many parameters it has."""
        return len(self.jacobian.T)

    def shifts(self, columns: FloatArray) -> FloatArray:
        """Of columns (n, p) by the parameters, shifts of all scans along x and along y, (n, 2)."""
        return columns[:, self.points.centres] @ np.eye(2)[np.nonzero(self.points.free)[1]]

    @property
    def prior(self) -> ArrayPair:
        """Further rows (c, p) of the jacobian by the curvatures' prior, and their residuals."""
        rows = self.points.prior_rows[:, : self.count]
        return rows, -rows.sum(axis=1) * self.drift[self.drift.size - len(rows) :]

    def has_width(self, weights: FloatArray, noise: float) -> bool:
        """Whether the width is distinct from zero, where its slopes vanish."""
        # At the end of its range a width or an ellipticity changes no voltage.
        if not self.jacobian.any(axis=0).all():
            return False
        try:
            variance = self.covariance(weights, noise)[1, 1]
        except np.linalg.LinAlgError:
            return False
        return self.sigma >= _NO_WIDTH * float(np.sqrt(variance))

    def covariance(self, weights: FloatArray, noise: float) -> FloatArray:
        """Covariance of the parameters for a noise (V) and relative weights."""
        standardised = self.points.standardised(self.jacobian, weights)
        prior = self.prior[0]
        information = standardised.T @ standardised + prior.T @ prior
        scale = np.sqrt(np.diag(information))
        inverse = np.linalg.inv(information / np.outer(scale, scale))
        return floats(noise**2 * inverse / np.outer(scale, scale))

    def gain(self, weights: FloatArray) -> VoltageMap:
        """Derivative of the parameters by the voltages, shape (p, n)."""
        covariance = self.covariance(weights, 1.0)
        right = self.points.unstandardise(self.points.standardised(self.jacobian, weights), weights)
        return VoltageMap(((covariance, right),))


def fit_gaussian_to_points(
    model: ForwardModel, weights: FloatArray, start: GaussianFit | None = None
) -> GaussianFit:
    """Fit a Gaussian by weighted least squares, from an earlier fit or a robust global search."""
    robust = start is None
    if robust and weights.size > MOST_AT_START:
        # They give the start for all.
        chosen = some_points(model.points)
        some = replace(model, points=model.points.selected(chosen))
        start = fit_gaussian_to_points(some, weights[chosen])
    theta = start.theta if start else _robust_start(model, weights)
    return _solve(model, weights, theta, robust)


def _solve(
    model: ForwardModel, weights: FloatArray, start: FloatArray, robust: bool
) -> GaussianFit:
    points = model.points
    # Typical size of each parameter, so that the solver sees numbers near one.
    scale = np.full(start.size, np.ptp(points.u))
    scale[: points.centres.stop] = max(abs(start[1]), 0.05 * _smoothing_length(model))
    scale[0] = abs(start[0])
    scale[start.size - points.ellipse :] = _TYPICAL_ELLIPTICITY
    begin = start / scale
    fit = linearise(model, begin * scale)
    left = points.standardised(points.u - fit.predicted, weights)
    noise = robust_scale(left, 1e-12 * abs(left).max() + TINY)
    # The solvers ask for residuals and slopes one after the other, at the same place.
    last = {begin.tobytes(): fit}
    prior = points.prior_rows
    # Of many points there is room for one.
    del fit

    def linearised(scaled: FloatArray) -> ArrayPair:
        key = scaled.tobytes()
        if key not in last:
            last.clear()
            last[key] = linearise(model, scaled * scale)
        residual = points.standardised(last[key].predicted - points.u, weights)
        slope = np.vstack([points.standardised(last[key].jacobian, weights), prior])
        return np.append(residual, prior @ (scaled * scale)) / noise, slope * scale / noise

    # A robust fit is the start of the next one: a low accuracy is enough.
    knee = _KNEE if robust else np.inf
    tolerance = 1e-4 if robust else 1e-9
    try:
        solution = gauss_newton(linearised, begin, tolerance=tolerance, knee=knee)
        # At a width of zero every slope by the width is zero: steps do not leave it.
        if solution is None or solution[1] < _NARROWEST:
            result = trust_region(
                linearised,
                begin,
                loss="soft_l1" if robust else "linear",
                f_scale=_KNEE,
                xtol=1e-10,
                ftol=1e-12,
                gtol=1e-10,
                max_nfev=100,
            )
            if not result.success:
                raise _undetermined(model, linearise(model, result.x * scale).conversion_constant)
            solution = result.x
    except ValueError as error:  # residuals or slopes are not finite
        raise _undetermined(model) from error
    # The model is even in the width.
    solution[1] = abs(solution[1])
    fit = linearise(model, solution * scale)
    if not 0 < fit.conversion_constant < np.inf:
        raise _undetermined(model, fit.conversion_constant)
    return fit


def trust_region(linearise: Linearised, start: FloatArray, **options: Any) -> Any:
    """Minimise the loss of the residuals from anywhere, with a trust region."""
    from scipy.optimize import least_squares

    def residual(place: FloatArray) -> FloatArray:
        return linearise(place)[0]

    def slope(place: FloatArray) -> FloatArray:
        return linearise(place)[1]

    return least_squares(residual, start, slope, **options)


def linearise(model: ForwardModel, theta: FloatArray) -> GaussianFit:
    """Return the model and its derivatives at A, sigma, centres, drifts and ellipticity."""
    points = model.points
    ellipse = theta.size - points.ellipse
    amplitude = float(theta[0])
    sigma = float(theta[1])
    centre = np.zeros(points.free.shape)
    centre[points.free] = theta[points.centres]
    drift = theta[points.centres.stop : ellipse]
    ellipticity = np.zeros(2)
    ellipticity[: points.ellipse] = theta[ellipse:]
    geometry = model.geometry(centre)
    if points.ellipse:
        columns, shift = elliptic_columns(model, geometry, sigma, ellipticity)
    else:
        kernel = gaussian_transfer(model.k, sigma)
        shift = model.shift_derivative(geometry, kernel)
        both = np.column_stack([kernel, gaussian_transfer_slope(model.k, sigma)])
        columns = model.signal(geometry, both)
    by_shape = amplitude * columns[:, 1 : 2 + points.ellipse]
    centring = model.by_free_centres(amplitude * shift)
    jacobian = np.hstack(
        [columns[:, :1], by_shape[:, :1], centring, model.drift_columns, by_shape[:, 1:]]
    )
    predicted = amplitude * columns[:, 0] + model.drift_columns @ drift
    return GaussianFit(
        theta, amplitude, sigma, centre, drift, ellipticity, points, geometry, jacobian, predicted
    )
