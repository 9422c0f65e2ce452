"""The surface of a half-space under rings of traction, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipk, j0, j1

from memscal.mechanics.film_response import hat_transform
from memscal.mechanics.surface import coupling_integrals, singular_integrals

EVEN = np.linspace(0.0, 1.0, 41)
CROWDED = 1 - np.linspace(1.0, 0.0, 60) ** 4


@pytest.mark.parametrize("rings", [EVEN, CROWDED], ids=["even", "crowded"])
def test_a_disc_of_pressure_presses_as_love_found(rings):
    x = np.array([0.0, 0.1, 0.5, 0.99, 0.999999, 1.0, 1.000001, 1.3, 7.0])
    found = singular_integrals(x, rings)[0] @ np.ones(rings.size)
    outside = np.maximum(x, 1.0)
    t = 1 / outside
    love = np.where(
        x <= 1,
        2 / np.pi * ellipe(np.minimum(x, 1.0) ** 2),
        2 / np.pi * outside * (ellipe(t**2) - (1 - t**2) * ellipk(np.where(x > 1, t**2, 0.0))),
    )
    np.testing.assert_allclose(found, love, rtol=2e-10)


@pytest.mark.parametrize("rings", [EVEN, CROWDED], ids=["even", "crowded"])
def test_a_linear_outward_traction_is_integrated_as_adaptive_quadrature_does(rings):
    def kernel(s, x):
        m = min(x, s) / max(x, s)
        return 2 / np.pi * (ellipk(m**2) - ellipe(m**2)) / min(x, s)

    for x in (0.05, 0.4321, 0.975, 2.0):
        breaks = [x] if x < 1 else None
        exact, _ = quad(lambda s: kernel(s, x) * s**2, 0, 1, points=breaks, epsrel=1e-11)  # noqa: B023
        found = singular_integrals(np.array([x]), rings)[1] @ rings
        assert found[0] == pytest.approx(exact, rel=1e-8)


def test_the_coupling_is_elementary():
    x = np.array([0.0, 0.013, 0.5, 1.0, 3.0])
    beyond, within = coupling_integrals(x, EVEN)
    inside = np.minimum(x, 1.0)
    np.testing.assert_allclose(beyond @ EVEN, (1 - inside**2) / 2, atol=1e-15)
    over_x = np.divide(inside**3 / 3, x, out=np.zeros_like(x), where=x > 0)
    np.testing.assert_allclose(within @ EVEN, over_x, atol=1e-15)
    assert np.all(singular_integrals(np.zeros(1), EVEN)[1] == 0)  # on the axis nothing moves aside


def test_the_transforms_of_the_hats_sum_to_those_of_simple_tractions():
    k = np.array([0.3, 2.0, 11.0, 40.0])
    of_pressure, of_shear = (hat_transform(EVEN.tobytes(), k.tobytes(), n) for n in (0, 1))
    np.testing.assert_allclose(of_pressure @ np.ones(41), j1(k) / k, rtol=1e-12)
    np.testing.assert_allclose(of_shear @ EVEN, (2 * j1(k) / k - j0(k)) / k, atol=1e-14)
