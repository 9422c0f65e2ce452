"""Scans of many points: the results of few points' matrices, without matrices over the points."""

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.rasters import tailed_raster

import memscal
from memscal.calibration import field_uncertainty, fields
from memscal.estimation import forward, gaussian, profile, residuals, smoothing, voltage_map
from memscal.model.scan import Scan

LINE = memscal.simulate(noise=0.005, seed=1)


def correlated(scan: Scan) -> Scan:
    apart = np.abs(np.subtract.outer(np.arange(scan.x.size), np.arange(scan.x.size)))
    noise = np.full(scan.u_zz.shape, 0.005 * np.ptp(scan.u_zz))
    return replace(scan, u_zz_correlation=0.3**apart, u_zz_errors=noise)


def with_an_outlier(scan: Scan) -> Scan:
    u = scan.u_zz.copy()
    u[..., 20] += 0.3 * np.ptp(u)
    return replace(scan, u_zz=u)


CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "line": (LINE, {}),
    "repeats": (memscal.simulate(noise=0.005, seed=2, repeats=5), {}),
    "repeats with centres": (
        memscal.simulate(noise=0.005, seed=2, repeats=3), {"centre": "per-repeat"},
    ),
    "correlated noise": (correlated(LINE), {}),
    "outlier": (with_an_outlier(LINE), {}),
    "loads": ([memscal.simulate(noise=0.005, seed=i, load=0.1 * i) for i in (1, 2, 3)], {}),
    "source": (LINE, {"reference": "disc:0.4mm"}),
    "raster": (tailed_raster(seed=1, side=21), {}),
}  # fmt: skip


@pytest.mark.parametrize("method", ["white-noise", "bayesian"])
@pytest.mark.parametrize("name", CASES)
def test_many_points_give_the_results_of_whole_matrices(
    name: str, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan, options = CASES[name]
    apparatus = []
    for dense, block in ((10**9, 10**9), (10, 17)):
        for module in (forward, gaussian, profile, residuals, smoothing, fields):
            monkeypatch.setattr(module, "DENSE", dense)
        for module in (forward, smoothing, voltage_map, field_uncertainty):
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
        # Which of the points at one place are dropped is arbitrary.
        if ours.name != "residual_runs":
            # The difference of both methods is a check of either.
            assert theirs.value == pytest.approx(ours.value, rel=2e-6, abs=2e-6)


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is told in other units")
def test_memory_grows_with_the_points_not_with_their_square() -> None:
    program = (
        "import resource, memscal\n"
        "scan = memscal.simulate(points=100_001, noise=0.005, seed=1)\n"
        "print(memscal.calibrate(scan).apparatus.gaussian_sigma)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
    )
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    sigma, peak = map(float, told.stdout.split())
    assert sigma == pytest.approx(0.561e-3, rel=0.005)
    # In kB.  A matrix over points and 100 columns has 80 MB, one over the points 80 GB.
    assert peak < 700e3
