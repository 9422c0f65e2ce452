"""Measured stress as tables, mapping and arrays, as ``memscal apply`` prints it."""

from itertools import zip_longest

import numpy as np

from memscal.measurement.measure_stress import SHARED_SOURCES, pooled_force
from memscal.model import records
from memscal.model.arrays import Values
from memscal.model.indenter import RoundIndenter
from memscal.model.measured_stress import MeasuredProfile, MeasuredScan, MeasuredStress
from memscal.model.quantities import MM, Quantity, by_name
from memscal.model.scan import Scan
from memscal.summaries import declared
from memscal.summaries.table import Table, checks_json, checks_table, texts_of, verdict

_NUMBERS = by_name(records.STRESS_NUMBERS.quantities)
_QUANTITIES = by_name(records.STRESS_PROFILE.quantities) | _NUMBERS
_POINTS = ("r", "x", "y", "s_zz", "s_zz_errors")
_SCALARS = tuple(name for name in _NUMBERS if not name.startswith("centre"))
_IN_JSON = [q for name, q in _NUMBERS.items() if not name.startswith("centre_y")]
_IN_JSON += [records.FORCE_BUDGET, records.MAXIMUM_BUDGET]
_POINTS_IN_JSON = [_QUANTITIES[name] for name in ("r", "x", "s_zz", "s_zz_errors")]


def mapping(stress: MeasuredStress) -> Values:
    """Return the object of ``apply --json`` without its files; the contract fixes its form."""
    applied = [quantity.read_in(stress.scans[0].reading) for quantity in records.APPLIED]
    profiles = []
    for profile in stress.profiles:
        numbers = [quantity.read_in(profile.scan.reading) for quantity in _IN_JSON]
        if profile.direction:
            numbers += records.SLID.quantities
        profiles.append(
            {
                "scan": getattr(profile.scan.source, "file_name", None),
                **declared.members(numbers, profile, **_centre(profile)),
                "stress": declared.members(_POINTS_IN_JSON, profile),
            }
        )
    return {
        "schema_version": "1",
        **declared.members(applied, stress, **_force_over_load(stress)),
        "profiles": profiles,
        "overridden": list(stress.overridden),
        "checks": checks_json(stress.checks),
        "warnings": texts_of(stress.messages),
    }


def _force_over_load(stress: MeasuredStress) -> Values:
    ratio, u = pooled_force(stress.profiles)
    return {"force_over_load": ratio, "force_over_load_uncertainty": u}


def _centre(profile: MeasuredProfile) -> Values:
    """Return the centre along the scan, in m."""
    u = profile.centre_uncertainty[profile.axis]
    return {"centre": profile.centre[profile.axis], "centre_uncertainty": u}


def answer(stress: MeasuredStress) -> str:
    """Return how large the stress is, and whether the force is the load."""
    profiles = stress.profiles
    lightest = min(profiles, key=lambda profile: profile.load)
    strongest = max(profiles, key=lambda profile: profile.maximum)
    maxima = _maximum(lightest)
    if strongest is not lightest:
        maxima += f", {_maximum(strongest)}"
    number = f"{len(profiles)} profile{'s' if len(profiles) > 1 else ''}"
    ratio = declared.cell(records.APPLIED[2], stress, **_force_over_load(stress))
    return (
        f"S_zz up to {maxima}.\n"
        f"{number}: total force over applied load {ratio}. {verdict(stress.checks)}"
    )


def _maximum(profile: MeasuredProfile) -> str:
    return f"{declared.cell(_NUMBERS['maximum'], profile)} at {profile.load:.4g} N"


def tables(stress: MeasuredStress) -> list[Table]:
    """Return the profiles, what holds for all of them, and the quality checks that matter."""
    kinds = ("applied_force", "applied_force_all")
    # What checks all profiles, the force of each, and what failed.
    shown = [check for check in stress.checks if check.kind in kinds or not check.passed]
    return [_profiles_table(stress), _common_table(stress), checks_table(shown)]


