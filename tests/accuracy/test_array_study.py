"""Calibrated arrays against an independent layer, whose film and load are drawn as they are stated.

Rows of 10 sensors with one line over them, a noise of 0.5 % of the largest reading, half of its
variance common to all.  The scan, not the sensor, is the unit of every bound: sensors share film,
load and the shape of G.  Set MEMSCAL_FULL_STUDY for 40 scans a case in place of 4.
"""

from functools import lru_cache

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.true_arrays import KERNELS, Errors, simulated_scan
from scipy.stats import binom

import memscal

SCANS = 40 if FULL else 4
CHANCE = 1e-4
#: Largest mean error of the crosstalk, and what chance adds to the mean of so many scans.
MEAN = 0.001 + (0.0 if FULL else 4 * 0.0025 / SCANS**0.5)


class Calibrated:
    """One scan's calibration beside the truth."""

    def __init__(self, seed, kernel, kernel_of, pairs, **made):
        self.scan, self.truth = simulated_scan(seed=seed, kernel=kernel_of, **made)
        self.calibration = memscal.calibrate_array(self.scan, kernel=kernel, crosstalk=pairs)
        self.array = self.calibration.array
        n = len(self.array.sensors)
        self.used = self.array.used
        self.crosstalk = slice(3 * n, 3 * n + len(self.array.pairs))
        self.columns = np.column_stack([self.array.root, *self.array.effects.values()])

    @property
    def of_crosstalk(self):
        """Errors and uncertainties of the crosstalk."""
        i, j = self.array.pairs.T
        error = self.array.crosstalk[i, j] - self.truth.crosstalk[i, j]
        return error, np.linalg.norm(self.columns[self.crosstalk], axis=1)

    @property
    def seen(self):
        """Mean of the crosstalk over its uncertainty."""
        i, j = self.array.pairs.T
        mean = self.columns[self.crosstalk].mean(axis=0)
        return abs(self.array.crosstalk[i, j].mean()) / np.linalg.norm(mean)

    @property
    def of_constants(self):
        """Relative errors and uncertainties of A."""
        a = self.array.conversion_constants[self.used]
        covariance = self.array.covariance[np.ix_(self.used, self.used)]
        return a / self.truth.conversion_constants[self.used] - 1, np.sqrt(np.diag(covariance)) / a

    @property
    def of_ratios(self):
        """The same of each A over the mean of all, of which film and load are no part."""
        a = self.array.conversion_constants[self.used]
        error, _ = self.of_constants
        relative = self.array.covariance[np.ix_(self.used, self.used)] / np.outer(a, a)
        off = np.eye(a.size) - 1 / a.size
        return error - error.mean(), np.sqrt(np.diag(off @ relative @ off))

    @property
    def of_places(self):
        """Errors and uncertainties of x, in m."""
        n = len(self.array.sensors)
        error = (self.array.centres - self.truth.centres)[self.used, 0]
        return error, self.array.uncertainties()[n : 2 * n][self.used]


@lru_cache(maxsize=200)
def calibrated(seed, kernel="common", kernel_of="gaussian", pairs="auto", **made):
    return Calibrated(seed, kernel, kernel_of, pairs, **made)


def of(made, what, scans=SCANS):
    """Errors over uncertainties of scans, (scans, sensors or pairs)."""
    pairs = [getattr(calibrated(seed, **made), what) for seed in range(scans)]
    return np.array([error / u for error, u in pairs])


def assert_as_stated(made, *names, scans=SCANS):
    low, high = (0.7, 1.3) if FULL else root_mean_square_range(scans, CHANCE)
    for name in names:
        assert low < root_mean_square(of(made, name, scans).ravel()) < high, name


def failing(made, check, scans=SCANS):
    """Return the sensors that fail a check of each scan."""
    return [calibrated(seed, **made).array.failing[check] for seed in range(scans)]


@pytest.mark.parametrize("kernel", KERNELS)
def test_crosstalk_and_constants_are_as_sure_as_they_say(kernel):
    made = {"kernel_of": kernel}
    assert_as_stated(made, "of_crosstalk", "of_constants", "of_ratios", "of_places")
    found = [calibrated(seed, **made).of_crosstalk for seed in range(SCANS)]
    assert abs(np.mean([error for error, _ in found])) < MEAN
    assert np.median([u for _, u in found]) < 0.0035


def test_all_pairs_are_as_sure_as_they_say():
    assert_as_stated({"pairs": "full"}, "of_crosstalk", "of_constants", "of_ratios")


@pytest.mark.parametrize("kernel", KERNELS)
def test_no_shape_of_g_is_taken_for_crosstalk(kernel):
    made = {"kernel_of": kernel, "crosstalk": 0.0}
    found = [calibrated(seed, **made).of_crosstalk[0] for seed in range(SCANS)]
    assert abs(np.mean(found)) < MEAN
    alarms = sum(calibrated(seed, **made).seen > 2.576 for seed in range(SCANS))
    assert alarms <= binom.isf(CHANCE, SCANS, 0.01)


def test_crosstalk_of_half_a_percent_is_seen():
    missed = sum(calibrated(seed, crosstalk=0.005).seen < 2.576 for seed in range(SCANS))
    assert missed <= binom.isf(CHANCE, SCANS, 0.1)


def test_errors_of_each_press_that_are_stated_are_counted():
    made = {"errors": Errors(place=10e-6, load=0.01)}
    assert_as_stated(made, "of_crosstalk", "of_constants", "of_ratios", "of_places")


def test_a_raster_tells_crosstalk_from_own_shapes():
    scans = 10 if FULL else 2
    made = {"rows": 3, "columns": 3, "kernel": "own", "own": 0.05}
    assert_as_stated(made, "of_crosstalk", "of_constants", "of_ratios", scans=scans)
    found = [calibrated(seed, **made).of_crosstalk[1] for seed in range(scans)]
    assert np.median(found) < 0.0025


def test_a_line_over_a_narrow_row_does_not_tell_crosstalk_from_own_shapes():
    made = {"pitch": 1e-3, "kernel": "own"}
    assert all(failing(made, "crosstalk_identified"))
    # The uncertainty of A holds what is not known.
    assert root_mean_square(of(made, "of_ratios").ravel()) < 1.5


DEFECTS = {
    "dead_taxels": Errors(dead=(4,)),
    "saturation": Errors(ceiling={4: 0.7}),
    "": Errors(missing=0.03),
}


@pytest.mark.parametrize("check", DEFECTS)
def test_what_is_wrong_with_one_sensor_moves_no_other(check):
    made = {"errors": DEFECTS[check]}
    others = np.arange(10) != 4
    for seed in range(SCANS):
        well = calibrated(seed)
        ill = calibrated(seed, **made)
        if check:
            assert ill.array.failing[check] == ("T04",)
        assert np.array_equal(ill.used, others) == (check == "dead_taxels")
        _, u = well.of_constants
        moved = ill.array.conversion_constants / well.array.conversion_constants - 1
        assert np.all(abs(moved[others]) < 0.75 * u[others])
