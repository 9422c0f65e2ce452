r"""First-order propagation of noise, regularisation and uncertain inputs to A, G and its widths.

Every result is a linear function of the posterior of the profile's parameters (:math:`w`) and of
the Gaussian fit's (:math:`f`).  What scatters from scan to scan, by their derivatives by the
voltages, is ``noise``; the rest of the expected squared error of :math:`w` is ``regularisation``,
with what a window hides beyond it.  Inputs add one column each, the change of all results by one
standard uncertainty.  An input that is larger than stated changes the estimate as voltages would:
by :math:`-A\,G\otimes\delta\sigma_{zz}` for the base stress, by :math:`-U'(R)\,\delta R` for the
positions.  A change of the load scales A alone.  Numbers read off G(r) are functionals of it:
their derivative is a row that multiplies a change of G.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import j0

from memscal.axisymmetry.hankel import RadialSpectrum, hankel_transform, radial_spline, ring_areas
from memscal.axisymmetry.kernels import unit_gaussian, unit_gaussian_slope
from memscal.calibration.stages import Deconvolution, FieldNoise
from memscal.deconvolution.fourier_ratio import Field
from memscal.errors import InputError
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference import carried_force, film_sensitivities, rod_sensitivities
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

#: Points per step of the profile between which the half maximum is interpolated.
_FINE = 20
#: Two models differ by a bound, anywhere within which the truth may lie: a rectangle.
_RECTANGLE = 1 / np.sqrt(3)
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
class DrawnScatter:
    """Columns of m draws less their mean over sqrt(m - 1): their squares add up to variances."""

    voltages: FloatArray  # (n, m): of the measured points, in V
    parameters: Mapping[str, FloatArray]  # (m,): of each number that the division decides, in SI
    radial: FloatArray  # (p, m): of G at its radii, in 1/m^2
    transfer: FloatArray  # (q, m): of the transfer function at the grid's wavenumbers


@dataclass(frozen=True, eq=False)
class _Rows:
    """Derivatives by (w, f) of the parameters, G and the transfer function, and what is hidden."""

    names: tuple[str, ...]  # of the parameters
    values: FloatArray
    radii: int
    matrix: FloatArray
    hidden: FloatArray
    opened: FloatArray  # rows of G as it is stored, through the window

    @property
    def stored(self) -> int:
        """How many results have a covariance: parameters and G."""
        return len(self.names) + self.radii


def propagate(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    window: FloatArray,
    wavenumbers: FloatArray,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
    raster: FieldNoise | None = None,
    drawn: DrawnScatter | None = None,
) -> Results:
    """Propagate all stated uncertainties: ``window`` at the nodes, ``wavenumbers`` in rad/m."""
    rows = _rows(estimate, deconvolution, window, wavenumbers)
    random, fixed = _noise_roots(estimate)
    noise = rows.matrix @ random
    columns = {
        "noise": noise if drawn is None else _drawn_columns(rows, estimate, noise, drawn),
        "regularisation": rows.matrix @ fixed,
        "window": rows.hidden[:, None],
    }
    if raster is not None:
        columns["raster_noise"] = _raster_columns(rows, deconvolution, raster)
    independent = list(columns.values())
    columns |= {name: _input_column(rows, estimate, effect) for name, effect in effects.items()}
    if effects:
        together = np.hstack([columns[name] for name in effects])
        joined = _root(correlation_matrix(list(effects), correlations))
        independent.append(together @ joined)
    everything = np.hstack(independent)
    stored = everything[: rows.stored] @ everything[: rows.stored].T
    count = len(rows.names)
    scatter = [rows.opened @ random[: rows.opened.shape[1]] if drawn is None else drawn.radial]
    if effects:
        moved = estimate.weighed.gain @ np.stack([e.voltage for e in effects.values()], axis=1)
        scatter.append(rows.opened @ moved @ joined)
    if raster is not None:
        scatter.append(raster.radial)
    return Results(
        parameters=ParameterSet(rows.names, rows.values, stored[:count, :count]),
        budget={name: _budget(rows, columns, stored, name) for name in BUDGETED},
        radial_covariance=stored[count:, count:],
        cross_covariance=stored[count:, :count],
        transfer_errors=np.linalg.norm(everything[rows.stored :], axis=1),
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


def _input_column(rows: _Rows, estimate: ProfileEstimate, effect: InputEffect) -> FloatArray:
    gain = np.vstack([estimate.weighed.gain, estimate.gaussian_gain])
    column = rows.matrix @ (gain @ effect.voltage)
    scales = np.array([name.startswith("conversion_constant") for name in rows.names])
    column[: scales.size] += np.where(scales, rows.values, 0.0) * effect.scaling
    return np.asarray(column[:, None])


def _rows(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    window: FloatArray,
    wavenumbers: FloatArray,
) -> _Rows:
    basis, k = estimate.basis, estimate.model.k
    a, r = deconvolution.conversion_constant, deconvolution.g.r
    fitted = estimate.gaussian.jacobian.shape[1]
    # Normalised: a change of A G by dK changes G by (dK - G dA) / A.
    synthesis = j0(np.multiply.outer(r, k)) * estimate.model.reference.wavenumbers.weights
    normalised = (basis.kernels(k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    radial = (basis.radial(r) - np.outer(estimate.radial(r) / a, basis.integrals)) / a
    transfer = _interpolated(wavenumbers, k, normalised)
    hidden = (1 - window) * estimate.kernel / a
    hidden_radial = synthesis @ hidden
    opened = radial - synthesis @ ((1 - window)[:, None] * normalised)
    functionals = kernel_functionals(deconvolution.g, deconvolution.gaussian_sigma)
    scalars, names, values = _scalar_rows(estimate, deconvolution, functionals, opened)
    hidden_scalars = np.zeros(len(names))
    for functional in functionals:
        hidden_scalars[names.index(functional.name)] = functional.row @ hidden_radial
    return _Rows(
        names=names,
        values=values,
        radii=r.size,
        matrix=np.vstack([scalars, np.pad(np.vstack([radial, transfer]), ((0, 0), (0, fitted)))]),
        hidden=np.concatenate([hidden_scalars, hidden_radial, np.interp(wavenumbers, k, hidden)]),
        opened=opened,
    )


def _interpolated(places: FloatArray, nodes: FloatArray, columns: FloatArray) -> FloatArray:
    """Interpolate every column linearly, its ends continued: np.interp for all at once."""
    left = np.clip(np.searchsorted(nodes, places) - 1, 0, nodes.size - 2)
    share = np.clip((places - nodes[left]) / (nodes[left + 1] - nodes[left]), 0.0, 1.0)[:, None]
    return np.asarray((1 - share) * columns[left] + share * columns[left + 1])


def _scalar_rows(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    functionals: tuple[Functional, ...],
    opened: FloatArray,
) -> tuple[FloatArray, tuple[str, ...], FloatArray]:
    count, fitted = estimate.basis.integrals.size, estimate.gaussian.jacobian.shape[1]
    gaussian = estimate.gaussian
    entries: list[tuple[str, float, FloatArray, int]] = [
        ("conversion_constant", deconvolution.conversion_constant, estimate.basis.integrals, 0),
        ("gaussian_sigma", gaussian.sigma, _unit(fitted, 1), count),
        *_ellipse(estimate),
        *((f.name, f.value, f.row @ opened, 0) for f in functionals),
        *_nuisances(estimate),
        ("conversion_constant_gaussian", gaussian.conversion_constant, _unit(fitted, 0), count),
    ]
    rows = np.zeros((len(entries), count + fitted))
    for row, (_, _, derivative, first) in zip(rows, entries, strict=True):
        row[first : first + derivative.size] = derivative
    return rows, tuple(e[0] for e in entries), np.array([e[1] for e in entries])


def _nuisances(estimate: ProfileEstimate) -> list[tuple[str, float, FloatArray, int]]:
    """Centre, baseline and drift of each scan; the second scan's end in ``_2``, and so on."""
    count, free = estimate.basis.integrals.size, estimate.points.free
    centres = [("centre", "centre_y")[axis] + _number(scan) for scan, axis in np.argwhere(free)]
    drifts: list[tuple[str, float]] = []
    for scan, directions in enumerate(free):
        # The drift is stated across the whole range; its coefficient spans half of it.
        along = [("drift", "drift_y")[axis] for axis in np.flatnonzero(directions)]
        drifts += [("baseline" + _number(scan), 1.0), *((n + _number(scan), 2.0) for n in along)]
    entries = [
        (name, float(value), _unit(count, 2 + i), 0)
        for i, (name, value) in enumerate(zip(centres, estimate.centres[free], strict=True))
    ]
    first = 2 + len(centres)
    for i, ((name, scale), value) in enumerate(zip(drifts, estimate.drifts, strict=True)):
        entries.append((name, scale * float(value), scale * _unit(count, first + i), 0))
    return entries


