"""The file of measured stress: what was measured comes back, and nothing else is read."""

import gzip
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.builders import make_film
from helpers.folders import DATA
from helpers.scans import known_apparatus

import memscal
from memscal import (
    Equipment,
    LoadCell,
    MeasuredPoints,
    MeasuredProfile,
    MeasuredScan,
    MeasuredStress,
    Process,
    QualityCheck,
    SourceFile,
    Sphere,
    StressSensor,
)
from memscal.errors import FormatError, InputError
from memscal.formats.hdf5 import limits
from memscal.formats.inspection import check
from memscal.formats.stress import read_stress, write_stress

SCANS = tuple(
    MeasuredScan(
        film=make_film(),
        indenter=Sphere(radius=0.1288, radius_uncertainty=0.5e-3),
        sensor=StressSensor(name="S1", model="MEMS", channel="zz"),
        load_cell=LoadCell(name="balance", serial_number="7"),
        width=3e-3,
        lubrication=lubrication,
        motion="sliding",
        speed=1e-3,
        sliding_friction=0.3,
        sliding_friction_uncertainty=0.02,
        position_scale_uncertainty=scale,
        gain_uncertainty=scale,
        stage=Equipment(name="stage", serial_number="8"),
        synthetic=scale is None,
        source=SourceFile(f"{lubrication}.h5", "1" * 64),
    )
    for lubrication, scale in (("dry", None), ("lubricated", 0.002))
)


def make_points(n, rng, channel):
    normal = channel == "zz"
    return MeasuredPoints(
        x=rng.normal(0, 1e-3, n),
        y=np.zeros(n),
        u=rng.normal(0, 1e-3, n),
        noise=rng.uniform(1e-6, 1e-5, n) if normal else None,
        weight=rng.uniform(0, 1, n),
        load=rng.uniform(0.5, 1.5, n),
        load_errors=rng.uniform(0, 0.01, n),
        x_errors=rng.uniform(0, 1e-5, n),
        correlation=np.eye(n) if normal else None,
    )


def make_stress_profile(load, n=7, **fields):
    rng = np.random.default_rng(n)
    x = rng.uniform(-1e-3, 2e-3, n)
    r = np.sort(np.abs(x))
    root = rng.normal(size=(n, n))
    made = {
        "scan": SCANS[1],
        "load": load,
        "load_uncertainty": 0.01 * load,
        "r": r,
        "x": x,
        "y": 0 * x,
        "s_zz": 1e5 * load * np.exp(-(r**2) / 1e-6),
        "roots": {"noise": 100 * np.abs(root[0]), "centre": 10.0 * root[:, :2]},
        "force": 1.01 * load,
        "force_budget": {"scan": 0.003, "apparatus": 0.004},
        "maximum": 1e5 * load,
        "maximum_budget": {"noise": 120.0},
        "centre": np.array([1.23456789e-4, 0.0]),
        "centre_uncertainty": np.array([1e-5 / 3, 0.0]),
        "baseline": 1e-5 / 7,
        "baseline_uncertainty": 1e-7 / 3,
        "contact_radius": 2e-3 / 3,
        "curve_r": np.linspace(0, r[-1], 11),
        "curve_s_zz": np.linspace(1e5, 0, 11) / 3,
        "points": {name: make_points(2 * n, rng, name) for name in ("zz", "xz")},
    }
    return MeasuredProfile(**(made | fields))


BACK = {"direction": -1.0, "tangential_load": -0.15}


def make_stress(**fields):
    process = Process(program="memscal", version="1", date="", configuration={"override": True})
    made = {
        "profiles": (make_stress_profile(0.5, scan=SCANS[0], **BACK), make_stress_profile(1.5, 9)),
        "scans": SCANS,
        "conversion_constant": 1e-7 / 3,
        "conversion_constant_uncertainty": 7e-10 / 3,
        "checks": (
            QualityCheck("applied_force_1", 0.4, 3.0, True, "0.5 N, dry: fine", 0.7),
            QualityCheck("symmetry_1", np.nan, 3.0, False, "not a number"),
        ),
        "overridden": ('scan.h5: film "a" in the scan, "b" in the artifact',),
        "process": process,
        "artifact": SourceFile("sensor.apparatus.h5", "0" * 64),
        "artifact_digest": "a" * 64,
    }
    return MeasuredStress(**(made | fields))


@pytest.fixture
def path(folder):
    write_stress(make_stress(), "a.stress.h5")
    return folder / "a.stress.h5"


@pytest.fixture
def old(folder):
    """A file of version 1.0."""
    path = folder / "old.stress.h5"
    path.write_bytes(gzip.decompress((DATA / "stress_1_0.h5.gz").read_bytes()))
    return path


