r"""First-order propagation of noise, regularisation and uncertain inputs to A, G and its widths.

A division is linear in the voltages: :math:`A\,G(r)` is the inverse transform of the window times
the smoothed voltages' transform over the reference's.  Its covariance by noise is exact for given
centre, weights, smoothing and window; centre, baseline and drift are those of the estimate, by
their derivatives.  What window and smoothing hide is stated apart (``window``): what they take from
the posterior mean of the Bayesian estimate, and from its posterior about that.

Method ``bayesian`` is a linear function of the posterior of the profile's parameters: what
scatters from scan to scan is ``noise``, the rest of the expected squared error ``regularisation``.

Inputs add one column each, the change of all results by one standard uncertainty.  An input that
is larger than stated changes the results as voltages would: by :math:`-A\,G\otimes\delta
\sigma_{zz}` for the base stress, by :math:`-U'(R)\,\delta R` for the positions.  A change of the
load scales A alone.  Numbers read off G(r) are functionals of it: their derivative is a row that
multiplies a change of G.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import j0

from memscal.axisymmetry.hankel import RadialSpectrum, hankel_transform, radial_spline, ring_areas
from memscal.axisymmetry.kernels import unit_gaussian, unit_gaussian_slope
from memscal.calibration.fields import RasterFields
from memscal.calibration.stages import Deconvolution, Solution
from memscal.deconvolution.fourier_ratio import Field
from memscal.errors import InputError
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference import carried_force, film_sensitivities, rod_sensitivities
from memscal.estimation.smoothing import SmoothedProfile
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

#: Points per step of the profile between which the half maximum is interpolated.
_FINE = 20
#: Two models differ by a bound, anywhere within which the truth may lie: a rectangle.
_RECTANGLE = 1 / np.sqrt(3)
#: Windows below this have closed.
_CLOSED = 1e-9
#: What sums of squares lose to rounding.
_ROUNDING = 1e-9
#: Parameters whose uncertainty is broken down by source.
BUDGETED = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "fwhm",
    "noise_equivalent_area",
)
#: Sources that are the same error in every scan.
NOT_RANDOM = ("regularisation", "window")


@dataclass(frozen=True, eq=False)
class Functional:
    """A number read off G: its parameter's name, its value, and its derivative by G(r)."""

    name: str
    value: float
    row: FloatArray


def kernel_functionals(field: Field, sigma: float) -> tuple[Functional, ...]:
    """Return the Gaussian width nearest to G, its full width at half maximum and its area."""
    r, g = field.r, field.radial
    return (_gaussian_width(r, g, sigma), _half_width(r, g), _equivalent_area(r, g))


def _gaussian_width(r: FloatArray, g: FloatArray, sigma: float) -> Functional:
    """Width of the Gaussian u nearest to G over the plane."""
    # Where the sum of r (u - G) u' vanishes: its change by G over its change by the width.
    slope, step = unit_gaussian_slope(r, sigma), 1e-4 * sigma
    bend = unit_gaussian_slope(r, sigma + step) - unit_gaussian_slope(r, sigma - step)
    left = unit_gaussian(r, sigma) - g
    row = r * slope / np.sum(r * (slope**2 + left * bend / (2 * step)))
    return Functional("gaussian_sigma_deconvolved", sigma, row)


def _half_width(r: FloatArray, g: FloatArray) -> Functional:
    """Diameter of the outermost circle where G is half of its maximum."""
    # With G(q) = G(m)/2, a change of G moves q by -(dG(q) - dG(m)/2) / G'(q).
    fine = np.linspace(r[0], r[-1], _FINE * r.size)
    values = radial_spline(r, g)(fine)
    top = int(np.argmax(values))
    last = int(np.flatnonzero(values >= values[top] / 2)[-1])
    last = min(last, fine.size - 2)
    slope = (values[last + 1] - values[last]) / (fine[1] - fine[0])
    half = fine[last] + (values[top] / 2 - values[last]) / slope if slope else fine[last]
    row = _at(r, half) - 0.5 * _at(r, float(fine[top]))
    row = -2 * row / slope if slope else np.zeros_like(row)
    return Functional("fwhm", float(2 * half), row)


