"""The paper's white noise: its expectation, its draws, and what holds for any seed."""

import numpy as np
import pytest
from helpers.bounds import RARE, root_mean_square_range
from scipy.stats import gamma

from memscal import EvenGrid, Lattice
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.deconvolution.division import (
    DivisionProblem,
    WhiteNoise,
    WhiteNoiseDraw,
)


def square_lattice(count, step=0.5):
    axis = (np.arange(count) - count // 2) * step
    return Lattice(axis, axis)


def spike(grid, height):
    """A field of the same transform, ``height``, at every wavenumber."""
    field = np.zeros((grid.y.size, grid.x.size))
    field[0, 0] = height / grid.cell_area
    return field


def truncated_mean_bound(count, cut):
    """Largest error of the mean of ``count`` values 1/(z + n) cut off at |z + n| < ``cut``.

    For E|n|^2 = 1.  The density of z + n is at most 1/pi, so that E|1/(z + n)|^2 without the
    disc is at most 2 ln(1/cut) + 1; Bernstein's inequality bounds what is kept.  What is cut
    has, the density's slope being at most sqrt(2/e)/pi, an expectation of 2 sqrt(2/e) cut^2.
    """
    odds = np.log(4 / RARE)
    bernstein = np.sqrt(2 * (2 * np.log(1 / cut) + 1) * odds / count) + 2 * odds / (3 * cut * count)
    return float(np.sqrt(2) * bernstein + 2 * np.sqrt(2 / np.e) * cut**2)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_a_draw_scatters_around_the_expectation(ratio, seed):
    # Both fields are spikes: every component of the quotient is another draw of z/(z + n).
    grid = square_lattice(513)
    field = spike(grid, ratio)
    problem = DivisionProblem(grid, field, field, 0.0, 10.0)
    kept = []
    for draw in range(3):
        division = WhiteNoiseDraw(seed=seed + draw).divide(problem)
        quotient = grid.transfer(division.field)[:, 1:].ravel()
        kept.append(np.where(np.abs(quotient) < ratio / 0.02, quotient, 0.0))
    mean = np.concatenate(kept).mean()
    bound = ratio * truncated_mean_bound(3 * 513 * 256, 0.02)
    assert bound < 0.14
    np.testing.assert_allclose(division.window, 1 - np.exp(-(ratio**2)))
    assert abs(mean - (1 - np.exp(-(ratio**2)))) < bound


@pytest.mark.parametrize("amplitude", [0.3, 1.0, 4.0])
def test_the_noise_has_the_spectral_amplitude_that_it_claims(amplitude, seed):
    # No voltage, and a stress of unit transform without noise: the quotient is the noise.
    # By Parseval the sum of its squares is that of the pixels' normal deviates.
    grid = square_lattice(101, 0.03)
    # So weak a reference brings no noise of its own.
    problem = DivisionProblem(grid, spike(grid, 0.0), spike(grid, 1.0), 7e-3, 1e-100)
    image = WhiteNoiseDraw(amplitude=amplitude, seed=seed).divide(problem).field
    spectrum = np.fft.fft2(image) * grid.cell_area
    s = amplitude * 0.1 * 7e-3
    low, high = root_mean_square_range(101**2, RARE) ** 2
    assert low < np.mean(np.abs(spectrum) ** 2) / s**2 < high
    # White: within a circle of wave vectors there is as much of it as outside.
    frequency = np.fft.fftfreq(101)
    inner = np.hypot.outer(frequency, frequency) < 0.3
    inner[0, 0] = False
    pairs = int(inner.sum()) // 2
    low, high = gamma.ppf([RARE, 1 - RARE], pairs) / pairs
    assert low < np.mean(np.abs(spectrum[inner]) ** 2) / s**2 < high


@pytest.mark.parametrize(("weakest", "error"), [(1e-3, 0.03), (1e-5, 5e-3), (1e-7, 1e-3)])
def test_without_noise_the_quotient_is_the_kernel_up_to_what_the_window_takes(
    on_each_grid, weakest, error
):
    gaussians = on_each_grid(weakest)
    division = WhiteNoise().divide(gaussians.problem)
    # By Parseval the error is the kernel's power behind the window.
    lost = gaussians.kernel_transform * (1 - division.window)
    if isinstance(gaussians.problem.grid, EvenGrid):
        sides = np.full(lost.shape[0], 2.0)
        sides[0] = sides[-1] = 1.0
        weights = np.multiply.outer(sides, sides)
    else:
        weights = np.full(lost.shape, 2.0)
        weights[:, 0] = 1.0
    expected = np.sqrt(np.sum(weights * lost**2) / np.sum(weights * gaussians.kernel_transform**2))
    assert gaussians.error(division) == pytest.approx(expected, rel=2e-2)
    assert gaussians.error(division) < error


@pytest.mark.parametrize("seed", range(3))
def test_a_draw_on_a_quarter_plane_convolves_back_as_its_quotient_says(seed):
    # One period for the quotient, another for the convolution: ripples that reach the edge, as all
    # of a draw's do, would leak into the band by half a percent.
    narrow = 0.9e-3
    wide = 1.06e-3
    weakest = 1e-3
    k = np.sqrt(-2 * np.log(weakest)) / narrow
    grid = EvenGrid(129, 1e-4)
    least = float(np.exp(-0.5 * (k * wide) ** 2))
    fields = (unit_gaussian(grid.radius, width) for width in (wide, narrow))
    problem = DivisionProblem(grid, *fields, least, weakest)
    back = grid.convolve(WhiteNoiseDraw(seed=seed).divide(problem).field, problem.reference)
    assert np.abs(back - problem.voltage).max() < 5e-4 * problem.voltage.max()


def test_a_seed_gives_the_same_draw_and_another_seed_another(gaussians, seed):
    problem = gaussians().problem
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    first = WhiteNoiseDraw(seed=seed).divide(problem).field
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    np.random.seed(seed % 1000)  # noqa: NPY002  # the global state is what must not matter
    np.testing.assert_array_equal(first, WhiteNoiseDraw(seed=seed).divide(problem).field)
    assert not np.array_equal(first, WhiteNoiseDraw(seed=seed + 1).divide(problem).field)
