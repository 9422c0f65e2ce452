"""Stress measured and restored by one sensor of a calibrated array, against an independent layer.

Film and load of the array's scan are drawn as they are stated; the contact is a sphere on the film
as it truly is.  Set MEMSCAL_FULL_STUDY for 24 arrays of each G in place of 3.
"""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_limit
from helpers.true_arrays import KERNELS, simulated_scan

import memscal

ARRAYS = 24 if FULL else 3
SPHERE = memscal.Sphere(radius=128.8e-3)
LOAD = 1.0
X = 0.25e-3 * np.arange(-33, 34)


def nearest_width(kernel):
    """Return the width of the Gaussian nearest to a G in the plane, from a table of widths."""
    k = np.linspace(0.0, 10e3, 2001)
    widths = np.linspace(0.4e-3, 0.8e-3, 4001)
    misfits = [np.sum(k * (KERNELS[kernel](k) - np.exp(-((w * k) ** 2) / 2)) ** 2) for w in widths]
    return widths[np.argmin(misfits)]


def errors_over_uncertainties(kernel, seed):
    """Return those of A, sigma, the measured force and the restored stress on the axis."""
    scan, true = simulated_scan(1, 5, seed=seed, kernel=kernel)
    sensor = memscal.calibrate_array(scan).array.sensor("T02")
    a = true.conversion_constants[2]
    alone = replace(
        true, centres=np.zeros((1, 2)), conversion_constants=np.array([a]), crosstalk=np.eye(1)
    )
    u = alone.readings(np.stack([X, 0 * X], axis=1), LOAD, indenter=SPHERE)[:, 0]
    noise = 0.002 * u.max()
    contact = memscal.Scan(
        x=X,
        u_zz=u + noise * np.random.default_rng([43, seed]).normal(size=X.size),
        u_zz_errors=np.full(X.size, noise),
        load=LOAD,
        load_uncertainty=1e-4,
        indenter=SPHERE,
        film=scan.film,
    )
    profile = memscal.measure_stress(contact, sensor, override=True).profiles[0]
    restored = memscal.restore(contact, sensor, override=True)
    bare = replace(alone, kernel=np.ones_like, conversion_constants=np.ones(1))
    on_axis = bare.readings(np.zeros((1, 2)), LOAD, indenter=SPHERE)[0, 0]
    return [
        (sensor.conversion_constant - a) / sensor.parameters.uncertainty("conversion_constant"),
        (sensor.gaussian_sigma - nearest_width(kernel))
        / sensor.parameters.uncertainty("gaussian_sigma"),
        (profile.force - LOAD) / profile.force_uncertainty,
        (float(restored.stress(0.0)) - on_axis) / float(restored.stress_uncertainty(0.0)),
    ]


@pytest.mark.parametrize("kernel", ["gaussian", "tails"])
def test_errors_are_as_large_as_stated(kernel):
    deviates = [errors_over_uncertainties(kernel, seed) for seed in range(ARRAYS)]
    limit = root_mean_square_limit(1.0, ARRAYS, 1e-4)
    assert (root_mean_square(np.array(deviates)) < limit).all(), deviates
