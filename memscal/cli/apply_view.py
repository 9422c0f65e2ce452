"""Measured stress as the tables and the JSON object that ``memscal apply`` prints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from memscal.cli.output import finite, texts_of
from memscal.cli.quality_view import checks_json, checks_table
from memscal.cli.tables import Table
from memscal.measurement.stress_checks import pooled_force
from memscal.model.checks import QualityCheck
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.notation import format_measured
from memscal.model.quantities import KPA, MM, MV

__all__ = ["stress_json", "stress_tables"]

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
