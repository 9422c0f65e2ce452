"""An altered artifact is refused; a newer major version is refused; a newer minor one is not."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.builders import make_artifact, make_film, make_profile, make_scan
from helpers.digests import rewrite_digest

from memscal import load_apparatus, read_reference, read_scan, write_reference, write_scan
from memscal.errors import FormatError, SchemaVersionError
from memscal.formats.artifact import write_artifact
from memscal.formats.hdf5.writer import SCHEMA_VERSION
from memscal.formats.inspection import check


@pytest.fixture
def artifact(folder):
    write_artifact(make_artifact(), "a.h5")
    return folder / "a.h5"


def altered(path, index, change):
    """A change of the values of a dataset."""
    return lambda file: file[path].__setitem__(index, change(file[path][index]))


def new_text(file):
    del file["/entry/process/date"]
    file["/entry/process"]["date"] = np.bytes_("2034-01-02T03:04:05+00:00")


CHANGES = {
    "value": altered("/entry/parameters/conversion_constant", (), lambda a: a * (1 + 1e-15)),
    "one of many": altered("/entry/apparatus_function/g", (3, 4), lambda g: g + 1e-9),
    "verdict": altered("/entry/quality/symmetry/passed", (), lambda _: 1),
    "unit": lambda file: file["/entry/radial_profile/r"].attrs.update(units=np.bytes_("um")),
    "axes": lambda file: file["/entry/apparatus_function"].attrs.update(axes=[b"x", b"y"]),
    "text": new_text,
    "something gone": lambda file: file.__delitem__("/entry/parameters/baseline_errors"),
    "list gone": lambda file: file.__delitem__("/entry/contents"),
    "digest gone": lambda file: file.attrs.__delitem__("memscal_content_sha256"),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_an_artifact_that_was_altered_is_refused(artifact, change):
    with h5py.File(artifact, "r+") as file:
        change(file)
    with pytest.raises(FormatError, match=r"a\.h5 was changed after it was written") as caught:
        load_apparatus(artifact)
    assert "calibration" in caught.value.cure


def test_a_copy_made_by_another_program_still_fits_its_digest(artifact):
    """The digest is over the content, not over the bytes of the file."""
    with h5py.File(artifact) as old, h5py.File("copy.h5", "w", libver="latest") as new:
        old.copy("/entry", new)
        for name, value in old.attrs.items():
            new.attrs[name] = value
    assert Path("copy.h5").read_bytes() != artifact.read_bytes()
    assert load_apparatus("copy.h5").load == 1.0


def test_what_other_programs_add_is_ignored(artifact):
    with h5py.File(artifact, "r+") as file:
        file["/entry/my_notes"] = "added later"
        file["/entry/parameters/budget/added"] = 1.0
        file["/entry/loop"] = file["/entry"]
        file["/entry/apparatus_function"].attrs["colour"] = "red"
    assert load_apparatus(artifact).load == 1.0


ADDITIONS = {
    "scan": ["sample/film/roughness_rms", "sample/lubrication", "indenter/load_errors"],
    "reference": ["parameters/depth", "parameters/film/name", "reference/sigma_zz_errors"],
    "artifact": ["sample/film/roughness_rms", "instrument/stress_sensor/serial_number"],
}
READERS = {
    "scan": read_scan,
    "reference": read_reference,
    "artifact": load_apparatus,
}


@pytest.mark.parametrize(("kind", "path"), [(k, p) for k, of in ADDITIONS.items() for p in of])
def test_no_reader_uses_what_was_added_or_changed_unless_that_is_accepted(kind, path):
    """A path that the reader knows and the list lacks, and a number that does not fit."""
    file_path = Path(f"{kind}.h5")
    if kind == "scan":
        write_scan(make_scan(film=make_film(roughness_rms=None), load_uncertainty=None), file_path)
    elif kind == "reference":
        write_reference(make_profile(depth=None), file_path)
    else:
        write_artifact(make_artifact(film=make_film(roughness_rms=None)), file_path)
    text = path.endswith(("name", "lubrication", "serial_number"))
    with h5py.File(file_path, "r+") as file:
        size = file["/entry/reference/r"].shape if path.endswith("sigma_zz_errors") else ()
        file[f"/entry/{path}"] = "dry" if text else np.full(size, 0.5)
        if not text:
            unit = "N" if "load" in path else "Pa" if "sigma" in path else "mm"
            file[f"/entry/{path}"].attrs["units"] = unit
    assert not check(file_path)[-1].passed
    with pytest.raises(FormatError, match=f"/entry/{path} was added"):
        READERS[kind](file_path)
    source = READERS[kind](file_path, accept_altered=True).source
    assert source.altered == f"/entry/{path} was added"
    with h5py.File(file_path, "r+") as file:
        del file[f"/entry/{path}"]
    assert not READERS[kind](file_path).source.altered
    with h5py.File(file_path, "r+") as file:
        film = file["/entry/parameters" if kind == "reference" else "/entry/sample"]["film"]
        film["thickness"][()] *= 1.01
    with pytest.raises(FormatError, match="does not fit its digest"):
        READERS[kind](file_path)
    source = READERS[kind](file_path, accept_altered=True).source
    assert source.altered == "its content does not fit its digest"


@pytest.fixture(params=["scan", "reference", "artifact"])
def versioned(request, folder):
    path = folder / f"{request.param}.h5"
    write, read, thing = {
        "scan": (write_scan, read_scan, make_scan()),
        "reference": (write_reference, read_reference, make_profile()),
        "artifact": (write_artifact, load_apparatus, make_artifact()),
    }[str(request.param)]
    write(thing, path)

    def read_version(version):
        with h5py.File(path, "r+") as file:
            file.attrs["memscal_schema_version"] = version
            file["/entry/of_the_future"] = h5py.Empty("f8")
        if version != SCHEMA_VERSION:
            rewrite_digest(path)
        return read(path)

    return read_version


@pytest.mark.parametrize("version", ["2.0.0", "10.1.0"])
def test_a_newer_major_version_is_refused_in_plain_words(versioned, version):
    with pytest.raises(SchemaVersionError, match=rf"newer memscal(.|\n)*{version}(.|\n)*Upgrade"):
        versioned(version)


@pytest.mark.parametrize("version", ["1.0.0", SCHEMA_VERSION, "1.7.3"])
def test_a_newer_minor_version_with_unknown_content_is_read(versioned, version):
    assert versioned(version).load == 1.0


@pytest.mark.parametrize(
    ("path", "change", "message"),
    [
        ("/entry/radial_covariance/r", lambda r: 1.5 * r, "differs from /entry/radial_profile/r"),
        ("/entry/radial_profile/g", lambda g: g[:-1], r"shape \(40,\), but its axes give \(41,\)"),
    ],
)
def test_arrays_that_do_not_fit_each_other_are_refused(artifact, path, change, message):
    with h5py.File(artifact, "r+") as file:
        values = change(file[path][()])
        del file[path]
        file[path] = values
        file[path].attrs["units"] = "mm" if path.endswith("r") else "1/mm^2"
    rewrite_digest(artifact)
    with pytest.raises(FormatError, match=message):
        load_apparatus(artifact)


@pytest.mark.parametrize("version", ["", "one", "-1", "²", "0.9.0"])
def test_an_older_major_version_and_what_is_none_are_refused(versioned, version):
    refusals = (SchemaVersionError, "not read any more"), (FormatError, "not a version")
    error, words = refusals[version != "0.9.0"]
    with pytest.raises(error, match=words):
        versioned(version)


def test_the_wrong_kind_of_file_is_refused_by_name(artifact):
    with pytest.raises(FormatError, match=r'"memscal-artifact", but "memscal-scan"'):
        read_scan(artifact)
    with h5py.File("foreign.h5", "w") as file:
        file["x"] = 1.0
    with pytest.raises(FormatError, match="no memscal schema"):
        read_scan("foreign.h5")
