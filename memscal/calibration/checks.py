"""Quality checks of a calibration: value, limit, and what a failure means."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.special import chdtrc, fdtri, logsumexp

from memscal.axisymmetry.hankel import ring_areas
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.calibration.fields import RasterFields
from memscal.calibration.stages import Solution
from memscal.calibration.uncertainty import DivisionMap, Results, route_difference, slow_noise_text
from memscal.estimation import model_tests
from memscal.estimation.band import RESOLVED
from memscal.estimation.bayesian import HYPOTHESES, Bayesian
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference_spectra import carried_force
from memscal.estimation.residuals import (
    FEWEST_RESIDUALS,
    TestOutcome,
    chi_square_test,
    free_model,
    neighbour_correlation_test,
    pure_error_test,
    residuals_of,
    ring_test,
    scatter_of_means,
    steps_test,
)
from memscal.estimation.runs import compare_runs, hysteresis_test
from memscal.estimation.slow_noise import slow_noise
from memscal.mechanics.press_rod import press_rod
from memscal.model.apparatus import ParameterSet
from memscal.model.assumptions import Assumption
from memscal.model.checks import (
    FALSE_ALARM,
    NOISE_LIMIT,
    QualityCheck,
    added_check,
    check,
    chi_square_limit,
    noise_check,
    outlier_check,
)
from memscal.model.film import LINEAR
from memscal.model.notation import format_measured

_Checks = Iterator[QualityCheck]

#: The Bayes factor of a Gaussian sensor has mean one, and exceeds a thousand at most once in a
#: thousand (Markov's inequality).
_LOG_BAYES_LIMIT = -math.log(FALSE_ALARM)
_EDGE = "an edge: a flat top with steep flanks, as of a disc"
_KINDS = {
    **dict.fromkeys(("edge", "rough edge", "disc"), _EDGE),
    **dict.fromkeys(("core", "ring"), "a core of its own: a ring or a spike in the middle"),
    **dict.fromkeys(("tail", "wide tail"), "tails that fall more slowly than a Gaussian's"),
    "plane": "a shape that is free in the plane",
}


#: Exceeded by at most one good scan in a thousand: by 2 of 3600 simulated of Gaussians, a disc and
#: tails at 0.1, 0.5 and 2 % noise, both of unstated noise (tests/accuracy/test_division.py).
_ROUTES_LIMIT = 3.2
#: Full width of a Gaussian at half of its maximum, over its standard deviation.
_HALF_WIDTH = math.sqrt(8 * math.log(2))
#: At this share of the thickness the base stress of a neo-Hookean film differs by a tenth.
_DEEP = 0.1
#: Of 1000 curvatures as their prior has them one is beyond; the noise hides less of it than all.
_CURVED = 3.3
_LEAST_FOUND = 1e-3
_BEYOND = 1.5
#: Offsets of scans and repeats that differ by less of the largest signal are usual.
_OFFSET = 0.02
_WIDTHS = ("gaussian_sigma", "gaussian_sigma_deconvolved")
_MOST_NAMED = 12
#: A lobe of G counts beyond so many standard uncertainties, and from this share of its largest.
_SURE = 4.0
_LOBE = 0.05
#: Degrees of freedom of a noise that is stated.
_WELL_KNOWN = 1e9


def quality_checks(
    solution: Solution,
    results: Results,
    other: Results | None,
    assumed: Sequence[Assumption],
) -> _Checks:
    """Run every check that applies to the scan; ``other``: results by the other route."""
    division = results.division or (other.division if other else None)
    estimate = solution.estimate
    yield from _reconvolutions(solution)
    yield from _constraint(solution)
    yield from _agreement(solution, results, division)
    yield from _shape(solution, results.parameters)
    yield from _field_shape(solution, results)
    yield from _set_up(solution)
    yield from _indentation(solution, results, assumed)
    yield from _unexplained(estimate, results)
    yield _bayes_factor(estimate)
    yield _symmetry(estimate)
    yield from _steadiness(solution)
    yield from _held_out(estimate)
    yield from _saturation(estimate)


def _reconvolutions(solution: Solution) -> _Checks:
    removed = (
        "the posterior mean of G misses something that the scan shows"
        if isinstance(solution.method, Bayesian)
        else "the regularisation has removed something that the scan shows (see method bayesian)"
    )
    fitted = solution.gaussian_misfit
    degrees = fitted.degrees
    p_value = None
    if solution.estimate.points.noise_stated:
        p_value = float(chdtrc(degrees, fitted.chi2_reduced * degrees))
    # Both are of the same points; the noise is stated, or is known by degrees of its own.
    limit = chi_square_limit(degrees)
    noise = solution.estimate.raster_noise
    if noise:
        # What the noise was estimated from is a part of the misfit: the rest of it is independent.
        rest = max(degrees - noise.degrees, 1.0)
        limit = noise.degrees + rest * float(fdtri(rest, noise.degrees, 1 - FALSE_ALARM))
    limit /= degrees
    yield check(
        "reconvolution",
        solution.deconvolution.misfit.chi2_reduced,
        limit,
        "Reduced chi-square of the scan against the G found, convolved with the reference. A "
        f"failure means that {removed}, or that the scan is no convolution of the reference: "
        "look at chi_square, which does not depend on G.",
    )
    yield check(
        "gaussian_misfit",
        fitted.chi2_reduced,
        limit,
        "Reduced chi-square of the scan against the fitted Gaussian convolved with the reference. "
        "A failure means that G is not Gaussian at this noise, or that something is not as stated.",
        p_value,
    )


def _constraint(solution: Solution) -> _Checks:
    """Compare a G that was kept from falling below zero, or from rising, with the free one."""
    estimate = solution.estimate
    method = solution.method
    if not (isinstance(method, Bayesian) and (method.nonnegative or method.monotone)):
        return
    points = estimate.points
    weights = estimate.weights / estimate.noise_scale**2
    kept = points.standardised(points.u - solution.deconvolution.predicted, weights)
    free = points.standardised(points.u - estimate.predicted, weights)
    rise = float(kept @ kept - free @ free)
    # As many combinations of departures as the scan determines, and as a constraint may remove.
    determined = free_model(estimate).design.shape[1]
    determined -= estimate.gaussian.jacobian.shape[1]
    yield check(
        "constraint",
        max(rise, 0.0),
        chi_square_limit(max(determined, 1)),
        "Rise of chi-square by the constraint on G (nonnegative, monotone) over the free "
        "estimate. A failure means that the scan contradicts it: leave it out.",
    )


def _agreement(solution: Solution, results: Results, division: DivisionMap | None) -> _Checks:
    """Compare the results of both routes, and the width of G with the one fitted to the scan."""
    difference = route_difference(solution, division)
    if difference is not None:
        yield check(
            "method_agreement",
            difference,
            _ROUTES_LIMIT,
            "Difference of the division of the fields from the Bayesian estimate, in A or in G(r), "
            "beyond what the window hides, over what noise explains. A failure means that the "
            "scan shows a feature that the one follows and the other does not, or that the method "
            "failed: look at the residuals and at both G(r).",
        )
    route = "by division of the fields" if solution.deconvolution.divided else "in data space"
    widths = results.parameters.only(_WIDTHS)
    fitted, deconvolved = widths.values
    # The misfit is what is looked for: no allowance is made for it.
    misfit = results.budget["gaussian_sigma"]["misfit"]
    variance = float([1, -1] @ widths.covariance @ [1, -1]) - misfit**2
    # Differences below a fifth of a percent are negligible, however small their noise.
    allowed = np.hypot(np.sqrt(max(variance, 0.0)), 0.002 * fitted)
    yield check(
        "width_agreement",
        abs(deconvolved - fitted) / allowed,
        3.0,
        f"Difference of the width of G {route} from the one fitted to the scan, in its standard "
        "uncertainty. A failure means that G is not Gaussian, or something not as stated, "
        "so that its width depends on how it is read off. Look at both reconvolutions.",
    )


def _shape(solution: Solution, parameters: ParameterSet) -> _Checks:
    """Look for what divisions that went wrong do to G: spikes, lobes and ripples."""
    g = solution.deconvolution.g
    ratios = [parameters["fwhm"] / (_HALF_WIDTH * parameters[name]) for name in _WIDTHS]
    widest = max(max(ratio, 1 / ratio) for ratio in ratios)
    share = ring_areas(g.r) * g.radial
    negative = np.maximum(-share, 0.0).sum() / abs(share).sum()
    k, modulus = solution.transfer
    power = k * modulus**2
    end = max(solution.band.resolved, solution.band.relevant, 2 / solution.estimate.gaussian.sigma)
    rough = power[k > _BEYOND * end].sum() / power.sum()
    cure = "take method white-noise or bayesian, or more regularisation"
    # 2.5 by simulation, docs/checks.md: beyond sound results, in which G may be a disc or a ring.
    yield check(
        "shape_width",
        widest,
        2.5,
        "Full width at half maximum of the deconvolved G over that of a Gaussian, of the one "
        "fitted to the scan or the one nearest to G, or the inverse, whichever is largest. A "
        f"failure means that G is a spike, or has lobes far out: {cure}.",
    )
    yield check(
        "shape_negative",
        negative,
        0.4,
        "Share of the integral of |G| over its support where G is negative. A failure means "
        f"that G consists of ripples: {cure}.",
    )
    yield check(
        "shape_roughness",
        rough,
        0.1,
        f"Share of the power of G at wavenumbers beyond {_BEYOND * end * 1e-3:.3g} rad/mm, "
        f"{_BEYOND:g} times those that the scan determines. A failure means that G's detail is "
        f"noise: {cure}.",
    )


def _field_shape(solution: Solution, results: Results) -> _Checks:
    """Look over the plane, of a raster, for lobes of G and for residuals that are no noise."""
    fields = solution.fields
    estimate = solution.estimate
    if not isinstance(fields, RasterFields) or not fields.index[0].size:
        return
    g = solution.deconvolution.g.image
    if results.field_errors is not None:
        # Farther out G is tapered to zero.
        inside = solution.deconvolution.g.grid.radius < fields.support / 2
        lobe = np.max((-g - _SURE * results.field_errors[1])[inside]) / g.max()
        yield check(
            "field_lobes",
            max(lobe, 0.0),
            _LOBE,
            f"Depth of the deepest lobe of G over the plane beyond {_SURE:g} standard "
            "uncertainties, over the largest G. A failure means that G has ripples that its "
            "uncertainty does not count: look at the field of G, and take method bayesian.",
        )
    left = estimate.outlier_weight * (estimate.points.u - estimate.predicted)
    noise = solution.band.excess * estimate.outlier_weight**0.5 * estimate.noise
    degrees = estimate.raster_noise.degrees if estimate.raster_noise else _WELL_KNOWN
    yield _tested(
        "field_residuals",
        ring_test(left, noise, fields.index, degrees),
        "Power of the Bayesian fit's residuals over the plane in one ring of wavenumbers, over "
        "that of the noise: the ring where chance makes it least likely. A failure means that the "
        "form of G leaves a structure of the scan, and that the baseline, with it A, is drawn "
        "along: a sensor or reference of another form, or an error that neighbours share. Look "
        "at the map of the residuals.",
    )


def _set_up(solution: Solution) -> _Checks:
    """Film, band, reach, baseline, force and outliers."""
    estimate = solution.estimate
    film = solution.scan.film
    sigma = estimate.gaussian.sigma
    source = solution.stress.form is not None
    if film and not source:
        yield check(
            "width_over_thickness",
            sigma / film.thickness,
            3.0,
            "Width of G over the film's thickness. A failure means that the unit of the positions "
            "or of the film's thickness should be looked at.",
        )
    resolved = solution.band.resolved
    yield check(
        "resolved_band",
        float(gaussian_transfer(np.array(resolved), sigma)),
        0.5,
        "Transfer function of the fitted Gaussian at the resolved wavenumber, here "
        f"{resolved * 1e-3:.3g} rad/mm: up to there, the posterior standard uncertainty of "
        f"G's transfer function is less than 1/{RESOLVED:g} of it, whatever the method of "
        "division; beyond, G is determined by the prior. A failure means that noise hides more "
        "than half of G's spectrum: average repeats or raise the load.",
    )
    # A shear falls off more slowly: of the paper's rod 6.5 % lie beyond four film thicknesses.
    yield check(
        "tail_share",
        solution.tail_share,
        0.10 if estimate.points.order else 0.05,
        "Share of the voltage's integral that lies beyond the scan and is extrapolated. A failure "
        "means that A rests on the extrapolation: scan farther.",
    )
    yield from _baseline(estimate)
    if not source:
        yield check(
            "reference_force",
            abs(carried_force(solution.stress, estimate.model.reference) - 1.0),
            0.01,
            "Relative difference of the reference's total force from the load. A failure means "
            "that the reference was made for another load, or that its table ends too early; A is "
            "wrong by as much.",
        )
    yield outlier_check(estimate.outlier_weight, "the points that the messages name")


def _baseline(estimate: ProfileEstimate) -> _Checks:
    points = estimate.points
    last = 1 + points.free[0].sum()
    yield check(
        "baseline_drift",
        2 * abs(estimate.drifts[1:last]).max() / estimate.largest_signal,
        0.05,
        "Change of the baseline across the scan over the largest signal. It is fitted and removed "
        "as a line that is straight or a little curved; a failure means that what is left of it "
        "may bias A.",
    )
    count = points.curved.size
    if count:
        prior = points.curvature[points.curved] ** 2
        # What a mean has of the prior's variance the posterior has not.
        found = prior - np.diag(estimate.weighed.covariance)[points.curvatures]
        share = abs(estimate.drifts[-count:]) / np.sqrt(np.maximum(found, _LEAST_FOUND * prior))
        yield check(
            "baseline_curvature",
            share.max(),
            _CURVED,
            "Fitted curvature of the baseline, edge to centre, over what its prior and the noise "
            "make of it. A failure means that the baseline bends by more than was allowed for, or "
            "that something else looks like it: a tail of G, the amplifier. State "
            "baseline_curvature_uncertainty, or let amplifier and film settle.",
        )


def _indentation(solution: Solution, results: Results, assumed: Sequence[Assumption]) -> _Checks:
    """Compare what a film's law would change, where nothing is counted for it, with u."""
    film = solution.scan.film
    if not film or film.law not in ("", LINEAR) or "model_form" in results.changes:
        return
    laws = [assumption.sizes for assumption in assumed if assumption.name == "film_law"]
    if laws:
        change = max(1 / laws[0][name] for name in ("conversion_constant", "gaussian_sigma"))
        words = "Change of A or sigma by a neo-Hookean film in place of the linear one, over its u."
    else:
        depths = []
        for scan, stress in zip(solution.scans, solution.stresses, strict=True):
            depth = stress.depth or press_rod(*scan.set_up.under(LINEAR)).depth
            depths.append(depth / scan.set_up.film.thickness)
        change = max(depths) / _DEEP
        words = f"Depth of the rod over {_DEEP:.0%} of the film's thickness."
    yield check(
        "indentation",
        change,
        1.0,
        f"{words} A failure means that a film that is taken as linear elastic, of which nothing is "
        "counted, is strained too far for that: give its law (film/law, --film-law), or leave it "
        "out to have the law's form counted, or calibrate at a lighter load.",
    )


