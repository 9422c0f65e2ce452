"""Reports as HTML pages, of a calibration first, without other files, network or scripts."""

import base64
import math
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from string import Template

import numpy as np
from matplotlib.figure import Figure

from memscal.figures.calibration import calibration_figure, values_text
from memscal.figures.style import render_figure
from memscal.model import records
from memscal.model.apparatus import ApparatusData
from memscal.model.notation import format_measured
from memscal.model.quantities import PER_MM, Record, estimated_quantity
from memscal.summaries.calibration import sensor_title, tables
from memscal.summaries.table import Table, checks_table, stated_text

#: By the policy in it a browser fetches nothing and runs nothing.
_PAGE = Path(__file__).with_name("report.html")


def html_report(data: ApparatusData) -> str:
    """Return a calibration as a self-contained HTML page; what came from files is escaped."""
    title = sensor_title(data)
    *values, _ = tables(data)
    sections = {
        "Values": "\n".join(table.html() for table in values),
        "Quality checks": checks_table(data.checks, meanings=True).html(),
        "Figure": _figure(data),
        "Uncertainty budget": _budget(data),
        "What was measured on": _setting(data).html(),
        "Provenance": _provenance(data),
    }
    return html_page(title, _verdict_text(data), sections, failed=not data.passed)


def html_page(title: str, verdict: str, sections: Mapping[str, str], *, failed: bool) -> str:
    """Return a page of a title, a verdict, and sections of HTML by their headings."""
    body = "\n".join(
        f"<section>\n<h2>{escape(heading)}</h2>\n{content}\n</section>"
        for heading, content in sections.items()
    )
    kind = "verdict failed" if failed else "verdict"
    note = f'<p class="{kind}" role="note">{escape(verdict)}</p>'
    heading = f"<h1>{escape(title)}</h1>\n{note}\n"
    page = Template(_PAGE.read_text(encoding="utf-8"))
    return page.substitute(title=escape(title), body=heading + body)


def html_figure(figure: Figure, alt: str, caption: str) -> str:
    """Return a figure with its caption, as an image that the page holds."""
    svg = base64.b64encode(render_figure(figure, "svg")).decode("ascii")
    return (
        f'<figure>\n<img alt="{escape(alt)}" src="data:image/svg+xml;base64,{svg}">\n'
        f"<figcaption>{escape(caption)}</figcaption>\n</figure>"
    )


def _verdict_text(data: ApparatusData) -> str:
    if not data.checks:
        return "No quality check was made."
    failed = [check.name.replace("_", " ") for check in data.checks if not check.passed]
    if not failed:
        return f"All {len(data.checks)} quality checks passed."
    count = f"{len(failed)} of {len(data.checks)} quality checks failed"
    return f"{count}: {', '.join(failed)}. Read what each failure means before use."


def _budget(data: ApparatusData) -> str:
    """Return sources of uncertainty in rows, estimated quantities in columns."""
    sources = dict.fromkeys(source for column in data.budget.values() for source in column)
    if not sources:
        return "<p>No budget by source was stored.</p>"
    columns = []
    for name, budget in data.budget.items():
        quantity = estimated_quantity(name).read_in(data.reading)
        total = float(np.sqrt(sum(u**2 for u in budget.values())))
        cells = [_share(budget.get(source), total, quantity.scale) for source in sources]
        ratio = math.nan
        if name in data.parameters and data.parameters[name] != 0:
            ratio = data.parameters.uncertainty(name) / abs(data.parameters[name])
        share = f"{100 * ratio:.2g} %" if math.isfinite(ratio) else "–"
        column = f"{quantity.words} ({quantity.unit})"
        columns.append((column, *cells, f"{total / quantity.scale:.2g}", share))
    names = [source.replace("_", " ") for source in sources]
    first = ("source", *names, "root sum of squares", "relative standard uncertainty")
    head, *rows = zip(first, *columns, strict=True)
    return Table("Standard uncertainty by source, and its share of the variance", head, rows).html()


def _share(u: float | None, total: float, scale: float) -> str:
    if u is None:
        return "–"
    return f"{u / scale:.2g}" + (f" ({100 * (u / total) ** 2:.0f} %)" if total > 0 else "")


def _setting(data: ApparatusData) -> Table:
    rows = [
        *_stated("", records.SENSOR, data.sensor),
        ("load", "not stated" if data.load is None else f"{data.load:.4g} N"),
        *_stated(f"{getattr(data.indenter, 'shape', '')}, ", records.ROUND_INDENTER, data.indenter),
        *_stated("film, ", records.FILM, data.film),
        *_stated("reference, ", records.SOLVER, data.reference),
        *_stated("reference, ", records.NUMERICS, data.reference),
    ]
    return Table("Sensor, indenter, film and reference", ("item", "value"), rows)


def _stated(prefix: str, record: Record, holder: object) -> Iterator[tuple[str, str]]:
    """Return what an object states of a record: words, and value with uncertainty and unit."""
    for quantity in record.quantities:
        value = getattr(holder, quantity.name, None)
        if isinstance(value, str) and value:
            yield prefix + quantity.words, value
        elif isinstance(value, float) and not quantity.name.endswith("_uncertainty"):
            value, spread = value / quantity.scale, f"{quantity.name}_uncertainty"
            text = f"{value:.3g} {quantity.unit}".strip()
            if hasattr(holder, spread):
                u = getattr(holder, spread)
                u = None if u is None else u / quantity.scale
                text = format_measured(value, u, quantity.unit)
            yield prefix + quantity.words, text


def _provenance(data: ApparatusData) -> str:
    process = data.process
    rows = [("program", f"{process.program} {process.version}"), ("date", process.date)]
    for name, source in (("scan", process.input_scan), ("reference", process.input_reference)):
        if source is not None:
            rows.append((f"input {name}", source.file_name))
            rows.append((f"its SHA-256 ({name})", source.sha256))
    blocks = [Table("What was run on what", ("item", "value"), rows).html()]
    for caption, mapping in (("Options", process.configuration), ("Versions", process.environment)):
        if mapping:
            rows = [(str(key), stated_text(value)) for key, value in mapping.items()]
            blocks.append(Table(caption, ("name", "value"), rows).html())
    items = "\n".join(f"<li>{escape(message.text)}</li>" for message in process.messages)
    messages = f"<ul>\n{items}\n</ul>" if items else "<p>None.</p>"
    return "\n".join([*blocks, "<h3>Messages</h3>", messages])


def _figure(data: ApparatusData) -> str:
    alt = (
        f"Panels: the scan with both reconvolutions, linear and logarithmic; residuals; "
        f"the apparatus function with its band, linear and logarithmic; the transfer function "
        f"resolved up to {data.resolved_wavenumber / PER_MM:.3g} rad/mm. "
        f"{values_text(data)}. {_verdict_text(data)}"
    )
    caption = (
        "a, c: scan, reconvolutions with the deconvolved G and with the Gaussian, and the "
        "reference. b: residuals in standard uncertainties. d, e: G with its band (k = 2) and "
        "the Gaussian. f: transfer function; hatched, what the scan does not resolve. Of a scan "
        "over the plane, from g: voltage, residuals and G; at several loads a row for each."
    )
    return html_figure(calibration_figure(data), alt, caption)
