"""The rod problem against closed forms, tables and an independent integral equation."""

import numpy as np
import pytest
from scipy.special import j0, j1

from memscal.axisymmetry.hankel import gauss_panels
from memscal.errors import ConvergenceError, DomainError
from memscal.mechanics import film_response, rod
from memscal.mechanics.rod import solve_rod


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("ratio", [0.125, 1.0, 2.0])
def test_frictionless_rod_solves_the_fredholm_equation(ratio, nu):
    # phi(t) + int K(t,s) phi(s) ds = 1 on (0, a), by Nystrom's method; kappa is phi's mean.
    t, t_weights = gauss_panels(1.0, 0.25)
    k, k_weights = gauss_panels(25.0 * ratio, 0.5)
    cosines = np.cos(np.outer(t, k))
    layer = k_weights * film_response.corrections(k / ratio, nu)[0]
    kernel = 2 / np.pi * (cosines * layer) @ cosines.T
    phi = np.linalg.solve(np.eye(t.size) + kernel * t_weights, np.ones(t.size))
    solution = solve_rod(ratio, nu, sticking=False)
    assert solution.stiffness_factor == pytest.approx(t_weights @ phi, rel=1e-10)
    found = 2 * np.pi * solution.traction(1.0, 1.0).pressure_transform(k)
    np.testing.assert_allclose(found, cosines.T @ (t_weights * phi) / (t_weights @ phi), atol=1e-10)


@pytest.mark.parametrize(
    ("nu", "sticking"),
    [
        *((nu, False) for nu in (0.0, 0.2, 0.5)),
        *((nu, True) for nu in (0.0, 0.2, 0.4, 0.49)),
    ],
)
def test_a_very_thick_film_is_a_half_space(nu, sticking):
    # Boussinesq: P = 2 E* a delta; the film's correction is of the order a/h.
    # Mossakovskii, Spence: P = 4 G a delta ln(3 - 4 nu)/(1 - 2 nu), where the film sticks.
    exact = 1.0
    near = 1e-7
    if sticking:
        exact = (1 - nu) * np.log(3 - 4 * nu) / (1 - 2 * nu)
        near = 3e-6
    assert solve_rod(1e-8, nu, sticking=sticking).stiffness_factor == pytest.approx(exact, abs=near)


@pytest.mark.parametrize(("sticking", "factor"), [(False, 3 / 64), (True, 3 / 16)])
def test_a_thin_incompressible_film_is_lubricated_flow(sticking, factor):
    # Reynolds: kappa -> factor pi (a/h)^3, the rod seeming wider by about one thickness;
    # the fourth root removes that edge when extrapolated in h/a.
    ratios = np.array([10.0, 20.0])
    kappa = [solve_rod(ratio, 0.5, sticking=sticking).stiffness_factor for ratio in ratios]
    root = (np.array(kappa) / (factor * np.pi * ratios**3)) ** 0.25
    assert 2 * root[1] - root[0] == pytest.approx(1, abs=3e-3)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_a_sticking_compressible_film_has_settled_to_its_stated_convergence(nu):
    solution = solve_rod(0.5, nu, sticking=True)
    assert solution.convergence < 1e-5
    finer = rod._solve(0.5, nu, True, terms=256, order=16)
    change = abs(solution.stiffness_factor / finer.stiffness_factor - 1)
    assert change < solution.convergence


@pytest.mark.parametrize(("nu", "sticking"), [(0.5, False), (0.5, True), (0.3, True)])
def test_transforms_belong_to_the_tractions(nu, sticking):
    traction = solve_rod(0.5, nu, sticking=sticking).traction(2.0, 3.0)
    theta, weights = gauss_panels(np.pi / 2, 0.02)  # r = a sin(theta) resolves the edge
    r = 2.0 * np.sin(theta)
    weights = weights * r * 2.0 * np.cos(theta)
    for k in np.array([[0.0], [0.3], [1.1], [2.9]]):
        pressure = np.sum(weights * traction.pressure(r) * j0(k * r))
        shear = np.sum(weights * traction.shear(r) * j1(k * r))
        scale = 3.0 / (2 * np.pi)
        assert pressure == pytest.approx(traction.pressure_transform(k)[0], abs=1e-7 * scale)
        assert shear == pytest.approx(traction.shear_transform(k)[0], abs=1e-7 * scale)


def test_a_solution_that_has_not_settled_is_not_given_away(monkeypatch):
    monkeypatch.setattr(rod, "_MOST_TERMS", 16)
    with pytest.raises(ConvergenceError, match="in the last refinement"):
        solve_rod(37.5, 0.5, sticking=False)


def test_a_rod_too_wide_for_this_solution_is_refused():
    with pytest.raises(DomainError, match="101 times the film's thickness"):
        solve_rod(101.0, 0.5, sticking=False)