def _unexplained(estimate: ProfileEstimate, results: Results) -> _Checks:
    """Test what no G explains: its size against the noise, and its order along the scan."""
    model = free_model(estimate)
    residuals = residuals_of(estimate, model)
    if residuals.stated:
        scatter = scatter_of_means(residuals, estimate.weighed.noise)
        yield noise_check(scatter, estimate.points.channel)
    if residuals.degrees < FEWEST_RESIDUALS:
        return
    outcome: TestOutcome | None
    if residuals.stated:
        outcome = chi_square_test(residuals)
        compared = f"with the stated noise: reduced chi-square of {residuals.degrees} degrees"
        noise = "the noise is larger than stated, or "
    else:
        outcome = pure_error_test(estimate, model)
        compared = "with the scatter of repeats, as no noise is stated: an F ratio"
        noise = ""
    if outcome:
        yield _tested(
            "chi_square",
            outcome,
            f"What no radial G can explain of the scan, compared {compared}. A failure means that "
            f"{noise}the scan is no convolution of this reference with a radial G: check the rod's "
            "radius, the film's thickness and Poisson's ratio, a baseline that is no straight "
            "line, and the positions; every uncertainty is doubtful until then.",
        )
    cause = (
        "a baseline that steps or bends, a wrong reference, or noise that is correlated from point "
        "to point (a slow amplifier, creep, temperature). Look at the residual; state a known "
        "correlation as u_zz_correlation"
    )
    cause += "." if estimate.slow else "; uncertainties are too small until then."
    slow = estimate.slow or slow_noise(estimate, residuals)
    found = f" {slow_noise_text(estimate, slow, results)}" if slow else ""
    yield _tested(
        "residual_steps",
        steps_test(residuals),
        "Largest step of the residuals along the scan, in standard deviations. A failure means "
        f"that readings changed from one point on by what no radial G explains: {cause}",
    )
    yield _tested(
        "residual_correlation",
        neighbour_correlation_test(residuals),
        "Correlation of each residual with its neighbours along the scan, halved for each step "
        f"farther, over what chance gives on average. A failure means that residuals are "
        f"alike: {cause}{found}",
    )


