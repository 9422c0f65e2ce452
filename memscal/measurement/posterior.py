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
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache, reduce
from operator import add

import numpy as np
from scipy.special import hyp0f1

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, hankel_transform
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.bayesian import Weighing, weigh_departures
from memscal.estimation.departures import DepartureBasis, ReducedScan, Side, departure_basis
from memscal.estimation.gaussian import GaussianFit
from memscal.estimation.points import ScanPoints
from memscal.estimation.profile import ProfileEstimate, dynamics_changes
from memscal.estimation.reference_spectra import law_at_once, law_sensitivities, rod_spectrum
from memscal.estimation.voltage_map import VoltageMap
from memscal.mechanics.film_response import base_response
from memscal.model.arrays import (
    ArrayPair,
    Arrays,
    ArrayTriple,
    FloatArray,
    array_record,
    floats,
    value_record,
)
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


def film_transfer(set_up: SetUp, wavenumbers: Wavenumbers) -> FloatArray:
    """Transform of the base's normal stress under a pressure of unit transform."""
    # A film at finite strain is as under the scan's rod, where that is tabulated: a rod's pressure
    # on a linear film makes the rod's own base stress.  Other indenters sink less.
    linear = _linear_transfer(set_up, wavenumbers)
    law = law_at_once(set_up)
    if law == LINEAR:
        return linear.values
    change = rod_spectrum(set_up, linear, law) - rod_spectrum(set_up, linear, LINEAR)
    return linear.values + per_pressure(set_up, linear, change)


def _linear_transfer(set_up: SetUp, wavenumbers: Wavenumbers) -> RadialSpectrum:
    values, _ = base_response(wavenumbers.k * set_up.film.thickness, set_up.film.poisson_ratio)
    return RadialSpectrum(wavenumbers, values)


def per_pressure(set_up: SetUp, linear: RadialSpectrum, change: FloatArray) -> FloatArray:
    """Divide a change of the base stress (N) by the rod's pressure on a linear film."""
    pressure = rod_spectrum(set_up, linear, LINEAR) / linear.values
    return change * pressure / (pressure**2 + (_LEAST_PRESSURE * set_up.load) ** 2)


@value_record
class PressureShape:
    """A pressure of unit force with its shear, as an equivalent pressure on a film."""

    exponent: float  # m, how softly the pressure ends; infinite for a Gaussian
    shear: float  # c, outward shear over pressure at the radius of two widths
    film: ElasticFilm

    def transform(self, k: FloatArray, width: float) -> ArrayPair:
        """Transform at ``k`` (rad/m) for a width (m), one at k = 0; its derivative by the width."""
        plain, first, second = _three_orders(self.exponent, k.tobytes(), width)
        slope = -width * k**2 * first
        if self.shear == 0.0:
            return plain, slope
        m = self.exponent
        ratio = 1.0 if math.isinf(m) else (m + 2) / (m + 3)
        rise = k * first - ratio * width**2 * k**3 * second
        share = 0.5 * self.shear * _shear_ratio(self.film, k.tobytes())
        return plain - share * k * width * first, slope - share * rise


@lru_cache(maxsize=32)
def _three_orders(m: float, nodes: bytes, width: float) -> ArrayTriple:
    """Return the transforms of the exponents m, m + 1 and m + 2, at the radius a of m."""
    k = np.frombuffer(nodes)
    if math.isinf(m):
        same = gaussian_transfer(k, width)
        return same, same, same
    b = m + 2
    z = -b * (k * width) ** 2 / 2
    first = floats(hyp0f1(b + 1, z))
    second = floats(hyp0f1(b + 2, z))
    # Downwards the recurrence is stable (DLMF 10.6.1).
    own = first + z / (b * (b + 1)) * second
    return own, first, second


@lru_cache(maxsize=16)
def _shear_ratio(film: ElasticFilm, k: bytes) -> FloatArray:
    """Normal stress at the base by a shear on the film over that by a pressure, at ``k``."""
    by_pressure, by_shear = base_response(np.frombuffer(k) * film.thickness, film.poisson_ratio)
    return by_shear / by_pressure


def pressure_shapes(film: ElasticFilm) -> list[PressureShape]:
    """Return the shapes that a restoration averages."""
    # Above a Poisson's ratio of 0.4 a pressed film flows outward under the indenter.
    shears = _SHEARS_INCOMPRESSIBLE if film.poisson_ratio > 0.4 else _SHEARS_COMPRESSIBLE
    return [PressureShape(m, c, film) for m in _EXPONENTS for c in shears]


