"""Files that version 0.1 wrote can be read, and say what they said.

One file of each schema 1.0.0 is kept.  They are not made anew: a later version must read them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from golden.make import unpack
from numpy.testing import assert_allclose

import memscal


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("written") / "files"
    unpack(folder)
    return folder


def test_a_line_scan_with_shear(files: Path) -> None:
    scan = memscal.read_scan(files / "line.scan.h5")
    assert scan.u_zz.shape == scan.channels["u_xz"].shape == (33,)
    assert_allclose(scan.x[[0, -1]], [-8e-3, 8e-3])
    assert_allclose(scan.u_zz[:3], [1.3730e-4, 1.7451e-4, 1.5166e-4], atol=1e-8)
    assert_allclose(scan.channels["u_xz"][0], 4.99209e-5, rtol=1e-5)
    assert (scan.load, scan.direction, scan.sensor.name) == (1.0, "x", "a simulated sensor")
    assert scan.film.poisson_ratio_uncertainty == pytest.approx(0.005)
    assert isinstance(scan.indenter, memscal.Rod)
    assert_allclose([scan.indenter.radius, scan.indenter.radius_uncertainty], [0.25e-3, 2.5e-6])
    assert scan.synthetic is not None
    assert scan.synthetic["conversion_constant"] == pytest.approx(1e-7)


def test_a_raster_with_missing_points(files: Path) -> None:
    scan = memscal.read_scan(files / "raster.scan.h5")
    assert scan.y is not None
    assert scan.u_zz.shape == (scan.y.size, scan.x.size) == (9, 33)
    assert np.isnan(scan.u_zz).sum() == 9
    assert np.nanmax(scan.u_zz) == pytest.approx(3e-3)
    assert scan.u_zz_errors is not None
    assert scan.normal_load is not None
    assert_allclose(scan.u_zz_errors, 1e-5)
    assert_allclose(scan.normal_load, 1.01)
    assert (scan.title, scan.notes) == ("A scan", "Two lines\nof notes, with an é.")
    assert scan.film.roughness_rms == pytest.approx(1.82e-6)


def test_a_reference_with_shear(files: Path) -> None:
    profile = memscal.read_reference(files / "reference.h5")
    assert_allclose(profile.sigma_zz[0], 1e6 / (2 * np.pi))
    assert profile.sigma_rz is not None
    assert_allclose(profile.sigma_rz, 100 * profile.r * profile.sigma_zz)
    assert_allclose([profile.load, profile.depth, profile.contact_radius], [1, 0.587e-3, 0.25e-3])
    assert (profile.solver, profile.friction_coefficient) == ("closed form", 0.0)
    assert profile.film is not None
    assert profile.film.young_modulus == pytest.approx(2.2e6)


def test_an_artifact(files: Path) -> None:
    apparatus = memscal.load_apparatus(files / "artifact.h5")
    assert apparatus.conversion_constant == pytest.approx(3e-8)
    assert apparatus.gaussian_sigma == pytest.approx(561e-6)
    assert apparatus.resolved_wavenumber == pytest.approx(3700)
    assert apparatus.parameters.uncertainty("gaussian_sigma") == pytest.approx(1e-6)
    assert apparatus.budget["conversion_constant"] == pytest.approx({"noise": 1e-10, "load": 3e-10})
    assert apparatus.field.g.shape == (13, 17)
    axis = 1 / (2 * np.pi * 561e-6**2)
    assert_allclose(apparatus.radial([0.0, 1e-3]) / axis, [1, np.exp(-0.5 / 0.561**2)], atol=0.01)
    assert {check.name: check.passed for check in apparatus.checks} == {
        "reconvolution": True,
        "symmetry": False,
    }
    assert apparatus.process.input_scan is not None
    assert apparatus.process.input_scan.file_name == "scan.h5"


def test_measured_stress(files: Path) -> None:
    stress = memscal.read_stress(files / "stress.h5")
    (profile,) = stress.profiles
    assert_allclose([profile.load, profile.force, profile.maximum], [0.5, 0.505, 5e4])
    assert_allclose(profile.s_zz, 5e4 * np.exp(-((profile.r / 1e-3) ** 2)))
    assert_allclose(profile.r, [0, 0.5e-3, 0.5e-3, 1e-3, 1e-3, 1.5e-3, 2e-3], atol=1e-12)
    assert_allclose(profile.covariance, sum(profile.covariances.values()))
    assert_allclose(profile.centre, [1.2e-4, 0.0])
    assert_allclose(profile.baseline, 1e-5)
    assert profile.lubrication == "dry"
