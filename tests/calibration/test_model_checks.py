"""The checks of the model: which there are, what they say, and that good scans pass."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import RING, TAILS, simulated

import memscal

DISC = memscal.SmoothedDisc(0.8e-3, 0.3e-3)


def checks(scan, **options):
    options = {"method": "bayesian"} | options
    return {check.name: check for check in memscal.calibrate(scan, **options).apparatus.checks}


@pytest.mark.parametrize(("options", "there", "absent"), [
    ({}, {"chi_square"}, {"held_out_repeat", "held_out_load", "held_out_scan"}),
    ({"state_noise": False}, {"residual_steps"}, {"chi_square", "noise_as_stated"}),
    ({"state_noise": False, "repeats": 3}, {"chi_square", "held_out_repeat"}, set()),
    ({"load": [0.5, 1.0, 1.5]}, {"held_out_load"}, {"held_out_repeat"}),
    ({"load": [0.5, 1.0], "repeats": 2}, {"held_out_load", "held_out_repeat"}, set()),
])  # fmt: skip
def test_a_check_is_run_where_the_scan_has_something_to_check(options, there, absent):
    found = set(checks(simulated(points=33, **options)))
    assert there <= found
    assert not absent & found


def test_a_check_passes_just_when_its_p_value_is_above_a_thousandth():
    scan = simulated(load=[0.5, 1.0, 1.5], points=33)
    rng = np.random.default_rng()
    for size in (0.0, 0.3, 1.0, 3.0):
        noise = rng.normal(0.0, size, scan.u_zz.shape) * scan.u_zz_errors
        for check in checks(replace(scan, u_zz=scan.u_zz + noise)).values():
            if check.p_value is not None:
                assert check.passed == (check.p_value > 1e-3), check


@pytest.mark.parametrize(
    ("kernel", "words"),
    [(TAILS, "tails"), (RING, "a core of its own"), (DISC, "an edge")],
)
def test_a_departure_from_a_gaussian_is_named(kernel, words):
    found = checks(simulated(kernel=kernel, noise=0.001, repeats=4))
    departure = found["gaussian_evidence"]
    assert not departure.passed
    assert re.search(f"most probable departure is ({words})", departure.meaning)
    assert found["chi_square"].passed
    assert not found["gaussian_misfit"].passed


def test_the_bayes_factor_favours_a_gaussian_that_is_one():
    values = [checks(simulated(seed=seed))["gaussian_evidence"].value for seed in range(12)]
    # A Bayes factor in favour of what is false exceeds ten at most once in ten.
    assert np.median(values) < 0
    assert np.mean(np.array(values) > np.log(10)) < 0.4


def test_a_constraint_that_the_scan_contradicts_is_found_and_one_that_it_meets_is_not():
    ring = simulated(noise=2e-4, repeats=4, kernel=RING)
    assert not checks(ring, options={"monotone": True})["constraint"].passed
    passed = [
        checks(simulated(noise=0.003, seed=seed, kernel=kernel), options={"monotone": True})[
            "constraint"
        ].passed
        for kernel in (memscal.GaussianMixture(), TAILS)
        for seed in range(5)
    ]
    assert all(passed)
