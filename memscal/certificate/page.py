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

from memscal.certificate.certificate import COVERAGE_FACTOR, Certificate
from memscal.errors import MemscalError
from memscal.figures.calibration import radial_figure
from memscal.figures.report import html_figure
from memscal.model.checks import state_of_checks
from memscal.model.notation import SUPERSCRIPTS, format_measured
from memscal.model.provenance import timestamp
from memscal.model.quantities import MM, PER_MM, PER_MM2
from memscal.summaries.table import Table

_PAGE = Path(__file__).with_name("certificate.html")
_FONTS = "'Liberation Sans', Arial, Helvetica, 'DejaVu Sans', sans-serif"
_SYNTHETIC = "SYNTHETIC DATA: NOTHING WAS MEASURED"
_ZERO_CELSIUS = 273.15


def certificate_page(of: Certificate) -> str:
    """Return a certificate as a self-contained HTML page; what came from files is escaped."""
    first = [_head(of), _facts(of), _accreditation(of), _method(of), _set_up(of), _signature(of)]
    second = [_values(of), _profile(of), _budget(of), _conformity(of)]
    end = f'<p class="end">— End of certificate {escape(of.number)} —</p>'
    body = f'<main>\n{_joined(first)}\n<div class="results">\n{_joined([*second, end])}\n</div>\n'
    return Template(_PAGE.read_text(encoding="utf-8")).substitute(
        number=escape(of.number),
        author=escape(of.sections["laboratory"]["name"]),
        created=timestamp(),
        mark=_SYNTHETIC if of.synthetic else "",
        fonts=_FONTS,
        laboratory="".join(map(_css, of.sections["laboratory"]["name"])),
        body=body + "</main>",
    )


def _css(character: str) -> str:
    """Return a character as a string of a style sheet holds it, whatever it is."""
    plain = character.isascii() and (character.isalnum() or character in " ,.-")
    return character if plain else f"\\{ord(character):x} "


def _joined(blocks: Iterable[str]) -> str:
    return "\n".join(block for block in blocks if block)


def _section(heading: str, *blocks: str) -> str:
    return f"<section>\n<h2>{escape(heading)}</h2>\n{_joined(blocks)}\n</section>"


