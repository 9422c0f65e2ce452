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
