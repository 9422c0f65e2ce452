"""Kernels against quadrature in the plane: closed transform and radial function are a pair."""

import numpy as np
import pytest
from helpers.machine import assert_same_to_rounding
from hypothesis import given
from hypothesis import strategies as st

from memscal import GaussianMixture, SmoothedDisc
from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import InputError


@given(shares=st.lists(st.floats(-2, 2), min_size=0, max_size=3), data=st.data())
def test_a_mixture_and_its_transform_belong_together(shares, data):
    weights = (*shares, 1.0 - sum(shares))
    widths = data.draw(
        st.lists(st.floats(0.2e-3, 1e-3), min_size=len(weights), max_size=len(weights))
    )
    mixture = GaussianMixture(weights, tuple(widths))
    r = np.linspace(0.0, 9e-3, 800)
    k = np.array([0.0, 0.5e3, 2e3, 6e3])
    radial = hankel_transform(r, mixture.radial(r), k)
    np.testing.assert_allclose(radial, mixture.transform(k), atol=1e-6 * np.abs(weights).sum())
    assert mixture.transform(np.zeros(1))[0] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(("weights", "sigmas", "problem"), [
    ((0.5, 0.4), (1e-3, 1e-3), "add up to 0.9, not to 1"),
    ((0.5, 0.5), (1e-3,), "2 weights do not fit 1 widths"), ((), (), "0 weights"),
    ((1.0,), (0.0,), "above zero"),
    ((1.0,), (np.inf,), "above zero"), ((1.0,), (np.nan,), "above zero"),
    ((float("nan"),), (1e-3,), "add up to nan"),
])  # fmt: skip
def test_a_mixture_that_is_no_apparatus_function_is_refused(weights, sigmas, problem):
    with pytest.raises(InputError, match=problem):
        GaussianMixture(weights, sigmas)


def blurred_disc(radius, sigma, r):
    """Add up the Gaussians of every point of a disc: Gauss' rule outward, even angles around."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    q = 0.5 * radius * (nodes + 1)
    angle = 2 * np.pi * np.arange(400) / 400
    x = np.multiply.outer(q, np.cos(angle))
    y = np.multiply.outer(q, np.sin(angle))
    area = (0.5 * radius * weights * q)[:, None] * 2 * np.pi / 400
    square = ((r[:, None, None] - x) ** 2 + y**2) / sigma**2
    density = np.exp(-0.5 * square) / (2 * np.pi * sigma**2)
    return np.sum(area * density, axis=(1, 2)) / (np.pi * radius**2)


@pytest.mark.parametrize(
    ("radius", "sigma"), [(0.8e-3, 0.3e-3), (1.0e-3, 0.08e-3), (0.1e-3, 0.5e-3)]
)
def test_a_disc_is_the_sum_of_its_points_gaussians(radius, sigma):
    disc = SmoothedDisc(radius=radius, sigma=sigma)
    r = np.linspace(0.0, radius + 8 * sigma, 25)
    summed = blurred_disc(radius, sigma, r)
    np.testing.assert_allclose(disc.radial(r), summed, atol=1e-12 * summed.max())
    assert_same_to_rounding(disc.radial(-r), disc.radial(r))


@given(radius=st.floats(0.1e-3, 2e-3), sigma=st.floats(0.1e-3, 1e-3))
def test_a_disc_and_its_transform_belong_together(radius, sigma):
    disc = SmoothedDisc(radius=radius, sigma=sigma)
    r = np.linspace(0.0, radius + 8 * sigma, 1500)
    k = np.array([0.0, 0.5e3, 2e3, 6e3])
    np.testing.assert_allclose(hankel_transform(r, disc.radial(r), k), disc.transform(k), atol=1e-6)


def test_a_disc_of_no_size_is_its_gaussian_and_one_far_away_is_zero():
    r = np.linspace(0.0, 3e-3, 31)
    point = SmoothedDisc(radius=1e-9, sigma=0.5e-3)
    gaussian = GaussianMixture((1.0,), (0.5e-3,))
    np.testing.assert_allclose(point.radial(r), gaussian.radial(r), atol=1e-10 / 0.5e-3**2)
    far = SmoothedDisc(radius=0.8e-3, sigma=0.3e-3).radial(np.array([[50e-3], [0.5]]))
    np.testing.assert_allclose(far, 0.0, atol=1e-12 / 0.8e-3**2)
    assert point.radial(np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("radius", "sigma", "problem"),
    [
        (0.0, 0.3e-3, "radius of the disc"),
        (float("nan"), 0.3e-3, "radius of the disc"),
        (0.8e-3, -0.3e-3, "width of the Gaussian that blurs the disc"),
        (0.8e-3, np.inf, "width of the Gaussian that blurs the disc"),
    ],
)
def test_a_disc_without_a_size_is_refused(radius, sigma, problem):
    with pytest.raises(InputError, match=problem):
        SmoothedDisc(radius=radius, sigma=sigma)
