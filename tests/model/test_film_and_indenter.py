"""Films and indenters: their ranges, their moduli, and that they stay as they were made."""

import math
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from helpers.paper import FILM
from hypothesis import given
from hypothesis import strategies as st

from memscal import Cone, Profile, Rod, Sphere
from memscal.errors import InputError


@given(nu=st.floats(0.0, 0.5), modulus=st.floats(1e3, 1e12))
def test_the_moduli_are_those_of_isotropic_elasticity(nu, modulus):
    film = replace(FILM, poisson_ratio=nu, young_modulus=modulus)
    # E = 2 G (1 + nu), and the plane-strain modulus is 2 G/(1 - nu).
    assert 2 * film.shear_modulus * (1 + nu) == pytest.approx(modulus)
    assert film.contact_modulus == pytest.approx(2 * film.shear_modulus / (1 - nu))


@pytest.mark.parametrize(("changes", "named"), [
    ({"young_modulus": 0.0}, "young_modulus is 0 Pa, but .* above zero"),
    ({"young_modulus": float("inf")}, "young_modulus is inf Pa"),
    ({"poisson_ratio": 0.5000001}, "poisson_ratio"),
    ({"poisson_ratio": -0.1}, r"poisson_ratio is -0\.1 .*from 0 to 0\.5"),
    ({"poisson_ratio": float("nan")}, "poisson_ratio is nan"),
    ({"thickness": -2e-3}, "thickness is -0.002 m"),
    ({"roughness_rms": -1e-6}, "roughness_rms"),
    ({"young_modulus_uncertainty": -1.0}, "uncertainty of film young_modulus"),
    ({"poisson_ratio_uncertainty": float("nan")}, "uncertainty of film poisson_ratio"),
    ({"thickness_uncertainty": float("inf")}, "uncertainty of film thickness"),
    ({"roughness_rms_uncertainty": -1e-9}, "uncertainty of film roughness_rms"),
])  # fmt: skip
def test_a_film_that_cannot_be_is_refused_by_name(changes, named):
    with pytest.raises(InputError, match=named):
        replace(FILM, **changes)


@pytest.mark.parametrize("radius", [0.0, -1e-3, float("nan"), float("inf")])
@pytest.mark.parametrize("kind", [Rod, Sphere])
def test_an_indenter_without_a_radius_is_refused_by_its_shape(kind, radius):
    with pytest.raises(InputError, match=f"{kind.__name__.lower()} radius"):
        kind(radius=radius)
    with pytest.raises(InputError, match=f"uncertainty of the {kind.__name__.lower()} radius"):
        kind(radius=1e-3, radius_uncertainty=-1e-6)


R = np.linspace(0.0, 2e-3, 50)


def test_a_rod_is_flat_to_its_edge_and_ends_there():
    height = Rod(radius=1e-3).height([0.0, 1e-3, 1.001e-3])
    np.testing.assert_array_equal(height, [0.0, 0.0, np.inf])


def test_a_sphere_is_round():
    sphere = Sphere(radius=5e-3)
    np.testing.assert_allclose(R**2 + (5e-3 - sphere.height(R)) ** 2, 25e-6, rtol=1e-14)
    assert sphere.height(5.1e-3) == np.inf
    # Far from its radius a sphere is a parabola, to the last digit.
    assert Sphere(radius=1e6).height(1e-3) == pytest.approx(0.5e-12, rel=1e-12)


def test_a_cone_rises_by_its_inclination():
    cone = Cone(inclination=math.atan(0.25))
    np.testing.assert_allclose(cone.height(R), R / 4, rtol=1e-14)
    assert cone.extent == math.inf


@pytest.mark.parametrize("inclination", [0.0, -0.1, math.pi / 2, math.nan])
def test_a_cone_is_neither_flat_nor_a_needle(inclination):
    with pytest.raises(InputError, match="inclination"):
        Cone(inclination=inclination)


def test_a_profile_goes_through_its_table_and_nowhere_else():
    profile = Profile(r=[0.0, 1e-3, 2e-3, 3e-3], z=[0.0, 0.0, 4e-6, 9e-6])
    np.testing.assert_allclose(profile.height(profile.r), profile.z, atol=1e-20)
    # A flat stays flat: a monotone spline does not swing below it.
    assert np.all(profile.height(np.linspace(0.0, 1e-3, 20)) == 0)
    assert profile.height(3.01e-3) == np.inf
    assert repr(profile) == "<Profile: 4 radii to 3 mm, heights to 9 um>"
    same = Profile(r=profile.r, z=profile.z)
    assert (profile == same, hash(profile) == hash(same)) == (True, True)
    assert profile != Profile(r=profile.r, z=2 * profile.z)


RADII = np.arange(4.0)


@pytest.mark.parametrize(("r", "z", "message"), [
    (RADII, RADII + 1, "touches first"),
    (RADII, [0.0, -1.0, 3.0, 4.0], "lowest height"),
    (RADII, 0 * RADII, "press a Rod"),
    (RADII, [0.0, math.nan, 3.0, 4.0], "height .* not finite"),
    ([0.0, 2.0, 1.0, 3.0], RADII, "increase"),
    ([0.5, 1.0, 2.0, 3.0], RADII, "first at the axis"),
    (RADII[:3], RADII[:3], "four or more"),
    (RADII, RADII[:3], "3 heights"),
])  # fmt: skip
def test_a_profile_that_cannot_touch_is_refused(r, z, message):
    with pytest.raises(InputError, match=f"(?i){message}"):
        Profile(r=r, z=z)


@pytest.mark.parametrize(
    ("modulus", "thickness", "meant"),
    [
        (1.8, 1.5, "modulus is 1.8 Pa. Probably 1.8 MPa was(.|\n)*1.5 mm was"),
        (0.9, 0.2, "0.9 MPa(.|\n)*0.2 mm was"),
        (1.8, 1.5e-3, "1.8 MPa was"),
        (2.2e6, 2e-3, ""),
        (2.2e6, 2.0, ""),  # a half-space
    ],
)
def test_a_film_in_millimetres_and_megapascals_is_warned_of(modulus, thickness, meant):
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        replace(FILM, young_modulus=modulus, thickness=thickness)
    words = "\n".join(str(each.message) for each in seen)
    assert re.search(meant, words)
    assert bool(words) is bool(meant)


@pytest.mark.parametrize("nu", [0.5, 0.497, 0.3, 0.0])
def test_the_expected_poissons_ratio_is_that_of_draws_that_a_film_can_have(nu):
    film = replace(FILM, poisson_ratio=nu, poisson_ratio_uncertainty=0.004)
    draws = np.random.default_rng(1).normal(nu, 0.004, 400_000)
    draws = draws[(draws >= 0) & (draws <= 0.5)]
    found = film.expected
    assert found.poisson_ratio == pytest.approx(draws.mean(), abs=5e-5)
    assert found.poisson_ratio_uncertainty == pytest.approx(draws.std(), rel=0.01)
    assert replace(film, poisson_ratio_uncertainty=None).expected.poisson_ratio == nu
