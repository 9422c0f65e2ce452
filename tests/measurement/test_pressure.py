"""Shapes of pressure: closed forms against quadrature, fits against least squares."""

import math

import numpy as np
import pytest
from helpers import scans as made
from helpers.bounds import FULL
from helpers.scans import EXACT_FILM
from scipy.optimize import least_squares
from scipy.special import jv

from memscal.axisymmetry.hankel import gauss_between
from memscal.estimation.points import measured_points
from memscal.measurement.posterior import PressureShape, pressure_shapes, weighed_shapes
from memscal.measurement.restore import gaussian_pressure
from memscal.mechanics.film_response import base_response

K = np.linspace(0.0, 6e3, 41)
WIDTH = 1.1e-3


def hankel(order, profile, r, weights):
    return np.asarray(jv(order, np.multiply.outer(K, r)) @ (2 * np.pi * weights * r * profile))


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.5])
@pytest.mark.parametrize("shear", [0.0, -0.4])
def test_the_transform_is_that_of_pressure_and_shear_through_the_film(exponent, shear):
    radius = WIDTH * math.sqrt(2 * (exponent + 2))
    r, weights = gauss_between(np.linspace(0.0, radius, 40), 16)
    pressure = (1 - (r / radius) ** 2) ** exponent
    pressure /= 2 * np.pi * np.sum(weights * r * pressure)
    outward = shear * pressure * r / (2 * WIDTH)
    x = K * EXACT_FILM.thickness
    nu = EXACT_FILM.poisson_ratio
    film, by_shear = base_response(x, nu)
    expected = film * hankel(0, pressure, r, weights)
    expected -= by_shear * hankel(1, outward, r, weights)
    shape = PressureShape(exponent, shear, EXACT_FILM)
    np.testing.assert_allclose(film * shape.transform(K, WIDTH)[0], expected, atol=1e-6)


def test_shapes_of_one_width_have_one_mean_square_radius():
    k = np.array([1.0])
    normal = [shape for shape in pressure_shapes(EXACT_FILM) if shape.shear == 0.0]
    assert len(normal) > 1
    for shape in normal:
        curvature = 2 * (1 - shape.transform(k, 1e-2)[0][0]) / k[0] ** 2
        assert curvature == pytest.approx(1e-4, rel=1e-4)


@pytest.mark.parametrize("seed", range(3 if FULL else 1))
def test_fits_and_likelihoods_of_shapes_are_those_of_least_squares(seed):
    scan = made.sphere_scan(made.pressed(), seed=seed)
    points = measured_points(scan)
    start = gaussian_pressure(scan, made.known_apparatus())
    reference = start.model.reference
    root = np.sqrt(start.weights)
    line = np.linspace(-1.0, 1.0, points.u.size)
    shapes = pressure_shapes(EXACT_FILM)
    count = float(start.outlier_weight.sum())
    for shape, weighed in zip(shapes, weighed_shapes(shapes, start), strict=True):

        def residual(theta, shape=shape):
            # By ln(force), ln(width), centre (mm), baseline and drift (mV).
            spectrum = (
                reference.values * shape.transform(reference.wavenumbers.k, np.exp(theta[1]))[0]
            )
            distance = np.abs(points.x - 1e-3 * theta[2])
            signal = scan.load * reference.wavenumbers.synthesise(spectrum, distance)
            background = 1e-3 * (theta[3] + theta[4] * line)
            return np.asarray(root * (np.exp(theta[0]) * signal + background - points.u))

        fit = weighed.reduced.fit
        units = np.array([fit.conversion_constant, fit.sigma, 1e-3, 1e-3, 1e-3])
        begin = [np.log(units[0]), np.log(units[1]), *(1e3 * np.r_[fit.centre[0, 0], fit.drift])]
        best = least_squares(residual, begin, "3-point", x_scale="jac", xtol=1e-12, ftol=1e-12)
        flat = root[:, None] * fit.jacobian * units
        step = np.linalg.lstsq(flat, root * (points.u - fit.predicted), rcond=None)[0]
        uncertainty = np.sqrt(np.diag(np.linalg.inv(flat.T @ flat)))
        assert np.all(np.abs(begin + step - best.x) < 0.01 * uncertainty)
        # Without departures, noise at its most likely: -2 ln p = nu ln(S/nu) + nu + ln |X'X|.
        freedom = count - 5
        loss = freedom * (np.log(2 * best.cost / freedom) + 1)
        loss += np.linalg.slogdet(best.jac.T @ best.jac)[1] + 3 * np.log(1e6)
        assert weighed.log_marginals[0] == pytest.approx(-loss / 2, abs=0.01)


@pytest.mark.parametrize("noise", [0.005, 0.02, 0.05])
def test_a_fit_that_does_not_settle_takes_the_gaussian(noise):
    # The slope by the width of a narrow pressure vanishes with the width: steps swing.
    contact = made.pressed(indenter=made.EXACT_ROD)
    for seed in range(8 if FULL else 4):
        scan = made.sphere_scan(contact, noise=noise, seed=seed)
        start = gaussian_pressure(scan, made.known_apparatus())
        root = np.sqrt(start.weights)
        for weighed in weighed_shapes(pressure_shapes(EXACT_FILM), start):
            fit = weighed.reduced.fit
            rest = root * (scan.u_zz - fit.predicted)
            step = np.linalg.lstsq(root[:, None] * fit.jacobian, rest, rcond=None)[0]
            gaussian = max(start.gaussian.sigma, 0.2 * start.points.step)
            assert abs(step[1]) < 2e-3 * fit.sigma or fit.sigma == gaussian
