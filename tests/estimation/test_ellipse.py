"""An elliptic apparatus function: its response by harmonics, and its estimate from a raster."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.rasters import CENTRE, TailedEllipse, clean_raster, tailed_raster
from helpers.scans import CONVERSION, SIGMA, estimated, simulated

import memscal
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.estimation.ellipse import elliptic_columns, elliptic_departure

SEEDS = 40 if FULL else 5
LAYOUT = {"side": 17, "half": 4e-3}


def ellipse(e):
    """The elliptic Gaussian of this ellipticity."""
    size = np.hypot(*e)
    widths = SIGMA * np.sqrt([1 + size, 1 - size])
    return TailedEllipse(((1.0, 0.0, 0.0, *widths, np.arctan2(e[1], e[0]) / 2),))


def elliptic_scan(e, seed):
    """A raster through it, by direct convolution: not by harmonics."""
    scan = tailed_raster(seed=seed, noise=0.01, kernel=ellipse(e), **LAYOUT)
    return replace(scan, u_zz_errors=np.full(scan.u_zz.shape, scan.synthetic["noise"]))


def test_the_harmonics_are_the_convolution_with_an_elliptic_gaussian():
    e = (0.3, 0.2)
    expected = clean_raster(ellipse(e), **LAYOUT).ravel()
    estimate = estimated(elliptic_scan(e, 0))
    geometry = estimate.model.geometry(np.array(CENTRE))
    found = CONVERSION * elliptic_columns(estimate.model, geometry, SIGMA, np.array(e))[0][:, 0]
    np.testing.assert_allclose(found, expected, atol=2e-6 * expected.max())


def test_the_departure_from_the_round_gaussian_is_the_ellipse_less_it():
    x = np.linspace(-2e-3, 2e-3, 9)
    y = 0.7 * x
    round_ = unit_gaussian(np.hypot.outer(y, x), SIGMA)
    found = elliptic_departure(x, y, SIGMA, np.array([0.3, 0.2]))
    expected = ellipse((0.3, 0.2)).at(x, y[:, None]) - round_
    np.testing.assert_allclose(found, expected, atol=1e-12 * round_.max())


def test_the_columns_are_the_derivatives_of_the_response():
    estimate = estimated(simulated(raster=True, points=9))
    geometry = estimate.model.geometry(estimate.centres)
    here = np.array([0.2, -0.1])
    columns, shift = elliptic_columns(estimate.model, geometry, SIGMA, here)
    for i, step in ((2, np.array([1e-3, 0.0])), (3, np.array([0.0, 1e-3]))):
        above = elliptic_columns(estimate.model, geometry, SIGMA, here + step)[0][:, 0]
        below = elliptic_columns(estimate.model, geometry, SIGMA, here - step)[0][:, 0]
        slope = (above - below) / 2e-3
        np.testing.assert_allclose(columns[:, i], slope, atol=1e-4 * np.abs(slope).max())
    for i, step in enumerate(1e-6 * np.eye(2)):
        above, below = (
            elliptic_columns(
                estimate.model, estimate.model.geometry(estimate.centres + way), SIGMA, here
            )[0][:, 0]
            for way in (step, -step)
        )
        slope = (above - below) / 2e-6
        np.testing.assert_allclose(shift[i], slope, atol=1e-4 * np.abs(slope).max())


def test_an_ellipse_is_found_with_an_uncertainty_that_is_true():
    truth = (0.25, -0.15)
    rows = []
    for seed in range(SEEDS):
        estimate = estimated(elliptic_scan(truth, seed))
        fit = estimate.gaussian
        variance = np.diag(fit.covariance(estimate.weights, estimate.noise_scale))
        rows.append([[*fit.ellipticity, fit.sigma], np.sqrt(variance[[-2, -1, 1]])])
    values, stated = np.array(rows).swapaxes(0, 1)
    low, high = root_mean_square_range(SEEDS, 1e-5)
    scatter = root_mean_square((values - [*truth, SIGMA]) / stated)
    # The calibration states the same of each scan, to a hundredth.
    assert np.all(scatter < 1.09 * high)
    assert np.all(scatter[:2] > low / 1.18)
    scan = elliptic_scan(truth, SEEDS - 1)
    p = memscal.calibrate(scan, method="bayesian").apparatus.parameters
    for i, name in enumerate(("ellipticity", "ellipticity_diagonal", "gaussian_sigma")):
        assert p[name] == pytest.approx(values[-1, i], abs=0.01 * stated[-1, i])
        assert p.uncertainty(name) == pytest.approx(stated[-1, i], rel=0.01)
