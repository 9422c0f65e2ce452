"""Measured and restored stress, contacts and designs show themselves as the commands print them."""

import json
import math

import numpy as np
import pytest
from helpers.scans import contact_scan, known_apparatus, pressed, sphere_scan

import memscal
from memscal.errors import InputError

LOADS = (0.69, 2.75)


@pytest.fixture(scope="module")
def apparatus():
    return known_apparatus(conversion_uncertainty=0.01, width_uncertainty=0.01)


@pytest.fixture(scope="module")
def stress(apparatus):
    return memscal.measure_stress(contact_scan(1, load=LOADS), apparatus)


@pytest.fixture(scope="module")
def restored(apparatus):
    return memscal.restore(sphere_scan(pressed(), seed=5), apparatus, expected=pressed())


@pytest.fixture(scope="module")
def contact():
    return pressed(1.0, 0.3)


@pytest.fixture(scope="module")
def planned():
    return memscal.design(noise=0.01, want={"sigma": 0.0345}, vary="repeats")


@pytest.mark.parametrize("name", ["stress", "restored", "contact", "planned"])
def test_mapping_notebook_and_arrays(name, request):
    result = request.getfixturevalue(name)
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False)) == result.to_dict()
    assert all(variable.attrs for variable in result.to_xarray().variables.values())
    assert len(result.to_dataframe()) > 10


def test_arrays_are_in_si_units_and_tables_in_shown_ones(stress):
    arrays = stress.to_xarray()
    table = stress.to_dataframe()
    assert arrays.s_zz.dims == ("profile", "point")
    assert (arrays.s_zz.attrs["units"], arrays.r.attrs["units"]) == ("Pa", "m")
    second = stress.profiles[1]
    np.testing.assert_allclose(arrays.s_zz[1, : second.r.size], second.s_zz)
    rows = table[table["profile"] == 2]
    np.testing.assert_allclose(rows["s_zz (kPa)"], second.s_zz / 1e3)
    np.testing.assert_allclose(rows["r (mm)"], second.r / 1e-3)
    assert len(table) == sum(profile.r.size for profile in stress.profiles)


def test_forces_of_one_sensor_are_correlated(stress):
    numbers = stress.ufloats()
    first, second = stress.profiles
    assert numbers["force_1"].nominal_value == first.force
    assert numbers["force_1"].std_dev == pytest.approx(first.force_uncertainty)
    assert numbers["maximum_2"].std_dev == pytest.approx(second.maximum_uncertainty)
    total = numbers["force_1"] + numbers["force_2"]
    assert total.std_dev > math.hypot(first.force_uncertainty, second.force_uncertainty)
    assert total.std_dev < first.force_uncertainty + second.force_uncertainty


def test_numbers_of_a_restoration_have_their_joint_covariance(restored):
    numbers = restored.ufloats()
    assert list(numbers) == ["force", "stress_on_axis", "centre", "baseline"]
    assert numbers["force"].nominal_value == pytest.approx(restored.force)
    assert numbers["force"].std_dev == pytest.approx(restored.force_uncertainty)
    assert numbers["stress_on_axis"].std_dev == pytest.approx(restored.stress_uncertainty(0.0))
    assert numbers["centre"].nominal_value == pytest.approx(restored.centre[0])
    assert numbers["baseline"].std_dev == pytest.approx(restored.baseline_uncertainty)
    total = numbers["force"] + 1e3 * numbers["baseline"]
    apart = math.hypot(restored.force_uncertainty, 1e3 * restored.baseline_uncertainty)
    # A higher baseline is a smaller force.
    assert total.std_dev < apart


def test_a_contact_varies_with_its_film_and_indenter():
    film = memscal.ElasticFilm(
        young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, young_modulus_uncertainty=0.1e6
    )
    rod = memscal.Rod(radius=0.25e-3, radius_uncertainty=5e-6)
    numbers = memscal.indent(film, rod, load=0.2).ufloats()
    # A flat punch: depth is as 1/E at a given load; the stress at the base does not depend on E.
    numbers_of_modulus = memscal.indent(film, memscal.Rod(radius=0.25e-3), load=0.2).ufloats()
    depth, stress = (numbers_of_modulus[name] for name in ("depth", "max_base_stress"))
    assert depth.std_dev / depth.nominal_value == pytest.approx(0.1 / 2.2, rel=0.01)
    assert stress.std_dev < 1e-6 * stress.nominal_value
    assert numbers["contact_radius"].std_dev == pytest.approx(5e-6)
    assert numbers["depth"].std_dev > depth.std_dev
    # Only P/E matters under a sphere: what E changes, the load changes the other way.
    sphere = memscal.Sphere(radius=0.1288)
    pressed_in = memscal.indent(film, sphere, load=0.3).ufloats()["depth"]
    less, more = (memscal.indent(film, sphere, load=0.3 / (1 + s * 0.1 / 2.2)) for s in (1, -1))
    assert pressed_in.std_dev == pytest.approx((more.depth - less.depth) / 2, rel=1e-3)


def test_a_contact_that_was_unloaded_is_not_varied(contact):
    sphere = memscal.Sphere(radius=0.1288)
    released = memscal.indent(contact.film, sphere, load=[1.0, 0.4], friction=0.3)[1]
    with pytest.raises(InputError, match="not reached by loading alone"):
        released.ufloats()
