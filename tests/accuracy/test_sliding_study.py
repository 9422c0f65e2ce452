"""Friction from sliding: how often its interval holds the truth, and how small it is.

Each experiment is a rod scan and scans of a sliding sphere by forward calculations that share
nothing with the package, with film, modulus and loads drawn from their uncertainties: A and P 1 %,
h 1 %, E 4.5 %, noise 0.5 %.  Set MEMSCAL_FULL_STUDY for 80 in place of 6 at each coefficient.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.outside import World, scan
from helpers.sliding_sphere import FILM, Slid, sliding_scan
from scipy.stats import binom

import memscal
from memscal.cli.compare import user_cache_folder

EXPERIMENTS = 80 if FULL else 6
CHANCE = 1e-3
FRICTIONS = (0.0, 0.1, 0.3, 0.6)
BACKLASH = 5e-6
FORTH = (1,)
BOTH = (1, -1)
BOUNDS = {FORTH: 0.010, BOTH: 0.004}
WAYS = pytest.mark.parametrize("ways", [FORTH, BOTH], ids=["forth", "both"])


@cache
def drawn(seed):
    """A calibrated sensor, and what is true of a film that it and a sphere's contacts share."""
    rng = np.random.default_rng(seed)
    thickness = rng.normal(FILM.thickness, FILM.thickness_uncertainty)
    modulus = rng.normal(FILM.young_modulus, FILM.young_modulus_uncertainty)
    rod_load, load = rng.normal(1.0, 0.01, 2)
    rod = replace(scan(World(thickness=thickness, load_scale=rod_load), seed), film=FILM)
    apparatus = memscal.calibrate(rod, method="bayesian").apparatus
    true = Slid(load_scale=load, young_modulus=modulus, thickness=thickness)
    return apparatus, true


@cache
def comparisons(friction, ways):
    """The comparisons of all experiments."""
    found = []
    for seed in range(EXPERIMENTS):
        apparatus, true = drawn(seed)
        own = 1000 * round(10 * friction) + seed
        play = np.random.default_rng(own).normal(0.0, BACKLASH)
        made = sliding_scan(replace(true, friction=friction), own, ways, backlash=play)
        compared = memscal.compare(
            made,
            apparatus,
            sliding=True,
            backlash=BACKLASH if ways == BOTH else None,
            cache=user_cache_folder(),
        )
        found.append(compared)
    return found


def estimates(friction, ways):
    """The coefficients of all experiments."""
    return [compared.joint[""]["sliding"] for compared in comparisons(friction, ways)]


@WAYS
def test_the_interval_holds_the_truth(ways):
    held = [one.interval.holds(mu) for mu in FRICTIONS for one in estimates(mu, ways)]
    assert sum(held) >= binom.ppf(CHANCE, len(held), 0.95)
    if FULL:
        assert np.mean(held) >= 0.92


@WAYS
@pytest.mark.parametrize("friction", FRICTIONS[1:])
def test_the_coefficient_is_as_sure_as_it_says(friction, ways):
    found = estimates(friction, ways)
    z = [(one.value - friction) / one.standard_uncertainty for one in found]
    low, high = root_mean_square_range(len(z), CHANCE)
    assert min(low, 0.6) < root_mean_square(z) < max(high, 1.3)
    if friction == 0.3:
        assert np.mean([one.standard_uncertainty for one in found]) <= BOUNDS[ways]


@WAYS
def test_without_friction_there_is_a_bound(ways):
    bounds = [one.interval for one in estimates(0.0, ways)]
    assert sum(bound.low == 0 for bound in bounds) >= binom.ppf(CHANCE, len(bounds), 0.95)
    assert np.median([bound.upper for bound in bounds]) < 3 * BOUNDS[ways]


@WAYS
def test_checks_fail_by_chance_alone(ways):
    failed = [not one.passed for mu in FRICTIONS for one in comparisons(mu, ways)]
    # Up to three checks, each of which chance fails in one of 370 or fewer.
    assert sum(failed) <= binom.ppf(1 - CHANCE, len(failed), 3 / 370)
