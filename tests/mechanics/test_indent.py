"""Pressing a rod on a film: loads, depths, base stress, and requests that are refused."""

import math

import numpy as np
import pytest
from helpers.machine import assert_same_to_rounding
from helpers.paper import FILM, ROD, film
from scipy.interpolate import CubicSpline
from scipy.special import j0

from memscal import Rod, Sphere, indent
from memscal.axisymmetry.hankel import gauss_panels
from memscal.errors import DomainError, InputError

CASES = [(nu, friction) for nu in (0.0, 0.3, 0.5) for friction in (0.0, math.inf)]


def press(nu, friction, radius=0.25e-3):
    return indent(film(nu), Rod(radius=radius), load=0.5, friction=friction)


@pytest.mark.parametrize("friction", [0.0, math.inf])
def test_the_spectrum_is_the_fourier_transform_of_the_base_stress(friction):
    contact = indent(FILM, ROD, load=0.5, friction=friction)
    k = np.array([[0.0, 300.0, 700.0], [1500.0, 3000.0, 1e6]])
    r, weights = gauss_panels(80e-3, 2e-3)
    summed = 2 * np.pi * j0(k[..., None] * r) @ (weights * r * contact.base_stress(r))
    spectrum = contact.base_spectrum(k)
    np.testing.assert_allclose(spectrum[:, :2], summed[:, :2], atol=1e-11)
    assert spectrum[0, 0] == pytest.approx(0.5, rel=1e-14)
    assert abs(spectrum[1, 2]) < 1e-100
    assert_same_to_rounding(contact.base_spectrum(-k), spectrum)
    many = np.linspace(0.0, 2e4, 20001)  # more than are computed at a time
    np.testing.assert_allclose(
        contact.base_spectrum(many)[::4000], contact.base_spectrum(many[::4000]), atol=1e-15
    )


def test_the_rod_of_the_paper_sinks_as_deep_as_the_linear_model_says():
    contact = indent(FILM, ROD, load=1.0)
    assert contact.depth == pytest.approx(0.587e-3, rel=1e-3)
    assert contact.load / contact.depth == pytest.approx(1704, rel=5e-4)


def test_friction_changes_the_stress_under_the_paper_s_rod_by_a_thousandth():
    r = np.linspace(0.0, 8e-3, 400)
    sliding = indent(FILM, ROD, load=1.0).base_stress(r)
    sticking = indent(FILM, ROD, load=1.0, friction=math.inf).base_stress(r)
    assert 0.5e-3 < np.max(np.abs(sticking - sliding)) / np.max(sliding) < 2e-3


def test_a_list_of_loads_gives_proportional_contacts():
    one, three = indent(FILM, ROD, load=[0.25, 0.75])
    assert three.depth == pytest.approx(3 * one.depth, rel=1e-14)
    assert [c.load for c in indent(FILM, ROD, load=np.array([0.25, 0.75]))] == [0.25, 0.75]
    assert [c.depth for c in indent(FILM, ROD, depth=(1e-5, 2e-5))] == [1e-5, 2e-5]


@pytest.mark.parametrize("friction", [0.0, math.inf])
def test_there_is_no_traction_outside_the_rod_and_no_nan_anywhere(friction):
    contact = indent(FILM, ROD, load=1.0, friction=friction)
    r = np.array([[0.0, 0.1e-3], [ROD.radius, 1.0]])
    at_interface = (contact.interface_pressure(r), contact.interface_shear(r))
    for field in (*at_interface, contact.base_stress(r), contact.base_shear(r)):
        assert field.shape == r.shape
        assert np.all(np.isfinite(field))
        assert field[1, 1] == 0
    assert np.all(contact.interface_pressure(r[1]) == 0)


@pytest.mark.parametrize("r", [[-1e-3], [np.nan], [np.inf]])
def test_what_is_no_radius_is_refused(r):
    with pytest.raises(InputError, match="radius"):
        indent(FILM, ROD, load=1.0).base_stress(r)


@pytest.mark.parametrize("radius", [0.1e-3, 4e-3])
@pytest.mark.parametrize(("nu", "friction"), CASES)
def test_a_spline_through_the_profile_is_the_stress(nu, friction, radius):
    contact = press(nu, friction, radius)
    profile = contact.profile()
    between = (profile.r[1:] + profile.r[:-1]) / 2
    spline = CubicSpline(profile.r, profile.sigma_zz)
    highest = np.max(profile.sigma_zz)
    assert np.max(np.abs(spline(between) - contact.base_stress(between))) < 1e-6 * highest
    beyond = profile.r[-1] + np.linspace(0.0, 0.05, 50)
    assert np.max(np.abs(contact.base_stress(beyond))) < 1.1e-9 * highest


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["load", "depth"])
def test_loads_and_depths_that_are_not_positive_are_refused(name, value):
    asked = (value, None) if name == "load" else (None, value)
    with pytest.raises(InputError, match=f"{name} is .* above zero"):
        indent(FILM, ROD, load=asked[0], depth=asked[1])


@pytest.mark.parametrize(
    ("asked", "error", "words"),
    [
        ({"load": 1.0, "depth": 1e-4}, InputError, "either a load or a depth, not both"),
        ({}, InputError, "either a load or a depth"),
        ({"depth": 2e-3}, DomainError, "sink"),
        ({"load": 10.0}, DomainError, "sink"),
    ],
)
def test_a_load_or_a_depth_within_the_film_is_needed(asked, error, words):
    with pytest.raises(error, match=words):
        indent(FILM, ROD, **asked)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"friction": -0.1}, "friction is -0.1"),
        ({"friction": math.nan}, "friction is nan"),
        ({"backend": "magic"}, "backend is 'magic'"),
        ({"loading": "sudden"}, "loading is 'sudden'"),
        ({"strain": "huge"}, "strain is 'huge'"),
        ({"rings": 3}, "at least 16"),
    ],
)
def test_what_makes_no_sense_is_refused_in_plain_words(wrong, message):
    with pytest.raises(InputError, match=message):
        indent(FILM, Sphere(radius=0.1288), load=1.0, **wrong)
