"""What stands in a certificate, in the words of its language: texts, tables and figures."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from string import Template
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from memscal.apparatus import ApparatusFunction
from memscal.extensions.certificate.certificate import COVERAGE_FACTOR, Certificate, CertifiedValue
from memscal.extensions.certificate.laboratory import MEASURED_BY, ZERO_CELSIUS
from memscal.figures.calibration import radial_figure
from memscal.figures.calibration_scan import draw_residuals, draw_scans, position_label
from memscal.figures.report import Picture
from memscal.figures.style import FIGURE_WIDTH, house_style, new_figure
from memscal.model.assumptions import ASSUMED, MEASURED
from memscal.model.checks import OVERRIDE
from memscal.model.notation import SUPERSCRIPTS, format_measured, rounded
from memscal.model.quantities import MM, PER_MM, PER_MM2
from memscal.summaries.declared import total_of
from memscal.summaries.table import Table

#: Sources of the budget that count what is taken for granted, where they have other names.
_COUNTED_AS = {"stage_scale": "position_scale", "film_law": "model_form", "load_scale": "load"}

Fields = dict[str, str]
"""What is filled into the texts, by name."""
Item = str | Table | Picture
Rows = list[Sequence[str]]


class Part(NamedTuple):
    """A section of a certificate: a heading, and texts, tables and figures with their names."""

    heading: str
    items: Sequence[tuple[str, Item]]


def filled(templates: str | Sequence[str], fields: Mapping[str, str]) -> str:
    """Fill in a text and join its parts, but for those of which something is not known."""
    parts = []
    for template in [templates] if isinstance(templates, str) else templates:
        with suppress(KeyError):
            parts.append(Template(template).substitute(fields))
    return " ".join(parts)


def parts_of(certificate: Certificate, fields: Mapping[str, str]) -> list[Part]:
    """Return the sections of a certificate, as its texts order them."""
    texts = certificate.texts
    known: dict[str, Item] = {}
    for name, form in texts["forms"].items():
        lines = [(label, filled(text, fields)) for label, text in form.items()]
        known[name] = Table("", ("", ""), [line for line in lines if line[1]])
    numbers = [f"({i})" for i in range(1, len(certificate.values) + 1)]
    units = zip(numbers, certificate.values, strict=True)
    # Beyond those of the texts.
    heads = {"values": numbers, "budget": [f"{number} {_unit(value)}" for number, value in units]}
    for name, make in _TABLES.items():
        stated = texts["tables"][name]
        head = [*stated["head"], *heads.get(name, ())]
        known[name] = Table(filled(stated["title"], fields), head, make(certificate))
    for name, draw in _FIGURES.items():
        stated = texts["figures"][name]
        known[name] = Picture(
            partial(draw, certificate.apparatus), stated["alt"], stated["caption"]
        )
    parts = []
    for section in texts["section"]:
        items = []
        for text in section["content"]:
            name = text[1:] if text[0] == "@" else ""
            item = known[name] if name else filled(text, fields)
            # A table without rows, and a text of which nothing is known, are left out.
            if item and getattr(item, "rows", True):
                items.append((name, item))
        if items:
            parts.append(Part(section["heading"], items))
    return parts


def fields_of(certificate: Certificate) -> Fields:
    """Return what is filled into the texts, by name; what is not known is not in it."""
    texts = certificate.texts
    fields = dict(texts["defaults"])
    for section, stated in certificate.sections.items():
        for key, value in stated.items():
            if isinstance(value, str) and value:
                fields[f"{section}_{key}"] = value
    fields |= _of_conditions(certificate) | _of_calibration(certificate)
    shown = {item.get("kind") for item in certificate.equipment}
    lists = {
        "traceable": [],
        "untraceable": [],
        "missing": [item.words for item in certificate.missing],
        "left_out": [_stated(certificate, value) for value in certificate.undetermined],
        "negligible": _contributions(certificate)[1],
    }
    for quantity, kind in MEASURED_BY.items():
        listed = lists["traceable" if kind in shown else "untraceable"]
        listed.append(certificate.words("measured", quantity))
    fields |= {name: ", ".join(words) for name, words in lists.items() if words}
    for name, templates in texts["fields"].items():
        text = filled(templates, fields)
        if text:
            fields[name] = text
    return fields


def _of_conditions(certificate: Certificate) -> Fields:
    """Return number, dates, temperature, humidity and decision rule."""
    conditions = certificate.sections["conditions"]
    decision = certificate.sections["decision"]
    fields = {"number": certificate.number, "issued": certificate.issued}
    begin = conditions["start_time"][:10]
    end = conditions["end_time"][:10] or begin
    if begin:
        fields |= {"begin": begin, "end": end}
    if end != begin:
        fields["until"] = end
    for name, zero, scale, unit in (
        ("temperature", ZERO_CELSIUS, 1.0, "°C"),
        ("humidity", 0.0, 0.01, "%"),
    ):
        if name in conditions:
            value, u = conditions[name]
            fields[name] = _expanded(value - zero, u, scale, unit)
            fields[f"{name}_value"] = repr(float((value - zero) / scale))
            fields[f"{name}_expanded"] = repr(float(COVERAGE_FACTOR * (u or 0.0) / scale))
    if certificate.conformity:
        fields["guard_band"] = f"{decision.get('guard_band', 1.0):g}"
        fields["decision"] = filled(certificate.words("decision", decision["rule"]), fields)
    return fields


def _of_calibration(certificate: Certificate) -> Fields:
    """Return by what method, from which readings, and with which film and indenter."""
    apparatus = certificate.apparatus
    process = apparatus.process
    checks = apparatus.checks
    overridden = [message.text for message in process.messages if message.kind == OVERRIDE]
    fields = {
        "overridden": " ".join(overridden),
        "method": certificate.words("methods", process.configuration.get("method", "")),
        "program": f"memscal {process.version}",
        "readings": str(apparatus.reconvolution.x.size),
        "unit": apparatus.reading.unit,
        "resolved": f"{apparatus.resolved_wavenumber / PER_MM:.3g} rad/mm",
        "digest": apparatus.content_digest,
        "checks": str(len(checks)),
        "passed": str(sum(check.passed for check in checks)),
    }
    if certificate.synthetic:
        fields["synthetic"] = str(certificate.texts["synthetic"])
    if process.input_scan:
        fields["scan_digest"] = process.input_scan.sha256
    loads: Any = apparatus.reconvolution.load
    if loads is None:
        loads = apparatus.load
    if loads is not None:
        share = process.configuration.get("relative_load_uncertainty")
        ends = [np.min(loads), np.max(loads)]
        texts = [_expanded(end, share * end, 1.0, "N") if share else f"{end:.4g} N" for end in ends]
        fields["load"] = " – ".join(dict.fromkeys(texts))
    rod = apparatus.indenter
    if rod is not None:
        fields["shape"] = certificate.words("shapes", rod.shape)
        fields["radius"] = _expanded(rod.radius, rod.radius_uncertainty, MM)
    film = apparatus.film
    if film is not None:
        modulus = _expanded(film.young_modulus, film.young_modulus_uncertainty, 1e6, "MPa")
        fields["modulus"] = modulus
        fields["thickness"] = _expanded(film.thickness, film.thickness_uncertainty, MM)
        fields["ratio"] = _expanded(film.poisson_ratio, film.poisson_ratio_uncertainty, 1.0, "")
        fields["law"] = certificate.words("laws", film.law or "not stated")
    return fields


def _expanded(value: float, u: float | None, scale: float, unit: str = "mm") -> str:
    """Return a value with U = k u, both given in SI units, ``scale`` of which are the unit."""
    return format_measured(value / scale, u and COVERAGE_FACTOR * u / scale, unit)


def _name(certificate: Certificate, value: CertifiedValue) -> str:
    quantity = value.quantity
    words = certificate.words("quantities", quantity.name)
    return f"{words}, {quantity.symbol}" if quantity.symbol else words


def _measured(value: CertifiedValue) -> str:
    scale = value.quantity.scale
    return format_measured(value.value / scale, value.expanded / scale, value.quantity.unit)


def _stated(certificate: Certificate, value: CertifiedValue) -> str:
    of_gaussian = certificate.words("states", "rejected")
    reason = of_gaussian if value.rejected else f"U/y = {_share(value)}"
    return f"{_name(certificate, value)} ({reason})"


def _share(value: CertifiedValue) -> str:
    if not value.quantity.unit:
        return "–"
    share = float(f"{100 * value.expanded / abs(value.value):.2g}")
    return f"{share:g} %"


def _values(certificate: Certificate) -> Rows:
    rows: Rows = []
    count = len(certificate.values)
    for i, value in enumerate(certificate.values):
        row = [f"({i + 1}) {_name(certificate, value)}", _measured(value)]
        row += [f"{value.factor:.3g}", _share(value)]
        row += [f"{round(r, 2) + 0:.2f}" for r in certificate.correlation[i, :i]]
        rows.append([*row, "1", *[""] * (count - i - 1)])
    return rows


def _others(certificate: Certificate) -> Rows:
    return [(_name(certificate, v), _measured(v), f"{v.factor:.3g}") for v in certificate.others]


def _profile(certificate: Certificate) -> Rows:
    r, g, covariance = certificate.profile
    expanded = COVERAGE_FACTOR * np.sqrt(np.diag(covariance))
    return [
        [f"{radius:.4g}", format_measured(value, u)]
        for radius, value, u in zip(r / MM, g / PER_MM2, expanded / PER_MM2, strict=True)
    ]


def _equipment(certificate: Certificate) -> Rows:
    rows: Rows = []
    for item in certificate.equipment:
        kind = certificate.words("kinds", item.get("kind", ""))
        rows.append(
            [kind, *(item.get(key) or "" for key in ("name", "serial", "certificate", "date"))]
        )
    return rows


def assumption_rows(certificate: Certificate) -> Rows:
    """Say of what is taken for granted which size moves A by one u, and whether U counts it."""
    budget = certificate.apparatus.budget.get("conversion_constant", {})
    rows: Rows = []
    for each in certificate.apparatus.assumptions:
        counted = each.state == MEASURED or bool(budget.get(_COUNTED_AS.get(each.name, each.name)))
        if each.name == "noise_correlation":
            counted = each.state != ASSUMED
        measure = certificate.words("measures", each.name)
        size = certificate.words("states", each.size_text("conversion_constant"))
        row = [certificate.words("assumptions", each.name), f"{measure}: {size}"]
        row.append(certificate.words("states", each.state))
        rows.append([*row, certificate.words("states", f"counted_{counted}")])
    return rows


def _budget(certificate: Certificate) -> Rows:
    """Return contributions to u of each value, in the unit of its last digits."""
    return _contributions(certificate)[0]


def _unit(value: CertifiedValue) -> str:
    """Return the unit of a value's last digits, with the power of ten before it."""
    _, power = _digits(value)
    factor = f"10{str(power).translate(SUPERSCRIPTS)} " if power else ""
    return f"{factor}{value.quantity.unit}".strip()