def _equivalent_area(r: FloatArray, g: FloatArray) -> Functional:
    r"""Noise-equivalent area :math:`1/\int G^2\,dA`, in m^2: 4 pi sigma^2 of a Gaussian."""
    ring = ring_areas(r)
    area = float(1 / np.sum(ring * g**2))
    return Functional("noise_equivalent_area", area, -2 * area**2 * ring * g)


def _at(r: FloatArray, place: float) -> FloatArray:
    """Row that reads a profile at a radius, by linear interpolation."""
    row = np.zeros_like(r)
    i = int(np.clip(np.searchsorted(r, place) - 1, 0, r.size - 2))
    share = (place - r[i]) / (r[i + 1] - r[i])
    row[i], row[i + 1] = 1 - share, share
    return row


@dataclass(frozen=True, eq=False)
class InputEffect:
    """What one standard uncertainty of an input does."""

    voltage: FloatArray  # (n,): change of the voltages that it would be mistaken for, in V
    scaling: float = 0.0  # relative change of A beside that


def input_effects(
    scans: Sequence[Scan],
    stresses: Sequence[StressProfile | Contact],
    estimate: ProfileEstimate,
    alternatives: Sequence[RadialSpectrum] | None = None,
) -> Mapping[str, InputEffect]:
    """Return the effect of every input whose uncertainty is stated, by its name."""
    # Scans share the error of a common film or rod, of the balance and of the stage.
    model = estimate.model
    changes: dict[str, list[FloatArray]] = {}
    for attribute, sensitivities in [("film", film_sensitivities), ("indenter", rod_sensitivities)]:
        owners = [getattr(scan, attribute) for scan in scans]
        distinct = list(dict.fromkeys(owners))
        for i, (scan, owner) in enumerate(zip(scans, owners, strict=True)):
            number = distinct.index(owner)
            suffix = "" if number == 0 else f"_{number + 1}"
            for source, change in sensitivities(scan, model.references[i]).items():
                blank = [np.zeros_like(change) for _ in scans]
                changes.setdefault(source + suffix, blank)[i] = change
    for i, stress in enumerate(stresses):
        # Stated errors are those of the normal stress, not of the shear.
        if model.order or not isinstance(stress, StressProfile):
            continue
        if stress.sigma_zz_errors is not None:
            errors = hankel_transform(stress.r, stress.sigma_zz_errors, model.k) / stress.load
            blank = [np.zeros_like(errors) for _ in scans]
            changes.setdefault("reference_stress", blank)[i] = errors
    if alternatives is not None:
        pairs = zip(alternatives, model.references, strict=True)
        changes["model_form"] = [_RECTANGLE * (a.values - ours.values) for a, ours in pairs]
    effects = {source: _of_reference(estimate, change) for source, change in changes.items()}
    return effects | _of_positions(scans, estimate) | _of_loads(scans, stresses, estimate)


def _of_reference(estimate: ProfileEstimate, changes: Sequence[FloatArray]) -> InputEffect:
    spectra = (
        replace(reference, values=change)
        for reference, change in zip(estimate.model.references, changes, strict=True)
    )
    changed = replace(estimate.model, references=tuple(spectra))
    return InputEffect(-changed.signal(estimate.gaussian.geometry, estimate.kernel))


def _of_positions(scans: Sequence[Scan], estimate: ProfileEstimate) -> dict[str, InputEffect]:
    shares = np.array([scan.position_scale_uncertainty or 0.0 for scan in scans])
    if not shares.any():
        return {}
    slope = estimate.model.radial_derivative(estimate.gaussian.geometry, estimate.kernel)
    error = slope * estimate.distance * shares[estimate.points.scan]
    return {"position_scale": InputEffect(-error)}


