"""Chi-square with nuisances against the same computed by dense matrices, and its uncertainties."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.linear_contacts import FRICTIONS, Laboratory, bare_points

from memscal.friction.family import bounded, unbounded
from memscal.friction.likelihood import likelihood, predict

CORRELATED = {"white": 0.0, "correlated": 0.6}


@pytest.fixture(params=CORRELATED)
def laboratory(request):
    return Laboratory.of(points=bare_points(correlation=CORRELATED[request.param]))


def dense(found, value):
    """Residual, covariance without flat parameters, and flat columns, over all loads."""
    predicted = predicted_of(found, value)
    measured = found.channel.points
    residual = np.concatenate(
        [points.u - p.signal[0] for points, p in zip(measured, predicted, strict=True)]
    )
    sizes = [points.u.size for points in measured]
    noise = np.zeros((sum(sizes),) * 2)
    flat = np.zeros((sum(sizes), 3 * len(sizes)))
    for i, (points, p) in enumerate(zip(measured, predicted, strict=True)):
        rows = slice(sum(sizes[:i]), sum(sizes[: i + 1]))
        inner = np.eye(points.u.size) if points.correlation is None else points.correlation
        block = np.outer(points.noise, points.noise) * inner
        block += np.diag((p.by_load[0] * points.load_errors) ** 2)
        shifted = np.diag(p.slope[0] * np.sign(points.offset) * points.x_errors)
        by_place = shifted if points.places is None else shifted @ points.places
        block += by_place @ by_place.T
        noise[rows, rows] = block
        flat[rows, 3 * i : 3 * i + 3] = np.column_stack(
            [points.flat, p.slope[0] * np.sign(points.offset)]
        )
    shared = np.concatenate([joined(p) for p in predicted])
    return residual, noise + shared @ shared.T, flat


def joined(found):
    return np.concatenate([column[0] for column in found.columns.values()], axis=1)


def generalised(residual, covariance, flat):
    """Chi-square of generalised least squares: by its normal equations."""
    inverse = np.linalg.inv(covariance)
    columns = flat / np.abs(flat).max(axis=0)
    best = np.linalg.solve(columns.T @ inverse @ columns, columns.T @ inverse @ residual)
    left = residual - columns @ best
    return float(left @ inverse @ left)


def test_chi_square_is_that_of_generalised_least_squares(laboratory):
    found = laboratory.drawn(0.15, seed=1)
    whole = found.whole.chi_square[np.isin(found.whole.values, FRICTIONS)]
    assert whole.shape == FRICTIONS.shape
    for i, value in enumerate(FRICTIONS):
        assert whole[i] == pytest.approx(generalised(*dense(found, value)), rel=1e-6)


def without_the_last_reading(points):
    """Points of repeats that are not complete."""
    arrays = {k: v[:-1] for k, v in vars(points).items() if np.shape(v)[:1] == points.u.shape}
    return replace(points, **arrays)


@pytest.mark.parametrize("complete", [True, False])
def test_repeats_share_the_error_of_their_position(complete):
    points = bare_points(repeats=3)
    points = points if complete else without_the_last_reading(points)
    found = Laboratory.of(points=points).drawn(0.15, seed=1)
    (there,) = likelihood(found.channel.at(0.15)).chi_square
    assert there == pytest.approx(generalised(*dense(found, 0.15)), rel=1e-6)
    anew = [replace(each, places=None) for each in found.channel.points]
    apart = likelihood(replace(found.channel, points=anew).at(0.15))
    assert likelihood(found.channel.at(0.15)).slope_fit()[0][0] < apart.slope_fit()[0][0]


def test_one_load_of_several_is_that_load_alone(laboratory):
    found = laboratory.drawn(0.15, seed=2)
    alone = likelihood(found.fine.only([1]))
    assert found.whole.only([1]).chi_square == pytest.approx(alone.chi_square, rel=1e-9)


def test_the_squares_of_the_budget_add_up_to_the_variance(laboratory):
    found = laboratory.drawn(0.15, seed=3)
    there = likelihood(found.channel.at(0.15))
    budget = there.budget()
    assert set(budget) == {"noise", "load_scatter", "position", "apparatus", "thickness", "load"}
    variance = 1 / there.slope_fit()[0][0]
    assert sum(part**2 for part in budget.values()) == pytest.approx(variance, rel=1e-9)


def test_the_uncertainty_is_the_curvature_of_chi_square():
    laboratory = Laboratory.of()
    points = [
        replace(points, u=laboratory.predicted(0.15, load).signal[0])
        for load, points in enumerate(laboratory.points)
    ]
    at = float(bounded(0.15, laboratory.family.scale))
    step = 2e-3
    values = unbounded([at - step, at, at + step], laboratory.family.scale)
    found = likelihood(laboratory.channel(points).at(values))
    curvature = (found.chi_square[0] + found.chi_square[2]) / (2 * step**2)
    assert found.chi_square[1] == pytest.approx(0.0, abs=1e-9)
    assert curvature == pytest.approx(found.slope_fit()[0][1], rel=0.02)


def test_baseline_drift_and_a_shift_of_the_centre_change_nothing():
    laboratory = Laboratory.of()
    found = laboratory.drawn(0.2, seed=5)
    points = found.channel.points[0]
    there = laboratory.predicted(0.2, 0, replace(points, offset=points.offset + 10e-6))
    here = laboratory.predicted(0.2, 0)
    u = points.u + there.signal[0] - here.signal[0] + points.flat @ np.array([3e-3, -2e-3])
    moved = likelihood(replace(found.fine.only([0]), points=[replace(points, u=u)]))
    before = found.whole.only([0]).chi_square
    held = [replace(points, u=u, free_centre=False)]
    fixed = likelihood(replace(found.fine.only([0]), points=held)).chi_square
    assert np.abs(moved.chi_square - before).max() < 0.3 < np.abs(fixed - before).max()


def test_loads_that_were_recorded_off_the_nominal_one_are_followed():
    laboratory = Laboratory.of(points=replace(bare_points(), log_load=0.1 * (-1) ** np.arange(33)))
    found = laboratory.drawn(0.2, seed=6)
    ignored = [replace(points, log_load=np.zeros(33)) for points in found.channel.points]
    wrong = likelihood(replace(found.fine, points=ignored))
    assert found.whole.chi_square.min() < 100 < wrong.chi_square.min()


def test_a_load_that_is_held_shares_its_errors_with_the_others(laboratory):
    found = laboratory.drawn(0.15, seed=8)
    frictionless = likelihood(found.channel.only([1]).at(0.0))
    together = found.whole.only([0]).with_held(frictionless, 0.0)
    for value in (0.0, 0.1, 0.3):
        free, held = (dense(found, each) for each in (value, 0.0))
        size = found.channel.points[0].u.size
        residual = np.concatenate([free[0][:size], held[0][size:]])
        shared = np.concatenate(
            [joined(predicted_of(found, each)[load]) for load, each in enumerate((value, 0.0))]
        )
        noise = np.zeros((2 * size, 2 * size))
        for whole, at, rows in ((free, value, slice(size)), (held, 0.0, slice(size, None))):
            own = np.concatenate([joined(p) for p in predicted_of(found, at)])
            noise[rows, rows] = (whole[1] - own @ own.T)[rows, rows]
        flat = np.vstack([free[2][:size], held[2][size:]])
        i = int(np.argmin(np.abs(found.whole.values - value)))
        expected = generalised(residual, noise + shared @ shared.T, flat)
        assert together.chi_square[i] == pytest.approx(expected, rel=1e-6)
    assert together.slope_fit()[0][30] > found.whole.only([0]).slope_fit()[0][30]


def predicted_of(found, value):
    channel = found.channel.at(value)
    return [
        predict(points, channel.sensor, channel.family, load)
        for load, points in enumerate(channel.points)
    ]


@pytest.mark.parametrize("friction", [0.1, 0.2])
def test_the_most_likely_coefficient_is_right_on_average(friction):
    # By chi-square alone it is half a standard deviation too large: larger noise fits better.
    laboratory = Laboratory.of()
    errors = []
    t = bounded(friction, laboratory.family.scale)
    for seed in range(40 if FULL else 20):
        along = laboratory.drawn(friction, seed).whole
        i = int(np.argmin(along.deviance))
        errors.append((along.coordinates[i] - t) * np.sqrt(along.slope_fit()[0][i]))
    assert abs(np.mean(errors)) < 0.15 + 3.3 * np.std(errors) / np.sqrt(len(errors))
    assert np.std(errors) == pytest.approx(1.0, abs=3.3 / np.sqrt(2 * len(errors)))
