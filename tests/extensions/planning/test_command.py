"""``memscal design``."""

import pytest
from helpers.console import Run


def test_options_reach_the_plan(run: Run):
    film = ["--thickness", 1.5, "--thickness-uncertainty", 0.01, "--poisson-ratio", 0.48]
    told = run(
        "design",
        *film,
        "--radius",
        0.2,
        "--load",
        0.5,
        "--noise-voltage",
        0.05,
        "--half-range",
        6,
        "--sigma",
        400,
        "--load-uncertainty",
        0,
        "--json",
    ).json
    assert told["plan"]["noise"] == {"value": pytest.approx(0.05), "unit": "mV"}
    assert told["plan"]["load"]["value"] == 0.5
    assert told["expected"]["gaussian_sigma"]["value"] == pytest.approx(0.4, rel=1e-3)
    assert told["expected"]["conversion_constant"]["budget"]["load"] == 0


def test_a_resolved_wavenumber_is_wanted_in_rad_per_mm(run: Run):
    told = run("design", "--want", "resolved=3", "--vary", "step", "--json").json
    assert told["resolved_wavenumber"]["value"] >= 3
    assert told["plan"]["step"]["value"] > 0.25


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
    (3, ["--radius", 1.5], "rod's width is 3 mm"),
    (3, ["--want", "sigma=1%", "--vary", "repeats"], "the best is"),
])  # fmt: skip
def test_wrong_use_and_a_plan_that_cannot_be_are_refused(run: Run, code, arguments, told):
    assert run("design", *arguments).exits(code, told).out == ""


@pytest.mark.parametrize(
    ("method", "words"), [("bayesian", "follows from the prior"), ("tikhonov", "window hides G")]
)
def test_what_stands_for_g_beyond_the_band_depends_on_the_method(run, method, words) -> None:
    assert words in run("design", "--method", method).err
