"""A calibration as the tables and the JSON object that ``memscal calibrate`` prints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from memscal.calibration.procedure import Calibration
from memscal.calibration.solution import Misfit
from memscal.cli.output import finite, texts_of
from memscal.cli.quality_view import checks_json, checks_table
from memscal.cli.tables import Table
from memscal.estimation.points import ScanPoints
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import ParameterSet
from memscal.model.quantities import MM, PER_MM, measured_text, parameter_quantity
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

__all__ = [
    "calibration_json",
    "calibration_tables",
    "rehearsal_json",
    "rehearsal_table",
]

_MEASURED = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "centre",
    "baseline",
)


def calibration_json(found: Calibration, artifact: Path) -> dict[str, Any]:
    """Return the object that ``calibrate --json`` prints; its form is part of the contract."""
    apparatus, solution = found.apparatus, found.solution
    deconvolved, gaussian = solution.deconvolution.misfit, solution.gaussian_misfit
    return {
        "schema_version": "1",
        "artifact": str(artifact),
        "method": solution.regulariser.name,
        **{name: _measured(apparatus.parameters, name) for name in _MEASURED},
        "resolved_wavenumber": {
            "value": finite(apparatus.resolved_wavenumber / PER_MM),
            "unit": "rad/mm",
        },
        "reconvolution": {
            "relative_rms": finite(deconvolved.relative_rms),
            "gaussian_relative_rms": finite(gaussian.relative_rms),
            "chi2_reduced": finite(deconvolved.chi2_reduced),
            "gaussian_chi2_reduced": finite(gaussian.chi2_reduced),
        },
        "checks": checks_json(apparatus.checks),
        "warnings": texts_of(apparatus.process.messages),
    }


def _measured(parameters: ParameterSet, name: str) -> dict[str, Any]:
    shown = parameter_quantity(parameters, name)
    return {
        "value": finite(parameters[name] / shown.scale),
        "standard_uncertainty": finite(parameters.uncertainty(name) / shown.scale),
        "unit": shown.unit,
    }


def calibration_tables(found: Calibration) -> list[Table]:
    """Return values with their standard uncertainties, and the quality checks."""
    apparatus = found.apparatus
    parameters = apparatus.parameters
    rows = [
        (
            parameter_quantity(parameters, name).words,
            parameter_quantity(parameters, name).symbol,
            measured_text(parameters, name),
        )
        for name in parameters.names
    ]
    resolved = apparatus.resolved_wavenumber / PER_MM
    rows += [
        ("method of division", "", found.solution.regulariser.name),
        ("resolved up to the wavenumber", "k", f"{resolved:.3g} rad/mm"),
        ("reconvolution with the deconvolved G", "", _misfit(found.solution.deconvolution.misfit)),
        ("reconvolution with the Gaussian", "", _misfit(found.solution.gaussian_misfit)),
    ]
    sensor = apparatus.sensor
    name = " ".join(part for part in (sensor.name, sensor.model) if part) or "the sensor"
    title = (
        f"Apparatus function of {name}, channel {sensor.channel} (± standard uncertainty, k = 1)"
    )
    return [Table(title, ("", "", ""), rows), checks_table(apparatus.checks)]


def _misfit(misfit: Misfit) -> str:
    return f"rms {misfit.relative_rms:.2%} of the largest signal, χ²/ν = {misfit.chi2_reduced:.3g}"


def rehearsal_json(
    stress: StressProfile | Contact, method: str, outputs: Sequence[Path]
) -> dict[str, Any]:
    """Return the object that ``calibrate --dry-run --json`` prints."""
    return {
        "schema_version": "1",
        "dry_run": True,
        "method": method,
        "reference": _origin(stress),
        "outputs": [str(path) for path in outputs],
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
    missing = f", {points.missing} missing" if points.missing else ""
    elasticity = f"E = {film.young_modulus / 1e6:.4g} MPa, Poisson's ratio {film.poisson_ratio:.4g}"
    rows = [
        ("scan", f"{scan.kind}, {points.u.size} points{missing}"),
        ("indenter", f"{scan.indenter.shape} of radius {scan.indenter.radius / MM:.4g} mm"),
        ("load", f"{scan.load:.4g} N"),
        ("film", f"{film.thickness / MM:.4g} mm, {elasticity}"),
        ("reference", _origin(stress)),
        ("method", method),
        *(("would write", str(path)) for path in outputs),
    ]
    return Table("A calibration would use", ("", ""), rows)


def _origin(stress: StressProfile | Contact) -> str:
    if isinstance(stress, Contact):
        return "the rod, solved on the film"
    if stress.source is not None:
        return stress.source.file_name
    return "the one in the scan" + (f" ({stress.solver})" if stress.solver else "")
