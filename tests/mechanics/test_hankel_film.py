"""The film's surface by Hankel transforms: reciprocity, limits, and the rod's own condition."""

import math

import numpy as np
import pytest
from helpers.paper import film

from memscal import Rod, indent
from memscal.axisymmetry.hankel import gauss_between, gauss_panels
from memscal.mechanics.film_response import HankelFilm


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.495, 0.5])
def test_the_compliance_is_reciprocal(nu):
    # Betti: what one pair of tractions does along the other is what the other does along it.
    rng = np.random.default_rng()
    rings = np.linspace(0.0, 4e-3, 13)
    r, weights = gauss_between(rings, order=40)
    measure = weights * r
    model = HankelFilm(film(nu), rings)
    one, other = (model.field(*rng.uniform(size=(2, rings.size))) for _ in range(2))

    def along(forces, moved):
        p = forces.traction.pressure(r)
        q = forces.traction.shear(r)
        return float(measure @ (p * moved.surface(r, 0) + q * moved.surface(r, 1)))

    assert along(one, other) == pytest.approx(along(other, one), rel=1e-5)
    assert along(one, one) > 0


@pytest.mark.parametrize("nu", [0.2, 0.5])
@pytest.mark.parametrize("sticking", [False, True])
def test_the_surface_meets_a_rod_all_the_way_to_its_edge(nu, sticking):
    contact = indent(film(nu), Rod(radius=1e-3), load=1.0, friction=math.inf if sticking else 0.0)
    r = np.linspace(0.0, 0.95e-3, 20)
    np.testing.assert_allclose(contact.surface_depression(r), contact.depth, rtol=2e-4)
    beside = contact.surface_depression([1.0001e-3, 1.1e-3, 10e-3])
    assert 0.9 < beside[0] / contact.depth < 1
    assert beside[1] < beside[0]
    assert abs(beside[2]) < 0.02 * contact.depth
    if sticking:
        assert np.max(np.abs(contact.surface_outward(r))) < 2e-4 * contact.depth


def test_an_incompressible_film_keeps_its_volume():
    contact = indent(film(0.5), Rod(radius=1e-3), load=1.0)
    # Inside and outside the edge apart: the surface bends sharply there.
    inside, w_in = gauss_panels(1e-3, 0.05e-3)
    s, w_out = gauss_panels(1.0, 0.02)
    outside = 1e-3 + 60e-3 * s**2
    volume = np.sum(w_in * inside * contact.surface_depression(inside))
    sunk = volume
    volume += np.sum(w_out * 120e-3 * s * outside * contact.surface_depression(outside))
    assert abs(volume) < 1e-5 * sunk
