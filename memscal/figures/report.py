"""Reports of results as HTML pages, each without other files, network or scripts."""

import base64
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import singledispatch
from html import escape
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from memscal.apparatus import ApparatusFunction
from memscal.calibration.calibrate import Calibration
from memscal.extensions import VIEWS, module
from memscal.figures.calibration import values_text
from memscal.figures.friction import comparison_figures
from memscal.figures.style import render_figure
from memscal.friction.results import FrictionComparison, joint_text
from memscal.measurement.restoration import Restoration
from memscal.model import records
from memscal.model.apparatus import ApparatusData
from memscal.model.checks import Message, QualityCheck, marked_texts
from memscal.model.measured_stress import MeasuredScan, MeasuredStress
from memscal.model.notation import format_measured
from memscal.model.provenance import Process, SourceFile
from memscal.model.quantities import KPA, PER_MM, Quantity, Record, by_name, estimated_quantity
from memscal.model.result import Drawn, Told
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.summaries import comparison as comparisons
from memscal.summaries.calibration import (
    apparatus_of,
    assumptions_table,
    explanations_table,
    sensor_title,
)
from memscal.summaries.declared import cell, total_of
from memscal.summaries.stress import contact_words
from memscal.summaries.table import CHECKS, Table, checks_table, stated_text, verdict, worst_checks
from memscal.version import __version__

#: By the policy in it a browser fetches nothing and runs nothing.
_PAGE = Path(__file__).with_name("report.html")
#: Bytes that the figures of a page may have, which leaves it below a megabyte.
_MOST_IMAGE_BYTES = 800_000
#: Dots per inch of figures that are too large as drawings.
_COARSE = 90.0


class Picture(NamedTuple):
    """A figure, drawn when it is called, with a text in its place and its caption."""

    draw: Callable[[], Figure]
    alt: str
    caption: str


@dataclass(frozen=True, kw_only=True)
class Report:
    """What the page of a result says beside its tables, of which ``leading`` precede figures."""

    title: str
    verdict: str = ""  # by default the answer of the result
    failed: bool = False  # or if a check failed
    leading: int = 2
    pictures: Sequence[Picture] = ()
    checks: Sequence[QualityCheck] = ()
    messages: Sequence[Message] = ()
    budget: Table | None = None
    assumptions: Sequence[Table] = ()
    settings: Sequence[Table] = ()
    files: Mapping[str, SourceFile | None] = field(default_factory=dict)
    process: Process | None = None


def html_report(result: Told) -> str:
    """Return a result as a self-contained HTML page; what came from files is escaped."""
    report = report_of(result)
    tables = [table for table in result.tables() if table.title != CHECKS]
    explained = checks_table(worst_checks(report.checks), meanings=True)
    checks = replace(
        explained,
        title="Each passes up to its limit; of one made several times, what failed and the worst",
    )
    items = "\n".join(f"<li>{escape(text)}</li>" for text in marked_texts(report.messages))
    sections = {
        "Results": _html(tables[: report.leading]),
        "Figures": html_figures(report.pictures),
        "Further results": _html(tables[report.leading :]),
        "Quality checks": _html([checks]),
        "Notes and warnings": f"<ul>\n{items}\n</ul>" if items else "",
        "Uncertainty budget": _html([report.budget] if report.budget else []),
        "What the answer assumes": _html(report.assumptions),
        "What was measured on": _html(report.settings),
        "Provenance": _html(_provenance(report)),
    }
    title = escape(report.title)
    body = [f"<h1>{title}</h1>"]
    found = report.verdict or result.answer()
    if found:
        failed = report.failed or not all(check.passed for check in report.checks)
        kind = "verdict failed" if failed else "verdict"
        lines = "<br>\n".join(escape(found).splitlines())
        body.append(f'<p class="{kind}" role="note">{lines}</p>')
    for heading, content in sections.items():
        if content:
            body.append(f"<section>\n<h2>{heading}</h2>\n{content}\n</section>")
    page = Template(_PAGE.read_text(encoding="utf-8"))
    return page.substitute(title=title, body="\n".join(body), program=f"memscal {__version__}")


