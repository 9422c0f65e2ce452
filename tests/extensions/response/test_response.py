"""Gains of waves of pressure: closed forms, the balance of moments, and what noise lets see."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.outside import answers
from helpers.scans import CONVERSION, EXACT_FILM, SIGMA, known_apparatus, simulate
from helpers.schemas import faults

import memscal

WAVELENGTHS = np.array([20e-3, 8e-3, 4e-3, 2e-3])
K = 2 * np.pi / WAVELENGTHS
GAUSSIAN = CONVERSION * np.exp(-((K * SIGMA) ** 2) / 2)
SENSOR = known_apparatus(conversion_uncertainty=0.01)
RATIOS = pytest.mark.parametrize("film", [replace(EXACT_FILM, poisson_ratio=nu) for nu in (0, 0.5)])


#: Readings at rest of a density of 1 V^2/Hz that no frequency changes.
WHITE = SimpleNamespace(corner=0.3, spectral_density=np.ones_like)


def test_without_shear_the_gain_is_that_of_an_incompressible_layer_in_closed_form():
    x = K * EXACT_FILM.thickness
    passed = (np.cosh(x) + x * np.sinh(x)) / (np.cosh(x) ** 2 + x**2)
    seen = memscal.response(SENSOR, WAVELENGTHS)
    np.testing.assert_allclose(seen.gain, GAUSSIAN * passed, rtol=1e-4)


@RATIOS
def test_shear_is_passed_as_an_independent_solution_of_the_layer_has_it(film):
    gain = memscal.response(SENSOR, WAVELENGTHS, film=film, friction=0.5).gain
    by_shear, by_pressure = answers(film.poisson_ratio, K * film.thickness)[1][:, 1].T
    np.testing.assert_allclose(gain.real, GAUSSIAN * by_pressure, rtol=1e-3)
    np.testing.assert_allclose(abs(gain.imag), 0.5 * GAUSSIAN * abs(by_shear), rtol=1e-3)


@RATIOS
def test_long_waves_are_moved_along_the_shear_by_its_moment(film):
    # exp(ik(x - s)): a phase of -ks is a pattern that is moved by s = mu h to larger x.
    [gain] = memscal.response(SENSOR, 2.0, film=film, friction=0.3).gain
    assert -np.angle(gain) / np.pi == pytest.approx(0.3 * film.thickness, rel=1e-3)


def test_a_film_of_its_own_adds_its_thickness_to_what_the_calibration_leaves():
    film = replace(EXACT_FILM, thickness_uncertainty=20e-6)
    seen = memscal.response(SENSOR, WAVELENGTHS, film=film)
    thicker = replace(film, thickness=film.thickness + 2e-6)
    change = 10 * (abs(memscal.response(SENSOR, WAVELENGTHS, film=thicker).gain) - abs(seen.gain))
    expected = np.hypot(0.01 * abs(seen.gain), change)
    np.testing.assert_allclose(seen.uncertainty, expected, rtol=0.02)


def test_the_smallest_stress_is_three_standard_deviations_of_a_fitted_amplitude(seed):
    seen = memscal.response(SENSOR, 4e-3, 2e-3, noise_record=WHITE, length=50e-3)
    times = np.arange(0, 25.0, 0.025)  # in s: 50 mm at 2 mm/s
    noise = np.random.default_rng(seed).normal(0, 20**0.5, (4000, times.size))  # up to 20 Hz
    amplitudes = 2 / times.size * noise @ np.cos(2 * np.pi * seen.frequency * times)
    # Of 4,000 draws a standard deviation is known to 1.1 %.
    assert seen.smallest_stress[0] * abs(seen.gain[0]) == pytest.approx(
        3 * amplitudes.std(), rel=0.06
    )


def test_speeds_make_rows_and_are_drawn_with_the_corner_of_the_drift():
    seen = memscal.response(SENSOR, WAVELENGTHS, [1e-3, 5e-3], noise_record=WHITE, length=20e-3)
    assert seen.frequency.shape == (2, 4)
    assert "Below 0.3 Hz drift" in seen.answer()
    [corner] = [line for line in seen.plot().axes[1].lines if "drift" in line.get_label()]
    np.testing.assert_allclose(corner.get_ydata(), 0.3 * corner.get_xdata())


def test_a_record_tells_no_stress_slower_than_itself_or_faster_than_half_its_rate():
    rest = np.random.default_rng(1).normal(size=6000)  # 120 s at 50 Hz
    record = memscal.Scan(x=0 * rest, u_zz=rest, time=0.02 * np.arange(6000), motion="rest")
    frequencies = np.array([0.99 / 120, 1.01 / 120, 24.9, 25.1])
    seen = memscal.response(SENSOR, 4e-3, 4e-3 * frequencies, noise_record=record, length=50e-3)
    assert np.isfinite(seen.smallest_stress[:, 0]).tolist() == [False, True, True, False]
    stresses = [wave["smallest_stress"]["value"] for wave in seen.to_dict()["waves"]]
    assert [stress is None for stress in stresses] == [True, False, False, True]
    assert "known from 0.00833 to 25 Hz" in seen.answer()
    [rows] = [table.rows for table in seen.tables()]
    assert [(row[1], row[-1] == "-") for row in rows][2:] == [("99.6", False), ("100.4", True)]
    _, panel, bar = seen.plot().axes
    assert "noise known between" in panel.get_legend_handles_labels()[1]
    assert "smallest stress, 3 sigma (Pa)" in bar.get_ylabel()
    aside = memscal.response(SENSOR, 4e-3, 1.0, noise_record=record, length=50e-3)
    assert len(aside.plot().axes) == 1


def test_an_object_that_states_a_band_is_known_within_it_and_another_everywhere():
    banded = SimpleNamespace(**vars(WHITE), band=(0.2, 1.0))
    stresses = [
        memscal.response(SENSOR, 4e-3, 5e-3, noise_record=noise, length=50e-3).smallest_stress
        for noise in (WHITE, banded)
    ]
    assert np.isfinite(stresses).ravel().tolist() == [True, False]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"wavelength": [4e-3, 0.0]}, "wavelength is 0 m"),
        ({"wavelength": []}, "shape"),
        ({"speed": -1.0}, "speed is -1 m/s"),
        ({"length": 0.1, "speed": 1.0}, "one is not given"),
        ({"noise_record": WHITE, "length": 1e-3, "speed": 1.0}, "holds no wave of 8 mm"),
        ({"noise_record": replace(simulate(), unit="A"), "length": 0.1, "speed": 1.0}, "are in A"),
        ({"apparatus": replace(SENSOR, film=None)}, "states no film"),
        (
            {"apparatus": replace(SENSOR, sensor=replace(SENSOR.sensor, channel="xz"))},
            "tangential channel xz",
        ),
    ],
)
def test_what_is_no_wave_or_no_sensor_of_normal_stress_is_refused(arguments, words):
    with pytest.raises(memscal.MemscalError, match=words):
        memscal.response(**({"apparatus": SENSOR, "wavelength": 8e-3} | arguments))


def test_the_command_gives_no_number_to_a_wave_that_is_not_resolved(run, artifact, good_scan):
    line = ("response", artifact, "--wavelength", 8, "--wavelength", 1, "--speed", 2)
    done = run(*line, "--json").exits(0)
    assert faults("response", done.json) == []
    first, second = done.json["waves"]
    [gain, none] = memscal.response(artifact, [8e-3, 1e-3]).gain
    assert first["gain"]["value"] == pytest.approx(1e3 * abs(gain), rel=1e-9)
    assert np.isnan(none)
    assert (second["gain"], second["phase"]["value"], second["resolved"]) == (None, None, False)
    assert second["frequency"] == {"value": 2.0, "unit": "Hz"}
    assert "not resolved" in run(*line).out
    refused = run(*line, "--length", 50, "--noise-record", good_scan).exits(3)
    assert "is no noise record" in refused.err
    assert "above 0 (in mm)" in run("response", artifact, "--wavelength", -1).exits(2).err
