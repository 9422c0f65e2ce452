"""What is told and drawn of an array: mapping, answer, tables, figure and page."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers.arrays import A, full_array
from helpers.schemas import faults

from memscal.model.checks import QualityCheck
from memscal.model.notation import Reading


def identified(*, passed):
    """Return the check whether crosstalk is known, and which sensors fail it."""
    check = QualityCheck("crosstalk_identified", 0.02, 0.005, passed, "Crosstalk or shape?")
    return {"checks": (check,), "failing": {check.name: () if passed else ("T00", "T01")}}


def test_json_has_one_entry_a_sensor_with_its_total_uncertainty():
    array = full_array(crosstalk=np.eye(6) + 0.01 * full_array().estimated)
    told = array.to_dict()
    assert faults("calibrate", json.loads(json.dumps(told))) == []
    a = told["conversion_constant"]
    assert a["unit"] == "mV/Pa"
    assert a["value"] == pytest.approx([1e3 * A] * 5 + [None])
    errors = 1e3 * np.sqrt(np.diag(array.covariance))[:5]
    assert a["standard_uncertainty"][:5] == pytest.approx(errors)
    assert a["standard_uncertainty"][5] is None
    assert told["used"] == [True] * 5 + [False]
    assert told["centre_x"]["value"] == pytest.approx(1e3 * array.centres[:, 0])
    crosstalk = told["crosstalk"]
    assert crosstalk["value"][0][:2] == [1.0, 0.01]
    assert crosstalk["standard_uncertainty"][0][0] == crosstalk["standard_uncertainty"][0][5] == 0
    assert told["estimated"] == array.estimated.tolist()
    assert [check["sensors"] for check in told["checks"]] == [["T05"]]


def test_what_a_line_does_not_tell_is_null():
    array = full_array(1, 3)
    assert array.to_dict()["centre_y"]["value"] == [None, None, None]
    assert "centre y" not in array.summary()


@pytest.mark.parametrize("passed", [True, False])
def test_crosstalk_is_printed_only_where_it_is_identified(passed):
    array = full_array(**identified(passed=passed))
    text = " ".join(array.summary().split())
    assert ("reads of (%)" in text) == passed
    assert ("Crosstalk is not identified" in text) != passed
    assert array.to_dict()["crosstalk"]["value"][0][1] == pytest.approx(0.01)
    if not passed:
        assert "by the readings alone is 2 %, of at most 0.5 %," in text
        assert "1 thicknesses of the film" in text
        assert "raster, or take a thinner film" in text
        assert "What fails crosstalk identified: T00, T01." in text


def test_the_first_lines_say_how_many_work_and_how_well_they_are_known():
    array = full_array()
    first, second, *_ = array.answer().splitlines()
    assert first == "5 of 6 sensors are used; left out: T05."
    assert "mV/Pa at the median" in second
    assert "(V/Pa)" not in replace(array, reading=Reading("1", 0)).summary()


def test_all_arrays_and_correlated_numbers_are_there_in_si_units():
    array = full_array()
    dataset = array.to_xarray()
    assert dataset["conversion_constant"].attrs["units"] == "V/Pa"
    assert dataset["u_zz"].dims == ("sensor", "point")
    assert float(dataset["centre_x"].sel(sensor="T01")) == array.centres[1, 0]


def test_a_row_along_neither_x_nor_y_has_a_figure_without_the_map_of_the_bound():
    array = full_array(1, 3)
    slanted = replace(array, centres=array.places[:, :1] * [1.0, 1.0])
    labels = [axes.get_label() for axes in slanted.plot().axes]
    assert labels[:5] == list("abcdg")


@pytest.mark.parametrize("size", [(1, 3), (4, 5)])
def test_figure_and_page_show_the_array(tmp_path, size):
    array = full_array(*size, **identified(passed=size[0] == 1))
    figure = array.plot()
    labels = [axes.get_label() for axes in figure.axes]
    assert labels[:7] == list("abcdefg")
    ticks = [[tick.get_text() for tick in figure.axes[i].get_xticklabels()] for i in (1, 6)]
    assert (ticks == 2 * [list(array.sensors)]) == (size == (1, 3))
    crosstalk = figure.axes[1].images[0].get_array()
    # All grey where it is not identified; only pairs that were estimated elsewhere.
    shown = np.isfinite(np.ma.filled(crosstalk, np.nan))
    assert (shown == (array.estimated & (size[0] == 1))).all()
    assert [axes.get_label() for axes in array.plot(panels="c").axes] == ["c"]
    page = array.report(tmp_path / "array.html")
    assert "crosstalk identified" in page
    assert page.count("<img") == 1
