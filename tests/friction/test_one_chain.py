"""One stage, or one gain, of calibration and contacts: its error counts once, and may cancel."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import memscal
from memscal import Equipment
from memscal.friction.calculated import amontons_family
from memscal.friction.likelihood import points_of, predict, sensor_of

LOAD = 2.75
SHARE = 0.01
STAGE = Equipment(name="stage", serial_number="7")


@lru_cache
def made():
    return memscal.simulate_experiment(friction=0.1, loads=[LOAD], lubricated_loads=[LOAD], seed=3)


@lru_cache
def family():
    scan = made().dry
    return amontons_family(scan.film, scan.indenter, [LOAD], friction=(0.0, 0.1), reach=24e-3)


@lru_cache
def calibrated(stretch=1.0):
    rod = replace(
        made().rod,
        x=stretch * made().rod.x,
        stage=STAGE,
        position_scale_uncertainty=SHARE,
        gain_uncertainty=SHARE,
    )
    return memscal.calibrate(rod, method="evidence").apparatus


@lru_cache
def measured(stage, gain=None):
    dry = replace(
        made().dry,
        stage=stage,
        position_scale_uncertainty=SHARE,
        gain_uncertainty=gain,
    )
    return memscal.measure_stress(dry, calibrated())


def predicted(stage, gain=None, stretch=1.0):
    contact = measured(stage, gain)
    sensor = sensor_of(calibrated(stretch), family(), 8e-3, contact.scans)
    readings = points_of(contact.profiles)[0]
    readings = replace(readings, offset=stretch * readings.offset)
    return predict(readings, sensor, family().at(0.1), 0)


def test_one_stage_stretches_the_calibration_and_the_contacts_alike():
    one = predicted(STAGE)
    truth = predicted(STAGE, stretch=1 + SHARE).signal - one.signal
    column = one.columns["position_scale"][0, :, 0]
    assert np.abs(column - truth[0]).max() < 0.05 * np.abs(truth).max()
    other = predicted(Equipment(name="another"))
    apart = other.columns["position_scale"][0, :, 0]
    assert np.abs(apart - truth[0]).max() > 0.3 * np.abs(truth).max()
    # What one column takes from A G is no longer among its own changes.
    sizes = [np.sum(each.columns["apparatus"] ** 2) for each in (one, other)]
    assert sizes[0] < sizes[1]


def test_one_gain_of_calibration_and_contacts_cancels():
    one = predicted(STAGE, SHARE)
    unstated = predicted(STAGE)
    signal = one.signal.max()
    assert np.abs(one.columns["gain"]).max() < 1e-9 * signal
    assert np.abs(predicted(STAGE, 3 * SHARE).columns["gain"]).max() == pytest.approx(
        2 * SHARE * signal, rel=1e-6
    )
    on_axis = [np.sum(each.columns["apparatus"][0, 16] ** 2) for each in (one, unstated)]
    assert on_axis[1] - on_axis[0] == pytest.approx((SHARE * signal) ** 2, rel=0.05)
