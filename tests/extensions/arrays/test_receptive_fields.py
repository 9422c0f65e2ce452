"""Receptive fields: the core's stress under a rod, balances of force and moment, derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.arrays import FILM, ROD, SIGMA, A, known_array

import memscal
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.extensions.arrays.array_data import ALL, KernelModes
from memscal.extensions.arrays.receptive_fields import receptive_fields
from memscal.mechanics.press_rod import press_rod

LINEAR = replace(FILM, law="linear")
NODES = Wavenumbers.covering(20 / FILM.thickness, 40e-3)
GRID = known_array(4, 4)


@pytest.fixture
def places(seed):
    return np.random.default_rng(seed).uniform(-5e-3, 5e-3, (40, 2))


def blurred(spectrum, array, places):
    """Readings per newton of a round stress, by its transform and a Gaussian G."""
    apart = np.linalg.norm(places[:, None] - array.places, axis=-1)
    alone = NODES.synthesise(spectrum * gaussian_transfer(NODES.k, SIGMA), apart)
    return A * alone @ array.crosstalk.T


@pytest.mark.parametrize(("film", "close"), [(LINEAR, 2e-5), (FILM, 6e-3)])
def test_a_rod_reads_the_stress_of_the_calibration_blurred_and_mixed(film, close, places):
    array = replace(GRID, film=film, reference=None)
    pressed = press_rod(film, ROD, 1.0)
    expected = blurred(pressed.base_spectrum(NODES.k), array, places)
    *_, found = receptive_fields(array, ROD).normal(places)
    np.testing.assert_allclose(found, expected, atol=close * expected.max())


def test_a_rod_reads_the_reference_of_the_calibration(places):
    stress = press_rod(LINEAR, ROD, 1.0).base_spectrum(GRID.k)
    *_, found = receptive_fields(replace(GRID, reference=1.05 * stress), ROD).normal(places)
    *_, linear = receptive_fields(replace(GRID, film=LINEAR), ROD).normal(places)
    np.testing.assert_allclose(found, 1.05 * linear, atol=1e-3 * linear.max())


@pytest.mark.parametrize("load", [0.1, 0.4, 1.3])
def test_a_rod_at_another_load_reads_what_the_law_of_the_film_makes_of_it(load, places):
    """A neo-Hookean film, calibrated at 1 N, against the finite-strain table of rods."""
    pressed = press_rod(FILM, ROD, load).base_spectrum(NODES.k) / load
    expected = blurred(pressed, GRID, places)
    fields = receptive_fields(replace(GRID, reference=None), ROD)
    *_, found = fields.normal(places, np.full(len(places), load))
    np.testing.assert_allclose(found, expected, atol=0.012 * expected.max())
    linear = press_rod(LINEAR, ROD, load).base_spectrum(NODES.k) / load
    # What is tested: without the law the field is off by more than that, at 0.1 N by 2 %.
    assert abs(found - blurred(linear, GRID, places)).max() > 0.012 * expected.max()


@pytest.mark.parametrize("load", [0.2, 1.0, 5.0])
def test_the_contact_radius_of_a_small_sphere_is_that_which_it_is_pressed_to(load):
    sphere = memscal.Sphere(radius=1e-3)
    fields = receptive_fields(replace(GRID, film=LINEAR), sphere)
    pressed = memscal.indent(LINEAR, sphere, load=load, strain="linear")
    assert fields.radius(load) == pytest.approx(pressed.contact_radius, rel=5e-3)
    assert load < fields.most < 10.0  # N, where it sinks into the film


@pytest.mark.parametrize("ratio", [0.3, 0.5])
def test_shear_moves_the_stress_by_its_moment_and_carries_no_force(ratio):
    film = replace(LINEAR, poisson_ratio=ratio)
    array = known_array(1, 2, pitch=60e-3, crosstalk=0.0)
    fields = receptive_fields(replace(array, film=film))
    step = 0.2e-3
    x = np.arange(-26e-3, 26e-3, step) + step / 2
    offsets = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    # The stress at an offset from the contact is what a sensor there reads.
    places = fields.centres[0] - offsets
    ones = np.ones(len(places))
    by_shear = fields.forward(places, ones, np.zeros((len(places), 2)))[1][:, 0, 3]
    moment = np.sum(by_shear * offsets[:, 0]) * step**2 / A
    assert moment == pytest.approx(film.thickness, rel=1e-2)
    assert abs(by_shear.sum()) * step**2 / A < 1e-6


def test_a_sphere_presses_as_hertz_says_on_a_thick_film(places):
    array = replace(GRID, film=replace(LINEAR, young_modulus=50e6))
    sphere = memscal.Sphere(radius=2e-3)
    force = np.full(len(places), 0.5)
    fields = receptive_fields(array, sphere)
    radius = (0.75 * 0.5 * sphere.radius / array.film.contact_modulus) ** (1 / 3)
    assert fields.radius(0.5) == pytest.approx(radius, rel=0.02)
    small, _ = fields.forward(places, force, np.zeros((len(places), 2)))
    *_, point = receptive_fields(array).normal(places)
    np.testing.assert_allclose(small, 0.5 * point, atol=2e-2 * point.max())


@pytest.mark.parametrize("indenter", [None, ROD, memscal.Sphere(radius=5e-3)])
def test_derivatives_are_those_of_the_readings(indenter, places):
    fields = receptive_fields(GRID, indenter)
    force = np.full(len(places), 0.7)
    shear = np.full((len(places), 2), [0.2, -0.1])

    def readings(state):
        return fields.forward(state[:, :2], state[:, 2], state[:, 3:])[0]

    state = np.column_stack([places, force, shear])
    _, slopes = fields.forward(places, force, shear)
    # A contact grows with the force, which the derivative by the force leaves out.
    close = [3e-3, 3e-3, 0.14, 3e-3, 3e-3]
    for i, step in enumerate([2e-5, 2e-5, 1e-3, 1e-3, 1e-3]):
        ahead = step * np.eye(5)[i]
        change = (readings(state + ahead) - readings(state - ahead)) / (2 * step)
        np.testing.assert_allclose(slopes[..., i], change, atol=close[i] * abs(change).max())


def test_errors_are_those_of_the_parameters(places):
    """The columns of an array with a unit root are its derivatives, times the steps."""
    change = (NODES.k * FILM.thickness) ** 2 * gaussian_transfer(NODES.k, SIGMA)
    modes = KernelModes(np.stack([change, change]), np.array([ALL, 5]))
    array = replace(GRID, modes=modes)
    q = len(array.pairs)
    n = 16
    p = 3 * n + q + 2
    array = replace(array, root=np.eye(p))
    force = np.full(len(places), 2.0)
    shear = np.full((len(places), 2), 0.1)
    found = receptive_fields(array).errors(places, force, shear)
    pairs = np.zeros((n, n))
    pairs[tuple(array.pairs[7])] = 1e-4
    step = 1e-6 * np.eye(n)[3]
    kernels = array.kernels + 1e-4 * change
    moved = {
        3: (replace(array, conversion_constants=A * (1 + 1e2 * step)), 1e-4),
        n + 3: (replace(array, centres=array.centres + np.outer(step, [1, 0])), 1e-6),
        2 * n + 3: (replace(array, centres=array.centres + np.outer(step, [0, 1])), 1e-6),
        3 * n + 7: (replace(array, crosstalk=array.crosstalk + pairs), 1e-4),
        3 * n + q: (replace(array, kernels=kernels), 1e-4),
    }
    before, _ = receptive_fields(array).forward(places, force, shear)
    for column, (other, size) in moved.items():
        after, _ = receptive_fields(other).forward(places, force, shear)
        expected = (after - before) / size
        close = 0.02 if column < 3 * n + q else 0.2  # the modes' shear is left out
        np.testing.assert_allclose(
            found[..., column], expected, atol=close * abs(expected).max(), err_msg=str(column)
        )


def test_a_film_that_is_thicker_than_stated_moves_no_contact_like_the_calibration(places):
    """Effects of the calibration and of the contact's own stress cancel."""
    film = replace(LINEAR, thickness_uncertainty=20e-6)
    array = replace(
        GRID, film=film, modes=KernelModes(np.zeros((1, NODES.k.size)), np.array([ALL]))
    )
    stress = press_rod(LINEAR, ROD, 1.0).base_spectrum(NODES.k)
    thicker = press_rod(replace(LINEAR, thickness=2.02e-3), ROD, 1.0).base_spectrum(NODES.k)
    kernel = gaussian_transfer(NODES.k, SIGMA)
    # Where the film passes nothing there is nothing to cancel.
    seen = stress > 1e-4
    change = np.where(seen, -kernel * (thicker - stress) / np.where(seen, stress, 1.0), 0.0)
    parameters = 3 * 16 + len(array.pairs) + 1
    effect = np.eye(parameters)[-1]
    array = replace(
        array,
        k=NODES.k,
        kernels=kernel[None],
        modes=KernelModes(change[None], np.array([ALL])),
        root=np.zeros((parameters, 1)),
        effects={"thickness": effect},
    )
    force = np.ones(len(places))
    still = np.zeros((len(places), 2))
    both = receptive_fields(array, ROD).errors(places, force, still)[..., -1]
    alone = receptive_fields(replace(array, film=LINEAR), ROD).errors(places, force, still)[..., -1]
    assert abs(both).max() < 0.02 * abs(alone).max()
