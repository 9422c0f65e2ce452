"""Comparisons of measured with calculated stress, as tables, JSON, data frames and notes."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from memscal.errors import InputError
from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import (
    INTERVAL,
    LOWER_BOUND,
    UNEXPLAINED,
    UNKNOWN,
    UPPER_BOUND,
    VALUE,
    BoundedEstimate,
    FrictionComparison,
    LoadComparison,
)
from memscal.model import records
from memscal.model.arrays import FloatArray, Values
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
    percent,
    texts_of,
    verdict,
    worst_checks,
)


def mapping(comparison: FrictionComparison) -> Values:
    """Return what ``compare --json`` prints but for the files that it was given and wrote."""
    whole: Values = {"schema_version": "1"}
    whole["scans"] = [
        file_json(scan.source) | {"lubrication": scan.lubrication}
        for scan in comparison.measured.scans
    ]
    whole["loads"] = [_load(comparison, i) for i in range(len(comparison.measured.profiles))]
    whole["joint"] = [
        {"lubrication": lubrication, "loading": loading, **estimate_json(comparison, estimate)}
        for lubrication, loading, estimate in _joint(comparison)
    ]
    if not comparison.by_shear:
        if comparison.shear is not None:
            whole["shear"] = file_json(comparison.shear.source)
        whole["dry_against_lubricated"] = [
            members(records.DRY_AGAINST_LUBRICATED, pair)
            for pair in comparison.dry_against_lubricated
        ]
        laws = comparison.interface
        whole["interface"] = None if laws is None else laws.to_dict()
        whole["macroscopic"] = None
        if comparison.macroscopic is not None:
            value, u = comparison.macroscopic
            sliding = members(
                measured(records.FRICTION), None, friction=value, friction_uncertainty=u
            )
            whole["macroscopic"] = sliding[records.FRICTION.name]
        whole["wrong_inputs"] = comparison.wrong_inputs
        whole["checks"] = checks_json(comparison.checks)
        whole["overridden"] = list(comparison.measured.overridden)
    whole["warnings"] = texts_of(comparison.messages)
    return whole


def frame(comparison: FrictionComparison) -> DataFrame:
    """Return one row for each load and definition of the loading; open ends are infinite."""
    import pandas as pd

    rows = []
    for loading in comparison.loadings:
        for i, profile in enumerate(comparison.measured.profiles):
            row = {"loading": loading, **columns(records.COMPARED_LOAD, profile)}
            if comparison.by_shear:
                row |= _columns("friction", comparison, comparison.by_shear[loading][i])
            else:
                load = comparison.loads[loading][i]
                row |= columns(records.COMPARED_MAXIMA, load)
                row["bracketed"] = load.bracketed
                row |= _columns("friction by maximum", comparison, load.by_maximum)
                row |= _columns("friction by profile", comparison, load.by_profile)
            rows.append(row)
    return pd.DataFrame(rows)


def _columns(
    name: str, comparison: FrictionComparison, estimate: BoundedEstimate
) -> dict[str, float]:
    """Return the columns of one estimate in a data frame."""
    tested = comparison.measured.noise_stated
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
_SCAN_SOURCES = {"noise", "load_scatter", "position", "between_scan_gain", "lubricated_friction"}


def correlated(comparison: FrictionComparison) -> Values:
    """Return the coefficients of all loads that have a standard uncertainty, by their names."""
    # Two of one scan share all sources of uncertainty, those of dry and lubricated scans only what
    # is common to them; each source moves all coefficients to the same side.
    names = []
    values = []
    variances = []
    budgets = []
    for lubrication, loading, estimate in _joint(comparison):
        if estimate.standard_uncertainty is not None:
            names.append(f"friction_{lubrication or 'unstated'}_{loading or 'given'}")
            values.append(estimate.best)
            variances.append(estimate.standard_uncertainty**2)
            budget = {}
            for source, u in estimate.budget.items():
                budget[source, lubrication if source in _SCAN_SOURCES else ""] = u
            budgets.append(budget)
    if not names:
        raise InputError(
            "No friction coefficient of all loads has a standard uncertainty.",
            why="; ".join(estimate.reason for *_, estimate in _joint(comparison)),
            cure="Use summary() or to_dict(), which give its bounds.",
        )
    sources = set().union(*budgets)
    shares = np.array([[budget.get(source, 0.0) for source in sources] for budget in budgets])
    covariance = shares @ shares.T
    # One without a budget has the standard uncertainty of its likelihood.
    np.fill_diagonal(covariance, variances)
    return correlated_numbers(names, values, covariance)


def _joint(comparison: FrictionComparison) -> Iterator[tuple[str, str, BoundedEstimate]]:
    """Return lubrication, loading and coefficient of all loads together."""
    for lubrication, by_loading in comparison.joint.items():
        for loading, estimate in by_loading.items():
            yield lubrication, loading, estimate


def file_json(source: SourceFile | None) -> Values:
    """Return a file's name and digest as the JSON output holds them."""
    return {name: getattr(source, name, None) for name in ("file_name", "sha256")}


