"""Gains of waves of pressure: closed forms, the balance of moments, and what noise lets see."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.outside import answers
from helpers.scans import CONVERSION, EXACT_FILM, SIGMA, known_apparatus
from helpers.schemas import faults

import memscal

WAVELENGTHS = np.array([20e-3, 8e-3, 4e-3, 2e-3])
K = 2 * np.pi / WAVELENGTHS
GAUSSIAN = CONVERSION * np.exp(-((K * SIGMA) ** 2) / 2)
OTHER = replace(EXACT_FILM, name="another", thickness_uncertainty=20e-6)


class White:
    """Readings at rest of a density (V^2/Hz) that no frequency changes."""

    corner = 0.3
    density = 1e-13

    def spectral_density(self, frequency):
        return np.full_like(frequency, self.density)


@pytest.fixture(scope="module")
def sensor():
    return known_apparatus()


def test_without_shear_the_gain_is_that_of_an_incompressible_layer_in_closed_form(sensor):
    x = K * EXACT_FILM.thickness
    passed = (np.cosh(x) + x * np.sinh(x)) / (np.cosh(x) ** 2 + x**2)
    seen = memscal.response(sensor, WAVELENGTHS)
    np.testing.assert_allclose(seen.gain, GAUSSIAN * passed, rtol=1e-4)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.5])
def test_shear_is_passed_as_an_independent_solution_of_the_layer_has_it(sensor, ratio):
    film = replace(EXACT_FILM, poisson_ratio=ratio)
    gain = memscal.response(sensor, WAVELENGTHS, film=film, friction=0.5).gain
    _, base = answers(ratio, K * film.thickness)
    np.testing.assert_allclose(gain.real, GAUSSIAN * base[:, 1, 1], rtol=1e-3)
    np.testing.assert_allclose(abs(gain.imag), 0.5 * GAUSSIAN * abs(base[:, 1, 0]), rtol=1e-3)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("friction", [0.3, -0.3])
def test_long_waves_are_moved_along_the_shear_by_its_moment(sensor, ratio, friction):
    # exp(ik(x - s)): a phase of -ks is a pattern that is moved by s = mu h to larger x.
    film = replace(EXACT_FILM, poisson_ratio=ratio)
    seen = memscal.response(sensor, 2.0, film=film, friction=friction)
    moved = -np.angle(seen.gain[0]) * 2.0 / (2 * np.pi)
    assert moved == pytest.approx(friction * film.thickness, rel=1e-3)


def test_a_wave_that_is_not_resolved_has_no_number(sensor, run, artifact):
    limit = 2 * np.pi / sensor.resolved_wavenumber
    seen = memscal.response(sensor, [1.001 * limit, 0.999 * limit, 1e-9])
    assert seen.resolved.tolist() == [True, False, False]
    assert np.isfinite(seen.gain).tolist() == np.isfinite(seen.uncertainty).tolist()
    assert np.isfinite(seen.gain).tolist() == [True, False, False]
    done = run("response", artifact, "--wavelength", 8, "--wavelength", 1, "--speed", 2, "--json")
    assert faults("response", done.exits(0).json) == []
    first, second = done.json["waves"]
    assert first["gain"]["value"] == pytest.approx(1e3 * abs(seen_at(8e-3)), rel=1e-9)
    assert (second["gain"], second["phase"]["value"], second["resolved"]) == (None, None, False)
    assert second["frequency"] == {"value": 2.0, "unit": "Hz"}
    assert "not resolved" in run("response", artifact, "--wavelength", 1).exits(0).out


def seen_at(wavelength):
    return memscal.response(known_apparatus(), wavelength).gain[0]


def test_a_film_of_its_own_adds_its_thickness_to_what_the_calibration_leaves(sensor):
    known = known_apparatus(conversion_uncertainty=0.01)
    seen = memscal.response(known, WAVELENGTHS, film=OTHER)
    thicker = replace(OTHER, thickness=OTHER.thickness + 2e-6)
    slope = 10 * (abs(memscal.response(known, WAVELENGTHS, film=thicker).gain) - abs(seen.gain))
    expected = np.hypot(0.01 * abs(seen.gain), slope)
    np.testing.assert_allclose(seen.uncertainty, expected, rtol=0.02)


def test_the_smallest_stress_is_three_standard_deviations_of_a_fitted_amplitude(sensor, seed):
    speed, length, rate = 2e-3, 50e-3, 40.0
    seen = memscal.response(sensor, 4e-3, speed, noise_record=White(), length=length)
    times = np.arange(0, length / speed, 1 / rate)
    wave = np.exp(-2j * np.pi * seen.frequency[0] * times)
    noise = np.random.default_rng(seed).normal(
        0, np.sqrt(White.density * rate / 2), (4000, times.size)
    )
    amplitudes = (2 / times.size * noise @ wave).real
    stress = 3 * amplitudes.std() / abs(seen.gain[0])
    # Of 4,000 draws a standard deviation is known to 1.1 %.
    assert seen.smallest_stress[0] == pytest.approx(stress, rel=0.06)


def test_speeds_make_rows_and_are_drawn_with_the_corner_of_the_drift(sensor):
    speeds = [1e-3, 5e-3]
    seen = memscal.response(sensor, WAVELENGTHS, speeds, noise_record=White(), length=20e-3)
    np.testing.assert_allclose(seen.frequency, np.outer(speeds, 1 / WAVELENGTHS))
    assert seen.smallest_stress.shape == (2, 4)
    assert len(list(seen.waves)) == 8
    assert "Below 0.3 Hz drift" in seen.answer()
    _, panel = seen.plot().axes
    [corner] = [line for line in panel.lines if "drift" in line.get_label()]
    np.testing.assert_allclose(corner.get_ydata(), 0.3 * corner.get_xdata())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"wavelength": [4e-3, 0.0]}, "wavelength is 0 m"),
        ({"wavelength": -1e-3}, "wavelength is -0.001 m"),
        ({"wavelength": []}, "shape"),
        ({"speed": -1.0}, "speed is -1 m/s"),
        ({"friction": np.inf}, "friction is inf"),
        ({"length": 0.1, "speed": 1.0}, "one is not given"),
        ({"noise_record": White(), "length": 0.1}, "one is not given"),
        ({"noise_record": White(), "length": 1e-3, "speed": 1.0}, "holds no wave of 8 mm"),
        ({"noise_record": object(), "length": 0.1, "speed": 1.0}, "noise record is needed"),
    ],
)
def test_what_is_no_wave_is_refused(sensor, arguments, words):
    with pytest.raises(memscal.MemscalError, match=words):
        memscal.response(sensor, **({"wavelength": 8e-3} | arguments))


def test_a_sensor_without_a_film_or_a_normal_stress_is_refused(sensor):
    with pytest.raises(memscal.MemscalError, match="states no film"):
        memscal.response(replace(sensor, film=None), 8e-3)
    shear = replace(sensor.sensor, channel="xz")
    with pytest.raises(memscal.MemscalError, match="tangential channel xz"):
        memscal.response(replace(sensor, sensor=shear), 8e-3)


def test_the_command_draws_and_refuses_a_scan_in_place_of_a_noise_record(run, artifact, good_scan):
    run("response", artifact, "--wavelength", 8, "--figure", "gain.png").exits(0)
    assert artifact.with_name("gain.png").stat().st_size > 10_000
    refused = run(
        "response",
        artifact,
        "--wavelength",
        8,
        "--speed",
        1,
        "--length",
        50,
        "--noise-record",
        good_scan,
    )
    assert "noise record is needed" in refused.exits(3).err
    assert "above 0 (in mm)" in run("response", artifact, "--wavelength", -1).exits(2).err