#: A fit diverges if its width is this many times the Gaussian's, or that fraction of it.
_FARTHEST = 4.0
#: A pressure narrower than this share of the scan's step is not distinct from one without width.
_NARROWEST = 0.2
#: One of several shapes is nearer to a contact's pressure than a Gaussian is to a sensor's G:
#: departures are expected to be smaller by this factor.
_SMALLER = 0.4
#: A shape of less probability is left out.
_NEGLIGIBLE = 1e-4


@array_record
class _Basis(DepartureBasis):
    """The kernels about a fitted pressure: by force and width, and rings in units of its width."""

    shape: PressureShape

    def _sensor(self, place: FloatArray, _: Side) -> ArrayPair:
        kernel, slope = self.shape.transform(place, self.sigma)
        return kernel, self.conversion_constant * slope


@array_record
class _PressureEstimate:
    """Average of departures from the fit of one shape of pressure, or of several shapes."""

    # State: pressure's transform per newton at the nodes, free centre (m), baseline and drift (V).
    state: FloatArray  # (s,): posterior mean
    covariance: FloatArray  # (s, s): expected squared error of the state
    gain: VoltageMap  # (s, n): derivative of the state by the voltages
    residual: FloatArray  # (n,), in V
    noise: float  # of a point of weight one, in V, or over the stated uncertainties


def _averaged_departures(start: ProfileEstimate, weighing: Weighing) -> _PressureEstimate:
    """Average the hypotheses about the fit of a shape."""
    model = start.model
    fit = weighing.reduced.fit
    weighed = weighing.average()
    kernels = weighing.basis.kernels(model.k)
    rows = np.vstack([kernels, np.eye(weighing.basis.flat, kernels.shape[1])[2:]])
    pressure = fit.conversion_constant * kernels[:, 0]
    fitted = np.concatenate([pressure, fit.centre[model.points.free], fit.drift])
    growth = start.adopted_noise(weighed.noise) / weighed.noise
    return _PressureEstimate(
        state=fitted + rows @ weighed.mean,
        covariance=growth**2 * (rows @ weighed.covariance @ rows.T),
        gain=rows @ weighed.gain,
        residual=weighed.residual,
        noise=weighed.noise,
    )


def _averaged_shapes(scan: Scan, start: ProfileEstimate) -> _PressureEstimate:
    """Average the shapes by their marginal likelihood; their spread counts as uncertainty."""
    weighed = weighed_shapes(pressure_shapes(scan.set_up.film), start)
    log_marginal = np.array([weighing.evidence for weighing in weighed])
    weight = np.exp(log_marginal - log_marginal.max())
    kept = np.flatnonzero(weight >= _NEGLIGIBLE)
    fits = [_averaged_departures(start, weighed[i]) for i in kept]
    shares = weight[kept] / weight[kept].sum()
    states = np.stack([fit.state for fit in fits])
    mean = shares @ states
    apart = (states - mean).T * np.sqrt(shares)
    pairs = list(zip(shares, fits, strict=True))
    return _PressureEstimate(
        state=mean,
        covariance=sum(share * fit.covariance for share, fit in pairs) + apart @ apart.T,
        gain=reduce(add, (fit.gain * share for share, fit in pairs)),
        residual=shares @ np.stack([fit.residual for fit in fits]),
        noise=float(shares @ [fit.noise for fit in fits]),
    )


def weighed_shapes(shapes: Sequence[PressureShape], start: ProfileEstimate) -> list[Weighing]:
    """Fit the shapes, and weigh departures from each fit."""
    count = start.outlier_weight.sum()
    weighed = []
    for shape, fit in zip(shapes, fitted_shapes(shapes, start), strict=True):
        about = departure_basis(fit)
        rings = tuple(replace(ring, amplitude=_SMALLER * ring.amplitude) for ring in about.rings)
        basis = _Basis(fit.conversion_constant, fit.sigma, about.flat, rings, (), None, shape)
        reduced = ReducedScan.of(start.model, fit, start.weights)
        weighed.append(weigh_departures(reduced, basis, count))
    return weighed


#: Steps of the fits; largest relative change of a width in one; what is left where it has settled.
_STEPS = 20
_LONGEST = 0.5
_SETTLED = 1e-3


