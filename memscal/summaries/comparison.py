"""Comparisons of measured with calculated stress, as tables, JSON, data frames and notes."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import (
    BoundedEstimate,
    FrictionComparison,
    LoadComparison,
    ShearComparison,
    percent,
)
from memscal.model import records
from memscal.model.arrays import FloatArray
from memscal.model.checks import Message
from memscal.model.measured_stress import MeasuredProfile
from memscal.model.notation import format_measured
from memscal.model.provenance import SourceFile
from memscal.model.quantities import MM, Quantity, measured
from memscal.summaries.declared import DataFrame, cell, columns, correlated_numbers, members, plain
from memscal.summaries.table import (
    Table,
    checks_json,
    checks_table,
    finite,
    texts_of,
    verdict,
    worst_checks,
)


def mapping(comparison: FrictionComparison | ShearComparison) -> dict[str, Any]:
    """Return what ``compare --json`` prints but for the files that it was given and wrote."""
    scans = [
        file_json(scan.source) | {"lubrication": scan.lubrication}
        for scan in comparison.measured.scans
    ]
    head = {"schema_version": "1", "scans": scans}
    tested = comparison.measured.noise_stated
    joint = [
        {"lubrication": lubrication, "loading": loading, **_estimate(estimate, tested)}
        for lubrication, loading, estimate in _joint(comparison)
    ]
    if isinstance(comparison, ShearComparison):
        loads = [
            {
                "lubrication": profile.lubrication,
                **members(records.STRESS_NUMBERS.quantities[:1], profile),
                "by_loading": {
                    loading or "given": _estimate(estimates[i], tested)
                    for loading, estimates in comparison.loads.items()
                },
            }
            for i, profile in enumerate(comparison.measured.profiles)
        ]
        return {**head, "loads": loads, "joint": joint, "warnings": texts_of(comparison.messages)}
    laws = comparison.interface
    sliding = comparison.macroscopic
    first = comparison.loads[comparison.loadings[0]]
    return {
        **head,
        "loads": [_load(i, comparison, load) for i, load in enumerate(first)],
        "joint": joint,
        **({"shear": file_json(comparison.shear.source)} if comparison.shear else {}),
        "dry_against_lubricated": [
            members(records.DRY_AGAINST_LUBRICATED, pair)
            for pair in comparison.dry_against_lubricated
        ],
        "interface": None if laws is None else laws.to_dict(),
        "macroscopic": None if sliding is None else _sliding(*sliding),
        "checks": checks_json(comparison.checks),
        "overridden": list(comparison.measured.overridden),
        "warnings": texts_of(comparison.messages),
    }


def frame(comparison: FrictionComparison | ShearComparison) -> DataFrame:
    """Return one row for each load and definition of the loading; open ends are infinite."""
    import pandas as pd

    rows = []
    tested = comparison.measured.noise_stated
    for loading in comparison.loadings:
        loads: Sequence[LoadComparison | BoundedEstimate] = comparison.loads[loading]
        for profile, load in zip(comparison.measured.profiles, loads, strict=True):
            row: dict[str, Any] = {"loading": loading, **columns(records.COMPARED_LOAD, profile)}
            if isinstance(load, BoundedEstimate):
                row |= _columns("friction", load, tested)
            else:
                row |= columns(records.COMPARED_MAXIMA, load) | {"bracketed": load.bracketed}
                row |= _columns("friction by maximum", load.by_maximum, tested)
                row |= _columns("friction by profile", load.by_profile, tested)
            rows.append(row)
    return pd.DataFrame(rows)


def _columns(name: str, estimate: BoundedEstimate, tested: bool) -> dict[str, float]:
    value = estimate.value
    u = estimate.standard_uncertainty
    return {
        name: math.nan if value is None else value,
        f"u({name})": math.nan if u is None else u,
        f"{name}, low": estimate.interval.low,
        f"{name}, high": estimate.interval.upper,
        f"{name}, chi2": estimate.least if tested else math.nan,
        f"{name}, degrees": estimate.degrees,
        f"{name}, p": estimate.p_value if tested else math.nan,
    }


#: Sources of uncertainty that scans of one sensor on one film do not share.
_OF_ONE_SCAN = {"noise", "load_scatter", "position"}


def correlated(comparison: FrictionComparison | ShearComparison) -> dict[str, Any]:
    """Return the coefficients of all loads that have a standard uncertainty, by their names."""
    # Two of one scan share all sources of uncertainty, those of dry and lubricated scans only what
    # is common to them; each source moves all coefficients to the same side.
    joint = [entry for entry in _joint(comparison) if entry[2].standard_uncertainty is not None]
    if not joint:
        problem = "No friction coefficient of all loads has a standard uncertainty."
        why = "; ".join(estimate.reason for *_, estimate in _joint(comparison))
        cure = "Use summary() or to_dict(), which give its bounds."
        raise InputError(problem, why=why, cure=cure)
    budgets = [
        {(name, lubrication if name in _OF_ONE_SCAN else ""): u for name, u in of.budget.items()}
        for lubrication, _, of in joint
    ]
    sources = {source for budget in budgets for source in budget}
    shares = np.array([[budget.get(source, 0.0) for source in sources] for budget in budgets])
    # The budget is linear; the standard uncertainty is that of the likelihood.
    shares /= np.maximum(np.linalg.norm(shares, axis=1, keepdims=True), np.finfo(float).tiny)
    spread = np.array([estimate.standard_uncertainty for *_, estimate in joint], dtype=np.float64)
    names = [
        "_".join(("friction", lubrication or "unstated", loading or "given"))
        for lubrication, loading, _ in joint
    ]
    values = [estimate.best for *_, estimate in joint]
    correlation = shares @ shares.T
    np.fill_diagonal(correlation, 1.0)
    return correlated_numbers(names, values, correlation * np.outer(spread, spread))


def _joint(
    comparison: FrictionComparison | ShearComparison,
) -> Iterator[tuple[str, str, BoundedEstimate]]:
    """Return lubrication, loading and coefficient of all loads together."""
    for lubrication, by_loading in comparison.joint.items():
        for loading, estimate in by_loading.items():
            yield lubrication, loading, estimate


def file_json(source: SourceFile | None) -> dict[str, Any]:
    """Return a file's name and digest as the JSON output holds them."""
    return {name: getattr(source, name, None) for name in ("file_name", "sha256")}