def _tested(name: str, outcome: TestOutcome, meaning: str) -> QualityCheck:
    return check(name, outcome.value, outcome.limit, meaning, outcome.p_value)


def _bayes_factor(estimate: ProfileEstimate) -> QualityCheck:
    weighed = estimate.weighed
    priors = np.array([hypothesis.estimate for hypothesis in HYPOTHESES[1:]])
    departed = logsumexp(weighed.log_marginals[1:], b=priors / priors.sum())
    kinds: dict[str, float] = {}
    for hypothesis, departure in zip(HYPOTHESES[1:], weighed.probability[1:], strict=True):
        kinds[hypothesis.kind] = kinds.get(hypothesis.kind, 0.0) + departure
    if estimate.free:
        departed = weighed.free
        kinds = {"plane": 1.0}
    kind = max(kinds, key=lambda name: kinds[name])
    share = kinds[kind] / max(sum(kinds.values()), 1e-300)
    return check(
        "gaussian_evidence",
        departed - weighed.log_marginals[0],
        _LOG_BAYES_LIMIT,
        "Natural logarithm of the Bayes factor for a departure of G from a Gaussian; below "
        "zero it is in favour of the Gaussian, and gaussian_sigma may be used. A failure "
        "means that G is not Gaussian, or that something is not as stated. The most probable "
        f"departure is {_KINDS[kind]} ({share:.0%} of them).",
    )


