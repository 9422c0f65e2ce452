"""The calibration over many scans: error of G and A by division, bands, both routes, the fit.

The scans come from another forward calculation than the analysis (helpers.direct).  Set
MEMSCAL_FULL_STUDY for 200 seeds in place of 3, of a Gaussian 8.  With --log-cli-level=INFO the
study tells medians, mean errors and coverage.
"""

import logging
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import (
    FULL,
    cramer_rao,
    deviates,
    root_mean_square,
    root_mean_square_limit,
    root_mean_square_range,
)
from helpers.estimation_study import (
    Case,
    Limits,
    Outcome,
    errors_of,
)
from helpers.scans import CENTRE, CONVERSION, RING, SIGMA, TAILS, added_ring, simulated
from scipy.stats import binom

import memscal

LOG = logging.getLogger(__name__)

CHANCE = 1e-5 if FULL else 1e-3  # of fewer seeds, so that what is wrong by much is still found
NOISES = (0.001, 0.005, 0.02)
WIDTHS = dict(zip(NOISES, (0.56e-3, 0.56e-3, 0.70e-3), strict=True))
OTHERS = {"disc": memscal.SmoothedDisc(0.8e-3, 0.3e-3), "mixture": TAILS, "ring": RING}

# A division loses detail that its window hides, and tells less of A than a fit does.
BANDS = {"bias_g": 1.3, "ratio": (0.1, 1.4), "bias_a": 0.6, "z_a": (0.6, 1.15), "efficiency": 2.2}
LIMITS = {
    "Gaussian": Limits((0.06, 0.145, 0.15), beyond=0.05, **BANDS),
    "disc": Limits((0.15, 0.15, 0.23), **BANDS),
    "mixture": Limits((0.15, 0.16, 0.26), **BANDS),
    # The film hides the hole of a ring, of which the band counts less than half.
    "ring": Limits(
        (0.30, 0.30, 0.30),
        **BANDS
        | {
            "coverage": 0.25,
            "mean_coverage": 0.80,
            "bias_g": 2.3,
            "ratio": (0.1, 2.4),
        },
    ),
}
A_LIMITS = dict(zip(NOISES, (0.003, 0.015, 0.045), strict=True))  # RMS error


def case_of(kind, noise):
    kernel = OTHERS.get(kind) or memscal.GaussianMixture((1.0,), (WIDTHS[noise],))
    return Case(kind, kernel, noise, 0.25e-3, 1, off=True)


CASES = [case_of(kind, noise) for kind in LIMITS for noise in NOISES]
GAUSSIANS = [case for case in CASES if case.sigma is not None]


def seeds_of(case):
    return 200 if FULL else 8 if case in GAUSSIANS else 3


def agreement(apparatus):
    return next(check for check in apparatus.checks if check.name == "method_agreement")


@lru_cache
def study(case):
    """Outcome of every seed's scan by the default method, and what its fit and checks find."""
    rows = []
    for seed in range(seeds_of(case)):
        scan = case.scan(seed)
        apparatus = memscal.calibrate(scan).apparatus
        p = apparatus.parameters
        truths = {n: scan.synthetic[n] for n in ("conversion_constant", "baseline", "centre")}
        fitted = {"conversion_constant_gaussian": CONVERSION, "gaussian_sigma": case.sigma or 1.0}
        rows.append(
            {
                **errors_of(case, seed, apparatus),
                "agreement": agreement(apparatus).value,
                "z": deviates(p, truths),
                "fit": [p[name] / truth - 1 for name, truth in fitted.items()],
                "u_fit": [p.uncertainty(name) / truth for name, truth in fitted.items()],
            }
        )
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    z = {"A": columns["z"][:, 0]}
    outcome = Outcome(case, columns["error"], columns["u"], columns["a"], z)
    held = outcome.held.mean(axis=0)
    rms = root_mean_square(outcome.a)
    told = np.median(outcome.g), held.mean(), held.min(), rms, columns["agreement"].max()
    LOG.info("%s: G %.3f, held %.3f, least %.3f; A %.4f; routes differ by %.2f", case.name, *told)
    return outcome, columns


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_g_and_a_are_found_and_are_as_uncertain_as_stated(case):
    outcome = study(case)[0]
    assert outcome.exceeded(LIMITS[case.kind]) == []
    limit = root_mean_square_limit(A_LIMITS[case.noise], seeds_of(case), CHANCE)
    assert root_mean_square(outcome.a) < limit


