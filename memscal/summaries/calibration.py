"""A calibration, or an apparatus function from a file, as tables, a mapping and arrays."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from memscal.calibration.calibrate import Calibration
from memscal.calibration.stages import Misfit
from memscal.estimation.points import ScanPoints
from memscal.mechanics.contact import Contact
from memscal.model import records
from memscal.model.apparatus import ApparatusData, ParameterSet
from memscal.model.checks import REPEAT_CENTRES, Message
from memscal.model.quantities import MM, PER_MM, measured_text, parameter_quantity
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.summaries.declared import (
    Dataset,
    correlated_parameters,
    members,
    parameter_json,
    record_arrays,
)
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of, verdict

Calibrated: TypeAlias = Calibration | ApparatusData

_OF_A_ROUTE = ("conversion_constant", "gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area")
#: What scans tell of the film, where they do.
_OF_FILM = ("film_laws", "free")
#: Checks that a G that is Gaussian passes.
_OF_GAUSSIAN = ("gaussian_misfit", "width_agreement")
_OF_G = "reconvolution"
#: Reduced chi-squares of the Gaussian and of G(r) whose ratio is smaller are alike; where that of
#: G(r) fails its check, too.
_ALIKE = 1.1
_ALIKE_FAILED = 1.5


def tables(result: Calibrated) -> list[Table]:
    """Return the estimates with their standard uncertainties, and the quality checks."""
    apparatus = apparatus_of(result)
    messages = apparatus.process.messages
    rows = estimate_rows(apparatus.parameters, apparatus.resolved_wavenumber, messages)
    if method := _method(apparatus):
        rows.insert(-1, ("method", "", method))
    if isinstance(result, Calibration):
        misfit = result.solution.deconvolution.misfit
        gaussian = result.solution.gaussian_misfit
        rows.append(("reconvolution with the deconvolved G", "", _misfit(misfit)))
        rows.append(("reconvolution with the Gaussian", "", _misfit(gaussian)))
    title = f"{sensor_title(apparatus)} (± standard uncertainty, k = 1)"
    shown = [Table(title, ("", "", ""), rows)]
    if (other := apparatus.other) is not None:
        title = f"The same by method {other.method}, to compare"
        shown.append(Table(title, ("", "", ""), _parameter_rows(other.parameters)))
    return [*shown, checks_table(apparatus.checks)]


def answer(result: Calibrated) -> str:
    """Return which A and which description of G to use, and why."""
    apparatus = apparatus_of(result)
    parameters = apparatus.parameters
    method = _method(apparatus)
    failed = [c.name for c in apparatus.checks if c.name in _OF_GAUSSIAN and not c.passed]
    checks = {check.name: check for check in apparatus.checks}
    alike = False
    if failed == ["gaussian_misfit"] and (of_g := checks.get(_OF_G)) is not None:
        ratio = _ALIKE if of_g.passed else _ALIKE_FAILED
        alike = checks[failed[0]].value < ratio * of_g.value
    which = (
        f"Its Gaussian of σ = {measured_text(parameters, 'gaussian_sigma')} suffices: the scan "
        "shows no departure."
        if not failed
        else "The Gaussian fails the check gaussian misfit, and G(r) explains the scan no better: "
        "the noise is larger than stated, or the model does not hold."
        if alike
        else f"Use G(r), for the Gaussian fails the check {' and '.join(failed)}."
    ).replace("_", " ")
    by = f" (method {method})" if method else ""
    a = measured_text(parameters, "conversion_constant")
    a = a.replace("(relative)", "(relative: the load is not known)")
    return f"{_of_the_law(apparatus)}Use A = {a}{by}. {verdict(apparatus.checks)}\n{which}"


def _of_the_law(apparatus: ApparatusData) -> str:
    dominated = []
    for symbol, name in (("A", "conversion_constant"), ("σ", "gaussian_sigma")):
        form = apparatus.budget.get(name, {}).get("model_form", 0.0)
        if (share := (form / apparatus.parameters.uncertainty(name)) ** 2) > 0.5:
            dominated.append(f"{share:.0%} of the variance of {symbol}")
    if not dominated or apparatus.film is None or apparatus.film.law:
        return ""
    return (
        "The film's law, which is not stated, dominates the uncertainty: it makes up "
        f"{' and '.join(dominated)}.\n"
    )


def _method(apparatus: ApparatusData) -> str:
    return str(apparatus.process.configuration.get("method") or "")


def _estimates_json(apparatus: ApparatusData) -> dict[str, Any]:
    parameters = apparatus.parameters
    other = apparatus.other
    own = {name: parameter_json(parameters, name) for name in _OF_A_ROUTE if name in parameters}
    estimates: dict[str, Any] = {_method(apparatus) or "chosen": own}
    if other is not None:
        names = other.parameters.names
        estimates[other.method] = {name: parameter_json(other.parameters, name) for name in names}
    if "conversion_constant_gaussian" in parameters:
        names = ("conversion_constant_gaussian", "gaussian_sigma")
        a, sigma = (parameter_json(parameters, name) for name in names)
        estimates["gaussian"] = {"conversion_constant": a, "gaussian_sigma": sigma}
    return estimates


def mapping(result: Calibrated) -> dict[str, Any]:
    """Return the object of ``calibrate --json``; its form is part of the contract."""
    apparatus = apparatus_of(result)
    parameters = apparatus.parameters
    values: dict[str, Any] = {
        "schema_version": "1",
        "method": _method(apparatus) or None,
        **{name: parameter_json(parameters, name) for name in parameters.names},
        **members(records.TRANSFER.quantities[-1:], apparatus),
        "estimates": _estimates_json(apparatus),
        "film_law": (apparatus.film and apparatus.film.law) or None,
    }
    configuration = apparatus.process.configuration
    choice = configuration.get("centre")
    if isinstance(choice, Mapping):
        centres = [name for name in parameters.names if name.startswith("centre")]
        values["centres"] = {**choice, "values": [parameter_json(parameters, n) for n in centres]}
    values |= {name: configuration[name] for name in _OF_FILM if name in configuration}
    if isinstance(result, Calibration):
        misfit = result.solution.deconvolution.misfit
        gaussian = result.solution.gaussian_misfit
        values["reconvolution"] = {
            "relative_rms": finite(misfit.relative_rms),
            "gaussian_relative_rms": finite(gaussian.relative_rms),
            "chi2_reduced": finite(misfit.chi2_reduced),
            "gaussian_chi2_reduced": finite(gaussian.chi2_reduced),
        }
    return values | {
        "checks": checks_json(apparatus.checks),
        "warnings": texts_of(apparatus.process.messages),
    }


def dataset(result: Calibrated) -> Dataset:
    """Return G(r), the transfer function, the reconvolution and the field, in SI units."""
    import xarray

    apparatus = apparatus_of(result)
    field = {"g": "field", "g_errors": "field_errors", "g_scatter": "field_scatter"}
    of_scan = records.RECONVOLUTION.read_in(apparatus.reading)
    return xarray.Dataset(
        record_arrays(records.RADIAL, apparatus.radial_profile)
        | record_arrays(records.RADIAL_COVARIANCE, apparatus.radial_profile)
        | record_arrays(records.TRANSFER, apparatus.transfer)
        | record_arrays(of_scan, apparatus.reconvolution, {"x": "position"})
        | record_arrays(records.FIELD, apparatus.field, field),
        attrs={"title": sensor_title(apparatus)},
    )


def correlated(result: Calibrated) -> dict[str, Any]:
    """Return the parameters as numbers of the package uncertainties, with their covariance."""
    return correlated_parameters(apparatus_of(result).parameters)


def estimate_rows(
    parameters: ParameterSet, resolved: float, messages: Sequence[Message]
) -> list[tuple[str, str, str]]:
    """Return words, symbol and value of each parameter and of the resolved wavenumber (rad/m)."""
    rows = _parameter_rows(parameters)
    if any(message.kind == REPEAT_CENTRES for message in messages):
        # Of further repeats the centre is shown.
        rows = [
            (words.replace(", scan ", ", repeat "), symbol, value)
            for words, symbol, value in rows
            if ", scan " not in words or words.startswith("centre")
        ]
    return [*rows, ("resolved up to the wavenumber", "k", f"{resolved / PER_MM:.3g} rad/mm")]


def _parameter_rows(parameters: ParameterSet) -> list[tuple[str, str, str]]:
    quantities = {name: parameter_quantity(parameters, name) for name in parameters.names}
    return [(q.words, q.symbol, measured_text(parameters, name)) for name, q in quantities.items()]


def sensor_title(apparatus: ApparatusData) -> str:
    """Return the title of everything that shows an apparatus function."""
    return f"Apparatus function of {sensor_name(apparatus)}, channel {apparatus.sensor.channel}"


def sensor_name(apparatus: ApparatusData) -> str:
    """Return what a sensor is called: its name and model."""
    sensor = apparatus.sensor
    return " ".join(word for word in (sensor.name, sensor.model) if word) or "the sensor"


def apparatus_of(result: Calibrated) -> ApparatusData:
    """Return the apparatus function of a calibration, or the one that it is already."""
    return result.apparatus if isinstance(result, Calibration) else result


def _misfit(misfit: Misfit) -> str:
    return f"rms {misfit.relative_rms:.2%} of the largest signal, χ²/ν = {misfit.chi2_reduced:.3g}"


def rehearsal_json(
    stress: StressProfile | Contact, method: str, outputs: Sequence[Path]
) -> dict[str, Any]:
    """Return the object that ``calibrate --dry-run --json`` prints."""
    plan = {"method": method, "reference": _origin(stress), "outputs": list(map(str, outputs))}
    return {"schema_version": "1", "dry_run": True, **plan}


def rehearsal_table(
    scan: Scan,
    points: ScanPoints,
    stress: StressProfile | Contact,
    method: str,
    outputs: Sequence[Path],
) -> Table:
    """Return what ``calibrate --dry-run`` would do."""
    film = scan.film
    rod = scan.indenter
    load = scan.load
    missing = f", {points.missing} missing" if points.missing else ""
    slip = {None: "", 0.0: ", sliding freely", math.inf: ", sticking"}[scan.rod_friction]
    rows = [("scan", f"{scan.kind}, {points.u.size} points{missing}")]
    if rod is not None:
        rows.append(("indenter", f"{rod.shape} of radius {rod.radius / MM:.4g} mm{slip}"))
    if load is not None:
        rows.append(("load", f"{load:.4g} N"))
    if film is not None:
        elasticity = f"E = {film.young_modulus / 1e6:.4g} MPa"
        elasticity += f", Poisson's ratio {film.poisson_ratio:.4g}, {film.law_text}"
        rows.append(("film", f"{film.thickness / MM:.4g} mm, {elasticity}"))
    rows += [("reference", _origin(stress)), ("method", method)]
    rows += [("would write", str(path)) for path in outputs]
    return Table("A calibration would use", ("", ""), rows)


def _origin(stress: StressProfile | Contact) -> str:
    if isinstance(stress, Contact):
        return "the rod, solved on the film"
    if stress.form is not None:
        return f"a {stress.form}"
    if stress.source is not None:
        return stress.source.file_name
    return "the one in the scan" + (f" ({stress.solver})" if stress.solver else "")
