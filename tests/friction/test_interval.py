"""Intervals of a profile likelihood: two ends, one end, none."""

import numpy as np
import pytest

from memscal.friction.interval import friction_reason, profile_estimate

COORDINATES = np.linspace(0.0, 1.0, 101)


def value_at(t):
    return float("inf") if t == 1 else 0.3 * t / (1 - t)


def estimate(chi_square, last=np.inf):
    values = np.array([*map(value_at, COORDINATES[:-1]), last])
    return profile_estimate(
        values, COORDINATES, chi_square, chi_square, 0.3, reason=friction_reason
    )


def parabola(best, sigma, last=np.inf):
    return estimate(7.0 + ((COORDINATES - best) / sigma) ** 2, last)


@pytest.mark.parametrize("sigma", [0.002, 0.02, 0.1])
@pytest.mark.parametrize("best", [0.4, 0.4037])
def test_the_ends_of_a_parabola_are_known(best, sigma):
    found = parabola(best, sigma)
    assert found.value == pytest.approx(value_at(best), rel=1e-3)
    assert found.least == pytest.approx(7.0, abs=1e-6)
    assert found.interval.low == pytest.approx(value_at(best - 1.959964 * sigma), rel=1e-3)
    assert found.interval.high == pytest.approx(value_at(best + 1.959964 * sigma), rel=1e-3)
    assert found.standard_uncertainty == pytest.approx(
        (value_at(best + sigma) - value_at(best - sigma)) / 2, rel=2e-3
    )
    assert found.reason == ""


def test_an_interval_that_reaches_full_stick_is_a_lower_bound():
    found = parabola(0.9, 0.1)
    assert found.interval.high is None
    assert found.interval.low == pytest.approx(value_at(0.704), rel=1e-2)
    assert found.interval.holds(float("inf"))
    assert found.value is None
    assert "lower bound" in found.reason
    assert "full stick" in found.reason
    assert "20" in parabola(0.9, 0.1, last=20.0).reason


def test_an_interval_that_reaches_no_friction_begins_there():
    found = parabola(0.05, 0.1)
    assert found.interval.low == 0
    assert found.interval.high == pytest.approx(value_at(0.246), rel=1e-2)
    assert found.standard_uncertainty is None
    assert found.reason == ""


def test_a_best_value_beyond_an_end_is_that_end():
    assert parabola(-0.2, 0.1).value == 0
    assert parabola(1.2, 0.1).best == float("inf")


def test_a_flat_likelihood_identifies_nothing():
    found = parabola(0.5, 10.0)
    assert (found.interval.low, found.interval.high) == (0, None)
    assert "not identifiable" in found.reason


def test_what_is_flat_beyond_a_value_bounds_from_below_only():
    """The shape of the real thing: chi-square falls to a value, and stays."""
    found = estimate(60 * np.maximum(0.5 - COORDINATES, 0) ** 2 * 100)
    assert found.interval.high is None
    assert found.interval.low == pytest.approx(value_at(0.5 - np.sqrt(3.84 / 6000)), rel=1e-2)