@pytest.mark.parametrize("case", GAUSSIANS, ids=lambda case: case.name)
def test_the_fit_reaches_its_bound_and_states_what_it_scatters_by(case):
    columns = study(case)[1]
    seeds = seeds_of(case)
    error = columns["fit"]
    stated = columns["u_fit"]
    bounds = cramer_rao(case.noise, case.kernel)
    truths = {"conversion_constant": CONVERSION, "gaussian_sigma": case.sigma}
    bound = np.array([bounds[name] / truth for name, truth in truths.items()])
    limit = root_mean_square_limit(1.1, seeds, CHANCE)
    assert (root_mean_square(error) < limit * bound).all()
    # The bound is what an efficient estimate truly scatters by, free of sampling error.
    assert root_mean_square(stated) == pytest.approx(bound, rel=0.15)
    low, high = root_mean_square_range(seeds, CHANCE)
    scatter = root_mean_square(error / stated)
    assert (low / 1.15 < scatter).all()
    assert (scatter < high * 1.15).all()
    nuisances = root_mean_square(columns["z"][:, 1:])
    assert (low * 0.85 < nuisances).all()
    assert (nuisances < high * 1.15).all()


def test_the_bands_of_95_percent_hold_g_pooled_over_all_cases():
    share, error = np.array([study(case)[0].coverage("G") for case in CASES]).T
    chance = 4 * np.linalg.norm(error) / len(CASES)
    assert 0.90 - chance < share.mean() < 0.99 + chance


def test_two_routes_to_one_scan_agree_but_for_one_good_scan_in_a_thousand():
    differences = np.concatenate([study(case)[1]["agreement"] for case in CASES])
    limit = agreement(memscal.calibrate(simulated()).apparatus).limit
    failed = int(np.sum(differences > limit))
    LOG.info("%d of %d scans differ by more than %g", failed, differences.size, limit)
    assert binom.sf(failed - 1, differences.size, 1e-3) > 1e-3


def test_a_ring_that_only_the_division_follows_is_told():
    scans = [GAUSSIANS[0].scan(seed) for seed in range(6)]
    ringed = [added_ring(scan, 0.01, 4e-3, 0.7e-3) for scan in scans]
    # A curved baseline, which both fit, would take a part of it.
    straight = [replace(scan, baseline_curvature_uncertainty=0.0) for scan in ringed]
    values = [agreement(memscal.calibrate(scan).apparatus) for scan in straight]
    assert np.median([check.value for check in values]) > values[0].limit


def test_a_raster_scatters_by_no_more_than_is_stated():
    z = []
    seeds = range(50 if FULL else 2)  # a raster costs as much as twenty lines
    for seed in seeds:
        scan = simulated(raster=True, points=25, seed=seed, centre=(0.3e-3, -0.2e-3))
        p = memscal.calibrate(scan).apparatus.parameters
        truths = {"conversion_constant": CONVERSION, "gaussian_sigma": SIGMA, "centre_y": -0.2e-3}
        z.append(deviates(p, truths))
    scatter = root_mean_square(z)
    assert (scatter < root_mean_square_limit(1.15, len(seeds), CHANCE)).all()


PASSES = 200 if FULL else 4


def of_repeats(noise, seed, shift, **options):
    """Calibrate with three passes over a Gaussian sensor, which moves from one to the next."""
    passes = [case_of("Gaussian", noise).scan(3 * seed + i) for i in range(3)]
    moved = [scan.x + i * shift for scan, i in zip(passes, (-1, 0, 1), strict=True)]
    u = np.concatenate([scan.u_zz for scan in passes])
    number = np.repeat([0, 1, 2], 65)
    scan = replace(passes[0], x=np.concatenate(moved), u_zz=u, u_zz_errors=None, repeat=number)
    return memscal.calibrate(scan, **options).apparatus


def test_repeats_that_share_their_centre_are_told_apart_as_rarely_as_is_said():
    found = [of_repeats(0.005, seed, 0.0).process.configuration["centre"] for seed in range(PASSES)]
    own = sum(choice["choice"] == "per-repeat" for choice in found)
    assert own <= binom.ppf(1 - CHANCE, PASSES, 1e-3)
    low, high = binom.ppf([CHANCE, 1 - CHANCE], PASSES, 0.4)
    assert low <= sum(choice["p_value"] < 0.4 for choice in found) <= high


def test_repeats_that_moved_have_centres_of_their_own_within_their_uncertainties():
    shift = 40e-6
    truths = {"conversion_constant_gaussian": CONVERSION, "gaussian_sigma": WIDTHS[0.005]}
    truths |= {"centre": CENTRE - shift, "centre_3": CENTRE + shift}
    z = []
    for seed in range(PASSES):
        own, one = (of_repeats(0.005, seed, shift, centre=choice) for choice in (None, "common"))
        p = own.parameters
        assert own.process.configuration["centre"]["choice"] == "per-repeat"
        z.append(deviates(p, truths))
        # With one centre the flanks of the others count as noise and outliers.
        name = "conversion_constant_gaussian"
        assert p.uncertainty(name) < 0.8 * one.parameters.uncertainty(name)
        assert "repeat_centres" in {check.name for check in one.checks if not check.passed}
    low, high = root_mean_square_range(PASSES, CHANCE)
    scatter = root_mean_square(z)
    assert np.all((low < scatter) & (scatter < high))