def _html(tables: Sequence[Table]) -> str:
    """Return tables, each in a box that scrolls on a narrow screen, by keys, too."""
    boxes = (
        f'<div class="scroll" role="group" tabindex="0" aria-label="{escape(table.title)}">\n'
        f"{table.html()}\n</div>"
        for table in tables
        if table.rows
    )
    return "\n".join(boxes)


def html_figures(pictures: Sequence[Picture]) -> str:
    """Return figures with their captions, as images that the page holds."""
    figures = [picture.draw() for picture in pictures]
    images = [html_image(figure, "svg", 72.0) for figure in figures]
    for i in sorted(range(len(images)), key=lambda i: -len(images[i])):
        if sum(map(len, images)) > _MOST_IMAGE_BYTES:
            images[i] = html_image(figures[i], "png", _COARSE)
    return "\n".join(
        f'<figure>\n<img alt="{escape(picture.alt)}" src="{image}">\n'
        f"<figcaption>{escape(picture.caption)}</figcaption>\n</figure>"
        for picture, image in zip(pictures, images, strict=True)
    )


def html_image(figure: Figure, form: str, dpi: float) -> str:
    """Return a figure as the address of an image, which holds it."""
    content = base64.b64encode(render_figure(figure, form, dpi=dpi)).decode("ascii")
    return f"data:image/{'svg+xml' if form == 'svg' else form};base64,{content}"


@singledispatch
def report_of(result: Told) -> Report:
    """Return what the page of a result says beside its tables; its figure's module may state it."""
    drawn_in = VIEWS[type(result).__name__][1].rpartition(".")[0]
    if drawn_in.startswith("extensions.") and hasattr(module(drawn_in), "report"):
        report: Report = module(drawn_in).report(result)
        return report
    tables: list[Table] = result.tables()
    title = tables[0].title if tables else type(result).__name__
    return Report(
        title=title,
        pictures=[Picture(result.plot, title, title)] if isinstance(result, Drawn) else [],
        checks=getattr(result, "checks", ()),
        messages=getattr(result, "messages", ()),
    )


@report_of.register(ApparatusFunction)
@report_of.register(Calibration)
def _calibration_report(result: Calibration | ApparatusFunction) -> Report:
    data = apparatus_of(result)
    process = data.process
    alt = (
        f"Panels: the scan with both reconvolutions, linear and logarithmic; residuals; "
        f"the apparatus function with its band, linear and logarithmic; the transfer function "
        f"resolved up to {data.resolved_wavenumber / PER_MM:.3g} rad/mm. "
        f"{values_text(data)}. {verdict(data.checks)}"
    )
    caption = (
        "a, c: scan, reconvolutions with the deconvolved G and with the Gaussian, and the "
        "reference. b: residuals in standard uncertainties. d, e: G with its band (k = 2) and "
        "the Gaussian. f: transfer function; hatched, what the scan does not resolve. Of a scan "
        "over the plane, from g: voltage, residuals and G; at several loads a row for each."
    )
    values = dict(zip(data.parameters.names, data.parameters.values, strict=True))
    budgets = []
    for name, budget in data.budget.items():
        quantity = estimated_quantity(name).read_in(data.reading)
        budgets.append((quantity, budget, values.get(name, 0.0), ""))
    return Report(
        title=sensor_title(data),
        pictures=[Picture(result.plot, alt, caption)],
        checks=data.checks,
        messages=process.messages,
        budget=_budget(*budgets, down=True),
        assumptions=[explanations_table(data), assumptions_table(data)],
        settings=[_setting(data, data.load, data.reference)],
        files={"scan": process.input_scan, "reference": process.input_reference},
        process=process,
    )


