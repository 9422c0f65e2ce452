"""What inspect says about a file, and what check finds."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.builders import make_artifact, make_profile, make_scan

from memscal import load_apparatus, write_reference, write_scan
from memscal.errors import FormatError, InputError
from memscal.formats.artifact import write_artifact
from memscal.formats.inspection import check, describe
from memscal.model.provenance import timestamp


@pytest.fixture(autouse=True)
def _files(folder):
    write_scan(make_scan("raster"), "scan.h5")
    write_reference(make_profile(friction_coefficient=float("inf")), "reference.h5")
    write_artifact(make_artifact(), "artifact.h5")


@pytest.mark.parametrize("name", ["scan", "reference", "artifact"])
def test_a_sound_file_is_found_in_order_and_described_in_standard_json(name):
    path = f"{name}.h5"
    passed = {f.name: f.passed for f in check(path)}
    assert list(passed.items()) == [(n, True) for n in ("safety", "schema", "digest", "content")]
    found = describe(path)
    assert (found["file"], found["schema"]) == (f"{name}.h5", f"memscal-{name}")
    assert json.loads(json.dumps(found, allow_nan=False)) == found


@pytest.mark.parametrize(
    ("version", "step", "words"),
    [("1.0.0", "content", "/entry/indenter/radius"), ("2.0.0", "schema", "newer")],
)
def test_a_scan_fails_at_its_newer_version_or_at_what_it_lacks(version, step, words):
    with h5py.File("scan.h5", "r+") as file:
        file.attrs["memscal_schema_version"] = version
        del file.attrs["memscal_content_sha256"], file["/entry/indenter/radius"]
    last = check("scan.h5")[-1]
    assert (last.name, last.passed) == (step, False)
    assert words in last.meaning


def test_an_uncertainty_without_a_value_is_refused_by_its_path():
    with h5py.File("reference.h5", "r+") as file:
        del file.attrs["memscal_content_sha256"]
        file["/entry/parameters/depth_errors"] = np.zeros(0)
        file["/entry/parameters/depth_errors"].attrs["units"] = "mm"
    with pytest.raises(FormatError, match="depth_errors has 0 values"):
        describe("reference.h5")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_stored_json_with_a_number_that_is_none_is_refused(number):
    with h5py.File("artifact.h5", "r+") as file:
        text = file["/entry/process/configuration/data"][()].decode()
        del file["/entry/process/configuration/data"]
        file["/entry/process/configuration/data"] = text.replace("0.1", number)
    for read in (describe, load_apparatus):
        with pytest.raises(InputError, match=f"configuration/data is not JSON: {number}"):
            read("artifact.h5", accept_altered=True)


def test_what_is_no_file_of_ours_fails_at_the_first_step():
    Path("a.h5").write_bytes(b"text")
    with h5py.File("b.h5", "w"):
        pass
    for path in (".", "a.h5", "b.h5", "missing.h5"):
        (finding,) = check(path)
        assert (finding.name, finding.passed) == ("safety", False)
        assert finding.meaning


def test_the_time_is_that_of_the_build_where_one_is_given(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    assert timestamp() == "2023-11-14T22:13:20+00:00"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "")
    assert timestamp().endswith("+00:00")
