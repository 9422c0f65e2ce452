"""False alarms and power of a sensor's history, of real calibrations half a year apart.

Scans of 65 points with a noise of 0.5 % of the largest signal, through the paper's film.
Set MEMSCAL_FULL_STUDY for 200 histories in place of 8.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from scipy.stats import binom

import memscal
from memscal.extensions.history.changes import exceeded_after
from memscal.model.instrument import Equipment, LoadCell

HISTORIES = 200 if FULL else 8
CHANCE = 1e-3
DATES = [f"{2020 + i // 2}-{1 + 6 * (i % 2):02}-01" for i in range(8)]


@lru_cache(maxsize=8 * HISTORIES + 1)
def calibrated(seed, film="F1", thicker=0.0):
    """A calibration of a sensor through a film that is thicker than stated."""
    scan = memscal.simulate(seed=seed)
    stated = scan.film
    if thicker:
        true = replace(stated, thickness=stated.thickness * (1 + thicker))
        scan = memscal.simulate(seed=seed, film=true)
    named = replace(
        scan,
        film=replace(stated, name=film),
        indenter=replace(scan.indenter, name="R1"),
        sensor=replace(scan.sensor, serial_number="S7"),
        load_cell=LoadCell(serial_number="7", certificate="C1"),
        stage=Equipment(serial_number="3", certificate="Z1"),
    )
    return memscal.calibrate(named).apparatus


def changed(apparatus, date, by, **stated):
    """Return a calibration of a date, of a sensor whose A has changed by a relative amount."""
    found = apparatus.parameters
    values = found.values.copy()
    values[found.names.index("conversion_constant")] *= 1 + by
    return replace(apparatus, start_time=date, parameters=replace(found, values=values), **stated)


def of_case(case, number):
    """Return one history of 8 dates."""
    rng = np.random.default_rng(number)
    thicker = 0.01 * rng.normal()
    heavier = 0.01 * rng.normal(size=2)
    apparatuses = []
    for i, date in enumerate(DATES):
        late = i >= 4
        by = 0.0
        stated = {}
        seed = 8 * number + i
        apparatus = calibrated(seed)
        if case == "step":
            by = 0.02 * late
        elif case == "drift":
            by = 0.006 * i / 2
        elif case == "load cell":
            by = heavier[int(late)]
            stated["load_cell"] = LoadCell(serial_number="7", certificate=f"C{int(late)}")
        elif case == "film" and late:
            apparatus = calibrated(seed, "F2", thicker)
        apparatuses.append(changed(apparatus, date, by, **stated))
    return memscal.history(apparatuses)


@lru_cache
def found(case):
    """Which of the tests were significant, and the trend over its uncertainty, of each history."""
    histories = [of_case(case, number) for number in range(HISTORIES)]
    alarms = np.array([[change["significant"] for change in h.changes] for h in histories])
    slope = 0.006 if case == "drift" else 0.0
    trends = [(h.trend["value"] - slope) / h.trend["standard_uncertainty"] for h in histories]
    return alarms, np.array(trends)


def at_most(share):
    """Largest number of histories that a rate makes, but for chance."""
    return binom.isf(CHANCE, HISTORIES, share)


@pytest.mark.parametrize("case", ["stable", "load cell", "film"])
def test_a_stable_sensor_raises_few_alarms(case):
    alarms, _ = found(case)
    assert (alarms.sum(axis=0) <= at_most(0.09)).all()
    assert alarms.any(axis=1).sum() <= at_most(0.15)


def test_a_step_of_two_percent_is_found():
    alarms, _ = found("step")
    assert (~alarms.any(axis=1)).sum() <= at_most(0.05)


@pytest.mark.parametrize("case", ["stable", "drift"])
def test_the_slope_is_covered(case):
    _, trends = found(case)
    missed = np.count_nonzero(np.abs(trends) > 1.96)
    assert missed <= at_most(0.10)
    # Too wide an interval would cover all.
    assert root_mean_square(trends) > root_mean_square_range(HISTORIES, CHANCE)[0] * 0.75


@pytest.mark.parametrize("count", [4, 5, 8])
def test_a_sensor_is_within_its_tolerance_at_the_proposed_date(count):
    rng = np.random.default_rng(count)
    years = np.arange(count) / 2
    runs = 1000 if FULL else 100
    covariance = 0.005**2 * np.eye(count) + 0.01**2
    slopes = 0.006 * rng.normal(size=runs)
    noise = np.linalg.cholesky(covariance) @ rng.normal(size=(count, runs))
    out = 0
    for slope, errors in zip(slopes, noise.T, strict=True):
        history = (slope * years + errors)[:, None]
        ahead = exceeded_after(history, np.ones((count, 1)), covariance, years, 0.02)
        out += abs(slope * ahead) > 0.02
    assert out <= binom.isf(CHANCE, runs, 0.05)
