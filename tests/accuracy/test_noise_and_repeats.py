"""Rasters of unknown noise, outliers, and errors of positions, by another forward calculation.

Set MEMSCAL_FULL_STUDY for 192 rasters, 75 scans with outliers and 150 of each kind of error.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, RARE, deviates, root_mean_square, root_mean_square_limit
from helpers.outside import ROUND, SIGMA, A, line, scan
from helpers.scans import with_outlier
from scipy.interpolate import make_interp_spline
from scipy.stats import binom

import memscal

RASTERS, OUTLIERS, REPEATS, GAINS = (64, 25, 150, 40) if FULL else (3, 4, 12, 4)
HALF = 8e-3
ERROR = 10e-6


@lru_cache
def clean(side):
    """Voltages of a raster of the round sensor."""
    x = np.linspace(-HALF, HALF, side)
    return np.stack([ROUND.voltages(x, y=float(y)) for y in x])


def test_a_good_raster_of_unknown_noise_fails_a_check_as_rarely_as_is_meant():
    failed = 0
    sides = (23, 25, 29)
    for side in sides:
        x = np.linspace(-HALF, HALF, side)
        u = clean(side)
        for seed in range(RASTERS):
            noise = np.random.default_rng([seed, side]).normal(0.0, 0.005 * u.max(), u.shape)
            raster = replace(scan(ROUND, 0), x=x, y=x, u_zz=u + noise, u_zz_errors=None)
            failed += not memscal.calibrate(raster, other=False).passed
    # Ten of the checks are tests at 1/1000.
    assert failed <= binom.isf(RARE, len(sides) * RASTERS, 0.01)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.15])
def test_outliers_move_a_division_by_its_uncertainty_from_the_truth_and_the_other_route(
    share,
):
    off = []
    for seed in range(OUTLIERS):
        made = scan(ROUND, seed)
        rng = np.random.default_rng([seed, 1])
        hit = rng.permutation(made.x.size)[: round(share * made.x.size)]
        outlying = with_outlier(made, hit, rng.uniform(0.05, 0.5, hit.size))
        apparatus = memscal.calibrate(outlying).apparatus
        assert apparatus.other is not None
        bayesian = apparatus.other.parameters["conversion_constant"]
        error = apparatus.conversion_constant - np.array([A, bayesian])
        off.append(error / apparatus.parameters.uncertainty("conversion_constant"))
    rms = root_mean_square(off)
    assert (rms < root_mean_square_limit(1.0, OUTLIERS, RARE)).all()


@pytest.mark.parametrize("anew", [False, True])
def test_errors_of_positions_are_as_stated(anew):
    fine = np.arange(-HALF - 0.2e-3, HALF + 0.2e-3, 0.02e-3)
    at = make_interp_spline(fine, ROUND.voltages(fine), k=5)
    film = {"thickness_uncertainty": None, "poisson_ratio_uncertainty": None}
    stated = scan(ROUND, 0)
    stated = replace(stated, load_uncertainty=None, film=replace(stated.film, **film))
    off = []
    for seed in range(REPEATS):
        rng = np.random.default_rng([seed, 11])
        moved = line() + ERROR * rng.normal(size=(3 if anew else 1, line().size))
        u = at(moved) + rng.normal(0.0, 0.005 * at(0.0), (3, line().size))
        made = replace(
            stated,
            u_zz=u,
            u_zz_errors=np.full(u.shape, 0.005 * at(0.0)),
            x_errors=np.full(line().size, ERROR),
            position_errors_by_repeat=anew,
        )
        found = memscal.calibrate(made).apparatus.parameters
        off.append(deviates(found, {"gaussian_sigma": SIGMA, "centre": 0.0}))
    rms = root_mean_square(off)
    assert (rms < root_mean_square_limit(1.1, REPEATS, RARE)).all()
    assert (rms > (0.7 if FULL else 0.4)).all()
    assert np.mean(np.abs(off) < 2) >= binom.ppf(RARE, 2 * REPEATS, 0.95) / (2 * REPEATS)


def test_gains_that_vary_between_repeats_are_estimated_and_counted():
    u = ROUND.voltages(line())
    names = ("conversion_constant", "conversion_constant_gaussian")
    off = []
    for seed in range(GAINS):
        rng = np.random.default_rng([seed, 3])
        varying = rng.normal(1.0, 0.02, (5, 1)) * u + rng.normal(0.0, 0.005 * u.max(), (5, u.size))
        made = replace(
            scan(ROUND, 0), u_zz=varying, u_zz_errors=np.full(varying.shape, 0.005 * u.max())
        )
        found = memscal.calibrate(replace(made, load_uncertainty=None), other=False).apparatus
        off.append(deviates(found.parameters, dict.fromkeys(names, A)))
        assert 0 < found.budget["conversion_constant"]["between_repeats"] < 0.025 * A
    rms = root_mean_square(off)
    assert (rms < root_mean_square_limit(1.2, GAINS, RARE)).all()
