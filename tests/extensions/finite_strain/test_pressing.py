"""The film at finite strain: closed forms, balances, and the linear model where strain is small."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from helpers.paper import FILM, ROD, SPHERE, film

from memscal import Contact, Rod, indent
from memscal.errors import ConvergenceError
from memscal.extensions.finite_strain.film_elements import FilmElements, Rubber
from memscal.extensions.finite_strain.pressing import Face
from memscal.extensions.finite_strain.solve import solve_finite_strain
from memscal.mechanics.solver.step import Depth, Load
from memscal.progress import reporting

EDGE = 0.05e-3
RADII = np.array([0.0, 0.5, 1.0, 2.0]) * 1e-3


def film_of(nu=0.5, ratio=None):
    law = "neo-hookean" if ratio is None else "mooney-rivlin"
    return replace(FILM, poisson_ratio=nu, law=law, mooney_rivlin_ratio=ratio)


def cylinder(nu=0.5, ratio=None):
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 1.5, 5), np.linspace(0, 2, 4))
    return FilmElements(mesh, Rubber.of(film_of(nu, ratio)))


@pytest.fixture(scope="module", params=[False, True], ids=["sliding", "sticking"])
def pressed_rods(request):
    depths = (Depth(0.02e-3), Depth(0.04e-3), Depth(0.12e-3))
    return solve_finite_strain(FILM, ROD, depths, sticking=request.param, edge=EDGE, refinement=0.6)


@pytest.mark.parametrize("stretch", [0.5, 1.6])
def test_a_free_cylinder_is_compressed_as_the_closed_form_says(stretch):
    elements = cylinder()
    G = elements.material.shear_modulus
    R, Z = elements.nodes
    pressure = np.full(elements.size - 2 * elements.n, G / stretch - G)
    x = np.concatenate([(stretch**-0.5 - 1) * R, (stretch - 1) * Z, pressure])
    forces = elements.forces(x)
    # Neo-Hookean, incompressible: nominal stress G (stretch - 1/stretch^2), and nothing sideways.
    nominal = G * (stretch - stretch**-2)
    total = np.sum(forces[elements.n + elements.surface])
    assert total == pytest.approx(nominal * np.pi * 1.5**2, rel=1e-12)
    ends = np.concatenate([elements.surface, elements.base]) + elements.n
    assert np.max(np.abs(np.delete(forces, ends))) < 1e-12
    energy = G / 2 * (stretch**2 + 2 / stretch - 3) * np.pi * 1.5**2 * 2
    assert elements.energy(x) == pytest.approx(energy, rel=1e-12)
    stress = elements.nodal_stress(x)
    assert stress[..., 1] == pytest.approx(nominal * stretch, rel=1e-12)
    assert np.max(np.abs(stress[..., [0, 2, 3]])) < 1e-12


@pytest.mark.parametrize(("nu", "ratio"), [(0.0, None), (0.3, 0.7), (0.5, None), (0.5, 0.3)])
def test_the_tangent_is_the_derivative_of_the_forces(nu, ratio):
    elements = cylinder(nu, ratio)
    wave = np.sin(np.arange(elements.size) * 1.7)
    x = 0.03 * wave
    direction = np.cos(np.arange(elements.size) * 0.9)
    step = 1e-6
    change = (elements.forces(x + step * direction) - elements.forces(x - step * direction)) / 2
    assert elements.tangent(x) @ direction == pytest.approx(change / step, abs=1e-8)


@pytest.mark.parametrize("ratio", [None, 0.4])
def test_the_forces_are_the_derivative_of_the_energy_of_an_incompressible_film(ratio):
    elements = cylinder(ratio=ratio)
    x = 0.03 * np.sin(np.arange(elements.size) * 1.7)
    x[2 * elements.n :] = 0.0  # its multiplier does no work in the energy
    direction = np.cos(np.arange(elements.size) * 0.9)
    step = 1e-6
    direction[2 * elements.n :] = 0.0
    change = elements.energy(x + step * direction) - elements.energy(x - step * direction)
    assert elements.forces(x) @ direction == pytest.approx(change / (2 * step), rel=1e-7)


@pytest.mark.parametrize("ratio", [0.0, 0.5, 2.0])
def test_simple_shear_of_a_mooney_rivlin_film_is_the_closed_form(ratio):
    rubber = Rubber.of(film_of(ratio=ratio))
    gamma = 0.8
    F = np.array([1.0, gamma, 0.0, 1.0, 1.0])
    rr, zz, hoop, rz = rubber.cauchy(F, np.zeros(()))
    assert rubber.shear_modulus == pytest.approx(FILM.shear_modulus * 1e-6, rel=1e-12)
    assert rz == pytest.approx(rubber.shear_modulus * gamma, rel=1e-12)
    assert rr - hoop == pytest.approx(2 * rubber.c1 * gamma**2, rel=1e-12)
    assert zz - hoop == pytest.approx(-2 * rubber.c2 * gamma**2, abs=1e-12)


@pytest.mark.parametrize(("nu", "sticking"), [(0.3, False), (0.5, False), (0.5, True)])
def test_a_lightly_pressed_sphere_is_that_of_the_linear_model(nu, sticking):
    tip = {"sticking": sticking, "refinement": 0.6}
    (state,) = solve_finite_strain(film(nu), SPHERE, (Load(0.1),), **tip)
    friction = np.inf if sticking else 0.0
    linear = indent(film(nu), SPHERE, load=0.1, friction=friction, loading="total")
    assert state.load == pytest.approx(0.1, rel=1e-9)
    assert state.depth == pytest.approx(linear.depth, rel=5e-3)
    highest = linear.base_stress(0.0)
    assert state.base_stress(RADII) == pytest.approx(
        linear.base_stress(RADII), abs=3e-3 * float(highest)
    )
    assert state.base_shear(RADII) == pytest.approx(
        linear.base_shear(RADII), abs=3e-3 * float(highest)
    )


@pytest.mark.parametrize("sticking", [False, True])
def test_a_hardly_pressed_rod_is_that_of_the_linear_model(sticking):
    # Only the flat part of its end touches then: a rod of that radius.
    (state,) = solve_finite_strain(
        FILM,
        ROD,
        (Depth(1e-10),),
        sticking=sticking,
        edge=EDGE,
        refinement=2.0 if sticking else 1.4,
    )
    linear = indent(
        FILM, Rod(radius=ROD.radius - EDGE), depth=1e-10, friction=np.inf if sticking else 0.0
    )
    # The stress at the edge of the flat is singular, and the mesh no finer than the rounding's.
    assert state.load == pytest.approx(linear.load, rel=5e-3)
    per_load = state.base_stress(RADII) / state.load
    expected = linear.base_stress(RADII) / linear.load
    assert per_load == pytest.approx(expected, abs=1e-3 * float(expected[0]))
    k = np.linspace(200.0, 1500.0, 5)
    shear = linear.base_shear_spectrum(k) / linear.load
    per_load = state.base_shear_spectrum(k) / state.load
    assert per_load == pytest.approx(shear, abs=0.02 * np.abs(shear).max())


def test_the_base_carries_the_load(pressed_rods):
    for state in pressed_rods:
        elements = state.inside.pressing.elements
        forces = elements.forces(state.inside.pressed.x)
        assert np.sum(forces[elements.base + elements.n]) == pytest.approx(state.load, rel=1e-9)
        assert state.base_spectrum(np.zeros(1))[0] == pytest.approx(state.load, rel=1e-5)


def test_the_departure_of_the_base_stress_grows_linearly_at_first(pressed_rods):
    once, twice, _ = pressed_rods
    (hardly,) = solve_finite_strain(
        FILM, ROD, (Depth(1e-8),), sticking=bool(np.isinf(once.friction)), edge=EDGE, refinement=0.6
    )
    k = np.array([1500.0])
    light, medium, heavy = (
        state.base_spectrum(k)[0] / state.load for state in (hardly, once, twice)
    )
    assert abs(medium / light - 1) > 1e-4
    assert (heavy / light - 1) / (medium / light - 1) == pytest.approx(2.0, rel=0.25)


def test_the_work_of_the_rod_is_the_energy_of_the_film(pressed_rods):
    last = pressed_rods[-1]
    assert last.work == pytest.approx(last.elastic_energy, rel=1e-3)


def test_the_film_drapes_itself_around_the_rod(pressed_rods):
    deepest = pressed_rods[-1]
    r, depression, outward = deepest.inside.displacements
    moved = (r + outward) * 1e3
    above = (deepest.depth - depression) * 1e3
    _, gap = Face(0.25, 0.05).nearest(moved, above)
    assert gap.min() > -1e-9
    assert deepest.contact_radius == pytest.approx(ROD.radius, rel=0.03)
    assert np.all(deepest.traction.pressures >= 0)


def test_a_sticking_sphere_moves_nothing_outward_and_a_sliding_one_does():
    r = np.linspace(0.0, 1e-3, 11)
    depths = (Depth(20e-6), Depth(20.5e-6))
    slides, deeper = solve_finite_strain(FILM, SPHERE, depths, refinement=0.5)
    (sticks,) = solve_finite_strain(FILM, SPHERE, (Depth(20e-6),), sticking=True, refinement=0.5)
    assert np.max(np.abs(sticks.surface_outward(r))) < 1e-12
    assert np.max(np.abs(slides.surface_outward(r))) > 1e-7
    assert sticks.load > slides.load
    assert sticks.work is None
    work = (slides.load + deeper.load) / 2 * (deeper.depth - slides.depth)
    assert deeper.work - slides.work == pytest.approx(work, rel=1e-3)
    assert np.max(np.abs(slides.traction.shears)) < 1e-6 * np.max(slides.traction.pressures)


def test_a_frictionless_film_comes_back_the_way_it_went():
    loads = (Load(0.34), Load(0.5), Load(0.34))
    shares = []
    with reporting(lambda progress: shares.append(progress.done / progress.total)):
        up, deeper, back = solve_finite_strain(FILM, SPHERE, loads, refinement=0.5)
    assert np.all(np.diff(shares) > 0)
    assert (shares[0] > 0, shares[-1]) == (True, pytest.approx(1.0))
    assert back.depth == pytest.approx(up.depth, rel=1e-6)
    assert deeper.depth > up.depth


def test_a_load_that_cannot_be_reached_gives_the_last_state_that_was():
    depths = (Depth(0.02e-3), Depth(1.98e-3))
    with pytest.raises(ConvergenceError, match="No equilibrium") as caught:
        solve_finite_strain(FILM, ROD, depths, sticking=True, edge=0.2e-3, refinement=0.2)
    assert f"Under the rod of radius {ROD.radius * 1e3:.4g} mm" in str(caught.value)
    assert "friction inf" not in str(caught.value)  # it sticks
    last = caught.value.last
    assert isinstance(last, Contact)
    assert 0.02e-3 < last.depth < 1.98e-3
    assert last.elastic_energy > 0
    assert np.isinf(last.convergence)
