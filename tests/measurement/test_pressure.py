"""Shapes of pressure: closed forms against quadrature, and what the film makes of a shear."""

import math

import numpy as np
import pytest
from helpers.scans import EXACT_FILM
from scipy.special import jv

from memscal.axisymmetry.hankel import gauss_between
from memscal.measurement.posterior import PressureShape, pressure_shapes
from memscal.mechanics.film_response import base_normal_from_pressure, base_normal_from_shear

K = np.linspace(0.0, 6e3, 41)
WIDTH = 1.1e-3


def hankel(order: int, profile: np.ndarray, r: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.asarray(jv(order, np.multiply.outer(K, r)) @ (2 * np.pi * weights * r * profile))


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.5])
@pytest.mark.parametrize("shear", [0.0, -0.4])
def test_the_transform_is_that_of_pressure_and_shear_through_the_film(exponent, shear) -> None:
    radius = WIDTH * math.sqrt(2 * (exponent + 2))
    r, weights = gauss_between(np.linspace(0.0, radius, 40), 16)
    pressure = (1 - (r / radius) ** 2) ** exponent
    pressure /= 2 * np.pi * np.sum(weights * r * pressure)
    outward = shear * pressure * r / (2 * WIDTH)
    x, nu = K * EXACT_FILM.thickness, EXACT_FILM.poisson_ratio
    film = base_normal_from_pressure(x, nu)
    expected = film * hankel(0, pressure, r, weights)
    expected -= base_normal_from_shear(x, nu) * hankel(1, outward, r, weights)
    shape = PressureShape(exponent, shear, EXACT_FILM)
    np.testing.assert_allclose(film * shape.transform(K, WIDTH)[0], expected, atol=1e-6)


@pytest.mark.parametrize("shape", pressure_shapes(EXACT_FILM), ids=str)
def test_widening_is_the_derivative_by_the_width(shape: PressureShape) -> None:
    step = 1e-4 * WIDTH
    difference = shape.transform(K, WIDTH + step)[0] - shape.transform(K, WIDTH - step)[0]
    slope = shape.transform(K, WIDTH)[1]
    np.testing.assert_allclose(slope * WIDTH, difference / 2e-4, atol=1e-6)


def test_shapes_of_one_width_have_one_mean_square_radius() -> None:
    k = np.array([1.0])
    normal = [shape for shape in pressure_shapes(EXACT_FILM) if shape.shear == 0.0]
    assert len(normal) > 1
    for shape in normal:
        curvature = 2 * (1 - shape.transform(k, 1e-2)[0][0]) / k[0] ** 2
        assert curvature == pytest.approx(1e-4, rel=1e-4)
