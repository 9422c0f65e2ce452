from __future__ import annotations

import numpy as np
import pytest

import memscal
from memscal.calibration.coverage import sampling_error, shortest_interval, symmetric_interval


def test_intervals_of_a_normal_distribution_are_its_quantiles() -> None:
    draws = np.random.default_rng(0).normal(3.0, 2.0, (40_000, 2))
    for ends in (symmetric_interval(draws), shortest_interval(draws)):
        # Of 40,000 draws the ends are known to about 0.015 standard deviations, the shortest
        # interval's to several times that: its width hardly changes as it moves.
        np.testing.assert_allclose(ends[0], 3 - 1.96 * 2, atol=0.3)
        np.testing.assert_allclose(ends[1], 3 + 1.96 * 2, atol=0.3)
        np.testing.assert_allclose(ends[1] - ends[0], 2 * 1.96 * 2, rtol=0.02)


def test_the_shortest_interval_of_a_skewed_distribution_is_shorter_and_to_one_side() -> None:
    draws = np.random.default_rng(1).exponential(size=20_000)
    symmetric, shortest = symmetric_interval(draws), shortest_interval(draws)
    assert np.ptp(shortest) < 0.9 * np.ptp(symmetric)
    assert shortest[0] < 0.005


@pytest.mark.parametrize("scale", [1.0, 1e-9])
def test_the_sampling_error_is_the_scatter_of_standard_deviations(scale: float) -> None:
    draws = scale * np.random.default_rng(2).normal(size=(100, 3000))
    stated = float(np.median(sampling_error(draws)))
    # 1 / sqrt(2 M) of a normal distribution.
    assert stated == pytest.approx(1 / np.sqrt(200), rel=0.1)
    spread = draws.std(axis=0, ddof=1)
    assert float(spread.std() / spread.mean()) == pytest.approx(stated, rel=0.1)


def test_draws_that_do_not_scatter_have_no_sampling_error() -> None:
    assert sampling_error(np.ones((10, 1)))[0] == 0.0


@pytest.mark.parametrize("coverage", [0.0, 1.0, -0.5, 95.0])
def test_a_coverage_that_is_no_probability_is_refused(coverage: float) -> None:
    with pytest.raises(memscal.MemscalError, match="coverage"):
        shortest_interval(np.arange(10.0), coverage)


def test_one_draw_has_no_interval() -> None:
    with pytest.raises(memscal.MemscalError, match="1 draws"):
        symmetric_interval(np.ones(1))
