r"""First-order propagation of noise, regularisation and uncertain inputs to A, G and its widths.

A division is linear in the voltages: :math:`A\,G(r)` is the inverse transform of the window times
the smoothed voltages' transform over the reference's.  Method ``bayesian`` is a linear function of
the posterior of the profile's parameters: what scatters from scan to scan is ``noise``, the rest
of the expected squared error ``regularisation``.  All sources are in docs/uncertainty.md.

Inputs add one column each, the change of all results by one standard uncertainty.  An input that
is larger than stated changes the results as voltages would: by :math:`-A\,G\otimes\delta
\sigma_{zz}` for the base stress, by :math:`-U'(R)\,\delta R` for the positions.  A change of the
load scales A; on a film at finite strain it changes the base stress per newton as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from memscal.axisymmetry.hankel import (
    RadialSpectrum,
    bessel_table,
    hankel_transform,
    radial_spline,
    ring_areas,
)
from memscal.calibration.fields import RasterFields, cosine_taper
from memscal.calibration.stages import Deconvolution, Solution
from memscal.deconvolution.widths import kernel_functionals
from memscal.errors import InputError
from memscal.estimation.decorrelation import SlowNoise
from memscal.estimation.forward import ForwardModel
from memscal.estimation.influences import influences, measured_by, signal_by
from memscal.estimation.points import ScanPoints
from memscal.estimation.profile import ProfileEstimate, dynamics_changes
from memscal.estimation.reference_spectra import (
    RECTANGLE,
    carried_force,
    load_sensitivities,
    reference_sensitivities,
)
from memscal.estimation.smoothing import SmoothedProfile
from memscal.estimation.voltage_map import DENSE, VoltageMap, square_root, triangular
from memscal.mechanics.contact import BaseStress
from memscal.model.apparatus import ParameterSet, round_wavenumbers
from memscal.model.arrays import TINY, Arrays, FloatArray, array_record, slices
from memscal.model.assumptions import MOVED
from memscal.model.scan import STATED_ERRORS, Scan
from memscal.model.stress import StressProfile

#: Windows below this have closed.
_CLOSED = 1e-9
#: What sums of squares lose to rounding.
_ROUNDING = 1e-9
#: Columns over many points that are made at a time.
_COLUMNS = 8
#: Parameters whose uncertainty is broken down by source.
BUDGETED = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "fwhm",
    "noise_equivalent_area",
)
#: Parameters of the Gaussian fit, which a shape that is none changes.
_GAUSSIAN_PARAMETERS = (
    "gaussian_sigma",
    "conversion_constant_gaussian",
    "ellipticity",
    "ellipticity_diagonal",
)
CURVATURE = "baseline_curvature"
#: Other scans of one sensor reach from this share of a scan's reach on.
_LEAST_REACH = 0.5
#: Sources that are the same error in every scan at the same positions.
NOT_RANDOM = ("regularisation", "window", "misfit")


@array_record
class InputEffect:
    """What one standard uncertainty of an input does."""

    voltage: FloatArray  # (n,): change of the voltages that it would be mistaken for, in V
    scaling: float = 0.0  # relative change of A beside that
    exact: Solution | None = None  # of the bound, where the first order does not serve


Effects = Mapping[str, InputEffect]
Correlations = Mapping[tuple[str, str], float]
"""Coefficients of the errors of two inputs, by their names."""


def input_effects(
    scans: Sequence[Scan],
    stresses: Sequence[BaseStress],
    estimate: ProfileEstimate,
    alternatives: Sequence[RadialSpectrum] | None = None,
) -> dict[str, InputEffect]:
    """Return the effect of every input whose uncertainty is stated, by its name."""
    model = estimate.model
    changes = reference_sensitivities(scans, model.references)
    # Stated errors are those of the normal stress, not of the shear.
    for i, stress in enumerate(() if estimate.points.order else stresses):
        if isinstance(stress, StressProfile) and stress.sigma_zz_errors is not None:
            errors = hankel_transform(stress.r, stress.sigma_zz_errors, model.k) / stress.load
            blank = [np.zeros_like(errors) for _ in scans]
            changes.setdefault("reference_stress", blank)[i] = errors
    if alternatives:
        pairs = zip(alternatives, model.references, strict=True)
        changes["model_form"] = [RECTANGLE * (other.values - own.values) for other, own in pairs]
    effects = {n: InputEffect(-signal_by(estimate, change)) for n, change in changes.items()}
    by_dynamics = dynamics_changes(estimate, estimate.kernel)
    effects |= {name: InputEffect(-change) for name, change in by_dynamics.items()}
    effects |= _taken_for_granted(scans, estimate) | _load_effects(scans, stresses, estimate)
    varying = _varying_gain(estimate)
    if varying:
        effects["between_repeats"] = InputEffect(np.zeros(estimate.points.u.size), varying)
    if "load" in effects:
        # Beside its scaling: at finite strain a larger load spreads the stress.
        spread = signal_by(estimate, load_sensitivities(scans, model.references))
        effects["load"] = replace(effects["load"], voltage=effects["load"].voltage - spread)
    return effects


def _taken_for_granted(scans: Sequence[Scan], estimate: ProfileEstimate) -> dict[str, InputEffect]:
    """Effects of what scans take for granted, where they state its uncertainty."""
    stated = {}
    for name in STATED_ERRORS:
        u = np.array([getattr(scan, f"{name}_uncertainty") or 0.0 for scan in scans])
        if u.any() and name not in ("gain", CURVATURE, *measured_by(estimate.points)):
            stated[name] = u[estimate.points.scan]
    found = influences(scans, estimate) if stated else {}
    effects = {}
    for name, u in stated.items():
        influence = found.get({"position_scale": "stage_scale"}.get(name, name))
        if influence:
            # The mean of a square is corrected; its standard deviation is left.
            change = u * influence.voltage + 2**0.5 * u**2 * influence.squared
            effects[name] = InputEffect(-change)
    return effects


def _load_effects(
    scans: Sequence[Scan], stresses: Sequence[BaseStress], estimate: ProfileEstimate
) -> dict[str, InputEffect]:
    """Effects of factors: loads, forces of references, and their discretisation."""
    pairs = zip(stresses, estimate.model.references, strict=True)
    shares: dict[str, Sequence[float | None]] = {
        "reference_force": [abs(carried_force(*pair) - 1.0) for pair in pairs],
        "load": [s.load_uncertainty and s.load_uncertainty / s.stated_load for s in scans],
        "gain": [scan.gain_uncertainty for scan in scans],
        "reference_convergence": [stress.convergence for stress in stresses],
    }
    effects = {}
    for source, stated in shares.items():
        if all(share is None for share in stated):
            continue
        by_scan = np.array([share or 0.0 for share in stated])
        apart = (by_scan - by_scan.mean())[estimate.points.scan]
        effects[source] = InputEffect(-apart * estimate.signal, -by_scan.mean())
    return effects


def _varying_gain(estimate: ProfileEstimate) -> float:
    """Relative standard uncertainty of A by gains that vary between repeats of one scan."""
    # By moments, which is the restricted likelihood of repeats that are alike: Hedges, J. Educ.
    # Stat. 8 (1983) 443.  Weights would favour an ordinary gain, which has fewer outliers.
    points = estimate.points
    repeats = np.unique(points.repeat)
    if repeats.size == 1 or points.owner.any():
        return 0.0
    columns = np.column_stack(
        [estimate.signal, estimate.weighed.residual, estimate.model.straight_columns]
    )
    columns = points.standardised(columns, estimate.weights / estimate.noise_scale**2)
    products = []
    for repeat in repeats:
        data, own = np.split(columns[points.repeat == repeat], [2], axis=1)
        data = data - own @ np.linalg.lstsq(own, data)[0]
        products.append(data[:, 0] @ data)
    weight, product = np.transpose(products)
    # A repeat that tells nothing of its gain lets no variation be found.
    weight = np.maximum(weight, 1.0)
    variance = np.var(product / weight, ddof=1) - np.mean(1 / weight)
    return math.sqrt(max(variance, 0.0) / repeats.size)


def correlation_matrix(sources: Sequence[str], correlations: Correlations) -> FloatArray:
    """Return the correlation matrix of inputs, the identity but for the stated pairs."""
    matrix = np.eye(len(sources))
    for pair, coefficient in correlations.items():
        if any(name not in sources for name in pair) or len(set(pair)) != 2:
            raise InputError(
                f"A correlation is given for {' and '.join(map(repr, pair))}.",
                why="It must be between two inputs whose uncertainty is stated.",
                cure=f"Choose from {', '.join(sources) or 'none'}.",
            )
        if not -1 <= coefficient <= 1:
            names = " and ".join(pair)
            raise InputError(f"The correlation of {names} is {coefficient:g}, outside -1 to 1.")
        i, j = (sources.index(name) for name in pair)
        matrix[i, j] = matrix[j, i] = coefficient
    least = np.linalg.eigvalsh(matrix)[0] if sources else 1.0
    if least < -1e-9:
        raise InputError(
            "The correlations of the inputs contradict each other: their matrix has the eigenvalue "
            f"{least:.3g}.",
            why="A covariance is positive semi-definite.",
            cure="Two inputs that both follow a third closely cannot be opposed.",
        )
    return matrix


@array_record
class Results:
    """Everything a calibration states with an uncertainty."""

    parameters: ParameterSet  # scalars with their joint covariance
    changes: Arrays  # (p,) by input: of the parameters, by one uncertainty of it
    budget: Mapping[str, Mapping[str, float]]  # standard uncertainties by parameter and source
    radial_covariance: FloatArray  # (n, n): covariance of G(r), in 1/m^4
    with_constant: FloatArray  # (n,): covariance of G(r) with A
    transfer_errors: FloatArray  # (m,): standard uncertainty of the transfer function
    radial_scatter: FloatArray  # (n,): u of G(r) by noise, baseline and inputs, in 1/m^2
    by_voltage: VoltageMap  # (p, n): derivatives of the parameters
    effective_degrees: Mapping[str, float]  # by parameter, where noise is estimated
    # (n,) by input, where none are correlated: of A G(r) over A by one uncertainty, in 1/m^2
    kernel_changes: Arrays
    shared_effects: Arrays  # (2 + m,) by source, likewise: of ln A, ln sigma and ln(A G)
    division: DivisionMap | None = None  # that was propagated
    field_errors: FloatArray | None = None  # (m, n): of a raster's G over the plane, in 1/m^2


@array_record
class DrawnScatter:
    """Columns of m draws less their mean over sqrt(m - 1): their squares add up to variances."""

    voltages: FloatArray  # (n, m): of the measured points, in V
    parameters: Arrays  # (m,): of each number that the division decides, in SI
    radial: FloatArray  # (p, m): of G at its radii, in 1/m^2
    transfer: FloatArray  # (q, m): of the transfer function at the grid's wavenumbers


@array_record
class _Derivatives:
    """Derivatives of results, one row each, and what the regularisation hides of them."""

    by_voltage: VoltageMap  # (m, n)
    by_state: FloatArray  # (m, p): by the posterior's parameters, beside what voltages do to them
    hidden: FloatArray  # (m, q): columns

    def __getitem__(self, rows: slice) -> _Derivatives:
        return _Derivatives(self.by_voltage[rows], self.by_state[rows], self.hidden[rows])

    def combined(self, rows: FloatArray) -> _Derivatives:
        """Derivatives of sums of the results, by rows (l, m)."""
        return _Derivatives(rows @ self.by_voltage, rows @ self.by_state, rows @ self.hidden)

    @classmethod
    def stacked(cls, parts: Sequence[_Derivatives]) -> _Derivatives:
        """Put the derivatives of several results below each other."""
        return cls(
            VoltageMap.stacked([part.by_voltage for part in parts]),
            np.vstack([part.by_state for part in parts]),
            np.vstack([part.hidden for part in parts]),
        )


def propagate(
    solution: Solution,
    deconvolution: Deconvolution,
    effects: Effects,
    correlations: Correlations,
    drawn: DrawnScatter | None,
) -> Results:
    """Propagate all stated uncertainties to a deconvolution."""
    estimate = solution.estimate
    wavenumbers = solution.fields.grid.wavenumber_axis
    kernel, division = _kernel_derivatives(solution, deconvolution, wavenumbers)
    names, values, parameters = _parameters(estimate, deconvolution, kernel, division)
    derivatives = _Derivatives.stacked([parameters, kernel[1:]])
    by_voltage = derivatives.by_voltage
    curvatures = [names.index(CURVATURE + _suffix(i)) for i in estimate.points.curved]
    columns = {
        "noise": solution.band.excess * estimate.scattered(by_voltage),
        "regularisation": derivatives.by_state @ estimate.hidden_root,
        "window": derivatives.hidden,
        CURVATURE: estimate.curved(by_voltage, curvatures),
    }
    rows = [names.index(name) for name in _GAUSSIAN_PARAMETERS if name in names]
    misfit = _misfit_columns(estimate, by_voltage[rows])
    columns["misfit"] = np.zeros((len(by_voltage), misfit.shape[1]))
    columns["misfit"][rows] = misfit
    if drawn:
        columns["noise"] = _drawn_columns(by_voltage, names, columns["noise"], drawn)
    independent = list(columns.values())
    count = len(names)
    if effects:
        changes = by_voltage @ np.column_stack([effect.voltage for effect in effects.values()])
        # No factor changes G and its transfer, beyond the named numbers.
        scaled = [name.startswith("conversion_constant") for name in names]
        for (source, effect), column in zip(effects.items(), changes.T, strict=True):
            column[:count] += np.where(scaled, values, 0.0) * effect.scaling
            if effect.exact:
                _replace_exactly(column, names, values, deconvolution, effect.exact, wavenumbers)
            columns[source] = column[:, None]
        independent.append(changes @ square_root(correlation_matrix(list(effects), correlations)))
    everything = np.hstack(independent)
    g = deconvolution.g.radial
    stop = count + g.size
    stored = everything[:stop] @ everything[:stop].T
    drawn_again = [columns["noise"], columns[CURVATURE], *(independent[-1:] if effects else [])]
    scatter = np.hstack(drawn_again)
    g_over_a = g / deconvolution.conversion_constant
    kernel_changes = {}
    shared: Arrays = {}
    if not correlations:
        shared = _shared_effects(solution, deconvolution, names, columns)
        for source in effects:
            change = columns[source][:stop, 0]
            kernel_changes[source] = change[count:] + g_over_a * change[0]
    return Results(
        parameters=ParameterSet(names, values, stored[:count, :count]),
        changes={source: columns[source][:count, 0] for source in effects},
        budget={name: _budget(names.index(name), columns, stored) for name in BUDGETED},
        radial_covariance=stored[count:, count:],
        with_constant=stored[count:, 0],
        transfer_errors=np.linalg.norm(everything[stop:], axis=1),
        radial_scatter=np.linalg.norm(scatter[count:stop], axis=1),
        by_voltage=by_voltage[:count],
        effective_degrees=_effective_degrees(estimate, names, columns["noise"], stored),
        kernel_changes=kernel_changes,
        shared_effects=shared,
        division=division,
    )


def _shared_effects(
    solution: Solution, deconvolution: Deconvolution, names: Sequence[str], columns: Arrays
) -> Arrays:
    """Changes of ln A, ln sigma and ln(A G) by each source; of several columns their norm."""
    g = deconvolution.g
    k = round_wavenumbers(solution.band.resolved)
    transform = bessel_table(k, g.r) * ring_areas(g.r)
    transfer = transform @ g.radial
    a, sigma = (names.index(name) for name in MOVED[:2])
    effects = {}
    for source, column in columns.items():
        of_a = column[a] / deconvolution.conversion_constant
        of_sigma = column[sigma] / solution.estimate.gaussian.sigma
        of_g = transform @ column[len(names) : len(names) + g.r.size] / transfer[:, None]
        changes = np.vstack([of_a, of_sigma, of_a + of_g])
        signed = changes.shape[1] == 1
        effects[source] = changes[:, 0] if signed else np.linalg.norm(changes, axis=1)
    return effects


def _effective_degrees(
    estimate: ProfileEstimate, names: Sequence[str], noise: FloatArray, covariance: FloatArray
) -> dict[str, float]:
    """Degrees of freedom of each uncertainty, of which an estimated noise alone has few."""
    # Welch and Satterthwaite: GUM (JCGM 100:2008), G.4.1.
    if estimate.points.noise_stated:
        return {}
    readings = estimate.outlier_weight.sum() + estimate.points.curved.size
    degrees = max(readings - estimate.basis.flat, 1.0)
    if estimate.raster_noise:
        degrees = max(degrees, estimate.raster_noise.degrees)
    variances = np.diag(covariance)[: len(names)]
    shares = np.sum(noise[: len(names)] ** 2, axis=1) / variances
    return dict(zip(names, (degrees / shares**2).tolist(), strict=True))


def slow_noise_text(estimate: ProfileEstimate, slow: SlowNoise, results: Results) -> str:
    """Say what correlation of the noise is found, and what it does to the uncertainties."""
    parameters = results.parameters
    rows = [parameters.names.index(name) for name in MOVED[:2]]
    numbers = results.by_voltage[rows]
    found, white = (
        np.sum(replace(estimate, slow=kind).scattered(numbers) ** 2, axis=1)
        for kind in (slow, None)
    )
    counted = found if estimate.slow else white
    others = np.maximum(np.diag(parameters.covariance)[rows] - counted, 0.0)
    a, sigma = np.sqrt((others + found) / (others + white))
    verb = "makes" if estimate.slow else "is not counted, as the noise is stated, but would make"
    return (
        f"The noise is correlated along the scan with a probability of {slow.probability:.0%}; "
        f"{slow.share:.0%} of its variance would then fall off over {slow.length:.2g} steps. This "
        f"{verb} the uncertainty of A {a:.2f} and that of sigma {sigma:.2f} times as large."
    )


def _replace_exactly(
    column: FloatArray,
    names: Sequence[str],
    values: FloatArray,
    deconvolution: Deconvolution,
    exact: Solution,
    wavenumbers: FloatArray,
) -> None:
    """Put differences from another calibration, over the root of three, for the first order."""
    # Those of centre, baseline and drift stay.
    same = exact.deconvolution.divided == deconvolution.divided
    other = exact.deconvolution if same else exact.other
    assert other
    r = deconvolution.g.r
    fit = exact.estimate.gaussian
    numbers, g = read_off(other, r)
    numbers["gaussian_sigma"] = fit.sigma
    numbers["conversion_constant_gaussian"] = fit.conversion_constant
    for name, value in numbers.items():
        row = names.index(name)
        column[row] = RECTANGLE * (value - values[row])
    change = RECTANGLE * (g - deconvolution.g.radial)
    transfer = bessel_table(wavenumbers, r) * ring_areas(r)
    column[len(names) :] = np.append(change, transfer @ change)


def read_off(result: Deconvolution, radii: FloatArray) -> tuple[dict[str, float], FloatArray]:
    """A and the numbers read off G, and G at other radii (m), zero beyond its support."""
    g = result.g
    read = kernel_functionals(g, result.gaussian_sigma, result.hidden)
    numbers = {functional.name: functional.value for functional in read}
    inside = radial_spline(g.r, g.radial)(np.minimum(radii, g.r[-1]))
    numbers["conversion_constant"] = result.conversion_constant
    return numbers, np.where(radii <= g.r[-1], inside, 0.0)


def expected_values(solution: Solution) -> dict[str, float]:
    """Parameters that scans about the posterior mean give on average, to first order."""
    # A division follows the noise of its scan, of which scans drawn about the mean know nothing.
    deconvolution = solution.deconvolution
    kernel, division = _kernel_derivatives(solution, deconvolution, np.zeros(0))
    names, values, derivatives = _parameters(solution.estimate, deconvolution, kernel, division)
    noise = derivatives.by_voltage @ (solution.estimate.points.u - drawn_about(solution))
    return dict(zip(names, (values - noise).tolist(), strict=True))


def drawn_about(solution: Solution) -> FloatArray:
    """Voltages (n,), in V, about which scans are drawn: the prediction of the best estimate."""
    deconvolution = solution.deconvolution
    return solution.estimate.predicted if deconvolution.divided else deconvolution.predicted


def _budget(row: int, columns: Arrays, covariance: FloatArray) -> dict[str, float]:
    """Contribution of each source; of correlations with the sign of what they add."""
    budget = {source: float(np.linalg.norm(column[row])) for source, column in columns.items()}
    variance = covariance[row, row]
    excess = variance - sum(u**2 for u in budget.values())
    if abs(excess) > _ROUNDING * variance:
        budget["correlations"] = math.copysign(math.sqrt(abs(excess)), excess)
    return budget


def _parameters(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    kernel: _Derivatives,
    division: DivisionMap | None,
) -> tuple[tuple[str, ...], FloatArray, _Derivatives]:
    """Names, values and derivatives of the parameters, in the order in which they are reported."""
    fit = estimate.gaussian
    g = deconvolution.g
    radial = kernel[1 : 1 + g.r.size]
    functionals = kernel_functionals(g, deconvolution.gaussian_sigma, deconvolution.hidden)
    widths = radial.combined(np.stack([functional.row for functional in functionals]))
    if division:
        lost = functionals[1].row @ division.lost[1 : 1 + g.r.size]
        lost[0] -= functionals[1].row @ deconvolution.hidden
        widths = _corrected_full_width(widths, lost, estimate)
        # What a window hides of G adds to the integral of its square by its own square.
        whole = g.radial + radial.hidden[:, 0]
        area = 1 / np.sum(ring_areas(g.r) * whole**2)
        widths.hidden[-1, 0] = area - functionals[-1].value
    # A round departure beside an ellipse would be read as less of width and ellipticity.
    gain = fit.gain(estimate.weights)
    ellipse = estimate.points.ellipse
    nuisances, scale = _nuisances(estimate.points)
    count = len(scale)
    shape = [1, *range(len(gain) - ellipse, len(gain))]
    nuisance = _fitted(kernel, estimate.weighed.gain[2 : 2 + count] * scale)
    nuisance.by_state[:, 2 : 2 + count] = np.diag(scale)
    parts = [kernel[:1], _fitted(kernel, gain[shape]), widths, nuisance, _fitted(kernel, gain[:1])]
    values = [
        deconvolution.conversion_constant,
        fit.sigma,
        *fit.ellipticity[:ellipse],
        *(functional.value for functional in functionals),
        *scale * np.append(estimate.centres[estimate.points.free], estimate.drifts),
        fit.conversion_constant,
    ]
    names = (
        "conversion_constant",
        "gaussian_sigma",
        *_GAUSSIAN_PARAMETERS[2 : 2 + ellipse],
        *(functional.name for functional in functionals),
        *nuisances,
        "conversion_constant_gaussian",
    )
    return names, np.array(values), _Derivatives.stacked(parts)


def _fitted(kernel: _Derivatives, by_voltage: VoltageMap) -> _Derivatives:
    """Derivatives of parameters that no regularisation touches."""
    count = len(by_voltage)
    states = np.zeros((count, kernel.by_state.shape[1]))
    return _Derivatives(by_voltage, states, np.zeros((count, kernel.hidden.shape[1])))


def _corrected_full_width(
    widths: _Derivatives, lost: FloatArray, estimate: ProfileEstimate
) -> _Derivatives:
    """Derivatives of widths of which the second is less what a window adds, (1 + p,), to it."""
    # It is corrected by the estimate, with whose noise it scatters.
    corrected = np.zeros((len(widths.by_voltage), lost.size - 1))
    corrected[1] = lost[1:]
    by_voltage = widths.by_voltage + corrected @ estimate.weighed.gain
    hidden = widths.hidden.copy()
    fixed = lost[1:] @ estimate.fixed_root
    hidden[1] = 0.0
    hidden[1, 0] = lost[0]
    hidden[1, hidden.shape[1] - fixed.size :] = fixed
    return replace(widths, by_voltage=by_voltage, hidden=hidden)


def _suffix(scan: int) -> str:
    """Ending of the names of a scan's parameters: of the second ``_2``."""
    return f"_{scan + 1}" if scan else ""


