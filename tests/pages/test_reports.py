"""Every report and a certificate in a browser: alone, silent, accessible, and whole on paper."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.folders import SHIPPED
from helpers.pages import PAPER, cut, violations
from helpers.scans import known_apparatus, pressed, simulate, sphere_scan

import memscal
from memscal.cli import main

KINDS = ("calibrate", "apply", "compare", "restore", "batch")
#: A name that has no place to break, and text that a page must not take for its own.
LONG = "a_name_without_a_place_to_break_it_" * 4 + "<b>&amp;"


@pytest.fixture(scope="session")
def reports(tmp_path_factory):
    """The report of each command, those of batch and calibrate with failures; a certificate."""
    folder = tmp_path_factory.mktemp("reports")
    pages = {kind: folder / f"{kind}.html" for kind in (*KINDS, "certificate")}
    files = {name: str(folder / f"{name}.h5") for name in ("artifact", "stress", "known", "one")}
    scans = [str(SHIPPED / "sphere_experiment" / f"sphere_{k}.h5") for k in ("dry", "lubricated")]
    memscal.write_scan(sphere_scan(pressed(), seed=5), files["one"])
    known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.01).save(files["known"])
    sensor = memscal.StressSensor(name=LONG, model="W7", serial_number="7")
    (folder / "scans").mkdir()
    for i, drift in enumerate((0.0, 0.0, 0.3)):
        scan = simulate(seed=i, points=33, drift=drift)
        place = folder / "scans" / f"{i}{LONG[:120]}.h5"
        memscal.write_scan(replace(scan, sensor=sensor), place)
    drifting = str(place)
    (folder / "scans" / "nonsense.h5").write_text("nonsense")
    friction = ("--macroscopic", "1.6", "--no-cache", "--friction", "0.2")
    runs = {
        "apply": ["apply", files["artifact"], *scans, "-o", files["stress"]],
        "compare": ["compare", files["artifact"], files["stress"], *friction],
        "restore": ["restore", files["known"], files["one"]],
        "batch": ["batch", str(folder / "scans"), "-o", str(folder / "results")],
        "calibrate": ["calibrate", drifting, "-o", str(folder / "d.h5")],
    }
    rod = str(SHIPPED / "sphere_experiment" / "rod_scan.h5")
    assert main(["calibrate", rod, "-o", files["artifact"]]) == 0
    codes = {kind: main([*run, "--report", str(pages[kind])]) for kind, run in runs.items()}
    failing = ("batch", "calibrate")
    assert codes == {kind: int(kind in failing) for kind in runs}
    certify = ["certificate", files["artifact"], "--lab", str(SHIPPED / "lab.toml"), "--incomplete"]
    assert main([*certify, "-o", str(pages["certificate"])]) == 0
    return pages


@pytest.mark.parametrize(("width", "scheme"), [(1100, "light"), (380, "dark")])
@pytest.mark.parametrize("kind", KINDS)
def test_axe_finds_no_violation(reports, opened, axe, kind, width, scheme):
    viewport = {"width": width, "height": 900}
    page = opened(reports[kind], viewport=viewport, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert violations(page, axe) == {}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_cut_on_a4(reports, opened, kind):
    assert reports[kind].stat().st_size < 1_000_000
    page = opened(reports[kind], viewport=PAPER, color_scheme="dark")
    assert cut(page) == []
    # Dark pages are white on paper.
    assert page.evaluate("getComputedStyle(document.body).color") == "rgb(26, 26, 26)"
    length = page.evaluate("document.documentElement.scrollHeight") / PAPER["height"]
    sheets = len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True)))
    assert length <= sheets <= 2 * length + 2


def test_a_certificate_is_accessible_and_prints_on_four_sheets(reports, opened, axe):
    page = opened(reports["certificate"], viewport={"width": 1100, "height": 900})
    assert violations(page, axe) == {}
    page.set_viewport_size(PAPER)
    assert cut(page) == []
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True))) == 4


def test_every_figure_is_drawn(reports, opened):
    sizes = "[...document.images].map(i => [i.naturalWidth, i.alt.length])"
    for path in reports.values():
        images = np.array(opened(path).evaluate(sizes))
        assert np.all(images > [300, 40])
