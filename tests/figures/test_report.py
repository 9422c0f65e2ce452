"""The HTML report: parsed by another program, self-contained, and safe with hostile names."""

from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from memscal import StressSensor
from memscal.figures import report, style

_VOID = {"meta", "img", "br", "link", "hr"}
_HOSTILE = "<script>alert('x')</script>\"&$title ${body} --><img src=x onerror=1>"


class Page(HTMLParser):
    """What a reader of the page finds: elements with their attributes, text, balance."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.elements = []
        self.open = []
        self.words = []
        self.rows = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data
        if self.open and self.open[-1] != "style":
            self.words.append(data)

    def find(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(name="page", scope="module")
def page_fixture(make_apparatus):
    """The page of a calibration whose every text would do harm."""
    sensor = StressSensor(name=_HOSTILE, model=_HOSTILE, channel=_HOSTILE)
    data = make_apparatus(sensor=sensor, meaning=_HOSTILE, failed=2, message=_HOSTILE)
    object.__setattr__(data.process, "configuration", {_HOSTILE: _HOSTILE})
    budget = {"conversion_constant": {"noise": 9e-11, "load": 6e-11, "film thickness": 7e-11}}
    return Page(replace(data, budget=budget).report())


def test_nothing_is_fetched_and_nothing_is_run(page):
    assert not page.find("script") + page.find("link") + page.find("iframe") + page.find("a")
    for _, attributes in page.elements:
        assert not any(name.startswith("on") for name in attributes)
        assert (attributes.get("src") or "data:").startswith("data:")
    policy = [each for each in page.find("meta") if "http-equiv" in each]
    assert policy[0]["http-equiv"] == "Content-Security-Policy"


def test_the_budget_adds_up_in_squares(page):
    start = next(i for i, row in enumerate(page.rows) if row[0] == "source")
    rows = {row[0]: row[1:] for row in page.rows[start : start + 5]}
    shares = [int(rows[name][0].split("(")[1].removesuffix("%)")) for name in ("noise", "load")]
    assert shares == [49, 22]  # 9, 6 and 7 squared are 81, 36 and 49 of 166
    assert float(rows["root sum of squares"][0]) == pytest.approx(1.3e-7)


def test_hostile_strings_are_text_and_nothing_else(page):
    assert page.open == []
    assert not page.find("script")
    assert len(page.find("img")) == 1
    assert page.words.count(_HOSTILE) >= 4
    assert any(row[:2] == [_HOSTILE, _HOSTILE] for row in page.rows)


def test_a_calibration_without_checks_does_not_claim_that_they_passed(make_apparatus, monkeypatch):
    monkeypatch.setattr(report, "html_figures", lambda _: "")
    text = replace(make_apparatus(), checks=()).report()
    assert "checks passed" not in text


def test_figures_too_large_for_a_page_become_coarser_images(monkeypatch):
    monkeypatch.setattr(report, "_MOST_IMAGE_BYTES", 150_000)
    places = np.random.default_rng(1).normal(size=(2, 5000))

    def draw(points):
        with style.panels_of(3.0) as (figure, panels):
            panels.flat[0].plot(*places[:, :points], ".")
        return figure

    pictures = [report.Picture(lambda n=n: draw(n), "a", "b") for n in (5000, 20)]
    large, small = (image["src"] for image in Page(report.html_figures(pictures)).find("img"))
    assert large.startswith("data:image/png;base64")
    assert small.startswith("data:image/svg+xml;base64")
    assert len(large) + len(small) < 150_000