def _symmetry(estimate: ProfileEstimate) -> QualityCheck:
    if estimate.points.planar:
        uneven = model_tests.axisymmetry_test(estimate)
        return check(
            "axisymmetry",
            uneven.fall,
            math.inf,
            f"Fall of chi-square by {uneven.count} columns of an elliptic sensor, which then make "
            f"up {uneven.size:.2%} of the largest signal. It has no limit, for G over the plane "
            "need not be round; beyond 18 the radial profile is only a mean over directions. A "
            "failure means that the ellipse could not be fitted.",
        )
    extra = model_tests.symmetry_test(estimate)
    parity = "odd"
    failure = ": a tilted rod, an uneven film, a drifting load, or a lag along the scan"
    if estimate.points.order:
        parity = "even"
        failure = " by more than their sign: cross-talk of the normal stress, "
        failure += "a tilted rod, or an uneven film"
    return added_check(
        "symmetry",
        extra.fall,
        extra.count,
        f"Fall of chi-square by {extra.count} {parity} columns, which then make up "
        f"{extra.size:.2%} of the largest signal. A failure means that the left and right halves "
        f"differ{failure}.",
    )


def _steadiness(solution: Solution) -> _Checks:
    """Test whether A, centre and baseline are the same at all loads, branches and repeats."""
    estimate = solution.estimate
    linear = model_tests.linearity_test(estimate)
    if linear:
        yield added_check(
            "load_linearity",
            linear.fall,
            linear.count,
            "Fall of chi-square by a conversion constant that changes with the load, here by "
            f"{float(linear.coefficients[0]):.2%} per mean load. A failure means that the output "
            "is not linear in the load, and that one A does not serve all loads.",
        )
    yield from _hysteresis(estimate)
    yield from _runs(estimate)
    apart = solution.apart
    if apart and not solution.per_repeat:
        yield _tested(
            "repeat_centres",
            apart,
            "Fall of the squared residuals by a centre for each repeat, over the scatter that is "
            f"left: an F ratio. The centres are up to {apart.distance * 1e6:.3g} um apart. A "
            "failure means that stage or sensor moved from repeat to repeat, and that the one "
            "centre widens G: take a centre per repeat (--centre per-repeat).",
        )


