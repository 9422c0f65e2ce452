"""``memscal calibrate --channel``: the tangential channel on the command line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.console import Run, names
from helpers.scans import LINEAR_FILM, shear_scan

import memscal


@pytest.fixture
def sheared(folder: Path) -> Path:
    """A scan with a tangential channel."""
    path = folder / "scan.h5"
    memscal.write_scan(shear_scan(seed=1, film=replace(LINEAR_FILM, law="")), path)
    return path


def test_the_channel_goes_to_an_artifact_of_its_own_by_method_bayesian(run: Run, sheared: Path):
    done = run("calibrate", sheared, "--channel", "xz", "--json").exits(0)
    assert done.json["method"] == "bayesian"
    assert "experimental" in done.err
    apparatus = memscal.load_apparatus(sheared.with_name("scan.xz.apparatus.h5"))
    assert apparatus.sensor.channel == "xz"
    alone = memscal.calibrate(sheared, channel="xz", method="bayesian").apparatus.parameters
    np.testing.assert_allclose(apparatus.parameters.values, alone.values, rtol=1e-9)
    np.testing.assert_allclose(apparatus.parameters.covariance, alone.covariance, rtol=1e-9)
    assert run("calibrate", sheared).code == 0
    assert names(sheared.parent) == ["scan.apparatus.h5", "scan.h5", "scan.xz.apparatus.h5"]


def test_a_report_and_a_figure_are_drawn(run: Run, sheared: Path):
    run("calibrate", sheared, "--channel", "xz", "--report", "r.html", "--figure", "f.png").exits(0)
    assert {"r.html", "f.png"} < set(names(sheared.parent))


def test_a_method_that_divides_fields_is_refused_by_a_dry_run(run: Run, sheared: Path):
    done = run("calibrate", sheared, "--channel", "xz", "--method", "wiener", "--dry-run")
    done.exits(3, "bayesian")
    assert names(sheared.parent) == ["scan.h5"]
