"""Places and forces on calibrated arrays, against an independent layer.

A row of 10 and 4x4 sensors, pitch and film 2 mm, crosstalk 1 %, calibrated by one scan with the
noise of the frames; contacts of a rod, 0.5 to 2 N.  Set MEMSCAL_FULL_STUDY for 8 arrays in place of
2, of all noises.
"""

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square
from helpers.true_arrays import ROD, Errors, simulated_frames, simulated_scan

import memscal

ARRAYS = 8 if FULL else 2
CONTACTS = 400
NOISES = [0.001, 0.01, 0.05] if FULL else [0.01]
LAYOUTS = pytest.mark.parametrize("layout", [(1, 10), (4, 4)], ids=["row", "grid"])


def located(layout, noise, shear, most_shear, seed):
    """Contacts, errors and least uncertainties of x and force, and forces."""
    scan, true = simulated_scan(*layout, errors=Errors(noise=noise), stated=0.0, seed=seed)
    array = memscal.calibrate_array(scan).array
    u, places, forces = simulated_frames(
        true, CONTACTS, seed=seed, most_shear=most_shear, noise=noise
    )
    found = array.locate(u, indenter=ROD, shear=shear)
    errors = np.stack([found.x - places[:, 0], found.force - forces], axis=1)
    bound = array.bound(places, forces, indenter=ROD, shear=shear)
    least = np.sqrt(np.diagonal(bound, axis1=1, axis2=2)[:, [0, 2]])
    return found, errors, least, forces


@LAYOUTS
@pytest.mark.parametrize("noise", NOISES)
def test_places_and_forces_are_as_sure_as_the_bound(layout, noise):
    drawn = [located(layout, noise, 0.0, 0.0, seed) for seed in range(ARRAYS)]
    errors, least = (np.concatenate([one[i] for one in drawn]) for i in (1, 2))
    assert np.all(root_mean_square(errors) < 1.25 * root_mean_square(least))
    if noise == 0.01:
        forces = np.concatenate([one[3] for one in drawn])
        assert root_mean_square(errors[:, 0]) < 28e-6
        assert root_mean_square(errors[:, 1] / forces) < 0.018


@LAYOUTS
def test_with_shear_in_the_truth_the_stated_uncertainties_hold(layout):
    drawn = [located(layout, 0.01, 0.3, 0.3, seed) for seed in range(ARRAYS)]
    errors = np.concatenate([one[1] for one in drawn])
    stated = np.concatenate([one[0].uncertainties[:, [0, 2]] for one in drawn])
    z = root_mean_square(errors / stated)
    assert np.all((z > 0.7) & (z < 1.3))
    assert np.median(stated[:, 0]) < (200e-6 if layout[0] == 1 else 150e-6)
