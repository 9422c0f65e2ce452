"""Speed of a calibration beside the plain way."""

import numpy as np
import pytest
from helpers.machine import show, turns
from helpers.scans import LINEAR_FILM, simulate
from scipy.optimize import curve_fit

import memscal
from memscal.axisymmetry.kernels import unit_gaussian

WIDTH = 16e-3


@pytest.fixture(scope="module")
def scan():
    return simulate(film=LINEAR_FILM, points=65, noise=0.002, centre=(0.0, 0.0), drift=0.0, seed=4)


@pytest.fixture(scope="module")
def reference(scan):
    return memscal.indent(scan.film, scan.indenter, load=scan.load).profile()


def plain_pipeline(scan, reference):
    """The paper's steps as plainly as they can be written: lift, add noise, divide, fit."""
    pixels = 512
    rng = np.random.default_rng(0)
    axis = (np.arange(pixels) - pixels // 2) * (2 * WIDTH / pixels)
    r = np.hypot.outer(axis, axis)
    volts = (scan.u_zz + scan.u_zz[::-1])[scan.x.size // 2 :] / 2
    volts = volts - np.mean(volts[-3:])
    u = np.interp(r, scan.x[scan.x.size // 2 :], volts, right=0.0)
    sigma = np.interp(r, reference.r, reference.sigma_zz, right=0.0)
    pixel = 2 * WIDTH / pixels
    weakest = 0.02 * np.abs([u.sum(), sigma.sum()]) / pixels
    u = u + 0.1 * weakest[0] * rng.normal(size=u.shape)
    sigma = sigma + 0.1 * weakest[1] * rng.normal(size=u.shape)
    g = np.fft.fftshift(np.fft.ifft2(np.fft.fft2(u) / np.fft.fft2(sigma)).real) / pixel**2
    rows = slice(pixels // 2 - 100, pixels // 2 + 101)

    def bell(distance, constant, width):
        return constant * unit_gaussian(distance, width)

    fit, _ = curve_fit(bell, r[rows, rows].ravel(), g[rows, rows].ravel(), p0=(1e-7, 0.5e-3))
    return np.asarray(fit)


def test_a_calibration_costs_no_more_than_a_few_plain_pipelines(scan, reference):
    apparatus = memscal.calibrate(scan, reference=reference).apparatus
    assert apparatus.conversion_constant == pytest.approx(1e-7, rel=0.03)
    assert apparatus.gaussian_sigma == pytest.approx(561e-6, rel=0.03)
    # No centre, no baseline, no uncertainties, no checks: what a script of one page does.
    assert plain_pipeline(scan, reference) == pytest.approx([1e-7, 561e-6], rel=0.4)
    ratio = turns(
        lambda: memscal.calibrate(scan, reference=reference),
        lambda: plain_pipeline(scan, reference),
        rounds=7,
    )
    show("calibration, over a plain pipeline", ratio, 4)


def test_a_calibration_costs_as_much_as_it_has_points():
    # Beyond what a scan of few points costs; matrices over the points would cost 64 times as much.
    scans = [simulate(points=points, noise=0.003, seed=1) for points in (20_001, 160_001)]
    small, large = (lambda s=s: memscal.calibrate(s) for s in scans)
    show("calibration of 160,000 points, over 20,000", turns(large, small, rounds=2), 16)
    rasters = [simulate(points=side, raster=True, noise=0.003, seed=1) for side in (65, 129)]
    small, large = (lambda s=s: memscal.calibrate(s) for s in rasters)
    show("calibration of a raster of 129 x 129 points, over 65 x 65", turns(large, small, 2), 8)