def test_what_was_saved_and_read_again_is_equal_to_the_last_bit(path):
    found = memscal.read_stress(path)
    assert found == make_stress()
    assert np.isnan(found.checks[1].value)
    assert len(repr(found)) < 200


def test_a_file_of_version_1_0_is_read_with_what_it_holds(old):
    found = memscal.read_stress(old)
    [profile] = found.profiles
    assert (profile.load, profile.force, profile.lubrication) == (0.5, 0.505, "dry")
    assert [scan.source.file_name for scan in found.scans if scan.source] == ["dry.h5", "wet.h5"]
    assert found.scans[1].film == make_film(law="", mooney_rivlin_ratio=None)
    assert not profile.points
    apparatus = known_apparatus()
    with pytest.raises(InputError, match="holds no measured points") as caught:
        memscal.compare(old, apparatus)
    assert "memscal apply" in caught.value.cure
    found.save("again.h5")
    assert memscal.read_stress("again.h5") == found


def test_other_programs_find_a_plottable_group_for_each_load(path):
    with h5py.File(path) as file:
        default = file["entry"][file["entry"].attrs["default"]]
        assert default[default.attrs["signal"]].shape == (9,)
        roots = file["entry/roots"][file["entry"].attrs["default"]]
        variance = roots["root_noise"][()] ** 2 + np.sum(roots["root_centre"][()] ** 2, axis=1)
        np.testing.assert_allclose(default["s_zz_errors"][()] ** 2, variance, rtol=1e-12)


def test_a_changed_number_is_found_out(path):
    with h5py.File(path, "r+") as file:
        file["entry/profile_1/s_zz"][0] *= 1.01
    with pytest.raises(FormatError, match="was changed after it was written"):
        read_stress(path)
    assert not all(finding.passed for finding in check(path))


POINTS = make_points(7, np.random.default_rng(0), "zz")


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("x", {"x": np.zeros(5)}),
        ("normal_load", {"points": {"zz": replace(POINTS, load=np.zeros(5))}}),
    ],
)
def test_an_array_of_another_shape_is_refused_by_its_path(name, fields):
    make_stress(profiles=(make_stress_profile(1.0, **fields),)).save("a.h5")
    with pytest.raises(FormatError, match=rf"1/{name} has shape \(5,\), but its axes give"):
        read_stress("a.h5")


@pytest.mark.parametrize("wrong", [np.ones(5), np.full(7, np.nan), np.ones((7, 0)), np.ones(())])
def test_a_root_of_another_shape_or_not_finite_is_refused_by_its_path(path, wrong):
    with h5py.File(path, "r+") as file:
        del file["entry/roots/profile_1/root_noise"]
        file["entry/roots/profile_1/root_noise"] = wrong
        file["entry/roots/profile_1/root_noise"].attrs["units"] = "Pa"
    with pytest.raises(FormatError, match="profile_1/root_noise should hold finite numbers in 7"):
        read_stress(path, accept_altered=True)


@pytest.mark.parametrize("factor", [-1.0, 1e200, np.nan])
def test_a_covariance_of_an_older_file_must_be_one(old, factor):
    with h5py.File(old, "r+") as file:
        stored = file["entry/profile_1/covariance_noise"]
        stored[0, 1:] = factor * np.abs(stored[0, 0]) * (1 + np.arange(stored.shape[0] - 1))
    with pytest.raises(FormatError, match=r"covariance_noise (is no covariance|should hold)"):
        read_stress(old, accept_altered=True)


def test_covariances_beside_the_profiles_are_read_like_those_within(old):
    [within] = memscal.read_stress(old).profiles
    with h5py.File(old, "r+") as file:
        expected = file["entry/profile_1/covariance"][()]
        for name in [n for n in file["entry/profile_1"] if n.startswith(("covariance", "sources"))]:
            file.require_group("entry/covariances/profile_1")
            file.move(f"entry/profile_1/{name}", f"entry/covariances/profile_1/{name}")
    [beside] = memscal.read_stress(old, accept_altered=True).profiles
    for profile in (within, beside):
        close = 1e-9 * np.abs(expected).max()
        np.testing.assert_allclose(profile.covariance, expected, rtol=0, atol=close)


def test_what_could_not_be_read_again_is_not_written(monkeypatch):
    monkeypatch.setattr(limits, "MOST_HDF5_BYTES", 2**16)
    with pytest.raises(InputError, match=r"bytes, but at most 65,536 are taken(.|\n)*fewer"):
        make_stress().save("a.h5")
    assert not list(Path().iterdir())
