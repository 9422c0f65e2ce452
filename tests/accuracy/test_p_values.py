"""P-values of the residuals are uniform for scans that are as stated, whatever G.

Set MEMSCAL_FULL_STUDY for 400 seeds in place of 16.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.direct import direct_scan
from helpers.scans import RING, TAILS, estimated, simulated
from scipy.interpolate import make_interp_spline
from scipy.stats import binom, kstest

import memscal
from memscal.estimation.residuals import (
    chi_square_test,
    neighbour_correlation_test,
    residuals_of,
    steps_test,
)

SEEDS = 400 if FULL else 16
CHANCE = 1e-5
NOISES = (0.003, 0.02)
SENSORS = {
    # The disc is sharper than any departure of the model.
    "Gaussian": memscal.GaussianMixture(),
    "tails": TAILS,
    "ring": RING,
    "disc": memscal.SmoothedDisc(1e-3, 0.05e-3),
}


@lru_cache
def p_values(sensor, noise):
    rows = []
    first = 1000 * list(SENSORS).index(sensor)
    for seed in range(first, first + SEEDS):
        residuals = residuals_of(estimated(direct_scan(SENSORS[sensor], noise=noise, seed=seed)))
        rows.append(
            {
                "size": chi_square_test(residuals).p_value,
                "steps": steps_test(residuals).p_value,
                "neighbours": neighbour_correlation_test(residuals).p_value,
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("name", ["size", "neighbours"])
def test_p_values_are_uniform(name, sensor, noise):
    assert kstest(p_values(sensor, noise)[name], "uniform").pvalue > CHANCE


@pytest.mark.parametrize("name", ["size", "neighbours", "steps"])
def test_p_values_of_all_sensors_together_are_uniform_in_their_lower_tail(name):
    # Seeds differ between sensors; the two noises share theirs, and are looked at one by one.
    for noise in NOISES:
        found = np.concatenate([p_values(sensor, noise)[name] for sensor in SENSORS])
        for level in (0.01, 0.1):
            low, high = binom.ppf([CHANCE, 1 - CHANCE], found.size, level)
            # Of correlated steps the sum of p-values is more than that of any.
            assert (low if name != "steps" else 0) <= np.sum(found < level) <= high


def test_uncertain_positions_are_noise_of_every_chi_square():
    fine = simulated(noise=0.0, points=1025)
    error = 10e-6
    voltage = make_interp_spline(fine.x, fine.u_zz, k=5)
    found = {"gaussian_misfit": [], "chi_square": [], "reconvolution": []}
    for seed in range(SEEDS):
        scan = simulated(noise=0.002, seed=seed)
        off = error * np.random.default_rng([seed, 1]).normal(size=65)
        u = scan.u_zz + voltage(scan.x + off) - voltage(scan.x)
        scan = replace(scan, u_zz=u, x_errors=np.full(65, error))
        for check in memscal.calibrate(scan).apparatus.checks:
            if check.name in found:
                # A reconvolution has no p-value.
                found[check.name].append(check.p_value or check.value / check.limit)
    assert kstest(found["chi_square"], "uniform").pvalue > CHANCE
    assert kstest(found["gaussian_misfit"], "uniform").pvalue > CHANCE
    assert np.sum(np.array(found["reconvolution"]) > 1) <= binom.ppf(1 - CHANCE, SEEDS, 1e-3)


def test_clean_scans_hardly_ever_fail_a_check():
    settings = [
        {},
        {"noise": 0.02},
        {"noise": 0.001},
        {"state_noise": False},
        {"repeats": 3, "points": 33},
        {"load": [0.0025, 0.005, 0.0075], "points": 33},
        {"repeats": 2, "points": 33, "branch": [1, 2]},
    ]
    failed = run = 0
    for seed in range(SEEDS):
        # Light enough for a linear film.
        scan = simulated(seed=seed, **({"load": 0.005} | settings[seed % len(settings)]))
        checks = memscal.calibrate(scan, method="evidence").apparatus.checks
        failed += sum(not check.passed for check in checks)
        run += len(checks)
    # Each fails once in a thousand by chance; some never do.
    assert failed <= binom.ppf(1 - CHANCE, run, 1e-3)
