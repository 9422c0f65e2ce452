"""Arrays of measured fields: magnetic dipoles, whose fields change sign, located without a film."""

import numpy as np
import pytest

import memscal

NAMES = tuple(f"B{i}" for i in range(5))
PLACES = 1e-3 * np.array([[0, 0], [8, 0], [-8, 0], [0, 8], [0, -8]])
STEP = 1e-3
NOISE = 3e-7  # T


def fields(at):
    """Fields of a dipole under each press, in T: positive above it, negative around it."""
    r = np.linalg.norm(at[:, None] - PLACES, axis=-1) / 7e-3
    return 1e-4 * (2 - r**2) / (1 + r**2) ** 2.5


def raster(rng, repeats=4, offset=0.0, dead=None, missing=None):
    axis = STEP * np.arange(-12, 13)
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
    at = np.tile(np.stack([x, y], axis=1), (repeats, 1))
    u = fields(at) + NOISE * rng.normal(size=(len(at), 5))
    u += offset
    if dead is not None:
        u[:, 2] = dead * rng.normal(size=len(u))
    if missing is not None:
        u[missing, 3] = np.nan
    repeat = np.repeat(np.arange(repeats), x.size)
    return memscal.Scan(sensors=NAMES, x=at[:, 0], y=at[:, 1], u_zz=u.T, repeat=repeat, unit="T")


@pytest.fixture
def rng(seed):
    return np.random.default_rng(seed)


@pytest.fixture
def array(rng):
    return memscal.calibrate_array(raster(rng), kernel="measured").array


def test_fields_that_change_sign_place_presses_of_other_sizes(array, rng):
    places = rng.uniform(-10e-3, 10e-3, (300, 2))
    sizes = rng.uniform(0.5, 2.0, 300)
    u = sizes[:, None] * fields(places) + NOISE * rng.normal(size=(300, 5))
    found = array.locate(u)
    error = np.stack([found.x, found.y, found.force], axis=1) - np.column_stack([places, sizes])
    z = error / found.uncertainties
    assert np.median(np.hypot(*error[:, :2].T)) < 0.3e-3
    # Of a normal distribution half of all lie within 0.67; of 300 this is known to 0.06.
    assert np.all(abs(np.median(abs(z), axis=0) - 0.674) < 0.25)
    assert found.unit == "1"
    assert "presses like those of the scan" in found.answer()


def test_a_place_that_fields_do_not_tell_from_another_is_ambiguous(array, rng):
    """Without the sensors above and below the line y = 0 its two sides are alike."""
    places = rng.uniform(3e-3, 8e-3, (50, 2))
    u = fields(places)
    assert set(array.locate(u).flags) == {""}
    u[:, 3:] = np.nan
    found = array.locate(u)
    beside = abs(found.y - places[:, 1]) > 3e-3
    ambiguous = np.array(["ambiguous" in flag for flag in found.flags])
    assert np.mean(ambiguous[beside]) >= 0.9


def test_the_map_of_the_bound_shows_the_sensors(array):
    """It showed corners of the raster."""
    drawn = array.plot().axes[0].lines[0].get_xydata()
    np.testing.assert_allclose(1e-3 * drawn, PLACES, atol=1.5 * STEP)


def test_the_maps_are_smoother_than_the_readings(rng):
    """By one raster the share of the scatter that is left is known to 0.03 only."""
    squares = []
    for _ in range(8):
        array = memscal.calibrate_array(raster(rng), kernel="measured").array
        readings = array.readings
        true = fields(np.stack([readings.x, readings.y], axis=1)).T
        errors = [readings.predicted - true, readings.u - true]
        squares.append([*np.mean(np.square(errors), axis=(1, 2)), np.mean(array.root[:5]) ** 2])
    smoothed, read, stated = np.sqrt(np.mean(squares, axis=0))
    assert smoothed < 0.8 * read
    # What is stated of the maps is their error.
    assert smoothed == pytest.approx(stated, rel=0.5)


def test_such_an_array_is_kept_in_a_file_and_drawn(array, tmp_path):
    array.save(tmp_path / "skin.h5")
    again = memscal.load_array(tmp_path / "skin.h5")
    np.testing.assert_allclose(again.readings.predicted, array.readings.predicted)
    assert again.film is None
    u = fields(np.array([[2e-3, 1e-3]]))
    np.testing.assert_allclose(again.locate(u).x, array.locate(u).x)
    assert len(array.plot().axes) == 4
    assert "5 sensors" in str(array)


@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_a_dead_sensor_is_left_out_and_named(noise, rng, tmp_path):
    array = memscal.calibrate_array(raster(rng, dead=noise), kernel="measured").array
    assert array.used.tolist() == [True, True, False, True, True]
    assert "left out: B2" in str(array)
    places = np.array([[2e-3, 1e-3], [-3e-3, 4e-3]])
    u = fields(places)
    u[:, 2] = 1.0
    array.save(tmp_path / "skin.h5")
    found = memscal.load_array(tmp_path / "skin.h5").locate(u)
    # Near the dead sensor the others tell a place to 0.2 mm only.
    assert np.all(found.uncertainties[:, :2] < 0.25e-3)
    error = np.stack([found.x, found.y], axis=1) - places
    assert np.all(abs(error) < 4 * found.uncertainties[:, :2])
    assert found.flags == ("", "")


def test_presses_with_a_missing_reading_are_left_out(rng):
    scan = raster(rng, missing=slice(0, None, 7))
    array = memscal.calibrate_array(scan, kernel="measured").array
    found = array.locate(fields(np.array([[2e-3, 1e-3]])))
    np.testing.assert_allclose(found.x, 2e-3, atol=0.1e-3)
    assert not array.messages


def test_an_offset_of_the_readings_is_said(rng):
    """Taken for the field it made a press of 2 units a misfit of 1."""
    calibration = memscal.calibrate_array(raster(rng, offset=1e-4), kernel="measured")
    [message] = calibration.array.messages
    assert "tare B0, B1, B2, B3, B4" in message.text
    assert "Not zero around the raster" in str(calibration)


def test_a_raster_without_repeats_is_refused(rng):
    with pytest.raises(memscal.MemscalError, match="two times"):
        memscal.calibrate_array(raster(rng, repeats=1), kernel="measured")
