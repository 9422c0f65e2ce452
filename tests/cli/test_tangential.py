"""``memscal calibrate --channel``: the tangential channel on the command line."""

import numpy as np
import pytest
from helpers.console import names
from helpers.scans import shear_scan, simulate_experiment

import memscal


@pytest.fixture
def sheared(folder):
    """A scan with a tangential channel."""
    path = folder / "scan.h5"
    memscal.write_scan(shear_scan(seed=1, load=0.05), path)
    return path


def test_the_channel_goes_to_an_artifact_of_its_own_by_method_bayesian(run, sheared):
    done = run("calibrate", sheared, "--channel", "xz", "--json").exits(0)
    assert done.json["method"] == "bayesian"
    assert "experimental" in done.err
    assert run("calibrate", sheared).code == 0
    assert names(sheared.parent) == ["scan.apparatus.h5", "scan.h5", "scan.xz.apparatus.h5"]


def test_the_shear_of_a_contact_is_compared_with_its_channel_s_artifact(run, folder, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    made = simulate_experiment(
        friction=0.1,
        loads=[1.37],
        lubricated_loads=[1.37],
        shear=(memscal.GaussianMixture(), 5e-8),
        seed=1,
    )
    for channel in ("zz", "xz"):
        found = memscal.calibrate(made.rod, channel=channel, method="bayesian").apparatus
        found.save(f"{channel}.apparatus.h5")
    measured = memscal.measure_stress(made.dry, "zz.apparatus.h5")
    measured.save("dry.stress.h5")
    ways = ("--friction", 0.1, "--loading", "total", "--cache", "kept")
    shear = ("compare", "xz.apparatus.h5", "dry.stress.h5", "--channel", "xz", *ways)
    normal = ("compare", "zz.apparatus.h5", "dry.stress.h5", *ways)
    alone = memscal.compare(
        measured, "xz.apparatus.h5", friction=(0.0, 0.1, np.inf), loading="total", cache="kept"
    )
    joint = run(*shear, "--json").exits(0).json["joint"][0]
    assert joint["interval"]["low"] == pytest.approx(alone.joint["dry"]["total"].interval.low)
    run(*normal, "--channel", "xz").exits(3, "of channel zz")
    assert "dry, with shear" in run(*normal, "--shear", "xz.apparatus.h5").exits(0).out
    run(*shear, "--figure", "f.png").exits(2, "no effect")