def _nuisances(points: ScanPoints) -> tuple[list[str], FloatArray]:
    """Names of centre, baseline, drift and curvature of each scan, and their scale."""
    free = points.free
    suffixes = [_suffix(i) for i in range(len(free))]
    names = [("centre", "centre_y")[axis] + suffixes[i] for i, axis in np.argwhere(free)]
    for directions, suffix in zip(free, suffixes, strict=True):
        names.append("baseline" + suffix)
        names += [("drift", "drift_y")[axis] + suffix for axis in np.flatnonzero(directions)]
    names += [CURVATURE + _suffix(i) for i in points.curved]
    # The drift is stated across the whole range; its coefficient spans half of it.
    scales = [2.0 if name.startswith("drift") else 1.0 for name in names]
    return names, np.array(scales)


def _kernel_derivatives(
    solution: Solution, deconvolution: Deconvolution, wavenumbers: FloatArray
) -> tuple[_Derivatives, DivisionMap | None]:
    """Derivatives of A, G at its radii and its transfer function by either route."""
    estimate = solution.estimate
    if not deconvolution.divided or not solution.smoothed:
        return _posterior_kernel(estimate, deconvolution, wavenumbers), None
    division = _division_map(solution, solution.smoothed, deconvolution, wavenumbers)
    # Centre, baseline and drift are parameters of the estimate.
    by_nuisance = -(division.direct @ division.nuisance)
    by_state = np.zeros((len(by_nuisance), estimate.basis.integrals.size))
    by_state[:, division.places] = by_nuisance
    spread = division.lost[:, 1:] @ square_root(estimate.weighed.covariance)
    by_voltage = division.direct + by_nuisance @ estimate.weighed.gain[division.places]
    # The last columns are what the estimate leaves unknown of what is corrected.
    corrected = np.zeros((len(spread), estimate.fixed_root.shape[1]))
    hidden = np.hstack([division.lost[:, :1], spread, corrected])
    return _Derivatives(by_voltage, by_state, hidden), division


