"""The calibration over many noise draws: Cramer-Rao bound, error of G, truth of uncertainties.

Set MEMSCAL_FULL_STUDY for 200 seeds in place of 24.
"""

from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, cramer_rao, root_mean_square_limit
from helpers.peers import tuned_wiener
from helpers.scans import CONVERSION, RING, SIGMA, TAILS, plane_error, simulated
from scipy.stats import binom, chi2

import memscal
from memscal.model.checks import FALSE_ALARM

pytestmark = pytest.mark.accuracy

SEEDS = 200 if FULL else 24
CHANCE = 1e-5 if FULL else 1e-3  # of fewer seeds, so that what is wrong by much is still found
NOISES = (0.001, 0.005, 0.02)
R = np.linspace(0, 3e-3, 121)


@lru_cache
def study(noise: float) -> dict[str, np.ndarray]:
    """Errors and stated uncertainties of SEEDS calibrations, centre and baseline unknown."""
    rows = []
    kernel = memscal.GaussianMixture()
    for seed in range(SEEDS):
        scan = simulated(noise=noise, seed=seed, state_noise=False)
        apparatus = memscal.calibrate(scan).apparatus
        p = apparatus.parameters
        error = apparatus.radial(R) - kernel.radial(R)
        rows.append(
            {
                "a": p["conversion_constant"] / CONVERSION - 1,
                "a_gaussian": p["conversion_constant_gaussian"] / CONVERSION - 1,
                "u_a_gaussian": p.uncertainty("conversion_constant_gaussian") / CONVERSION,
                "sigma": p["gaussian_sigma"] / SIGMA - 1,
                "u_sigma": p.uncertainty("gaussian_sigma") / SIGMA,
                "centre": (p["centre"] - 0.14e-3) / p.uncertainty("centre"),
                "baseline": (p["baseline"] - scan.synthetic["baseline"])
                / p.uncertainty("baseline"),
                "g": plane_error(R, apparatus.radial(R), kernel.radial(R)),
                "covered": np.mean(np.abs(error) < 2 * apparatus.radial_uncertainty(R)),
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


@pytest.mark.parametrize(
    ("noise", "g_limit", "a_limit"), [(0.001, 0.06, 0.005), (0.005, 0.10, 0.01), (0.02, 0.20, 0.04)]
)
def test_the_default_method_finds_g_and_a(noise: float, g_limit: float, a_limit: float) -> None:
    found = study(noise)
    assert np.median(found["g"]) < g_limit
    assert found["g"].max() < 2 * g_limit
    assert np.sqrt(np.mean(found["a"] ** 2)) < a_limit


@pytest.mark.parametrize("noise", NOISES)
def test_the_band_of_a_gaussian_g_covers_it(noise: float) -> None:
    # Bands count what the window hides, so that they cover more than noise alone would ask.
    assert study(noise)["covered"].mean() > 0.95


def test_a_beats_a_wiener_filter_tuned_on_the_truth_and_g_meets_it() -> None:
    noise, ours, theirs = 0.005, [], []
    kernel = memscal.GaussianMixture()
    for seed in range(max(10, SEEDS // 4)):
        scan = simulated(noise=noise, seed=seed)
        apparatus = memscal.calibrate(scan).apparatus
        g = plane_error(R, apparatus.radial(R), kernel.radial(R))
        ours.append((g, apparatus.conversion_constant / CONVERSION - 1))
        g, a = tuned_wiener(scan, kernel)
        theirs.append((plane_error(R, g, kernel.radial(R)), a / CONVERSION - 1))
    g_ours, a_ours = np.array(ours).T
    g_theirs, a_theirs = np.array(theirs).T
    assert np.median(g_ours) < 1.1 * np.median(g_theirs)
    assert np.sqrt(np.mean(a_ours**2)) < np.sqrt(np.mean(a_theirs**2))


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


@pytest.mark.parametrize("method", ["white-noise", "bayesian", "tikhonov", "wiener"])
def test_the_shape_of_a_sound_g_passes(method: str) -> None:
    kernels = [RING, TAILS, memscal.SmoothedDisc(radius=0.6e-3, sigma=0.25e-3)]
    failures = 0
    for seed in range(SEEDS):
        scan = simulated(kernel=kernels[seed % 3], noise=NOISES[seed % 2 + 1], seed=seed)
        checks = memscal.calibrate(scan, method=method).apparatus.checks
        failures += not all(check.passed for check in checks if check.name.startswith("shape_"))
    assert failures <= binom.isf(CHANCE, SEEDS, FALSE_ALARM)


@pytest.mark.parametrize("method", ["white-noise-draw", "unsupervised-wiener", "richardson-lucy"])
def test_what_no_window_divides_scatters_by_half_to_twice_what_is_stated(method: str) -> None:
    count, radii, values, stated = 20 if FULL else 8, np.linspace(0, 2e-3, 9), [], []
    kernel = memscal.GaussianMixture((1.0,), (0.9e-3,))
    for seed in range(count):
        scan = simulated(kernel=kernel, noise=0.01, points=33, seed=seed)
        apparatus = memscal.calibrate(scan, method=method, seed=seed).apparatus
        names = ("conversion_constant", "noise_equivalent_area")
        values.append([*(apparatus.parameters[n] for n in names), *apparatus.radial(radii)])
        u_g = apparatus.radial_uncertainty(radii)
        stated.append([*(apparatus.budget[n]["noise"] for n in names), *u_g])
        # Half or twice the truth is never stated as if it were right.
        off = abs(np.log2(apparatus.parameters["fwhm"] / (2.355 * 0.9e-3))) > 1
        assert not (off and apparatus.passed)
    ratio = np.std(values, axis=0, ddof=1) / np.median(stated, axis=0)
    low, high = np.sqrt(chi2.isf([1 - CHANCE, CHANCE], count - 1) / (count - 1))
    # What is stated of G counts what every scan hides, too.
    assert (ratio[:2] > low / 2).all()
    assert (ratio < 2 * high).all()
