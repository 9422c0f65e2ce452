"""Calibrations of simulated scans, with checks and messages of the tests' own."""

from dataclasses import replace
from functools import cache

import pytest
from helpers.scans import simulate

import memscal
from memscal import Message
from memscal.figures.calibration import calibration_figure


@cache
def calibrated(**scan):
    """Calibrate a simulated scan, once for all tests."""
    return memscal.calibrate(simulate(seed=1, **scan), other=False).apparatus


def build(
    *,
    failed=0,
    meaning="The scan is not explained to within its noise.",
    message="1 outlier was down-weighted at x = 2.25 mm.",
    sensor=None,
    **scan,
):
    """Return a calibration of which the first checks fail."""
    data = calibrated(**scan)
    checks = enumerate(data.checks)
    return replace(
        data,
        checks=tuple(replace(c, passed=i >= failed, meaning=meaning) for i, c in checks),
        process=replace(data.process, messages=(Message("outlier", message),)),
        sensor=sensor or data.sensor,
    )


@pytest.fixture(name="make_apparatus", scope="session")
def make_apparatus_fixture():
    """Return the builder of calibrations."""
    return build


@pytest.fixture(name="drawn", scope="session")
def drawn_fixture():
    """Return the figure of a calibration, drawn once for all tests that only look at it."""

    @cache
    def drawn(**options):
        return calibration_figure(build(**options))

    return drawn
