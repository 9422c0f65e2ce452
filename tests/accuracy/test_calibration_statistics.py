"""The fit to the scan over many noise draws: Cramer-Rao bound, truth of uncertainties.

Set MEMSCAL_FULL_STUDY for 200 seeds in place of 24.
"""

from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, cramer_rao, root_mean_square_limit
from helpers.scans import CONVERSION, SIGMA, simulated
from scipy.stats import chi2

import memscal

pytestmark = pytest.mark.accuracy

SEEDS = 200 if FULL else 24
CHANCE = 1e-5 if FULL else 1e-3  # of fewer seeds, so that what is wrong by much is still found
NOISES = (0.001, 0.005, 0.02)


@lru_cache
def study(noise: float) -> dict[str, np.ndarray]:
    """Errors and stated uncertainties of SEEDS calibrations, centre and baseline unknown."""
    rows = []
    for seed in range(SEEDS):
        scan = simulated(noise=noise, seed=seed, state_noise=False)
        p = memscal.calibrate(scan).apparatus.parameters
        rows.append(
            {
                "a_gaussian": p["conversion_constant_gaussian"] / CONVERSION - 1,
                "u_a_gaussian": p.uncertainty("conversion_constant_gaussian") / CONVERSION,
                "sigma": p["gaussian_sigma"] / SIGMA - 1,
                "u_sigma": p.uncertainty("gaussian_sigma") / SIGMA,
                "centre": (p["centre"] - 0.14e-3) / p.uncertainty("centre"),
                "baseline": (p["baseline"] - scan.synthetic["baseline"])
                / p.uncertainty("baseline"),
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@pytest.mark.parametrize("noise", NOISES)
def test_data_space_a_and_sigma_reach_the_cramer_rao_bound(noise: float) -> None:
    found = study(noise)
    for error, bound in zip((found["a_gaussian"], found["sigma"]), cramer_rao(noise), strict=True):
        assert np.sqrt(np.mean(error**2)) < root_mean_square_limit(1.1, SEEDS, CHANCE) * bound


@pytest.mark.parametrize("noise", NOISES)
def test_stated_uncertainties_are_right_to_fifteen_percent(noise: float) -> None:
    found = study(noise)
    for stated, bound in zip(
        (found["u_a_gaussian"], found["u_sigma"]), cramer_rao(noise), strict=True
    ):
        # The bound is what an efficient estimate truly scatters by, free of sampling error.
        assert np.sqrt(np.mean(stated**2)) == pytest.approx(bound, rel=0.15)
    low, high = np.sqrt(chi2.isf([1 - CHANCE, CHANCE], SEEDS) / SEEDS)
    for error, stated in (("a_gaussian", "u_a_gaussian"), ("sigma", "u_sigma")):
        assert low / 1.15 < np.sqrt(np.mean((found[error] / found[stated]) ** 2)) < high * 1.15


@pytest.mark.parametrize("noise", NOISES)
def test_centre_and_baseline_scatter_by_no_more_than_is_stated(noise: float) -> None:
    found = study(noise)
    for name in ("centre", "baseline"):
        assert np.sqrt(np.mean(found[name] ** 2)) < root_mean_square_limit(1.15, SEEDS, CHANCE)


def test_a_raster_scatters_by_no_more_than_is_stated() -> None:
    deviates = []
    seeds = range(SEEDS // 4)  # a raster costs as much as twenty lines
    for seed in seeds:
        scan = simulated(raster=True, points=25, seed=seed, centre=(0.3e-3, -0.2e-3))
        p = memscal.calibrate(scan).apparatus.parameters
        truths = {"conversion_constant": CONVERSION, "gaussian_sigma": SIGMA, "centre_y": -0.2e-3}
        deviates.append([(p[n] - truth) / p.uncertainty(n) for n, truth in truths.items()])
    scatter = np.sqrt(np.mean(np.square(deviates), axis=0))
    assert (scatter < root_mean_square_limit(1.15, len(seeds), CHANCE)).all()
