"""A calibration as one HTML page that opens anywhere: no other file, no network, no script."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from string import Template

import numpy as np

from memscal.figures.calibration import calibration_figure, values_text
from memscal.figures.style import render_figure
from memscal.model.apparatus import ApparatusData
from memscal.model.notation import format_measured
from memscal.model.provenance import SourceFile
from memscal.model.quantities import (
    MM,
    PER_MM,
    estimated_quantity,
    measured_text,
    parameter_quantity,
)

__all__ = ["PAGE", "STYLE", "html_report"]

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
  max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; line-height: 1.25; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin-top: 2rem; border-bottom: 1px solid #bbb; }
h3 { font-size: 1rem; }
.verdict { padding: .6rem .9rem; border-left: .4rem solid #0072b2; background: #eef5fa; }
.verdict.failed { border-left-color: #a11d00; background: #fbeeea; font-weight: 600; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-size: .92rem; }
caption { text-align: left; color: #555; padding-bottom: .3rem; }
th, td { text-align: left; vertical-align: top; padding: .3rem .7rem .3rem 0;
  border-bottom: 1px solid #ddd; overflow-wrap: break-word; }
td:last-child { overflow-wrap: anywhere; }
th[scope=row] { font-weight: 500; min-width: 9rem; }
thead th { border-bottom: 2px solid #777; }
td { font-variant-numeric: tabular-nums; }
tr.failed th, tr.failed td { color: #a11d00; font-weight: 600; }
tr.total th, tr.total td { font-weight: 600; border-top: 1px solid #777; }
figure { margin: 1rem 0; }
img { max-width: 100%; height: auto; display: block; margin: 0 auto; }
figcaption { color: #555; font-size: .92rem; }
@page { margin: 15mm; }
@media print {
  body { font-size: 10pt; margin: 0; max-width: none; padding: 0; }
  h2, h3, caption { break-after: avoid; }
  tr, figure, .verdict { break-inside: avoid; }
  img { max-height: 235mm; }
  .verdict, tr.failed td { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""

# The policy makes the promise binding: nothing is fetched and nothing is run.
PAGE = Template(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>$style</style>
</head>
<body>
<main>
$body
</main>
</body>
</html>
"""
)

_RATIO_SCALE = (
    "conversion_constant",
    "conversion_constant_gaussian",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
)


def html_report(data: ApparatusData) -> str:
    """Return a calibration as a self-contained HTML page, for reading and for printing.

    Values with uncertainty and unit, quality checks with what a failure means, the
    uncertainty budget, the figure of :func:`~memscal.figures.calibration.calibration_figure`,
    and the provenance.  The same data give the same text.

    Parameters
    ----------
    data : ApparatusData
        The result of a calibration, or what was read from an artifact.

    Returns
    -------
    str
        The page, in UTF-8's characters; everything that came from a file is escaped.
    """
    title = f"Apparatus function of {_sensor(data) or 'the sensor'}, channel {data.sensor.channel}"
    body = "\n".join(
        (
            f"<h1>{escape(title)}</h1>",
            _verdict(data),
            _section("Values", _values_table(data)),
            _section("Quality checks", _checks_table(data)),
            _section("Figure", _figure(data)),
            _section("Uncertainty budget", _budget_table(data)),
            _section("What was measured on", _setting_table(data)),
            _section("Provenance", _provenance(data)),
        )
    )
    return PAGE.substitute(title=escape(title), style=STYLE, body=body)


def _sensor(data: ApparatusData) -> str:
    return " ".join(part for part in (data.sensor.name, data.sensor.model) if part)


def _section(heading: str, content: str) -> str:
    return f"<section>\n<h2>{escape(heading)}</h2>\n{content}\n</section>"


def _verdict(data: ApparatusData) -> str:
    kind = "verdict" if data.passed else "verdict failed"
    return f'<p class="{kind}" role="note">{escape(_verdict_text(data))}</p>'


