"""The film's law: counted where it is not stated, taken as known where it is."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import EXACT_FILM, LINEAR_FILM, simulated

import memscal
from memscal.errors import ConvergenceError, InputError
from memscal.mechanics import press_rod

LAWLESS = replace(EXACT_FILM, law="")


def message(calibration, kind):
    return next(m.text for m in calibration.apparatus.process.messages if m.kind == kind)


def check(calibration, name):
    return next(c for c in calibration.apparatus.checks if c.name == name)


@pytest.fixture(scope="module")
def deep():
    """The paper's load, under which the rod sinks by 29 % of the film; the law is not stated."""
    return replace(simulated(film=LAWLESS, seed=1), film=LAWLESS)


@pytest.mark.parametrize("method", ["white-noise", "bayesian"])
def test_the_form_of_a_law_that_is_not_stated_is_a_rectangle(deep, method):
    linear, rubber, counted = (
        memscal.calibrate(deep, method=method, film_law=law).apparatus
        for law in ("linear", "neo-hookean", None)
    )
    for name in ("conversion_constant", "gaussian_sigma", "gaussian_sigma_deconvolved"):
        assert counted.parameters[name] == rubber.parameters[name]
        share = counted.budget[name]["model_form"]
        half_width = abs(rubber.parameters[name] - linear.parameters[name])
        assert share == pytest.approx(half_width / math.sqrt(3), rel=1e-6)
        square = rubber.parameters.uncertainty(name) ** 2 + share**2
        assert counted.parameters.uncertainty(name) == pytest.approx(math.sqrt(square))
    # A G(r), too: its band holds the other law's G within the root of three.
    r = np.linspace(0.0, 1.5e-3, 16)
    apart = np.abs(rubber.radial(r) - linear.radial(r)) / math.sqrt(3)
    assert np.all(counted.radial_uncertainty(r) >= 0.99 * apart)
    assert "model_form" not in linear.budget["gaussian_sigma"]


def test_draws_scatter_by_the_form_of_the_law_as_the_budget_says(deep):
    drawn = memscal.monte_carlo(memscal.calibrate(deep), draws=30)
    width = next(found for found in drawn.comparisons if found.name == "gaussian_sigma")
    # Of that many draws the spread is known to its sampling error.
    assert width.ratio == pytest.approx(1.0, abs=0.1 + 4 * width.sampling_error / width.uncertainty)


def test_it_dominates_at_the_papers_load_and_hardly_counts_at_a_light_one(deep):
    usual = replace(LINEAR_FILM, law="")  # with the uncertainties of its thickness and others
    light = memscal.calibrate(replace(simulated(load=0.05, seed=1), film=usual))
    heavy = memscal.calibrate(replace(deep, film=usual))
    sigma = heavy.apparatus.parameters
    assert sigma.uncertainty("gaussian_sigma") / sigma["gaussian_sigma"] > 0.08
    lines = heavy.answer().splitlines()
    assert "A = " in lines[0]
    assert lines[-1].startswith("The film's law, which is not stated, dominates")
    assert light.summary().startswith("Use A =")
    u = light.apparatus.parameters.uncertainty("gaussian_sigma")
    without = math.sqrt(u**2 - light.apparatus.budget["gaussian_sigma"]["model_form"] ** 2)
    assert u / without == pytest.approx(1.0, abs=0.1)


def test_an_answer_says_once_where_its_uncertainty_counts_noise_alone(folder, run):
    bare = memscal.ElasticFilm(
        young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, law="neo-hookean"
    )
    scan = replace(simulated(load=0.05, seed=1), film=bare, load_uncertainty=None)
    scan = replace(scan, indenter=replace(scan.indenter, radius_uncertainty=None))
    words = "No uncertainty of film, rod and load is stated: ± counts noise alone."
    for stated, alone in ((scan, True), (replace(scan, load_uncertainty=0.001), False)):
        memscal.write_scan(stated, "scan.h5", overwrite=True)
        told = run("calibrate", "scan.h5", "--force").exits(0)
        assert " ".join((told.out + told.err).split()).count(words) == alone


@pytest.mark.parametrize("law", ["", "neo-hookean", "linear"])
def test_a_deep_rod_fails_only_under_a_film_that_is_stated_to_be_linear(deep, law):
    # No rubber slides that deep: where the linear film is stated, none is solved.
    friction = 0.0 if law == "linear" else None
    scan = replace(deep, film=replace(LAWLESS, law=law), rod_friction=friction)
    calibration = memscal.calibrate(scan)
    checks = {check.name: check for check in calibration.apparatus.checks}
    if law == "linear":
        indentation = checks["indentation"]
        law_size = next(a for a in calibration.assumptions if a.name == "film_law").sizes
        sizes = (law_size["conversion_constant"], law_size["gaussian_sigma"])
        assert indentation.value == pytest.approx(1 / min(sizes))
        assert not indentation.passed
    else:
        assert "indentation" not in checks
    noisy = memscal.calibrate(simulated(load=0.02, noise=0.02))
    assert check(noisy, "indentation").passed
    assert message(calibration, "film_law").startswith("The film's law is not") == (not law)


def test_a_film_that_no_law_but_the_linear_one_solves_is_linear(deep, monkeypatch):
    def unsolved(*_, **__):
        raise ConvergenceError("No equilibrium was found.")

    monkeypatch.setattr(press_rod, "_midway", unsolved)
    monkeypatch.setattr(press_rod, "largest_tabulated_load", lambda *_, **__: 0.0)
    # No other test has pressed this rod.
    scan = replace(deep, load=0.987)
    found = memscal.calibrate(scan)
    linear = memscal.calibrate(scan, film_law="linear")
    assert found.apparatus.conversion_constant == linear.apparatus.conversion_constant
    assert "model_form" not in found.apparatus.budget["gaussian_sigma"]
    assert "it is taken as linear" in message(found, "film_law")
    assert not check(found, "indentation").passed


def test_whether_the_film_sticks_is_counted_where_it_is_not_stated(deep):
    film = replace(LAWLESS, law="neo-hookean")
    light = replace(simulated(film=LAWLESS, load=0.3), film=film)
    sticks, slides, either = (
        memscal.calibrate(light, rod_friction=friction) for friction in (math.inf, 0.0, None)
    )
    ends = np.array([slides.apparatus.gaussian_sigma, sticks.apparatus.gaussian_sigma])
    share = either.apparatus.budget["gaussian_sigma"]["rod_friction"]
    assert share == pytest.approx(abs(np.diff(ends)[0]) / math.sqrt(12), rel=0.1)  # first order
    assert either.apparatus.gaussian_sigma == pytest.approx(ends.mean(), rel=1e-3)
    assert "rod_friction" not in sticks.apparatus.budget["gaussian_sigma"]
    # Beyond where a sliding film can be solved the difference grows with the depth.
    deeper = memscal.calibrate(replace(deep, film=film)).apparatus.budget["gaussian_sigma"]
    assert deeper["rod_friction"] > share


def test_the_law_of_a_reference_counts_as_stated(deep):
    linear = memscal.indent(LINEAR_FILM, deep.indenter, load=1.0)
    calibration = memscal.calibrate(deep, reference=linear.profile())
    assert calibration.apparatus.film.law == "linear"
    assert "model_form" not in calibration.apparatus.budget["gaussian_sigma"]
    assert not check(calibration, "indentation").passed
    with pytest.raises(InputError, match=r"law \(neo-hookean\) and a reference"):
        memscal.calibrate(deep, reference=linear, film_law="neo-hookean")
