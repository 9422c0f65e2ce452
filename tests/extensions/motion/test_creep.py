"""Creep of a sensor: what a dwell record tells, its file, and the scans that it corrects."""

import numpy as np
import pytest
from helpers.schemas import faults
from scipy.signal import lfilter

import memscal
from memscal.extensions.motion.creep import creep_of
from memscal.model.quantities import measured_text
from memscal.readings.noise_record import noise_of

TIME = np.arange(1200) / 20
ROD = memscal.Rod(radius=0.25e-3)
COLUMNS = ("--time", "t", "--u", "U")


def dwell(shares=(0.05,), times=(1.0,), noise=0.002, **stated):
    """Return a dwell record of 60 s at 20 Hz."""
    u = 1 + noise * np.random.default_rng(1).standard_normal(TIME.size)
    u -= np.exp(np.divide.outer(-TIME, times)) @ shares
    given = {"u_zz": 1e-3 * u, "time": TIME, "indenter": ROD, "motion": "rest"} | stated
    return memscal.Scan(x=0 * TIME, **given)


def failed(**stated):
    return [check.name for check in creep_of(dwell(**stated)).checks if not check.passed]


@pytest.fixture
def table(tmp_path):
    """The table of a logger whose clock does not begin at zero, and whose rows are shuffled."""
    rows = np.column_stack([1.7e9 + TIME, 1e3 * dwell().u_zz])
    rows = np.random.default_rng(2).permutation([*rows, [1.7e9 - 1, np.nan]])
    np.savetxt(tmp_path / "dwell.csv", rows, "%.8f", ",", header="t/s,U/mV", comments="")
    return tmp_path / "dwell.csv"


def test_an_exact_record_gives_what_it_was_made_of():
    level = 1e-3 * (1 - 0.05 * np.exp(-TIME[-1]))
    found = creep_of(dwell(noise=0.0)).parameters.values
    assert found == pytest.approx([0.05, 1.0, level, TIME[-1]], rel=1e-6)
    assert failed(noise=0.0) == []


@pytest.mark.parametrize("times", [(0.1, 10.0), (1.0, 100.0)])
def test_the_residuals_tell_that_one_time_does_not_do(times):
    fails = failed(shares=(0.02, 0.02), times=times, noise=0.001)
    assert fails == ["one_time", "residual_correlation"]


def test_noise_that_is_not_white_is_said():
    noise = lfilter([1e-6], [1.0, -0.3], np.random.default_rng(3).standard_normal(TIME.size))
    assert "residual_correlation" in failed(u_zz=dwell(noise=0.0).u_zz + noise)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        (
            {"shares": (0.0,), "noise": 0.005},
            r"no creep seen; a share of 1\.\d % with a time of 0.6 s",
        ),
        ({"times": (500.0,)}, "takes 60 s or longer"),
        (
            {"shares": (-0.05,), "noise": 1e-5},
            "late is -5 %, with a time of 1 s",
        ),
        ({"indenter": None}, "is no dwell record"),
        ({"u_zz": np.ones(TIME.size)}, "all are equal"),
        ({"u_zz": np.where(TIME < 3, TIME, np.nan)}, "fewer than 64"),
    ],
)
def test_a_record_without_creep_or_of_something_else_is_refused(stated, words):
    with pytest.raises(memscal.MemscalError, match=words):
        creep_of(dwell(**stated))


def test_a_scan_along_time_keeps_its_indenter_and_is_no_noise_record(run, table):
    path = table.with_name("dwell.h5")
    small = creep_of(dwell(u_zz=1e-6 * dwell().u_zz, unit="A"))
    # A unit of readings that were read before is not that of these.
    assert measured_text(small.parameters, "level").endswith("nA")
    memscal.write_scan(dwell(unit="A"), path)
    read = memscal.read_scan(path)
    assert read.indenter == ROD
    with pytest.raises(memscal.MemscalError, match="is no noise record"):
        noise_of(read)
    run("creep", path, "-o", path, "--force").exits(4, "input")
    printed = run("creep", path, "-o", path.with_name("a.h5"), "--json").exits(0).json
    assert faults("creep", printed) == []
    other = run("creep", table, *COLUMNS, "-o", path.with_name("b.h5"), "--json").exits(0).json
    for name in ("share", "time", "level", "record"):
        assert other[name]["value"] == pytest.approx(printed[name]["value"], rel=1e-4)


def test_a_calibration_takes_the_creep_of_a_file_and_records_its_digest(run, good_scan, table):
    creep = table.with_name("creep.h5")
    artifact = table.with_name("a.h5")
    run("creep", table, *COLUMNS, "-o", creep).exits(0)
    printed = run("calibrate", good_scan, "--creep", creep, "-o", artifact).exits(0)
    assert "Creep is corrected for by creep.h5" in " ".join(printed.err.split())
    apparatus = memscal.load_apparatus(artifact)
    found = creep_of(dwell()).parameters
    dynamics = apparatus.sensor.dynamics
    numbers = [dynamics.creep_share, dynamics.creep_time_uncertainty, dynamics.creep_record]
    expected = [found["share"], found.uncertainty("time"), TIME[-1]]
    assert numbers == pytest.approx(expected, rel=1e-3)
    held = run("inspect", creep, "--json").exits(0).json
    named = f"creep.h5 (sha256 {held['sha256']}): all checks passed"
    assert apparatus.process.configuration["creep"] == named
    assert held["provenance"]["input_scan"] == "dwell.csv"
    assert run("check", creep).exits(0).out.count("passed") == 4


def test_the_figure_shows_the_record_with_its_creep():
    _, line = creep_of(dwell()).plot().axes[0].lines
    assert line.get_ydata()[[0, -1]] == pytest.approx([0.95, 1.0], abs=5e-3)
