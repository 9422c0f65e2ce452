"""The gain of waves of pressure, of calibrations on films whose thickness is drawn.

Scans and true gains are those of another forward calculation.  Set MEMSCAL_FULL_STUDY for 40
calibrations in place of 8.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.outside import FILM, ROUND, SIGMA, A, answers, scan
from helpers.scans import calibrated

import memscal

CALIBRATIONS = 40 if FULL else 8
CHANCE = 1e-4
WAVELENGTHS = np.array([8e-3, 4e-3, 3e-3])
NOISE = 0.002
STATED = replace(FILM, poisson_ratio_uncertainty=None, young_modulus_uncertainty=None)


@cache
def study():
    """Error of the gain, its uncertainty, and that without what cancels, all over the true one."""
    rows = []
    for seed in range(CALIBRATIONS):
        drawn = np.random.default_rng([38, seed]).normal(1.0, 0.01)
        world = replace(ROUND, thickness=drawn * FILM.thickness)
        made = replace(scan(world, seed, noise=NOISE), film=STATED, load_uncertainty=None)
        apparatus = calibrated(made, other=False).apparatus
        seen = memscal.response(apparatus, WAVELENGTHS)
        apart = memscal.response(apparatus, WAVELENGTHS, film=replace(STATED, name="another"))
        k = 2 * np.pi / WAVELENGTHS
        _, base = answers(FILM.poisson_ratio, k * world.thickness)
        true = A * np.exp(-((k * SIGMA) ** 2) / 2) * base[:, 1, 1]
        rows.append([abs(seen.gain) / true - 1, seen.uncertainty / true, apart.uncertainty / true])
    return np.moveaxis(rows, 1, 0)


def test_the_gain_is_as_sure_as_it_says():
    errors, stated, _ = study()
    z = root_mean_square(errors / stated)
    low, high = root_mean_square_range(CALIBRATIONS, CHANCE)
    assert np.all(z > 0.7 * low)
    assert np.all(z < 1.3 * high)
    if FULL:
        assert np.all((z > 0.7) & (z < 1.3))


def test_what_calibration_and_film_share_is_counted_once():
    _, stated, apart = np.median(study(), axis=1)
    assert np.all(stated < [0.006, 0.012, 0.018])
    assert np.all(apart > 2 * stated)