def _verdict_text(data: ApparatusData) -> str:
    if not data.checks:
        return "No quality check was made."
    failed = [check.name.replace("_", " ") for check in data.checks if not check.passed]
    if not failed:
        return f"All {len(data.checks)} quality checks passed."
    count = f"{len(failed)} of {len(data.checks)} quality checks failed"
    return f"{count}: {', '.join(failed)}. Read what each failure means before use."


def _values_table(data: ApparatusData) -> str:
    rows = []
    for name in data.parameters.names:
        shown, text = (
            parameter_quantity(data.parameters, name),
            measured_text(data.parameters, name),
        )
        value, spread = data.parameters[name], data.parameters.uncertainty(name)
        # A share of a position or an offset would mean nothing: its zero is arbitrary.
        share = f"{100 * spread / abs(value):.2g} %" if name in _RATIO_SCALE and value else "–"
        rows.append((shown.words, shown.symbol, text, share))
    resolved = data.resolved_wavenumber / PER_MM
    rows.append(("resolved up to the wavenumber", "k", f"{resolved:.3g} rad/mm", "–"))
    caption = "Estimates with their standard uncertainties (k = 1)"
    return _table(caption, ("quantity", "symbol", "value", "relative uncertainty"), rows)


def _checks_table(data: ApparatusData) -> str:
    rows = [
        (
            check.name.replace("_", " "),
            f"{check.value:.3g}",
            f"{check.limit:.3g}",
            "–" if check.p_value is None else f"{check.p_value:.2g}",
            "passed" if check.passed else "FAILED",
            check.meaning,
        )
        for check in data.checks
    ]
    failed = {i for i, check in enumerate(data.checks) if not check.passed}
    head = ("check", "value", "limit", "p-value", "result", "meaning")
    return _table(
        "Each check, its value, its limit and the chance of such a value", head, rows, marked=failed
    )


def _budget_table(data: ApparatusData) -> str:
    """Return sources of uncertainty in rows, estimated quantities in columns."""
    columns = list(data.budget)
    sources = list(dict.fromkeys(source for name in columns for source in data.budget[name]))
    if not sources:
        return "<p>No budget by source was stored.</p>"
    head = [
        "source",
        *(
            f"{estimated_quantity(name).words} ({estimated_quantity(name).unit})"
            for name in columns
        ),
    ]
    rows = [
        (source.replace("_", " "), *(_share(data, name, source) for name in columns))
        for source in sources
    ]
    total = [_root_sum_square(data.budget[name].values()) for name in columns]
    combined = (_in_unit(name, each) for name, each in zip(columns, total, strict=True))
    rows.append(("root sum of squares", *combined))
    caption = "Standard uncertainty by source, and its share of the variance"
    return _table(caption, head, rows, marked={len(rows) - 1}, mark="total")


def _share(data: ApparatusData, name: str, source: str) -> str:
    if source not in data.budget[name]:
        return "–"
    part, total = data.budget[name][source], _root_sum_square(data.budget[name].values())
    percent = f" ({100 * (part / total) ** 2:.0f} %)" if total > 0 else ""
    return _in_unit(name, part) + percent


def _in_unit(name: str, value: float) -> str:
    return f"{value / estimated_quantity(name).scale:.2g}"


def _root_sum_square(parts: Iterable[float]) -> float:
    return float(np.sqrt(sum(part**2 for part in parts)))


