"""What a dwell record of 60 s at 20 Hz tells of creep, for the noise that it has."""

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.scans import EXACT_ROD

import memscal
from memscal.extensions.motion.creep import creep_of

SHARE = 0.05
TIME = np.arange(1200) / 20
DECAY = np.exp(-TIME)  # of 1 s
COUNT = 60 if FULL else 20


@pytest.mark.parametrize("noise", [0.001, 0.005, 0.02])
def test_share_time_and_level_are_as_uncertain_as_the_noise_makes_them(noise):
    errors = []
    spreads = []
    failed = 0
    for seed in range(COUNT):
        u = 1 - SHARE * DECAY + noise * np.random.default_rng([seed, 40]).standard_normal(1200)
        record = memscal.Scan(x=0 * u, u_zz=u, time=TIME, motion="rest", indenter=EXACT_ROD)
        creep = creep_of(record)
        share, tau, level, _ = creep.parameters.values
        spread = np.sqrt(np.diag(creep.parameters.covariance))[:3] / [1, tau, 1]
        errors.append(np.array([share - SHARE, np.log(tau), level - 1]) / spread)
        spreads.append(spread)
        failed += sum(not check.passed for check in creep.checks)
    low, high = root_mean_square_range(COUNT, 1e-3)
    assert np.all((low < root_mean_square(errors)) & (root_mean_square(errors) < high))
    # Cramer-Rao, by share, ln tau, and level.
    slopes = np.stack([-DECAY, -SHARE * DECAY * TIME, 1 - SHARE * DECAY])
    bounds = noise * np.sqrt(np.diag(np.linalg.inv(slopes @ slopes.T)))
    np.testing.assert_allclose(np.median(spreads, axis=0), bounds, rtol=0.15)
    assert (np.median(spreads, axis=0) < noise * np.array([0.51, 15, 0.033])).all()
    assert failed <= 2  # of so many checks at 1/1000
