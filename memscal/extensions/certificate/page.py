"""Pages of a certificate: HTML, and a tagged PDF/A-3 of the same contents with the XML in it."""

import json
from collections.abc import Sequence
from datetime import datetime
from html import escape
from pathlib import Path
from string import Template
from typing import NamedTuple

from memscal.errors import MemscalError
from memscal.extensions.certificate.certificate import Certificate
from memscal.extensions.certificate.content import Item, Part, fields_of, filled, parts_of
from memscal.figures.report import Picture, html_figures
from memscal.figures.style import render_figure
from memscal.model.arrays import Values
from memscal.model.provenance import timestamp
from memscal.summaries.table import Table

_HTML = Path(__file__).with_name("certificate.html")
_TYPST = Path(__file__).with_name("certificate.typ")


class Page(NamedTuple):
    """Contents of a page: short texts by name, what must be said first, and sections."""

    texts: dict[str, str]
    boxes: Sequence[str]
    parts: Sequence[Part]


def page_of(certificate: Certificate) -> Page:
    """Return the contents of the page of a certificate, in its language."""
    fields = fields_of(certificate)
    stated = certificate.texts
    texts = {name: filled(text, fields) for name, text in stated["page"].items()}
    boxes = [filled(text, fields) for text in stated["boxes"]]
    return Page(texts, [box for box in boxes if box], parts_of(certificate, fields))


def certificate_page(page: Page) -> str:
    """Return a certificate as a self-contained HTML page; what came from files is escaped."""
    texts = {name: escape(text) for name, text in page.texts.items()}
    for name, text in page.texts.items():
        texts[f"css_{name}"] = "".join(map(_css, text))
    texts["boxes"] = "\n".join(f'<p class="box">{escape(box)}</p>' for box in page.boxes)
    sections = []
    for part in page.parts:
        items = "\n".join(_html(name, item) for name, item in part.items)
        sections.append(f"<section>\n<h2>{escape(part.heading)}</h2>\n{items}\n</section>")
    texts["parts"] = "\n".join(sections)
    return Template(_HTML.read_text("utf-8")).substitute(texts, created=timestamp())


def _css(character: str) -> str:
    """Return a character as a string of a style sheet holds it, whatever it is."""
    plain = character.isascii() and (character.isalnum() or character in " ,.-")
    return character if plain else f"\\{ord(character):x} "


def _html(name: str, item: Item) -> str:
    if isinstance(item, Table):
        return item.html(name)
    return html_figures([item]) if isinstance(item, Picture) else f"<p>{escape(item)}</p>"


def certificate_pdf(page: Page, xml: bytes) -> bytes:
    """Return the page as a tagged PDF/A-3 with the XML in it; nothing is fetched."""
    import matplotlib as mpl

    try:
        import typst
    except ImportError as error:
        cure = 'Install the extra "certificate" (pip install ".[certificate]"), or write'
        raise MemscalError(
            f"Typst, which makes the PDF, cannot be used: {error}.",
            cure=f"{cure} .html and print it.",
        ) from error
    parts = []
    for part in page.parts:
        items = [_plain(name, item) for name, item in part.items]
        parts.append({"heading": part.heading, "items": items})
    contents = {"texts": page.texts, "boxes": page.boxes, "parts": parts}
    made: bytes = typst.compile(
        _TYPST,
        format="pdf",
        pdf_standards=["a-3a", "ua-1"],
        sys_inputs={"contents": json.dumps(contents), "xml": xml.decode()},
        font_paths=[Path(mpl.get_data_path(), "fonts", "ttf")],
        ignore_system_fonts=True,
        timestamp=int(datetime.fromisoformat(timestamp()).timestamp()),
    )
    return made


def _plain(name: str, item: Item) -> Values:
    """Return a text, a table or a figure as JSON holds it."""
    if isinstance(item, Table):
        return {"name": name, "title": item.title, "head": [*item.head], "rows": [*item.rows]}
    if isinstance(item, Picture):
        drawn = render_figure(item.draw(), "svg", dpi=72).decode()
        return {"svg": drawn, "alt": item.alt, "caption": item.caption}
    return {"text": item}