def fitted_shapes(shapes: Sequence[PressureShape], start: ProfileEstimate) -> list[GaussianFit]:
    """Fit force and width of each shape; keep the Gaussian's where that fails."""
    # All shapes share the waves about the Gaussian's centre.  Another one's lies within a tenth of
    # the width from there: weighing the departures, linear in the centre, takes that step.
    gaussian = start.gaussian
    points = start.points
    drift = start.model.drift_columns.shape[1]
    force = gaussian.conversion_constant
    width = max(gaussian.sigma, _NARROWEST * points.step)
    forces = np.full(len(shapes), force)
    widths = np.full(len(shapes), width)
    data = points.standardised(points.u, start.weights)
    growth = np.zeros_like(widths)
    for _ in range(_STEPS):
        columns = _shape_columns(shapes, start, forces, widths)
        columns[..., 1:-drift] *= width
        flat = points.standardised(columns.reshape(data.size, -1), start.weights)
        inverse = np.linalg.pinv(np.moveaxis(flat.reshape(columns.shape), 1, 0))
        forces, steps, *_ = (inverse @ data).T
        # A step that turns back is half as long as the last, so that no width swings for ever.
        ahead = steps * width / widths
        longest = np.where(ahead * growth < 0, abs(growth) / 2, _LONGEST)
        growth = np.clip(ahead, -longest, longest)
        widths = widths * (1 + growth)
        if abs(ahead).max() < _SETTLED:
            break
    settled = (forces > 0) & (abs(ahead) < _SETTLED)
    settled &= (widths > width / _FARTHEST) & (widths < width * _FARTHEST)
    forces = np.where(settled, forces, force)
    widths = np.where(settled, widths, width)
    columns = np.moveaxis(_shape_columns(shapes, start, forces, widths), 1, 0)
    background = start.model.drift_columns @ gaussian.drift
    return [
        replace(
            gaussian,
            conversion_constant=float(force),
            sigma=float(width),
            ellipticity=np.zeros(2),
            jacobian=jacobian,
            predicted=force * jacobian[:, 0] + background,
        )
        for force, width, jacobian in zip(forces, widths, columns, strict=True)
    ]


def _shape_columns(
    shapes: Sequence[PressureShape], start: ProfileEstimate, forces: FloatArray, widths: FloatArray
) -> FloatArray:
    """Derivatives of the voltages by force, width, centre and drift, (n, shapes, p)."""
    model = start.model
    geometry = start.gaussian.geometry
    pairs = zip(shapes, widths, strict=True)
    transforms = np.array([shape.transform(model.k, width) for shape, width in pairs])
    kernels, slopes = transforms.transpose(1, 2, 0)
    signal, widening = np.hsplit(model.signal(geometry, np.hstack([kernels, slopes])), 2)
    centre = [model.centre_derivative(geometry, kernel) for kernel in (forces * kernels).T]
    drift = model.drift_columns[:, None]
    drift = np.broadcast_to(drift, (*signal.shape, drift.shape[-1]))
    own = np.stack([signal, forces * widening], axis=2)
    return np.concatenate([own, np.stack(centre, axis=1), drift], axis=2)


#: Eigenvalues of the covariance of A G below this share of the largest count as zero.
_EXACT = 1e-10
_RESOLVED = 3.0
#: The stress is computed out to this multiple of the scan's width.
_REACH = 1.5


@array_record
class Posterior:
    """Base stress, centre and baseline as one state with its covariance."""

    estimate: ProfileEstimate  # the best Gaussian pressure, noise and outliers
    state: FloatArray  # (s,): stress at the nodes (N), free centre (m), baseline, drift (V)
    covariances: Arrays  # (s, s) by source, independent
    shifts: Arrays  # (n, q) by source: change of the voltages, in V
    changes: Arrays  # (s, q) by source: change of the state
    film: FloatArray  # (k,): stress at the base over the pressure on the film, by their transforms
    film_inputs: Sequence[str]  # whose uncertainties the columns of source ``film`` are
    nodes: int  # how many entries of the state are the transform
    first_drift: int  # place of the baseline, behind the free centre
    residual: FloatArray  # (n,), in V
    found_noise: float  # of a point of weight one, in V, or over the stated uncertainties
    noise_ratio: float  # adopted noise over the Gaussian estimate's
    resolved_wavenumber: float  # where the uncertainty is a third of the Gaussian's, rad/m

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the state, all sources together."""
        return floats(np.sum(list(self.covariances.values()), axis=0))

    @property
    def wavenumbers(self) -> Wavenumbers:
        """Nodes of the transform of the base stress."""
        return self.estimate.model.reference.wavenumbers

    @property
    def stress(self) -> FloatArray:
        """Transform of the base stress at the nodes, in N."""
        return self.state[: self.nodes]

    @property
    def drift(self) -> FloatArray:
        """Baseline and drift, in V, that the drift's columns belong to."""
        return self.state[self.first_drift :]