def _of_loads(
    scans: Sequence[Scan], stresses: Sequence[StressProfile | Contact], estimate: ProfileEstimate
) -> dict[str, InputEffect]:
    """Effects of factors: loads, forces of references, and their discretisation."""
    model = estimate.model
    signal = estimate.predicted - estimate.background
    shares: dict[str, Sequence[float | None]] = {
        "reference_force": [
            abs(carried_force(stress, reference) - 1.0)
            for stress, reference in zip(stresses, model.references, strict=True)
        ],
        "load": [
            None if scan.load_uncertainty is None else scan.load_uncertainty / scan.load
            for scan in scans
        ],
        "reference_convergence": [stress.convergence for stress in stresses],
    }
    effects = {}
    for source, stated in shares.items():
        if all(share is None for share in stated):
            continue
        of_scans = np.array([share or 0.0 for share in stated])
        common = float(of_scans.mean())
        apart = (of_scans - common)[estimate.points.scan]
        effects[source] = InputEffect(-apart * signal, -common)
    return effects


def correlation_matrix(
    sources: Sequence[str], correlations: Mapping[tuple[str, str], float]
) -> FloatArray:
    """Return the correlation matrix of inputs, the identity but for the stated pairs."""
    matrix = np.eye(len(sources))
    for pair, coefficient in correlations.items():
        unknown = [name for name in pair if name not in sources]
        if unknown or len(set(pair)) != 2:
            raise InputError(
                f"A correlation is given for {' and '.join(map(repr, pair))}.",
                why="It must be between two inputs whose uncertainty is stated.",
                cure=f"Choose from {', '.join(sources) or 'none'}.",
            )
        if not -1 <= coefficient <= 1:
            raise InputError(
                f"The correlation of {pair[0]} and {pair[1]} is {coefficient:g}, outside -1 to 1."
            )
        i, j = (sources.index(name) for name in pair)
        matrix[i, j] = matrix[j, i] = coefficient
    least = float(np.linalg.eigvalsh(matrix)[0]) if sources else 1.0
    if least < -1e-9:
        raise InputError(
            f"The correlations of the inputs contradict each other: their matrix has the "
            f"eigenvalue {least:.3g}.",
            why="A covariance is positive semi-definite.",
            cure="Two inputs that both follow a third closely cannot be opposed.",
        )
    return matrix


@dataclass(frozen=True, eq=False)
class Results:
    """Everything a calibration states with an uncertainty."""

    parameters: ParameterSet  # scalars with their joint covariance
    budget: Mapping[str, Mapping[str, float]]  # standard uncertainties by parameter and source
    radial_covariance: FloatArray  # (n, n): covariance of G(r), in 1/m^4
    cross_covariance: FloatArray  # (n, p): covariance of G(r) with the parameters, in their units
    transfer_errors: FloatArray  # (m,): standard uncertainty of the transfer function
    radial_scatter: FloatArray  # (n,): standard uncertainty of G(r) from noise alone, in 1/m^2


@dataclass(frozen=True, eq=False)
class _Rows:
    """Derivatives of all results: of the parameters, then G at its radii, then the transfer."""

    names: tuple[str, ...]  # of the parameters
    values: FloatArray
    by_voltage: FloatArray  # (m, n)
    by_state: FloatArray  # (m, p): by the posterior's parameters, beside what voltages do to them
    hidden: FloatArray | None = None  # (m, q): columns of what window and smoothing hide

    def columns(self, estimate: ProfileEstimate) -> dict[str, FloatArray]:
        """Contributions of the scan itself."""
        own = {
            "noise": self.by_voltage @ estimate.noise_root,
            "regularisation": self.by_state @ _fixed_root(estimate),
        }
        return own if self.hidden is None else own | {"window": self.hidden}


def propagate(
    solution: Solution,
    deconvolution: Deconvolution,
    wavenumbers: FloatArray,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
) -> Results:
    """Propagate all stated uncertainties to a deconvolution, with its transfer at wavenumbers."""
    estimate = solution.estimate
    rows = _rows(solution, deconvolution, wavenumbers)
    columns = rows.columns(estimate)
    independent = list(columns.values())
    columns |= {name: _input_column(rows, effect) for name, effect in effects.items()}
    if effects:
        together = np.hstack([columns[name] for name in effects])
        independent.append(together @ _root(correlation_matrix(list(effects), correlations)))
    everything = np.hstack(independent)
    count = len(rows.names)
    radial = slice(count, count + deconvolution.g.r.size)
    stored = everything[: radial.stop] @ everything[: radial.stop].T
    scatter = [columns["noise"][radial], *([independent[-1][radial]] if effects else [])]
    return Results(
        parameters=ParameterSet(rows.names, rows.values, stored[:count, :count]),
        budget={name: _budget(rows, columns, stored, name) for name in BUDGETED},
        radial_covariance=stored[count:, count:],
        cross_covariance=stored[count:, :count],
        transfer_errors=np.linalg.norm(everything[radial.stop :], axis=1),
        radial_scatter=np.linalg.norm(np.hstack(scatter), axis=1),
    )


