"""``memscal design``."""

from pathlib import Path

import pytest
from helpers.console import Run, names


def test_options_reach_the_plan(run: Run):
    film = ["--thickness", 1.5, "--thickness-uncertainty", 0.01, "--poisson-ratio", 0.48]
    told = run(
        "design", *film, "--radius", 0.2, "--load", 0.5, "--noise-voltage", 0.05,
        "--half-range", 6, "--sigma", 400, "--load-uncertainty", 0, "--json",
    ).json  # fmt: skip
    assert told["plan"]["noise"] == {"value": pytest.approx(0.05), "unit": "mV"}
    assert told["plan"]["load"]["value"] == 0.5
    assert told["expected"]["gaussian_sigma"]["value"] == pytest.approx(0.4, rel=1e-3)
    assert told["expected"]["conversion_constant"]["budget"]["load"] == 0


def test_a_wish_is_reached(run: Run):
    told = run("design", "--noise", 1, "--want", "sigma=2.8%", "--vary", "repeats", "--json").json
    assert told["wanted_si"] == {"sigma": 0.028}
    assert told["expected"]["gaussian_sigma"]["relative_uncertainty"] <= 0.028
    assert told["plan"]["repeats"] > 1


def test_a_resolved_wavenumber_is_wanted_in_rad_per_mm(run: Run):
    told = run("design", "--want", "resolved=3", "--vary", "step", "--json").json
    assert told["resolved_wavenumber"]["value"] >= 3
    assert told["plan"]["step"]["value"] > 0.25


def test_a_wish_out_of_reach_is_an_error_with_the_best(run: Run):
    failed = run("design", "--want", "sigma=1%", "--vary", "repeats")
    assert (failed.code, failed.out) == (3, "")
    assert "the best is" in failed.err
    assert "thickness" in failed.err


@pytest.mark.parametrize(("code", "arguments", "told"), [
    (2, ["--step", -1], "--step"), (2, ["--noise", 0], "--noise"),
    (2, ["--repeats", 0], "--repeats"), (2, ["--figure", "design.gif"], ".png"),
    (2, ["--want", "sigma=1%"], "--want and --vary go together"),
    (2, ["--vary", "step"], "--want and --vary go together"),
    (2, ["--want", "sigma", "--vary", "step"], "is no target"),
    (2, ["--want", "sigma=much%", "--vary", "step"], "is no target"),
    (2, ["--want", "sigma=0.01", "--vary", "step"], "write the %"),
    (2, ["--want", "resolved=4%", "--vary", "step"], "without %"),
    (2, ["--weight", 0.5, "--weight", 0.5], "--weight"), (3, ["--method", "magic"], "magic"),
    (3, ["--want", "colour=1%", "--vary", "step"], "no known target"),
    (3, ["--half-range", 2, "--centre", 3], "not passed over"), (3, ["--step", 4], "positions"),
    (3, ["--half-range", 0.8, "--step", 0.1, "--noise", 1], "not distinct from zero"),
    (3, ["--radius", 1.5], "rod's width is 3 mm"),
])  # fmt: skip
def test_wrong_use_and_a_plan_that_cannot_be_are_refused(run: Run, code, arguments, told):
    assert run("design", *arguments).exits(code, told).out == ""


def test_figures_are_written_and_not_overwritten(run: Run, folder: Path):
    assert run("design", "--figure", "d.svg", "--figure", "d.png").code == 0
    assert names(folder) == ["d.png", "d.svg"]
    before = (folder / "d.png").read_bytes()
    assert run("design", "--noise", 2, "--figure", "d.png").code == 4
    assert (folder / "d.png").read_bytes() == before
    assert run("design", "--noise", 2, "--figure", "d.png", "--force").code == 0
    assert (folder / "d.png").read_bytes() != before


@pytest.mark.parametrize(
    ("method", "words"), [("bayesian", "follows from the prior"), ("tikhonov", "window hides G")]
)
def test_what_stands_for_g_beyond_the_band_depends_on_the_method(run, method, words) -> None:
    assert words in run("design", "--method", method).err
