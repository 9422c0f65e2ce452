"""The force check over whole experiments: false alarms, and what it sees of a mistake.

Everything is drawn that a laboratory does not know: noise, the loads and their scale, positions,
film, radii.  Set MEMSCAL_FULL_STUDY for 60 experiments a case in place of 2.
"""

from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import simulate_experiment
from scipy.stats import binom

import memscal
from memscal.measurement.measure_stress import pooled_force

EXPERIMENTS = 60 if FULL else 2
CHANCE = 1e-3 if FULL else 1e-2  # or two experiments would be allowed any number of alarms
#: Repeats and loads that are known well enough to see five percent.
CAREFUL = {"repeats": 3, "load_uncertainty": 0.003}


@lru_cache
def study(**mistake):
    """Force over load, its uncertainty, failed force checks, and width of G, of each."""
    found = []
    for seed in range(EXPERIMENTS):
        scans = simulate_experiment(seed=seed, draw_inputs=True, **CAREFUL, **mistake)
        sensor = memscal.calibrate(scans.rod, method="evidence").apparatus
        measured = memscal.measure_stress([scans.dry, scans.lubricated], sensor)
        alarms = [c for c in measured.checks if "applied_force" in c.name and not c.passed]
        ratio, spread = pooled_force(measured.profiles)
        found.append((ratio, spread, len(alarms), sensor.gaussian_sigma))
    return found


def alarmed(**mistake):
    return sum(alarms > 0 for _, _, alarms, _ in study(**mistake))


def test_clean_experiments_seldom_alarm():
    # One check at 95 % and six at 99.7 %.
    assert alarmed() <= binom.ppf(1 - CHANCE, EXPERIMENTS, 0.065)


@pytest.mark.parametrize("gain", [1 / 1.05, 1.05] if FULL else [1.05])
def test_a_gain_that_is_wrong_by_five_percent_is_seen(gain):
    assert alarmed(gain=gain) >= binom.ppf(CHANCE, EXPERIMENTS, 0.9)


def test_a_film_five_percent_thicker_than_stated_is_not_seen_by_force_but_by_the_width_of_g():
    thick = {"thickness_factor": 1.05}
    assert alarmed(**thick) <= binom.ppf(1 - CHANCE, EXPERIMENTS, 0.1)
    wider = np.array([s[3] for s in study(**thick)]) / np.array([s[3] for s in study()])
    assert np.all(wider > 1.05)