def _sliding(value: float, uncertainty: float | None) -> dict[str, Any]:
    values = {"friction": value, "friction_uncertainty": uncertainty}
    [member] = members(measured(records.FRICTION), None, **values).values()
    return dict(member)


def _load(index: int, comparison: FrictionComparison, load: LoadComparison) -> dict[str, Any]:
    return {
        "scan": getattr(load.profile.scan.source, "file_name", None),
        **members(records.COMPARED_LOAD, load.profile),
        **members(records.COMPARED_MAXIMA, load),
        "by_loading": {
            loading or "given": _by_loading(comparison, loads[index])
            for loading, loads in comparison.loads.items()
        },
    }


def _by_loading(comparison: FrictionComparison, load: LoadComparison) -> dict[str, Any]:
    names = [quantity.name for quantity in records.CALCULATED]
    mu = comparison.friction
    sticking = np.isinf(comparison.friction).tolist()
    return {
        "effective_friction_coefficient": {
            "by_maximum": _estimate(load.by_maximum, comparison.measured.noise_stated),
            "by_profile": _estimate(load.by_profile, comparison.measured.noise_stated),
        },
        "bracketed": finite(load.bracketed),
        "degrees": load.degrees,
        "profiles": [
            members(records.CALCULATED, None, **dict(zip(names, row, strict=True)))
            for row in zip(
                mu, sticking, load.p_max, load.chi_square, load.p_values, load.deviance, strict=True
            )
        ],
    }


def _estimate(estimate: BoundedEstimate, tested: bool) -> dict[str, Any]:
    # An estimated noise is as large as the misfit: a chi-square by it tests nothing.
    fit: dict[str, Any] = {} if tested else {"least": None, "p_value": None}
    return {
        **bounded_json(records.FRICTION, estimate),
        **members(records.ESTIMATE_FIT, estimate, **fit),
        "lubricated_beside": estimate.beside,
        "profile_likelihood": {
            "friction_coefficient": {"value": _shortened(estimate.values), "unit": "1"},
            "deviance": _shortened(estimate.deviance),
        },
    }


def _shortened(values: FloatArray) -> list[float | None]:
    return [finite(float(f"{value:.6g}")) for value in values]


#: Coefficients farther apart than this, in the bounded coordinate, leave much to interpolation.
_FAR = 0.26


def notes(comparison: FrictionComparison) -> Iterator[Message]:
    """Return what a user should know, each thing once."""
    laws = comparison.interface
    of_laws = () if laws is None else laws.messages
    texts = (
        f"{_which(lubrication, loading)}, all loads: {joint.reason}"
        for lubrication, loading, joint in _joint(comparison)
        if joint.reason
    )
    missing = (Message("no_value", text[:1].upper() + text[1:]) for text in texts)
    about = (*comparison.messages, *missing, *_about_profiles(comparison), *of_laws)
    yield from dict.fromkeys(about)


