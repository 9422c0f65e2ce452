"""Division by a spectral window: the quotient, the window, and the formulas of the windows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import expm1

from memscal import EvenGrid, Lattice
from memscal.deconvolution.division import (
    DivisionProblem,
    Tikhonov,
    WhiteNoise,
    filtered_division,
)

SEEDS = st.integers(0, 2**32 - 1)


def small_lattice():
    return Lattice((np.arange(9) - 4) * 0.5, (np.arange(7) - 3) * 0.4)


def random_problem(seed, grid):
    """A random kernel behind a stress whose transform has no zero."""
    rng = np.random.default_rng(seed)
    shape = grid.radius.shape
    spectrum = grid.forward(rng.normal(size=shape))
    reference = grid.inverse(spectrum + 2.0 * np.abs(spectrum).max())
    if isinstance(grid, Lattice):
        reference = np.fft.ifftshift(reference)  # its axis at the lattice's first point
    kernel = rng.normal(size=shape)
    return DivisionProblem(grid, grid.convolve(kernel, reference), reference, 1.0, 1.0), kernel


@pytest.mark.parametrize("grid", [EvenGrid(9, 0.5), small_lattice()], ids=["quarter", "lattice"])
@given(seed=SEEDS)
def test_a_window_scales_each_component_of_the_quotient(grid, seed):
    problem, kernel = random_problem(seed, grid)
    window = np.exp(-grid.wavenumber / 5)
    division = filtered_division(problem, window)
    expected = window * grid.transfer(kernel)
    np.testing.assert_allclose(grid.transfer(division.field), expected, atol=1e-9)
    np.testing.assert_array_equal(division.window, window)
    opened = filtered_division(problem, np.ones_like(window))
    np.testing.assert_allclose(opened.field, kernel, atol=1e-9)


def test_components_behind_a_closed_window_are_left_out_even_if_nothing_is_there():
    grid = EvenGrid(9, 0.5)
    reference = grid.inverse(np.where(grid.wavenumber < 4.0, 1.0, 0.0))
    window = np.where(grid.wavenumber < 3.0, 1.0, 1e-10)
    division = filtered_division(DivisionProblem(grid, reference, reference, 1.0, 1.0), window)
    expected = np.where(grid.wavenumber < 3.0, 1.0, 0.0)
    np.testing.assert_allclose(grid.forward(division.field), expected, atol=1e-12)


@given(amplitude=st.floats(1e-2, 1e2), weakest=st.floats(1e-4, 0.5))
def test_both_windows_are_the_formulas_that_they_state(amplitude, weakest):
    grid = EvenGrid(33, 0.25)
    reference = np.exp(-(grid.radius**2) / 2) / (2 * np.pi)
    problem = DivisionProblem(grid, reference, reference, 1.0, weakest)
    z2 = np.exp(-(grid.wavenumber**2))
    s2 = (0.1 * amplitude * weakest) ** 2
    tikhonov = Tikhonov(amplitude=amplitude).divide(problem).window
    np.testing.assert_allclose(tikhonov, z2 / (z2 + s2), atol=1e-9)
    white = WhiteNoise(amplitude=amplitude).divide(problem).window
    # Where z has sunk into rounding, at 1e-16, so has the window: at 1e-32/s^2.
    np.testing.assert_allclose(white, -expm1(-z2 / s2), atol=1e-9)


@given(seed=SEEDS)
def test_the_window_of_an_image_is_what_is_left_of_each_component(seed):
    grid = small_lattice()
    problem, kernel = random_problem(seed, grid)
    window = np.exp(-grid.wavenumber / 5)
    image = grid.to_image(grid.inverse(window * grid.transfer(kernel)))
    division = problem.restored(image)
    np.testing.assert_array_equal(division.field, image)
    np.testing.assert_allclose(division.window, window, atol=1e-6)
