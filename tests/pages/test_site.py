"""The built documentation in a browser: whole, silent, and accessible.

``nox --session pages`` builds the site; its folder is ``MEMSCAL_SITE``.
"""

import os
import re
import shlex
from html import unescape
from pathlib import Path

import pytest

DARK = ["docs/index", "docs/quality", "docs/method", "docs/commands", "docs/api/memscal.calibrate"]
#: Of the pages of public names, which are made alike, these are read.
NAMES = {f"docs/api/memscal.{name}" for name in ("calibrate", "Calibration", "FieldGrid")}


@pytest.fixture(scope="module")
def site():
    return Path(os.environ["MEMSCAL_SITE"])


def faults(browser, path, scheme, axe):
    """Open a page; return what it loads from outside, what axe finds, and where it is too wide."""
    page = browser.new_page(viewport={"width": 1300, "height": 900}, color_scheme=scheme)
    heard = []
    page.on("request", lambda request: heard.append(request.url[:200]))
    page.on("requestfailed", lambda request: heard.append(f"failed: {request.url}"))
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.goto(path.as_uri())
    page.evaluate(axe)
    report = page.evaluate("axe.run({preload: false, resultTypes: ['violations']})")
    found = [text for text in heard if not text.startswith(("file:", "data:"))]
    for rule in report["violations"]:
        found += [f"{rule['id']}: {node['html'][:200]}" for node in rule["nodes"]]
    for width in (1300, 380):
        page.set_viewport_size({"width": width, "height": 900})
        if (needed := page.evaluate("document.documentElement.scrollWidth")) > width:
            found.append(f"{needed} pixels wide in a window of {width}")
    page.close()
    return found


def test_pages_are_accessible_load_nothing_from_outside_and_fit_their_window(site, browser, axe):
    pages = {path.relative_to(site).with_suffix("").as_posix() for path in site.rglob("*.html")}
    made = {page for page in pages if page.startswith("docs/api/")}
    written = {page for page in pages - made - {"index"} if not page.startswith("_static/")}
    assert len(written) > 40
    assert made > NAMES
    tried = [(page, "light") for page in sorted(written | NAMES)] + [
        (page, "dark") for page in DARK
    ]
    found = {each: faults(browser, site / f"{each[0]}.html", each[1], axe) for each in tried}
    assert {each: wrong for each, wrong in found.items() if wrong} == {}


def test_the_top_leads_to_the_start_page_and_the_search_finds_a_check(site, browser):
    page = browser.new_page()
    page.goto((site / "index.html").as_uri())
    page.wait_for_url("**/docs/index.html")
    page.goto((site / "search.html").as_uri() + "?q=held_out_repeat")
    page.wait_for_selector("#search-results a[href*='quality']")


def test_commands_are_shown_as_they_are_typed(site):
    typed = []
    for path in site.rglob("*.html"):
        page = path.read_text(encoding="utf-8")
        for block in re.findall(r"<pre>(.*?)</pre>", page, re.DOTALL):
            text = unescape(re.sub("<[^>]+>", "", block)).replace("\\\n", "")
            typed += re.findall(r"^(?:memscal|pip|python3) .*", text, re.MULTILINE)
    assert len(typed) > 100
    assert [line for line in typed if re.search("[\N{EN DASH}\N{EM DASH}‘’“”]", line)] == []
    assert all(shlex.split(line, comments=True) for line in typed)
    for path in site.rglob("*.html"):
        text = unescape(re.sub("<[^>]+>", "", path.read_text(encoding="utf-8")))
        assert re.findall("(?<![\\w])[\N{EN DASH}\N{EM DASH}][a-z]", text) == [], path
    commands = (site / "docs" / "commands.html").read_text(encoding="utf-8")
    assert 'class="pre">--young-modulus-uncertainty<' in commands
    schemas = re.findall(r'href="\.\./(schemas/\w+\.json)"', commands)
    assert len(schemas) > 10
    assert all((site / schema).is_file() for schema in schemas)
    assert "\n    --load 1 --radius 0.25" in unescape(re.sub("<[^>]+>", "", commands))
