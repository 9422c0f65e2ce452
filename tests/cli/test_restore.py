"""``memscal restore``: what it prints, what it writes, and its exit codes."""

from pathlib import Path

import numpy as np
import pytest
from helpers.console import Run
from helpers.scans import pressed, sphere_scan

import memscal


@pytest.fixture
def sphere(folder: Path) -> Path:
    path = folder / "sphere.h5"
    memscal.write_scan(sphere_scan(pressed(), seed=5), path)
    return path


def test_the_file_is_a_reference_with_errors(run: Run, artifact: Path, sphere: Path, folder: Path):
    assert "Written: stress.h5" in run("restore", artifact, sphere, "-o", "stress.h5").err
    profile = memscal.read_reference(folder / "stress.h5")
    assert np.all(profile.sigma_zz_errors > 0)
    assert profile.force == pytest.approx(1.0, rel=0.1)
    assert run("check", "stress.h5").code == 0
