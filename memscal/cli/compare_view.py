"""A comparison of measured with calculated stress as tables and notes for people."""

from __future__ import annotations

import math
from collections.abc import Iterator

from memscal.cli.calibration_view import checks_table
from memscal.cli.friction_text import bounded_text, friction_name, percent
from memscal.cli.interface_view import interface_tables
from memscal.cli.tables import Table
from memscal.figures.quantities import KPA, MM
from memscal.friction.results import EffectiveFriction, FrictionComparison
from memscal.model.notation import format_measured

__all__ = ["comparison_notes", "comparison_tables"]

#: Coefficients in one table of chi-square: more would not fit in 100 columns.
_COLUMNS = 9
#: From here on chi-square is written without a decimal, and as a power of ten.
_WIDE, _LONG = 100, 1e5


def comparison_tables(found: FrictionComparison) -> list[Table]:
    """Return what was measured, the friction by each loading, its budget, and the checks."""
    return [
        _maxima_table(found),
        *(_friction_table(found, loading) for loading in found.loadings),
        *(table for loading in found.loadings for table in _chi_square_tables(found, loading)),
        _budget_table(found),
        _macroscopic_table(found),
        _lubrication_table(found),
        *([] if found.interface is None else interface_tables(found.interface)),
        checks_table(found.checks),
    ]


def comparison_notes(found: FrictionComparison) -> Iterator[str]:
    """Return what a user should know, each thing once."""
    said = dict.fromkeys([*found.messages, *_reasons(found)])
    if found.interface is not None:
        said |= dict.fromkeys(found.interface.messages)
    yield from said


def _reasons(found: FrictionComparison) -> Iterator[str]:
    """Return why the coefficient of all loads together has no value, where it has none."""
    for lubrication, by_loading in found.joint.items():
        for loading, joint in by_loading.items():
            if joint.reason:
                yield f"{_capital(_which(lubrication, loading))}, all loads: {joint.reason}"


def _which(lubrication: str, loading: str) -> str:
    words = [lubrication or "lubrication not stated", f"{loading} loading" if loading else ""]
    return ", ".join(word for word in words if word)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _maxima_table(found: FrictionComparison) -> Table:
    """Return the measured force and maximum of each load, beside the frictionless maximum."""
    first = found.loads[found.loadings[0]]
    sphere = found.measured.profiles[0].part.scan.indenter
    title = (
        f"Measured stress S = U/A and frictionless p0, {sphere.shape} of radius "
        f"{sphere.radius / MM:.4g} mm (± standard uncertainty)"
    )
    head = ["lubrication", "load (N)", "force (N)", "S_max (kPa)", "p0_max (kPa)", "S_max/p0_max"]
    rows = [
        [
            one.lubrication or "not stated",
            f"{one.load:.4g}",
            _pm(one.profile.force, one.profile.force_uncertainty),
            _pm(one.s_max / KPA, one.s_max_uncertainty / KPA),
            _pm(one.p0_max / KPA, one.p0_max_uncertainty / KPA),
            _pm(one.ratio, one.ratio_uncertainty),
        ]
        for one in first
    ]
    return Table(title, head, rows)


def _pm(value: float, uncertainty: float) -> str:
    return format_measured(value, uncertainty)


def _friction_table(found: FrictionComparison, loading: str) -> Table:
    """Return the effective coefficient of each load by both readings, and of all together."""
    of_all = list(found.joint.values())
    level = percent(of_all[0][loading].interval.level) if of_all else "95 %"
    way = f"{loading} loading" if loading else "profiles as given"
    title = f"Effective friction coefficient, {way} [{level} interval]"
    head = ["lubrication", "load (N)", "by the maximum", "by the profile", "χ²/ν", "p", "bracketed"]
    rows = []
    for lubrication, by_loading in found.joint.items():
        name = lubrication or "not stated"
        of_it = [one for one in found.loads[loading] if one.lubrication == lubrication]
        rows += [
            [
                name,
                f"{one.load:.4g}",
                bounded_text(one.by_maximum),
                bounded_text(one.by_profile),
                *_fit(one.by_profile),
                f"{100 * one.bracketed:.0f} %",
            ]
            for one in of_it
        ]
        if len(of_it) > 1:
            joint = by_loading[loading]
            rows.append([name, "all", "", bounded_text(joint), *_fit(joint), ""])
    return Table(title, head, rows)


