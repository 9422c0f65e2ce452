"""``memscal history``: what calibrations share, the tests, and the next date."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.schemas import faults
from scipy import stats

import memscal
from memscal.errors import InputError
from memscal.extensions.history.changes import exceeded_after, fitted
from memscal.extensions.history.shared import covariances
from memscal.model.instrument import Equipment, LoadCell

CELL = LoadCell(serial_number="7", certificate="C1")
DATES = [f"{2020 + i // 2}-{1 + 6 * (i % 2):02}-01" for i in range(8)]


@pytest.fixture(scope="module")
def first():
    """One calibration whose film, rod, load cell and stage are named."""
    scan = memscal.simulate(seed=3)
    named = replace(
        scan,
        film=replace(scan.film, name="F1"),
        indenter=replace(scan.indenter, name="R1"),
        sensor=replace(scan.sensor, serial_number="S7"),
        load_cell=CELL,
        stage=Equipment(serial_number="3", certificate="Z1"),
        start_time=DATES[0],
    )
    return memscal.calibrate(named).apparatus


def later(apparatus, date, change=0.0, **changes):
    """Return a calibration of another date, of which A differs by a relative change."""
    parameters = apparatus.parameters
    values = parameters.values.copy()
    values[parameters.names.index("conversion_constant")] *= np.exp(change)
    return replace(
        apparatus, start_time=date, parameters=replace(parameters, values=values), **changes
    )


def dated(first, steps):
    return [later(first, date, step) for date, step in zip(DATES, steps, strict=False)]


def test_what_is_shared_cancels_and_noise_remains(first):
    found = memscal.history(dated(first, [0.0, 0.01]))
    noise = first.budget["conversion_constant"]["noise"] / first.conversion_constant
    z = 0.01 / (2**0.5 * noise)
    of_a = next(t for t in found.tests if (t["test"], t["quantity"]) == ("newest", "A"))
    assert of_a["statistic"] == pytest.approx(z, rel=1e-6)
    assert of_a["p"] == pytest.approx(min(2 * stats.norm.sf(z) / 0.4, 1.0), rel=1e-3)
    assert found.next_date is None
    assert "four dates" in found.summary()


@pytest.mark.parametrize(
    ("change", "source"),
    [
        ({"load_cell": replace(CELL, certificate="C2")}, "load"),
        ({"load_cell": LoadCell(serial_number="7")}, "load"),
    ],
)
def test_a_load_cell_of_another_certificate_is_another_one(first, change, source):
    same = [first, later(first, DATES[1])]
    other = [first, later(first, DATES[1], **change)]
    k = np.zeros(0)
    cancelled = covariances(same, k)[0, 0] - covariances(other, k)[0, 0]
    effect = first.shared_effects[source][0] ** 2
    np.testing.assert_allclose(cancelled, effect * np.array([[0, 1], [1, 0]]), atol=1e-12)


def test_what_is_not_named_or_not_stated_cancels_nothing_and_that_is_said(first):
    relative = first.parameters.uncertainty("conversion_constant") / first.conversion_constant
    old = [later(first, date, shared_effects={}) for date in DATES[:2]]
    found = memscal.history(old)
    np.testing.assert_allclose(found.covariances[0], relative**2 * np.eye(2), atol=1e-12)
    assert "older than version 1.2" in found.messages[0].text
    bare = replace(first.film, name="")
    found = memscal.history([later(first, date, film=bare) for date in DATES[:2]])
    assert any("--film-name" in message.text for message in found.messages)
    effects = first.shared_effects
    kept = sum(effects[name][0] ** 2 for name in ("load", "rod_radius", "baseline_curvature"))
    assert found.covariances[0][0, 1] == pytest.approx(kept, rel=1e-6)


def test_an_estimated_scatter_gives_the_t_test_of_two_means():
    rng = np.random.default_rng(5)
    values = rng.normal(size=(12, 400))
    group = np.arange(12) >= 5
    exact = 1e-8 * np.eye(12)
    # The scatter is far above what is stated: it is found on a grid of 14 sizes.
    found = fitted(1e-3 * values, np.ones((12, 1)), group, exact)
    expected = stats.ttest_ind(values[group], values[~group]).statistic
    assert np.median(found.statistic / np.abs(expected)) == pytest.approx(1.0, abs=0.15)
    assert found.degrees == pytest.approx(10, rel=0.3)


def test_a_change_of_known_slope_exceeds_the_tolerance_where_the_line_does():
    years = np.arange(9.0)
    base = np.ones((9, 1))
    history = 0.01 * years[:, None]
    covariance = 1e-12 * np.eye(9)
    assert exceeded_after(history, base, covariance, years, 0.03) == pytest.approx(3.0, rel=0.01)
    # It does not look ahead farther than the history looks back.
    assert exceeded_after(0 * history, base, covariance, years, 0.03) == 8.0


def test_a_repair_begins_a_segment_which_alone_is_tested(first):
    apparatuses = dated(first, [0, 0, 0, 0, 0.05, 0.05, 0.05, 0.05])
    assert memscal.history(apparatuses).changed
    found = memscal.history(apparatuses[::-1], repairs=["2021-09-15"])
    assert not found.changed
    assert found.segment == (0, 0, 0, 0, 1, 1, 1, 1)
    assert found.repairs[0]["change"]["value"] == pytest.approx(0.05)
    assert found.next_date > DATES[-1]


def test_a_temperature_that_explains_a_change_is_none_of_the_sensor(first):
    warm = np.array([0.0, 6, 0, 6, 0, 6, 0, 6])
    apparatuses = [
        later(first, date, -0.004 * t, sensor=replace(first.sensor, temperature=293.15 + t))
        for date, t in zip(DATES, warm, strict=True)
    ]
    found = memscal.history(apparatuses)
    assert found.temperature["value"] == pytest.approx(-0.004, rel=1e-6)
    assert not found.changed
    assert not memscal.history(dated(first, 0 * warm)).temperature


def test_artifacts_of_one_day_are_compared_pair_by_pair(first):
    pair = [later(first, f"2026-01-01T{i:02}:00:00", 0.02 * i) for i in range(2)]
    found = memscal.history(pair).to_dict()
    noise = first.budget["conversion_constant"]["noise"] / first.conversion_constant
    assert found["pairs"][0]["en"] == pytest.approx(0.02 / (2 * 2**0.5 * noise), rel=1e-6)
    assert found["trend"] is None


def test_a_tolerance_below_the_uncertainty_is_due_now(first):
    history = dated(first, [0.0, 0.03, -0.03, 0.0])
    found = memscal.history(history, tolerance=1e-5)
    assert found.next_date == "2021-07-02"
    assert "due now" in found.answer()
    far = memscal.history(history, tolerance=10.0)
    assert far.next_date == "2022-12-30"
    assert "for a tolerance of 1000 % of A. It is as far ahead" in far.answer()


def test_a_next_date_takes_four_days_since_the_last_repair(first):
    days = [f"2024-0{1 + i // 2}-01T{i:02}:00:00" for i in range(4)]
    found = memscal.history([later(first, day, 0.001 * i) for i, day in enumerate(days)])
    assert found.next_date is None
    assert "four dates" in found.answer()


def test_what_is_not_tested_since_a_repair_is_not_said_to_be_stable(first):
    history = dated(first, [0, 0, 0.01, 0, 0.01])
    told = memscal.history(history, repairs=["2020-09-01"]).answer()
    assert "No change seen in 3 calibrations from 2021-01-01 to 2022-01-01" in told
    for repair, count in (("2021-09-01", 1), ("2030-01-01", 0)):
        found = memscal.history(history, repairs=[repair])
        assert found.changes == []
        assert found.next_date is None
        assert (
            f"Nothing is tested: that takes two calibrations since the last repair, not {count}"
            in (found.answer())
        )
        assert found.plot().axes


def test_times_are_compared_in_utc(first):
    times = ["2025-01-01T00:30+02:00", "2024-12-31T23:00Z"]
    found = memscal.history([later(first, time, 0.01 * i) for i, time in enumerate(times)])
    assert found.of_one_date
    assert found.times == tuple(times)
    assert "2 calibrations of 2024-12-31" in found.answer()


def test_artifacts_without_a_serial_number_are_of_the_same_sensor_by_their_name(first):
    bare = replace(first.sensor, serial_number="")
    found = memscal.history([first, later(first, DATES[1], sensor=bare)])
    assert "1 of 2 calibrations state no serial number" in found.messages[0].text
    other = later(first, DATES[1], sensor=replace(bare, name="another"))
    with pytest.raises(InputError, match="names: a simulated sensor, another"):
        memscal.history([first, other])


def test_a_step_is_said_with_its_size_and_its_dates(first):
    found = memscal.history(dated(first, np.log([1, 1, 1, 1, 0.9, 0.9, 0.9, 0.9])))
    change = next(change for change in found.changes if change["test"] == "change_point")
    assert change["between"] == ["2021-07-01", "2022-01-01"]
    assert np.exp(change["value"]) == pytest.approx(0.9)
    told = found.answer()
    assert " fell by (10.0" in told
    assert "between 2021-07-01 and 2022-01-01" in told
    wild = memscal.history(dated(first, [0.0, 0.3, -0.3])).answer()
    assert "a step of A of over 100 % would" in wild


def test_the_figure_of_one_date_names_each_artifact(first):
    times = [f"2025-05-01T{hour}:00:00" for hour in (10, 11)]
    found = memscal.history([later(first, time) for time in times])
    assert [text.get_text() for text in found.plot().axes[0].get_xticklabels()] == times


def test_wrong_histories_are_refused(first):
    with pytest.raises(InputError, match="two or more"):
        memscal.history([first])
    with pytest.raises(InputError, match="start-time"):
        memscal.history([first, later(first, "")])
    with pytest.raises(InputError, match="no date"):
        memscal.history([first, later(first, "yesterday")])
    other = later(first, DATES[1], sensor=replace(first.sensor, serial_number="S8"))
    with pytest.raises(InputError, match="different sensors: S7, S8"):
        memscal.history([first, other])
    with pytest.raises(InputError, match="tolerance"):
        memscal.history([first, first], tolerance=0.0)
    with pytest.raises(InputError, match="given twice"):
        memscal.history([first, later(first, DATES[1]), first])
    with pytest.raises(InputError, match="1900 to 2999"):
        memscal.history([first, later(first, "9999-12-31")])


def test_the_command_writes_its_page_and_ends_with_one_where_the_sensor_changed(run, folder, first):
    names = []
    for i, apparatus in enumerate(dated(first, [0, 0, 0, 0, 0.05, 0.05, 0.05, 0.05])):
        names.append(f"{i}.h5")
        apparatus.save(names[-1])
    done = run("history", *names, "-o", "h.html", "--figure", "h.png", "--json").exits(1)
    assert faults("history", done.json) == []
    assert [change["test"] for change in done.json["changes"]] == [
        "newest",
        "homogeneity",
        "change_point",
        "trend",
    ]
    assert done.json["trend"]["unit"] == "1/yr"
    page = (folder / "h.html").read_text(encoding="utf-8")
    assert "data:image/svg+xml" in page
    assert 'src="http' not in page
    assert "<script" not in page
    told = run("history", *names[:4]).exits(0).out
    assert "No change seen in 4 calibrations" in told
    run("history", *names, "--tolerance", "A=2").exits(2, "A=2%")
    run("history", *names, "--repair", "soon").exits(3, "soon")
