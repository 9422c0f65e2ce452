"""An elliptic apparatus function: its response by harmonics, and its estimate from a raster."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import CONVERSION, SIGMA, estimated, simulated
from scipy.signal import fftconvolve
from scipy.stats import chi2

import memscal
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.estimation.ellipse import elliptic_columns, elliptic_departure
from memscal.model.scan import Scan

SEEDS = 40 if FULL else 5
AXIS = np.arange(-160, 161) * 0.05e-3
BASE = {"raster": True, "points": 17, "half_range": 4e-3}


@lru_cache
def unblurred() -> tuple[Scan, np.ndarray]:
    """The layout of the raster, and the rod's stress on a fine grid."""
    base = simulated(**BASE, noise=0.0, baseline=0.0, drift=0.0)
    contact = memscal.indent(base.film, base.indenter, load=base.load)
    r = np.linspace(0.0, 17e-3, 2001)
    return base, np.interp(np.hypot.outer(AXIS, AXIS), r, contact.base_stress(r))


@lru_cache
def clean_scan(e: tuple[float, float]) -> Scan:
    """A raster through an elliptic Gaussian, convolved on a fine grid: not by harmonics."""
    base, stress = unblurred()
    step = AXIS[1] - AXIS[0]
    kernel = elliptic_departure(AXIS, AXIS, SIGMA, np.array(e))
    kernel = kernel + unit_gaussian(np.hypot.outer(AXIS, AXIS), SIGMA)
    field = CONVERSION * fftconvolve(stress, kernel, mode="same") * step**2
    # The raster's points lie on the fine grid, but for the centre: 0.15 mm, three of its steps.
    places = np.rint((base.x - 0.15e-3) / step).astype(int) + 160
    return replace(base, u_zz=field[np.ix_(places, places)], synthetic=None)


def elliptic_scan(e: tuple[float, float], noise: float, seed: int = 0) -> Scan:
    """The same with noise."""
    base = clean_scan(e)
    clean = base.u_zz
    errors = np.full(clean.shape, noise * clean.max())
    u = clean + np.random.default_rng(seed).normal(size=clean.shape) * errors
    return replace(base, u_zz=u, u_zz_errors=errors if noise else None)


def test_the_harmonics_are_the_convolution_with_an_elliptic_gaussian() -> None:
    e = (0.3, 0.2)
    scan = elliptic_scan(e, noise=0.0)
    estimate = estimated(simulated(**BASE))
    geometry = estimate.model.geometry(np.array([0.15e-3, 0.15e-3]))
    found = CONVERSION * elliptic_columns(estimate.model, geometry, SIGMA, np.array(e))[0][:, 0]
    np.testing.assert_allclose(found, scan.u_zz.ravel(), atol=2e-4 * scan.u_zz.max())


def test_the_columns_are_the_derivatives_of_the_response() -> None:
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


def test_an_ellipse_is_found_with_an_uncertainty_that_is_true() -> None:
    truth = (0.25, -0.15)
    rows = []
    for seed in range(SEEDS):
        estimate = estimated(elliptic_scan(truth, 0.01, seed))
        fit = estimate.gaussian
        variance = np.diag(fit.covariance(estimate.weights, estimate.noise_scale))
        rows.append([[*fit.ellipticity, fit.sigma], np.sqrt(variance[[-2, -1, 1]])])
    values, stated = np.array(rows).swapaxes(0, 1)
    low, high = np.sqrt(chi2.isf([1 - 1e-5, 1e-5], SEEDS) / SEEDS)
    scatter = np.sqrt(np.mean(((values - [*truth, SIGMA]) / stated) ** 2, axis=0))
    # The calibration states the same of each scan, to a hundredth.
    assert np.all(scatter < 1.09 * high)
    assert np.all(scatter[:2] > low / 1.18)
    scan = elliptic_scan(truth, 0.01, SEEDS - 1)
    p = memscal.calibrate(scan, method="bayesian").apparatus.parameters
    for i, name in enumerate(("ellipticity", "ellipticity_diagonal", "gaussian_sigma")):
        assert p[name] == pytest.approx(values[-1, i], abs=0.01 * stated[-1, i])
        assert p.uncertainty(name) == pytest.approx(stated[-1, i], rel=0.01)