def _fit(reading: EffectiveFriction) -> tuple[str, str]:
    if reading.degrees <= 0:
        return "", ""
    return f"{reading.least / reading.degrees:.2f}", f"{reading.p_value:.2g}"


def _chi_square_tables(found: FrictionComparison, loading: str) -> Iterator[Table]:
    """Return chi-square of each load against each calculated profile, in as few tables as fit."""
    loads = found.loads[loading]
    way = f"{loading} loading" if loading else "profiles as given"
    for start in range(0, found.friction.size, _COLUMNS):
        part = range(start, min(start + _COLUMNS, found.friction.size))
        head = ["lubrication", "load (N)", "ν"]
        head += [friction_name(float(found.friction[i])) for i in part]
        rows = [
            [one.lubrication or "not stated", f"{one.load:.4g}", f"{one.degrees}"]
            + [_short(float(one.chi_square[i])) for i in part]
            for one in loads
        ]
        yield Table(f"χ² of each profile against friction coefficients, {way}", head, rows)


def _short(chi_square: float) -> str:
    if not math.isfinite(chi_square):
        return "-"
    if chi_square >= _LONG:
        return f"{chi_square:.0e}".replace("e+0", "e")
    return f"{chi_square:.1f}" if chi_square < _WIDE else f"{chi_square:.0f}"


def _budget_table(found: FrictionComparison) -> Table:
    """Return what each source adds to the uncertainty of the coefficient of all loads."""
    columns = {
        _which(lubrication, loading).removesuffix(" loading"): joint
        for lubrication, by_loading in found.joint.items()
        for loading, joint in by_loading.items()
        if joint.value is not None and joint.budget
    }
    sources = dict.fromkeys(name for joint in columns.values() for name in joint.budget)
    rows = [
        [name.replace("_", " "), *(_share(joint.budget.get(name)) for joint in columns.values())]
        for name in sources
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


def _macroscopic_table(found: FrictionComparison) -> Table:
    """Return where the macroscopic coefficient stands beside the effective ones."""
    if found.macroscopic is None:
        return Table("", ("", ""), [])
    value, u = found.macroscopic
    title = f"Beside the macroscopic friction coefficient, {format_measured(value, u)}"
    rows = [
        [_which(lubrication, loading), bounded_text(joint), _against(joint, value)]
        for lubrication, by_loading in found.joint.items()
        for loading, joint in by_loading.items()
    ]
    return Table(title, ["all loads of", "effective coefficient", "macroscopic one"], rows)


def _against(joint: EffectiveFriction, value: float) -> str:
    level = percent(joint.interval.level)
    if joint.interval.holds(value):
        return f"within the {level} interval"
    return ("below" if value < joint.interval.low else "above") + f" the {level} interval"


def _lubrication_table(found: FrictionComparison) -> Table:
    """Return how far dry and lubricated stress differ at each load."""
    rows = [
        [
            f"{one.load:.4g}",
            _pm(one.maximum / KPA, one.maximum_uncertainty / KPA),
            format_measured(100 * one.relative, 100 * one.relative_uncertainty, "%"),
            f"{one.chi_square / one.degrees:.2f}",
            f"{one.p_value:.2g}",
        ]
        for one in found.dry_against_lubricated
    ]
    head = ["load (N)", "on the axis (kPa)", "of the lubricated", "χ²/ν of no difference", "p"]
    return Table("Dry less lubricated stress (± standard uncertainty)", head, rows)
