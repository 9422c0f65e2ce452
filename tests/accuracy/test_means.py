"""Scans whose readings are means along the scan: A, both widths and G are the sensor's own."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.outside import ROUND, SIGMA, line, scan, tail

import memscal

COUNT = 40 if FULL else 8
MEAN = 0.25e-3
NOISE = 0.001
X = line(step=MEAN)
WIDENED = MEAN**2 / 24 / SIGMA**2
"""What a mean that is not stated does to the width: in one direction s^2 grows by D^2/12."""
_PER_MEAN = 16
"""Points of a mean, a midpoint rule that is right to 1e-5 of the signal."""


def errors(world, seed, *, stated):
    """Relative errors of A and the width against those from readings at the places."""
    steps = MEAN * ((np.arange(_PER_MEAN) + 0.5) / _PER_MEAN - 0.5)
    u = world.voltages(np.add.outer(X, steps).ravel()).reshape(X.size, -1).mean(axis=1)
    exact = world.voltages(X)
    made = scan(world, 0, x=X)
    noise = NOISE * exact.max() * np.random.default_rng([seed, 38]).standard_normal(X.size)
    found = []
    for readings, length in ((u, MEAN if stated else None), (exact, None)):
        measured = replace(made, u_zz=readings + noise, averaging_length=length)
        apparatus = memscal.calibrate(measured, method="bayesian", other=False).apparatus
        names = ("conversion_constant", "gaussian_sigma", "fwhm")
        found.append([apparatus.parameters[name] for name in names])
    return np.array(found[0]) / found[1] - 1


@pytest.mark.parametrize("world", [ROUND, tail(0.15)], ids=["Gaussian", "tails"])
def test_a_stated_mean_widens_nothing(world):
    change = np.mean([errors(world, seed, stated=True) for seed in range(COUNT)], axis=0)
    # A full width is of a smooth G, which follows tails less far by readings that are smoother.
    assert (np.abs(change) < [2e-4, 2e-4, WIDENED / 10]).all()


def test_a_mean_that_is_not_stated_widens_the_sensor():
    change = errors(ROUND, 0, stated=False)
    assert change[1] == pytest.approx(WIDENED, abs=2e-3)
