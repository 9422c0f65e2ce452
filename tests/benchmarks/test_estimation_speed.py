"""Speed of the estimate: replicates of one scan, beside one estimate after the other."""

from __future__ import annotations

import numpy as np
import pytest
from scans import estimated, simulated
from timing import show, turns

import memscal
from memscal.estimation.profile_estimate import estimate_profile
from memscal.estimation.replicates import ReplicateEstimator

pytestmark = pytest.mark.benchmark


def test_a_thousand_replicates_cost_a_few_estimates() -> None:
    estimate = estimated(simulated(noise=0.003, seed=4))
    draws = np.random.default_rng(0).normal(size=(1000, estimate.points.u.size))
    voltages = estimate.predicted + draws * estimate.noise

    ratio = turns(
        lambda: ReplicateEstimator(estimate).fit(voltages),
        lambda: estimate_profile(estimate.points, *estimate.model.references),
        rounds=7,
    )
    show("1000 replicates, over one estimate", ratio, 20)


def test_a_thousand_draws_of_noise_and_inputs_cost_less_than_a_hundred_calibrations() -> None:
    scan = memscal.simulate(noise=0.003, seed=4)
    calibration = memscal.calibrate(scan, method="evidence")
    ratio = turns(
        lambda: memscal.monte_carlo(calibration, draws=1000),
        lambda: memscal.calibrate(scan, method="evidence"),
        rounds=3,
    )
    show("1000 draws, over one calibration", ratio, 100)
