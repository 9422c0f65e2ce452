"""Comparisons show themselves: as text within 100 columns, JSON, rows and figures."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.friction_results import FRICTION, LOADS, comparison, interface_comparison

from memscal import BoundedEstimate, ElasticFilm, FrictionComparison, Interval, Sphere
from memscal.friction.checks import comparison_checks, comparison_messages
from memscal.friction.effective import bracketed_share
from memscal.model.checks import Message, QualityCheck
from memscal.summaries.comparison import notes, tables


@pytest.fixture(scope="module")
def found() -> FrictionComparison:
    return comparison(interface=interface_comparison(1.8e-6))


def reading(
    value: float | None, low: float, high: float | None, *, u: float | None = 0.02, **fields: Any
) -> BoundedEstimate:
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


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (reading(0.2134, 0.171, 0.262), "0.21 [0.17, 0.26]"),
        (reading(0.1544, 0.1361, 0.1749), "0.154 [0.136, 0.175]"),
        (reading(0.03, 0.0, 0.084), "0.03 [0, 0.08]"),
        (reading(None, 12.51, None), "above 12 (95 %)"),
        (reading(0.2, 0.091, 1.61), "0.20 [0.09, 1.61]"),
        (reading(0.0, 0.0, 0.05), "below 0.050 (95 %)"),
        (reading(None, 0.0, None), "not identifiable"),
    ],
)
def test_an_estimate_prints_its_interval_or_a_bound(found: BoundedEstimate, text: str) -> None:
    assert str(found) == text
    assert text in repr(found)


@pytest.mark.parametrize("bound", [0.0999, 0.1001, 0.2451, 0.98765, 1.234, 9.99, 99.6])
def test_a_bound_is_never_rounded_to_the_side_that_claims_more(bound: float) -> None:
    lower = float(str(reading(None, bound, None)).split()[1])
    upper = float(str(reading(None, 0.0, bound)).split()[1])
    assert lower <= bound <= upper
    assert upper - lower < 0.11 * bound


def test_json_is_standard_and_says_null_and_why_where_there_is_no_value() -> None:
    bound = comparison(friction=math.inf, lubrications=("dry",), loadings=("incremental",))
    for load in json.loads(json.dumps(bound.to_dict(), allow_nan=False))["loads"]:
        readings = load["by_loading"]["incremental"]["effective_friction_coefficient"]
        for estimate in readings.values():
            assert (estimate["value"], estimate["interval"]["high"]) == (None, None)
            assert "lower bound" in estimate["reason"]
    assert "Contributions" not in str(bound)
    assert "no_value" in {message.kind for message in notes(bound)}


def test_rows_hold_every_load_by_every_loading(found: FrictionComparison) -> None:
    rows = found.to_dataframe()
    assert list(rows["load (N)"]) == 4 * list(LOADS)
    profiles = [load.by_profile for loads in found.loads.values() for load in loads]
    values = [math.nan if p.value is None else p.value for p in profiles]
    np.testing.assert_allclose(rows["friction by profile"], values)


def test_coefficients_share_what_scans_share(found: FrictionComparison) -> None:
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


def test_checks_of_each_profile_are_told_by_the_worst_and_failures_one_by_one() -> None:
    def check(name: str, value: float) -> QualityCheck:
        return QualityCheck(name, value, 1.0, value <= 1.0, "meaning")

    checks = [check("force_1", 0.3), check("noise_1", 0.2), check("force_2", 0.8)]
    table = tables(comparison(checks=tuple(checks)))[-1]
    assert [row[:2] for row in table.rows] == [("force, worst of 2", "0.8"), ("noise 1", "0.2")]
    failing = tables(comparison(checks=(*checks, check("force_3", 1.4))))[-1]
    assert [row[0] for row in failing.rows] == ["force 3", "force, worst of 2", "noise 1"]
    assert failing.marked == {0}


def test_a_wide_gap_between_coefficients_and_a_missing_frictionless_profile_are_told() -> None:
    def told(*friction: float) -> str:
        return " ".join(map(str, notes(comparison(friction_grid=np.array(friction)))))

    assert "between the friction coefficients 0 and 0.2" in told(0.0, 0.2, 0.3, math.inf)
    assert "p0_max is that of friction 0.1" in told(0.1, 0.2, 0.3, math.inf)
    # Past the friction at which a contact sticks nearly wholly, little changes.
    assert told(*FRICTION) == told(0.0, 0.1, 0.2, 0.3, math.inf) == ""


def messages(
    incremental: BoundedEstimate, total: BoundedEstimate, macroscopic: float | None = None
) -> str:
    film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    scan = SimpleNamespace(synthetic=False, film=film, indenter=Sphere(radius=0.1))
    profiles = (SimpleNamespace(scan=scan, load_uncertainty=None),)
    told = (Message("measured", "from the measured stress"),)
    measured: Any = SimpleNamespace(scans=(scan,), profiles=profiles, messages=told)
    joint = {"dry": {"incremental": incremental, "total": total}}
    sliding = None if macroscopic is None else (macroscopic, None)
    return "\n".join(map(str, comparison_messages(measured, {}, joint, (), sliding)))


def test_definitions_of_the_loading_that_disagree_are_told() -> None:
    near = reading(0.25, 0.2, 0.3)
    far = reading(0.29, 0.24, 0.36)
    assert "disagree for the dry loads by 0.04" in messages(near, far)
    assert "disagree" not in messages(near, reading(0.26, 0.21, 0.31))
    bound = reading(None, 0.2, None)
    # A bound and a value agree where the interval of the value reaches beyond the bound.
    assert "disagree" not in messages(bound, far)
    assert "disagree" not in messages(bound, bound)
    text = messages(reading(None, 0.4, None), far)
    assert "loads: above 0.40 (95 %) by incremental loading, 0.29 [0.24, 0.36] by total" in text


def test_the_macroscopic_coefficient_is_held_against_the_interval() -> None:
    one = reading(0.12, 0.08, 0.17)
    assert "is smaller than the macroscopic one, 1.6" in messages(one, one, 1.6)
    assert "is larger than the macroscopic one, 0.05" in messages(one, one, 0.05)
    assert "agrees with the macroscopic one, 0.1" in messages(one, one, 0.1)
    bound = reading(None, 0.2, None)
    assert "does not contradict the macroscopic one, 1.6" in messages(bound, bound, 1.6)
    text = messages(one, one)
    assert "Young's modulus, Poisson's ratio, film thickness, sphere radius, load" in text
    assert "from the measured stress" in text


def test_points_within_both_extremes_and_their_uncertainty_are_bracketed() -> None:
    """Profiles cross: under the flank the frictionless stress is the larger one."""
    calculated = np.array([[10.0, 5.0], [11.0, 5.5], [12.0, 4.0]])
    none = np.zeros_like(calculated)
    assert bracketed_share(np.array([11.0, 4.5]), np.zeros(2), calculated, none) == 1
    outside = np.array([13.0, 4.5])
    assert bracketed_share(outside, np.zeros(2), calculated, none) == 0.5
    assert bracketed_share(outside, np.full(2, 0.6), calculated, none) == 1
    assert bracketed_share(outside, np.zeros(2), calculated, none + 0.6) == 1


def test_lubricated_loads_that_exclude_no_friction_fail_their_check() -> None:
    def check(rise: float) -> QualityCheck:
        along = np.array([30.0 + rise, 30.0, 60.0])
        joint = {"lubricated": {"total": reading(0.1, 0.05, 0.2, deviance=along)}}
        return comparison_checks({}, joint)[-1]

    assert check(9.0).passed
    failing = check(12.0)
    assert not failing.passed
    assert failing.p_value == pytest.approx(5.3e-4, rel=0.02)


def test_a_misfit_of_all_loads_fails_though_one_loading_is_enough_to_pass() -> None:
    bad = reading(0.1, 0.05, 0.2, least=90.0, p_value=1e-8)
    good = reading(0.1, 0.05, 0.2)
    assert not comparison_checks({}, {"dry": {"total": bad}})[0].passed
    assert comparison_checks({}, {"dry": {"incremental": good, "total": bad}})[0].passed
    assert reading(None, 0.05, None).best == 0.1
