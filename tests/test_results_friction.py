"""Comparisons show themselves: as text within 100 columns, JSON, rows and figures."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.friction_results import LOADS, comparison, interface_comparison

from memscal import BoundedEstimate, Interval
from memscal.friction.checks import comparison_checks
from memscal.friction.effective import bracketed_share
from memscal.summaries.comparison import notes


@pytest.fixture(scope="module")
def found():
    return comparison(interface=interface_comparison(1.8e-6))


def reading(value, low, high, *, u=0.02, **fields):
    made = BoundedEstimate(
        value=value,
        standard_uncertainty=u,
        interval=Interval(low, high),
        reason="" if value is not None else "a lower bound",
        values=np.array([0.0, 0.1, math.inf]),
        deviance=np.array([40.0, 30.0, 50.0]),
        degrees=29,
        least=30.0,
        p_value=0.4,
    )
    return replace(made, **fields)


@pytest.mark.parametrize("bound", [0.0999, 0.1001, 0.2451, 0.98765, 1.234, 9.99, 99.6])
def test_a_bound_is_never_rounded_to_the_side_that_claims_more(bound):
    lower = float(str(reading(None, bound, None)).split()[1])
    upper = float(str(reading(None, 0.0, bound)).split()[1])
    assert lower <= bound <= upper
    assert upper - lower < 0.11 * bound


def test_json_is_standard_and_says_null_and_why_where_there_is_no_value():
    bound = comparison(friction=math.inf, lubrications=("dry",), loadings=("incremental",))
    for load in json.loads(json.dumps(bound.to_dict(), allow_nan=False))["loads"]:
        readings = load["by_loading"]["incremental"]["effective_friction_coefficient"]
        for estimate in readings.values():
            assert (estimate["value"], estimate["interval"]["high"]) == (None, None)
            assert "lower bound" in estimate["reason"]
    assert "Contributions" not in str(bound)
    assert "no_value" in {message.kind for message in notes(bound)}


def test_rows_hold_every_load_by_every_loading(found):
    rows = found.to_dataframe()
    assert list(rows["load (N)"]) == 4 * list(LOADS)
    profiles = [load.by_profile for loads in found.loads.values() for load in loads]
    values = [math.nan if p.value is None else p.value for p in profiles]
    np.testing.assert_allclose(rows["friction by profile"], values)


def test_coefficients_share_what_scans_share(found):
    joint = {
        f"friction_{lubrication}_{loading}": estimate
        for lubrication, by_loading in found.joint.items()
        for loading, estimate in by_loading.items()
        if estimate.standard_uncertainty is not None
    }
    numbers = found.ufloats()
    assert set(numbers) == set(joint)
    for name, number in numbers.items():
        assert number.nominal_value == pytest.approx(joint[name].value)
        assert number.std_dev == pytest.approx(joint[name].standard_uncertainty)
    first, *others = numbers.values()
    for other in others:
        apart = math.hypot(first.std_dev, other.std_dev)
        assert abs(first.std_dev - other.std_dev) <= (first - other).std_dev <= apart * (1 + 1e-9)


def test_points_within_both_extremes_and_their_uncertainty_are_bracketed():
    """Profiles cross: under the flank the frictionless stress is the larger one."""
    calculated = np.array([[10.0, 5.0], [11.0, 5.5], [12.0, 4.0]])
    none = np.zeros_like(calculated)
    assert bracketed_share(np.array([11.0, 4.5]), np.zeros(2), calculated, none) == 1
    outside = np.array([13.0, 4.5])
    assert bracketed_share(outside, np.zeros(2), calculated, none) == 0.5
    assert bracketed_share(outside, np.full(2, 0.6), calculated, none) == 1
    assert bracketed_share(outside, np.zeros(2), calculated, none + 0.6) == 1


def test_lubricated_loads_that_exclude_no_friction_fail_their_check():
    def check(rise):
        along = np.array([30.0 + rise, 30.0, 60.0])
        joint = {"lubricated": {"total": reading(0.1, 0.05, 0.2, deviance=along)}}
        return comparison_checks({}, joint)[-1]

    assert check(9.0).passed
    failing = check(12.0)
    assert not failing.passed
    assert failing.p_value == pytest.approx(5.3e-4, rel=0.02)


def test_a_misfit_of_all_loads_fails_though_one_loading_is_enough_to_pass():
    bad = reading(0.1, 0.05, 0.2, least=90.0, p_value=1e-8)
    good = reading(0.1, 0.05, 0.2)
    assert not comparison_checks({}, {"dry": {"total": bad}})[0].passed
    assert comparison_checks({}, {"dry": {"incremental": good, "total": bad}})[0].passed
    assert reading(None, 0.05, None).best == 0.1