def _load(comparison: FrictionComparison, index: int) -> Values:
    """Return what is compared of one load, by the loading."""
    profile = comparison.measured.profiles[index]
    if comparison.by_shear:
        by_loading = {
            loading or "given": estimate_json(comparison, loads[index])
            for loading, loads in comparison.by_shear.items()
        }
        held = members(records.STRESS_NUMBERS.quantities[:1], profile)
        return {"lubrication": profile.lubrication, **held, "by_loading": by_loading}
    first = comparison.loads[comparison.loadings[0]][index]
    return {
        "scan": getattr(profile.scan.source, "file_name", None),
        **members(records.COMPARED_LOAD, profile),
        **members(records.COMPARED_MAXIMA, first),
        "by_loading": {
            loading or "given": _by_loading(comparison, loads[index])
            for loading, loads in comparison.loads.items()
        },
    }


def _by_loading(comparison: FrictionComparison, load: LoadComparison) -> Values:
    """Return what one load says of each coefficient, by one loading."""
    profiles = [
        members(
            records.CALCULATED,
            None,
            friction=mu,
            sticking=bool(np.isinf(mu)),
            p_max=load.p_max[i],
            chi_square=load.chi_square[i],
            p_value=load.p_values[i],
            deviance=load.deviance[i],
        )
        for i, mu in enumerate(comparison.friction)
    ]
    return {
        "effective_friction_coefficient": {
            "by_maximum": estimate_json(comparison, load.by_maximum),
            "by_profile": estimate_json(comparison, load.by_profile),
        },
        "bracketed": finite(load.bracketed),
        "degrees": load.degrees,
        "profiles": profiles,
    }


def estimate_json(comparison: FrictionComparison, estimate: BoundedEstimate) -> Values:
    """Return an estimate with its fit and its profile likelihood."""
    # An estimated noise is as large as the misfit: a chi-square by it tests nothing.
    fit = {} if comparison.measured.noise_stated else {"least": None, "p_value": None}
    return {
        **bounded_json(records.FRICTION, estimate),
        **members(records.ESTIMATE_FIT, estimate, **fit),
        "lubricated_beside": estimate.beside,
        "by_lubricated_friction": estimate.by_lubricated,
        "profile_likelihood": {
            "friction_coefficient": {"value": _shortened(estimate.values), "unit": "1"},
            "deviance": _shortened(estimate.deviance),
        },
    }


def _shortened(values: FloatArray) -> list[float | None]:
    """Return values with six digits."""
    return [finite(float(f"{value:.6g}")) for value in values]


#: Coefficients farther apart than this, in the bounded coordinate, leave much to interpolation.
_FAR = 0.26


def notes(comparison: FrictionComparison) -> Iterator[Message]:
    """Return what a user should know, each thing once."""
    messages = list(comparison.messages)
    if not comparison.by_shear:
        for lubrication, loading, estimate in _joint(comparison):
            if estimate.reason and estimate.kind != UNEXPLAINED:
                text = f"{_which(lubrication, loading)}, all loads: {estimate.reason}"
                messages.append(Message("no_value", text[:1].upper() + text[1:]))
        messages += _about_profiles(comparison)
        if comparison.interface is not None:
            messages += comparison.interface.messages
    yield from dict.fromkeys(messages)


def _about_profiles(comparison: FrictionComparison) -> Iterator[Message]:
    """Say where the calculated profiles are too few."""
    friction = comparison.friction
    if friction[0] > 0:
        yield Message(
            "frictions",
            "No frictionless profile was calculated: p0_max is that of friction "
            f"{friction[0]:.3g}.",
        )
    for low, high in pairwise(friction):
        apart = bounded(high, FRICTION_SCALE) - bounded(low, FRICTION_SCALE)
        if low < FRICTION_SCALE and apart > _FAR:
            yield Message(
                "frictions",
                f"Profiles between the friction coefficients {friction_name(low)} and "
                f"{friction_name(high)} are interpolated over a wide gap: values and intervals "
                "there are rough. More coefficients make them better.",
            )


def _which(lubrication: str, loading: str) -> str:
    """Name the loads and the loading of a coefficient."""
    words = lubrication or "lubrication not stated"
    return f"{words}, {loading} loading" if loading else words


