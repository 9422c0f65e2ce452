"""One load cell for calibration and contacts: its common error counts once, and partly cancels."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square_range
from helpers.scans import simulate, simulate_contacts, simulate_experiment

import memscal
from memscal import LoadCell
from memscal.extensions.simulation.contact_scan import PAPER_SPHERE
from memscal.extensions.simulation.rod_scan import PAPER_FILM
from memscal.friction.calculated import amontons_family
from memscal.friction.likelihood import load_points, points_at, predict, sensor_of
from memscal.measurement.measure_stress import pooled_force

SEEDS = range(8 if FULL else 4)
CHANCE = 1e-3
SHARE = 0.05  # standard uncertainty of the load cell's scale
LOADS = (0.69, 2.75)
FRICTION = 0.1
FILM = replace(PAPER_FILM, law="linear", poisson_ratio_uncertainty=None)
OTHER = LoadCell(name="another")
OFFSETS = np.linspace(-6e-3, 6e-3, 25)


@lru_cache
def experiment(seed):
    """Scans of one load cell, whose error is drawn with everything else."""
    return simulate_experiment(
        film=FILM,
        loads=LOADS,
        lubricated_loads=LOADS[:1],
        friction=FRICTION,
        seed=seed,
        load_uncertainty=SHARE,
        draw_inputs=True,
        one_load_cell=True,
    )


@lru_cache
def measured(seed, other=None):
    """Dry contacts and their sensor, which may name another load cell."""
    made = experiment(seed)
    sensor = memscal.calibrate(made.rod, method="evidence").apparatus
    sensor = sensor if other is None else replace(sensor, load_cell=other)
    return memscal.measure_stress(made.dry, sensor), sensor


@lru_cache
def family():
    values = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 1.0)
    return amontons_family(FILM, PAPER_SPHERE, LOADS, friction=values, reach=24e-3)


@pytest.mark.parametrize(
    ("mine", "theirs", "same"),
    [
        (LoadCell(name="K", serial_number="7"), LoadCell(name="L", serial_number="7"), True),
        (LoadCell(name="K"), LoadCell(name="K", certificate="2024"), True),
        (LoadCell(name="K", serial_number="7"), LoadCell(name="K"), False),
        (LoadCell(name="K", serial_number="7"), LoadCell(name="K", serial_number="8"), False),
        (LoadCell(), LoadCell(), False),
    ],
)
def test_load_cells_are_told_apart_by_serial_number_then_by_name(mine, theirs, same):
    assert mine.same_as(theirs) == theirs.same_as(mine) == same


def test_scans_of_two_load_cells_calibrate_a_sensor_of_none():
    for cells, named in (("KK", "K"), ("KL", "")):
        scans = [
            replace(memscal.simulate(film=FILM, seed=seed), load_cell=LoadCell(name=name))
            for seed, name in enumerate(cells)
        ]
        assert memscal.calibrate(scans, method="evidence").apparatus.load_cell.name == named


def force_of(rod_scale, sphere_scale):
    """Force less load, and what the check allows, by true loads over the stated; in N."""
    cell = {"load_cell": LoadCell(name="K")}
    rod = simulate(film=FILM, load=rod_scale, load_uncertainty=SHARE)
    stated = replace(rod, load=1.0, baseline_curvature_uncertainty=0.0, **cell)
    sensor = memscal.calibrate(stated, method="evidence").apparatus
    contact = simulate_contacts(
        film=FILM,
        load=LOADS[1],
        load_scale=sphere_scale,
        load_uncertainty=SHARE,
    )
    measured = memscal.measure_stress(replace(contact, **cell), sensor)
    off = measured.profiles[0].force - LOADS[1]
    return off, abs(off) / measured.checks[0].value


def test_a_load_cell_that_is_wrong_for_both_leaves_the_check_where_it_is():
    (right, u), (both, _), (one, _) = (
        force_of(*scales) for scales in ((1, 1), (1.05, 1.05), (1, 1.05))
    )
    assert both == pytest.approx(right, abs=0.3 * u)
    assert one == pytest.approx(right + 0.05 * LOADS[1], rel=0.15)
    assert u < 0.03 * LOADS[1]


def test_the_checks_do_not_allow_for_what_cancels():
    squares = []
    for stress, sensor in (measured(0), measured(0, OTHER)):
        values = {check.name: check.value for check in stress.checks}
        off = [profile.force / profile.load - 1 for profile in stress.profiles]
        allowed = [abs(d) / values[f"applied_force_{i}"] for i, d in enumerate(off, 1)]
        rod = memscal.restore(experiment(0).rod, sensor)
        of_rod = next(check.value for check in rod.checks if check.name == "restored_force")
        allowed += [pooled_force(stress.profiles)[1], abs(rod.force - 1) / of_rod]
        squares.append(np.square(allowed))
    # Force over load: u_A^2 + u_P^2 of two load cells, (u_A - u_P)^2 of one.
    np.testing.assert_allclose(squares[1] - squares[0], 2 * SHARE**2, rtol=0.05)
    same = measured(0)[0].profiles
    apart = measured(0, OTHER)[0].profiles
    for mine, theirs in zip(same, apart, strict=True):
        assert mine.force_uncertainty == pytest.approx(theirs.force_uncertainty, rel=1e-3)
        assert mine.maximum_uncertainty == pytest.approx(theirs.maximum_uncertainty, rel=1e-3)


def test_the_force_over_load_has_the_error_that_it_states():
    z = []
    for seed in SEEDS:
        ratio, spread = pooled_force(measured(seed)[0].profiles)
        z.append((ratio - 1) / np.hypot(spread, 0.005))
    low, high = root_mean_square_range(len(z), CHANCE) ** 2
    assert 0.3 * low < np.mean(np.square(z)) < high
    apart = [pooled_force(measured(seed, OTHER)[0].profiles)[1] for seed in SEEDS[:2]]
    assert min(apart) > 3 * pooled_force(measured(0)[0].profiles)[1]


def predicted(other=None):
    stress, sensor = measured(0, other)
    sensed = sensor_of(sensor, family(), 8e-3, stress.scans)
    return predict(
        points_at(OFFSETS, load_points(stress.profiles[1])), sensed, family().at(FRICTION), 1
    )


def test_its_error_changes_a_and_the_contact_as_one():
    one = predicted()
    two = predicted(OTHER)
    assert set(one.columns) == set(two.columns)
    # A ~ 1/P of the rod: the column of both is u (dU/d ln P - U), which is that of a softer film.
    signal = one.signal[0]
    by_load = one.by_load[0]
    np.testing.assert_allclose(
        one.columns["load"][0, :, 0], SHARE * (by_load - signal), atol=1e-3 * signal.max() * SHARE
    )
    softer = -one.columns["young_modulus"] * FILM.young_modulus / FILM.young_modulus_uncertainty
    np.testing.assert_allclose(
        one.columns["load"], SHARE * softer, atol=1e-2 * signal.max() * SHARE
    )

    def variance(found):
        return sum(np.sum(column[0] ** 2, axis=1) for column in found.columns.values())

    crossed = -2 * SHARE**2 * by_load * signal
    difference = variance(one) - variance(two)
    np.testing.assert_allclose(difference, crossed, atol=1e-2 * np.abs(crossed).max())