@report_of.register
def _stress_report(stress: MeasuredStress) -> Report:
    largest = max(stress.profiles, key=lambda profile: profile.maximum)
    quantities = by_name(records.STRESS_NUMBERS.quantities)
    top = cell(quantities["maximum"], largest)
    alt = (
        f"Stress against the distance from the centre, {len(stress.profiles)} profiles on a "
        f"linear and a logarithmic scale. The largest, at {largest.label}, has a maximum of {top}."
    )
    caption = (
        "a: measured stress with its uncertainty; lines: the restored stress as the sensor blurs "
        "it; ticks at the top: the radius of the contact without friction. b: the same on a "
        "logarithmic scale, pale where the stress is not distinct from zero."
    )
    budgets = []
    for i, p in enumerate(stress.profiles, start=1):
        label = f"{i}: {p.label}, "
        budgets.append((quantities["force"], p.force_budget, p.force, label))
        budgets.append((quantities["maximum"], p.maximum_budget, p.maximum, label))
    return Report(
        title=f"Stress measured at the base of {contact_words(stress.scans[0])}",
        pictures=[Picture(stress.plot, alt, caption)],
        checks=stress.checks,
        messages=stress.messages,
        budget=_budget(*budgets),
        **_measured_on(stress),
    )


@report_of.register
def _restoration_report(restored: Restoration) -> Report:
    on_axis = float(restored.stress(0.0)) / KPA
    u = float(restored.stress_uncertainty(0.0)) / KPA
    alt = (
        "Left: stress at the base against the distance from the centre, restored, blurred again, "
        f"and measured; on the axis it is {format_measured(on_axis, u, 'kPa')}. Right: residuals."
    )
    caption = (
        "a: the restored stress with its band, the same as the sensor blurs it, the calculated "
        "stress where there is one, and the scan. b: residuals over the standard uncertainty of "
        "the noise."
    )
    force = by_name(records.RESTORED)["force"]
    return Report(
        title=f"Stress restored at the base of {contact_words(restored.scan)}",
        pictures=[Picture(restored.plot, alt, caption)],
        checks=restored.checks,
        messages=restored.messages,
        budget=_budget((force, restored.force_budget, restored.force, "")),
        settings=[_setting(restored.scan, restored.scan.load)],
        files={"artifact": restored.apparatus.source, "scan": restored.scan.source},
    )


#: First sentences of the captions of a comparison's figures, by the beginning of their names.
_COMPARED = {
    "profiles": "Measured and calculated profiles{}",
    "maxima": "Maximum of the stress against the load",
    "effective-friction": "Effective friction coefficient against the load, by the maximum and by "
    "the whole profile, with 95 % intervals; band: all loads together",
    "likelihood": "Likelihood of each friction coefficient: twice the loss of its logarithm, for "
    "each load and for all together; dotted: what bounds 68 % and 95 %",
    "sliding": "Measured beside calculated profiles of sliding, and the friction coefficient",
    "interface": "Laws of the interface: how well each length explains all loads, the evidence of "
    "each law, and the friction coefficients that a slip length means",
}
_DETAILS = {
    "profiles": " Points: measured stress; lines: calculated, with the friction coefficients that "
    "the legend names. Below: measured less calculated stress over its uncertainty.",
    "maxima": " Points: the largest measured stress over the largest of the frictionless contact; "
    "lines: the same calculated with each friction coefficient.",
}


@report_of.register
def _comparison_report(compared: FrictionComparison) -> Report:
    return Report(
        title=f"Friction of {contact_words(compared.measured.scans[0])}",
        leading=1 + len(compared.loadings),
        pictures=list(_compared_pictures(compared)),
        checks=compared.checks,
        messages=tuple(comparisons.notes(compared)),
        **_measured_on(compared.measured),
    )


def _compared_pictures(compared: FrictionComparison) -> Iterator[Picture]:
    joint = joint_text(compared.joint)
    for stem, draw in comparison_figures(compared).items():
        for name, subject in _COMPARED.items():
            if stem.startswith(name):
                shown = subject.format(stem.removeprefix(name).replace("-", ", "))
                alt = f"{shown}. All loads together: {joint}."
                yield Picture(draw, alt, f"{shown}.{_DETAILS.get(name, '')}")


