"""A calibration, or an apparatus function from a file, as tables, a mapping and arrays."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from memscal.calibration.calibrate import Calibration
from memscal.calibration.explanations import DEPARTURE, explanation, misfit
from memscal.calibration.stages import Misfit
from memscal.estimation.points import MINIMUM_POSITIONS, ScanPoints, loads_differ
from memscal.mechanics.contact import Contact
from memscal.model import records
from memscal.model.apparatus import ApparatusData, ParameterSet, Reconvolution
from memscal.model.arrays import Values
from memscal.model.assumptions import MOVED
from memscal.model.checks import EXPLANATIONS, NOISE_ALONE, REPEAT_CENTRES
from memscal.model.quantities import (
    ESTIMATED,
    MM,
    PER_MM,
    measured_text,
    name_and_scan,
    parameter_quantity,
)
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.summaries.declared import (
    DataFrame,
    Dataset,
    correlated_parameters,
    members,
    parameter_json,
    parameters_json,
    record_arrays,
)
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of, verdict

Calibrated = Calibration | ApparatusData
Loads = Sequence[tuple[str, ApparatusData]]  # each load's text and points

_BY_METHOD = ("conversion_constant", "gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area")
#: What scans tell of the film, and what explains them, where they do.
_FOUND = ("film_laws", "free", "explanations")


def tables(result: Calibrated) -> list[Table]:
    """Return the estimates with their standard uncertainties, and the quality checks."""
    apparatus = apparatus_of(result)
    rows = _estimate_rows(apparatus)
    method = _method(apparatus)
    if method:
        rows.insert(-1, ("method", "", method))
    if apparatus.effective_degrees:
        factors = [f"{apparatus.coverage_factor(name):.3g}" for name in MOVED[:2]]
        rows.append(("coverage factors of 95 % of A and σ", "k", " and ".join(factors)))
    if isinstance(result, Calibration):
        misfit = result.solution.deconvolution.misfit
        rows.append(("reconvolution with the deconvolved G", "", _misfit(misfit)))
        gaussian = result.solution.gaussian_misfit
        rows.append(("reconvolution with the Gaussian", "", _misfit(gaussian)))
    title = f"{sensor_title(apparatus)} (± standard uncertainty, k = 1)"
    shown = [Table(title, ("", "", ""), rows)]
    other = apparatus.other
    if other is not None:
        title = f"The same by method {other.method}, to compare"
        rows = [_parameter_row(other.parameters, name) for name in other.parameters.names]
        shown.append(Table(title, ("", "", ""), rows))
    return [*shown, checks_table(apparatus.checks)]


def answer(result: Calibrated) -> str:
    """Return which A and which description of G to use, and why."""
    apparatus = apparatus_of(result)
    method = _method(apparatus)
    by = f" (method {method})" if method else ""
    a = measured_text(apparatus.parameters, "conversion_constant")
    a = a.replace("(relative)", "(relative: the load is not known)")
    law = _dominating_law(apparatus)
    checks = verdict(apparatus.checks)
    notes = apparatus.process.messages
    alone = "".join(f" {note.text}" for note in notes if note.kind == NOISE_ALONE)
    failed = [check.kind for check in apparatus.checks if not check.passed]
    if failed and not misfit(apparatus.checks):
        cures = [EXPLANATIONS[kind][1] for kind in dict.fromkeys(failed) if kind in EXPLANATIONS]
        return f"A = {a}{by} is in doubt.{alone} {checks}\nWhat to do: {'; '.join(cures)}.{law}"
    if not failed:
        suffices = ""
        # A sensor of an array is not tested for it.
        if any(check.kind == "gaussian_misfit" for check in apparatus.checks):
            sigma = measured_text(apparatus.parameters, "gaussian_sigma")
            suffices = f"\nIts Gaussian of σ = {sigma} suffices: the scan shows no departure."
        return f"Use A = {a}{by}.{alone} {checks}{suffices}{law}"
    rows = _explanations(apparatus)
    rivals = [row for row in rows if row["named"] and row["name"] != DEPARTURE]
    settled = ": which A to use is not settled" if rivals else ""
    found = f"A = {a}{by} if all is as stated{settled}.{alone} {checks}"
    return f"{found}\n{explanation(rows)}{law}"


def _explanations(apparatus: ApparatusData) -> Sequence[Values]:
    return list(apparatus.process.configuration.get("explanations", ()))


def _dominating_law(apparatus: ApparatusData) -> str:
    """Say where the film's law, if it is not stated, is most of the uncertainty."""
    if apparatus.film is None or apparatus.film.law:
        return ""
    dominated = []
    for symbol, name in (("A", "conversion_constant"), ("σ", "gaussian_sigma")):
        form = apparatus.budget.get(name, {}).get("model_form", 0.0)
        share = (form / apparatus.parameters.uncertainty(name)) ** 2
        if share > 0.5:
            dominated.append(f"{share:.0%} of the variance of {symbol}")
    if not dominated:
        return ""
    return (
        "\nThe film's law, which is not stated, dominates the uncertainty: it makes up "
        f"{' and '.join(dominated)}."
    )


