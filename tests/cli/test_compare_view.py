"""What ``memscal compare`` prints: never a bare number, standard JSON, within 100 columns."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from helpers.friction_results import FRICTION, LOADS, comparison, interface_comparison

import memscal
from memscal.friction.results import EffectiveFriction, FrictionComparison, Interval
from memscal.model.checks import QualityCheck, failed_check_messages
from memscal.model.provenance import SourceFile
from memscal.summaries.comparison import comparison_json, comparison_notes, comparison_tables
from memscal.summaries.interface_laws import bounded_text

ARTIFACT = SourceFile("sensor.apparatus.h5", "cd" * 32)


@pytest.fixture(scope="module")
def found() -> FrictionComparison:
    return comparison()


@pytest.fixture(scope="module")
def sticking() -> FrictionComparison:
    """A comparison whose coefficients have no upper end."""
    return comparison(friction=math.inf, lubrications=("dry",), loadings=("incremental",))


def printed(found: FrictionComparison) -> str:
    return "\n".join(table.plain() for table in comparison_tables(found) if table.rows)


def reading(value: float | None, low: float, high: float | None) -> EffectiveFriction:
    nothing = np.zeros(1)
    return EffectiveFriction(
        value, None, Interval(low, high), "why", {}, nothing, nothing, 1, 0.0, 1.0
    )


def as_json(found: FrictionComparison) -> dict[str, Any]:
    text = json.dumps(comparison_json(found, ARTIFACT), allow_nan=False)
    value = json.loads(text)
    assert isinstance(value, dict)
    return value


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (reading(0.2134, 0.171, 0.262), "0.21 [0.17, 0.26]"),
        (reading(0.1544, 0.1361, 0.1749), "0.154 [0.136, 0.175]"),
        (reading(0.03, 0.0, 0.084), "0.03 [0, 0.08]"),
        (reading(None, 0.2451, None), "above 0.24 (95 %)"),
        (reading(None, 12.51, None), "above 12 (95 %)"),
        (reading(0.2, 0.091, 1.61), "0.20 [0.09, 1.61]"),
        (reading(0.0, 0.0, 0.0123), "below 0.013 (95 %)"),
        (reading(0.0, 0.0, 0.05), "below 0.050 (95 %)"),
        (reading(None, 0.0, 0.31), "below 0.31 (95 %)"),
        (reading(None, 0.0, None), "not identifiable"),
    ],
)
def test_a_coefficient_is_written_with_its_interval_or_as_a_bound(
    found: EffectiveFriction, text: str
) -> None:
    assert bounded_text(found) == text


@pytest.mark.parametrize("bound", [0.0999, 0.1001, 0.2451, 0.98765, 1.234, 9.99, 99.6])
def test_a_bound_is_never_rounded_to_the_side_that_claims_more(bound: float) -> None:
    lower = float(bounded_text(reading(None, bound, None)).split()[1])
    upper = float(bounded_text(reading(None, 0.0, bound)).split()[1])
    assert lower <= bound <= upper
    assert upper - lower < 0.11 * bound


def test_tables_fit_in_a_hundred_columns(found: FrictionComparison) -> None:
    assert max(map(len, printed(found).splitlines())) < 100


def test_every_load_has_both_readings_by_both_loadings(found: FrictionComparison) -> None:
    for loading in ("incremental", "total"):
        title = f"Effective friction coefficient, {loading} loading"
        (table,) = (t for t in comparison_tables(found) if t.title.startswith(title))
        of_each = [row for row in table.rows if row[2] != "all"]
        assert len(table.rows) - len(of_each) == 2  # dry and lubricated
        for row, one in zip(of_each, found.loads[loading], strict=True):
            assert row[3:5] == [bounded_text(one.by_maximum), bounded_text(one.by_profile)]


def test_chi_square_stands_for_every_calculated_coefficient(found: FrictionComparison) -> None:
    tables = [t for t in comparison_tables(found) if t.title.startswith("χ² of each profile")]
    heads = [name for table in tables for name in table.head[4:]]
    assert heads == 2 * [f"{mu:g}" for mu in FRICTION]


def test_coefficients_that_do_not_fit_in_one_table_go_on_in_the_next() -> None:
    grid = np.linspace(0.0, 1.0, 30)
    found = comparison(loadings=("total",), friction_grid=grid)
    tables = [t for t in comparison_tables(found) if t.title.startswith("χ² of each profile")]
    assert len(tables) > 1
    assert [name for table in tables for name in table.head[4:]] == [f"{mu:.4g}" for mu in grid]
    assert max(map(len, printed(found).splitlines())) < 100


def test_checks_of_each_profile_are_told_by_the_worst_and_failures_one_by_one() -> None:
    def check(name: str, value: float) -> QualityCheck:
        return QualityCheck(name, value, 1.0, value <= 1.0, "meaning")

    checks = [check("force_1", 0.3), check("noise_1", 0.2), check("force_2", 0.8)]
    table = comparison_tables(comparison(checks=tuple(checks)))[-1]
    assert [row[:2] for row in table.rows] == [("force, worst of 2", "0.8"), ("noise 1", "0.2")]
    failing = comparison_tables(comparison(checks=(*checks, check("force_3", 1.4))))[-1]
    assert [row[0] for row in failing.rows] == ["force 3", "force, worst of 2", "noise 1"]
    assert failing.marked == {0}


def test_what_failed_of_several_profiles_is_told_once_with_their_numbers() -> None:
    failed = [QualityCheck(f"force_{i}", 2.0, 1.0, False, "meaning") for i in (1, 2, 4)]
    alone = QualityCheck("noise_3", 2.0, 1.0, False, "meaning")
    note = memscal.Message("synthetic", "A note.")
    messages = (*failed_check_messages((*failed, alone)), note)
    told = comparison(checks=(*failed, alone), messages=messages)
    assert [str(message) for message in comparison_notes(told)] == [
        "Quality check force_1 failed: 2 exceeds 1. meaning The same of profiles 2, 4.",
        "Quality check noise_3 failed: 2 exceeds 1. meaning",
        "A note.",
    ]


def test_a_wide_gap_between_coefficients_and_a_missing_frictionless_profile_are_told() -> None:
    def notes(*friction: float) -> str:
        return " ".join(map(str, comparison_notes(comparison(friction_grid=np.array(friction)))))

    assert "between the friction coefficients 0 and 0.2" in notes(0.0, 0.2, 0.3, math.inf)
    assert "p0_max is that of friction 0.1" in notes(0.1, 0.2, 0.3, math.inf)
    # Past the friction at which a contact sticks nearly wholly, little changes.
    assert notes(*FRICTION) == notes(0.0, 0.1, 0.2, 0.3, math.inf) == ""


def test_a_bound_has_its_reason_and_no_budget(sticking: FrictionComparison) -> None:
    text = printed(sticking)
    assert "above" in text
    assert "Contributions" not in text
    assert "no_value" in {message.kind for message in comparison_notes(sticking)}


def test_json_says_null_and_why_where_there_is_no_value(sticking: FrictionComparison) -> None:
    for load in as_json(sticking)["loads"]:
        by_loading = load["by_loading"]["incremental"]["effective_friction_coefficient"]
        for found in by_loading.values():
            assert found["value"] is None
            assert found["interval"]["high"] is None
            assert found["interval"]["low"] > 0
            assert "lower bound" in found["reason"]


def test_json_holds_the_numbers_of_the_comparison(found: FrictionComparison) -> None:
    told = as_json(found)
    assert [load["load"]["value"] for load in told["loads"]] == [*LOADS, *LOADS]
    for i, load in enumerate(told["loads"]):
        one = found.loads["total"][i]
        assert load["S_max"]["value"] == pytest.approx(one.s_max * 1e-3)
        assert load["p0_max"]["standard_uncertainty"] == pytest.approx(
            one.p0_max_uncertainty * 1e-3
        )
        assert load["ratio"]["value"] == pytest.approx(one.ratio)
        profiles = load["by_loading"]["total"]["profiles"]
        np.testing.assert_allclose([p["chi2"] for p in profiles], one.chi_square)
        assert profiles[-1]["friction_coefficient"] is None
        assert profiles[-1]["sticking"]
        assert not profiles[0]["sticking"]
    assert {(j["lubrication"], j["loading"]) for j in told["joint"]} == {
        (lubrication, loading)
        for lubrication in ("dry", "lubricated")
        for loading in ("incremental", "total")
    }


def test_json_names_the_files_and_their_digests(found: FrictionComparison) -> None:
    told = as_json(found)
    assert told["artifact"] == {"file_name": "sensor.apparatus.h5", "sha256": "cd" * 32}
    assert [scan["file_name"] for scan in told["scans"]] == ["dry.h5", "lubricated.h5"]
    assert all(len(scan["sha256"]) == 64 for scan in told["scans"])
    assert told["loads"][0]["scan"] == "dry.h5"


def test_a_profile_without_a_stated_lubrication_or_loading_is_named_all_the_same() -> None:
    # Profiles calculated elsewhere need not say how they were loaded.
    found = comparison(lubrications=("",), loadings=("",))
    text = printed(found)
    assert "not stated" in text
    assert "profiles as given" in text
    assert set(as_json(found)["loads"][0]["by_loading"]) == {"given"}


def test_the_macroscopic_coefficient_stands_beside_the_interval(found: FrictionComparison) -> None:
    (table,) = (t for t in comparison_tables(found) if "macroscopic" in t.title)
    assert "1.60 ± 0.20" in table.title
    assert all("above the 95 % interval" in row[2] for row in table.rows)
    none = comparison(macroscopic=None)
    assert not any("macroscopic" in t.title for t in comparison_tables(none))


def test_a_slip_length_has_its_interval_its_unit_and_its_evidence() -> None:
    found = comparison(interface=interface_comparison(1.8e-6))
    text = printed(found)
    assert "1.8 [1.4, 2.3] um" in text
    assert "for it, very strong" in text  # the slip length
    assert "against it, positive" in text  # the normal compliance
    assert max(map(len, text.splitlines())) < 100
    told = as_json(found)["interface"]
    length = told["tangential"]["length"]
    assert (length["value"], length["unit"]) == (pytest.approx(1.8), "um")
    assert length["interval"]["low"] < 1.8 < length["interval"]["high"]
    assert [load["load_n"] for load in told["tangential"]["implied"]] == list(LOADS)
    assert told["normal"]["implied"] is None
    assert set(found.interface.messages) <= set(comparison_notes(found))