#: Inputs on which a factor is tried.
_INPUTS = {
    "radius": "radius",
    "young_modulus": "Young's modulus",
    "thickness": "thickness",
    "load": "load",
    "gain": "gain",
}
#: How the symbol of the coefficient is joined to its estimate, by the estimate's kind.
_EQUALS = {VALUE: " =", INTERVAL: " in", UNKNOWN: " is", LOWER_BOUND: "", UPPER_BOUND: ""}


def answer(comparison: FrictionComparison) -> str:
    """Return the coefficients of all loads with their intervals, and how the checks stand."""
    moved = [estimate.by_lubricated for *_, estimate in _joint(comparison)]
    lines = []
    unexplained = comparison.unexplained
    if unexplained:
        loads = f"{' and '.join(unexplained)} profiles".strip()
        lines.append(f"No friction coefficient explains the {loads}{_wrong(comparison)}")
    # The others share every input with those: no interval of theirs holds either.
    explained = {} if unexplained else comparison.joint
    for lubrication, by_loading in explained.items():
        estimates = list(by_loading.values())
        loadings: dict[str, str] = {}
        for loading, estimate in by_loading.items():
            loadings.setdefault(str(estimate), loading)
        kinds = {estimate.kind for estimate in estimates}
        if kinds == {UPPER_BOUND}:
            # The larger bound holds for both.
            largest = max(estimates, key=lambda estimate: estimate.interval.upper)
            loadings = {str(largest): ""}
        stated = ", ".join(loadings)
        if len(loadings) > 1:
            stated = ", ".join(f"{text} {loading}" for text, loading in loadings.items())
        # Bounds state their level themselves.
        level = f" ({percent(estimates[-1].interval.level)})"
        if kinds & {LOWER_BOUND, UPPER_BOUND, INTERVAL}:
            level = ""
        taken = ""
        if any(moved) and lubrication == "lubricated":
            largest_move = max(filter(None, moved), key=abs)
            taken = f"; 0.01 more moves the others by {0.01 * largest_move:.4f}"
        name = (lubrication or "all contacts").capitalize()
        lines.append(f"{name}: μ{_EQUALS[estimates[0].kind]} {stated}{level}{taken}.")
    friction = "\n".join(lines)
    return f"{friction} {verdict(comparison.checks)}".strip()


def _wrong(comparison: FrictionComparison) -> str:
    """Say which wrong input would explain what no friction does."""
    factors = comparison.wrong_inputs
    if factors is None:
        return "."
    if not factors:
        return f", nor does a factor on {' or '.join(_INPUTS.values())}."
    named = [f"a {_INPUTS[name]} of {factor:.2f} times" for name, factor in factors.items()]
    return f"; {', or '.join(named)} the stated one would explain them."


_LABELS = ("", "state", "load (N)")


def tables(comparison: FrictionComparison) -> list[Table]:
    """Return what was measured, the friction by each loading, its budget, and the checks."""
    friction = [_friction_table(comparison, loading) for loading in comparison.loadings]
    if comparison.by_shear:
        return [*friction, _budget_table(comparison)]
    laws = comparison.interface
    return [
        _maxima_table(comparison),
        *friction,
        _budget_table(comparison),
        _macroscopic_table(comparison),
        _lubrication_table(comparison),
        *([] if laws is None else laws.tables()),
        checks_table(worst_checks(comparison.checks)),
    ]


def _maxima_table(comparison: FrictionComparison) -> Table:
    """Return measured and calculated maxima of each load."""
    sphere = comparison.measured.scans[0].indenter
    title = (
        f"Measured stress S = U/A and frictionless p0, {sphere.shape} of radius "
        f"{sphere.radius / MM:.4g} mm (± standard uncertainty)"
    )
    force = records.COMPARED_LOAD[2]
    maxima = records.COMPARED_MAXIMA[::2]
    head = [*_LABELS, *(quantity.heading for quantity in (force, *maxima))]
    rows = []
    for i, load in enumerate(comparison.loads[comparison.loadings[0]], start=1):
        numbers = [cell(quantity, load, unit="") for quantity in maxima]
        rows.append([*_labels(i, load.profile), cell(force, load.profile, unit=""), *numbers])
    return Table(title, head, rows, labels=len(_LABELS))


def _labels(number: int, profile: MeasuredProfile) -> tuple[str, str, str]:
    """Return number, state and load of a profile; checks and messages use the number."""
    return str(number), profile.state or "not stated", f"{profile.load:.4g}"