def _posterior_kernel(
    estimate: ProfileEstimate, deconvolution: Deconvolution, wavenumbers: FloatArray
) -> _Derivatives:
    """Derivatives of A, G and its transfer function, by the posterior's parameters."""
    from scipy.interpolate import make_interp_spline

    basis = estimate.basis
    k = estimate.model.k
    a = deconvolution.conversion_constant
    r = deconvolution.g.r
    # Normalised: a change of A G by dK changes G by (dK - G dA) / A.
    normalised = (basis.kernels(k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    radial = (basis.radial(r) - np.outer(estimate.radial(r) / a, basis.integrals)) / a
    transfer = make_interp_spline(k, normalised, k=1)(np.clip(wavenumbers, k[0], k[-1]))
    rows = np.vstack([basis.integrals, radial, transfer])
    return _Derivatives(rows @ estimate.weighed.gain, rows, np.zeros((len(rows), 0)))


@array_record
class DivisionMap:
    """A division of fields as a linear map from voltages less background to A, G and transfer."""

    direct: VoltageMap  # (m, n): of voltages, for given centre, baseline and drift
    nuisance: FloatArray  # (n, q): voltages by free centres, baselines and drifts
    kept: FloatArray  # (m, 1 + p): what voltages of the posterior mean, and by its parameters, give
    lost: FloatArray  # (m, 1 + p): what the division hides of these
    places: slice  # of centres, baselines and drifts among the posterior's parameters


def _division_map(
    solution: Solution,
    smoothed: SmoothedProfile,
    deconvolution: Deconvolution,
    wavenumbers: FloatArray,
) -> DivisionMap:
    estimate = solution.estimate
    fields = solution.fields
    model = estimate.model
    a = deconvolution.conversion_constant
    r = deconvolution.g.r
    reference = model.reference
    window = deconvolution.quotient.window[0]
    window = np.interp(model.k, fields.grid.wavenumber_axis, window, right=0.0)
    # Where the window has closed the reference may have vanished.
    ratio = np.divide(window, reference.values, out=np.zeros_like(window), where=window > _CLOSED)
    weights = reference.wavenumbers.weights * ratio
    synthesis = cosine_taper(r, fields.support)[:, None] * bessel_table(r, model.k) * weights
    rings = ring_areas(r)

    # From changes of A G at its radii to those of A, G and its transfer function.
    by_radius = (np.eye(r.size) - np.outer(deconvolution.g.radial, rings)) / a
    normalised = np.vstack([rings, by_radius, (bessel_table(wavenumbers, r) * rings) @ by_radius])
    gain = fields.gain(smoothed) if isinstance(fields, RasterFields) else smoothed.gain
    direct = normalised @ synthesis @ gain
    geometry = model.geometry(estimate.centres)
    nuisance = np.hstack([model.centre_derivative(geometry, estimate.kernel), model.drift_columns])
    kernels = np.column_stack([estimate.kernel, estimate.basis.kernels(model.k)])
    count = kernels.shape[1] if estimate.points.u.size <= DENSE else _COLUMNS
    chunks = slices(kernels.shape[1], count)
    # The fields that are divided are those of a still sensor.
    still = ForwardModel(estimate.points, model.references) if estimate.points.in_motion else model
    at = still.geometry(estimate.centres)
    signals = (still.signal(at, kernels[:, chunk]) for chunk in chunks)
    kept = np.hstack([direct @ voltages for voltages in signals])
    radial = np.column_stack([estimate.radial(r), estimate.basis.radial(r)])
    places = slice(2, 2 + nuisance.shape[1])
    return DivisionMap(direct, nuisance, kept, normalised @ radial - kept, places)


def route_difference(solution: Solution, division: DivisionMap | None) -> float | None:
    """Difference of division and Bayesian estimate beyond what the former hides, over its size."""
    # Of the division of the Bayesian fit's residuals: A's in standard deviations, or the root of
    # G's squared integral over its expectation, if that is larger.
    estimate = solution.estimate
    if not (division and solution.comparable):
        return None
    divided = solution.deconvolution if solution.deconvolution.divided else solution.other
    assert divided
    rings = ring_areas(divided.g.r)
    # A and G, without the transfer function.
    direct = division.direct[: 1 + rings.size]
    moved = division.kept[: 1 + rings.size, 1:].copy()
    moved[:, division.places] += direct @ division.nuisance
    noise = estimate.scattered(direct - moved @ estimate.weighed.gain)
    difference = direct @ (estimate.points.u - estimate.predicted)
    variance = np.sum(np.hstack([noise, moved @ estimate.fixed_root]) ** 2, axis=1)
    in_g = np.sqrt((rings @ difference[1:] ** 2) / (rings @ variance[1:]))
    return float(max(abs(difference[0]) / np.sqrt(variance[0]), in_g))


def _drawn_columns(
    by_voltage: VoltageMap, names: tuple[str, ...], noise: FloatArray, drawn: DrawnScatter
) -> FloatArray:
    """Scatter of repeated draws in place of the first-order noise of what the division decides."""
    columns = by_voltage @ drawn.voltages
    # What no division decides keeps its size to first order, and is correlated as the draws are.
    size = np.maximum(np.linalg.norm(columns, axis=1), TINY)
    columns *= (np.linalg.norm(noise, axis=1) / size)[:, None]
    for name, column in drawn.parameters.items():
        columns[names.index(name)] = column
    columns[len(names) :] = np.vstack([drawn.radial, drawn.transfer])
    return columns


def _misfit_columns(estimate: ProfileEstimate, gain: VoltageMap) -> FloatArray:
    """Changes of numbers of the Gaussian fit with the reach of its scans; mean square: sum."""
    # The sandwich of a misspecified model: White, Econometrica 50 (1982) 1; Conley, J. Econometrics
    # 92 (1999) 1.
    points = estimate.points
    distance = estimate.distance
    reach = np.array([distance[points.scan == i].max() for i in range(points.scans)])
    share = distance / reach[points.scan]
    inwards = np.argsort(-share)
    misfit = estimate.predicted - estimate.gaussian.predicted
    changes = np.cumsum((gain.dense() * misfit)[:, inwards], axis=1)
    # From the least reach to the full one, each change holds until the next point is left out.
    ends = np.clip(np.append(share[inwards], 0.0), _LEAST_REACH, 1.0)
    changes *= np.sqrt(-np.diff(ends) / (1 - _LEAST_REACH))
    return triangular(changes.T).T