def reach_of(points: ScanPoints) -> float:
    """Return the radius out to which a scan's stress is computed, in m."""
    return _REACH * points.span


def posterior_of(scan: Scan, apparatus: ApparatusFunction, estimate: ProfileEstimate) -> Posterior:
    """Average the shapes of pressure and propagate the inputs."""
    averaged = _averaged_shapes(scan, estimate)
    mean = averaged.state
    model = estimate.model
    nodes = model.k.size
    wavenumbers = model.reference.wavenumbers
    set_up = scan.set_up.expected
    film = film_transfer(set_up, wavenumbers)
    scale = np.append(scan.stated_load * film, np.ones(mean.size - nodes))
    by_film = film_changes(set_up, wavenumbers)
    shared = shared_changes(apparatus, [scan], model.k)
    # One error of a film that sensor and contact share changes A G and the film's transfer.
    names = [name for name in by_film | shared if name != "load"]
    of_film = columns_of(by_film, names, nodes)
    of_kernel = columns_of(shared, names, nodes)
    transfer = apparatus.conversion_constant * sensor_changes(apparatus, model.k)[0]
    together = of_film * transfer[:, None] + of_kernel * film[:, None]
    _, sensor = sensor_changes(apparatus, model.k, shared)
    slope = model.radial_derivative(estimate.gaussian.geometry, mean[:nodes])
    stretched = slope * estimate.distance * (scan.position_scale_uncertainty or 0.0)
    shifts = {
        "apparatus": _signals(estimate, mean, sensor * film[:, None]),
        "film": _signals(estimate, mean, together),
        "position_scale": stretched[:, None],
    }
    by_dynamics = dynamics_changes(estimate, mean[:nodes])
    if by_dynamics:
        shifts["dynamics"] = np.column_stack([*by_dynamics.values()])
    if "load" in shared:
        shifts["load"] = _signals(estimate, mean, (shared["load"] * film)[:, None])
    changes = {}
    covariances = {"scan": np.outer(scale, scale) * averaged.covariance}
    for source, shift in shifts.items():
        change = -scale[:, None] * (averaged.gain @ shift)
        if source == "film":
            change[:nodes] += scan.stated_load * of_film * mean[:nodes, None]
        changes[source] = change
        covariances[source] = change @ change.T
    variance = sum(np.diag(covariance)[:nodes] for covariance in covariances.values())
    gaussian = scan.stated_load * film * gaussian_transfer(model.k, estimate.gaussian.sigma)
    lost = _RESOLVED * np.sqrt(np.maximum(variance, 0.0)) > gaussian
    resolved = model.k[np.argmax(lost) if lost.any() else -1]
    return Posterior(
        estimate=estimate,
        state=scale * mean,
        covariances=covariances,
        shifts=shifts,
        changes=changes,
        film=film,
        film_inputs=names,
        nodes=nodes,
        first_drift=nodes + estimate.points.free.sum(),
        residual=averaged.residual,
        found_noise=averaged.noise,
        noise_ratio=estimate.adopted_noise(averaged.noise) / estimate.noise_scale,
        resolved_wavenumber=float(min(resolved, np.pi / estimate.points.step)),
    )


def columns_of(changes: Arrays, names: Sequence[str], count: int) -> FloatArray:
    """Return changes by some inputs as columns, (count, q); of one that changes nothing, zeros."""
    rows = [changes.get(name, np.zeros(count)) for name in names]
    return np.reshape(rows, (-1, count)).T


def _signals(estimate: ProfileEstimate, state: FloatArray, changes: FloatArray) -> FloatArray:
    """Voltages of the pressure through changed references, shape (n, q), in V."""
    model = estimate.model
    alone = RadialSpectrum(model.reference.wavenumbers, np.ones(model.k.size))
    kernels = state[: model.k.size, None] * changes
    return replace(model, references=(alone,)).signal(estimate.gaussian.geometry, kernels)


def sensor_changes(
    apparatus: ApparatusFunction, k: FloatArray, without: Iterable[str] = ()
) -> ArrayPair:
    """Return the transform of G, as a convolution has it, and changes of that of A G, in V/Pa.

    The changes (n, q) by one uncertainty are independent; those ``without`` which they are asked
    for are left to :func:`shared_changes`.
    """
    return _sensor_changes(apparatus, k.tobytes(), tuple(without))


#: Properties of a film that sensor and contact have in common, by their names in budgets.
_FILM_PROPERTIES = ("young_modulus", "poisson_ratio", "thickness")


