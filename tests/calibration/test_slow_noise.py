"""Noise that may be correlated along a scan: found, counted where no noise is stated, and said."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import simulated

import memscal
from memscal.calibration.calibrate import calibrate, uncertainties
from memscal.estimation.residuals import residuals_of
from memscal.estimation.slow_noise import slow_noise

A = "conversion_constant"
SIGMA = "gaussian_sigma"


def scan_with(noise, *, stated=None, repeats=1):
    """Return a simulated scan with this noise (n,), in shares of its largest signal."""
    exact = simulated(noise=0.0, repeats=repeats)
    top = np.abs(exact.u_zz).max()
    u = exact.u_zz + top * noise[: exact.u_zz.size].reshape(exact.u_zz.shape)
    errors = None if stated is None else np.full(u.shape, stated * top)
    return replace(exact, u_zz=u, u_zz_errors=errors, synthetic=None)


def slow(length, seed):
    """Return noise of 0.5 % whose correlation falls off over so many steps; white at zero."""
    place = np.arange(200)
    correlation = np.exp(-np.abs(np.subtract.outer(place, place)) / max(length, 1e-2))
    noise = np.linalg.cholesky(correlation) @ np.random.default_rng(seed).standard_normal(200)
    return np.asarray(0.005 * noise)


def meaning(calibration):
    """Return what the check of neighbouring residuals says."""
    checks = {check.name: check for check in calibration.apparatus.checks}
    return checks["residual_correlation"].meaning


def told(calibration):
    """Return what is said where no noise is stated."""
    messages = calibration.apparatus.process.messages
    return next(message.text for message in messages if message.kind == "noise_unstated")


def growth(calibration):
    """Return u(sigma) over what it is for white noise."""
    solution = calibration.solution
    white = replace(solution, estimate=replace(solution.estimate, slow=None))
    results = uncertainties(white, white.deconvolution, calibration.effects, {})
    parameters = calibration.apparatus.parameters
    return parameters.uncertainty(SIGMA) / results.parameters.uncertainty(SIGMA)


def test_a_correlation_is_found_said_and_widens_the_uncertainty():
    calibration = calibrate(scan_with(slow(10, 3), repeats=3))
    found = calibration.solution.estimate.slow
    assert found is not None
    assert found.probability > 0.999
    assert 5 < found.length < 25
    assert found.share > 0.75
    assert growth(calibration) > 1.15
    expected = f"and that of sigma {growth(calibration):.3g} times as large"
    assert expected in told(calibration)
    assert expected in meaning(calibration)
    # Its covariance is that of the noise, and passes are independent.
    root = found.covariance.correlate(np.eye(195))
    covariance = root @ root.T
    assert covariance[20, 21] / covariance[20, 20] == pytest.approx(np.exp(-0.1), abs=0.12)
    assert covariance[64, 65] == 0


def test_the_likelihood_is_that_of_contrasts():
    # By the data that no apparatus function explains, in any orthonormal basis of them.
    estimate = calibrate(scan_with(slow(3, 1))).solution.estimate
    residuals = residuals_of(estimate)
    count = residuals.values.size
    whole = np.eye(count) - residuals.basis @ residuals.basis.T
    contrasts = np.linalg.svd(whole)[0][:, : residuals.degrees]
    data = contrasts.T @ residuals.values
    apart = np.abs(np.subtract.outer(residuals.place, residuals.place))
    evidence = []
    for length in (3, 10, 30):
        for share in (0.1, 0.5, 0.9):
            correlation = (1 - share) * np.eye(count) + share * np.exp(-apart / length)
            covariance = contrasts.T @ correlation @ contrasts
            square = data @ np.linalg.solve(covariance, data)
            determinant = np.linalg.slogdet(covariance)[1]
            evidence.append(-(determinant + residuals.degrees * np.log(square)) / 2)
    white = -residuals.degrees * np.log(data @ data) / 2
    odds = 0.3 / 0.7 * np.mean(np.exp(np.array(evidence) - white))
    found = slow_noise(estimate, residuals)
    assert found is not None
    assert found.probability == pytest.approx(odds / (1 + odds), rel=1e-6)


def test_noise_that_is_stated_as_white_is_told_of_but_not_widened():
    calibration = calibrate(scan_with(slow(10, 3), stated=0.005, repeats=3))
    assert growth(calibration) == 1
    assert "is not counted, as the noise is stated, but would make" in meaning(calibration)
    assert not calibration.apparatus.effective_degrees
    assert calibration.apparatus.coverage_factor(A) == 2


@pytest.mark.parametrize(("stated", "state"), [(None, "measured"), (0.005, "assumed")])
def test_the_assumption_is_measured_where_no_noise_is_stated(stated, state):
    calibration = calibrate(scan_with(slow(0, 1), stated=stated))
    assert {a.name: a.state for a in calibration.assumptions}["noise_correlation"] == state


def test_a_stated_correlation_and_an_exact_scan_are_left_alone():
    exact = scan_with(np.zeros(99))
    assert calibrate(exact).solution.estimate.slow is None
    white = np.eye(exact.u_zz.size)
    stated = calibrate(replace(scan_with(slow(0, 1)), u_zz_correlation=white))
    assert stated.solution.estimate.slow is None
    assert "Its correlation is not estimated." in told(stated)


def test_effective_degrees_are_those_of_welch_and_satterthwaite(tmp_path):
    calibration = calibrate(scan_with(slow(0, 1)))
    apparatus = calibration.apparatus
    # Conversion constant, width, centre, baseline and drift are fitted.
    degrees = apparatus.reconvolution.x.size - 5
    for name, budget in apparatus.budget.items():
        share = budget["noise"] / apparatus.parameters.uncertainty(name)
        assert apparatus.effective_degrees[name] == pytest.approx(degrees / share**4, rel=0.01)
    apparatus.save(tmp_path / "a.h5")
    read = memscal.load_apparatus(tmp_path / "a.h5")
    assert read.effective_degrees == pytest.approx(apparatus.effective_degrees)
    written = calibration.to_dict()
    assert written["effective_degrees"] == apparatus.effective_degrees
    assert f"{apparatus.coverage_factor(A):.3g} and " in str(calibration)


@pytest.mark.parametrize(("degrees", "factor"), [(1, 13.97), (5, 2.65), (10, 2.28), (50, 2.05)])
def test_coverage_factors_are_those_of_the_gum(degrees, factor):
    # JCGM 100:2008, table G.2, 95.45 %.
    apparatus = calibrate(simulated()).apparatus
    process = replace(apparatus.process, configuration={"effective_degrees": {A: degrees}})
    found = replace(apparatus, process=process).coverage_factor(A)
    assert found == pytest.approx(factor, abs=0.005)