def _hysteresis(estimate: ProfileEstimate) -> _Checks:
    """Compare approach with retreat where scans say which is which."""
    branches = hysteresis_test(estimate)
    if not branches:
        return
    reading = estimate.points.reading
    units = (
        ("A", 1e-2, "%"),
        ("the width", 1e-2, "%"),
        ("the centre's position", 1e-6, "um"),
        ("the baseline", reading.scale, reading.unit),
    )
    differences = [
        f"of {name} by {format_measured(value / scale, error / scale, unit)}"
        for (name, scale, unit), value, error in zip(
            units, branches.values, branches.errors, strict=False
        )
    ]
    yield _tested(
        "hysteresis",
        branches.outcome,
        "Differences between approach and retreat over the scatter that is left: an F ratio. They "
        f"differ (approach less retreat): {', '.join(differences)}. A failure means that A and G "
        "are means over two different scans. Scan at another speed: a difference that grows with "
        "the speed is creep of the film or a slow amplifier, of which a longer wait before each "
        "reading rids; one that does not is play of the stage (backlash), or a film that adheres: "
        "move to each position from the same side. Or calibrate with one branch alone.",
    )


def _runs(estimate: ProfileEstimate) -> _Checks:
    """Compare the offset and the noise of each repeat and scan with those of the others."""
    runs = compare_runs(estimate)
    if not runs:
        return
    reading = estimate.points.reading
    largest = estimate.largest_signal
    apart = format_measured(runs.distance / reading.scale, runs.error / reading.scale, reading.unit)
    yield check(
        "offset_agreement",
        abs(runs.distance) / largest,
        max(_OFFSET, runs.offset.limit**0.5 * runs.error / largest),
        "Difference of a baseline from those of all other repeats of all scans, over the largest "
        f"signal: that of number {runs.moved + 1} of {runs.count} is off by {apart}. A failure "
        "means that the sensor's offset moved between them, beyond chance: let it warm up, and "
        "read it without the indenter before each run. A baseline of its own (scans have it, "
        "repeats by --centre per-repeat) takes that up, but not what else moved.",
        runs.offset.p_value,
    )
    stated = ", each over what is stated" if estimate.points.noise_stated else ""
    yield check(
        "noise_agreement",
        runs.noise.value**0.5,
        max(NOISE_LIMIT, runs.noise.limit**0.5),
        f"Ratio of the scatter of one repeat of a scan to that of all others{stated}, or back: "
        f"number {runs.noisy + 1} of {runs.count} has {'more' if runs.louder else 'less'}. A "
        "failure means that their noise differs beyond chance, so that weights and uncertainties "
        "are wrong: look for its cause, or state the noise of each (u_zz_errors).",
        runs.noise.p_value,
    )