def _text(text: str, kind: str = "") -> str:
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def _table(kind: str, title: str, head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    drawn = Table(title, tuple(head), [tuple(row) for row in rows]).html()
    drawn = drawn.replace("<caption></caption>\n", "")
    return drawn.replace("<table>", f'<table class="{kind}">', 1)


def _address(of: Mapping[str, Any]) -> str:
    place = " ".join(of[key] for key in ("post_code", "city") if key in of)
    lines = (of.get("street", ""), f"{place}, {of['country']}", of.get("email"), of.get("phone"))
    return " · ".join(line for line in lines if line)


def _head(of: Certificate) -> str:
    laboratory = of.sections["laboratory"]
    name = f'<p class="name">{escape(laboratory["name"])}</p>'
    title = f'<h1>Calibration certificate</h1>\n<p class="number">No. {escape(of.number)}</p>'
    form = f"{_SYNTHETIC}. This shows the form of a certificate and certifies nothing."
    warnings = [form] if of.synthetic else []
    if failed := [c.name.replace("_", " ") for c in of.apparatus.checks if not c.passed]:
        warnings.append(f"Quality checks of the calibration that failed: {', '.join(failed)}.")
    notes = _joined(_text(text, "note failed") for text in warnings)
    return f"<header>\n{name}\n{_text(_address(laboratory))}\n</header>\n{title}\n{notes}"


def _facts(of: Certificate) -> str:
    sensor, customer, conditions = (of.sections[k] for k in ("sensor", "customer", "conditions"))
    begin, end = (conditions.get(key, "")[:10] for key in ("start_time", "end_time"))
    rows = [
        ("Object", f"MEMS stress sensor under an elastic film: {sensor['name']}"),
        ("Manufacturer", sensor["manufacturer"]),
        ("Model, channel", ", ".join(sensor[k] for k in ("model", "channel") if sensor.get(k))),
        ("Serial number", sensor["serial"]),
        ("Customer", f"{customer['name']}, {_address(customer)}"),
        ("Date of measurement", begin if end in ("", begin) else f"{begin} to {end}"),
        ("Date of issue", of.issued),
    ]
    if operator := of.sections["person"].get("operator"):
        rows.append(("Measured by", operator))
    return _table("facts", "", ("", ""), rows)


def _accreditation(of: Certificate) -> str:
    stated = of.sections["laboratory"].get("accreditation")
    text = (
        f"Accreditation, as the laboratory states it: {stated}."
        if stated
        else "This is no accredited certificate: the laboratory states no accreditation for this "
        "calibration."
    )
    return _text(
        f"{text} The values are traceable to the SI through the certificates of the equipment "
        "listed below. They hold for the object as it was received, on the date of measurement.",
        "note",
    )


def _method(of: Certificate) -> str:
    data = of.apparatus
    rod, film, reading = data.indenter, data.film, data.reading
    loads = data.load if data.reconvolution.load is None else data.reconvolution.load
    facts = [f"{data.reconvolution.x.size} readings ({reading.unit})"]
    if loads is not None:
        low, high = (f"{extreme(loads):.4g}" for extreme in (np.min, np.max))
        facts[0] += f" under a load of {low} N" if low == high else f", loads {low} to {high} N"
    if rod is not None:
        facts.append(f"a {rod.shape} of radius {_mm(rod.radius, rod.radius_uncertainty)}")
    if film is not None:
        modulus = _expanded(film.young_modulus / 1e6, film.young_modulus_uncertainty, "MPa", 1e6)
        ratio = _expanded(film.poisson_ratio, film.poisson_ratio_uncertainty, "")
        thick = _mm(film.thickness, film.thickness_uncertainty)
        facts.append(
            f"a film of thickness {thick}, Young's modulus {modulus}, Poisson's ratio {ratio}, law "
            f"{film.law or 'not stated'}"
        )
    method = data.process.configuration.get("method", "")
    equation = (
        "The reading U was recorded against the position of an indenter pressed on the film of the "
        "sensor. U = A (G ⊗ σ), with σ the stress at the base of the film and ⊗ the convolution in "
        "the plane, was solved for the conversion constant A and the apparatus function G of unit "
        "integral (Scheibert et al., EPL 2008, Eq. 1)."
    )
    program = f"Program: memscal {data.process.version}."
    setting = f"Method {method}, with {'; '.join(facts)} (± U, k = 2). {program}"
    uncertainties = (
        "Uncertainties were evaluated by JCGM 100:2008 (GUM) from noise, regularisation, load, "
        "indenter, film, and the form of the model. The expanded uncertainty is U = k u with "
        "k = 2; of a normal distribution this covers about 95 %."
    )
    texts = (equation, setting, uncertainties)
    return _section("Method of calibration", *map(_text, texts), _origin(of))


def _mm(value: float, uncertainty: float | None) -> str:
    return _expanded(value / MM, uncertainty, "mm", MM)


def _expanded(value: float, u: float | None, unit: str, scale: float = 1.0) -> str:
    """Return a value with U = k u; ``u`` is in SI units, ``scale`` of which are the unit."""
    return format_measured(value, None if u is None else COVERAGE_FACTOR * u / scale, unit)


def _set_up(of: Certificate) -> str:
    rows = [
        (item["name"], item["serial"], item["certificate"], item["date"]) for item in of.equipment
    ]
    head = ("Instrument", "Serial number", "Certificate", "Date of certificate")
    t, humidity = (of.sections["conditions"][key] for key in ("temperature", "humidity"))
    conditions = (
        f"Temperature {_expanded(t.value - _ZERO_CELSIUS, t.uncertainty, '°C')}; relative humidity "
        f"{_expanded(100 * humidity.value, humidity.uncertainty, '%', 0.01)} (± U, k = 2)."
    )
    return _joined(
        (
            _section("Measuring equipment", _table("", "", head, rows)),
            _section("Conditions of measurement", _text(conditions)),
        )
    )


def _signature(of: Certificate) -> str:
    person = of.sections["person"]
    who = f"<p>{escape(person['name'])}</p>\n<p>{escape(person['role'])}</p>"
    return (
        '<div class="sign">\n<div><div class="line"></div>\n<p>Date and seal</p></div>\n'
        f'<div><div class="line"></div>\n<p>Authorised by</p>\n{who}</div>\n</div>\n'
        '<p class="small">This certificate may be passed on only in full. It needs the '
        "signature of the person who authorises it.</p>"
    )


def _values(of: Certificate) -> str:
    rows = []
    for i, (value, correlations) in enumerate(zip(of.values, of.correlation, strict=True)):
        quantity, scale = value.quantity, value.quantity.scale
        share = 100 * value.expanded / abs(value.value) if value.value else np.inf
        relative = f"{share:.2g} %" if share < 99 else "–"
        stated = format_measured(value.value / scale, value.expanded / scale, quantity.unit)
        words = f"({i + 1}) {quantity.words}" + (f", {quantity.symbol}" if quantity.symbol else "")
        cells = (
            f"{round(r, 2) + 0:.2f}" if j < i else "1" if j == i else ""
            for j, r in enumerate(correlations)
        )
        rows.append((words, stated, relative, *cells))
    numbers = [f"({i + 1})" for i in range(len(rows))]
    head = ("Quantity y", "y ± U (k = 2)", "U / y", *numbers)
    title = f"Right: correlation coefficients of the values {numbers[0]} to {numbers[-1]}"
    resolved = f"{of.apparatus.resolved_wavenumber / PER_MM:.3g} rad/mm"
    text = f"The scan determines G up to the wavenumber {resolved}; beyond, regularisation does."
    return _section("Results", _table("numbers", title, head, rows), _text(text))


def _profile(of: Certificate) -> str:
    profile = of.profile
    rows = [
        (f"{r / MM:.4g}", format_measured(g / PER_MM2, u / PER_MM2))
        for r, g, u in zip(profile.r, profile.g, profile.expanded, strict=True)
    ]
    table = _table("numbers", "", ("r in mm", "G(r) ± U in 1/mm² (k = 2)"), rows)
    alt = "G(r) with its expanded uncertainty as a band; the numbers are in the table beside it."
    figure = html_figure(radial_figure(of.apparatus), alt, "G(r); band ± U (k = 2).")
    return _section(
        "Apparatus function", f'<div class="pair">\n<div>{table}</div>\n<div>{figure}</div>\n</div>'
    )


def _budget(of: Certificate) -> str:
    budget = of.apparatus.budget
    columns = [value for value in of.values if value.quantity.name in budget and value.value]
    sources = dict.fromkeys(s for value in columns for s in budget[value.quantity.name])
    shares = {
        source: [100 * budget[v.quantity.name].get(source, 0.0) / abs(v.value) for v in columns]
        for source in sources
    }
    largest = {source: max(row) for source, row in shares.items() if max(row) >= 0.005}
    rows = [
        (source.replace("_", " "), *(f"{share:.2f}" for share in shares[source]))
        for source in sorted(largest, key=lambda source: -largest[source])
    ]
    total = np.sqrt(np.sum(np.square([*shares.values()]), axis=0))
    if not columns:
        return ""
    rows.append(("root sum of squares", *(f"{share:.2f}" for share in total)))
    names = [f"({of.values.index(value) + 1})" for value in columns]
    title = "Standard uncertainties u (k = 1) by source, in percent of the value"
    return _section("Uncertainty budget", _table("numbers", title, ("Source", *names), rows))


def _conformity(of: Certificate) -> str:
    if not of.conformity:
        return _section("Conformity", _text("No statement of conformity was agreed."))
    rows = []
    for item in of.conformity:
        quantity, w = item.of.quantity, item.guard_band
        numbers = (item.lower, item.upper, item.lower + w, item.upper - w, item.of.value)
        *ends, y = _alike([number / quantity.scale for number in numbers])
        p = 100 * item.probability
        rows.append(
            (
                f"{quantity.words} in {quantity.unit}" if quantity.unit else quantity.words,
                y,
                f"{ends[0]} to {ends[1]}",
                f"{ends[2]} to {ends[3]}",
                "above 99.99 %" if p > 99.99 else "below 0.01 %" if p < 0.01 else f"{p:.2f} %",
                item.statement,
            )
        )
    head = ("Quantity y", "y", "Tolerance", "Acceptance", "Conformance probability", "Statement")
    return _section(
        "Statement of conformity",
        _text(f"Decision rule: {of.decision}"),
        _table("", "", head, rows),
    )


def _alike(numbers: Iterable[float]) -> list[str]:
    """Write numbers with one power of ten and five digits of the largest."""
    largest = max(abs(number) for number in numbers if np.isfinite(number))
    power = int(np.floor(np.log10(largest))) if largest else 0
    power = 0 if -2 <= power <= 4 else power
    places = max(4 - int(np.floor(np.log10(largest * 10.0**-power))), 0) if largest else 0
    factor = "×10" + str(power).translate(SUPERSCRIPTS) if power else ""
    return [
        f"{number * 10.0**-power:.{places}f}{factor}" if np.isfinite(number) else "no limit"
        for number in numbers
    ]


def _origin(of: Certificate) -> str:
    data, source = of.apparatus, of.apparatus.process.input_scan
    scan = f" Scan {source.file_name}, SHA-256 {source.sha256}." if source else ""
    checks = f"Quality checks of the calibration: {state_of_checks(data.checks)}."
    artifact = f"Artifact: content digest {data.content_digest}."
    return _text(f"{checks} {artifact}{scan}", "small digest")


def certificate_pdf(of: Certificate, page: str, xml: bytes) -> bytes:
    """Return the page as a tagged PDF/A-3 with the XML in it; nothing is fetched."""
    try:
        import weasyprint
        from weasyprint.urls import URLFetcher
    except (ImportError, OSError) as error:
        raise MemscalError(
            f"WeasyPrint, which makes the PDF, cannot be used: {error}.",
            cure='Install it with the extra "certificate": pip install "memscal[certificate]"; or '
            "write .html and print it.",
        ) from error
    digest = hashlib.sha256(page.encode() + xml).digest()
    now = datetime.fromisoformat(timestamp())
    attachment = weasyprint.Attachment(
        string=xml,
        name=f"{of.number}.xml",
        description="The same as a Digital Calibration Certificate",
        created=now,
        modified=now,
        relationship="Alternative",
    )
    fetcher = URLFetcher(allowed_protocols=("data",), allow_redirects=False)
    document = weasyprint.HTML(string=page, base_url=None, url_fetcher=fetcher)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # it leaves its colour profile open
        made: bytes = document.write_pdf(
            pdf_variant="pdf/a-3a",
            pdf_identifier=base64.b16encode(digest[:16]),
            attachments=[attachment],
        )
    return made
