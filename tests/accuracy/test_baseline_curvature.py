"""A curved baseline that no scan states, by scans of another forward calculation.

Set MEMSCAL_FULL_STUDY for 40 seeds in place of 10.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.bounds import FULL, deviates
from helpers.outside import ROUND
from helpers.outside import scan as perturbed_scan
from helpers.outside_study import TRUTHS
from scipy.stats import norm

import memscal

SEEDS = 40 if FULL else 10
CHANCE = 1e-4
METHODS = ("white-noise", "bayesian")


@cache
def found(method, parabola, held):
    """Errors over uncertainties, relative uncertainties, and whether a scan has no alarm."""
    world = replace(ROUND, parabola=parabola)
    z = []
    u = []
    passed = []
    for seed in range(SEEDS):
        scan = perturbed_scan(world, seed)
        if held:
            scan = replace(scan, baseline_curvature_uncertainty=0.0)
        apparatus = memscal.calibrate(scan, method=method, other=False).apparatus
        p = apparatus.parameters
        z.append(deviates(p, TRUTHS))
        u.append([p.uncertainty(name) / truth for name, truth in TRUTHS.items()])
        passed.append(apparatus.passed)
    return np.array(z), np.array(u), np.array(passed)


@pytest.mark.parametrize("method", METHODS)
def test_a_parabola_of_one_percent_moves_results_by_at_most_one_and_a_half_uncertainties(method):
    straight, _, _ = found(method, 0.0, False)
    curved, _, passed = found(method, 0.01, False)
    assert passed.mean() > 0.5
    # Of the same noise: its share in the difference is small.
    moved = np.mean((curved - straight)[passed], axis=0)
    assert np.abs(moved).max() < 1.5


@pytest.mark.parametrize("method", METHODS)
def test_the_prior_of_a_curvature_widens_a_of_a_straight_baseline_by_at_most_15_percent(method):
    free = found(method, 0.0, False)[1][:, 0]
    held = found(method, 0.0, True)[1][:, 0]
    growth = free / held
    margin = norm.isf(CHANCE) * np.std(growth, ddof=1) / np.sqrt(SEEDS)
    assert 1.0 < growth.mean() < 1.15 + margin
