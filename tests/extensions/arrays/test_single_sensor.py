"""One sensor of an array as an ordinary apparatus function, against closed forms and the truth."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.arrays import FILM, SIGMA, A, known_array, layout
from helpers.true_arrays import TrueArray

import memscal
from memscal.axisymmetry.kernels import GaussianMixture, gaussian_transfer_slope, unit_gaussian
from memscal.errors import InputError
from memscal.extensions.arrays.array_data import ALL, ArrayReadings, KernelModes
from memscal.model.checks import QualityCheck

#: Relative standard uncertainties: of A by noise and load, of the width of all G.
OF_A, OF_LOAD, OF_WIDTH = 0.02, 0.01, 0.03
PLACES = layout(1, 5)


def row(**changes):
    """Return a row of five sensors with these uncertainties, scanned without noise."""
    array = known_array(1, 5)
    slope = SIGMA * gaussian_transfer_slope(array.k, SIGMA)
    parameters = 15 + len(array.pairs) + 1
    root = np.zeros((parameters, 6))
    root[:5, :5] = OF_A * np.eye(5)
    root[-1, -1] = OF_WIDTH
    load = np.zeros(parameters)
    load[:5] = -OF_LOAD
    x = np.linspace(-8e-3, 8e-3, 65)
    true = TrueArray(PLACES, array.conversion_constants, array.crosstalk)
    u = true.readings(np.stack([x, 0 * x], axis=1), 1.0).T
    stated = {
        "modes": KernelModes(slope[None], np.array([ALL])),
        "root": root,
        "effects": {"load": load},
        "readings": ArrayReadings(x, 0 * x, np.ones(65), u, u, 0 * u),
    }
    return replace(array, **(stated | changes))


def test_it_has_the_numbers_and_uncertainties_of_the_array():
    apparatus = row().sensor("T01")
    assert apparatus.conversion_constant == A
    assert apparatus.parameters.uncertainty("conversion_constant") == pytest.approx(
        A * np.hypot(OF_A, OF_LOAD)
    )
    budget = apparatus.budget["conversion_constant"]
    assert budget == pytest.approx({"noise": OF_A * A, "load": OF_LOAD * A})
    assert apparatus.parameters.uncertainty("gaussian_sigma") == pytest.approx(OF_WIDTH * SIGMA)
    assert apparatus.parameters["centre"] == -2e-3
    assert "centre_y" not in apparatus.parameters
    profile = apparatus.radial_profile
    g = unit_gaussian(profile.r, SIGMA)
    np.testing.assert_allclose(profile.g, g, atol=1e-6 * g[0])
    # The derivative of a Gaussian by its width.
    slope = OF_WIDTH * abs((profile.r / SIGMA) ** 2 - 2) * g
    np.testing.assert_allclose(profile.g_errors, slope, atol=1e-4 * slope[0])
    np.testing.assert_allclose(apparatus.kernel_changes["load"], -OF_LOAD * profile.g)
    # Where 3 u(width) (sigma k)^2 = 1.
    resolved = (3 * OF_WIDTH) ** -0.5 / SIGMA
    assert apparatus.resolved_wavenumber == pytest.approx(resolved, rel=0.01)


def test_its_readings_are_without_the_crosstalk():
    array = row()
    alone = TrueArray(PLACES, array.conversion_constants, np.eye(5))
    x = array.readings.x
    expected = alone.readings(np.stack([x, 0 * x], axis=1), 1.0)[:, 1]
    readings = array.sensor("T01").reconvolution
    # The rod's pressure there is that of a punch on a half-space.
    np.testing.assert_allclose(readings.u_zz, expected, atol=2e-4 * expected.max())
    np.testing.assert_allclose(readings.residual, 0.0, atol=1e-15)
    assert abs(readings.u_zz_gaussian - readings.u_zz).max() < 1e-4 * expected.max()
    assert abs(array.readings.u[1] - expected).max() > 5e-3 * expected.max()


def test_what_it_measures_is_off_by_its_uncertainty(tmp_path):
    row(film=replace(FILM, law="linear")).sensor("T01").save(tmp_path / "sensor.h5")
    apparatus = memscal.load_apparatus(tmp_path / "sensor.h5")
    # A that is too small by one uncertainty makes every force too large.
    scan = memscal.simulate(
        film=apparatus.film,
        kernel=GaussianMixture((1.0,), (SIGMA,)),
        conversion_constant=(1 + OF_A) * A,
        disturbances=memscal.Disturbances(noise=1e-4, baseline=0.0, drift=0.0),
    )
    profile = memscal.measure_stress(scan, apparatus, override=True).profiles[0]
    assert profile.force / profile.load - 1 == pytest.approx(OF_A, abs=4e-3)
    stated = np.hypot(OF_A, OF_LOAD)
    assert stated <= profile.force_uncertainty / profile.load < 1.3 * stated


def test_checks_of_other_sensors_stay_with_them():
    checks = tuple(QualityCheck(name, 2.0, 1.0, False, "") for name in ("own", "other", "all"))
    array = row(checks=checks, failing={"own": ("T01",), "other": ("T02",), "all": ()})
    assert [check.name for check in array.sensor("T01").checks] == ["own", "all"]


def test_a_sensor_without_apparatus_function_is_refused_with_the_names_of_others():
    array = row(used=np.array([True, True, True, False, True]))
    for name in ("T03", "nobody"):
        with pytest.raises(InputError, match=name) as caught:
            array.sensor(name)
        assert "T00, T01, T02, T04" in str(caught.value)
    with pytest.raises(InputError, match="T00"):
        row(reference=None).sensor("T00")