def _contributions(certificate: Certificate) -> tuple[Rows, list[str]]:
    """Return the rows of the budget, and the sources that no last digit of a value shows."""
    columns = []
    sizes: dict[str, float] = {}
    totals = []
    for value in certificate.values:
        budget = certificate.apparatus.budget.get(value.quantity.name, {})
        places, power = _digits(value)
        unit = 10.0**power * value.quantity.scale
        columns.append({source: f"{u / unit:.{places}f}" for source, u in budget.items()})
        totals.append(f"{total_of(budget) / unit:.{places}f}" if budget else "")
        for source, u in budget.items():
            sizes[source] = max(sizes.get(source, 0.0), abs(u) / value.uncertainty)
    rows = []
    negligible = []
    for source in sorted(sizes, key=lambda source: -sizes[source]):
        words = certificate.words("sources", source)
        cells = [column.get(source, "") for column in columns]
        if any(cell.strip("-0.") for cell in cells):
            rows.append([words, *cells])
        else:
            negligible.append(words)
    return [*rows, [certificate.words("sources", "total"), *totals]], negligible


def _digits(value: CertifiedValue) -> tuple[int, int]:
    """Return how many decimals a value is stated with, and the power of ten before its unit."""
    scale = value.quantity.scale
    _, spread, power = rounded(value.value / scale, value.expanded / scale)
    return len(spread.partition(".")[2]), power


