"""The built documentation in a browser: whole, silent, and accessible.

``nox --session pages`` builds the site, whose folder is ``MEMSCAL_SITE``.
"""

import os
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.pages

#: Of the pages of public names, which are made alike, these are read.
NAMES = {"calibrate", "Calibration", "FieldGrid", "MemscalError"}
DARK = {"docs/index", "docs/quality", "docs/method", "docs/commands", "docs/api/memscal.calibrate"}


@pytest.fixture(scope="module")
def site() -> Path:
    return Path(os.environ["MEMSCAL_SITE"])


def pages_to_read(site: Path) -> list[str]:
    """Return the pages that people write, and some of those that are made of docstrings."""
    pages = {path.relative_to(site).with_suffix("").as_posix() for path in site.rglob("*.html")}
    made = {page for page in pages if page.startswith("docs/api/")}
    chosen = {f"docs/api/memscal.{name}" for name in NAMES}
    assert chosen <= made
    return sorted(page for page in pages - made - {"index"} | chosen if page[0] != "_")


def test_pages_are_accessible_load_nothing_from_outside_and_fit_their_window(
    site: Path, browser: Any, axe: str
) -> None:
    pages = pages_to_read(site)
    assert len(pages) > 40
    found: dict[str, list[str]] = {}
    for page, scheme in [*((p, "light") for p in pages), *((p, "dark") for p in sorted(DARK))]:
        opened = browser.new_page(viewport={"width": 1300, "height": 900}, color_scheme=scheme)
        heard: list[str] = []
        opened.on("request", lambda request, heard=heard: heard.append(request.url[:200]))
        opened.on("requestfailed", lambda request, heard=heard: heard.append(f"- {request.url}"))
        opened.on("pageerror", lambda error, heard=heard: heard.append(str(error)))
        opened.goto((site / f"{page}.html").as_uri())
        opened.evaluate(axe)
        report = opened.evaluate("axe.run({preload: false, resultTypes: ['violations']})")
        wrong = [text for text in heard if not text.startswith(("file:", "data:"))]
        for width in (1300, 380):
            opened.set_viewport_size({"width": width, "height": 900})
            if (needed := opened.evaluate("document.documentElement.scrollWidth")) > width:
                wrong.append(f"{needed} pixels wide in a window of {width}")
        for rule in report["violations"]:
            wrong += [f"{rule['id']}: {node['html'][:200]}" for node in rule["nodes"]]
        if wrong:
            found[f"{page} ({scheme})"] = wrong
        opened.close()
    assert found == {}


def test_the_top_of_the_site_leads_to_its_start_page(site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto((site / "index.html").as_uri())
    page.wait_for_url("**/docs/index.html")


def test_the_search_finds_a_check(site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto((site / "search.html").as_uri() + "?q=held_out_repeat")
    page.wait_for_selector("#search-results a")
    assert any("quality" in link for link in page.locator("#search-results a").evaluate_all(
        "links => links.map(link => link.href)"
    ))  # fmt: skip
