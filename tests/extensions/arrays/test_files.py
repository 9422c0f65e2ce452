"""The array's file: what is stored comes back, other programs read it, and changes are refused."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from helpers.arrays import SIGMA, A, full_array
from helpers.records import assert_same

import memscal
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.errors import FormatError, OutputError
from memscal.formats.inspection import check, describe
from memscal.model.notation import Reading


@pytest.mark.parametrize("own", [False, True])
def test_what_is_stored_comes_back(tmp_path, own):
    array = full_array()
    if own:
        kernels = array.kernels * np.linspace(1.0, 0.9, 6)[:, None]
        array = replace(array, kernel="own", kernels=kernels)
    array.save(tmp_path / "array.h5")
    found = memscal.load_array(tmp_path / "array.h5")
    assert_same(found, array, but=("source",), rtol=1e-14)
    # Units round a number once.
    found.save(tmp_path / "again.h5")
    assert_same(memscal.load_array(tmp_path / "again.h5"), found, but=("source",))
    assert found.source.file_name == "array.h5"


def test_others_find_numbers_with_their_uncertainties_and_units(tmp_path):
    array = full_array(layout=None)
    array.save(tmp_path / "array.h5")
    with h5py.File(tmp_path / "array.h5") as file:
        sensors = file["entry/sensors"]
        assert sensors.attrs["signal"] == "conversion_constant"
        assert sensors["conversion_constant"].attrs["units"] == "mV/Pa"
        assert sensors["conversion_constant"][0] == pytest.approx(1e3 * A)
        # The load's and the others' shares, added by hand.
        columns = np.column_stack([array.root, *array.effects.values()])
        errors = 1e3 * A * np.sqrt(np.sum(columns[0] ** 2))
        assert sensors["conversion_constant_errors"][0] == pytest.approx(errors)
        assert np.isnan(sensors["conversion_constant"][5])
        assert sensors["used"][:].tolist() == [1, 1, 1, 1, 1, 0]
        # A mode that widens G by one part in one has the width's uncertainty.
        both = columns[-2] + columns[-1] / 2
        widths = sensors["gaussian_sigma_errors"][:2] / (1e3 * SIGMA)
        assert widths == pytest.approx([np.linalg.norm(both), np.linalg.norm(columns[-2])])
        crosstalk = file["entry/crosstalk"]
        row, column = array.pairs[3]
        error = np.linalg.norm(columns[18 + 3])
        assert crosstalk["c_errors"][row, column] == pytest.approx(error)
        assert crosstalk["c_errors"][0, 0] == 0.0
        r, g = file["entry/kernel/r"][:], file["entry/kernel/g"][0]
        expected = 1e-6 * unit_gaussian(1e-3 * r, SIGMA)
        np.testing.assert_allclose(g, expected, atol=1e-6 * expected[0])


def test_readings_in_other_units_keep_them(tmp_path):
    for reading in (Reading("1", 0), Reading("T", -6)):
        array = replace(full_array(), reading=reading)
        array.save(tmp_path / f"{reading.si}.h5")
        found = memscal.load_array(tmp_path / f"{reading.si}.h5")
        assert found.reading == reading
        np.testing.assert_allclose(found.noise, array.noise, rtol=1e-12)
        np.testing.assert_allclose(found.baseline_uncertainties, 1e-5, rtol=1e-14)


def test_a_changed_file_is_refused_or_accepted_on_record(tmp_path):
    path = tmp_path / "array.h5"
    full_array().save(path)
    assert all(finding.passed for finding in check(path))
    assert describe(path)["checks"][0]["name"] == "dead_taxels"
    with pytest.raises(OutputError, match="exists"):
        full_array().save(path)
    with h5py.File(path, "a") as file:
        file["entry/crosstalk/c"][0, 1] = 0.5
    assert [finding.passed for finding in check(path)] == [True, True, False]
    with pytest.raises(FormatError, match="changed after it was written"):
        memscal.load_array(path)
    found = memscal.load_array(path, accept_altered=True)
    assert found.crosstalk[0, 1] == 0.5
    assert "digest" in found.source.altered


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("kernel/k", np.nan, "kernels or roots are not finite"),
        ("kernel/k", 1e9, "do not increase"),
        ("kernel/transfer", np.nan, "kernels or roots are not finite"),
        ("kernel/transfer", 0.0, "G does not integrate to 1"),
        ("roots/of_ln_a", np.nan, "kernels or roots are not finite"),
        ("kernel/changes", np.nan, "kernels or roots are not finite"),
        ("kernel/reference", np.nan, "kernels or roots are not finite"),
        ("kernel/owner", 9, "a mode has no sensor"),
        ("sensors/centre_x", np.nan, "centres are not known"),
        ("sensors/line_y", np.nan, "centres are not known"),
        ("sensors/used", np.nan, "no sensor is used"),
        ("sensors/conversion_constant", -1e-7, "not finite and above zero"),
        ("sensors/conversion_constant", np.nan, "not finite and above zero"),
        ("crosstalk/estimated", np.nan, "roots are of other pairs"),
        ("crosstalk/c", np.nan, "crosstalk is not finite"),
        ("crosstalk/c", 2.0, "not 1 of a sensor with itself"),
        ("noise/correlation", 5.0, "no covariance"),
        ("noise/deviation", np.inf, "no covariance"),
        ("noise/deviation", 0.0, "no covariance"),
    ],
)
def test_an_altered_file_with_numbers_of_no_calibration_is_refused(path, value, words, tmp_path):
    file = tmp_path / "array.h5"
    full_array().save(file)
    with h5py.File(file, "a") as altered:
        whole = path in ("sensors/used", "sensors/line_y", "crosstalk/estimated")
        altered[f"entry/{path}"][() if whole else (..., 0)] = value
    with pytest.raises(FormatError, match=words):
        memscal.load_array(file, accept_altered=True)


def test_a_mode_that_the_roots_lack_is_refused(tmp_path):
    file = tmp_path / "array.h5"
    full_array().save(file)
    with h5py.File(file, "a") as altered:
        short = altered["entry/roots/of_mode"][:-1]
        attributes = dict(altered["entry/roots/of_mode"].attrs)
        del altered["entry/roots/of_mode"]
        altered["entry/roots/of_mode"] = short
        altered["entry/roots/of_mode"].attrs.update(attributes)
    with pytest.raises(FormatError, match="other pairs or modes"):
        memscal.load_array(file, accept_altered=True)


def test_sensors_of_one_name_or_place_are_refused(tmp_path):
    array = full_array()
    for name, change in {
        "name": {"sensors": (array.sensors[0],) * len(array.sensors)},
        "place": {"centres": array.centres[:1] + 0 * array.centres},
    }.items():
        replace(array, **change).save(tmp_path / f"{name}.h5")
        with pytest.raises(FormatError, match=name):
            memscal.load_array(tmp_path / f"{name}.h5")


def test_half_a_layout_is_none(tmp_path):
    full_array().save(tmp_path / "array.h5")
    with h5py.File(tmp_path / "array.h5", "a") as altered:
        del altered["entry/sensors/layout_y"]
    assert memscal.load_array(tmp_path / "array.h5", accept_altered=True).layout is None


def test_a_raster_of_many_sensors_stays_small(tmp_path):
    full_array(8, 8, points=4225).save(tmp_path / "array.h5")
    # Three arrays of 64 x 4225 readings, of which noise does not shrink.
    assert (tmp_path / "array.h5").stat().st_size < 8e6
    assert memscal.load_array(tmp_path / "array.h5").readings.u.shape == (64, 4225)
