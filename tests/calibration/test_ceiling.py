"""Readings at a ceiling: found by the check, named by a refusal, left out where it is stated."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
from helpers.outside import clipped, marked, wide_scan
from scipy.special import erf

import memscal
from memscal import Scan


def saturation(scan, **options):
    found = memscal.calibrate(scan, other=False, **options)
    return found, next(check for check in found.apparatus.checks if check.name == "saturation")


@pytest.mark.parametrize(
    ("places", "count", "digit", "made"),
    [
        (20, 3, 0.0, {"noise": 0.02}),
        (20, 3, 1 / 1024, {"noise": 0.001}),
        (20, 4, 0.0, {"noise": 0.005, "noise_stated": False}),
        (41, 9, 1 / 1024, {"noise": 0.02, "noise_stated": False}),
        (41, 6, 0.0, {"noise": 0.005}),
    ],
)
def test_a_clipped_scan_fails_and_its_a_is_not_recommended(places, count, digit, made):
    scan = clipped(wide_scan(places + count, places=places, **made), count)
    step = digit * scan.u_zz.max() or 1e-12
    found, check = saturation(replace(scan, u_zz=np.round(scan.u_zz / step) * step))
    assert check.value == count
    assert not found.summary().startswith("Use A")


@pytest.mark.parametrize("stage", [0.0, 30e-6])
@pytest.mark.parametrize("digit", [1e-3, 1e-9])
def test_a_beam_wider_than_the_sensor_is_not_clipped(digit, stage):
    x = np.arange(-8e-3, 8.1e-3, 0.5e-3)
    true = x + np.random.default_rng(1).normal(0.0, stage, x.size)
    u = (erf((true + 3.5e-3) / 0.5e-3) - erf((true - 3.5e-3) / 0.5e-3)) / 2
    scan = Scan(x=x, u_zz=np.round(u / digit) * digit * 1e-3)
    assert saturation(scan, reference="slit:7mm", method="bayesian")[1].passed


@pytest.mark.parametrize(("count", "noise"), [(7, 0.02), (9, 0.001)])
def test_a_refusal_names_the_ceiling_and_what_leaves_it_out(count, noise):
    whole = wide_scan(count, noise=noise, noise_stated=False, width=0.55e-3)
    scan = clipped(whole, count)
    with pytest.raises(memscal.MemscalError) as caught:
        memscal.calibrate(scan)
    assert f"{count} readings look clipped" in str(caught.value)
    ceiling = float(re.search(r"--ceiling VALUE, (\S+) mV", str(caught.value))[1])
    assert np.sum(scan.u_zz >= ceiling * 1e-3) == count
    with pytest.raises(memscal.MemscalError, match=f"{count} readings at the ceiling are left out"):
        memscal.calibrate(marked(whole, count))


def test_the_range_in_a_file_leaves_out_what_an_import_does(tmp_path):
    whole = wide_scan(5, noise=0.001)
    scan = clipped(whole, 5)
    path = tmp_path / "scan.h5"
    memscal.write_scan(scan, path)
    ceiling = np.sort(scan.u_zz)[-6:-4].mean()
    with h5py.File(path, "r+") as file:
        file["entry/data/reading_high"] = ceiling * 1e6
        file["entry/data/reading_high"].attrs["units"] = "uV"
    read = memscal.read_scan(path, accept_altered=True)
    np.testing.assert_array_equal(read.u_zz, np.where(scan.u_zz > ceiling, np.nan, scan.u_zz))
    layout = memscal.TableLayout(x_unit="m", u_unit="V", ceiling=ceiling)
    table = {"x": scan.x, "U": scan.u_zz}
    imported = memscal.import_table(table, x="x", u="U", layout=layout)
    np.testing.assert_array_equal(imported.u_zz, read.u_zz)
    assert read.at_ceiling == imported.at_ceiling == 5
    found, check = saturation(read)
    assert check.passed
    assert "5 readings at the ceiling are left out." in map(str, found.apparatus.process.messages)
    parameters = found.apparatus.parameters
    u = parameters.uncertainty("conversion_constant")
    assert parameters["conversion_constant"] == pytest.approx(1e-7, abs=3 * u)
    # What was left out is missing, and counted, in the next file.
    memscal.write_scan(read, tmp_path / "again.h5")
    assert memscal.read_scan(tmp_path / "again.h5").at_ceiling == 5