def _about_profiles(comparison: FrictionComparison) -> Iterator[Message]:
    friction = comparison.friction
    if friction[0] > 0:
        yield Message(
            "frictions",
            "No frictionless profile was calculated: p0_max is that of friction "
            f"{friction[0]:.3g}.",
        )
    for low, high in pairwise(float(mu) for mu in friction):
        apart = bounded(high, FRICTION_SCALE) - bounded(low, FRICTION_SCALE)
        if low < FRICTION_SCALE and apart > _FAR:
            yield Message(
                "frictions",
                f"Profiles between the friction coefficients {friction_name(low)} and "
                f"{friction_name(high)} are interpolated over a wide gap: values and intervals "
                "there are rough. More coefficients make them better.",
            )


def _which(lubrication: str, loading: str) -> str:
    words = [lubrication or "lubrication not stated", f"{loading} loading" if loading else ""]
    return ", ".join(word for word in words if word)


def answer(comparison: FrictionComparison | ShearComparison) -> str:
    """Return the coefficients of all loads with their intervals, and how the checks stand."""
    held = any(joint.beside for *_, joint in _joint(comparison))
    lines = []
    for lubrication, by_loading in comparison.joint.items():
        ways: dict[str, str] = {}
        for loading, joint in by_loading.items():
            ways.setdefault(str(joint), loading)
        if all(text.startswith("below") for text in ways):  # the larger bound holds for both
            ways = {max(ways, key=lambda text: float(text.split()[1])): ""}
        told = ", ".join(f"{text} {way}" if len(ways) > 1 else text for text, way in ways.items())
        equals = {"n": " is", "[": " in"}.get(told[0], " =" if told[0].isdigit() else "")
        level = "" if "%" in told else f" ({percent(joint.interval.level)})"
        beside = ", taken as 0" if held and lubrication == "lubricated" else ""
        name = (lubrication or "all contacts").capitalize()
        lines.append(f"{name}: μ{equals} {told}{level}{beside}.")
    checks = comparison.checks if isinstance(comparison, FrictionComparison) else ()
    return ("\n".join(lines) + f" {verdict(checks)}").strip()


_LABELS = ("", "state", "load (N)")
#: From here on chi-square is written without a decimal, and as a power of ten.
_WIDE = 100
_LONG = 1e5


def tables(comparison: FrictionComparison | ShearComparison) -> list[Table]:
    """Return what was measured, the friction by each loading, its budget, and the checks."""
    friction = [_friction_table(comparison, loading) for loading in comparison.loadings]
    if isinstance(comparison, ShearComparison):
        return [*friction, _budget_table(comparison)]
    return [
        _maxima_table(comparison),
        *friction,
        *(_likelihood_table(comparison, loading) for loading in comparison.loadings),
        _budget_table(comparison),
        _macroscopic_table(comparison),
        _lubrication_table(comparison),
        *([] if comparison.interface is None else comparison.interface.tables()),
        checks_table(worst_checks(comparison.checks)),
    ]


def _maxima_table(comparison: FrictionComparison) -> Table:
    sphere = comparison.measured.profiles[0].scan.indenter
    title = (
        f"Measured stress S = U/A and frictionless p0, {sphere.shape} of radius "
        f"{sphere.radius / MM:.4g} mm (± standard uncertainty)"
    )
    force = records.COMPARED_LOAD[2]
    maxima = records.COMPARED_MAXIMA[::2]
    head = [*_LABELS, *(quantity.heading for quantity in (force, *maxima))]
    rows = [
        [
            *_labels(i, load.profile),
            cell(force, load.profile, unit=""),
            *(cell(quantity, load, unit="") for quantity in maxima),
        ]
        for i, load in enumerate(comparison.loads[comparison.loadings[0]], start=1)
    ]
    return Table(title, head, rows, labels=len(_LABELS))


def _labels(number: int, profile: MeasuredProfile) -> tuple[str, str, str]:
    """Return number, state and load of a profile; checks and messages use the number."""
    return str(number), profile.lubrication or "not stated", f"{profile.load:.4g}"


def _friction_table(comparison: FrictionComparison | ShearComparison, loading: str) -> Table:
    level = next((percent(joint.interval.level) for *_, joint in _joint(comparison)), "95 %")
    way = f"{loading} loading" if loading else "profiles as given"
    shear = isinstance(comparison, ShearComparison)
    loads: Sequence[LoadComparison | BoundedEstimate] = comparison.loads[loading]
    tests = ["χ²/ν", "p"] if comparison.measured.noise_stated else []
    head = [*_LABELS, "by the shear", *tests]
    if not shear:
        head = [*_LABELS, "by the maximum", "by the profile", *tests, "bracketed"]
    rows = []
    fit = _fit if tests else lambda _: ()
    for lubrication, by_loading in comparison.joint.items():
        count = 0
        for i, load in enumerate(loads):
            profile = comparison.measured.profiles[i]
            if profile.lubrication != lubrication:
                continue
            count += 1
            labels = _labels(i + 1, profile)
            if isinstance(load, BoundedEstimate):
                rows.append([*labels, str(load), *fit(load)])
            else:
                cells = [str(load.by_maximum), str(load.by_profile), *fit(load.by_profile)]
                rows.append([*labels, *cells, f"{100 * load.bracketed:.0f} %"])
        sheared = isinstance(comparison, FrictionComparison) and comparison.shear is not None
        if count > 1 or sheared:
            joint = by_loading[loading]
            name = lubrication or "not stated"
            name += " + lubricated" if joint.beside else ""
            name += ", with shear" if sheared else ""
            cells = [str(joint), *fit(joint)]
            rows.append(["", name, "all", *(cells if shear else ["", *cells, ""])])
    title = f"Effective friction coefficient, {way} [{level} interval]"
    return Table(title, head, rows, labels=len(_LABELS))