def shared_changes(
    apparatus: ApparatusFunction, scans: Sequence[Scan | MeasuredScan], k: FloatArray
) -> Arrays:
    """Return changes (n,) of the transform of A G, in V/Pa, by what contacts share with the sensor.

    By one standard uncertainty of each property of its film, and of the load on its load cell.
    """
    known = apparatus.film
    names = list[str]()
    if known and all(scan.film and alike_films(scan.film, known) for scan in scans):
        names += _FILM_PROPERTIES
    if all(scan.load_cell.same_as(apparatus.load_cell) for scan in scans):
        names.append("load")
    return input_changes(apparatus, names, k)


def input_changes(apparatus: ApparatusFunction, names: Iterable[str], k: FloatArray) -> Arrays:
    """Return changes (n,) of the transform of A G, in V/Pa, by inputs of the calibration."""
    known = tuple(name for name in names if name in apparatus.kernel_changes)
    if not known:
        return {}
    return dict(zip(known, _kernel_changes(apparatus, k.tobytes(), known), strict=True))


@lru_cache(maxsize=16)
def _kernel_changes(
    apparatus: ApparatusFunction, nodes: bytes, names: tuple[str, ...]
) -> FloatArray:
    """Transforms (q, n) of changes of A G by inputs, which all profiles of one sensor share."""
    table = np.column_stack([apparatus.kernel_changes[name] for name in names])
    transforms = hankel_transform(apparatus.radial_profile.r, table, np.frombuffer(nodes))
    return apparatus.conversion_constant * transforms.T


def common_inputs(apparatus: ApparatusFunction, other: ApparatusFunction) -> list[str]:
    """Return the inputs that the calibrations of two channels by one rod scan have in common."""
    scans = {
        (one.film, one.indenter, one.load, one.load_cell, one.process.input_scan)
        for one in (apparatus, other)
    }
    if len(scans) > 1:
        return []
    return [name for name in apparatus.kernel_changes if name in other.kernel_changes]


def alike_films(film: ElasticFilm, other: ElasticFilm) -> bool:
    """Whether two films state the same properties and uncertainties."""
    names = [*_FILM_PROPERTIES, *(f"{name}_uncertainty" for name in _FILM_PROPERTIES)]
    # What is not stated is not a number.
    values = np.array([getattr(film, name) for name in names], float)
    others = np.array([getattr(other, name) for name in names], float)
    same = np.allclose(values, others, rtol=1e-6, atol=0.0, equal_nan=True)
    return film.name == other.name and same


@lru_cache(maxsize=16)
def _sensor_changes(
    apparatus: ApparatusFunction, nodes: bytes, without: tuple[str, ...]
) -> ArrayPair:
    """Return transfer function and changes, which all profiles of one sensor share."""
    profile = apparatus.radial_profile
    g = profile.g
    a = apparatus.conversion_constant
    u_a = apparatus.parameters.uncertainty("conversion_constant")
    covariance = a**2 * profile.g_covariance + np.outer(g, g) * u_a**2
    if profile.conversion_correlation is not None:
        shared = a * u_a * profile.conversion_correlation * profile.g_errors
        covariance = covariance + np.outer(shared, g) + np.outer(g, shared)
    for name in without:
        change = a * apparatus.kernel_changes[name]
        covariance = covariance - np.outer(change, change)
    # Rings far out count by their area.
    ring = np.sqrt(profile.r + profile.r[1])
    values, vectors = np.linalg.eigh(covariance * np.outer(ring, ring))
    uncertain = values > max(_EXACT * values[-1], 0.0)
    roots = vectors[:, uncertain] * np.sqrt(values[uncertain])
    table = np.column_stack([g, roots / ring[:, None]])
    transforms = hankel_transform(profile.r, table, np.frombuffer(nodes))
    return transforms[:, 0], transforms[:, 1:]


def film_changes(set_up: SetUp, wavenumbers: Wavenumbers) -> Arrays:
    """Change of the film's transfer function by one standard uncertainty of what is not known."""
    changes: Arrays = {}
    for name in ("thickness", "poisson_ratio"):
        ends = more_and_less(set_up.film, name)
        if ends:
            *films, share = ends
            more, less = (film_transfer(set_up._replace(film=f), wavenumbers) for f in films)
            changes[name] = share * (more - less)
    if law_at_once(set_up.under(NEO_HOOKEAN)) != LINEAR:
        linear = _linear_transfer(set_up, wavenumbers)
        for name, change in law_sensitivities(set_up, linear).items():
            changes[name] = per_pressure(set_up, linear, change * set_up.load)
    return changes
