"""A comparison of measured with calculated stress as tables for people."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import (
    DryAgainstLubricated,
    EffectiveFriction,
    FrictionComparison,
    LoadComparison,
)
from memscal.model.arrays import FloatArray
from memscal.model.checks import FAILED_CHECK, Message, QualityCheck, failed_check_messages
from memscal.model.notation import format_measured
from memscal.model.provenance import SourceFile
from memscal.model.quantities import KPA, MM
from memscal.summaries.interface_laws import (
    bounded_text,
    friction_name,
    interface_json,
    interface_tables,
    percent,
)
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of

__all__ = ["comparison_json", "comparison_notes", "comparison_tables", "failures", "which"]


def comparison_json(
    found: FrictionComparison,
    artifact: SourceFile,
    references: Sequence[SourceFile | None] = (),
    files: Sequence[Path] = (),
) -> dict[str, Any]:
    """Return the object that ``compare --json`` prints; its form is part of the contract.

    A friction coefficient of infinity is ``null``, with ``"sticking": true``; an interval's open
    end is ``null``.
    """
    return {
        "schema_version": "1",
        "artifact": _file(artifact),
        "scans": [
            _file(scan.source) | {"lubrication": scan.lubrication} for scan in found.measured.scans
        ],
        "references": [_file(source) for source in references],
        "figures": [str(path) for path in files],
        "loads": [
            _load(i, found, next(iter(found.loads.values()))[i])
            for i in range(len(found.measured.profiles))
        ],
        "joint": [
            {"lubrication": lubrication, "loading": loading, **_reading(joint)}
            for lubrication, by_loading in found.joint.items()
            for loading, joint in by_loading.items()
        ],
        "dry_against_lubricated": [_difference(one) for one in found.dry_against_lubricated],
        "interface": None if found.interface is None else interface_json(found.interface),
        "macroscopic": None if found.macroscopic is None else _quantity(*found.macroscopic, "1"),
        "checks": checks_json(found.checks),
        "overridden": list(found.measured.overridden),
        "warnings": texts_of(found.messages),
    }


def _file(source: SourceFile | None) -> dict[str, Any]:
    if source is None:
        return {"file_name": None, "sha256": None}
    return {"file_name": source.file_name, "sha256": source.sha256}


def _quantity(value: float, uncertainty: float | None, unit: str) -> dict[str, Any]:
    return {"value": finite(value), "standard_uncertainty": finite(uncertainty), "unit": unit}


def _coefficient(friction: float) -> dict[str, Any]:
    return {"friction_coefficient": finite(friction), "sticking": math.isinf(friction)}


def _load(index: int, found: FrictionComparison, first: LoadComparison) -> dict[str, Any]:
    """Return what was measured at one load, and what each loading makes of it."""
    profile = first.profile
    source = profile.scan.source
    return {
        "scan": None if source is None else source.file_name,
        "lubrication": first.lubrication,
        "load": {"value": finite(first.load), "unit": "N"},
        "force": _quantity(profile.force, profile.force_uncertainty, "N"),
        "S_max": _quantity(first.s_max / KPA, first.s_max_uncertainty / KPA, "kPa"),
        "p0_max": _quantity(first.p0_max / KPA, first.p0_max_uncertainty / KPA, "kPa"),
        "ratio": _quantity(first.ratio, first.ratio_uncertainty, "1"),
        "by_loading": {
            loading or "given": _by_loading(found, loads[index])
            for loading, loads in found.loads.items()
        },
    }


def _by_loading(found: FrictionComparison, one: LoadComparison) -> dict[str, Any]:
    return {
        "effective_friction_coefficient": {
            "by_maximum": _reading(one.by_maximum),
            "by_profile": _reading(one.by_profile),
        },
        "bracketed": finite(one.bracketed),
        "degrees": one.degrees,
        "profiles": [
            {
                **_coefficient(float(mu)),
                "p_max": {"value": finite(one.p_max[i] / KPA), "unit": "kPa"},
                "chi2": finite(float(one.chi_square[i])),
                "p_value": finite(float(one.p_values[i])),
            }
            for i, mu in enumerate(found.friction)
        ],
    }


def _reading(reading: EffectiveFriction) -> dict[str, Any]:
    """Return a coefficient with its interval; without a value there is a reason."""
    return {
        "value": finite(reading.value),
        "standard_uncertainty": finite(reading.standard_uncertainty),
        "interval": {
            "low": finite(reading.interval.low),
            "high": finite(reading.interval.high),
            "level": reading.interval.level,
        },
        "reason": reading.reason or None,
        "budget": {name: finite(u) for name, u in reading.budget.items()},
        "chi2": finite(reading.least),
        "degrees": reading.degrees,
        "p_value": finite(reading.p_value),
        "profile_likelihood": {
            "friction_coefficient": _shortened(reading.values),
            "chi2": _shortened(reading.chi_square),
        },
    }


def _shortened(values: FloatArray) -> list[float | None]:
    """Return numbers of a curve with six digits, infinity as null."""
    return [finite(float(f"{value:.6g}")) for value in values]


def _difference(one: DryAgainstLubricated) -> dict[str, Any]:
    return {
        "load": {"value": finite(one.load), "unit": "N"},
        "on_axis": _quantity(one.maximum / KPA, one.maximum_uncertainty / KPA, "kPa"),
        "relative": _quantity(one.relative, one.relative_uncertainty, "1"),
        "chi2": finite(one.chi_square),
        "degrees": one.degrees,
        "p_value": finite(one.p_value),
    }


#: Coefficients farther apart than this, in the bounded coordinate, leave much to interpolation.
_FAR = 0.26


def comparison_notes(found: FrictionComparison) -> Iterator[Message]:
    """Return what a user should know, each thing once; what failed of several profiles, once."""
    others = (message for message in found.messages if message.kind != FAILED_CHECK)
    of_laws = () if found.interface is None else found.interface.messages
    yield from dict.fromkeys(
        [*_failed(found), *others, *_reasons(found), *_about_profiles(found), *of_laws]
    )


def _about_profiles(found: FrictionComparison) -> Iterator[Message]:
    """Say what the calculated profiles do not cover."""
    friction = found.friction
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


def failures(checks: Sequence[QualityCheck]) -> dict[str, list[QualityCheck]]:
    """Return the checks that failed, by kind."""
    failed: dict[str, list[QualityCheck]] = {}
    for check in checks:
        if not check.passed:
            failed.setdefault(check.kind, []).append(check)
    return failed


def _failed(found: FrictionComparison) -> Iterator[Message]:
    """Return one warning for each kind of check that failed, about the first profile."""
    for first, *others in failures(found.checks).values():
        [message] = failed_check_messages([first])
        numbers = ", ".join(check.profile for check in others)
        text = f"{message.text} The same of profiles {numbers}." if others else message.text
        yield replace(message, text=text)


def _reasons(found: FrictionComparison) -> Iterator[Message]:
    """Return why the coefficient of all loads together has no value, where it has none."""
    for lubrication, by_loading in found.joint.items():
        for loading, joint in by_loading.items():
            if joint.reason:
                words = _capital(which(lubrication, loading))
                yield Message("no_value", f"{words}, all loads: {joint.reason}")


def which(lubrication: str, loading: str) -> str:
    """Return lubrication and definition of the loading in words."""
    words = [lubrication or "lubrication not stated", f"{loading} loading" if loading else ""]
    return ", ".join(word for word in words if word)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


_LABELS = ("", "state", "load (N)")
#: No table is wider than this many columns of text.
_WIDTH = 98
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
        _checks_table(found.checks),
    ]


def _maxima_table(found: FrictionComparison) -> Table:
    """Return the measured force and maximum of each load, beside the frictionless maximum."""
    first = found.loads[found.loadings[0]]
    sphere = found.measured.profiles[0].scan.indenter
    title = (
        f"Measured stress S = U/A and frictionless p0, {sphere.shape} of radius "
        f"{sphere.radius / MM:.4g} mm (± standard uncertainty)"
    )
    head = [*_LABELS, "force (N)", "S_max (kPa)", "p0_max (kPa)", "S_max/p0_max"]
    rows = [
        [
            *_labels(i, one),
            _pm(one.profile.force, one.profile.force_uncertainty),
            _pm(one.s_max / KPA, one.s_max_uncertainty / KPA),
            _pm(one.p0_max / KPA, one.p0_max_uncertainty / KPA),
            _pm(one.ratio, one.ratio_uncertainty),
        ]
        for i, one in enumerate(first, start=1)
    ]
    return Table(title, head, rows)


def _labels(number: int, one: LoadComparison) -> tuple[str, str, str]:
    """Return number, state and load of a profile; checks and messages use the number."""
    return str(number), one.lubrication or "not stated", f"{one.load:.4g}"


def _pm(value: float, uncertainty: float) -> str:
    return format_measured(value, uncertainty)


def _friction_table(found: FrictionComparison, loading: str) -> Table:
    """Return the effective coefficient of each load by both readings, and of all together."""
    of_all = list(found.joint.values())
    level = percent(of_all[0][loading].interval.level) if of_all else "95 %"
    way = f"{loading} loading" if loading else "profiles as given"
    title = f"Effective friction coefficient, {way} [{level} interval]"
    head = [*_LABELS, "by the maximum", "by the profile", "χ²/ν", "p", "bracketed"]
    rows = []
    for lubrication, by_loading in found.joint.items():
        of_it = [
            (i, one)
            for i, one in enumerate(found.loads[loading], start=1)
            if one.lubrication == lubrication
        ]
        rows += [
            [
                *_labels(i, one),
                bounded_text(one.by_maximum),
                bounded_text(one.by_profile),
                *_fit(one.by_profile),
                f"{100 * one.bracketed:.0f} %",
            ]
            for i, one in of_it
        ]
        if len(of_it) > 1:
            joint, name = by_loading[loading], lubrication or "not stated"
            rows.append(["", name, "all", "", bounded_text(joint), *_fit(joint), ""])
    return Table(title, head, rows)


def _fit(reading: EffectiveFriction) -> tuple[str, str]:
    if reading.degrees <= 0:
        return "", ""
    return f"{reading.least / reading.degrees:.2f}", f"{reading.p_value:.2g}"


def _chi_square_tables(found: FrictionComparison, loading: str) -> Iterator[Table]:
    """Return chi-square of each load against each calculated profile, in as few tables as fit."""
    loads = found.loads[loading]
    way = f"{loading} loading" if loading else "profiles as given"
    labels = [[*_labels(i, one), f"{one.degrees}"] for i, one in enumerate(loads, start=1)]
    head = [*_LABELS, "ν"]
    columns = [
        [friction_name(float(mu)), *(_short(float(one.chi_square[i])) for one in loads)]
        for i, mu in enumerate(found.friction)
    ]
    room = _WIDTH - sum(2 + max(map(len, column)) for column in zip(head, *labels, strict=True))
    for part in _fitting(columns, room):
        values = zip(*(column[1:] for column in part), strict=True)
        rows = [[*label, *row] for label, row in zip(labels, values, strict=True)]
        title = f"χ² of each profile against friction coefficients, {way}"
        yield Table(title, [*head, *(column[0] for column in part)], rows)


def _fitting(columns: Sequence[list[str]], room: int) -> Iterator[list[list[str]]]:
    """Divide columns among tables none of which is wider than there is room for."""
    part: list[list[str]] = []
    for column in columns:
        widths = [2 + max(map(len, kept)) for kept in (*part, column)]
        if part and sum(widths) > room:
            yield part
            part = []
        part.append(column)
    yield part


def _short(chi_square: float) -> str:
    if not math.isfinite(chi_square):
        return "-"
    if chi_square >= _LONG:
        return f"{chi_square:.0e}".replace("e+0", "e")
    return f"{chi_square:.1f}" if chi_square < _WIDE else f"{chi_square:.0f}"


def _budget_table(found: FrictionComparison) -> Table:
    """Return what each source adds to the uncertainty of the coefficient of all loads."""
    columns = {
        which(lubrication, loading).removesuffix(" loading"): joint
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
        [which(lubrication, loading), bounded_text(joint), _against(joint, value)]
        for lubrication, by_loading in found.joint.items()
        for loading, joint in by_loading.items()
    ]
    return Table(title, ["all loads of", "effective coefficient", "macroscopic one"], rows)


def _against(joint: EffectiveFriction, value: float) -> str:
    level = percent(joint.interval.level)
    if joint.interval.holds(value):
        return f"within the {level} interval"
    return ("below" if value < joint.interval.low else "above") + f" the {level} interval"


def _checks_table(checks: Sequence[QualityCheck]) -> Table:
    """Return what failed, and of checks that were made of each profile the closest to failing."""
    shown: list[QualityCheck] = []
    for name, of_it in groupby(sorted(checks, key=_kind_in(checks)), key=lambda check: check.kind):
        group = list(of_it)
        passed = [check for check in group if check.passed]
        shown += [check for check in group if not check.passed]
        if passed:
            worst = max(passed, key=lambda check: check.value / check.limit)
            many = f"{name}, worst of {len(passed)}" if len(passed) > 1 else worst.name
            shown.append(replace(worst, name=many))
    return checks_table(shown)


def _kind_in(checks: Sequence[QualityCheck]) -> Callable[[QualityCheck], int]:
    """Return an order in which checks of one kind follow each other, kinds as they came."""
    order = list(dict.fromkeys(check.kind for check in checks))
    return lambda check: order.index(check.kind)


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
