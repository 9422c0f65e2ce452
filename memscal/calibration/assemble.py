"""What a calibration records: the apparatus function with its steps, checks and configuration."""

from dataclasses import asdict, is_dataclass, replace
from typing import Any

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import quotient
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.calibration.film_inference import FilmLawComparison
from memscal.calibration.messages import calibration_messages
from memscal.calibration.prepare import Prepared
from memscal.calibration.stages import COMMON, PER_REPEAT, Deconvolution, Solution
from memscal.calibration.uncertainty import Results
from memscal.estimation.bayesian import Bayesian
from memscal.estimation.points import loads_differ
from memscal.mechanics.contact import stress_table
from memscal.model.apparatus import (
    ApparatusField,
    ApparatusRadial,
    OtherEstimate,
    Reconvolution,
    TransferFunction,
)
from memscal.model.arrays import Values
from memscal.model.assumptions import Assumption
from memscal.model.checks import QualityChecks
from memscal.model.provenance import Process
from memscal.model.scan import common_circumstances

#: Parameters that differ between a division and the Bayesian estimate.
_BY_ROUTE = ("conversion_constant", "gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area")


def assemble(
    prepared: Prepared,
    solution: Solution,
    results: Results,
    other: Results | None,
    checks: QualityChecks,
    laws: FilmLawComparison | None,
    assumptions: tuple[Assumption, ...],
    explanations: list[Values],
) -> ApparatusFunction:
    """Return the apparatus function with everything that its artifact stores."""
    # Film and indenter are as stated by the scan where nothing was calculated with them.
    stated = prepared.as_stated[0]
    scan = solution.scan
    reference = stress_table(solution.stress)
    channel = solution.estimate.points.channel
    other_estimate = None
    if other and solution.other:
        method = "white-noise" if isinstance(solution.method, Bayesian) else "bayesian"
        radial = _radial(solution, solution.other, other)
        other_estimate = OtherEstimate(method, other.parameters.only(_BY_ROUTE), radial)
    window = solution.deconvolution.quotient.window[0]
    messages = calibration_messages(prepared, solution, results, checks, laws, assumptions)
    return ApparatusFunction(
        plane=_plane(solution, results),
        radial_profile=_radial(solution, solution.deconvolution, results),
        transfer=TransferFunction(
            *solution.transfer, results.transfer_errors, window, solution.band.resolved
        ),
        reconvolution=_reconvolution(solution),
        parameters=results.parameters,
        checks=checks,
        film=scan.film or stated.film,
        indenter=scan.indenter or stated.indenter,
        sensor=scan.sensor if channel == "zz" else replace(scan.sensor, channel=channel),
        load=scan.load if prepared.reading.per == "Pa" else None,
        reference=reference,
        process=Process.of_now(
            configuration=_configuration(prepared, solution, results, laws, explanations),
            messages=tuple(messages),
            input_scan=scan.source,
            input_reference=reference.source,
        ),
        budget=results.budget,
        kernel_changes=results.kernel_changes,
        shared_effects=results.shared_effects,
        assumptions=assumptions,
        **common_circumstances(solution.scans),
        other=other_estimate,
    )


def _configuration(
    prepared: Prepared,
    solution: Solution,
    results: Results,
    laws: FilmLawComparison | None,
    explanations: list[Values],
) -> Values:
    """Return what was asked for and decided; what is usual is left out."""
    request = prepared.request
    method: Any = request.method
    # A method of another package may be no dataclass.
    options = {}
    if is_dataclass(method) and not isinstance(method, type):
        options = asdict(method)
    unit = prepared.reading.per
    centre: Values | None = None
    if request.centre or solution.apart:
        choice = PER_REPEAT if solution.per_repeat else COMMON
        centre = {"choice": choice, "chosen_by": "option" if request.centre else "test"}
        if solution.apart:
            centre["p_value"] = solution.apart.p_value
    u_load = solution.scans[0].load_uncertainty
    # A scan that was split by repeats or loads has one source.
    sources = {i: scan.source for i, scan in zip(solution.owners, solution.scans, strict=True)}
    further = [
        source and {"file_name": source.file_name, "sha256": source.sha256}
        for owner, source in sources.items()
        if owner > 0
    ]
    record = {
        "method": method.name,
        "seed": request.seed,
        "options": options,
        "reference_unit": None if unit == "Pa" else unit,
        "relative_load_uncertainty": u_load and u_load / solution.scans[0].stated_load,
        "free": prepared.thickness and prepared.thickness.record,
        "film_laws": laws and laws.record,
        "explanations": explanations or None,
        "channel": None if request.channel == "zz" else request.channel,
        "film_law": request.film_law,
        "rod_friction": request.rod_friction,
        "centre": centre,
        "creep": request.creep,
        "override": prepared.overridden or None,
        "correlations": {" ".join(pair): c for pair, c in request.correlations.items()} or None,
        "grid": solution.choice.reasons,
        "relevant_wavenumber_rad_per_mm": solution.band.relevant * 1e-3,
        "effective_degrees": results.effective_degrees or None,
        "direction": "y" if solution.scan.direction == "y" else None,
        "further_scans": further or None,
    }
    return {name: value for name, value in record.items() if value is not None}


def _plane(solution: Solution, results: Results) -> ApparatusField:
    g = solution.deconvolution.g
    x, y = g.grid.axes
    plane = g.grid.to_image(g.values)
    if results.field_errors is not None:
        scatter, errors = results.field_errors
        return ApparatusField(x, y, plane, errors, scatter)
    radial = np.sqrt(np.diag(results.radial_covariance))
    errors = g.grid.to_image(np.interp(g.grid.radius, g.r, radial))
    return ApparatusField(x, y, plane, errors)


def _radial(solution: Solution, deconvolution: Deconvolution, results: Results) -> ApparatusRadial:
    g = deconvolution.g
    gaussian = unit_gaussian(g.r, solution.estimate.gaussian.sigma)
    errors = np.sqrt(np.diag(results.radial_covariance))
    scale = errors * results.parameters.uncertainty("conversion_constant")
    correlation = quotient(results.with_constant, scale)
    return ApparatusRadial(g.r, g.radial, errors, gaussian, results.radial_covariance, correlation)


def _reconvolution(solution: Solution) -> Reconvolution:
    estimate = solution.estimate
    points = estimate.points
    if solution.per_repeat and not points.planar and max(solution.owners) == 0:
        # Repeats of one line are shown with their centres at that of the first.
        axis = np.argmax(points.free[0])
        place = estimate.offset[axis] + estimate.centre[axis]
    elif points.scans > 1 and points.order:
        # The sign of a shear depends on the side.
        place = estimate.offset[estimate.model.axis]
    elif points.scans > 1 or points.planar:
        place = estimate.distance
    else:
        place = points.x if points.free[0, 0] else points.y
    predicted = solution.deconvolution.predicted
    columns = {
        "x": place,
        "u_zz": points.u,
        "u_zz_errors": estimate.noise,
        "u_zz_predicted": predicted,
        "u_zz_gaussian": estimate.gaussian.predicted,
        "residual": points.u - predicted,
    }
    if points.planar:
        columns["offset_x"], columns["offset_y"] = estimate.offset
    if points.planar or points.scans > 1 or loads_differ(points.load):
        columns["load"] = points.load
        columns["background"] = estimate.background
    order = np.argsort(place, kind="stable")
    return Reconvolution(**{name: values[order] for name, values in columns.items()})