def _profiles_table(stress: MeasuredStress) -> Table:
    quantities = [_NUMBERS[name] for name in ("force", "maximum", "centre")]
    headings = [quantity.heading for quantity in quantities]
    rows = []
    marked = set()
    for i, profile in enumerate(stress.profiles):
        row = [str(i + 1), f"{profile.load:.4g}", profile.state or "not stated"]
        centre = _centre(profile)
        row += [declared.cell(quantity, profile, unit="", **centre) for quantity in quantities]
        checks = [check for check in stress.checks if check.profile == row[0]]
        failed = [check.kind.replace("_", " ") for check in checks if not check.passed]
        if failed:
            marked.add(i)
        rows.append([*row, f"FAILED: {', '.join(failed)}" if failed else "passed"])
    pressed = contact_words(stress.scans[0])
    title = f"Stress measured at the base of {pressed} (± standard uncertainty, k = 1)"
    head = ("", _NUMBERS["load"].heading, "state", *headings, "checks")
    return Table(title, head, rows, frozenset(marked), labels=3)


def contact_words(scan: Scan | MeasuredScan) -> str:
    """Return what was pressed on what film."""
    film = scan.film
    indenter = scan.indenter
    if film is None or not isinstance(indenter, RoundIndenter):
        return "the film"
    pressed = f"a {indenter.shape} of radius {indenter.radius / MM:.4g} mm"
    return f"a {film.thickness / MM:.4g} mm film under {pressed}"


def _common_table(stress: MeasuredStress) -> Table:
    ratio = _force_over_load(stress)
    rows = []
    for quantity in records.APPLIED[::2]:
        shown = quantity.read_in(stress.scans[0].reading)
        rows.append((shown.words, declared.cell(shown, stress, **ratio)))
    points = sum(profile.r.size for profile in stress.profiles)
    farthest = max(profile.r[-1] for profile in stress.profiles)
    rows.append(("points", f"{points}, from the axis to {farthest / MM:.3g} mm"))
    return Table("All profiles", ("", ""), rows)


def dataset(stress: MeasuredStress) -> declared.Dataset:
    """Return the points as (profile, point), NaN beyond the last of a profile, and its numbers."""
    profiles = stress.profiles
    values: Values = {name: [getattr(p, name) for p in profiles] for name in _SCALARS}
    for name in _POINTS:
        rows = [getattr(profile, name) for profile in profiles]
        values[name] = np.transpose([*zip_longest(*rows, fillvalue=np.nan)])
    for i, name in enumerate(("centre", "centre_y")):
        values[name] = [p.centre[i] for p in profiles]
        values[f"{name}_uncertainty"] = [p.centre_uncertainty[i] for p in profiles]
    axes = dict.fromkeys(values, ("profile",)) | dict.fromkeys(_POINTS, ("profile", "point"))
    return declared.labelled_dataset(_QUANTITIES.values(), values, axes)


def frame(stress: MeasuredStress) -> declared.DataFrame:
    """Return one row for each point, with the number, load and lubrication of its profile."""
    sizes = [profile.r.size for profile in stress.profiles]
    values: Values = {"profile": np.repeat(np.arange(1, len(sizes) + 1), sizes)}
    for name in _POINTS:
        values[name] = np.concatenate([getattr(profile, name) for profile in stress.profiles])
    for name in ("load", "lubrication"):
        values[name] = np.repeat([getattr(profile, name) for profile in stress.profiles], sizes)
    number = Quantity("profile", "number", "number of the profile")
    columns = [_QUANTITIES[name] for name in ("load", "lubrication", *_POINTS)]
    return declared.data_frame((number, *columns), values)


def correlated(stress: MeasuredStress) -> Values:
    """Return force, maximum, centre and baseline of each profile, numbered from one."""
    # Forces are correlated by the sources that profiles share; no other covariance is known.
    names = []
    values = []
    spread = []
    for i, profile in enumerate(stress.profiles, start=1):
        for name in ("force", "maximum", "centre", "baseline"):
            value = getattr(profile, name)
            u = getattr(profile, f"{name}_uncertainty")
            if name == "centre":
                value = value[profile.axis]
                u = u[profile.axis]
            names.append(f"{name}_{i}")
            values.append(value)
            spread.append(u)
    covariance = np.diag(np.square(spread))
    forces = slice(0, None, 4)
    for source in SHARED_SOURCES:
        shared = np.array([profile.force_budget.get(source, 0.0) for profile in stress.profiles])
        covariance[forces, forces] += np.outer(shared, shared) - np.diag(shared**2)
    return declared.correlated_numbers(names, values, covariance)
