"""The file of measured stress: what was measured comes back, and nothing else is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from builders import make_artifact, make_film
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from memscal.model.stress_record import StressRecord, StressRecordProfile

import memscal
from memscal.errors import FormatError, MemscalError, OutputError, UnitError
from memscal.formats.artifact import write_artifact
from memscal.formats.inspection import check, describe
from memscal.formats.stress import read_stress, write_stress
from memscal.model.apparatus import QualityCheck
from memscal.model.indenter import Sphere
from memscal.model.provenance import Process, SourceFile
from memscal.model.scan import StressSensor

EXACT = 1e-14


def make_record_profile(load: float, points: int = 7) -> StressRecordProfile:
    x = np.linspace(-1e-3, 2e-3, points)
    r = np.sort(np.abs(x))
    rng = np.random.default_rng(points)
    root = rng.normal(size=(points, points))
    return StressRecordProfile(
        load=load,
        load_uncertainty=0.01 * load,
        lubrication="dry",
        scan=1,
        r=r,
        x=x,
        y=0 * x,
        s_zz=1e5 * load * np.exp(-(r**2) / 1e-6),
        covariances={"noise": 1e4 * root @ root.T, "centre": 10.0 * np.ones((points, points))},
        force=1.01 * load,
        maximum=1e5 * load,
        budget={"force": {"scan": 0.003, "apparatus": 0.004}, "maximum": {"noise": 120.0}},
        centre=np.array([1.2e-4, 0.0]),
        centre_uncertainty=np.array([1e-5, 0.0]),
        baseline=1e-5,
        baseline_uncertainty=1e-7,
        contact_radius=2e-3,
    )


def make_record() -> StressRecord:
    return StressRecord(
        profiles=(make_record_profile(0.5), make_record_profile(1.5, 9)),
        film=make_film(),
        indenter=Sphere(radius=0.1288, radius_uncertainty=0.5e-3),
        sensor=StressSensor(name="S1", model="MEMS", channel="zz"),
        conversion_constant=1e-7,
        conversion_constant_uncertainty=7e-10,
        checks=(QualityCheck("applied_force_1", 0.4, 3.0, True, "0.5 N, dry: fine", 0.7),),
        overridden=('scan.h5: film "a" in the scan, "b" in the artifact',),
        artifact=SourceFile("sensor.apparatus.h5", "0" * 64),
        scans=(SourceFile("dry.h5", "1" * 64), SourceFile("wet.h5", "2" * 64)),
        process=Process(program="memscal", version="1", date="", configuration={"override": True}),
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_stress(make_record(), tmp_path / "a.stress.h5")
    return tmp_path / "a.stress.h5"


def test_everything_comes_back(path: Path) -> None:
    found, wanted = read_stress(path), make_record()
    for name in ("film", "indenter", "sensor", "checks", "overridden", "artifact", "scans"):
        assert getattr(found, name) == getattr(wanted, name)
    assert found.conversion_constant == pytest.approx(wanted.conversion_constant, rel=EXACT)
    assert found.process.configuration == {"override": True}
    for mine, its in zip(found.profiles, wanted.profiles, strict=True):
        assert list(mine.covariances) == list(its.covariances)
        for source, values in its.covariances.items():
            np.testing.assert_allclose(mine.covariances[source], values, rtol=EXACT)
        for name in ("r", "x", "y", "s_zz", "s_zz_errors", "centre", "centre_uncertainty"):
            np.testing.assert_allclose(getattr(mine, name), getattr(its, name), rtol=EXACT)
        for name in ("load", "load_uncertainty", "force", "maximum", "baseline", "contact_radius"):
            assert getattr(mine, name) == pytest.approx(getattr(its, name), rel=EXACT)
        assert (mine.scan, mine.lubrication) == (its.scan, its.lubrication)
        assert mine.budget == its.budget
        assert mine.uncertainty("force") == pytest.approx(0.005)


def test_memscal_reads_it_by_name(path: Path) -> None:
    assert memscal.read_stress(path).profiles[1].load == 1.5


def test_other_programs_find_a_plottable_group_for_each_load(path: Path) -> None:
    with h5py.File(path) as file:
        default = file["entry"][file["entry"].attrs["default"]]
        assert default.attrs["NX_class"] == b"NXdata"
        signal = default[default.attrs["signal"]]
        assert signal.shape == (9,)
        assert signal.attrs["units"] == b"Pa"
        assert default["covariance"].attrs["units"] == b"Pa^2"
        errors = default["s_zz_errors"][()]
        np.testing.assert_allclose(errors**2, np.diag(default["covariance"][()]), rtol=1e-12)


def test_a_sound_file_is_described_and_in_order(path: Path) -> None:
    assert all(finding.passed for finding in check(path))
    found = describe(path)
    assert found["schema"] == "memscal-stress"
    loads = [q["value"] for q in found["quantities"] if q["name"] == "load"]
    assert loads == [0.5, 1.5]
    assert {a["path"] for a in found["arrays"]} >= {"/entry/profile_1/s_zz", "/entry/profile_2/r"}


def test_a_changed_number_is_found_out(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["entry/profile_1/s_zz"][0] *= 1.01
    with pytest.raises(FormatError, match="was changed after it was written"):
        read_stress(path)
    assert not all(finding.passed for finding in check(path))


def test_another_schema_is_refused_by_its_name(tmp_path: Path) -> None:
    write_artifact(make_artifact(), tmp_path / "a.h5")
    with pytest.raises(FormatError, match='schema "memscal-artifact", but "memscal-stress"'):
        read_stress(tmp_path / "a.h5")


def test_an_existing_file_is_left_alone(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(OutputError):
        write_stress(make_record(), path)
    assert path.read_bytes() == before


def test_the_same_record_gives_the_same_bytes(path: Path, tmp_path: Path) -> None:
    write_stress(make_record(), tmp_path / "b.h5")
    assert (tmp_path / "b.h5").read_bytes() == path.read_bytes()


def test_a_covariance_of_another_shape_is_refused_by_its_path(tmp_path: Path) -> None:
    profile = replace(make_record_profile(1.0), covariances={"noise": np.eye(7)})
    wrong = replace(profile, x=np.zeros(5))
    write_stress(replace(make_record(), profiles=(wrong,)), tmp_path / "a.h5")
    with pytest.raises(FormatError, match=r"/entry/profile_1/x has shape \(5,\), but r gives"):
        read_stress(tmp_path / "a.h5")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(where=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_flipped_bit_is_refused_or_changes_nothing(path: Path, where: float, bit: int) -> None:
    whole = path.read_bytes()
    damaged = bytearray(whole)
    damaged[int(where * len(whole))] ^= 1 << bit
    spoilt = path.with_name("spoilt.h5")
    spoilt.write_bytes(bytes(damaged))
    try:
        found = read_stress(spoilt)
    except (MemscalError, UnitError):
        return
    wanted = make_record()
    for mine, its in zip(found.profiles, wanted.profiles, strict=True):
        np.testing.assert_allclose(mine.s_zz, its.s_zz, rtol=EXACT)
        np.testing.assert_allclose(mine.covariance, its.covariance, rtol=EXACT)
