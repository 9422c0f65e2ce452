"""Pages of a certificate: one HTML page, and the tagged PDF/A-3 that is made of it."""

import base64
import hashlib
import warnings
from collections.abc import Iterable, Mapping
from datetime import datetime
from functools import partial
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from memscal.apparatus import ApparatusFunction
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
#: Sources of a smaller share of every value, in percent, are left out of the budget.
_LEAST_SHARE = 0.005
_TOTAL = "root sum of squares"
#: Kinds of messages of a calibration that say what its uncertainties do not count.
_NOT_COUNTED = ("film_law", "uncertainty_unstated")
_FONTS = "'Liberation Sans', Arial, Helvetica, 'DejaVu Sans', sans-serif"


def certificate_page(certificate: Certificate) -> str:
    """Return a certificate as a self-contained HTML page; what came from files is escaped."""
    sections = certificate.sections
    laboratory = sections["laboratory"]
    temperature = sections["conditions"]["temperature"]
    humidity = sections["conditions"]["humidity"]
    celsius = temperature.value - ZERO_CELSIUS
    warnings = (f'<p class="note failed">{escape(text)}</p>' for text in certificate.warnings)
    apparatus = certificate.apparatus
    alt = "G(r) with its expanded uncertainty as a band; the numbers are in the table beside it."
    picture = Picture(partial(radial_figure, apparatus), alt, "G(r); band ± U (k = 2).")
    texts = {
        "number": certificate.number,
        "created": timestamp(),
        "mark": SYNTHETIC if certificate.synthetic else "",
        "laboratory_name": laboratory["name"],
        "laboratory_address": _address(laboratory),
        "person_name": sections["person"]["name"],
        "person_role": sections["person"]["role"],
        "accreditation": certificate.accreditation,
        "setting": _setting(apparatus),
        "origin": _origin(apparatus),
        "celsius": _expanded(celsius, temperature.uncertainty, 1.0, "°C"),
        "humidity": _expanded(humidity.value, humidity.uncertainty, 0.01, "%"),
        "sources": _sources(apparatus),
        "not_counted": " ".join(
            m.text for m in apparatus.process.messages if m.kind in _NOT_COUNTED
        ),
        "resolved": f"{apparatus.resolved_wavenumber / PER_MM:.3g} rad/mm",
    }
    blocks = {
        "fonts": _FONTS,
        "laboratory_css": "".join(map(_css, laboratory["name"])),
        "warnings": "\n".join(warnings),
        "facts": _facts(certificate),
        "equipment": _equipment(certificate),
        "assumptions": _assumptions(apparatus),
        "values": _values(certificate),
        "profile": _profile(certificate),
        "figure": html_figures([picture]),
        "budget": _budget(certificate),
        "conformity": _conformity(certificate),
    }
    page = Template(_PAGE.read_text(encoding="utf-8"))
    escaped = {name: escape(text) for name, text in texts.items()}
    return page.substitute(escaped | blocks)


def _css(character: str) -> str:
    """Return a character as a string of a style sheet holds it, whatever it is."""
    plain = character.isascii() and (character.isalnum() or character in " ,.-")
    return character if plain else f"\\{ord(character):x} "


def _address(contact: Mapping[str, str]) -> str:
    city = " ".join(contact[key] for key in ("post_code", "city") if key in contact)
    place = f"{city}, {contact['country']}"
    lines = (contact.get("street"), place, contact.get("email"), contact.get("phone"))
    return " · ".join(line for line in lines if line)


def _facts(certificate: Certificate) -> str:
    sections = certificate.sections
    sensor = sections["sensor"]
    customer = sections["customer"]
    begin = sections["conditions"]["start_time"][:10]
    end = sections["conditions"]["end_time"][:10]
    rows = {
        "Object": f"MEMS stress sensor under an elastic film: {sensor['name']}",
        "Manufacturer": sensor["manufacturer"],
        "Model, channel": ", ".join(text for text in (sensor["model"], sensor["channel"]) if text),
        "Serial number": sensor["serial"],
        "Customer": f"{customer['name']}, {_address(customer)}",
        "Date of measurement": begin if end in ("", begin) else f"{begin} to {end}",
        "Date of issue": certificate.issued,
        "Measured by": sections["person"].get("operator", ""),
    }
    return Table("", ("", ""), [row for row in rows.items() if row[1]]).html("facts")