def _ellipse(estimate: ProfileEstimate) -> list[tuple[str, float, FloatArray, int]]:
    """The Gaussian's ellipticity: a round departure beside it would be read as less of both."""
    count, fitted = estimate.basis.integrals.size, estimate.basis.flat
    names, values = ("ellipticity", "ellipticity_diagonal"), estimate.gaussian.ellipticity
    first = fitted - estimate.points.ellipse
    return [
        (names[i], float(values[i]), _unit(fitted, first + i), count)
        for i in range(estimate.points.ellipse)
    ]


def _number(scan: int) -> str:
    return "" if scan == 0 else f"_{scan + 1}"


def _raster_columns(rows: _Rows, deconvolution: Deconvolution, raster: FieldNoise) -> FloatArray:
    """Noise of a measured field: a column for A, then those of G, then each of the transfer's."""
    count, components = len(rows.names), raster.transfer.size
    columns = np.zeros((rows.hidden.size, 1 + raster.radial.shape[1] + components))
    columns[rows.names.index("conversion_constant"), 0] = raster.conversion_constant
    inner = slice(1, 1 + raster.radial.shape[1])
    for functional in kernel_functionals(deconvolution.g, deconvolution.gaussian_sigma):
        columns[rows.names.index(functional.name), inner] = functional.row @ raster.radial
    columns[count : rows.stored, inner] = raster.radial
    columns[rows.stored :, inner.stop :] = np.diag(raster.transfer)
    return columns


