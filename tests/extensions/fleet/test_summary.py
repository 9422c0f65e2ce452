"""Summaries of fleets: outliers from the wafer's trend, tolerances, errors by kind."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from memscal.extensions.fleet.results import Failure, FleetResults, Tolerance
from memscal.extensions.fleet.results_summary import mapping, outliers, verdict
from memscal.extensions.fleet.tolerance import prober_table

NOISE = 0.003


def places(count):
    """Places of the dies nearest to the middle of a wafer, with a pitch of 5 mm."""
    row, column = np.indices((20, 20)).reshape(2, -1)
    nearest = np.argsort(np.hypot(row - 9.5, column - 9.5), kind="stable")[:count]
    return 5.0 * column[nearest], 5.0 * row[nearest]


def wafer(rng, count, **changes):
    """A fleet with a bowl of 5 % over its wafer."""
    x, y = places(count)
    squared = (x - x.mean()) ** 2 + (y - y.mean()) ** 2
    a = 1e-4 * (1 + 0.05 * squared / squared.max() + rng.normal(0, NOISE, count))
    fleet = FleetResults(
        paths=[f"die_{i}.h5" for i in range(count)],
        sensors=[f"W7-{i}" for i in range(count)],
        conversion_constant=a,
        conversion_constant_errors=np.full(count, 1e-7),
        gaussian_sigma=np.full(count, 0.8),
        gaussian_sigma_errors=np.full(count, 0.004),
        wafer_x=x,
        wafer_y=y,
        failed={},
        errors={},
        unit="mV/Pa",
    )
    return replace(fleet, **changes)


@pytest.mark.parametrize("count", [24, 40, 60, 300])
def test_a_bowl_over_the_wafer_hides_no_die_and_alarms_for_none(count):
    rng = np.random.default_rng(count)
    wafers = 150
    alarms = 0
    found = 0
    for _ in range(wafers):
        fleet = wafer(rng, count)
        alarms += bool(outliers(fleet))
        # Inside of the bowl: of all values it is among the middle ones.
        place = count // 2
        a = fleet.conversion_constant.copy()
        a[place] *= 0.97
        found += (
            outliers(replace(fleet, conversion_constant=a)).get(place, "").endswith("the trend")
        )
    assert alarms <= binom.ppf(1 - 1e-3, wafers, 0.02)
    assert found >= (0.9 if count >= 40 else 0.5) * wafers
    about_median = replace(fleet, conversion_constant=a, wafer_x=np.full(count, np.nan))
    assert place not in outliers(about_median)


def test_the_summary_says_from_what_outliers_are_told():
    rng = np.random.default_rng(1)
    assert mapping(wafer(rng, 24))["outliers_from"] == "trend"
    few = wafer(rng, 23)
    assert mapping(few)["outliers_from"] == "median"
    for unit, label in (("mm", "$x$ on the wafer (mm)"), ("die", "column of dies")):
        assert label in [a.get_xlabel() for a in replace(few, place_unit=unit).plot().axes]
    assert "a trend takes 24 calibrated sensors" in str(replace(few, failed={0: ("symmetry",)}))


def test_tolerances_give_yield_bins_and_a_table_for_the_prober():
    a = np.array([1.0, 1.01, 1.029, 1.05, 1.0, np.nan, 0.971, 1.0])
    sigma = np.array([0.8, 0.8, 0.8, 0.7, 0.8, np.nan, 0.9, 0.8])
    fleet = wafer(
        np.random.default_rng(1),
        8,
        conversion_constant=a,
        conversion_constant_errors=np.full(8, 0.001),
        gaussian_sigma=sigma,
        failed={4: ("symmetry",), 5: (), 6: ("symmetry",)},
        errors={5: Failure("FormatError", "No.", "Do.")},
        tolerances={"A": Tolerance(0.03, 1.0), "sigma": Tolerance(0.1, None)},
        wafer_x=np.array([-7.5, -2.5, 2.5, 7.5, -7.5, -2.5, 2.5, np.nan]),
        wafer_y=np.array([3.0, 3.0, 3.0, 3.0, 9.0, 9.0, 9.0, np.nan]),
    )
    rows = list(csv.DictReader(io.StringIO(prober_table(fleet).decode())))
    reasons = ["", "", "", "A and sigma", "check", "error", "sigma and check", ""]
    assert [row["reason"] for row in rows] == reasons
    assert [row["result"] for row in rows] == ["fail" if reason else "pass" for reason in reasons]
    assert [row["column"] for row in rows] == ["-2", "-1", "0", "1", "-2", "-1", "0", ""]
    assert [row["row"] for row in rows[3:]] == ["0", "1", "1", "1", ""]
    found = mapping(fleet)["tolerances"]
    assert found["sensors"]["passed"] == 4
    bins = found["bins"]["A"]
    # 1.029 and 0.971 are within U = 0.002 of a limit.
    assert (bins["within_half"], bins["within"], bins["within_double"]) == (4, 6, 7)
    assert bins["undecided"] == 2
    assert (found["bins"]["sigma"]["centre"], found["bins"]["sigma"]["within"]) == (0.8, 5)
    assert "Yield: 50.0%" in verdict(fleet)


@pytest.mark.parametrize("share", [0.5, 0.9, 0.98])
def test_the_interval_of_the_yield_holds_it(share):
    rng = np.random.default_rng(2)
    held = 0
    for passed in rng.random((200, 60)) < share:
        fleet = wafer(
            rng,
            60,
            conversion_constant=np.where(passed, 1.0, 2.0),
            tolerances={"A": Tolerance(0.1, 1.0)},
        )
        found = mapping(fleet)["tolerances"]["yield"]
        held += found["low"] <= share <= found["high"]
    assert held >= binom.ppf(1e-3, 200, 0.92)  # near 1 it holds less often than 95 %


def test_errors_that_differ_in_names_and_numbers_are_one_kind():
    errors = {
        0: Failure("FormatError", "die_0.h5, line 3: '1,5' is not a number.", "Write a point."),
        1: Failure("FormatError", "die_1.h5, line 20: 'much' is not a number.", "Write a point."),
        2: Failure("InputError", "die_2.h5 is not there. It may be hidden.", "Look."),
    }
    fleet = wafer(np.random.default_rng(1), 30, failed=dict.fromkeys(errors, ()), errors=errors)
    numbers, missing = mapping(fleet)["error_groups"]
    assert (numbers["scans"], numbers["first"], numbers["cure"]) == (
        2,
        "die_0.h5",
        "Write a point.",
    )
    assert missing == {"scans": 1, "first": "die_2.h5", **errors[2]._asdict()}