def _method(apparatus: ApparatusData) -> str:
    return str(apparatus.process.configuration.get("method") or "")


def _estimates_json(apparatus: ApparatusData) -> Values:
    parameters = apparatus.parameters
    other = apparatus.other
    names = [name for name in _BY_METHOD if name in parameters]
    estimates = {_method(apparatus) or "chosen": parameters_json(parameters, names)}
    if other is not None:
        estimates[other.method] = parameters_json(other.parameters)
    if "conversion_constant_gaussian" in parameters:
        a = parameter_json(parameters, "conversion_constant_gaussian")
        sigma = parameter_json(parameters, "gaussian_sigma")
        estimates["gaussian"] = {"conversion_constant": a, "gaussian_sigma": sigma}
    return estimates


def mapping(result: Calibrated) -> Values:
    """Return the object of ``calibrate --json``; its form is part of the contract."""
    apparatus = apparatus_of(result)
    parameters = apparatus.parameters
    configuration = apparatus.process.configuration
    values = {
        "schema_version": "1",
        "method": _method(apparatus) or None,
        **parameters_json(parameters),
        **members(records.TRANSFER.quantities[-1:], apparatus),
        "estimates": _estimates_json(apparatus),
        "film_law": (apparatus.film and apparatus.film.law) or None,
    }
    choice = configuration.get("centre")
    if isinstance(choice, Mapping):
        names = parameters.names
        shown = [parameter_json(parameters, n) for n in names if n.startswith("centre")]
        values["centres"] = {**choice, "values": shown}
    values |= {name: configuration[name] for name in _FOUND if name in configuration}
    if isinstance(result, Calibration):
        misfit = result.solution.deconvolution.misfit
        gaussian = result.solution.gaussian_misfit
        values["reconvolution"] = {
            "relative_rms": finite(misfit.relative_rms),
            "gaussian_relative_rms": finite(gaussian.relative_rms),
            "chi2_reduced": finite(misfit.chi2_reduced),
            "gaussian_chi2_reduced": finite(gaussian.chi2_reduced),
        }
    values["assumptions"] = [assumption.to_dict() for assumption in apparatus.assumptions]
    values["effective_degrees"] = dict(apparatus.effective_degrees)
    values["checks"] = checks_json(apparatus.checks)
    values["warnings"] = texts_of(apparatus.process.messages)
    return values


def assumptions_table(apparatus: ApparatusData) -> Table:
    """Return what is taken for granted, and the sizes that move A, its widths by their u."""
    rows = []
    for assumption in apparatus.assumptions:
        sizes = []
        for parameter in MOVED:
            size = assumption.size(parameter)
            sizes.append(f"{size:.2g}" if math.isfinite(size) else "-")
        measure = f"{assumption.measure} ({assumption.unit})"
        rows.append((assumption.sentence, assumption.state, measure, *sizes))
    heads = ("taken for granted", "state", "size", "for u(A)", "for u(σ)", "for u(FWHM)")
    return Table("Sizes that move a result by one standard uncertainty", heads, rows)


def explanations_table(apparatus: ApparatusData) -> Table:
    """Return what was weighed to explain a scan that fails a check."""
    rows = []
    for row in _explanations(apparatus):
        factor = f"{row['log_bayes_factor']:.1f}"
        change = f"{row['relative_change_of_a']:+.1%}"
        rows.append((row["words"], factor, change, "named" if row["named"] else ""))
    heads = ("explanation", "ln of the Bayes factor", "A by it", "")
    return Table("What explains the scan, against a Gaussian G and all as stated", heads, rows)


