"""Scans of many points: the results of few points' matrices, without matrices over the points."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import simulate, with_outlier
from scipy.linalg import toeplitz

import memscal
from memscal.calibration import field_uncertainty
from memscal.errors import InputError
from memscal.estimation import forward, profile, residuals, smoothing, voltage_map

LINE = simulate(noise=0.005, seed=1)
RASTER = simulate(noise=0.005, seed=1, raster=True, points=9)


def correlated(scan):
    near = toeplitz(0.3 ** np.arange(scan.x.size))
    noise = np.full(scan.u_zz.shape, 0.005 * np.ptp(scan.u_zz))
    return replace(scan, u_zz_correlation=near, u_zz_errors=noise)


def correlated_with_neighbours(scan, width):
    """The same noise, stated for neighbours alone; its correlation ends after ``width`` points."""
    x = scan.x.size
    apart = np.arange(x)
    whole = toeplitz(np.where(apart < width, 0.3**apart, 0.0))
    columns = [np.append(np.diag(whole, j), np.zeros(j)) for j in range(width)]
    peak = np.nanmax(scan.u_zz)
    scan = replace(scan, u_zz_errors=np.full(scan.u_zz.shape, 0.005 * peak))
    both = whole, np.stack(columns, axis=1)
    return [replace(scan, u_zz_correlation=correlation) for correlation in both]


def test_correlation_of_neighbours_is_that_of_all_pairs():
    u = simulate(noise=0.005, seed=3, repeats=2).u_zz.copy()
    u[0, 5] = np.nan
    u[1, 30:33] = np.nan
    scan = replace(simulate(noise=0.005, seed=3, repeats=2), u_zz=u)
    whole, banded = (
        memscal.calibrate(s).apparatus.parameters for s in correlated_with_neighbours(scan, 4)
    )
    u_stated = np.sqrt(np.diag(whole.covariance))
    assert np.abs((whole.values - banded.values) / u_stated).max() < 2e-6
    assert (
        np.abs((whole.covariance - banded.covariance) / np.outer(u_stated, u_stated)).max() < 2e-6
    )


@pytest.mark.parametrize(
    ("band", "found"),
    [
        (np.tile([1.0, 0.9], (65, 1)), "beyond the end"),
        (np.r_[np.tile([1.0, 0.9], (64, 1)), [[1.0, 0.0]]], "not positive definite"),
        (np.r_[np.tile([2.0, 0.1], (64, 1)), [[2.0, 0.0]]], "first column"),
        (np.ones((64, 2)), "should be (65, 65), or (65, w)"),
    ],
)
def test_a_correlation_of_neighbours_that_is_none_is_refused(band, found):
    with pytest.raises(InputError) as refusal:
        replace(LINE, u_zz_correlation=band)
    assert found in str(refusal.value)


def with_a_tail(raster):
    """The raster of a sensor that is not round, but has a tail along x."""
    return replace(raster, u_zz=raster.u_zz + 0.3 * np.roll(raster.u_zz, 2, axis=1))


CASES = {
    "line": (LINE, {}),
    "repeats": (simulate(noise=0.005, seed=2, repeats=5), {}),
    "repeats with centres": (
        simulate(noise=0.005, seed=2, repeats=3),
        {"centre": "per-repeat"},
    ),
    "correlated noise": (correlated(LINE), {}),
    "correlated with neighbours": (correlated_with_neighbours(LINE, 4)[1], {}),
    "outlier": (with_outlier(LINE, (..., 20), 0.3), {}),
    "loads": ([simulate(noise=0.005, seed=i, load=0.1 * i) for i in (1, 2, 3)], {}),
    "source": (LINE, {"reference": "disc:0.4mm"}),
    "raster": (with_a_tail(RASTER), {}),
}


@pytest.mark.parametrize(
    ("name", "method"), [*((name, "white-noise") for name in CASES), ("line", "bayesian")]
)
def test_many_points_give_the_results_of_whole_matrices(name, method, monkeypatch):
    scan, options = CASES[name]
    apparatus = []
    for dense, block in ((10**9, 10**9), (10, 67)):
        for module in (forward, profile, residuals, smoothing):
            monkeypatch.setattr(module, "DENSE", dense)
        for module in (forward, voltage_map, field_uncertainty):
            monkeypatch.setattr(module, "BLOCK", block)
        apparatus.append(memscal.calibrate(scan, method=method, **options).apparatus)
    whole, reduced = apparatus
    # The smoothing parameter of a division is at a maximum, found to the root of the rounding.
    tolerance = 2e-6 if method == "white-noise" else 1e-9
    u = np.sqrt(np.diag(whole.parameters.covariance))
    difference = np.subtract(whole.parameters.values, reduced.parameters.values)
    assert np.abs(difference / u).max() < tolerance
    correlation = (whole.parameters.covariance - reduced.parameters.covariance) / np.outer(u, u)
    assert np.abs(correlation).max() < tolerance
    for ours, theirs in (
        (whole.radial_profile.g, reduced.radial_profile.g),
        (whole.radial_profile.g_errors, reduced.radial_profile.g_errors),
        (whole.field.g_errors, reduced.field.g_errors),
        (whole.transfer.modulus_errors, reduced.transfer.modulus_errors),
    ):
        assert np.abs(ours - theirs).max() < tolerance * np.abs(ours).max()
    for ours, theirs in zip(whole.checks, reduced.checks, strict=True):
        # The difference of both methods is a check of either.
        assert theirs.value == pytest.approx(ours.value, rel=2e-6, abs=2e-6)


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is read from /proc")
def test_memory_grows_with_the_points_not_with_their_square():
    program = (
        "import memscal\n"
        "scan = memscal.simulate(points=30_001, seed=1)\n"
        "print(memscal.calibrate(scan).apparatus.gaussian_sigma)\n"
        "print(open('/proc/self/status').read().split('VmHWM:')[1].split()[0])\n"
    )
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    sigma, peak = map(float, told.stdout.split())
    assert sigma == pytest.approx(0.561e-3, rel=0.005)
    # In kB.  A matrix over points and 100 columns has 24 MB, one over the points 7 GB.
    assert peak < 500e3
