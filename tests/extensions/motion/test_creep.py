"""Creep of a sensor: what a dwell record tells, its file, and the scans that it corrects."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.schemas import faults
from scipy.signal import lfilter

import memscal
from memscal.extensions.motion.creep import creep_of
from memscal.readings.noise_record import noise_of

TIME = np.arange(1200) / 20
ROD = memscal.Rod(radius=0.25e-3)


def dwell(shares=(0.05,), times=(1.0,), noise=0.002, seed=1, **stated):
    """Return a dwell record of 60 s at 20 Hz."""
    u = 1 + noise * np.random.default_rng(seed).standard_normal(TIME.size)
    for share, tau in zip(shares, times, strict=True):
        u -= share * np.exp(-TIME / tau)
    given = {"u_zz": 1e-3 * u, "time": TIME, "indenter": ROD, "load": 1.0} | stated
    return memscal.Scan(x=0 * TIME, motion="rest", **given)


def table(path, record):
    """Write a record as the table of a logger whose clock does not begin at zero."""
    rows = np.column_stack([1.7e9 + record.time, 1e3 * record.u_zz])
    np.savetxt(path, rows, "%.8f", ",", header="t/s,U/mV", comments="")
    return path


def test_an_exact_record_gives_what_it_was_made_of():
    found = creep_of(dwell(noise=0.0))
    level = 1e-3 * (1 - 0.05 * np.exp(-TIME[-1]))
    assert found.parameters.values == pytest.approx([0.05, 1.0, level, TIME[-1]], rel=1e-6)
    assert found.passed


def test_missing_readings_their_order_and_the_clock_change_nothing():
    record = dwell()
    order = np.random.default_rng(2).permutation(TIME.size)
    u = np.append(record.u_zz[order], np.nan)
    time = np.append(record.time[order] + 7.0, 3.0)
    shuffled = replace(record, x=0 * time, u_zz=u, time=time)
    found = creep_of(shuffled).parameters
    np.testing.assert_allclose(found.values, creep_of(record).parameters.values, rtol=1e-6)


@pytest.mark.parametrize("times", [(0.1, 10.0), (1.0, 100.0)])
def test_the_residuals_tell_that_one_time_does_not_do(times):
    checks = {c.name: c.passed for c in creep_of(dwell((0.02, 0.02), times, noise=0.001)).checks}
    assert checks == {"one_time": False, "residual_correlation": False}


def test_noise_that_is_not_white_is_said():
    steps = np.random.default_rng(3).standard_normal(TIME.size)
    noise = lfilter([1e-6], [1.0, -0.3], steps)
    failed = [
        c.name for c in creep_of(dwell(u_zz=dwell(noise=0.0).u_zz + noise)).checks if not c.passed
    ]
    assert "residual_correlation" in failed


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (dwell((), (), noise=0.005), r"no creep seen .* a share of 1\.\d % with a time of 0.6 s"),
        (dwell(times=(500.0,)), "of a time within the record"),
        (dwell(indenter=None), "is no dwell record"),
        (replace(dwell(), motion=""), "is no dwell record"),
        (dwell(time=None), "is no dwell record"),
        (dwell(u_zz=np.ones(TIME.size)), "all are equal"),
        (dwell(time=0 * TIME), "all are equal"),
        (dwell(u_zz=np.where(TIME < 3, 1.0 - TIME, np.nan)), "fewer than 64"),
    ],
)
def test_a_record_without_creep_or_of_something_else_is_refused(record, words):
    with pytest.raises(memscal.MemscalError, match=words):
        creep_of(record)


def test_a_dwell_record_keeps_its_indenter_and_is_no_noise_record(tmp_path):
    memscal.write_scan(dwell(), tmp_path / "dwell.h5")
    read = memscal.read_scan(tmp_path / "dwell.h5")
    assert (read.indenter, read.load, read.motion) == (ROD, 1.0, "rest")
    with pytest.raises(memscal.MemscalError, match="is no noise record"):
        noise_of(read)


def test_a_table_and_a_scan_along_time_give_one_file_that_is_checked(tmp_path, run):
    table(tmp_path / "dwell.csv", dwell())
    memscal.write_scan(dwell(), tmp_path / "dwell.h5")
    columns = ("--time", "t", "--u", "U")
    creep = tmp_path / "creep.h5"
    printed = run("creep", tmp_path / "dwell.csv", *columns, "-o", creep, "--json").exits(0).json
    assert faults("creep", printed) == []
    again = run("creep", tmp_path / "dwell.h5", "-o", tmp_path / "same.h5", "--json").exits(0).json
    for name in ("share", "time", "level", "record"):
        assert again[name]["value"] == pytest.approx(printed[name]["value"], rel=1e-4)
    assert run("check", creep).exits(0).out.count("passed") == 4
    held = run("inspect", creep, "--json").exits(0).json
    assert held["schema"] == "memscal-creep"
    stored = {q["name"]: q["standard_uncertainty"] for q in held["quantities"]}
    assert stored["share"] == pytest.approx(printed["share"]["standard_uncertainty"])
    assert held["provenance"]["input_scan"] == "dwell.csv"
    run("creep", tmp_path / "dwell.h5", "-o", tmp_path / "dwell.h5", "--force").exits(4, "input")
    table(tmp_path / "two.csv", dwell((0.02, 0.02), (1.0, 100.0), noise=0.001))
    failed = run("creep", tmp_path / "two.csv", *columns, "-o", tmp_path / "two.h5").exits(1)
    assert "2 of 2 checks FAILED" in failed.out


def test_a_calibration_takes_the_creep_of_a_file_and_records_its_digest(tmp_path, run, good_scan):
    table(tmp_path / "dwell.csv", dwell())
    creep = tmp_path / "creep.h5"
    run("creep", tmp_path / "dwell.csv", "--time", 1, "--u", 2, "-o", creep).exits(0)
    artifact = tmp_path / "a.h5"
    run("calibrate", good_scan, "--creep", creep, "-o", artifact).exits(0)
    apparatus = memscal.load_apparatus(artifact)
    found = creep_of(dwell()).parameters
    dynamics = apparatus.sensor.dynamics
    assert dynamics.creep_share == pytest.approx(found["share"], rel=1e-4)
    assert dynamics.creep_time_uncertainty == pytest.approx(found.uncertainty("time"), rel=1e-3)
    assert dynamics.creep_record == pytest.approx(TIME[-1])
    named = apparatus.process.configuration["creep"]
    assert named["file_name"] == "creep.h5"
    assert named["sha256"] == run("inspect", creep, "--json").json["sha256"]
    run("calibrate", good_scan, "--creep", good_scan, "-o", artifact, "--force").exits(3, "creep")


def test_the_figure_shows_the_record_with_its_creep_and_the_residuals():
    above, below = creep_of(dwell()).plot().axes
    [_, line] = above.lines
    assert line.get_ydata()[[0, -1]] == pytest.approx([0.95, 1.0], abs=5e-3)
    assert np.std(below.lines[-1].get_ydata()) == pytest.approx(1.0)
