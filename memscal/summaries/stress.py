"""Measured stress as the tables and the JSON object that ``memscal apply`` prints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from memscal.measurement.measure_stress import pooled_force
from memscal.measurement.restoration import Comparison, Restoration
from memscal.mechanics.contact import Contact
from memscal.model.checks import QualityCheck
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.notation import format_measured
from memscal.model.quantities import KPA, MM, MV, PER_MM
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of

__all__ = ["restoration_json", "restoration_tables", "stress_json", "stress_tables"]

_PER_PASCAL = 1e-3
"""Volts per pascal in mV/Pa."""


def stress_json(found: MeasuredStress, output: Path) -> dict[str, Any]:
    """Return the object that ``apply --json`` prints; its form is part of the contract."""
    ratio, spread = pooled_force(found.profiles)
    return {
        "schema_version": "1",
        "output": str(output),
        "conversion_constant": {
            "value": finite(found.conversion_constant / _PER_PASCAL),
            "standard_uncertainty": finite(found.conversion_constant_uncertainty / _PER_PASCAL),
            "unit": "mV/Pa",
        },
        "force_over_load": {"value": finite(ratio), "standard_uncertainty": finite(spread)},
        "profiles": [_profile_json(profile) for profile in found.profiles],
        "overridden": list(found.overridden),
        "checks": checks_json(found.checks),
        "warnings": texts_of(found.messages),
    }


def _profile_json(profile: MeasuredProfile) -> dict[str, Any]:
    source = profile.scan.source
    quantities = (
        ("force", profile.force, profile.force_uncertainty, "N"),
        ("maximum", profile.maximum / KPA, profile.maximum_uncertainty / KPA, "kPa"),
        ("centre", *_centre(profile), "mm"),
        ("baseline", profile.baseline / MV, profile.baseline_uncertainty / MV, "mV"),
    )
    return {
        "scan": None if source is None else source.file_name,
        "load": {"value": finite(profile.load), "unit": "N"},
        "lubrication": profile.lubrication,
        **{
            name: {"value": finite(value), "standard_uncertainty": finite(u), "unit": unit}
            for name, value, u, unit in quantities
        },
        "force_budget": {source: finite(u) for source, u in profile.force_budget.items()},
        "maximum_budget_kpa": {
            source: finite(u / KPA) for source, u in profile.maximum_budget.items()
        },
        "stress": {
            "r_mm": [finite(r / MM) for r in profile.r],
            "x_mm": [finite(x / MM) for x in profile.x],
            "s_zz_kpa": [finite(s / KPA) for s in profile.s_zz],
            "s_zz_errors_kpa": [finite(u / KPA) for u in profile.s_zz_errors],
        },
    }


def stress_tables(found: MeasuredStress) -> list[Table]:
    """Return the profiles, what holds for all of them, and the quality checks that matter."""
    head = ("", "load", "state", "total force", "maximum of S_zz", "centre", "checks")
    rows, marked = [], set()
    for i, profile in enumerate(found.profiles):
        failed = [check.kind for check in _checks_of(found, i) if not check.passed]
        if failed:
            marked.add(i)
        names = ", ".join(name.replace("_", " ") for name in failed)
        rows.append(
            (
                str(i + 1),
                f"{profile.load:.4g} N",
                profile.lubrication or "not stated",
                format_measured(profile.force, profile.force_uncertainty, "N"),
                format_measured(profile.maximum / KPA, profile.maximum_uncertainty / KPA, "kPa"),
                format_measured(*_centre(profile), "mm"),
                f"FAILED: {names}" if failed else "passed",
            )
        )
    film, indenter = found.scans[0].film, found.scans[0].indenter
    title = (
        f"Stress measured at the base of a {film.thickness / MM:.4g} mm film under a "
        f"{indenter.shape} of radius {indenter.radius / MM:.4g} mm (± standard uncertainty, k = 1)"
    )
    checks = checks_table(_shown(found))
    return [
        Table(title, head, rows, frozenset(marked)),
        Table("All profiles", ("", ""), _common(found)),
        checks,
    ]


def _common(found: MeasuredStress) -> list[tuple[str, str]]:
    a, u = found.conversion_constant, found.conversion_constant_uncertainty
    ratio, spread = pooled_force(found.profiles)
    points = sum(profile.r.size for profile in found.profiles)
    return [
        ("conversion constant A", format_measured(a / _PER_PASCAL, u / _PER_PASCAL, "mV/Pa")),
        ("total force over applied load", format_measured(ratio, spread)),
        ("points", f"{points}, from the axis to {_farthest(found) / MM:.3g} mm"),
    ]


def _farthest(found: MeasuredStress) -> float:
    return float(max(profile.r[-1] for profile in found.profiles))


def _checks_of(found: MeasuredStress, number: int) -> list[QualityCheck]:
    return [check for check in found.checks if check.profile == str(number + 1)]


def _shown(found: MeasuredStress) -> list[QualityCheck]:
    """Return what checks all profiles, the force of each, and what failed."""
    return [
        check
        for check in found.checks
        if check.kind in ("applied_force", "applied_force_all") or not check.passed
    ]


def _centre(profile: MeasuredProfile) -> tuple[float, float]:
    """Centre along the scan and its standard uncertainty, in mm."""
    axis = profile.axis
    return profile.centre[axis] / MM, profile.centre_uncertainty[axis] / MM


_SHOWN_RADII = 9
_TAIL = 0.01


def _quantities(found: Restoration) -> list[tuple[str, str, float, float, str]]:
    """Name in JSON, words, value, standard uncertainty and unit of each number."""
    axis, error = float(found.stress(0.0)), float(found.stress_uncertainty(0.0))
    rows = [
        ("force", "total force", found.force, found.force_uncertainty, "N"),
        ("stress_on_axis", "stress on the axis", axis / KPA, error / KPA, "kPa"),
    ]
    named = zip(("centre", "centre_y"), found.points.free[0], strict=True)
    for i, (name, free) in enumerate(named):
        if free:
            words = "centre of the scan" + (" along y" if i else "")
            value, spread = found.centre[i] / MM, found.centre_uncertainty[i] / MM
            rows.append((name, words, float(value), float(spread), "mm"))
    baseline, spread = found.baseline / MV, found.baseline_uncertainty / MV
    return [*rows, ("baseline", "baseline", baseline, spread, "mV")]


def restoration_json(
    found: Restoration, compared: Comparison | None, output: Path | None
) -> dict[str, Any]:
    """Return the object that ``restore --json`` prints; its form is part of the contract."""
    errors = np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
    return {
        "schema_version": "1",
        "output": None if output is None else str(output),
        "load": {"value": finite(found.scan.load), "unit": "N"},
        **{
            name: {"value": finite(value), "standard_uncertainty": finite(u), "unit": unit}
            for name, _, value, u, unit in _quantities(found)
        },
        "force_budget": {k: finite(v) for k, v in found.force_budget.items()},
        "resolved_wavenumber": {
            "value": finite(found.resolved_wavenumber / PER_MM),
            "unit": "rad/mm",
        },
        "reconvolution": {
            "chi2_reduced": finite(found.chi_square / found.degrees),
            "degrees": finite(found.degrees),
        },
        "stress": {
            "r_mm": [finite(r / MM) for r in found.r],
            "sigma_zz_kpa": [finite(s / KPA) for s in found.sigma_zz],
            "sigma_zz_errors_kpa": [finite(u / KPA) for u in errors],
        },
        "calculated": None if compared is None else _comparison_json(compared),
        "checks": checks_json(found.checks),
        "warnings": texts_of(found.messages),
    }


def _comparison_json(compared: Comparison) -> dict[str, Any]:
    return {
        "origin": _origin(compared),
        "chi2_reduced": finite(compared.chi_square),
        "degrees": compared.degrees,
        "p_value": finite(compared.p_value),
        "largest_difference": finite(compared.difference),
        "share_within_95_percent": finite(compared.within),
    }


def restoration_tables(found: Restoration, compared: Comparison | None) -> list[Table]:
    """Return the numbers, the stress at a few radii, and the quality checks."""
    rows = [(words, format_measured(v, u, unit)) for _, words, v, u, unit in _quantities(found)]
    rows[:0] = [("load", f"{found.scan.load:.4g} N")]
    rows += [
        ("resolved up to the wavenumber", f"{found.resolved_wavenumber / PER_MM:.3g} rad/mm"),
        ("restored stress blurred again", f"χ²/ν = {found.chi_square / found.degrees:.3g}"),
    ]
    if compared is not None:
        rows += [
            (
                f"{_origin(compared)}, blurred",
                f"χ²/ν = {compared.chi_square:.3g}, p = {compared.p_value:.2g}",
            ),
            (
                f"{_origin(compared)}, beside the restored",
                f"within 95 % bounds at {compared.within:.0%} of radii",
            ),
        ]
    indenter, film = found.scan.indenter, found.scan.film
    title = (
        f"Stress at the base of a {film.thickness / MM:.4g} mm film under a {indenter.shape} of "
        f"radius {indenter.radius / MM:.4g} mm (± standard uncertainty, k = 1)"
    )
    checks = checks_table(found.checks)
    return [Table(title, ("", ""), rows), _stress_table(found, compared), checks]


def _stress_table(found: Restoration, compared: Comparison | None) -> Table:
    """Return the stress from the axis to where it has decayed."""
    strong = np.abs(found.sigma_zz) > _TAIL * float(np.abs(found.sigma_zz).max())
    last = float(found.r[np.flatnonzero(strong)[-1]])
    step = max(round(last / MM / (_SHOWN_RADII - 1) * 4) / 4, 0.05) * MM
    radii = np.arange(_SHOWN_RADII) * step
    radii = radii[radii <= found.r[-1]]
    stress, errors = found.stress(radii) / KPA, found.stress_uncertainty(radii) / KPA
    head = ["r (mm)", "restored"] + (["calculated"] if compared is not None else [])
    rows = []
    for r, s, u in zip(radii, stress, errors, strict=True):
        row = [f"{r / MM:.4g}", format_measured(float(s), float(u), "kPa")]
        if compared is not None:
            row.append(f"{np.interp(r, found.r, compared.sigma_zz) / KPA:.4g} kPa")
        rows.append(row)
    return Table("Normal stress at the base, positive in compression", head, rows)


def _origin(compared: Comparison) -> str:
    if isinstance(compared.stress, Contact):
        return "calculated without friction"
    source = compared.stress.source
    return "expected stress" if source is None else f"expected stress ({source.file_name})"
