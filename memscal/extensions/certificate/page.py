"""Pages of a certificate: one HTML page, and the tagged PDF/A-3 that is made of it."""

import base64
import hashlib
import warnings
from collections.abc import Iterable, Mapping
from datetime import datetime
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from memscal.errors import MemscalError
from memscal.extensions.certificate.certificate import COVERAGE_FACTOR, SYNTHETIC, Certificate
from memscal.extensions.certificate.laboratory import ZERO_CELSIUS
from memscal.figures.calibration import radial_figure
from memscal.figures.report import Picture, html_figures
from memscal.model.checks import state_of_checks
from memscal.model.notation import SUPERSCRIPTS, format_measured
from memscal.model.provenance import timestamp
from memscal.model.quantities import MM, PER_MM, PER_MM2
from memscal.summaries.declared import total_of
from memscal.summaries.table import Table

_PAGE = Path(__file__).with_name("certificate.html")
_FONTS = "'Liberation Sans', Arial, Helvetica, 'DejaVu Sans', sans-serif"


def certificate_page(of: Certificate) -> str:
    """Return a certificate as a self-contained HTML page; what came from files is escaped."""
    laboratory = of.sections["laboratory"]
    person = of.sections["person"]
    t, h = (of.sections["conditions"][key] for key in ("temperature", "humidity"))
    keys = ("name", "serial", "certificate", "date")
    heads = ("Instrument", "Serial number", "Certificate", "Date of certificate")
    alt = "G(r) with its expanded uncertainty as a band; the numbers are in the table beside it."
    caption = "G(r); band ± U (k = 2)."
    texts = {
        "number": of.number,
        "created": timestamp(),
        "mark": SYNTHETIC if of.synthetic else "",
        "laboratory_name": laboratory["name"],
        "laboratory_address": _address(laboratory),
        "person_name": person["name"],
        "person_role": person["role"],
        "accreditation": of.accreditation,
        "setting": _setting(of),
        "origin": _origin(of),
        "celsius": _expanded(t.value - ZERO_CELSIUS, t.uncertainty, 1.0, "°C"),
        "humidity": _expanded(h.value, h.uncertainty, 0.01, "%"),
        "sources": _sources(of),
        "not_counted": _not_counted(of),
        "resolved": f"{of.apparatus.resolved_wavenumber / PER_MM:.3g} rad/mm",
    }
    blocks = {
        "fonts": _FONTS,
        "laboratory_css": "".join(map(_css, laboratory["name"])),
        "warnings": "\n".join(f'<p class="note failed">{escape(text)}</p>' for text in of.warnings),
        "facts": _facts(of),
        "equipment": _table("", "", heads, [[i[key] for key in keys] for i in of.equipment]),
        "values": _values(of),
        "profile": _profile(of),
        "figure": html_figures([Picture(lambda: radial_figure(of.apparatus), alt, caption)]),
        "budget": _budget(of),
        "conformity": _conformity(of),
    }
    page = Template(_PAGE.read_text(encoding="utf-8"))
    return page.substitute({name: escape(text) for name, text in texts.items()} | blocks)


def _css(character: str) -> str:
    """Return a character as a string of a style sheet holds it, whatever it is."""
    plain = character.isascii() and (character.isalnum() or character in " ,.-")
    return character if plain else f"\\{ord(character):x} "


