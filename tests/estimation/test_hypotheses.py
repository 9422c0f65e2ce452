"""The model's assumptions: false alarms are as rare as stated, and real departures are found."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import CENTRE, CONVERSION, as_points, estimated, simulated
from scipy.stats import binom, chi2

from memscal.estimation.model_tests import (
    axisymmetry_test,
    hysteresis_test,
    linearity_test,
    symmetry_test,
)
from memscal.model.checks import chi_square_limit
from memscal.model.scan import Scan

BOTH = {"repeats": 2, "points": 33, "branch": ["approach", "retreat"]}


@pytest.mark.parametrize(
    ("test", "options"),
    [
        (symmetry_test, {}),
        (linearity_test, {"load": [0.5, 1.5], "points": 33}),
        (hysteresis_test, BOTH),
        (hysteresis_test, BOTH | {"state_noise": False}),
    ],
)
def test_a_true_hypothesis_is_rejected_as_rarely_as_chance_demands(test, options) -> None:
    scans = 80 if FULL else 16
    extra = [test(estimated(simulated(seed=seed, **options))) for seed in range(scans)]
    rejected = sum(chi2.sf(columns.fall, columns.count) < 0.1 for columns in extra)
    # A tenth of good scans fall below p = 0.1, within what a binomial allows once in 1e6.
    low, high = binom.ppf([1e-6, 1 - 1e-6], scans, 0.1)
    assert low <= rejected <= high


def test_a_tilted_rod_is_found() -> None:
    scan = simulated(noise=0.002)
    side = scan.x - 0.14e-3
    bump = 0.05 * scan.u_zz.max() * (side / 1e-3) * np.exp(-((side / 1.2e-3) ** 2))
    odd = symmetry_test(estimated(replace(scan, u_zz=scan.u_zz + bump)))
    assert odd.fall > chi_square_limit(odd.count)


def test_linearity_and_hysteresis_are_tested_only_where_loads_and_branches_differ() -> None:
    assert linearity_test(estimated(simulated())) is None
    for branch in (["approach", ""], ["retreat", "retreat"]):
        assert hysteresis_test(estimated(simulated(**BOTH | {"branch": branch}))) is None


def hysteretic(seed: int, conversion: float = 0.0, play: float = 0.0, step: float = 0.0) -> Scan:
    """Two scans, of sensors that differ in A and centre, as approach and retreat of one."""
    rows = [
        simulated(
            seed=2 * seed + i,
            noise=0.002,
            baseline=0.0,
            drift=0.0,
            conversion_constant=CONVERSION * (1 + side * conversion),
            centre=(CENTRE + side * play, 0.0),
        )
        for i, side in enumerate((0.5, -0.5))
    ]
    u, errors = (np.stack([getattr(row, name) for row in rows]) for name in ("u_zz", "u_zz_errors"))
    u += np.array([[0.5], [-0.5]]) * step
    return replace(rows[0], u_zz=u, u_zz_errors=errors, branch=BOTH["branch"])


@pytest.mark.parametrize("differences", [(0.01, 0.0, 0.0), (0.0, -20e-6, 0.0), (0.0, 0.0, 1e-4)])
def test_a_hysteresis_is_found_and_measured_within_its_uncertainty(differences) -> None:
    scans = 40 if FULL else 8
    extra = [hysteresis_test(estimated(hysteretic(seed, *differences))) for seed in range(scans)]
    assert all(columns.fall > chi_square_limit(3) for columns in extra)
    z = np.array([(columns.coefficients - differences) / columns.errors for columns in extra])
    low, high = chi2.ppf([1e-6, 1 - 1e-6], scans)
    assert np.all((low < np.sum(z**2, axis=0)) & (np.sum(z**2, axis=0) < high))
    found = hysteresis_test(estimated(as_points(hysteretic(0, *differences))))
    np.testing.assert_allclose(found.coefficients, extra[0].coefficients, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("eta", [-0.05, 0.1])
def test_a_gain_that_changes_with_load_is_measured(eta: float) -> None:
    scan = simulated(load=[0.5, 1.0, 1.5], noise=0.002, baseline=0.0, drift=0.0)
    bent = scan.u_zz * (1 + eta * (scan.normal_load - 1.0))
    linear = linearity_test(estimated(replace(scan, u_zz=bent)))
    assert linear.fall > chi_square_limit(1)
    # First order in eta, and what departures absorb of it.
    assert linear.coefficients[0] == pytest.approx(eta, abs=5 * linear.errors[0] + 0.3 * abs(eta))


def test_a_round_sensor_passes_and_an_elliptic_one_is_found() -> None:
    scan = simulated(raster=True, points=17, noise=0.003)
    even = axisymmetry_test(estimated(scan))
    assert even.fall < chi2.isf(1e-6, even.count)
    dx = scan.x[None, :] - 0.14e-3
    dy = scan.y[:, None]
    lobes = (dx**2 - dy**2) / 1e-6 * np.exp(-(dx**2 + dy**2) / 3e-6)
    oval = replace(scan, u_zz=scan.u_zz + 0.02 * scan.u_zz.max() * lobes)
    uneven = axisymmetry_test(estimated(oval))
    assert uneven.fall > chi_square_limit(uneven.count)
    assert uneven.size == pytest.approx(0.02 * np.abs(lobes).max(), rel=0.5)
