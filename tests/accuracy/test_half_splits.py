"""Differences between runs of one sensor over what is stated for them.

Set MEMSCAL_FULL_STUDY for 200 runs in place of 16.
"""

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import RING, TAILS, simulated
from scipy.stats import chi2

import memscal

pytestmark = pytest.mark.accuracy

CHANCE = 1e-5 if FULL else 1e-3
RUNS = 200 if FULL else 16
DISC = memscal.SmoothedDisc(radius=0.8e-3, sigma=0.3e-3)
KINDS = {"Gaussian": None, "disc": DISC, "tails": TAILS, "ring": RING}


def scatter(values: np.ndarray, stated: np.ndarray) -> float:
    """RMS of the values about their weighted mean, in stated uncertainties."""
    mean = np.average(values, weights=stated**-2)
    return float(np.sqrt(np.sum(((values - mean) / stated) ** 2) / (values.size - 1)))


@pytest.mark.parametrize("noise", [0.001, 0.005])
@pytest.mark.parametrize("kind", KINDS)
def test_runs_of_other_reach_and_step_differ_as_stated(kind: str, noise: float) -> None:
    rng, rows = np.random.default_rng(3), []
    for seed in range(RUNS):
        half_range, step = rng.uniform(5e-3, 10e-3), rng.uniform(0.2e-3, 0.5e-3)
        scan = simulated(
            kernel=KINDS[kind], noise=noise, seed=seed, half_range=half_range,
            points=int(2 * half_range / step), centre=(rng.uniform(-1e-3, 1e-3), 0.0),
            repeats=int(rng.integers(1, 4)),
        )  # fmt: skip
        apparatus = memscal.calibrate(scan, method="bayesian").apparatus
        p, budget = apparatus.parameters, apparatus.budget["gaussian_sigma"]
        names = "gaussian_sigma", "conversion_constant_gaussian"
        rows.append(
            [budget["noise"], *(n for name in names for n in (p[name], p.uncertainty(name)))]
        )
    by_noise, width, u_width, a, u_a = np.array(rows).T
    low, high = np.sqrt(chi2.isf([1 - CHANCE, CHANCE], RUNS - 1) / (RUNS - 1))
    for ratio in (scatter(width, u_width), scatter(a, u_a)):
        assert 0.7 * low < ratio < 1.3 * high
    if kind == "Gaussian":
        assert np.mean(u_width) < 1.02 * np.mean(by_noise)
    elif kind == "tails" and noise == 0.001:
        assert scatter(width, by_noise) > 1.2