def _equipment(certificate: Certificate) -> str:
    heads = ("Instrument", "Serial number", "Certificate", "Date of certificate")
    keys = ("name", "serial", "certificate", "date")
    rows = [[item[key] for key in keys] for item in certificate.equipment]
    return Table("", heads, rows).html()


def _setting(apparatus: ApparatusFunction) -> str:
    """Say by what method, from which readings, and with which film and indenter."""
    rod = apparatus.indenter
    film = apparatus.film
    readings = f"{apparatus.reconvolution.x.size} readings ({apparatus.reading.unit})"
    facts = [readings + _loads(apparatus)]
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
    method = apparatus.process.configuration.get("method", "not stated")
    program = f"Program: memscal {apparatus.process.version}."
    return f"Method {method}, with {'; '.join(facts)} (± U, k = 2). {program}"


def _loads(apparatus: ApparatusFunction) -> str:
    """Return the load of all readings, or the range of their loads; nothing if none is known."""
    loads: Any = apparatus.reconvolution.load
    if loads is None:
        loads = apparatus.load
    if loads is None:
        return ""
    low = f"{np.min(loads):.4g}"
    high = f"{np.max(loads):.4g}"
    return f" under a load of {low} N" if low == high else f", loads {low} to {high} N"


def _sources(apparatus: ApparatusFunction) -> str:
    """Name the sources that count."""
    sources: dict[str, None] = {}
    for budget in apparatus.budget.values():
        sources |= dict.fromkeys(source for source, u in budget.items() if u)
    return ", ".join(source.replace("_", " ") for source in sources) or "no source that is named"


def _assumptions(apparatus: ApparatusFunction) -> str:
    """Say what the values take for granted, and the size of each that moves A by one u."""
    texts: dict[str, str] = {}
    for each in apparatus.assumptions:
        size = f"{each.measure}: {each.size_text('conversion_constant')}"
        text = f" {each.sentence.removesuffix('.')} ({size})."
        texts[each.state] = texts.get(each.state, "") + text
    paragraphs = [f"<b>{state.capitalize()}.</b>{escape(t)}" for state, t in texts.items()]
    return " ".join(paragraphs) or "None is recorded."


def _expanded(value: float, u: float | None, scale: float, unit: str = "mm") -> str:
    """Return a value with U = k u, both given in SI units, ``scale`` of which are the unit."""
    return format_measured(value / scale, u and COVERAGE_FACTOR * u / scale, unit)


def _origin(apparatus: ApparatusFunction) -> str:
    source = apparatus.process.input_scan
    scan = f" Scan {source.file_name}, SHA-256 {source.sha256}." if source else ""
    checks = f"Quality checks of the calibration: {state_of_checks(apparatus.checks)}."
    return f"{checks} Artifact: content digest {apparatus.content_digest}.{scan}"


def _values(certificate: Certificate) -> str:
    count = len(certificate.values)
    rows = []
    for i, value in enumerate(certificate.values):
        quantity = value.quantity
        scale = quantity.scale
        symbol = f", {quantity.symbol}" if quantity.symbol else ""
        share = 100 * value.expanded / abs(value.value) if value.value else np.inf
        row = [
            f"({i + 1}) {quantity.words}{symbol}",
            format_measured(value.value / scale, value.expanded / scale, quantity.unit),
            f"{share:.2g} %" if share < 99 else "–",
            *(f"{round(r, 2) + 0:.2f}" for r in certificate.correlation[i, :i]),
        ]
        rows.append([*row, "1", *[""] * (count - i - 1)])
    numbers = [f"({i + 1})" for i in range(count)]
    # Two; more where the noise was estimated from few readings.
    factors = [value.factor for value in certificate.values]
    ends = dict.fromkeys([f"{min(factors):.3g}", f"{max(factors):.3g}"])
    head = ("Quantity y", f"y ± U (k = {' to '.join(ends)})", "U / y", *numbers)
    title = f"Right: correlation coefficients of the values {numbers[0]} to {numbers[-1]}"
    return Table(title, head, rows).html("numbers")