def _budget(
    rows: _Rows, columns: Mapping[str, FloatArray], covariance: FloatArray, name: str
) -> dict[str, float]:
    """Contribution of each source; of correlations with the sign of what they add."""
    row = rows.names.index(name)
    budget = {source: float(np.linalg.norm(column[row])) for source, column in columns.items()}
    variance = float(covariance[row, row])
    excess = variance - sum(u**2 for u in budget.values())
    if abs(excess) > _ROUNDING * variance:
        budget["correlations"] = float(np.copysign(np.sqrt(abs(excess)), excess))
    return budget


def _input_column(rows: _Rows, effect: InputEffect) -> FloatArray:
    column = rows.by_voltage @ effect.voltage
    scales = np.array([name.startswith("conversion_constant") for name in rows.names])
    column[: scales.size] += np.where(scales, rows.values, 0.0) * effect.scaling
    return np.asarray(column[:, None])


def _rows(solution: Solution, deconvolution: Deconvolution, wavenumbers: FloatArray) -> _Rows:
    """Derivatives of the results of either route."""
    estimate, smoothed = solution.estimate, solution.smoothed
    a, g = deconvolution.conversion_constant, deconvolution.g
    functionals = kernel_functionals(g, deconvolution.gaussian_sigma)
    if deconvolution.divided and smoothed is not None:
        division = _division_map(solution, smoothed, deconvolution, wavenumbers)
        kernel = _divided_kernel(estimate, division)
    else:
        kernel = _posterior_kernel(estimate, deconvolution, wavenumbers)
    read = np.stack([functional.row for functional in functionals])
    of_kernel = ("conversion_constant", *(functional.name for functional in functionals))
    values = dict(zip(of_kernel, (a, *(f.value for f in functionals)), strict=True))
    blocks = {
        name: np.vstack([block[:1], read @ block[1 : 1 + g.r.size]])
        for name, block in kernel.items()
    }
    fitted = _fitted_rows(estimate)
    names = _order(of_kernel, tuple(fitted))
    shapes = {"by_voltage": estimate.points.u.size, "by_state": estimate.basis.integrals.size}
    stacked = {}
    for block, of_numbers in blocks.items():
        rows = dict(zip(of_kernel, of_numbers, strict=True))
        for name, (value, by_voltage, by_state) in fitted.items():
            values[name] = value
            rows[name] = {"by_voltage": by_voltage, "by_state": by_state}.get(
                block, np.zeros(of_numbers.shape[1])
            )
        stacked[block] = np.vstack([*(rows[name] for name in names), kernel[block][1:]])
    assert all(stacked[block].shape[1] == size for block, size in shapes.items())
    return _Rows(names, np.array([values[name] for name in names]), **stacked)


def _order(of_kernel: tuple[str, ...], fitted: tuple[str, ...]) -> tuple[str, ...]:
    """Parameters in the order in which they are reported."""
    first, *others = of_kernel
    sigma, *ellipse = (name for name in fitted if name.startswith(("gaussian_sigma", "ellip")))
    nuisances = [name for name in fitted if name not in (sigma, *ellipse)]
    return (first, sigma, *ellipse, *others, *nuisances)


