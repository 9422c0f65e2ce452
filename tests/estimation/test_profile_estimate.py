"""The estimated profile: noise, outliers, departures from a Gaussian, and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square_range
from helpers.scans import CONVERSION, RING, TAILS, estimated, simulated, with_outlier

import memscal
from memscal.errors import FitError
from memscal.estimation.bayesian import HYPOTHESES, weigh_departures
from memscal.estimation.departures import ReducedScan


def test_the_noise_is_found_from_the_scatter_alone():
    # Scans of about 60 degrees of freedom each: the pooled variance follows chi-square.
    seeds = range(40 if FULL else 20)
    ratios = []
    for seed in seeds:
        scan = simulated(noise=0.01, state_noise=False, seed=seed)
        ratios.append(estimated(scan).noise_scale / scan.synthetic["noise"])
    pooled = np.mean(np.square(ratios))
    low, high = root_mean_square_range(60 * len(seeds), 1e-6) ** 2
    # Down-weighted chance outliers and spent departures take up to three percent.
    assert low - 0.06 < pooled < high


def test_stated_noise_that_is_too_small_is_raised_and_never_lowered():
    scan = simulated(noise=0.01)
    small = replace(scan, u_zz_errors=scan.u_zz_errors / 3)
    large = replace(scan, u_zz_errors=scan.u_zz_errors * 3)
    assert 2.0 < estimated(small).noise_scale < 4.0
    assert estimated(large).noise_scale == 1.0


@pytest.mark.parametrize("height", [-1.0, 0.3, 5.0])
def test_an_outlier_is_found_weighed_down_and_moves_nothing(height):
    scan = simulated(noise=0.002)
    clean = estimated(scan)
    spoilt = estimated(with_outlier(scan, 20, height))
    assert spoilt.outlier_weight[20] < 1e-3
    assert np.sum(spoilt.outlier_weight < 0.5) <= 1 + np.sum(clean.outlier_weight < 0.5)
    shift = abs(spoilt.conversion_constant - clean.conversion_constant)
    assert shift < np.sqrt(
        spoilt.basis.integrals @ spoilt.weighed.covariance @ spoilt.basis.integrals
    )


def test_gross_outliers_leave_the_noise_as_it_is():
    ratios = []
    for seed in range(24 if FULL else 12):
        scan = simulated(noise=0.005, seed=seed)
        rng = np.random.default_rng(seed)
        chosen = rng.choice(scan.u_zz.size, 3, replace=False)
        off = np.zeros_like(scan.u_zz)
        off[chosen] = rng.choice([-1, 1], 3) * rng.uniform(0.1, 0.6, 3) * scan.u_zz.max()
        noises = [estimated(s).weighed.noise for s in (scan, replace(scan, u_zz=scan.u_zz + off))]
        ratios.append(noises[1] / noises[0])
    # Without three of 65 points the noise moves by some hundredths.
    assert np.max(ratios) < 1.15
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.02)


def test_a_scan_beside_the_sensor_is_refused():
    with pytest.raises(FitError, match="outside the scan"):
        estimated(simulated(centre=(8.4e-3, 0.0)))


def test_the_gain_is_the_derivative_of_the_estimate_by_the_voltages():
    scan = simulated(kernel=RING, noise=0.002, state_noise=False)
    estimate = estimated(scan)
    change = np.zeros_like(scan.u_zz)
    change[30] = 1e-3 * estimate.weighed.noise
    model = replace(estimate.model, points=replace(estimate.points, u=estimate.points.u + change))
    reduced = ReducedScan.of(model, estimate.gaussian, estimate.weights)
    count = float(estimate.outlier_weight.sum())
    again = weigh_departures(reduced, estimate.basis, count).average()
    profile = estimate.basis.radial(np.linspace(0.0, 3e-3, 31))
    expected = profile @ (estimate.weighed.gain @ change)
    found = profile @ (again.mean - estimate.weighed.mean)
    # The estimated noise moves, too, which the gain leaves out: by a few hundredths of the change.
    np.testing.assert_allclose(found, expected, atol=0.05 * np.abs(expected).max())


def test_noise_that_is_stated_too_large_widens_the_band_by_what_noise_does_and_no_more():
    """What the film hides does not grow with the noise: only its share of the band does."""
    # Nor does a straight baseline; of a curved one more noise leaves more open.
    scan = replace(simulated(noise=0.002), baseline_curvature_uncertainty=0.0)
    scans = [replace(scan, u_zz_errors=scan.u_zz_errors * factor) for factor in (1.0, 10.0)]
    found = [memscal.calibrate(stated, method="bayesian").apparatus for stated in scans]
    bands = [apparatus.radial_uncertainty(0.0) for apparatus in found]
    assert bands[0] < bands[1] < 3 * bands[0]


def test_stated_noise_is_the_least_that_the_evidence_takes():
    """Overstated, it says nothing against a Gaussian; understated, the scatter counts."""
    for seed in range(4):
        scan = simulated(noise=0.01, kernel=TAILS, seed=seed)
        scans = [replace(scan, u_zz_errors=scan.u_zz_errors * factor) for factor in (0.5, 1, 10)]
        under, stated, over = (estimated(s).weighed.probability[0] for s in scans)
        # Within a third of what the scan itself says, and within 0.01 of the prior.
        assert 0.3 * stated < under < 1.001 * stated
        assert stated < over == pytest.approx(HYPOTHESES[0].estimate, abs=0.01)


def test_a_scan_without_scatter_is_calibrated_at_the_noise_that_it_states():
    clean = simulated(noise=0.0)
    apparatus = memscal.calibrate(replace(clean, u_zz_errors=np.full(65, 1e-5))).apparatus
    assert apparatus.conversion_constant == pytest.approx(CONVERSION, rel=1e-3)
    assert apparatus.parameters.uncertainty("conversion_constant") > 1e-4 * CONVERSION