def _profile(certificate: Certificate) -> str:
    r, g, covariance = certificate.profile
    expanded = COVERAGE_FACTOR * np.sqrt(np.diag(covariance))
    rows = []
    for radius, value, u in zip(r / MM, g / PER_MM2, expanded / PER_MM2, strict=True):
        rows.append((f"{radius:.4g}", format_measured(value, u)))
    return Table("", ("r in mm", "G(r) ± U in 1/mm² (k = 2)"), rows).html("numbers")


def _budget(certificate: Certificate) -> str:
    """Return shares of each source in percent of the values, those that matter, largest first."""
    columns = {}
    for i, value in enumerate(certificate.values, start=1):
        budget = certificate.apparatus.budget.get(value.quantity.name)
        if budget is not None and np.isfinite(value.value) and value.value:
            percent = 100 / abs(value.value)
            shares = {source: percent * u for source, u in budget.items()}
            columns[f"({i})"] = {**shares, _TOTAL: percent * total_of(budget)}
    rows = {}
    for column in columns.values():
        for source in column:
            rows[source] = [other.get(source, 0.0) for other in columns.values()]
    total = rows.pop(_TOTAL, [])
    if not rows:
        return "<p>The artifact states no budget by source.</p>"
    order = sorted(rows, key=lambda source: -max(map(abs, rows[source])))
    shown = [source for source in order if max(map(abs, rows[source])) >= _LEAST_SHARE]
    cells = [(source.replace("_", " "), *_two_decimals(rows[source])) for source in shown]
    cells.append((_TOTAL, *_two_decimals(total)))
    title = "Standard uncertainties u (k = 1) by source, in percent of the value"
    return Table(title, ("Source", *columns), cells).html("numbers")


def _two_decimals(numbers: Iterable[float]) -> list[str]:
    return [f"{number:.2f}" for number in numbers]


def _conformity(certificate: Certificate) -> str:
    if not certificate.conformity:
        return "<p>No statement of conformity was agreed.</p>"
    rows = []
    for item in certificate.conformity:
        quantity = item.certified.quantity
        w = item.guard_band
        limits = (item.lower, item.upper, item.lower + w, item.upper - w)
        numbers = [number / quantity.scale for number in (item.certified.value, *limits)]
        y, lower, upper, lowest, highest = _alike(numbers)
        name = f"{quantity.words} in {quantity.unit}" if quantity.unit else quantity.words
        row = [name, y, f"{lower} to {upper}", f"{lowest} to {highest}"]
        rows.append([*row, _percent(item.probability), item.statement])
    head = ("Quantity y", "y", "Tolerance", "Acceptance", "Conformance probability", "Statement")
    table = Table("", head, rows).html()
    return f"<p>Decision rule: {escape(certificate.decision)}</p>\n{table}"


def _percent(probability: float) -> str:
    if probability > 0.9999:
        return "above 99.99 %"
    return f"{100 * probability:.2f} %" if probability >= 1e-4 else "below 0.01 %"


def _alike(numbers: list[float]) -> list[str]:
    """Write numbers with one power of ten, that of the first."""
    power = int(np.floor(np.log10(abs(numbers[0])))) if numbers[0] else 0
    factor = f"×10{str(power).translate(SUPERSCRIPTS)}" if not -3 < power < 4 else ""
    scale = 10.0**power if factor else 1.0
    return [f"{n / scale:.5g}{factor}" if np.isfinite(n) else "no limit" for n in numbers]


def certificate_pdf(certificate: Certificate, page: str, xml: bytes) -> bytes:
    """Return the page as a tagged PDF/A-3 with the XML in it; nothing is fetched."""
    try:
        import weasyprint
    except (ImportError, OSError) as error:
        cure = 'Install the extra "certificate" (pip install ".[certificate]"), or write'
        raise MemscalError(
            f"WeasyPrint, which makes the PDF, cannot be used: {error}.",
            cure=f"{cure} .html and print it.",
        ) from error
    now = datetime.fromisoformat(timestamp())
    attachment = weasyprint.Attachment(
        string=xml,
        name=f"{certificate.number}.xml",
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
        made = document.write_pdf(
            pdf_variant="pdf/a-3a",
            pdf_identifier=base64.b16encode(digest[:16]),
            attachments=[attachment],
        )
    return bytes(made)
