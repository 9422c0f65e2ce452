r"""Posterior of the restored stress over shapes of pressure, their departures, and the inputs.

The base stress is :math:`\hat\sigma_{zz}(k) = P\,T(kh)\,\hat p(k)`: the film's transfer function
:math:`T` turns a pressure into the stress at the base.  The shapes of pressure are averaged by
their marginal likelihood, and their spread counts as uncertainty.

A pressure :math:`p(r) \propto (1 - r^2/a^2)^m` of unit force has the transform

.. math::

    \Lambda_m(ka) = \Gamma(m+2)\,(2/ka)^{m+1} J_{m+1}(ka) = {}_0F_1(m+2;\,-k^2a^2/4),

from a flat punch (m = -1/2) over a sphere on a thick film (1/2) to one on a thin film that is
compressible (1) or not (2), and to a Gaussian (:math:`m \to \infty`).  With the width
:math:`s = a/\sqrt{2(m+2)}`, half of whose square is the mean square radius of each, the derivative
is :math:`\partial\Lambda_m/\partial s = -s k^2 \Lambda_{m+1}`.

Friction adds a shear :math:`q(r) = c\,p(r)\,r/2s`, whose transform of order one per newton is
:math:`c\,ks\,\Lambda_{m+1}/2`.  At the base it counts as the pressure :math:`-(N/T)\,q` with the
film's transfer functions (:mod:`memscal.mechanics.film_response`).

A wrong input acts twice.  The scan is evaluated with the wrong :math:`A\,\hat G\,T`, as if its
voltages were wrong by :math:`-\delta(A\hat G T) \otimes p`; and the film turns pressure into
stress by the wrong :math:`T`.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from operator import add

import numpy as np
from scipy.special import hyp0f1, j0, j1

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, hankel_transform
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.bayesian import WeighedFit, weigh_departures
from memscal.estimation.departures import DepartureBasis, ReducedScan, Side, departure_basis
from memscal.estimation.gaussian import GaussianFit, gauss_newton, linearise
from memscal.estimation.points import ScanPoints
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference import (
    law_at_once,
    law_sensitivities,
    rod_spectrum,
)
from memscal.estimation.voltage_map import VoltageMap
from memscal.mechanics.film_response import base_normal_from_pressure, base_normal_from_shear
from memscal.model.arrays import FloatArray
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm, more_and_less
from memscal.model.measured_stress import MeasuredScan
from memscal.model.scan import Scan, SetUp

_EXPONENTS = (-0.5, 0.0, 0.5, 1.0, 2.0, math.inf)
#: Shears from none to full stick: spheres of a contact radius from half to twice the thickness.
_SHEARS_INCOMPRESSIBLE = (0.0, -0.2, -0.4)
_SHEARS_COMPRESSIBLE = (0.0, 0.1, 0.2)
#: The transform of a rod's pressure passes through zero: where it is below this share of its force,
#: the film counts as linear.  Half and twice of it change forces and stresses by less than 0.4 %.
_LEAST_PRESSURE = 0.1


def film_transfer(scan: Scan, wavenumbers: Wavenumbers) -> FloatArray:
    """Transform of the base's normal stress under a pressure of unit transform."""
    return _transfer(scan.set_up.expected, wavenumbers)


def _transfer(set_up: SetUp, wavenumbers: Wavenumbers) -> FloatArray:
    # A film at finite strain is as under the scan's rod, where that is tabulated: a rod's pressure
    # on a linear film makes the rod's own base stress.  Other indenters sink less.
    linear = RadialSpectrum(wavenumbers, _linear_transfer(set_up.film, wavenumbers.k))
    if (law := law_at_once(set_up)) == LINEAR:
        return linear.values
    own, other = (rod_spectrum(set_up, linear, name) for name in (law, LINEAR))
    return linear.values + _per_pressure(set_up, linear, own - other)


def _linear_transfer(film: ElasticFilm, k: FloatArray) -> FloatArray:
    return base_normal_from_pressure(k * film.thickness, film.poisson_ratio)


def _per_pressure(set_up: SetUp, linear: RadialSpectrum, change: FloatArray) -> FloatArray:
    """Divide a change of the base stress (N) by the rod's pressure on a linear film."""
    pressure = rod_spectrum(set_up, linear, LINEAR) / linear.values
    return change * pressure / (pressure**2 + (_LEAST_PRESSURE * set_up.load) ** 2)


