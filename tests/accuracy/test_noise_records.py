"""Restored stress of oversampled scans, whose noise a record at rest states, by an outside sphere.

Peak and force: mean error and root mean square over the stated uncertainty, where the noise has
passed a low-pass of 1 Hz, and where the baseline walks, and by independent noise for comparison.
"""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_limit, root_mean_square_range
from helpers.outside import A, correlated
from helpers.outside_sphere import FILM, LOADS, SPHERE, Pressed
from helpers.scans import CONVERSION, known_apparatus

import memscal

COUNT = 60 if FULL else 10
CHANCE = 1e-3
RATE = 50.0
"""Samples a second, at 1 mm/s."""
X = np.linspace(-8e-3, 8e-3, 801)
LOAD = LOADS[2]
KEPT = float(np.exp(-2 * np.pi / RATE))
EXACT = replace(
    FILM,
    young_modulus_uncertainty=0.0,
    poisson_ratio_uncertainty=0.0,
    thickness_uncertainty=0.0,
)


def walking(rng, count):
    """White noise of 0.1 %, and a baseline that walks by 1.5 % along a scan."""
    steps = 0.015 / np.sqrt(X.size) * rng.standard_normal(count)
    return np.cumsum(steps) + 0.001 * rng.standard_normal(count)


def errors(noise, seed, *, recorded):
    """Errors of peak and force over their uncertainties, and relative ones."""
    rng = np.random.default_rng([seed, 38])
    world = Pressed(load=LOAD)
    u = CONVERSION / A * world.voltages(X)
    top = np.abs(u).max()
    rest = top * noise(rng, 6000)
    record = memscal.Scan(
        x=np.zeros(rest.size), u_zz=rest, time=np.arange(rest.size) / RATE, motion="rest"
    )
    scan = memscal.Scan(
        x=X,
        u_zz=u + top * noise(rng, X.size),
        u_zz_errors=np.full(X.size, top * 0.005),
        time=np.arange(X.size) / RATE,
        load=LOAD,
        film=EXACT,
        indenter=SPHERE,
    )
    restored = memscal.restore(
        scan, known_apparatus(), noise_record=record if recorded else None
    ).to_dict()
    k = np.linspace(0.0, 10e3, 4001)
    peak = np.trapezoid(k * world.base(k)[0], k) / (2 * np.pi) * LOAD / 1e3
    found = [restored["stress_on_axis"], restored["force"]]
    change = np.array([each["value"] for each in found]) / [peak, LOAD] - 1
    u = [each["standard_uncertainty"] for each in found] / np.array([peak, LOAD])
    failed = [check["name"] for check in restored["checks"] if not check["passed"]]
    return change / u, change, failed


@pytest.mark.parametrize(("noise", "most"), [(correlated(KEPT, 0.005, 0.0), 1.3), (walking, 1.4)])
def test_a_noise_record_makes_peak_and_force_as_sure_as_stated(noise, most):
    made = [errors(noise, seed, recorded=True) for seed in range(COUNT)]
    deviates = np.array([each[0] for each in made])
    size = root_mean_square(deviates)
    assert (size < root_mean_square_limit(most, COUNT, CHANCE)).all(), size
    assert (size > 0.7 * root_mean_square_range(COUNT, CHANCE)[0]).all(), size
    # The mean error is at most what chance makes of it, and half a percent that the shapes hide.
    change = np.array([each[1] for each in made])
    chance = 3.3 * change.std(axis=0, ddof=1) / np.sqrt(COUNT)
    assert (np.abs(change.mean(axis=0)) < chance + np.array([0.005, 0.015])).all()
    assert sum("noise_as_stated" in each[2] for each in made) <= 1


def test_independent_noise_is_found_not_to_be_as_stated():
    made = [errors(correlated(KEPT, 0.005, 0.0), seed, recorded=False) for seed in range(COUNT)]
    assert root_mean_square([each[0] for each in made]).min() > 1.5
    assert sum("noise_as_stated" in each[2] for each in made) >= 0.9 * COUNT