def _setting_table(data: ApparatusData) -> str:
    film, indenter, reference = data.film, data.indenter, data.reference
    rows = [
        ("sensor", _sensor(data) or "not stated"),
        ("channel", data.sensor.channel),
        ("load", f"{data.load:.4g} N"),
        (
            f"{indenter.shape}, radius",
            format_measured(indenter.radius / MM, _scaled(indenter.radius_uncertainty, MM), "mm"),
        ),
        (
            "film, Young's modulus",
            format_measured(
                film.young_modulus / 1e6, _scaled(film.young_modulus_uncertainty, 1e6), "MPa"
            ),
        ),
        (
            "film, Poisson's ratio",
            format_measured(film.poisson_ratio, film.poisson_ratio_uncertainty),
        ),
        (
            "film, thickness",
            format_measured(film.thickness / MM, _scaled(film.thickness_uncertainty, MM), "mm"),
        ),
        ("reference, solver", reference.solver or "not stated"),
        ("reference, discretisation", reference.discretisation or "not stated"),
        (
            "reference, estimated relative error",
            "not stated" if reference.convergence is None else f"{reference.convergence:.1g}",
        ),
    ]
    return _table("Sensor, indenter, film and reference", ("item", "value"), rows)


def _scaled(uncertainty: float | None, scale: float) -> float | None:
    return None if uncertainty is None else uncertainty / scale


def _provenance(data: ApparatusData) -> str:
    process = data.process
    rows = [
        ("program", f"{process.program} {process.version}"),
        ("date", process.date),
        *_source_rows("scan", process.input_scan),
        *_source_rows("reference", process.input_reference),
    ]
    parts = [_table("What was run on what", ("item", "value"), rows)]
    for caption, mapping in (("Options", process.configuration), ("Versions", process.environment)):
        if mapping:
            rows = [(str(key), _plain(value)) for key, value in mapping.items()]
            parts.append(_table(caption, ("name", "value"), rows))
    parts.append("<h3>Messages</h3>")
    if process.messages:
        items = "\n".join(f"<li>{escape(message.text)}</li>" for message in process.messages)
        parts.append(f"<ul>\n{items}\n</ul>")
    else:
        parts.append("<p>None.</p>")
    return "\n".join(parts)


def _source_rows(what: str, source: SourceFile | None) -> list[tuple[str, str]]:
    if source is None:
        return []
    return [(f"input {what}", source.file_name), (f"its SHA-256 ({what})", source.sha256)]


def _plain(value: object) -> str:
    """Return an option's value for reading: groups as "name: value", not as Python."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key}: {_plain(each)}" for key, each in value.items()) or "none"
    return "not given" if value is None else str(value)


def _figure(data: ApparatusData) -> str:
    svg = base64.b64encode(render_figure(calibration_figure(data), "svg")).decode("ascii")
    alt = (
        f"Six panels: the scan with both reconvolutions, linear and logarithmic; residuals; "
        f"the apparatus function with its band, linear and logarithmic; the transfer function "
        f"resolved up to {data.resolved_wavenumber / PER_MM:.3g} rad/mm. "
        f"{values_text(data)}. {_verdict_text(data)}"
    )
    caption = (
        "a, c: scan, reconvolutions with the deconvolved G and with the Gaussian, and the "
        "reference. b: residuals in standard uncertainties. d, e: G with its band (k = 2) and "
        "the Gaussian. f: transfer function; hatched, what the scan does not resolve."
    )
    return (
        f'<figure>\n<img alt="{escape(alt)}" src="data:image/svg+xml;base64,{svg}">\n'
        f"<figcaption>{escape(caption)}</figcaption>\n</figure>"
    )


def _table(
    caption: str,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    marked: Iterable[int] = (),
    mark: str = "failed",
) -> str:
    """Return a table whose first column heads its rows; every cell is escaped here."""
    lines = ["<table>", f"<caption>{escape(caption)}</caption>", "<thead><tr>"]
    lines += [f'<th scope="col">{escape(cell)}</th>' for cell in head]
    lines.append("</tr></thead>\n<tbody>")
    for i, (first, *rest) in enumerate(rows):
        opening = f'<tr class="{mark}">' if i in set(marked) else "<tr>"
        cells = "".join(f"<td>{escape(cell)}</td>" for cell in rest)
        lines.append(f'{opening}<th scope="row">{escape(first)}</th>{cells}</tr>')
    lines.append("</tbody>\n</table>")
    return "\n".join(lines)
