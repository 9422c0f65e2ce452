"""Speed of many calibrations on two processes, beside the plain loop over them.

Set MEMSCAL_FULL_STUDY for 400 scans in place of 100.
"""

from __future__ import annotations

import os

import pytest
from helpers.timing import once, show

import memscal

pytestmark = pytest.mark.benchmark

SCANS = 400 if os.environ.get("MEMSCAL_FULL_STUDY") else 100
#: Processes start by importing: a second or two, which a few hundred scans outweigh.
ALLOWED = 0.9 if SCANS > 100 else 1.2


def test_two_processes_calibrate_faster_than_a_loop() -> None:
    if (os.cpu_count() or 1) < 2:
        pytest.skip("one core")
    scans = [memscal.simulate(points=65, noise=0.003, seed=seed) for seed in range(SCANS)]

    def loop() -> None:
        for scan in scans:
            memscal.calibrate(scan, method="evidence")

    memscal.calibrate(scans[0], method="evidence")
    # The better of two: what else the machine does is not ours.
    fleet = min(
        once(lambda: memscal.calibrate_many(scans, workers=2, method="evidence")) for _ in range(2)
    )
    plain = min(once(loop) for _ in range(2))
    show(f"{SCANS} scans on two processes, over a loop", fleet / plain, ALLOWED)
