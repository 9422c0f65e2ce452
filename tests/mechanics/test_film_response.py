"""The transfer functions against the equations of elasticity, solved by another route."""

import numpy as np
import pytest
from helpers.outside import answers

from memscal.mechanics import film_response as film

RATIOS = (0.0, 0.25, 0.3, 0.49, 0.5)


@pytest.mark.parametrize("nu", RATIOS)
@pytest.mark.parametrize("x", [0.05, 0.3, 0.499, 0.501, 1.0, 2.5, 6.0])
def test_responses_solve_the_boundary_value_problem(x, nu):
    # Displacements (down, outward) and base stresses (pressure, shear) by pressure and by shear.
    surface, base = (of_unit[0, ::-1, ::-1] for of_unit in answers(nu, np.array([x])))
    normal, added_coupling, radial = film.corrections(x, nu)
    coupling = film.half_space_coupling(nu) + added_coupling
    compliance = [[1 + normal, coupling], [coupling, 1 + radial]]
    by_pressure, by_shear = film.base_response(x, nu)
    transmitted = [[by_pressure, -by_shear], film.base_response(x, nu, 1)]
    np.testing.assert_allclose((1 - nu) * np.array(compliance), x * surface, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(transmitted, base, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("nu", RATIOS)
def test_short_waves_see_a_half_space_and_reach_no_base(nu):
    x = np.array([30.0, 1e3, 1e9, np.inf])
    responses = (film.corrections(x, nu), film.base_response(x, nu), film.base_response(x, nu, 1))
    for response in responses:
        assert np.all(np.abs(response) < 1e-11)


def test_a_long_wave_of_pressure_shears_the_base_without_cancellation():
    x = np.logspace(-12, -5, 8)
    np.testing.assert_allclose(film.base_response(x, 0.0, 1)[0] / (x**3 / 6), 1, rtol=1e-8)


@pytest.mark.parametrize("nu", RATIOS)
def test_the_base_carries_all_of_a_uniform_traction(nu):
    # Zero is exact.
    assert film.base_response(0.0, nu) == pytest.approx((1, 0), rel=1e-15, abs=0)
    assert film.base_response(0.0, nu, 1) == pytest.approx((0, 1), rel=1e-15, abs=0)
