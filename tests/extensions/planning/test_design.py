"""Expected uncertainties of a plan: laws that they follow, and limits in which they are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import cramer_rao
from helpers.scans import EXACT_FILM, EXACT_ROD, estimated, simulated

import memscal
from memscal import Plan
from memscal.deconvolution.division import create_regulariser
from memscal.errors import FitError, InputError
from memscal.estimation.band import find_band
from memscal.estimation.smoothing import smooth_profile
from memscal.extensions.planning.design import expected_calibration, varied_designs
from memscal.extensions.simulation.rod_scan import PAPER_FILM

EXACT = {"film": EXACT_FILM, "rod": EXACT_ROD, "load_uncertainty": None}


@pytest.fixture(scope="module")
def paper():
    return memscal.design()


def test_sigma_has_the_bound_of_cramer_and_rao_by_finite_differences():
    # About the middle of an even scan a drift, which is odd, tells nothing of the width.
    bound = cramer_rao(0.004, centre=(0.0, 0.0))["gaussian_sigma"]
    found = memscal.design(**EXACT, noise=0.004).parameters.uncertainty("gaussian_sigma")
    assert found == pytest.approx(bound, rel=1e-3)


def test_twice_the_load_or_four_repeats_halve_what_a_voltage_of_noise_makes_of_sigma():
    changes = [{}, {"load": 2.0}, {"repeats": 4}]
    plans = [memscal.design(**EXACT, noise_voltage=5e-5, **change) for change in changes]
    once, heavy, often = (plan.relative_uncertainty("gaussian_sigma") for plan in plans)
    assert heavy == pytest.approx(often, rel=1e-6)
    # The curvature that a baseline may have does not fall with the noise.
    assert once / 2 < heavy < 1.03 * once / 2


def test_a_voltage_and_a_share_of_noise_are_the_same_thing(paper):
    again = memscal.design(noise_voltage=paper.plan.point_noise)
    np.testing.assert_allclose(again.parameters.covariance, paper.parameters.covariance)


def test_the_loads_uncertainty_is_as_much_of_a():
    # At finite strain the load changes the shape of the stress, too.
    film = replace(PAPER_FILM, law="linear")
    planned = memscal.design(load_uncertainty=0.03, film=film)
    part = planned.budget["conversion_constant"]["load"]
    assert part / planned.parameters["conversion_constant"] == pytest.approx(0.03, rel=1e-6)
    assert planned.largest_source("conversion_constant") == "load"


def test_without_uncertain_inputs_only_noise_and_the_priors_are_left():
    budget = memscal.design(**EXACT).budget["gaussian_sigma"]
    # The posterior mean of a Gaussian's voltages departs from them by far less than their noise.
    assert 0 < budget.pop("misfit") < 1e-2 * budget["noise"]
    small = 1e-9 * budget["noise"]
    assert 0 < budget.pop("baseline_curvature") < budget["noise"]
    assert all(part < small for source, part in budget.items() if source != "noise")


def test_the_expected_noise_is_the_one_that_was_planned():
    solution, _ = expected_calibration(Plan(repeats=3), create_regulariser("evidence"))
    assert solution.estimate.weighed.noise == pytest.approx(1.0, abs=0.02)


def test_the_resolved_band_is_the_mean_over_draws_of_the_noise():
    expected, _ = expected_calibration(
        Plan(film=EXACT_FILM, rod=EXACT_ROD, load_uncertainty=None), create_regulariser("evidence")
    )
    drawn = [estimated(simulated(seed=seed)) for seed in range(30)]
    bands = np.array([find_band(e, smooth_profile(e)).resolved for e in drawn])
    assert abs(expected.band.resolved / bands.mean() - 1) < 0.02 + 3.9 * bands.std() / (
        bands.mean() * np.sqrt(len(drawn))
    )


def test_a_disc_is_expected_as_a_disc():
    disc = memscal.SmoothedDisc(radius=0.9e-3, sigma=0.2e-3)
    planned = memscal.design(kernel=disc, repeats=100, noise=0.002)
    flat = planned.r < 1.5e-3
    truth = disc.radial(planned.r)
    gaussian = memscal.GaussianMixture((1.0,), (planned.parameters["gaussian_sigma"],))
    ours, theirs = (
        np.sum(planned.r[flat] * (g[flat] - truth[flat]) ** 2)
        for g in (planned.g, gaussian.radial(planned.r))
    )
    assert ours < 0.5 * theirs


def test_another_method_is_expected_to_hide_more_behind_its_window(paper):
    other = memscal.design(method="white-noise")
    assert other.method == "white-noise"
    assert other.budget["fwhm"]["window"] > 0
    assert paper.budget["fwhm"]["window"] == 0.0
    with pytest.raises(InputError, match="no parameter colour"):
        paper.relative_uncertainty("colour")


def test_plans_are_varied_one_number_at_a_time(paper):
    steps = [0.2e-3, 0.5e-3, 4e-3]
    designs = varied_designs(paper, "step", steps)
    # Of the last, five positions, nothing can be determined.
    assert [each.plan.step for each in designs] == steps[:2]
    fine, coarse = (each.relative_uncertainty("gaussian_sigma") for each in designs)
    assert fine < coarse


@pytest.mark.parametrize(("want", "vary"), [
    ({"A": 0.016}, "step"), ({"A": 0.02}, "half_range"),
    ({"resolved": 3.8e3}, "repeats"), ({"A": 0.018, "sigma": 0.028}, "repeats"),
])  # fmt: skip
def test_what_is_found_reaches_the_target_and_one_less_does_not(want, vary):
    plan = {"noise": 0.01, "rod_friction": math.inf}
    found = memscal.design(**plan, want=want, vary=vary)
    less = {
        "step": {"step": 2 * found.plan.half_range / (found.plan.positions - 2)},
        "repeats": {"repeats": found.plan.repeats - 1},
        "half_range": {"half_range": found.plan.half_range - found.plan.step / 2},
    }[vary]
    before = memscal.design(**plan, **less)
    assert reaches(found, want)
    assert not reaches(before, want)


def reaches(planned, want):
    names = {"A": "conversion_constant", "sigma": "gaussian_sigma", "fwhm": "fwhm"}
    resolved = planned.resolved_wavenumber >= want.get("resolved", 0.0)
    limits = {names[name]: value for name, value in want.items() if name != "resolved"}
    return resolved and all(planned.relative_uncertainty(n) <= limits[n] for n in limits)


@pytest.mark.parametrize(("want", "vary", "told"), [
    ({"sigma": 0.01}, "repeats", r"the best is .* of sigma of 2\.35.*\n.*thickness"),
    ({"A": 0.005}, "step", r"\nload alone contributes 1\.07 %"),
    ({"resolved": 7e3}, "repeats", "passes little"),
    ({"resolved": 20e3}, "step", "best is a resolved wavenumber"),
    ({"resolved": 4e3, "step": 1e-3}, "repeats", r"step of 1 mm samples no more than 3\.142"),
])  # fmt: skip
def test_a_target_out_of_reach_names_the_best_and_what_stands_in_the_way(want, vary, told):
    step = want.pop("step", 0.25e-3)
    with pytest.raises(FitError, match=told):
        memscal.design(step=step, rod_friction=math.inf, want=want, vary=vary)


@pytest.mark.parametrize(("given", "told"), [
    ({"step": float("nan")}, "step"), ({"half_range": -1e-3}, "half range"),
    ({"load": 0.0}, "load"),
    ({"conversion_constant": -1e-7}, "conversion constant"), ({"load_uncertainty": -0.01}, "load"),
    ({"repeats": 1.5}, "repeated 1.5 times"), ({"noise": 0.0}, "noise"),
    ({"noise_voltage": 0.0}, "noise"),
    ({"half_range": 2e-3, "centre": 3e-3}, "2 mm to either side"), ({"step": 1e-6}, "positions"),
    ({"half_range": 8.0}, "positions"),
    ({"kernel": memscal.GaussianMixture(sigmas=(0.561e-6,))}, "a point to a film of 2 mm"),
])  # fmt: skip
def test_a_plan_that_makes_no_scan_is_refused(given, told):
    with pytest.raises(InputError, match=told):
        Plan(**given)


def test_too_few_positions_or_too_short_a_range_determine_nothing():
    with pytest.raises(FitError, match="5 measured positions; at least 6"):
        memscal.design(step=2e-3, half_range=4e-3)
    with pytest.raises(FitError, match="not distinct from zero"):
        memscal.design(half_range=0.8e-3, step=0.1e-3, noise=0.01)


@pytest.mark.parametrize(
    ("step", "half_range", "count"), [(0.25e-3, 8e-3, 65), (0.1e-3, 0.7e-3, 15), (0.3e-3, 8e-3, 54)]
)
def test_positions_are_whole_steps_within_the_range(step, half_range, count):
    scan = Plan(step=step, half_range=half_range).scan()
    assert scan.x.size == count
    np.testing.assert_allclose(np.diff(scan.x), step)
    assert scan.x[-1] <= half_range * (1 + 1e-6)