def _measured_on(measured: MeasuredStress) -> dict[str, Any]:
    """Return what was measured on what, and the files and versions of it."""
    settings = []
    files = {"artifact": measured.artifact}
    for i, scan in enumerate(measured.scans, start=1):
        files[f"scan {i}"] = scan.source
        setting = _setting(scan)
        if setting not in settings:
            settings.append(setting)
    return {"settings": settings, "files": files, "process": measured.process}


def _setting(
    holder: Scan | MeasuredScan | ApparatusData,
    load: float | None = None,
    reference: StressProfile | None = None,
) -> Table:
    """Return sensor, indenter, film and reference as a table of items and values."""
    indenter = holder.indenter
    rows = [*_stated("", records.SENSOR, holder.sensor)]
    rows += _stated("sensor, ", records.DYNAMICS, holder.sensor.dynamics)
    if load is not None:
        rows.append(("load", f"{load:.4g} N"))
    rows += _stated("", records.LOAD_CELL, getattr(holder, "load_cell", None))
    rows += _stated(f"{getattr(indenter, 'shape', '')}, ", records.ROUND_INDENTER, indenter)
    rows += _stated("film, ", records.FILM, holder.film)
    rows += _stated("reference, ", records.SOLVER, reference)
    rows += _stated("reference, ", records.NUMERICS, reference)
    return Table("Sensor, indenter and film", ("item", "value"), rows)


def _stated(prefix: str, record: Record, holder: object) -> Iterator[tuple[str, str]]:
    """Return what an object states of a record: words, and value with uncertainty and unit."""
    for quantity in record.quantities:
        value = getattr(holder, quantity.name, None)
        if isinstance(value, str) and value:
            yield prefix + quantity.words, value
        elif isinstance(value, float) and not quantity.name.endswith("_uncertainty"):
            text = f"{value / quantity.scale:.3g} {quantity.unit}".strip()
            if hasattr(holder, f"{quantity.name}_uncertainty"):
                text = cell(quantity, holder)
            yield prefix + quantity.words, text


def _budget(*rows: tuple[Quantity, Mapping[str, float], float, str], down: bool = False) -> Table:
    """Return the shares of all sources in the uncertainty of values; ``down``: a row a source.

    Each value has its quantity, its uncertainty by source, itself, and what it is of.
    """
    sources: dict[str, None] = {}
    for _, budget, *_ in rows:
        sources |= dict.fromkeys(budget)
    words = (source.replace("_", " ") for source in sources)
    lines = [("source" if down else "", *words, "root sum of squares", "relative")]
    for quantity, budget, value, subject in rows:
        total = total_of(budget)
        cells = [_share(budget.get(source), total, quantity.scale) for source in sources]
        cells.append(f"{total / quantity.scale:.2g}")
        cells.append(f"{100 * total / abs(value):.2g}%" if value else "–")
        lines.append((subject + quantity.heading, *cells))
    head, *body = zip(*lines, strict=True) if down else lines
    return Table(
        "Standard uncertainty by source, and its share of the variance",
        head,
        body if sources else [],
    )


def _share(u: float | None, total: float, scale: float) -> str:
    if u is None:
        return "–"
    size = f"{u / scale:.2g}"
    return f"{size} ({np.copysign((u / total) ** 2, u):.0%})" if total > 0 else size


def _provenance(report: Report) -> list[Table]:
    """Return program, files, options and versions."""
    process = report.process
    rows = []
    if process:
        rows = [("program", f"{process.program} {process.version}"), ("date", process.date)]
    for name, source in report.files.items():
        if source:
            rows.append((f"input {name}", source.file_name))
            rows.append((f"its SHA-256 ({name})", source.sha256))
    tables = [Table("What was run on what", ("item", "value"), rows)]
    if process:
        tables.append(_named_values("Options", process.configuration))
        tables.append(_named_values("Versions", process.environment))
    return tables


def _named_values(title: str, values: Mapping[str, Any]) -> Table:
    rows = [(name, stated_text(value)) for name, value in values.items()]
    return Table(title, ("name", "value"), rows)
