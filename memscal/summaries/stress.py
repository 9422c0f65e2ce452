"""Measured stress as tables, mapping and arrays, as ``memscal apply`` prints it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from memscal.measurement.measure_stress import SHARED_SOURCES, pooled_force
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.notation import format_measured
from memscal.model.quantities import KPA, MM, MV, Quantity, by_name
from memscal.model.records import STRESS_NUMBERS, STRESS_PROFILE
from memscal.summaries.interop import (
    correlated_numbers,
    data_frame,
    labelled_dataset,
    quantity_json,
)
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray

_PER_PASCAL = 1e-3
"""Volts per pascal in mV/Pa."""
_QUANTITIES = by_name([*STRESS_PROFILE.quantities, *STRESS_NUMBERS.quantities])
_POINTS = ("r", "x", "y", "s_zz", "s_zz_errors")
_SCALARS = ("load", "force", "force_uncertainty", "maximum", "maximum_uncertainty", "baseline",
            "baseline_uncertainty", "contact_radius", "lubrication")  # fmt: skip


def mapping(stress: MeasuredStress) -> dict[str, Any]:
    """Return the object of ``apply --json`` without its files; the contract fixes its form."""
    ratio, spread = pooled_force(stress.profiles)
    a, u = stress.conversion_constant, stress.conversion_constant_uncertainty
    return {
        "conversion_constant": quantity_json(a / _PER_PASCAL, "mV/Pa", u / _PER_PASCAL),
        "force_over_load": {"value": finite(ratio), "standard_uncertainty": finite(spread)},
        "profiles": [_profile_json(profile) for profile in stress.profiles],
        "overridden": list(stress.overridden),
        "checks": checks_json(stress.checks),
        "warnings": texts_of(stress.messages),
    }


def _profile_json(profile: MeasuredProfile) -> dict[str, Any]:
    baseline, baseline_error = profile.baseline / MV, profile.baseline_uncertainty / MV
    centre, centre_error = _centre(profile)
    return {
        "scan": getattr(profile.scan.source, "file_name", None),
        "load": quantity_json(profile.load, "N"),
        "lubrication": profile.lubrication,
        "force": quantity_json(profile.force, "N", profile.force_uncertainty),
        "maximum": quantity_json(profile.maximum / KPA, "kPa", profile.maximum_uncertainty / KPA),
        "centre": quantity_json(centre, "mm", centre_error),
        "baseline": quantity_json(baseline, "mV", baseline_error),
        "force_budget": {source: finite(u) for source, u in profile.force_budget.items()},
        "maximum_budget_kpa": {name: finite(u / KPA) for name, u in profile.maximum_budget.items()},
        "stress": {
            "r_mm": [finite(r / MM) for r in profile.r],
            "x_mm": [finite(x / MM) for x in profile.x],
            "s_zz_kpa": [finite(s / KPA) for s in profile.s_zz],
            "s_zz_errors_kpa": [finite(u / KPA) for u in profile.s_zz_errors],
        },
    }


def tables(stress: MeasuredStress) -> list[Table]:
    """Return the profiles, what holds for all of them, and the quality checks that matter."""
    head = ("", "load", "state", "total force", "maximum of S_zz", "centre", "checks")
    rows, marked = [], set()
    for i, profile in enumerate(stress.profiles):
        number = str(i + 1)
        failed = [c.kind for c in stress.checks if c.profile == number and not c.passed]
        if failed:
            marked.add(i)
        names = ", ".join(name.replace("_", " ") for name in failed)
        rows.append(
            (
                number,
                f"{profile.load:.4g} N",
                profile.lubrication or "not stated",
                format_measured(profile.force, profile.force_uncertainty, "N"),
                format_measured(profile.maximum / KPA, profile.maximum_uncertainty / KPA, "kPa"),
                format_measured(*_centre(profile), "mm"),
                f"FAILED: {names}" if failed else "passed",
            )
        )
    film, indenter = stress.scans[0].film, stress.scans[0].indenter
    title = (
        f"Stress measured at the base of a {film.thickness / MM:.4g} mm film under a "
        f"{indenter.shape} of radius {indenter.radius / MM:.4g} mm (± standard uncertainty, k = 1)"
    )
    # What checks all profiles, the force of each, and what failed.
    kinds = ("applied_force", "applied_force_all")
    checks = [check for check in stress.checks if check.kind in kinds or not check.passed]
    common = Table("All profiles", ("", ""), _common_rows(stress))
    return [Table(title, head, rows, frozenset(marked)), common, checks_table(checks)]


def _common_rows(stress: MeasuredStress) -> list[tuple[str, str]]:
    a, u = stress.conversion_constant, stress.conversion_constant_uncertainty
    points = sum(profile.r.size for profile in stress.profiles)
    farthest = max(float(profile.r[-1]) for profile in stress.profiles)
    return [
        ("conversion constant A", format_measured(a / _PER_PASCAL, u / _PER_PASCAL, "mV/Pa")),
        ("total force over applied load", format_measured(*pooled_force(stress.profiles))),
        ("points", f"{points}, from the axis to {farthest / MM:.3g} mm"),
    ]


def _centre(profile: MeasuredProfile) -> tuple[float, float]:
    """Centre along the scan and its standard uncertainty, in mm."""
    axis = profile.axis
    return profile.centre[axis] / MM, profile.centre_uncertainty[axis] / MM


def dataset(stress: MeasuredStress) -> xarray.Dataset:
    """Return the points as (profile, point), NaN beyond the last of a profile, and its numbers."""
    profiles = stress.profiles
    shape = (len(profiles), max(profile.r.size for profile in profiles))
    values: dict[str, Any] = {name: [getattr(p, name) for p in profiles] for name in _SCALARS}
    for name in _POINTS:
        values[name] = np.full(shape, np.nan)
        for row, profile in zip(values[name], profiles, strict=True):
            row[: profile.r.size] = getattr(profile, name)
    for i, name in enumerate(("centre", "centre_y")):
        values[name] = [p.centre[i] for p in profiles]
        values[f"{name}_uncertainty"] = [p.centre_uncertainty[i] for p in profiles]
    axes = dict.fromkeys(values, ("profile",)) | dict.fromkeys(_POINTS, ("profile", "point"))
    return labelled_dataset(_QUANTITIES.values(), values, axes)


def frame(stress: MeasuredStress) -> pd.DataFrame:
    """Return one row for each point, with the number, load and lubrication of its profile."""
    sizes = [profile.r.size for profile in stress.profiles]
    values: dict[str, Any] = {
        name: np.concatenate([getattr(profile, name) for profile in stress.profiles])
        for name in _POINTS
    }
    values["profile"] = np.repeat(np.arange(1, len(sizes) + 1), sizes)
    for name in ("load", "lubrication"):
        values[name] = np.repeat([getattr(profile, name) for profile in stress.profiles], sizes)
    names = ("load", "lubrication", *_POINTS)
    number = Quantity("profile", "number", "number of the profile")
    return data_frame((number, *(_QUANTITIES[name] for name in names)), values)


def correlated(stress: MeasuredStress) -> dict[str, Any]:
    """Return force, maximum, centre and baseline of each profile, numbered from one.

    Forces are correlated by the sources that profiles share, as in the check of all forces.  No
    other covariance is known: all other pairs are taken as independent.
    """
    names, values, spread = [], [], []
    for i, profile in enumerate(stress.profiles, start=1):
        numbers = {
            "force": (profile.force, profile.force_uncertainty),
            "maximum": (profile.maximum, profile.maximum_uncertainty),
            "centre": (profile.centre[profile.axis], profile.centre_uncertainty[profile.axis]),
            "baseline": (profile.baseline, profile.baseline_uncertainty),
        }
        names += [f"{name}_{i}" for name in numbers]
        values += [float(value) for value, _ in numbers.values()]
        spread += [float(u) for _, u in numbers.values()]
    covariance = np.diag(np.square(spread))
    forces = slice(0, None, len(names) // len(stress.profiles))
    for source in SHARED_SOURCES:
        shared = np.array([profile.force_budget.get(source, 0.0) for profile in stress.profiles])
        covariance[forces, forces] += np.outer(shared, shared) - np.diag(shared**2)
    return correlated_numbers(names, values, covariance)
