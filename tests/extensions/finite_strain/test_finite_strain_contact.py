"""Finite strain behind the same door as all other contacts."""

import math

import numpy as np
import pytest
from helpers.paper import FILM, ROD, SPHERE

from memscal import Cone, Interface, indent
from memscal.errors import DomainError, InputError

R = np.linspace(0.0, 4e-3, 30)


def test_a_light_rod_stresses_the_base_as_in_the_linear_film():
    finite = indent(FILM, ROD, load=0.01, friction=math.inf, strain="finite")
    linear = indent(FILM, ROD, load=0.01, friction=math.inf)
    difference = finite.base_stress(R) - linear.base_stress(R)
    assert np.max(np.abs(difference)) < 1e-2 * linear.max_base_stress
    assert (finite.strain, finite.backend) == ("finite", "fem")
    assert finite.base_spectrum(0.0) == pytest.approx(0.01, rel=1e-5)
    k = np.linspace(200.0, 1500.0, 5)
    shear = linear.base_shear_spectrum(k)
    atol = 0.02 * np.abs(shear).max()
    np.testing.assert_allclose(finite.base_shear_spectrum(k), shear, atol=atol)
    assert finite.profile().solver == "memscal, fem backend, finite strain"


@pytest.mark.parametrize(
    ("indenter", "asked", "error", "message"),
    [
        (ROD, {"friction": 0.3}, DomainError, "slides freely .* or sticks"),
        (ROD, {"interface": Interface(slip_length=1e-6)}, DomainError, "do not yield"),
        (SPHERE, {"friction": math.inf}, DomainError, 'loading="total" only'),
        (Cone(inclination=0.1), {}, DomainError, "a cone cannot be pressed"),
        (ROD, {"rings": 64}, InputError, "the surface has none"),
        (ROD, {"load": None, "depth": 2.5e-3}, DomainError, "goes through the film"),
        (SPHERE, {"load": 500.0}, DomainError, "contact would be"),
    ],
)
def test_what_is_not_modelled_at_finite_strain_is_refused(indenter, asked, error, message):
    with pytest.raises(error, match=message):
        indent(FILM, indenter, **{"load": 0.1, "strain": "finite", **asked})
