"""Measured stress as tables, mapping and arrays, as ``memscal apply`` prints it."""

from typing import Any

import numpy as np

from memscal.measurement.measure_stress import SHARED_SOURCES, pooled_force
from memscal.model import records
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
from memscal.model.quantities import MM, Quantity, by_name
from memscal.summaries import declared
from memscal.summaries.table import Table, checks_json, checks_table, texts_of, verdict

_NUMBERS = by_name(records.STRESS_NUMBERS.quantities)
_QUANTITIES = by_name(records.STRESS_PROFILE.quantities) | _NUMBERS
_POINTS = ("r", "x", "y", "s_zz", "s_zz_errors")
_SCALARS = tuple(name for name in _NUMBERS if not name.startswith("centre"))
_IN_JSON = [q for name, q in _NUMBERS.items() if not name.startswith("centre_y")]
_IN_JSON += [records.FORCE_BUDGET, records.MAXIMUM_BUDGET]
_POINTS_IN_JSON = [_QUANTITIES[name] for name in ("r", "x", "s_zz", "s_zz_errors")]


def mapping(stress: MeasuredStress) -> dict[str, Any]:
    """Return the object of ``apply --json`` without its files; the contract fixes its form."""
    applied = [quantity.read_in(stress.scans[0].reading) for quantity in records.APPLIED]
    return {
        **declared.members(applied, stress, **_force_over_load(stress)),
        "profiles": [
            {
                "scan": getattr(profile.scan.source, "file_name", None),
                **declared.members(
                    [quantity.read_in(profile.scan.reading) for quantity in _IN_JSON],
                    profile,
                    **_centre(profile),
                ),
                "stress": declared.members(_POINTS_IN_JSON, profile),
            }
            for profile in stress.profiles
        ],
        "overridden": list(stress.overridden),
        "checks": checks_json(stress.checks),
        "warnings": texts_of(stress.messages),
    }


def _force_over_load(stress: MeasuredStress) -> dict[str, Any]:
    ratio, u = pooled_force(stress.profiles)
    return {"force_over_load": ratio, "force_over_load_uncertainty": u}


def _centre(profile: MeasuredProfile) -> dict[str, Any]:
    """Return the centre along the scan, in m."""
    u = profile.centre_uncertainty[profile.axis]
    return {"centre": profile.centre[profile.axis], "centre_uncertainty": u}


def answer(stress: MeasuredStress) -> str:
    """Return how large the stress is, and whether the force is the load."""
    profiles = stress.profiles
    force = records.APPLIED[2]
    lightest = min(profiles, key=lambda profile: profile.load)
    strongest = max(profiles, key=lambda profile: profile.maximum)
    texts = [
        f"{declared.cell(_NUMBERS['maximum'], profile)} at {profile.load:.4g} N"
        for profile in ([lightest, strongest] if strongest is not lightest else [lightest])
    ]
    number = f"{len(profiles)} profile{'s' if len(profiles) > 1 else ''}"
    ratio = declared.cell(force, stress, **_force_over_load(stress))
    return (
        f"S_zz up to {', '.join(texts)}.\n"
        f"{number}: total force over applied load {ratio}. {verdict(stress.checks)}"
    )


def tables(stress: MeasuredStress) -> list[Table]:
    """Return the profiles, what holds for all of them, and the quality checks that matter."""
    load, *shown = (_NUMBERS[name] for name in ("load", "force", "maximum", "centre"))
    head = ("", load.heading, "state", *(quantity.heading for quantity in shown), "checks")
    rows = []
    marked = set()
    for i, profile in enumerate(stress.profiles):
        number = str(i + 1)
        failed = [c.kind for c in stress.checks if c.profile == number and not c.passed]
        if failed:
            marked.add(i)
        names = ", ".join(name.replace("_", " ") for name in failed)
        centre = _centre(profile)
        cells = [declared.cell(quantity, profile, unit="", **centre) for quantity in shown]
        state = profile.lubrication or "not stated"
        checks = f"FAILED: {names}" if failed else "passed"
        rows.append((number, f"{profile.load:.4g}", state, *cells, checks))
    film = stress.scans[0].film
    indenter = stress.scans[0].indenter
    title = (
        f"Stress measured at the base of a {film.thickness / MM:.4g} mm film under a "
        f"{indenter.shape} of radius {indenter.radius / MM:.4g} mm (± standard uncertainty, k = 1)"
    )
    # What checks all profiles, the force of each, and what failed.
    kinds = ("applied_force", "applied_force_all")
    checks_shown = [check for check in stress.checks if check.kind in kinds or not check.passed]
    ratio = _force_over_load(stress)
    shown = [quantity.read_in(stress.scans[0].reading) for quantity in records.APPLIED[::2]]
    numbers = [(q.words, declared.cell(q, stress, **ratio)) for q in shown]
    points = sum(profile.r.size for profile in stress.profiles)
    farthest = max(float(profile.r[-1]) for profile in stress.profiles)
    places = ("points", f"{points}, from the axis to {farthest / MM:.3g} mm")
    common = Table("All profiles", ("", ""), [*numbers, places])
    profiles = Table(title, head, rows, frozenset(marked), labels=3)
    return [profiles, common, checks_table(checks_shown)]


def dataset(stress: MeasuredStress) -> declared.Dataset:
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
    return declared.labelled_dataset(_QUANTITIES.values(), values, axes)


def frame(stress: MeasuredStress) -> declared.DataFrame:
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
    return declared.data_frame((number, *(_QUANTITIES[name] for name in names)), values)


def correlated(stress: MeasuredStress) -> dict[str, Any]:
    """Return force, maximum, centre and baseline of each profile, numbered from one."""
    # Forces are correlated by the sources that profiles share; no other covariance is known.
    names = []
    values = []
    spread = []
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
    return declared.correlated_numbers(names, values, covariance)
