"""Clipped scans: none passes, A of what is left is within its u, and good scans are not clipped.

Set MEMSCAL_FULL_STUDY for 120 clipped scans and 3000 good ones in place of 3 and 30.
"""

from typing import Any

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.outside import clipped, marked, wide_scan

import memscal
from memscal.calibration.stages import require_profile
from memscal.estimation.model_tests import clipped_points
from memscal.estimation.set_up import reference_profile

pytestmark = pytest.mark.accuracy

CLIPPED, GOOD = (120, 3000) if FULL else (3, 30)


def drawn(seed: int) -> tuple[int, dict[str, Any]]:
    rng = np.random.default_rng(seed)
    places = int(rng.choice([20, 41]))
    made = {
        "places": places,
        "noise": float(rng.choice([0.001, 0.002, 0.005, 0.01, 0.02])),
        "noise_stated": bool(rng.integers(2)),
        "width": float(rng.choice([0.55e-3, 1.3e-3])),
    }
    return int(rng.integers(3, 8 if places == 20 else 10)), made


@pytest.mark.parametrize("nine_of_20", [False, True])
def test_no_clipped_scan_passes_and_what_is_left_tells_a_within_its_u(nine_of_20):
    silent = []
    unnamed: list[int] = []
    z = []
    for seed in range(CLIPPED):
        count, made = drawn(seed)
        if nine_of_20:
            count = 9
            made["places"] = 20
        whole = wide_scan(seed, **made)
        try:
            found = memscal.calibrate(clipped(whole, count, seed=seed), other=False)
            checks = found.apparatus.checks
            if all(check.passed for check in checks if check.name == "saturation"):
                silent.append(seed)
        except memscal.MemscalError as error:
            unnamed += [seed] * ("--ceiling" not in str(error))
        try:
            found = memscal.calibrate(marked(whole, count), other=False)
        except memscal.MemscalError as error:
            unnamed += [seed] * ("at the ceiling" not in str(error))
            continue
        a = found.apparatus.parameters
        u = a.uncertainty("conversion_constant")
        z.append((a["conversion_constant"] - 1e-7) / u)
    assert silent == unnamed == []
    # Of nine of twenty nothing may be left: all are refused.
    assert np.sum(np.square(z)) <= 1.2**2 * len(z)


def test_good_scans_are_not_clipped():
    false = []
    for seed in range(GOOD):
        scan = wide_scan(seed, **drawn(seed)[1])
        estimate = require_profile([scan], [reference_profile(scan, None)], "zz", (0,), "Pa")
        if clipped_points(estimate).any():
            false.append(seed)
    assert len(false) <= 3 * GOOD / 3000