def _held_out(estimate: ProfileEstimate) -> _Checks:
    """Predict each repeat, load and scan from the others, whichever there are several of."""
    groups = {
        "scan": estimate.points.owner,
        "load": model_tests.load_groups(estimate.points.load),
        "repeat": estimate.points.repeat,
    }
    held_out: dict[bytes, str] = {}
    for what, group in groups.items():
        # Where every repeat has a load, or a scan, of its own, it is held out under that name.
        # Groupings are equal if the first point of each point's group is the same.
        _, first, index = np.unique(group, return_index=True, return_inverse=True)
        if first.size > 1:
            held_out.setdefault(first[index].tobytes(), what)
    causes = {
        "repeat": "something changed between repeats: the load, the contact, the sensor; look at "
        "this repeat, and leave it out if its reason is known",
        "load": "the signal is not proportional to the load: the film is strained too far for a "
        "linear reference, or the load cell's scale is wrong; calibrate at the load of use",
        "scan": "the scans are not of the same sensor, film and reference; calibrate each by "
        "itself and compare",
    }
    stated = estimate.points.noise_stated
    scale = "" if stated else ", over the others' own scatter as no noise is stated"
    for what in reversed(held_out.values()):
        worst = model_tests.hold_out(estimate, groups[what])
        if not worst:
            continue
        joined = "" if worst.alone else f", {what}s taken several at a time"
        yield _tested(
            f"held_out_{what}",
            worst,
            f"Chi-square per degree of one {what}'s voltages against their prediction from the "
            f"others, with the uncertainty of both{scale}; the worst of {worst.folds}, number "
            f"{worst.worst + 1}{joined}. Its own baseline, drift and centre are fitted to it. A "
            f"failure means that {causes[what]}.",
        )


def _saturation(estimate: ProfileEstimate) -> _Checks:
    if estimate.points.order:
        return
    clipped = np.flatnonzero(model_tests.clipped_points(estimate))
    where = ""
    if clipped.size:
        axes = estimate.points.positions[estimate.points.free.any(axis=0)].T * 1e3
        places = [", ".join(f"{p:.4g}" for p in place) for place in axes[clipped[:_MOST_NAMED]]]
        where = f", here at {'; '.join(places)} mm"
        if clipped.size > _MOST_NAMED:
            where += f" and {clipped.size - _MOST_NAMED} more"
    yield check(
        "saturation",
        clipped.size,
        0.0,
        f"Number of points at a ceiling{where}: the highest agree far better than the fit has them "
        "differ, or the profile through the other points rises above them. A failure means that "
        "amplifier or converter is saturated, and A and G are wrong: leave the points out (memscal "
        "import --ceiling VALUE), or lower gain or load and scan again.",
    )