def _conformity(certificate: Certificate) -> Rows:
    rows: Rows = []
    for item in certificate.conformity:
        value = item.certified
        places, power = _digits(value)
        unit = 10.0**power * value.quantity.scale
        # One digit more than the value has: limits are no values that are measured.
        y, lower, upper, lowest, highest = (
            f"{number / unit:.{places + 1}f}".replace("inf", "∞")
            for number in (value.value, item.lower, item.upper, *item.acceptance)
        )
        row = [f"{_name(certificate, value)} ({_unit(value) or '1'})", y]
        row += [f"{lower} – {upper}", f"{lowest} – {highest}", _percent(item.probability)]
        rows.append([*row, certificate.words("statements", item.statement)])
    return rows


def _percent(probability: float) -> str:
    if probability > 0.9999:
        return "> 99.99 %"
    return f"{100 * probability:.2f} %" if probability >= 1e-4 else "< 0.01 %"


def scan_figure(apparatus: ApparatusFunction) -> Figure:
    """Draw a scan with its fits, and their residuals, half a page wide."""
    with house_style():
        figure = new_figure(3.2)
        figure.set_figwidth(FIGURE_WIDTH / 2)
        scan, residuals = figure.subplots(2, sharex=True, height_ratios=(2, 1))
        loads = [("", apparatus)]
        draw_scans([scan], loads)
        draw_residuals(residuals, apparatus, loads)
        residuals.set_xlabel(position_label(apparatus))
    return figure


_TABLES = {
    "equipment": _equipment,
    "assumptions": assumption_rows,
    "values": _values,
    "profile": _profile,
    "budget": _budget,
    "conformity": _conformity,
    "others": _others,
}
_FIGURES = {"scan": scan_figure, "radial": radial_figure}
