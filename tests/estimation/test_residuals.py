"""Residuals that do not depend on G: exact size, no order, and real causes that break them."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import as_points, estimated, simulated, with_outlier
from scipy.stats import binom, chi2, f

from memscal.estimation.residuals import (
    Residuals,
    chi_square_test,
    free_model,
    neighbour_correlation_test,
    pure_error_test,
    residuals_of,
    ring_test,
    steps_test,
)


def made(values, passes=1):
    """Residuals that are independent already, but for a last point that takes one parameter."""
    n = values.size
    place = np.arange(n + 1)
    sequence = np.append(np.arange(n) * passes // n, passes)
    basis = (place == n)[:, None].astype(float)
    return Residuals(np.append(values, 0.0), basis, place, place, sequence, stated=True, degrees=n)


@pytest.mark.parametrize(
    "options", [{}, {"repeats": 3, "points": 33}, {"raster": True, "points": 17}]
)
def test_residuals_keep_the_misfit_s_size_and_lose_one_for_each_column(options):
    estimate = estimated(simulated(**options))
    model = free_model(estimate)
    residuals = residuals_of(estimate)
    misfit = model.data - model.design @ np.linalg.lstsq(model.design, model.data)[0]
    assert residuals.values @ residuals.values == pytest.approx(misfit @ misfit, rel=1e-6)
    assert residuals.degrees == model.data.size - model.design.shape[1]


def test_an_outlier_is_left_out_of_the_residuals():
    residuals = residuals_of(estimated(with_outlier(simulated(noise=0.005), 20, 0.5)))
    assert 20 not in residuals.point
    assert chi_square_test(residuals).p_value > 1e-6


def test_each_row_and_each_repeat_is_a_pass_of_its_own_in_the_order_of_the_scan():
    assert set(residuals_of(estimated(simulated(repeats=3, points=33))).sequence) == {0, 1, 2}
    estimate = estimated(simulated(raster=True, points=17))
    raster = residuals_of(estimate)
    assert set(raster.sequence) == set(range(17))
    assert (np.diff(raster.sequence) >= 0).all()
    assert (np.diff(estimate.points.x[raster.point])[np.diff(raster.sequence) == 0] > 0).all()


def test_the_chi_square_is_that_of_the_distribution():
    found = chi_square_test(made(np.array([1.0, -2.0, 0.5, 1.5])))
    assert found.value == pytest.approx(7.5 / 4)
    assert found.p_value == pytest.approx(chi2.sf(7.5, 4))
    assert found.limit == pytest.approx(chi2.isf(1e-3, 4) / 4)


def test_the_largest_step_is_that_of_a_mean_over_its_deviation():
    values = np.append(np.zeros(12), np.ones(4))
    found = steps_test(made(values))
    assert found.value == pytest.approx(2.0)
    assert found.p_value == pytest.approx(16 * chi2.sf(4.0, 1))
    assert found.limit == pytest.approx(np.sqrt(chi2.isf(1e-3 / 16, 1)))
    unstated = steps_test(replace(made(2 * values + np.tile([0.1, -0.1], 8)), stated=False))
    assert unstated.p_value == pytest.approx(16 * f.sf(unstated.value**2, 1, 15))
    assert (unstated.value > unstated.limit) == (unstated.p_value < 1e-3)


def test_neighbours_of_different_passes_are_no_neighbours():
    values = np.tile([1.0, 1.0, -1.0, -1.0], 5)
    assert steps_test(made(values, passes=10)).value == pytest.approx(np.sqrt(2))
    assert neighbour_correlation_test(made(values, passes=20)).value == 0.0


def test_the_neighbours_correlation_does_not_depend_on_the_noise_s_size():
    values = np.random.default_rng().normal(size=50)
    one, other = (neighbour_correlation_test(made(values * size)) for size in (1.0, 1e-6))
    assert one.limit == other.limit
    assert other.p_value == pytest.approx(one.p_value)


def pure_error(scan):
    estimate = estimated(scan)
    return pure_error_test(estimate, free_model(estimate))


@pytest.mark.parametrize("scatter", [0.0, 5e-6])
def test_repeats_take_the_place_of_stated_noise(scatter):
    """Where the stage comes to rest elsewhere each time, as well."""
    scans = 150 if FULL else 25
    level = 0.1
    p_values = []
    fine = simulated(points=2001, noise=0.0)
    for seed in range(scans):
        scan = simulated(repeats=3, points=33, state_noise=False, seed=seed)
        if scatter:
            scan = as_points(scan)
            x = scan.x + np.random.default_rng(seed).normal(scale=scatter, size=scan.x.size)
            moved = np.interp(x, fine.x, fine.u_zz) - np.interp(scan.x, fine.x, fine.u_zz)
            scan = replace(scan, x=x, u_zz=scan.u_zz + moved)
        p_values.append(pure_error(scan).p_value)
    low, high = binom.ppf([1e-6, 1 - 1e-6], scans, level)
    assert low <= np.sum(np.array(p_values) < level) <= high
    assert pure_error(simulated(state_noise=False)) is None


def test_the_pure_error_is_the_scatter_of_repeats():
    scan = simulated(repeats=3, points=33, state_noise=False)
    estimate = estimated(scan)
    model = free_model(estimate)
    found = pure_error_test(estimate, model)
    assert model.point.size == scan.u_zz.size
    pure = scan.u_zz.var(axis=0, ddof=1).mean()
    degrees = 33 - model.design.shape[1]
    misfit = model.data - model.design @ np.linalg.lstsq(model.design, model.data)[0]
    value = (misfit @ misfit - 66 * pure) / degrees / pure
    assert found.value == pytest.approx(value, rel=1e-6)
    assert found.p_value == pytest.approx(f.sf(value, degrees, 66), rel=1e-6)


@pytest.mark.parametrize("cause", ["a bent baseline", "a step of the baseline", "correlated noise"])
def test_faults_leave_steps_and_alike_neighbours(cause):
    scan = simulated(noise=0.003, points=97)
    largest = scan.u_zz.max()
    place = scan.x / scan.x.max()
    if cause == "a bent baseline":
        u = scan.u_zz + 0.02 * largest * np.sin(4 * place)
    elif cause == "a step of the baseline":
        u = scan.u_zz + 0.03 * largest * (place > 0.45)
    else:
        white = np.random.default_rng(5).normal(size=scan.x.size + 50)
        slow = np.convolve(white, 0.8 ** np.arange(50))[50 : 50 + scan.x.size]
        slow *= 0.003 * largest * np.sqrt(1 - 0.8**2)
        u = simulated(noise=0.0, points=97).u_zz + slow
    residuals = residuals_of(estimated(replace(scan, u_zz=u)))
    found = [neighbour_correlation_test(residuals)]
    if cause != "correlated noise":
        found += [steps_test(residuals), chi_square_test(residuals)]
    assert all(outcome.value > outcome.limit for outcome in found)
    assert max(outcome.p_value for outcome in found) < 1e-3


def test_a_wave_over_the_plane_is_told_from_noise_by_its_ring():
    rng = np.random.default_rng()
    rows, columns = (each.ravel() for each in np.indices((40, 48)))
    noise = np.full(rows.size, 2.0)
    wave = np.cos(0.6 * rows + 0.9 * columns)
    p_values = []
    for _ in range(200):
        left = 2.0 * rng.standard_normal(rows.size)
        p_values.append(ring_test(left, noise, (rows, columns), 800.0).p_value)
    # The noise alone fails once in a thousand at most.
    assert sum(p < 1e-3 for p in p_values) <= 4
    outcome = ring_test(left + wave, noise, (rows, columns), 800.0)
    assert outcome.value > outcome.limit
    assert outcome.p_value < 1e-3