def _posterior_kernel(
    estimate: ProfileEstimate, deconvolution: Deconvolution, wavenumbers: FloatArray
) -> dict[str, FloatArray]:
    """Derivatives of A, G and its transfer function, by the posterior's parameters."""
    basis, k = estimate.basis, estimate.model.k
    a, r = deconvolution.conversion_constant, deconvolution.g.r
    # Normalised: a change of A G by dK changes G by (dK - G dA) / A.
    normalised = (basis.kernels(k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    radial = (basis.radial(r) - np.outer(estimate.radial(r) / a, basis.integrals)) / a
    transfer = _interpolated(wavenumbers, k, normalised)
    rows = np.vstack([basis.integrals, radial, transfer])
    return {"by_voltage": rows @ estimate.weighed.gain, "by_state": rows}


@dataclass(frozen=True, eq=False)
class _DivisionMap:
    """A division of fields as a linear map from voltages less background to A, G and transfer."""

    direct: FloatArray  # (m, n): of voltages, for given centre, baseline and drift
    nuisance: FloatArray  # (n, q): voltages by free centres, baselines and drifts
    signals: FloatArray  # (n, 1 + p): voltages of the posterior mean, and by its parameters
    lost: FloatArray  # (m, 1 + p): what the division hides of these

    @property
    def places(self) -> slice:
        """Places of centres, baselines and drifts among the posterior's parameters."""
        return slice(2, 2 + self.nuisance.shape[1])


def _division_map(
    solution: Solution,
    smoothed: SmoothedProfile,
    deconvolution: Deconvolution,
    wavenumbers: FloatArray,
) -> _DivisionMap:
    estimate, fields = solution.estimate, solution.fields
    basis, model = estimate.basis, estimate.model
    a, r, g = deconvolution.conversion_constant, deconvolution.g.r, deconvolution.g.radial
    gain = fields.gain(smoothed) if isinstance(fields, RasterFields) else smoothed.gain
    reference = model.reference
    axis, window = fields.along_axis(deconvolution.quotient.window)
    window = np.interp(model.k, axis, window, right=0.0)
    # Where the window has closed the reference may have vanished.
    ratio = np.divide(window, reference.values, out=np.zeros_like(window), where=window > _CLOSED)
    weights = reference.wavenumbers.weights * ratio
    synthesis = fields.taper(r)[:, None] * j0(np.multiply.outer(r, model.k)) * weights
    rings = ring_areas(r)

    def normalised(radial: FloatArray) -> FloatArray:
        """Changes of A, G and its transfer function for changes of A G (r, m)."""
        of_a = rings @ radial
        of_g = (radial - np.multiply.outer(g, of_a)) / a
        transfer = (j0(np.multiply.outer(wavenumbers, r)) * rings) @ of_g
        return np.vstack([of_a[None, :], of_g, transfer])

    geometry = model.geometry(estimate.centres)
    nuisance = np.hstack([model.centre_derivative(geometry, estimate.kernel), model.drift_columns])
    signals = model.signal(geometry, np.column_stack([estimate.kernel, basis.kernels(model.k)]))
    radial = np.column_stack([estimate.radial(r), basis.radial(r)])
    return _DivisionMap(
        direct=normalised(synthesis @ gain),
        nuisance=nuisance,
        signals=signals,
        lost=normalised(radial - synthesis @ (gain @ signals)),
    )


def _divided_kernel(estimate: ProfileEstimate, division: _DivisionMap) -> dict[str, FloatArray]:
    """Derivatives of A, G and its transfer function by division, and what it hides of them."""
    # Centre, baseline and drift are parameters of the estimate.
    by_nuisance = -division.direct @ division.nuisance
    by_state = np.zeros((len(by_nuisance), estimate.basis.integrals.size))
    by_state[:, division.places] = by_nuisance
    spread = division.lost[:, 1:] @ _root(estimate.covariance)
    return {
        "by_voltage": division.direct + by_nuisance @ estimate.weighed.gain[division.places],
        "by_state": by_state,
        "hidden": np.hstack([division.lost[:, :1], spread]),
    }


def route_difference(solution: Solution) -> float | None:
    r"""Difference of division and Bayesian estimate beyond what the division hides, over its size.

    The division of the residuals of the Bayesian fit: of A in standard deviations, of G as the
    root of :math:`\int \Delta G^2\,dA` over its expectation; the larger one.  ``None`` where
    there is one estimate only.
    """
    estimate, smoothed = solution.estimate, solution.smoothed
    if solution.other is None or smoothed is None:
        return None
    division = solution.deconvolution if solution.deconvolution.divided else solution.other
    linear = _division_map(solution, smoothed, division, np.zeros(0))
    changes = linear.signals[:, 1:].copy()
    changes[:, linear.places] += linear.nuisance
    fitted = changes @ estimate.weighed.gain
    roots = [
        estimate.noise_root - fitted @ estimate.noise_root,
        changes @ _fixed_root(estimate),
    ]
    residual = estimate.points.u - estimate.predicted
    difference = linear.direct @ (residual + estimate.oval)
    variance = np.sum((linear.direct @ np.hstack(roots)) ** 2, axis=1)
    rings = ring_areas(division.g.r)
    of_a = abs(difference[0]) / np.sqrt(variance[0])
    of_g = np.sqrt((rings @ difference[1:] ** 2) / (rings @ variance[1:]))
    return float(max(of_a, of_g))


def _interpolated(places: FloatArray, nodes: FloatArray, columns: FloatArray) -> FloatArray:
    """Interpolate every column linearly, its ends continued: np.interp for all at once."""
    left = np.clip(np.searchsorted(nodes, places) - 1, 0, nodes.size - 2)
    share = np.clip((places - nodes[left]) / (nodes[left + 1] - nodes[left]), 0.0, 1.0)[:, None]
    return np.asarray((1 - share) * columns[left] + share * columns[left + 1])


def _fitted_rows(
    estimate: ProfileEstimate,
) -> dict[str, tuple[float, FloatArray, FloatArray]]:
    """Value and derivatives (by voltages, by the posterior's parameters) of what is fitted."""
    gaussian, states = estimate.gaussian, estimate.basis.integrals.size
    none, fit, gain = np.zeros(states), estimate.gaussian_gain, estimate.weighed.gain
    rows: dict[str, tuple[float, FloatArray, FloatArray]] = {
        "gaussian_sigma": (gaussian.sigma, fit[1], none)
    }
    # The Gaussian's ellipticity: a round departure beside it would be read as less of both.
    first = estimate.basis.flat - estimate.points.ellipse
    for i, name in enumerate(("ellipticity", "ellipticity_diagonal")[: estimate.points.ellipse]):
        rows[name] = (float(gaussian.ellipticity[i]), fit[first + i], none)
    for i, (name, value, scale) in enumerate(_nuisances(estimate), start=2):
        rows[name] = (value, scale * gain[i], scale * _unit(states, i))
    rows["conversion_constant_gaussian"] = (gaussian.conversion_constant, fit[0], none)
    return rows


def _nuisances(estimate: ProfileEstimate) -> list[tuple[str, float, float]]:
    """Centre, baseline and drift of each scan, with their scale; of the second ending in ``_2``."""
    free = estimate.points.free
    centres = [("centre", "centre_y")[axis] + _number(scan) for scan, axis in np.argwhere(free)]
    entries = [
        (name, float(value), 1.0)
        for name, value in zip(centres, estimate.centres[free], strict=True)
    ]
    drifts: list[tuple[str, float]] = []
    for scan, directions in enumerate(free):
        # The drift is stated across the whole range; its coefficient spans half of it.
        along = [("drift", "drift_y")[axis] for axis in np.flatnonzero(directions)]
        drifts += [("baseline" + _number(scan), 1.0), *((n + _number(scan), 2.0) for n in along)]
    pairs = zip(drifts, estimate.drifts, strict=True)
    return entries + [(name, scale * float(value), scale) for (name, scale), value in pairs]


def _number(scan: int) -> str:
    return "" if scan == 0 else f"_{scan + 1}"


def _unit(count: int, index: int) -> FloatArray:
    row = np.zeros(count)
    row[index] = 1.0
    return row


def _fixed_root(estimate: ProfileEstimate) -> FloatArray:
    """Square root of what of the posterior's covariance does not scatter from scan to scan."""
    covariance, random = estimate.covariance, estimate.weighed.gain @ estimate.noise_root
    return _root(covariance - random @ random.T, np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def _root(covariance: FloatArray, scale: FloatArray | None = None) -> FloatArray:
    """A square root of a covariance that may be singular, its rows of the given sizes."""
    if scale is None:
        scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    safe = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(safe, safe))
    return np.asarray(safe[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
