"""Calibrations with readings of any unit, and with a reference in place of film, rod and load."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import simulate

import memscal
from memscal import read_scan, write_scan
from memscal.errors import InputError

pytestmark = pytest.mark.usefixtures("folder")

FILM = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, law="linear")
ROD = memscal.Rod(radius=0.25e-3)
SCAN = replace(simulate(film=FILM, noise=0.005, seed=1), synthetic=None)
TABLE = memscal.indent(FILM, ROD, load=1.0).profile()
BARE = replace(TABLE, film=None, indenter=None, depth=None, contact_radius=None)


def scaled(factor, unit):
    """Return the scan with readings in another unit."""
    errors = None if SCAN.u_zz_errors is None else factor * SCAN.u_zz_errors
    return replace(SCAN, u_zz=factor * SCAN.u_zz, u_zz_errors=errors, unit=unit)


def without_set_up(scan=SCAN):
    stated = dict.fromkeys(("film", "indenter", "load", "load_uncertainty", "rod_friction"))
    return replace(scan, **stated)


@pytest.fixture(scope="module")
def bare():
    return memscal.calibrate(without_set_up(), reference=BARE).apparatus


def numbers(apparatus, conversion=1.0):
    """Parameters beside the baseline's and their uncertainties, A times a factor, (n, 2)."""
    rows = []
    for name in apparatus.parameters.names:
        if name not in ("baseline", "drift", "baseline_curvature"):
            row = np.array([apparatus.parameters[name], apparatus.parameters.uncertainty(name)])
            rows.append(row * (conversion if "conversion_constant" in name else 1.0))
    return np.array(rows)


@pytest.mark.parametrize(
    ("unit", "factor", "shown"),
    [
        ("A", 1e-9, "pA/Pa"),
        ("Pa", 1e6, "1"),
        pytest.param("T", 1e-4, "uT/Pa", marks=pytest.mark.full_study),
        pytest.param("1", 1e5, "1/Pa", marks=pytest.mark.full_study),
    ],
)
def test_readings_in_another_unit_are_volts_times_a_factor(bare, unit, factor, shown):
    scan = without_set_up(scaled(factor, unit))
    write_scan(scan, "scan.h5")
    stored = read_scan("scan.h5")
    assert (stored.unit, stored.film, stored.indenter, stored.load) == (unit, None, None, None)
    np.testing.assert_allclose(stored.u_zz, scan.u_zz, rtol=1e-14)
    apparatus = memscal.calibrate(stored, reference=BARE).apparatus
    assert apparatus.to_dict()["conversion_constant"]["unit"] == shown
    np.testing.assert_allclose(numbers(apparatus), numbers(bare, factor), rtol=1e-6)
    apparatus.save("sensor.h5")
    again = memscal.load_apparatus("sensor.h5")
    np.testing.assert_allclose(numbers(again), numbers(apparatus), rtol=1e-12)


def test_scans_of_several_units_are_refused():
    with pytest.raises(InputError, match=r"in V.*in A"):
        memscal.calibrate([SCAN, replace(SCAN, unit="A")])


def test_a_relative_calibration_takes_no_load_and_states_no_pascals(bare):
    scan = replace(SCAN, load=3.0, load_uncertainty=0.3, normal_load=np.full(SCAN.x.shape, 2.0))
    calibration = memscal.calibrate(scan, reference=BARE, relative=True)
    apparatus = calibration.apparatus
    peak = BARE.sigma_zz.max()
    assert apparatus.conversion_constant == pytest.approx(bare.conversion_constant * peak, rel=1e-9)
    assert apparatus.gaussian_sigma == pytest.approx(bare.gaussian_sigma, rel=1e-9)
    assert "load" not in apparatus.budget["conversion_constant"]
    assert "relative: the load is not known" in str(calibration).partition("\n")[0]
    drawn = memscal.monte_carlo(calibration, draws=4)
    assert drawn.to_dict()["parameters"]["conversion_constant"]["unit"] == "mV (relative)"
    apparatus.save("sensor.h5")
    stored = memscal.load_apparatus("sensor.h5")
    assert stored.load is None
    for state in (lambda: stored.stress(0.01), lambda: memscal.restore(SCAN, stored)):
        with pytest.raises(InputError, match="relative: it gives no stress in Pa"):
            state()


def relative(scan, load, **options):
    scan = replace(scan, load=load, load_uncertainty=None, normal_load=None)
    return memscal.calibrate(scan, relative=True, **options).apparatus


@pytest.mark.parametrize("options", [{}, {"film_law": "linear"}, {"method": "bayesian"}])
def test_a_relative_calibration_of_a_scan_without_a_load_is_that_at_1_n(options):
    unloaded, stated = (relative(SCAN, load, **options) for load in (None, 1.0))
    assert unloaded.conversion_constant == stated.conversion_constant
    for found in (unloaded, stated):
        said = any("1 N is taken" in message.text for message in found.process.messages)
        assert said is (found is unloaded)


def test_a_load_that_is_not_known_does_not_sink_the_rod():
    soft = replace(SCAN, film=replace(FILM, young_modulus=5e4))
    unknown, light = (relative(soft, load) for load in (None, 1e-3))
    np.testing.assert_allclose(numbers(unknown), numbers(light), rtol=1e-6)


def test_an_artifact_without_a_film_measures_the_stress_of_a_scan_that_states_its_own(bare):
    measured, usual = (memscal.measure_stress(SCAN, a).profiles[0] for a in (bare, CALIBRATED))
    np.testing.assert_allclose(measured.s_zz, usual.s_zz, rtol=0.01, atol=0.01 * usual.maximum)


def test_a_scan_without_a_load_is_taken_at_that_of_its_reference(bare):
    assert bare.load == BARE.load
    assert any("No load is stated" in message.text for message in bare.process.messages)


@pytest.mark.parametrize("use", [memscal.calibrate, lambda s: memscal.restore(s, CALIBRATED)])
def test_what_needs_the_film_says_what_is_missing(use):
    with pytest.raises(InputError, match=r"states no film \(/entry/sample/film\)(.|\n)*reference"):
        use(without_set_up())


CALIBRATED = memscal.calibrate(SCAN).apparatus


def test_readings_of_another_unit_than_the_artifact_are_refused():
    with pytest.raises(InputError, match="in A, those of the artifact in V"):
        memscal.restore(replace(SCAN, unit="A"), CALIBRATED)


def test_currents_are_turned_into_stress_and_come_back():
    currents = scaled(1e-9, "A")
    measured = memscal.measure_stress(currents, memscal.calibrate(currents).apparatus)
    volts = memscal.measure_stress(SCAN, CALIBRATED)
    stress = volts.profiles[0].s_zz
    # Where it passes through zero, rounding is more than a millionth of it.
    bound = 1e-9 * stress.max()
    np.testing.assert_allclose(measured.profiles[0].s_zz, stress, rtol=1e-6, atol=bound)
    measured.save("a.stress.h5")
    stored = memscal.read_stress("a.stress.h5")
    np.testing.assert_allclose(
        stored.profiles[0].points["zz"].u, measured.profiles[0].points["zz"].u
    )
    assert "A/Pa" in str(stored)
    assert "V" not in str(stored.to_dict()["conversion_constant"])
