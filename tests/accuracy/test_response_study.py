"""The gain of waves of pressure, of calibrations on films whose thickness is drawn.

Scans and true gains are those of another forward calculation.  Set MEMSCAL_FULL_STUDY for 40
calibrations in place of 8.
"""

from dataclasses import replace

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


def outcome(seed):
    """Error of the gain, its uncertainty, and that without what cancels, all over the true one."""
    drawn = FILM.thickness * np.random.default_rng([38, seed]).normal(1.0, 0.01)
    made = scan(replace(ROUND, thickness=drawn), seed, noise=NOISE)
    apparatus = calibrated(replace(made, film=STATED, load_uncertainty=None), other=False).apparatus
    seen, apart = (
        memscal.response(apparatus, WAVELENGTHS, film=replace(STATED, name=name))
        for name in ("", "another")
    )
    k = 2 * np.pi / WAVELENGTHS
    _, base = answers(FILM.poisson_ratio, k * drawn)
    true = A * np.exp(-((k * SIGMA) ** 2) / 2) * base[:, 1, 1]
    return abs(seen.gain) / true - 1, seen.uncertainty / true, apart.uncertainty / true


def test_the_gain_is_as_sure_as_it_says_where_what_is_shared_counts_once():
    errors, stated, apart = np.moveaxis([outcome(seed) for seed in range(CALIBRATIONS)], 1, 0)
    low, high = (0.7, 1.3) if FULL else root_mean_square_range(CALIBRATIONS, CHANCE)
    z = root_mean_square(errors / stated)
    assert np.all((low < z) & (z < high))
    assert np.all(np.median(stated, axis=0) < [0.006, 0.012, 0.018])
    assert np.all(np.median(apart / stated, axis=0) > 2)