def _friction_table(comparison: FrictionComparison, loading: str) -> Table:
    """Return the coefficient of each load and of all loads of a kind, by one loading."""
    with_shear = comparison.shear is not None and not comparison.by_shear
    tests = ["χ²/ν", "p"] if comparison.measured.noise_stated else []
    head = ["by the maximum", "by the profile", *tests, "bracketed"]
    if comparison.by_shear:
        head = ["by the shear" if comparison.shear else "by the profile", *tests]
    rows = []
    level = "95 %"
    for lubrication, by_loading in comparison.joint.items():
        joint = by_loading[loading]
        level = percent(joint.interval.level)
        count = 0
        for i, profile in enumerate(comparison.measured.profiles):
            if profile.lubrication == lubrication:
                count += 1
                readings = _readings(comparison, loading, i)
                rows.append([*_labels(i + 1, profile), *readings])
        if count > 1 or with_shear:
            name = lubrication or "not stated"
            name += " + lubricated" if joint.beside else ""
            name += ", with shear" if with_shear else ""
            cells = [str(joint), *_fit(comparison, joint)]
            rows.append(["", name, "all", *(cells if comparison.by_shear else ["", *cells, ""])])
    way = f"{loading} loading" if loading else "profiles as given"
    title = f"Effective friction coefficient, {way} [{level} interval]"
    return Table(title, [*_LABELS, *head], rows, labels=len(_LABELS))


def _readings(comparison: FrictionComparison, loading: str, index: int) -> list[str]:
    """Return the coefficient of one load, with its fit."""
    if comparison.by_shear:
        estimate = comparison.by_shear[loading][index]
        return [str(estimate), *_fit(comparison, estimate)]
    load = comparison.loads[loading][index]
    fit = _fit(comparison, load.by_profile)
    return [str(load.by_maximum), str(load.by_profile), *fit, f"{100 * load.bracketed:.0f} %"]


def _fit(comparison: FrictionComparison, estimate: BoundedEstimate) -> tuple[str, ...]:
    """Return the reduced chi-square and its p value, where they test anything."""
    if not comparison.measured.noise_stated:
        return ()
    if estimate.degrees <= 0:
        return "", ""
    return f"{estimate.least / estimate.degrees:.2f}", f"{estimate.p_value:.2g}"


def _budget_table(comparison: FrictionComparison) -> Table:
    """Return the contribution of each source to each coefficient."""
    shown = {}
    sources: dict[str, None] = {}
    for lubrication, loading, joint in _joint(comparison):
        if joint.value is not None and joint.budget:
            name = f"{lubrication or 'lubrication not stated'}, {loading}".removesuffix(", ")
            shown[name] = joint
            sources |= dict.fromkeys(joint.budget)
    rows = []
    for source in sources:
        shares = [_share(joint.budget.get(source)) for joint in shown.values()]
        rows.append([source.replace("_", " "), *shares])
    if rows:
        totals = [_share(joint.standard_uncertainty) for joint in shown.values()]
        rows.append(["standard uncertainty", *totals])
    moved = [joint.by_lubricated for joint in shown.values()]
    if any(moved):
        rows.append(["dμ/dμ of the lubricated", *map(_share, moved)])
    title = "Contributions to the standard uncertainty of the coefficient of all loads"
    return Table(title, ["source", *shown], rows)


def _share(value: float | None) -> str:
    """Return a contribution with two digits."""
    return "-" if value is None else f"{value:.2g}"


def _macroscopic_table(comparison: FrictionComparison) -> Table:
    """Return the macroscopic coefficient beside each effective one."""
    if comparison.macroscopic is None:
        return Table("", ("", ""), [])
    value, u = comparison.macroscopic
    title = f"Beside the macroscopic friction coefficient, {format_measured(value, u)}"
    rows = []
    for lubrication, loading, joint in _joint(comparison):
        place = "within"
        if joint.kind == UNEXPLAINED:
            continue
        if not joint.interval.holds(value):
            place = "below" if value < joint.interval.low else "above"
        interval = f"{place} the {percent(joint.interval.level)} interval"
        rows.append([_which(lubrication, loading), str(joint), interval])
    return Table(title, ["all loads of", "effective coefficient", "macroscopic one"], rows)


def _lubrication_table(comparison: FrictionComparison) -> Table:
    """Return the differences of dry and lubricated stress."""
    load, maximum, _, relative, *_ = records.DRY_AGAINST_LUBRICATED
    rows = []
    for pair in comparison.dry_against_lubricated:
        on_axis = cell(maximum, pair, unit="")
        share = format_measured(100 * pair.relative, 100 * pair.relative_uncertainty, "%")
        reduced = pair.chi_square / pair.degrees
        rows.append([f"{pair.load:.4g}", on_axis, share, f"{reduced:.2f}", f"{pair.p_value:.2g}"])
    head = [load.heading, maximum.heading, relative.words, "χ²/ν of no difference", "p"]
    return Table("Dry less lubricated stress (± standard uncertainty)", head, rows)


def friction_name(friction: float) -> str:
    """Return a friction coefficient as it is typed: ``0.15`` or ``inf``."""
    return f"{friction:.4g}"


def bounded_json(quantity: Quantity, estimate: BoundedEstimate) -> Values:
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
