"""The base shear's transform of order one, against closed forms and the shear itself."""

import numpy as np
import pytest
from helpers.machine import assert_same_to_rounding
from helpers.paper import ROD, SPHERE, film
from scipy.integrate import simpson
from scipy.special import j1

from memscal import indent


@pytest.mark.parametrize("nu", [0.2, 0.45, 0.5])
def test_the_first_moment_of_the_shear_is_that_of_a_column_under_the_load(nu):
    # Equilibrium of the whole film: at small k every film is an oedometer under the mean
    # pressure, whose radial stress nu/(1 - nu) p on its thickness h is what the base holds.
    k = 1e-3 / film(nu).thickness
    moment = indent(film(nu), ROD, load=2.0).base_shear_spectrum(k) / k
    assert moment == pytest.approx(-2.0 * nu / (1 - nu) * film(nu).thickness, rel=1e-5)


@pytest.mark.parametrize(
    ("indenter", "nu", "friction"), [(SPHERE, 0.5, 0.2), (ROD, 0.3, 0.0), (ROD, 0.5, np.inf)]
)
def test_the_spectrum_is_an_integral_of_the_shear_and_odd_in_k(indenter, nu, friction):
    contact = indent(film(nu), indenter, load=1.37, friction=friction)
    k = np.array([150.0, 700.0, 2000.0])
    # Even radii, forty to the film's thickness, over which the shear is smooth.
    r = np.linspace(0.0, 50e-3, 1001)
    measure = 2 * np.pi * r * contact.base_shear(r)
    direct = [simpson(measure * j1(wavenumber * r), x=r) for wavenumber in k]
    spectrum = contact.base_shear_spectrum(k)
    np.testing.assert_allclose(spectrum, direct, rtol=1e-5)
    assert_same_to_rounding(contact.base_shear_spectrum(-k), -spectrum)
    assert contact.base_shear_spectrum(0.0) == 0.0
    assert contact.base_shear_spectrum(k.reshape(3, 1)).shape == (3, 1)