@dataclass(frozen=True)
class PressureShape:
    """A pressure of unit force with its shear, as an equivalent pressure on a film."""

    exponent: float  # m, how softly the pressure ends; infinite for a Gaussian
    shear: float  # c, outward shear over pressure at the radius of two widths
    film: ElasticFilm

    def transform(self, k: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
        """Transform at ``k`` (rad/m) for a width (m), one at k = 0; its derivative by the width."""
        plain, first, second = _orders(self.exponent, k.tobytes(), width)
        slope = -width * k**2 * first
        if self.shear == 0.0:
            return plain, slope
        m = self.exponent
        ratio = 1.0 if math.isinf(m) else (m + 2) / (m + 3)
        rise = k * first - ratio * width**2 * k**3 * second
        share = 0.5 * self.shear * _pull(self.film, k.tobytes())
        return plain - share * k * width * first, slope - share * rise


@lru_cache(maxsize=32)
def _orders(m: float, nodes: bytes, width: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the transforms of the exponents m, m + 1 and m + 2, at the radius a of m."""
    k = np.frombuffer(nodes)
    if math.isinf(m):
        same = gaussian_transfer(k, width)
        return same, same, same
    z, b = -(m + 2) * (k * width) ** 2 / 2, m + 2
    first, second = (np.asarray(hyp0f1(b + i, z), np.float64) for i in (1, 2))
    # Downwards the recurrence is stable (DLMF 10.6.1).
    return first + z / (b * (b + 1)) * second, first, second


@lru_cache(maxsize=16)
def _pull(film: ElasticFilm, k: bytes) -> FloatArray:
    """Normal stress at the base by a shear on the film over that by a pressure, at ``k``."""
    x, nu = np.frombuffer(k) * film.thickness, film.poisson_ratio
    return np.asarray(base_normal_from_shear(x, nu) / base_normal_from_pressure(x, nu))


def pressure_shapes(film: ElasticFilm) -> tuple[PressureShape, ...]:
    """Return the shapes that a restoration averages."""
    # Above a Poisson's ratio of 0.4 a pressed film flows outward under the indenter.
    shears = _SHEARS_INCOMPRESSIBLE if film.poisson_ratio > 0.4 else _SHEARS_COMPRESSIBLE
    return tuple(PressureShape(m, c, film) for m in _EXPONENTS for c in shears)


#: A fit diverges if its width is this many times the Gaussian's, or that fraction of it.
_FARTHEST = 4.0
#: A pressure narrower than this share of the scan's step is not distinct from one without width.
_NARROWEST = 0.2
#: One of several shapes is nearer to a contact's pressure than a Gaussian is to a sensor's G:
#: departures are expected to be smaller by this factor.
_SMALLER = 0.4


@dataclass(frozen=True, eq=False)
class _Basis(DepartureBasis):
    """The kernels about a fitted pressure: by force and width, and rings in units of its width."""

    shape: PressureShape

    def _sensor(self, place: FloatArray, _: Side) -> tuple[FloatArray, FloatArray]:
        kernel, slope = self.shape.transform(place, self.sigma)
        return kernel, self.conversion_constant * slope


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """The fit of one shape of pressure and of departures from it."""

    # State: pressure's transform per newton at the nodes, free centre (m), baseline and drift (V).
    state: FloatArray  # (s,): posterior mean
    rows: FloatArray  # (s, p): the state's departure from the fit, by the kernels and the rest
    weighed: WeighedFit  # by departures from the fit
    growth: float  # adopted noise over the posterior's
    log_marginal: float  # marginal likelihood up to a constant of the scan

    @property
    def covariance(self) -> FloatArray:
        """Expected squared error of the state, (s, s)."""
        return self.growth**2 * (self.rows @ self.weighed.covariance @ self.rows.T)

    @property
    def gain(self) -> VoltageMap:
        """Derivative of the state by the voltages, (s, n)."""
        return self.rows @ self.weighed.gain


#: Steps of the fits on a line, and the largest relative change of a width in one of them; they end
#: at changes below the last, in units of the parameters' sizes.
_STEPS, _LONGEST, _SETTLED = 8, 0.5, 1e-7


def _fitted_on_line(
    shapes: Sequence[PressureShape], start: ProfileEstimate, theta: FloatArray, scale: FloatArray
) -> FloatArray:
    """Fit force, width, centre and drift of all shapes at once: (shapes, p), from one start."""
    # By a Taylor series in the shift of the centre, so that the shapes share their waves.
    points, k, weights = start.points, start.model.k, start.weights
    axis, middle = int(points.free[0, 1]), theta[2]
    places, back = np.unique((points.x, points.y)[axis] - middle, return_inverse=True)
    x = np.multiply.outer(places, k)
    zero, one = j0(x), j1(x)
    two = 2 * np.divide(one, x, out=np.full_like(x, 0.5), where=x != 0) - zero
    three = 4 * np.divide(two, x, out=np.zeros_like(x), where=x != 0) - one
    # Derivatives of J0(kx) by the centre, over the factorials.
    waves = np.stack([zero, k * one, k**2 * (two - zero) / 4, k**3 * (three - 3 * one) / 24])
    waves *= start.model.reference.wavenumbers.weights * start.model.reference.values
    drift = np.repeat(start.model.drift_columns[:, None], len(shapes), axis=1)
    fitted = np.tile(theta, (len(shapes), 1))
    for _ in range(_STEPS):
        forces, widths, shifts = fitted[:, 0], fitted[:, 1], fitted[:, 2] - middle
        pairs = zip(shapes, widths, strict=True)
        transforms = np.stack([shape.transform(k, width) for shape, width in pairs], axis=2)
        # Axes: terms of the series, points, response or its slope by the width, shapes.
        terms = (waves @ np.moveaxis(transforms, 1, 0).reshape(k.size, -1))[:, back]
        terms = (terms * points.load[:, None]).reshape(4, points.u.size, 2, -1)
        powers = shifts ** np.arange(4)[:, None]
        signal, widening = np.einsum("ts,tnds->dns", powers, terms)
        moving = np.einsum("ts,tns->ns", np.arange(1, 4)[:, None] * powers[:3], terms[1:, :, 0])
        columns = np.stack([signal, forces * widening, forces * moving], axis=2)
        columns = np.concatenate([columns, drift], axis=2)
        rest = points.u[:, None] - forces * signal - drift[:, 0] @ fitted[:, 3:].T
        both = np.concatenate([columns * scale, rest[:, :, None]], axis=2)
        both = points.standardised(both.reshape(points.u.size, -1), weights).reshape(both.shape)
        step = (np.linalg.pinv(np.moveaxis(both[..., :-1], 1, 0)) @ both[..., -1].T[..., None])[
            ..., 0
        ]
        step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step[:, 1:2]), 1e-300))
        fitted = fitted + step * scale
        if np.abs(step).max() < _SETTLED:
            break
    return fitted


def fit_shape(shape: PressureShape, start: ProfileEstimate, fit: GaussianFit) -> ShapeFit:
    """Average departures from the fit of a shape."""
    model, weights = start.model, start.weights
    rings = departure_basis(model, fit)
    smaller = tuple(replace(ring, amplitude=_SMALLER * ring.amplitude) for ring in rings.rings)
    basis = _Basis(rings.conversion_constant, rings.sigma, rings.flat, smaller, (), None, shape)
    reduced = ReducedScan.of(model, fit, weights)
    weighed = weigh_departures(reduced, basis, float(start.outlier_weight.sum()))
    kernels = basis.kernels(model.k)
    rows = np.vstack([kernels, np.eye(basis.flat, kernels.shape[1])[2:]])
    first = np.concatenate(
        [fit.conversion_constant * kernels[:, 0], fit.centre[model.points.free], fit.drift]
    )
    # Priors are flat in log force, log width and the others: the information's log determinant.
    flat = fit.jacobian * np.r_[fit.conversion_constant, fit.sigma, np.ones(basis.flat - 2)]
    root = np.linalg.qr(model.points.standardised(flat, weights), mode="r")
    log_information = 2 * float(np.log(np.abs(np.diag(root))).sum())
    return ShapeFit(
        state=first + rows @ weighed.mean,
        rows=rows,
        weighed=weighed,
        growth=start.adopted_noise(weighed.noise) / weighed.noise,
        log_marginal=weighed.log_marginal_likelihood - 0.5 * log_information,
    )


def fitted_shapes(shapes: Sequence[PressureShape], start: ProfileEstimate) -> list[GaussianFit]:
    """Fit force, width, centre and drift of each shape; keep the Gaussian's where that fails."""
    gaussian, points, free = start.gaussian, start.points, start.points.free
    force, width = gaussian.conversion_constant, max(gaussian.sigma, _NARROWEST * points.step)
    theta = np.concatenate([[force, width], gaussian.centre[free], gaussian.drift])
    widths = np.full(1 + int(free.sum()), width)
    scale = np.concatenate([[force], widths, np.full(gaussian.drift.size, np.ptp(points.u))])
    near = np.tile(theta, (len(shapes), 1))
    if not points.planar:
        # Bessel functions at one centre take most steps; the last ones are exact.
        near = _fitted_on_line(shapes, start, theta, scale)
    pairs = zip(shapes, near, strict=True)
    return [
        _fitted(shape, start, place if _fits(place / scale) else theta, scale)
        for shape, place in pairs
    ]


def _fits(scaled: FloatArray) -> bool:
    return bool(scaled[0] > 0 and 1 / _FARTHEST < scaled[1] < _FARTHEST)


def _fitted(
    shape: PressureShape, start: ProfileEstimate, theta: FloatArray, scale: FloatArray
) -> GaussianFit:
    model, weights, last = start.model, start.weights, list[GaussianFit]()

    def misfit(scaled: FloatArray) -> tuple[FloatArray, FloatArray]:
        last[:] = [linearise(model, scaled * scale, shape.transform)]
        residual = model.points.standardised(last[0].predicted - model.points.u, weights)
        return residual, model.points.standardised(last[0].jacobian, weights) * scale

    best = gauss_newton(misfit, theta / scale, tolerance=_SETTLED)
    if best is None or not _fits(best):
        misfit(theta / scale)
    return last[0]


#: A shape of less probability is left out.
_NEGLIGIBLE = 1e-4
#: Eigenvalues of the covariance of A G below this share of the largest count as zero.
_EXACT = 1e-10
_RESOLVED = 3.0
#: The stress is computed out to this multiple of the scan's width.
_REACH = 1.5


@dataclass(frozen=True, eq=False)
class Posterior:
    """Base stress, centre and baseline as one state with its covariance."""

    estimate: ProfileEstimate  # the best Gaussian pressure, noise and outliers
    state: FloatArray  # (s,): stress at the nodes (N), free centre (m), baseline, drift (V)
    covariances: Mapping[str, FloatArray]  # (s, s) by source, independent
    shifts: Mapping[str, FloatArray]  # (n, q) by source: change of the voltages, in V
    changes: Mapping[str, FloatArray]  # (s, q) by source: change of the state
    film_inputs: tuple[str, ...]  # whose uncertainties the columns of source ``film`` are
    residual: FloatArray  # (n,), in V
    found_noise: float  # of a point of weight one, in V, or over the stated uncertainties
    resolved_wavenumber: float  # where the uncertainty is a third of the Gaussian's, rad/m

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the state, all sources together."""
        return np.asarray(np.sum(list(self.covariances.values()), axis=0))

    @property
    def noise_ratio(self) -> float:
        """Adopted noise over the Gaussian estimate's."""
        return self.estimate.adopted_noise(self.found_noise) / self.estimate.noise_scale

    @property
    def nodes(self) -> int:
        """How many entries of the state are the transform."""
        return self.estimate.model.k.size


def reach_of(points: ScanPoints) -> float:
    """Return the radius out to which a scan's stress is computed, in m."""
    return _REACH * float(np.hypot(np.ptp(points.x), np.ptp(points.y)))


def sensor_transfer(apparatus: ApparatusFunction, k: FloatArray) -> FloatArray:
    """Return the transform of G at ``k`` (rad/m), as a convolution with it has it."""
    return _of_sensor(apparatus, k.tobytes())[0]


def posterior_of(
    scan: Scan, apparatus: ApparatusFunction, estimate: ProfileEstimate, transfer: FloatArray
) -> Posterior:
    """Average the shapes of pressure and propagate the inputs; ``transfer``: A G's, in V/Pa."""
    shapes = pressure_shapes(scan.set_up.film)
    pairs = zip(shapes, fitted_shapes(shapes, estimate), strict=True)
    fits = [fit_shape(shape, estimate, fit) for shape, fit in pairs]
    log_marginal = np.array([fit.log_marginal for fit in fits])
    weight = np.exp(log_marginal - log_marginal.max())
    kept = np.flatnonzero(weight >= _NEGLIGIBLE)
    fits, shares = [fits[i] for i in kept], weight[kept] / weight[kept].sum()
    mean = shares @ np.stack([fit.state for fit in fits])
    gain = reduce(add, (fit.gain * share for fit, share in zip(fits, shares, strict=True)))
    within = sum(share * fit.covariance for fit, share in zip(fits, shares, strict=True))
    apart = np.stack([fit.state - mean for fit in fits], axis=1) * np.sqrt(shares)
    model, nodes = estimate.model, estimate.model.k.size
    film = film_transfer(scan, model.reference.wavenumbers)
    scale = np.concatenate([scan.stated_load * film, np.ones(mean.size - nodes)])
    by_film = _film_changes(scan, model.reference.wavenumbers)
    shared = shared_changes(apparatus, [scan], model.k)
    of_sensor = apparatus_changes(apparatus, model.k, shared)
    of_load = shared.pop("load", None)
    names, nothing = tuple(dict.fromkeys([*by_film, *shared])), np.zeros(nodes)
    # One error of a film that sensor and contact share changes A G and the film's transfer.
    of_film, of_kernel = (
        np.array([known.get(name, nothing) for name in names]).reshape(-1, nodes).T
        for known in (by_film, shared)
    )
    slope = model.radial_derivative(estimate.gaussian.geometry, mean[:nodes])
    scaled = slope * estimate.distance * (scan.position_scale_uncertainty or 0.0)
    shifts = {
        "apparatus": _signals(estimate, mean, of_sensor * film[:, None]),
        "film": _signals(estimate, mean, of_film * transfer[:, None] + of_kernel * film[:, None]),
        "position_scale": scaled[:, None],
    }
    if of_load is not None:
        shifts["load"] = _signals(estimate, mean, (of_load * film)[:, None])
    covariances = {"scan": np.outer(scale, scale) * (within + apart @ apart.T)}
    changes = {source: -scale[:, None] * (gain @ shift) for source, shift in shifts.items()}
    changes["film"][:nodes] += scan.stated_load * of_film * mean[:nodes, None]
    covariances |= {source: columns @ columns.T for source, columns in changes.items()}
    variance = np.sum([np.diag(covariance)[:nodes] for covariance in covariances.values()], axis=0)
    gaussian = scan.stated_load * film * gaussian_transfer(model.k, estimate.gaussian.sigma)
    lost = _RESOLVED * np.sqrt(np.maximum(variance, 0.0)) > gaussian
    resolved = model.k[int(np.argmax(lost)) if lost.any() else -1]
    return Posterior(
        estimate=estimate,
        state=scale * mean,
        covariances=covariances,
        shifts=shifts,
        changes=changes,
        film_inputs=names,
        residual=shares @ np.stack([fit.weighed.residual for fit in fits]),
        found_noise=float(np.dot(shares, [fit.weighed.noise for fit in fits])),
        resolved_wavenumber=float(min(resolved, np.pi / estimate.points.step)),
    )


def _signals(estimate: ProfileEstimate, state: FloatArray, changes: FloatArray) -> FloatArray:
    """Voltages of the pressure through changed references, shape (n, q), in V."""
    model, kernel = estimate.model, state[: estimate.model.k.size]
    geometry, wavenumbers = estimate.gaussian.geometry, model.reference.wavenumbers
    references = [(RadialSpectrum(wavenumbers, change),) for change in changes.T]
    columns = [replace(model, references=own).signal(geometry, kernel) for own in references]
    return np.stack(columns, axis=1) if columns else np.zeros((model.points.u.size, 0))


def apparatus_changes(
    apparatus: ApparatusFunction, k: FloatArray, without: Iterable[str] = ()
) -> FloatArray:
    """Return independent changes (n, q) of the transform of A G by one uncertainty, in V/Pa.

    Those ``without`` which they are asked for are left to :func:`shared_changes`.
    """
    return _of_sensor(apparatus, k.tobytes(), tuple(without))[1]


#: Properties of a film that sensor and contact have in common, by their names in budgets.
_OF_FILM = ("young_modulus", "poisson_ratio", "thickness")


def shared_changes(
    apparatus: ApparatusFunction, scans: Sequence[Scan | MeasuredScan], k: FloatArray
) -> dict[str, FloatArray]:
    """Return changes (n,) of the transform of A G, in V/Pa, by what contacts share with the sensor.

    By one standard uncertainty of each property of its film, and of the load on its load cell.
    """
    known, names = apparatus.film, list[str]()
    if known is not None and all(scan.film and _alike(scan.film, known) for scan in scans):
        names += _OF_FILM
    if all(scan.load_cell.same_as(apparatus.load_cell) for scan in scans):
        names.append("load")
    return input_changes(apparatus, names, k)


def input_changes(
    apparatus: ApparatusFunction, names: Iterable[str], k: FloatArray
) -> dict[str, FloatArray]:
    """Return changes (n,) of the transform of A G, in V/Pa, by inputs of the calibration."""
    known = [name for name in names if name in apparatus.kernel_changes]
    return dict(zip(known, _kernel_changes(apparatus, k.tobytes(), tuple(known)), strict=True))


@lru_cache(maxsize=16)
def _kernel_changes(
    apparatus: ApparatusFunction, nodes: bytes, names: tuple[str, ...]
) -> FloatArray:
    """Transforms (q, n) of changes of A G by inputs, which all profiles of one sensor share."""
    if not names:
        return np.empty((0, len(nodes) // 8))
    table = np.column_stack([apparatus.kernel_changes[name] for name in names])
    transforms = hankel_transform(apparatus.radial_profile.r, table, np.frombuffer(nodes))
    return apparatus.conversion_constant * transforms.T


def common_inputs(apparatus: ApparatusFunction, other: ApparatusFunction) -> list[str]:
    """Return the inputs that the calibrations of two channels by one rod scan have in common."""
    scans = (
        (one.film, one.indenter, one.load, one.load_cell, one.process.input_scan)
        for one in (apparatus, other)
    )
    same = len(set(scans)) == 1
    return [name for name in apparatus.kernel_changes if same and name in other.kernel_changes]


def _alike(film: ElasticFilm, other: ElasticFilm) -> bool:
    """Whether two films state the same properties and uncertainties."""
    names = [name + end for name in _OF_FILM for end in ("", "_uncertainty")]
    pairs = [(getattr(film, name), getattr(other, name)) for name in names]
    return film.name == other.name and all(
        (a is None) == (b is None) and math.isclose(a or 0.0, b or 0.0, rel_tol=1e-6)
        for a, b in pairs
    )


@lru_cache(maxsize=16)
def _of_sensor(
    apparatus: ApparatusFunction, nodes: bytes, without: tuple[str, ...] = ()
) -> tuple[FloatArray, FloatArray]:
    """Return transfer function and changes, which all profiles of one sensor share."""
    profile, a = apparatus.radial_profile, apparatus.conversion_constant
    u_a = apparatus.parameters.uncertainty("conversion_constant")
    covariance = a**2 * profile.g_covariance + np.outer(profile.g, profile.g) * u_a**2
    if profile.conversion_correlation is not None:
        shared = a * u_a * profile.conversion_correlation * profile.g_errors
        covariance = covariance + np.outer(shared, profile.g) + np.outer(profile.g, shared)
    for name in without:
        covariance = covariance - np.multiply.outer(*[a * apparatus.kernel_changes[name]] * 2)
    # Rings far out count by their area.
    ring = np.sqrt(profile.r + profile.r[1])
    values, vectors = np.linalg.eigh(covariance * np.outer(ring, ring))
    uncertain = values > max(_EXACT * float(values[-1]), 0.0)
    roots = vectors[:, uncertain] * np.sqrt(values[uncertain]) / ring[:, None]
    table = np.column_stack([profile.g, roots])
    transforms = hankel_transform(profile.r, table, np.frombuffer(nodes))
    return transforms[:, 0], transforms[:, 1:]


def _film_changes(scan: Scan, wavenumbers: Wavenumbers) -> dict[str, FloatArray]:
    """Change of the film's transfer function by one standard uncertainty of what is not known."""
    set_up = scan.set_up.expected
    linear = RadialSpectrum(wavenumbers, _linear_transfer(set_up.film, wavenumbers.k))
    columns: dict[str, FloatArray] = {}
    for name in ("thickness", "poisson_ratio"):
        if ends := more_and_less(set_up.film, name):
            *films, share = ends
            varied = (set_up._replace(film=film) for film in films)
            more, less = (_transfer(each, wavenumbers) for each in varied)
            columns[name] = share * (more - less)
    if law_at_once(set_up.under(NEO_HOOKEAN)) != LINEAR:
        columns |= {
            name: _per_pressure(set_up, linear, change * set_up.load)
            for name, change in law_sensitivities(set_up, linear).items()
        }
    return columns