def _table(kind: str, title: str, head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    drawn = Table(title, tuple(head), [tuple(row) for row in rows]).html()
    drawn = drawn.replace("<caption></caption>\n", "")
    return drawn.replace("<table>", f'<table class="{kind}">', 1)


def _address(of: Mapping[str, Any]) -> str:
    place = " ".join(of[key] for key in ("post_code", "city") if key in of)
    lines = (of.get("street"), f"{place}, {of['country']}", of.get("email"), of.get("phone"))
    return " · ".join(line for line in lines if line)


def _facts(of: Certificate) -> str:
    sensor, customer, conditions = (of.sections[k] for k in ("sensor", "customer", "conditions"))
    begin, end = (conditions[key][:10] for key in ("start_time", "end_time"))
    rows = {
        "Object": f"MEMS stress sensor under an elastic film: {sensor['name']}",
        "Manufacturer": sensor["manufacturer"],
        "Model, channel": ", ".join(text for text in (sensor["model"], sensor["channel"]) if text),
        "Serial number": sensor["serial"],
        "Customer": f"{customer['name']}, {_address(customer)}",
        "Date of measurement": begin if end in ("", begin) else f"{begin} to {end}",
        "Date of issue": of.issued,
        "Measured by": of.sections["person"].get("operator", ""),
    }
    return _table("facts", "", ("", ""), [row for row in rows.items() if row[1]])


def _setting(of: Certificate) -> str:
    data = of.apparatus
    rod = data.indenter
    film = data.film
    each = data.reconvolution.load
    facts = [f"{data.reconvolution.x.size} readings ({data.reading.unit})"]
    if (loads := data.load if each is None else each) is not None:
        low, high = (f"{extreme(loads):.4g}" for extreme in (np.min, np.max))
        facts[0] += f" under a load of {low} N" if low == high else f", loads {low} to {high} N"
    if rod is not None:
        facts.append(f"a {rod.shape} of radius {_expanded(rod.radius, rod.radius_uncertainty, MM)}")
    if film is not None:
        thickness = _expanded(film.thickness, film.thickness_uncertainty, MM)
        modulus = _expanded(film.young_modulus, film.young_modulus_uncertainty, 1e6, "MPa")
        ratio = _expanded(film.poisson_ratio, film.poisson_ratio_uncertainty, 1.0, "")
        facts.append(
            f"a film of thickness {thickness}, Young's modulus {modulus}, Poisson's ratio {ratio}, "
            f"law {film.law or 'not stated'}"
        )
    method = data.process.configuration.get("method", "not stated")
    program = f"Program: memscal {data.process.version}."
    return f"Method {method}, with {'; '.join(facts)} (± U, k = 2). {program}"


def _sources(of: Certificate) -> str:
    """Name the sources that count."""
    budget = of.apparatus.budget
    shares = (share for of_value in budget.values() for share in of_value.items())
    sources = dict.fromkeys(source for source, u in shares if u)
    return ", ".join(source.replace("_", " ") for source in sources) or "no source that is named"


def _not_counted(of: Certificate) -> str:
    """Say what the uncertainties do not count, as the calibration said it."""
    messages = of.apparatus.process.messages
    return " ".join(m.text for m in messages if m.kind in ("film_law", "uncertainty_unstated"))


def _expanded(value: float, u: float | None, scale: float, unit: str = "mm") -> str:
    """Return a value with U = k u, both given in SI units, ``scale`` of which are the unit."""
    return format_measured(value / scale, u and COVERAGE_FACTOR * u / scale, unit)


def _origin(of: Certificate) -> str:
    data = of.apparatus
    source = of.apparatus.process.input_scan
    scan = f" Scan {source.file_name}, SHA-256 {source.sha256}." if source else ""
    checks = f"Quality checks of the calibration: {state_of_checks(data.checks)}."
    return f"{checks} Artifact: content digest {data.content_digest}.{scan}"


def _values(of: Certificate) -> str:
    rows = []
    for i, (value, correlations) in enumerate(zip(of.values, of.correlation, strict=True)):
        quantity = value.quantity
        share = 100 * value.expanded / abs(value.value) if value.value else np.inf
        rows.append(
            (
                f"({i + 1}) {quantity.words}" + (f", {quantity.symbol}" if quantity.symbol else ""),
                _expanded(value.value, value.uncertainty, quantity.scale, quantity.unit),
                f"{share:.2g} %" if share < 99 else "–",
                *(f"{round(r, 2) + 0:.2f}" for r in correlations[:i]),
                *("1", *[""] * (len(of.values) - i - 1)),
            )
        )
    numbers = [f"({i + 1})" for i in range(len(rows))]
    head = ("Quantity y", "y ± U (k = 2)", "U / y", *numbers)
    title = f"Right: correlation coefficients of the values {numbers[0]} to {numbers[-1]}"
    return _table("numbers", title, head, rows)


def _profile(of: Certificate) -> str:
    expanded = COVERAGE_FACTOR * np.sqrt(np.diag(of.profile.covariance))
    rows = [
        (f"{r / MM:.4g}", format_measured(g / PER_MM2, u / PER_MM2))
        for r, g, u in zip(of.profile.r, of.profile.g, expanded, strict=True)
    ]
    return _table("numbers", "", ("r in mm", "G(r) ± U in 1/mm² (k = 2)"), rows)


def _budget(of: Certificate) -> str:
    budget = of.apparatus.budget
    finite = [value for value in of.values if np.isfinite(value.value) and value.value]
    columns = [value for value in finite if value.quantity.name in budget]
    sources = dict.fromkeys(s for value in columns for s in budget[value.quantity.name])
    shares = {
        source: [100 * budget[v.quantity.name].get(source, 0.0) / abs(v.value) for v in columns]
        for source in sources
    }
    if not shares:
        return "<p>The artifact states no budget by source.</p>"
    largest = {source: max(map(abs, row)) for source, row in shares.items()}
    order = sorted(sources, key=lambda source: -largest[source])
    rows = {s.replace("_", " "): shares[s] for s in order if largest[s] >= 0.005}
    totals = [100 * total_of(budget[v.quantity.name]) / abs(v.value) for v in columns]
    rows["root sum of squares"] = totals
    numbers = [f"({of.values.index(value) + 1})" for value in columns]
    title = "Standard uncertainties u (k = 1) by source, in percent of the value"
    cells = [(source, *(f"{share:.2f}" for share in row)) for source, row in rows.items()]
    return _table("numbers", title, ("Source", *numbers), cells)


def _conformity(of: Certificate) -> str:
    if not of.conformity:
        return "<p>No statement of conformity was agreed.</p>"
    rows = []
    for item in of.conformity:
        quantity = item.of.quantity
        w = item.guard_band
        p = 100 * item.probability
        numbers = (item.of.value, item.lower, item.upper, item.lower + w, item.upper - w)
        y, *ends = _alike([number / quantity.scale for number in numbers])
        rows.append(
            (
                f"{quantity.words} in {quantity.unit}" if quantity.unit else quantity.words,
                *(y, f"{ends[0]} to {ends[1]}", f"{ends[2]} to {ends[3]}"),
                "above 99.99 %" if p > 99.99 else "below 0.01 %" if p < 0.01 else f"{p:.2f} %",
                item.statement,
            )
        )
    head = ("Quantity y", "y", "Tolerance", "Acceptance", "Conformance probability", "Statement")
    return f"<p>Decision rule: {escape(of.decision)}</p>\n" + _table("", "", head, rows)


def _alike(numbers: list[float]) -> list[str]:
    """Write numbers with one power of ten, that of the first."""
    power = int(np.floor(np.log10(abs(numbers[0])))) if numbers[0] else 0
    factor = f"×10{str(power).translate(SUPERSCRIPTS)}" if not -3 < power < 4 else ""
    scale = 10.0**power if factor else 1.0
    return [f"{n / scale:.5g}{factor}" if np.isfinite(n) else "no limit" for n in numbers]


def certificate_pdf(of: Certificate, page: str, xml: bytes) -> bytes:
    """Return the page as a tagged PDF/A-3 with the XML in it; nothing is fetched."""
    try:
        import weasyprint
    except (ImportError, OSError) as error:
        problem = f"WeasyPrint, which makes the PDF, cannot be used: {error}."
        cure = 'Install the extra "certificate" (pip install "memscal[certificate]"), or write'
        raise MemscalError(problem, cure=f"{cure} .html and print it.") from error
    now = datetime.fromisoformat(timestamp())
    attachment = weasyprint.Attachment(
        string=xml,
        name=f"{of.number}.xml",
        description="The same as a Digital Calibration Certificate",
        created=now,
        modified=now,
        relationship="Alternative",
    )
    fetcher = weasyprint.URLFetcher(allowed_protocols=("data",), allow_redirects=False)
    document = weasyprint.HTML(string=page, url_fetcher=fetcher)
    digest = hashlib.sha256(page.encode() + xml).digest()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # it leaves its colour profile open
        made: bytes = document.write_pdf(
            pdf_variant="pdf/a-3a",
            pdf_identifier=base64.b16encode(digest[:16]),
            attachments=[attachment],
        )
    return made
