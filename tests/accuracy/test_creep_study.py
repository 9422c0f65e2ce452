"""What a dwell record tells of creep, and what a calibration of a scan in motion makes of it.

The record: 60 s at 20 Hz.  The scan: of the paper's rod by a forward calculation of its own, passed
through creep in time by the exact recursion for readings that are linear between fine steps.
"""

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.outside import World
from helpers.scans import EXACT_FILM, EXACT_ROD

import memscal
from memscal.extensions.motion.creep import creep_of

SHARE = 0.05
TIME = np.arange(1200) / 20
DECAY = np.exp(-TIME)  # of 1 s
COUNT = 60 if FULL else 20
X = np.linspace(-8e-3, 8e-3, 201)
FINE = 20
"""Steps of the recursion from reading to reading."""


def found(rng, noise):
    u = 1 - SHARE * DECAY + noise * rng.standard_normal(TIME.size)
    return creep_of(memscal.Scan(x=0 * u, u_zz=u, time=TIME, motion="rest", indenter=EXACT_ROD))


@pytest.mark.parametrize("noise", [0.001, 0.005, 0.02])
def test_share_time_and_level_are_as_uncertain_as_the_noise_makes_them(noise):
    errors = []
    spreads = []
    failed = 0
    for seed in range(COUNT):
        creep = found(np.random.default_rng([seed, 40]), noise)
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


def crept(still, speed):
    """Return readings of a sensor that creeps, of those of a still one at fine steps."""
    step = np.ptp(X) / (still.size - 1) / speed
    lags = np.diff(still) / step
    slow = still.copy()
    for i, lag in enumerate(lags, 1):
        slow[i] = still[i] - lag + (slow[i - 1] - still[i - 1] + lag) * np.exp(-step)
    return (1 - SHARE) * still + SHARE * slow


@pytest.mark.parametrize(("speed", "wrong"), [(1e-3, (0.015, 0.032)), (10e-3, (-0.047, 0.003))])
def test_a_scan_in_motion_is_corrected_by_the_creep_of_a_dwell_record(speed, wrong, seed):
    still = World(load=1.0).voltages(np.linspace(X[0], X[-1], FINE * (X.size - 1) + 1))
    rng = np.random.default_rng(seed)
    noise = 0.001 * still.max() * np.ones_like(X)
    drawn = noise * rng.standard_normal(X.size)

    def calibrated(u, **timed):
        scan = memscal.Scan(
            x=X,
            u_zz=u[::FINE] + drawn,
            u_zz_errors=noise,
            load=1.0,
            film=EXACT_FILM,
            indenter=EXACT_ROD,
            **timed,
        )
        creep = found(rng, 0.002) if timed else None
        apparatus = memscal.calibrate(scan, creep=creep, other=False).apparatus
        values = np.array([apparatus.conversion_constant, apparatus.gaussian_sigma])
        parts = [apparatus.budget[n] for n in ("conversion_constant", "gaussian_sigma")]
        left = [np.hypot(p.get("creep_share", 0), p.get("creep_time", 0)) for p in parts]
        return values, left / values

    moved = crept(still, speed)
    true, _ = calibrated(still)
    corrected, left = calibrated(moved, time=(X - X[0]) / speed)
    # What the noise of the dwell record leaves of the creep is chance.
    assert (abs(corrected / true - 1) < np.array([0.002, 0.004]) + 4 * left).all()
    assert calibrated(moved)[0] / true - 1 == pytest.approx(wrong, abs=0.005)
