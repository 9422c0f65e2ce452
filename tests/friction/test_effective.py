"""The effective friction coefficient over many cheap experiments: coverage, bounds, budgets."""

from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.linear_contacts import Laboratory
from scipy.stats import binom, kstest

from memscal.friction.effective import with_loading

SEEDS = 40 if FULL else 20
CHANCE = 1e-4
TRUTHS = (0.0, 0.1, 0.2, 0.3)


@lru_cache
def laboratory():
    return Laboratory.of()


@lru_cache
def found(friction):
    first = 1000 * round(100 * min(friction, 9.0))
    return [laboratory().drawn(friction, first + seed).coefficient([0, 1]) for seed in range(SEEDS)]


def test_intervals_hold_the_truth_in_ninety_to_ninety_eight_percent():
    held = [one.interval.holds(mu) for mu in TRUTHS for one in found(mu)]
    low, high = binom.ppf([CHANCE, 1 - CHANCE], len(held), [0.90, 0.98])
    assert low <= sum(held) <= high


@pytest.mark.parametrize("friction", TRUTHS)
def test_no_coefficient_is_left_out_of_its_interval(friction):
    held = sum(one.interval.holds(friction) for one in found(friction))
    assert held >= binom.ppf(CHANCE, SEEDS, 0.94)


@pytest.mark.parametrize("friction", [1.0, np.inf])
def test_a_large_coefficient_gives_a_lower_bound_and_no_number(friction):
    bounds = [one for one in found(friction) if one.value is None]
    # Full stick is excluded by chance as seldom as any true value.
    assert len(bounds) >= binom.ppf(CHANCE, SEEDS, 0.95)
    for one in bounds:
        assert one.interval.high is None
        assert "lower bound" in one.reason
        assert not one.budget
        assert one.standard_uncertainty is None
        assert one.interval.low > 0.1


def test_chi_square_is_as_large_as_its_degrees_say():
    chances = [one.p_value for mu in (0.1, 0.2) for one in found(mu)]
    assert kstest(chances, "uniform").pvalue > CHANCE


def test_of_two_loadings_the_middle_is_the_value_and_a_rectangle_is_left():
    ends = {"incremental": found(0.1)[0], "total": found(0.2)[0]}
    both = with_loading(ends, tested=True)
    low, high = (end.value for end in ends.values())
    apart = (high - low) / np.sqrt(12)
    for each in both.values():
        assert each.value == pytest.approx((low + high) / 2)
        assert each.budget["loading"] == pytest.approx(apart)
        assert np.hypot.reduce(list(each.budget.values())) == pytest.approx(
            each.standard_uncertainty
        )
    assert with_loading({"total": ends["total"]}, tested=True) == {"total": ends["total"]}