def _fit(reading: BoundedEstimate) -> tuple[str, str]:
    if reading.degrees <= 0:
        return "", ""
    return f"{reading.least / reading.degrees:.2f}", f"{reading.p_value:.2g}"


def _likelihood_table(comparison: FrictionComparison, loading: str) -> Table:
    """Return what each load says of each calculated profile."""
    way = f"{loading} loading" if loading else "profiles as given"
    rows = [
        [*_labels(i, load.profile), f"{load.degrees}", *(_short(float(d)) for d in load.deviance)]
        for i, load in enumerate(comparison.loads[loading], start=1)
    ]
    head = [*_LABELS, "ν", *(friction_name(float(mu)) for mu in comparison.friction)]
    title = f"-2 ln(p/p_max) of each profile by friction coefficient, {way}"
    return Table(title, head, rows, labels=len(_LABELS))


def _short(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    if value >= _LONG:
        return f"{value:.0e}".replace("e+0", "e")
    return f"{value:.1f}" if value < _WIDE else f"{value:.0f}"


def _budget_table(comparison: FrictionComparison | ShearComparison) -> Table:
    columns = {
        _which(lubrication, loading).removesuffix(" loading"): joint
        for lubrication, loading, joint in _joint(comparison)
        if joint.value is not None and joint.budget
    }
    rows = [
        [name.replace("_", " "), *(_share(joint.budget.get(name)) for joint in columns.values())]
        for name in dict.fromkeys(name for joint in columns.values() for name in joint.budget)
    ]
    if rows:
        totals = [joint.standard_uncertainty for joint in columns.values()]
        rows.append(["standard uncertainty", *(_share(total) for total in totals)])
    title = "Contributions to the standard uncertainty of the coefficient of all loads"
    return Table(title, ["source", *columns], rows)


def _share(value: float | None) -> str:
    if value is None:
        return "-"
    return "0" if value == 0 else f"{value:.2g}"


def _macroscopic_table(comparison: FrictionComparison) -> Table:
    if comparison.macroscopic is None:
        return Table("", ("", ""), [])
    value, u = comparison.macroscopic
    title = f"Beside the macroscopic friction coefficient, {format_measured(value, u)}"
    rows = []
    for lubrication, loading, joint in _joint(comparison):
        side = "below" if value < joint.interval.low else "above"
        place = "within" if joint.interval.holds(value) else side
        interval = f"{place} the {percent(joint.interval.level)} interval"
        rows.append([_which(lubrication, loading), str(joint), interval])
    return Table(title, ["all loads of", "effective coefficient", "macroscopic one"], rows)


def _lubrication_table(comparison: FrictionComparison) -> Table:
    load, maximum, _, relative, *_ = records.DRY_AGAINST_LUBRICATED
    rows = [
        [
            f"{pair.load:.4g}",
            cell(maximum, pair, unit=""),
            format_measured(100 * pair.relative, 100 * pair.relative_uncertainty, "%"),
            f"{pair.chi_square / pair.degrees:.2f}",
            f"{pair.p_value:.2g}",
        ]
        for pair in comparison.dry_against_lubricated
    ]
    head = [load.heading, maximum.heading, relative.words, "χ²/ν of no difference", "p"]
    return Table("Dry less lubricated stress (± standard uncertainty)", head, rows)


def friction_name(friction: float) -> str:
    """Return a friction coefficient as it is typed: ``0.15`` or ``inf``."""
    return "inf" if math.isinf(friction) else f"{friction:.4g}"


def bounded_json(quantity: Quantity, estimate: BoundedEstimate) -> dict[str, Any]:
    """Return an estimate with its interval; without a value there is a reason."""
    interval = estimate.interval
    scale = quantity.scale
    return {
        "value": plain(estimate.value, scale),
        "standard_uncertainty": plain(estimate.standard_uncertainty, scale),
        "unit": quantity.unit_text,
        "interval": {
            "low": plain(interval.low, scale),
            "high": plain(interval.high, scale),
            "level": interval.level,
        },
        "reason": estimate.reason or None,
    }
