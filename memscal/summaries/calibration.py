"""A calibration as the tables and the JSON object that ``memscal calibrate`` prints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from memscal.calibration.calibrate import Calibration
from memscal.calibration.monte_carlo import Comparison, MonteCarlo
from memscal.calibration.stages import Misfit
from memscal.calibration.sweep import Sweep
from memscal.estimation.points import ScanPoints
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray
from memscal.model.quantities import (
    MM,
    MV,
    PER_MM,
    estimated_quantity,
    measured_text,
    parameter_quantity,
)
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of

__all__ = [
    "calibration_json",
    "calibration_tables",
    "monte_carlo_json",
    "monte_carlo_table",
    "rehearsal_json",
    "rehearsal_table",
    "sweep_json",
    "sweep_table",
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


def monte_carlo_table(found: MonteCarlo) -> Table:
    """Return each parameter's standard uncertainty by the budget and by draws."""
    rows = []
    for each in found.comparisons:
        shown = estimated_quantity(each.name)
        scale = shown.scale
        low, high = (end / scale for end in each.symmetric)
        rows.append(
            (
                f"{shown.words} ({shown.unit})",
                f"{each.first_order / scale:.2g}",
                f"{each.uncertainty / scale:.2g}",
                f"{low:.4g} to {high:.4g}",
                "yes" if each.agrees else "no",
            )
        )
    apart = frozenset(i for i, each in enumerate(found.comparisons) if not each.agrees)
    title = (
        f"What scatters, by {found.draws} draws of {_in_words(found.sources)} (seed {found.seed})"
    )
    head = ("", "u by the budget", "u of the draws", "95 % interval", "agrees")
    return Table(title, head, rows, apart)


def monte_carlo_json(found: MonteCarlo) -> dict[str, Any]:
    """Return the comparison of every parameter."""
    return {
        "draws": found.draws,
        "seed": found.seed,
        "sources": list(found.sources),
        "agrees": found.agrees,
        "parameters": {each.name: _one(each) for each in found.comparisons},
        "messages": texts_of(found.messages),
    }


def _one(each: Comparison) -> dict[str, Any]:
    shown = estimated_quantity(each.name)
    unit, scale = shown.unit, shown.scale
    return {
        "value": finite(each.value / scale),
        "mean": finite(each.mean / scale),
        "standard_uncertainty": finite(each.uncertainty / scale),
        "sampling_error": finite(each.sampling_error / scale),
        "interval_95": [finite(end / scale) for end in each.symmetric],
        "shortest_interval_95": [finite(end / scale) for end in each.shortest],
        "first_order": finite(each.first_order / scale),
        "stated": finite(each.stated / scale),
        "unit": unit.replace("²", "^2"),
        "agrees": each.agrees,
        "reason": each.reason,
    }


def _in_words(sources: tuple[str, ...]) -> str:
    words = [source.replace("_", " ") for source in sources]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def sweep_table(sweep: Sweep) -> Table:
    """Return every second amplitude: the exact expectation, and the middle draw of the seeds."""
    power = _power(sweep.conversion_constant / MV)
    scale = MV * 10.0**power
    rows = []
    for i in range(0, sweep.amplitude.size, 2):
        a, width = sweep.conversion_constant[i] / scale, sweep.gaussian_sigma_deconvolved[i] / MM
        rows.append(
            (
                f"{sweep.amplitude[i]:.3g}",
                _number(a, ".4f"),
                _number(width, ".4f"),
                _number(100 * sweep.relative_rms[i], ".3g"),
                _draws(sweep.seed_conversion_constant[i] / scale, ".4f"),
                _draws(sweep.seed_gaussian_sigma[i] / MM, ".4f"),
                _draws(100 * sweep.seed_relative_rms[i], ".3g"),
            )
        )
    count = sweep.seed_relative_rms.shape[1]
    title = (
        "Dependence on the noise amplitude (1 is the rule's choice): the expectation, and the "
        f"median of {count} draws"
    )
    head = ("amplitude", f"A (1e{power} mV/Pa)", "σ(G) (mm)", "rms (%)")
    return Table(title, (*head, "A, draws", "σ(G), draws", "rms, draws"), rows)


def sweep_json(sweep: Sweep) -> dict[str, Any]:
    """Return the whole sweep: lists over amplitudes, and lists of draws within them."""
    return {
        "amplitude": _series_of(sweep.amplitude, 1.0),
        "conversion_constant": _series(
            sweep.conversion_constant, sweep.seed_conversion_constant, MV, "mV/Pa"
        ),
        "gaussian_sigma_deconvolved": _series(
            sweep.gaussian_sigma_deconvolved, sweep.seed_gaussian_sigma, MM, "mm"
        ),
        "relative_rms": _series(sweep.relative_rms, sweep.seed_relative_rms, 1.0, "1"),
    }


def _series(expected: FloatArray, draws: FloatArray, scale: float, unit: str) -> dict[str, Any]:
    return {
        "values": _series_of(expected, scale),
        "draws": [_series_of(row, scale) for row in draws],
        "unit": unit,
    }


def _series_of(values: FloatArray, scale: float) -> list[float | None]:
    return [finite(float(value) / scale) for value in values]


def _power(values: FloatArray) -> int:
    """Return the power of ten to name in the head in place of a row of zeros."""
    known = np.abs(values[np.isfinite(values) & (values != 0)])
    return int(np.floor(np.log10(np.median(known)))) if known.size else 0


def _draws(values: FloatArray, form: str) -> str:
    known = values[np.isfinite(values)]
    return _number(float(np.median(known)), form) if known.size else "-"


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else "-"
