"""Both grids against complex FFTs, direct sums, closed forms and linear convolution."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from memscal.axisymmetry.grids import EvenGrid, Lattice, on_grid
from memscal.axisymmetry.hankel import radial_spline
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.errors import InputError

SEEDS = st.integers(0, 2**32 - 1)


def centred_axis(count, step, offset=0.0):
    return (np.arange(count) - count // 2) * step + offset


def random_field(seed):
    """A lattice of a random size, step and place, and a field on it."""
    rng = np.random.default_rng(seed)
    axes = [
        centred_axis(2 * n + 1, rng.uniform(0.1, 2.0), rng.normal())
        for n in rng.integers(2, 9, size=2)
    ]
    return Lattice(*axes), rng.normal(size=(axes[1].size, axes[0].size))


@given(count=st.integers(3, 24), spacing=st.floats(1e-5, 10.0), seed=SEEDS)
def test_a_quarter_plane_gives_the_complex_transform_of_its_mirrored_plane(count, spacing, seed):
    grid = EvenGrid(count, spacing)
    quarter = np.random.default_rng(seed).normal(size=(count, count))
    # One period of the plane, which the two edges share: 2 (count - 1) points from the axis on.
    whole = np.concatenate([quarter, quarter[-2:0:-1]], axis=0)
    whole = np.concatenate([whole, whole[:, -2:0:-1]], axis=1)
    full = np.fft.fft2(whole) * spacing**2
    scale = np.abs(full).max()
    np.testing.assert_allclose(full.imag, 0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(grid.forward(quarter), full.real[:count, :count], atol=1e-12 * scale)
    ky = 2 * np.pi * np.abs(np.fft.fftfreq(2 * (count - 1), spacing))[:count]
    np.testing.assert_allclose(grid.wavenumber, np.hypot.outer(ky, ky), rtol=1e-12)


@given(count=st.integers(2, 12), seed=SEEDS)
def test_an_integral_counts_each_pixel_of_the_image_once(count, seed):
    grid = EvenGrid(count, 0.7)
    field = np.random.default_rng(seed).normal(size=(count, count))
    image = grid.to_image(field)
    assert image.shape == (2 * count - 1, 2 * count - 1)
    assert grid.integrate(field) == pytest.approx(image.sum() * 0.7**2, abs=1e-9)
    np.testing.assert_array_equal(image[count - 1 :, count - 1 :], field)
    np.testing.assert_array_equal(image, image[::-1])
    np.testing.assert_array_equal(image, image[:, ::-1])
    np.testing.assert_array_equal(grid.from_image(image), field)


@given(seed=SEEDS)
def test_a_lattice_gives_the_direct_sum_about_its_first_point(seed):
    grid, field = random_field(seed)
    dy, dx = grid.spacing
    ky = 2 * np.pi * np.fft.fftfreq(grid.y.size, dy)
    kx = 2 * np.pi * np.fft.fftfreq(grid.x.size, dx)[: grid.x.size // 2 + 1]
    waves_y = np.exp(-1j * np.multiply.outer(ky, grid.y - grid.y[0]))
    direct = waves_y @ field @ np.exp(-1j * np.multiply.outer(grid.x - grid.x[0], kx)) * dx * dy
    np.testing.assert_allclose(grid.forward(field), direct, atol=1e-9 * np.abs(direct).max())
    np.testing.assert_allclose(grid.wavenumber, np.hypot.outer(ky, np.abs(kx)), atol=1e-12)


@given(seed=SEEDS)
def test_what_a_lattice_inverts_it_transforms_back_about_the_central_point(seed):
    grid, field = random_field(seed)
    spectrum = grid.forward(field)
    centred = grid.inverse(spectrum)
    np.testing.assert_allclose(grid.transfer(centred), spectrum, atol=1e-10)
    # It is the same field, its first point now in the middle.
    assert centred[grid.y.size // 2, grid.x.size // 2] == pytest.approx(field[0, 0], abs=1e-12)
    np.testing.assert_allclose(np.sort(centred.ravel()), np.sort(field.ravel()), atol=1e-12)
    assert grid.to_image(field) is field
    assert grid.from_image(field) is field


@given(seed=SEEDS, factor=st.sampled_from([1, 3, 5]))
def test_a_refined_kernel_keeps_its_values_and_its_integral(seed, factor):
    grid, kernel = random_field(seed)
    fine, values = grid.refined(kernel, factor)
    assert values.shape == (fine.y.size, fine.x.size)
    assert fine.x[fine.x.size // 2] == fine.y[fine.y.size // 2] == 0.0
    # Every factor-th point from the central one on is an old point.
    old_y = np.arange(-(grid.y.size // 2), grid.y.size // 2 + 1) * factor + fine.y.size // 2
    old_x = np.arange(-(grid.x.size // 2), grid.x.size // 2 + 1) * factor + fine.x.size // 2
    np.testing.assert_allclose(values[np.ix_(old_y, old_x)], kernel, atol=1e-11)
    before = kernel.sum() * grid.cell_area
    after = values.sum() * fine.cell_area
    assert after == pytest.approx(before, abs=1e-9)


def test_a_refined_gaussian_is_a_gaussian():
    grid = Lattice(centred_axis(31, 0.5), centred_axis(25, 0.6))
    fine, values = grid.refined(unit_gaussian(grid.radius, 1.0), 5)
    np.testing.assert_allclose(values, unit_gaussian(fine.radius, 1.0), atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_lifting_then_cutting_gives_the_profile_back(seed):
    rng = np.random.default_rng(seed)
    grid = EvenGrid(65, 0.1)
    weights = rng.normal(size=4)
    widths = rng.uniform(0.6, 2.0, size=4)

    def profile(r):
        return np.exp(-((r[..., None] / widths) ** 2) / 2) @ weights

    r = rng.uniform(0.0, 6.4, size=200)
    back = radial_spline(grid.axis, on_grid(profile, grid, 0.02)[0])(r)
    np.testing.assert_allclose(back, profile(r), atol=3e-5 * np.abs(weights).sum())
    whole = Lattice(centred_axis(129, 0.1), centred_axis(129, 0.1))
    lifted = grid.to_image(on_grid(profile, grid, 0.02))
    np.testing.assert_allclose(on_grid(profile, whole, 0.02), lifted, atol=1e-12)


def test_a_lattice_without_a_central_point_is_refused():
    with pytest.raises(InputError, match="no central point"):
        Lattice(np.arange(8) * 0.1, np.arange(7) * 0.2)
