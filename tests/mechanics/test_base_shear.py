"""The base shear's transform of order one, against closed forms and the shear itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.rounding import assert_same_to_rounding
from scipy.integrate import simpson
from scipy.special import j1

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.mechanics.indent import indent
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere


def film(nu: float) -> ElasticFilm:
    return ElasticFilm(young_modulus=2.2e6, poisson_ratio=nu, thickness=2e-3)


@pytest.mark.parametrize("nu", [0.2, 0.45, 0.5])
def test_the_first_moment_of_the_shear_is_that_of_a_column_under_the_load(nu: float) -> None:
    # Equilibrium of the whole film: at small k every film is an oedometer under the mean
    # pressure, whose radial stress nu/(1 - nu) p on its thickness h is what the base holds.
    contact = indent(film(nu), Rod(radius=0.25e-3), load=2.0)
    k = 1e-3 / film(nu).thickness
    moment = contact.base_shear_spectrum(k) / k
    assert moment == pytest.approx(-2.0 * nu / (1 - nu) * film(nu).thickness, rel=1e-5)


@pytest.mark.parametrize("nu", [0.3, 0.5])
@pytest.mark.parametrize("friction", [0.0, math.inf])
def test_the_spectrum_and_the_shear_are_one_function(nu: float, friction: float) -> None:
    contact = indent(film(nu), Rod(radius=0.25e-3), load=1.0, friction=friction)
    wavenumbers = Wavenumbers.covering(20 / film(nu).thickness, 16e-3)
    spectrum = RadialSpectrum(wavenumbers, contact.base_shear_spectrum(wavenumbers.k), order=1)
    r = np.linspace(0.0, 15e-3, 61)
    shear = contact.base_shear(r)
    np.testing.assert_allclose(spectrum.at(r), shear, atol=1e-6 * np.abs(shear).max())


def test_the_spectrum_is_an_integral_of_the_shear_and_odd_in_k() -> None:
    contact = indent(film(0.5), Sphere(radius=128.8e-3), load=1.37, friction=0.2)
    k = np.array([150.0, 700.0, 2000.0])
    # Even radii, a hundred to the film's thickness, over which the shear is smooth.
    r = np.linspace(0.0, 80e-3, 4001)
    measure = 2 * np.pi * r * contact.base_shear(r)
    direct = [simpson(measure * j1(each * r), x=r) for each in k]
    found = contact.base_shear_spectrum(k)
    np.testing.assert_allclose(found, direct, rtol=1e-5)
    assert_same_to_rounding(contact.base_shear_spectrum(-k), -found)
    assert contact.base_shear_spectrum(0.0) == 0.0
    assert contact.base_shear_spectrum(k.reshape(3, 1)).shape == (3, 1)


@pytest.mark.parametrize("friction", [0.0, math.inf])
def test_both_backends_have_the_same_spectrum(friction: float) -> None:
    rod = Rod(radius=0.6e-3)
    k = np.linspace(100.0, 2500.0, 13)
    one, other = (
        indent(film(0.45), rod, load=1.0, friction=friction, **backend).base_shear_spectrum(k)
        for backend in ({}, {"backend": "fem", "rings": 48})
    )
    np.testing.assert_allclose(other, one, atol=2e-3 * np.abs(one).max())


def test_at_finite_strain_the_spectrum_is_that_of_the_shear() -> None:
    contact = indent(film(0.45), Rod(radius=0.5e-3), load=0.02, friction=math.inf, strain="finite")
    linear = indent(film(0.45), Rod(radius=0.5e-3), load=0.02, friction=math.inf)
    k = np.linspace(200.0, 1500.0, 5)
    expected = linear.base_shear_spectrum(k)
    np.testing.assert_allclose(
        contact.base_shear_spectrum(k), expected, atol=0.02 * np.abs(expected).max()
    )
