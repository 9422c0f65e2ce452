"""The transfer functions against the equations of elasticity, solved by another route."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from memscal.mechanics import film_response as film

RATIOS = (0.0, 0.25, 0.3, 0.49, 0.5)


def march_through_film(x: float, nu: float) -> tuple[np.ndarray, np.ndarray]:
    """Integrate Navier's equations in Hankel space from the base up, for k = G = 1.

    The state (u_r, u_z, sigma_rz, sigma_zz) obeys a linear system that stays regular at
    nu = 1/2; its matrix exponential carries the unknown base traction to the surface.
    Returns surface displacements (down, outward) and base stresses (pressure, shear) for a
    unit pressure (first column) and a unit outward traction (second column) on the surface.
    """
    rate = np.array(
        [
            [0, 1, 1, 0],
            [-nu / (1 - nu), 0, 0, (1 - 2 * nu) / (2 * (1 - nu))],
            [2 / (1 - nu), 0, 0, nu / (1 - nu)],
            [0, 0, -1, 0],
        ]
    )
    carry = expm(rate * x)
    surface_traction = np.array([[0.0, 1.0], [-1.0, 0.0]])  # rows sigma_rz, sigma_zz
    base = np.linalg.solve(carry[2:, 2:], surface_traction)
    moved = carry[:2, 2:] @ base
    return np.array([-moved[1], moved[0]]), np.array([-base[1], base[0]])


@pytest.mark.parametrize("nu", RATIOS)
@pytest.mark.parametrize("x", [0.05, 0.3, 0.499, 0.501, 1.0, 2.5, 6.0])
def test_responses_solve_the_boundary_value_problem(x: float, nu: float) -> None:
    surface, base = march_through_film(x, nu)
    compliance = [
        [film.normal_compliance(x, nu), film.coupling_compliance(x, nu)],
        [film.coupling_compliance(x, nu), film.radial_compliance(x, nu)],
    ]
    transmitted = [
        [film.base_normal_from_pressure(x, nu), -film.base_normal_from_shear(x, nu)],
        [film.base_shear_from_pressure(x, nu), film.base_shear_from_shear(x, nu)],
    ]
    np.testing.assert_allclose((1 - nu) * np.array(compliance), surface, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(transmitted, base, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("x", [0.1, 1.0, 4.0])
def test_the_couplings_of_pressure_and_shear_are_reciprocal(x: float) -> None:
    surface, _ = march_through_film(x, 0.3)
    assert surface[0, 1] == pytest.approx(surface[1, 0], rel=1e-9)


@pytest.mark.parametrize("nu", RATIOS)
def test_short_waves_see_a_half_space(nu: float) -> None:
    x = np.array([30.0, 1e3, 1e9, np.inf])
    np.testing.assert_allclose(film.normal_compliance(x, nu), 1, rtol=1e-14)
    np.testing.assert_allclose(film.radial_compliance(x, nu), 1, rtol=1e-14)
    half_space = -(1 - 2 * nu) / (2 * (1 - nu))
    np.testing.assert_allclose(film.coupling_compliance(x, nu), half_space, atol=1e-14)
    for transmitted in (
        film.base_normal_from_pressure,
        film.base_shear_from_pressure,
        film.base_normal_from_shear,
        film.base_shear_from_shear,
    ):
        assert np.all(np.abs(transmitted(x, nu)) < 1e-11)


def test_long_waves_reach_their_limits_without_cancellation() -> None:
    x = np.logspace(-12, -5, 8)
    # Incompressible: lubrication.  Compressible: uniaxial compression and simple shear.
    np.testing.assert_allclose(film.normal_compliance(x, 0.5) / (2 * x**3 / 3), 1, rtol=1e-8)
    uniaxial = (1 - 2 * 0.3) / (2 * (1 - 0.3) ** 2) * x
    np.testing.assert_allclose(film.normal_compliance(x, 0.3) / uniaxial, 1, rtol=1e-8)
    np.testing.assert_allclose(0.7 * film.radial_compliance(x, 0.3) / x, 1, rtol=1e-8)
    np.testing.assert_allclose(film.coupling_compliance(x, 0.5) / x**2, 1, rtol=1e-8)
    # At nu = 1/4 the terms in x^2 cancel exactly and x^4 remains.
    np.testing.assert_allclose(film.coupling_compliance(x, 0.25) / (-(x**4) / 10.125), 1, rtol=1e-8)
    np.testing.assert_allclose(film.base_shear_from_pressure(x, 0.0) / (x**3 / 6), 1, rtol=1e-8)


@pytest.mark.parametrize("nu", RATIOS)
def test_the_base_carries_all_of_a_uniform_traction(nu: float) -> None:
    assert film.base_normal_from_pressure(0.0, nu) == pytest.approx(1, rel=1e-15)
    assert film.base_shear_from_shear(0.0, nu) == pytest.approx(1, rel=1e-15)
    assert film.base_shear_from_pressure(0.0, nu) == 0
    assert film.base_normal_from_shear(0.0, nu) == 0


@pytest.mark.parametrize("nu", RATIOS)
def test_corrections_are_the_compliances_minus_the_half_space(nu: float) -> None:
    x = np.linspace(0.0, 12.0, 60)
    pairs = (
        (film.normal_correction, film.normal_compliance, 1.0),
        (film.radial_correction, film.radial_compliance, 1.0),
        (film.coupling_correction, film.coupling_compliance, film.half_space_coupling(nu)),
    )
    for correction, compliance, limit in pairs:
        np.testing.assert_allclose(correction(x, nu), compliance(x, nu) - limit, atol=2e-15)


def test_responses_keep_the_shape_of_their_argument() -> None:
    assert film.normal_compliance(np.ones((2, 3)), 0.5).shape == (2, 3)
    assert film.base_normal_from_pressure(1.0, 0.5).shape == ()