def dataset(result: Calibrated) -> Dataset:
    """Return G(r), the transfer function, the reconvolution and the field, in SI units."""
    import xarray

    apparatus = apparatus_of(result)
    field = {"g": "field", "g_errors": "field_errors", "g_scatter": "field_scatter"}
    reconvolution = records.RECONVOLUTION.read_in(apparatus.reading)
    return xarray.Dataset(
        record_arrays(records.RADIAL, apparatus.radial_profile)
        | record_arrays(records.RADIAL_COVARIANCE, apparatus.radial_profile)
        | record_arrays(records.TRANSFER, apparatus.transfer)
        | record_arrays(reconvolution, apparatus.reconvolution, {"x": "position"})
        | record_arrays(records.FIELD, apparatus.field, field),
        attrs={"title": sensor_title(apparatus)},
    )


def frame(result: Calibrated) -> DataFrame:
    """Return a row for each parameter, with its standard uncertainty and SI unit."""
    import pandas as pd

    parameters = apparatus_of(result).parameters
    columns = {
        "value": parameters.values,
        "standard_uncertainty": np.sqrt(np.diag(parameters.covariance)),
        "unit": [parameter_quantity(parameters, name).si_unit for name in parameters.names],
    }
    return pd.DataFrame(columns, index=pd.Index(parameters.names, name="name"))


def correlated(result: Calibrated) -> Values:
    """Return the parameters as numbers of the package uncertainties, with their covariance."""
    return correlated_parameters(apparatus_of(result).parameters)


def _estimate_rows(apparatus: ApparatusData) -> list[tuple[str, str, str]]:
    """Return words, symbol and value of each parameter and of the resolved wavenumber."""
    parameters = apparatus.parameters
    repeats = any(message.kind == REPEAT_CENTRES for message in apparatus.process.messages)
    rows = []
    for name in parameters.names:
        start, number = name_and_scan(name)
        words, symbol, value = _parameter_row(parameters, name)
        if repeats and number:
            # Of further repeats the centre is shown.
            if start not in ("centre", "centre_y"):
                continue
            words = f"{ESTIMATED[start].words}, repeat {number}"
        rows.append((words, symbol, value))
    resolved = f"{apparatus.resolved_wavenumber / PER_MM:.3g} rad/mm"
    return [*rows, ("resolved up to the wavenumber", "k", resolved)]


def _parameter_row(parameters: ParameterSet, name: str) -> tuple[str, str, str]:
    quantity = parameter_quantity(parameters, name)
    return quantity.words, quantity.symbol, measured_text(parameters, name)


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


def rehearsal_json(stress: StressProfile | Contact, method: str, outputs: Sequence[Path]) -> Values:
    """Return the object that ``calibrate --dry-run --json`` prints."""
    return {
        "schema_version": "1",
        "dry_run": True,
        "method": method,
        "reference": _origin(stress),
        "outputs": [*map(str, outputs)],
    }


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


def points_by_load(data: ApparatusData) -> Loads:
    """Return the points of each load apart, from the smallest up; of a single one without text."""
    scan = data.reconvolution
    if scan.load is None:
        return [("", data)]
    loads, inverse = np.unique(scan.load, return_inverse=True)
    # A load that is measured with noise at each point is one load: there is no gap in it.
    group = np.cumsum([0, *map(loads_differ, pairwise(loads))])[inverse]
    counts = np.bincount(group)
    if counts.size == 1 or counts.min() < MINIMUM_POSITIONS:
        return [("", data)]
    parts = []
    for i in range(counts.size):
        points = some_points(scan, group == i)
        load = scan.load[group == i].mean()
        parts.append((f"{load:.3g} N", replace(data, load=load, reconvolution=points)))
    return parts


def some_points(scan: Reconvolution, chosen: Any) -> Reconvolution:
    """Return some points of a scan, by a mask or a slice."""
    columns = {name: values[chosen] for name, values in vars(scan).items() if values is not None}
    return replace(scan, **columns)
