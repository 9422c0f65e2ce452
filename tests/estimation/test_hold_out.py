"""Predicting a repeat or a load from the others: the covariance is right, and faults are found."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import estimated, simulated, with_outlier
from scipy.stats import binom, chi2

from memscal.estimation.model_tests import hold_out, load_groups
from memscal.estimation.residuals import free_model


def test_the_fall_of_the_residual_sum_is_the_distance_in_the_predictive_covariance():
    estimate = estimated(simulated(repeats=2, points=33))
    model = free_model(estimate, clip_outliers=True)
    group = estimate.points.repeat
    found = hold_out(estimate, group)
    out = group == found.worst
    x = model.design
    z = model.data
    known = np.linalg.inv(x[~out].T @ x[~out])
    beta = known @ x[~out].T @ z[~out]
    covariance = np.eye(33) + x[out] @ known @ x[out].T
    # The held-out part's own centre, baseline and drift, by generalised least squares.
    own = x[out][:, 2:5]
    distance = z[out] - x[out] @ beta
    weight = np.linalg.inv(covariance)
    left = distance - (own @ np.linalg.solve(own.T @ weight @ own, own.T @ weight @ distance))
    assert found.value == pytest.approx(left @ weight @ left / 30, rel=1e-5)
    assert found.p_value == pytest.approx(min(2 * chi2.sf(30 * found.value, 30), 1.0), rel=1e-4)
    assert found.limit == pytest.approx(chi2.isf(5e-4, 30) / 30, rel=1e-6)


@pytest.mark.parametrize("options", [
    {"repeats": 3, "points": 33},
    {"repeats": 3, "points": 33, "state_noise": False},
    {"load": [0.5, 1.0, 1.5], "points": 33},
    {"repeats": 14, "points": 21},
])  # fmt: skip
def test_groups_of_good_scans_are_rejected_no_more_often_than_is_said(options):
    scans = 60 if FULL else 12
    level = 0.1
    p_values = []
    for seed in range(scans):
        estimate = estimated(simulated(seed=seed, **options))
        points = estimate.points
        group = load_groups(points.load) if "load" in options else points.repeat
        found = hold_out(estimate, group)
        assert (found.value > found.limit) == (found.p_value < 1e-3)
        p_values.append(found.p_value)
    assert np.sum(np.array(p_values) < level) <= binom.ppf(1 - 1e-6, scans, level)


@pytest.mark.parametrize("gain", [1.04, 0.92])
@pytest.mark.parametrize("stated", [True, False])
def test_a_repeat_of_another_gain_is_found_and_named(gain, stated):
    scan = simulated(repeats=4, noise=0.003, state_noise=stated)
    u = scan.u_zz.copy()
    u[2] *= gain
    estimate = estimated(replace(scan, u_zz=u))
    found = hold_out(estimate, estimate.points.repeat)
    assert found.worst == 2
    assert found.p_value < 1e-3


def test_a_repeat_may_have_its_own_baseline_and_centre():
    scan = simulated(repeats=3, noise=0.003)
    largest = scan.u_zz.max()
    u = scan.u_zz.copy()
    u[1] += 0.02 * largest * (1 + scan.x / scan.x.max())
    # A fortieth of a step to the side, to first order.
    u[1] -= 0.025 * (scan.x[1] - scan.x[0]) * np.gradient(u[1], scan.x)
    estimate = estimated(replace(scan, u_zz=u))
    # The other repeats are predicted from one with another baseline, this one from those alike.
    alone = np.where(estimate.points.repeat == 1, 0, 1)
    outcomes = [hold_out(estimate, group) for group in (alone, estimate.points.repeat)]
    assert all(found.p_value > 1e-6 for found in outcomes)


def test_a_signal_that_is_not_linear_in_load_is_found_by_the_load_held_out():
    scan = simulated(load=[0.5, 1.0, 1.5], noise=0.003, baseline=0.0, drift=0.0)
    estimate = estimated(replace(scan, u_zz=scan.u_zz * (1 + 0.06 * (scan.normal_load - 1.0))))
    assert hold_out(estimate, load_groups(estimate.points.load)).p_value < 1e-3


def test_one_outlier_does_not_condemn_its_repeat():
    scan = simulated(repeats=3)
    estimate = estimated(with_outlier(scan, (1, 30), 0.5))
    assert hold_out(estimate, estimate.points.repeat).p_value > 1e-3


def test_more_groups_than_ten_are_held_out_several_at_a_time_and_one_alone_not_at_all():
    estimate = estimated(simulated(repeats=23, points=17))
    found = hold_out(estimate, estimate.points.repeat)
    assert found.folds == 10
    assert not found.alone
    assert hold_out(estimate, np.zeros_like(estimate.points.repeat)) is None