def _drawn_columns(
    rows: _Rows, estimate: ProfileEstimate, noise: FloatArray, drawn: DrawnScatter
) -> FloatArray:
    """Scatter of repeated draws in place of the first-order noise of what the division decides."""
    gain = np.vstack([estimate.weighed.gain, estimate.gaussian_gain])
    columns = rows.matrix @ (gain @ drawn.voltages)
    # What no division decides keeps its size to first order, and is correlated as the draws are.
    size = np.maximum(np.linalg.norm(columns, axis=1), np.finfo(float).tiny)
    columns *= (np.linalg.norm(noise, axis=1) / size)[:, None]
    for name, column in drawn.parameters.items():
        columns[rows.names.index(name)] = column
    columns[len(rows.names) : rows.stored] = drawn.radial
    columns[rows.stored :] = drawn.transfer
    return np.asarray(columns)


def _unit(count: int, index: int) -> FloatArray:
    row = np.zeros(count)
    row[index] = 1.0
    return row


def _noise_roots(estimate: ProfileEstimate) -> tuple[FloatArray, FloatArray]:
    """Square roots of the joint covariance of (w, f): what scatters, and what does not."""
    # A Gaussian fit has no prior: all of its error scatters.
    covariance, random = estimate.covariance, estimate.weighed.gain @ estimate.noise_root
    fitted = estimate.gaussian_gain @ estimate.noise_root
    fixed = _root(covariance - random @ random.T, np.sqrt(np.maximum(np.diag(covariance), 0.0)))
    return np.vstack([random, fitted]), np.pad(fixed, ((0, fitted.shape[0]), (0, 0)))


def _root(covariance: FloatArray, scale: FloatArray | None = None) -> FloatArray:
    """A square root of a covariance that may be singular, its rows of the given sizes."""
    if scale is None:
        scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    safe = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(safe, safe))
    return np.asarray(safe[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
