"""What is written is what is read: values, units and text."""

import dataclasses
import hashlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.builders import BARE, make_artifact, make_profile, make_scan
from helpers.records import assert_same
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from memscal import (
    Dynamics,
    FieldMesh,
    ParameterSet,
    SourceFile,
    Sphere,
    load_apparatus,
    read_reference,
    read_scan,
    write_reference,
    write_scan,
)
from memscal.errors import FormatError, InputError, OutputError, UnitError
from memscal.extensions.meshes.mesh_files import write_mesh
from memscal.formats.artifact import write_artifact
from memscal.model.checks import Message, QualityCheck, messages_from_json


def kept(**fields):
    """Write an artifact and read it."""
    write_artifact(make_artifact(**fields), "a.h5")
    return load_apparatus("a.h5")


#: Each number another one, and the share of the creep below one.
SLOW = Dynamics(**{name: 0.1 * i + 0.1 for i, name in enumerate(vars(Dynamics()))})


@pytest.mark.parametrize("kind", ["line", "repeats", "raster", "points"])
@pytest.mark.parametrize("direction", ["x", "y"])
def test_all_that_a_scan_may_state_comes_back(kind, direction):
    path = Path("scan.h5")
    plain = make_scan(kind)
    film = dataclasses.replace(plain.film, name="film A")
    count = np.arange(plain.u_zz.size).reshape(plain.u_zz.shape)
    errors = np.where(count % 33 == 4, np.nan, 0.02 * plain.normal_load * (1 + count))
    order = np.arange(count.size if kind == "raster" else 33)
    scan = dataclasses.replace(
        plain,
        x_errors=np.linspace(1e-6, 2e-6, 33),
        position_errors_by_repeat=True,
        position_scale_uncertainty=2e-3,
        gain_uncertainty=5e-3,
        gain_curvature_uncertainty=0.01,
        roundness_uncertainty=0.05,
        line_offset=0.2e-3,
        line_offset_uncertainty=0.1e-3,
        base_slip_uncertainty=0.1,
        baseline_curvature_uncertainty=0.002,
        u_zz_correlation=0.5 ** np.abs(np.subtract.outer(order, order)),
        branch=count % 3,
        film=film,
        normal_load_errors=errors,
        time=np.where(count % 33 == 4, np.nan, 0.25 * count),
        motion="sliding",
        sliding_direction=np.where(count % 33 < 20, 1, -1),
        tangential_load=-0.3 * plain.normal_load,
        speed=1e-3,
        sliding_friction=0.3,
        sliding_friction_uncertainty=0.02,
        sensor=dataclasses.replace(plain.sensor, dynamics=SLOW),
        lubrication="lubricated",
        lubricant="glycerol, 99 %",
        direction="x" if kind == "raster" else direction,
        # Points of direction y are a line, the repeats of which are numbered.
        y=None if (kind, direction) == ("points", "y") else plain.y,
        # The reference's own film has no name of its own: it is the scan's.
        reference=dataclasses.replace(plain.reference, film=film),
    )
    write_scan(scan, path)
    found = read_scan(path)
    assert_same(found, scan, but=("source",))
    assert found.kind == kind
    assert found.source == SourceFile("scan.h5", hashlib.sha256(path.read_bytes()).hexdigest())
    with h5py.File(path) as file:
        assert file["/entry/data/normal_load_errors"].attrs["units"] == "N"
        assert file["/entry/data/time"].attrs["units"] == "s"
        assert np.array_equal(file["/entry/data/direction"], scan.sliding_direction)
        assert file["/entry/indenter/speed"].attrs["units"] == "mm/s"
        assert "1 approach, 2 retreat" in file["/entry/data/branch"].attrs["meaning"]


def test_a_file_may_state_one_direction_for_each_row():
    scan = make_scan("repeats", motion="sliding", sliding_direction=[1, -1, 1])
    write_scan(scan, "scan.h5")
    with h5py.File("scan.h5", "r+") as file:
        del file["/entry/data/direction"], file.attrs["memscal_content_sha256"]
        file["/entry/data/direction"] = [1, -1, 1]
    assert np.array_equal(read_scan("scan.h5").sliding_direction, scan.sliding_direction)


SPHERE = Sphere(radius=128.8e-3, radius_uncertainty=1e-5)
ABSENT = "sigma_rz depth contact_radius stick_radius friction_coefficient film indenter convergence"


@pytest.mark.parametrize(
    "profile",
    [
        make_profile(indenter=SPHERE, notes="Two\nlines, é"),
        make_profile(**dict.fromkeys(ABSENT.split()), loading="", solver="", discretisation=""),
    ],
    ids=["whole", "only a table"],
)
def test_a_reference_comes_back(profile):
    write_reference(profile, "a.h5")
    assert_same(read_reference("a.h5"), profile, but=("source",))


def test_a_reference_in_a_scan_without_parameters_takes_its_load_but_no_film():
    path = Path("scan.h5")
    write_scan(make_scan(load=2.5), path)
    with h5py.File(path, "r+") as file:
        del file["/entry/reference_parameters"], file["/entry/reference_process"]
        del file.attrs["memscal_content_sha256"]
    found = read_scan(path).reference
    assert (found.load, found.film, found.indenter is not None) == (2.5, None, False)


def test_an_artifact_comes_back():
    changes = np.array([-0.01, 0.02, -0.011, -0.012, -0.013])
    effects = {"noise": np.abs(changes), "load": changes}
    found = kept(shared_effects=effects)
    assert_same(found, make_artifact(shared_effects=effects), but=("source", "units"))
    assert found.parameters.units == ("V/Pa", "m", "m", "m", "V")


def test_a_parameter_of_an_unknown_name_needs_a_unit_and_keeps_it():
    values = np.array([2.0])
    covariance = np.eye(1)
    unnamed = ParameterSet(("tilt",), values, covariance)
    with pytest.raises(InputError, match=r"unit of tilt(.|\n)*units="):
        kept(parameters=unnamed, budget={})
    assert not Path("a.h5").exists()
    parameters = ParameterSet(("tilt",), values, covariance, units=("V/m",))
    found = kept(parameters=parameters, budget={}).parameters
    assert found.units == ("V/m",)
    assert found["tilt"] == 2.0


@pytest.mark.parametrize("name", ["names", "Größe", "../x", "a/b", "a b", ""])
def test_a_parameter_name_that_cannot_stand_in_a_file_is_refused(name):
    parameters = ParameterSet((name,), np.ones(1), np.eye(1), units=("m",))
    with pytest.raises(InputError):
        kept(parameters=parameters, budget={})
    assert not Path("a.h5").exists()


def test_check_names_are_kept_as_they_are_and_two_alike_are_refused():
    check = QualityCheck("Gaussian misfit (far)", 1.0, 2.0, True, "Fine.")
    assert kept(checks=(check,)).checks == (check,)
    with pytest.raises(InputError, match="gaussian_misfit_far"):
        kept(checks=(check, check))


def test_the_texts_of_older_files_are_read_as_notes():
    assert messages_from_json(["old"]) == (Message("note", "old"),)
    odd = [7, {"severity": "fatal", "text": ["z"]}, {}]
    texts = [(each.kind, each.text, each.severity) for each in messages_from_json(odd)]
    assert texts == [("note", "7", "note"), ("note", "['z']", "note"), ("note", "", "note")]


def test_configurations_with_numpy_numbers_and_infinities_are_stored_as_json():
    configuration = {"seed": np.int64(3), "mu": float("inf"), "loads": np.array([1.0, 2.0])}
    process = dataclasses.replace(make_artifact().process, configuration=configuration)
    found = kept(process=process).process.configuration
    assert found == {"seed": 3, "mu": "inf", "loads": [1.0, 2.0]}


MESH = FieldMesh(
    points=[[0, 0], [1, 0], [0, 1]],
    triangles=[[0, 1, 2]],
    displacement=np.zeros((3, 2)),
    stress=np.zeros((3, 4)),
)


@pytest.mark.parametrize(
    ("write", "thing"),
    [
        (write_scan, make_scan()),
        (write_reference, make_profile()),
        (write_artifact, make_artifact()),
        (write_mesh, MESH),
    ],
)
def test_a_file_is_replaced_only_where_that_is_asked_for(write, thing):
    path = Path("a.h5")
    path.write_bytes(b"years of work")
    with pytest.raises(OutputError, match="exists already"):
        write(thing, path)
    assert path.read_bytes() == b"years of work"
    write(thing, path, overwrite=True)
    assert b"years" not in path.read_bytes()
    assert [file.name for file in Path().iterdir()] == ["a.h5"]


# Quantities are no smaller, in SI units.
finite = st.floats(-1e6, 1e6).map(lambda value: value if abs(value) > 1e-20 else 0.0)


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    x=hnp.arrays(np.float64, st.integers(1, 99), elements=finite, unique=True),
    missing=st.floats(0, 1),
    title=st.text(max_size=50),
    notes=st.text(st.characters(categories=["L", "N", "P", "S"]), max_size=200),
    load=st.floats(1e-6, 1e6),
)
def test_any_scan_comes_back(x, missing, title, notes, load):
    u = np.where(np.arange(x.size) < missing * x.size, np.nan, x)
    stated = {"x": x, "u_zz": u, "title": title, "notes": notes, "load": load}
    scan = make_scan(**(BARE | stated))
    write_scan(scan, "scan.h5", overwrite=True)
    found = read_scan("scan.h5")
    assert_same(found, scan, but=("source", "title"))
    assert found.title == "".join(c for c in title if c.isprintable() or c in "\n\t")


def other_program():
    """Write a scan by the contract with h5py alone, in other units and other types."""
    with h5py.File("scan.h5", "w") as file:
        file.attrs["memscal_schema"] = "memscal-scan"
        file.attrs["memscal_schema_version"] = "1.0.0"
        for name, value, units in (
            ("entry/data/x", np.array([-1000, 0, 500], dtype="i2"), "um"),
            ("entry/data/u_zz", np.array([1.0, 3.0, 2.0], dtype=">f4"), "uV"),
            ("entry/indenter/radius", [0.25], "mm"),
            ("entry/indenter/load", 100.0, "gram * standard_gravity"),
            ("entry/sample/film/young_modulus", 2.2, "MPa"),
            ("entry/sample/film/thickness", 0.2, "centimeter"),
        ):
            file[name] = value
            file[name].attrs["units"] = units
        file["entry/sample/film/poisson_ratio"] = 0.5
        file["entry/indenter/shape"] = "rod"


def test_a_scan_of_another_program_is_read_in_its_own_units():
    other_program()
    scan = read_scan("scan.h5")
    assert scan.x.tolist() == [-1e-3, 0.0, 0.5e-3]
    np.testing.assert_allclose(scan.u_zz, [1e-6, 3e-6, 2e-6], rtol=1e-15)
    assert scan.load == pytest.approx(0.980665, rel=1e-12)
    assert scan.indenter.radius == 0.25e-3
    assert scan.film.young_modulus == 2.2e6
    assert scan.film.thickness == pytest.approx(2e-3, rel=1e-15)
    assert scan.film.poisson_ratio == 0.5


FILM = "/entry/sample/film"


@pytest.mark.parametrize(
    ("path", "value", "units", "error", "words"),
    [
        *(
            (path, None, None, FormatError, f": {path} is missing")
            for path in (
                "/entry/data/x",
                "/entry/data/u_zz",
                "/entry/indenter/radius",
                "/entry/indenter/shape",
                f"{FILM}/young_modulus",
                f"{FILM}/poisson_ratio",
                f"{FILM}/thickness",
            )
        ),
        *(
            (path, ..., units, UnitError, f": {path}(.|\n)*{words}")
            for path, units, words in (
                ("/entry/data/x", "mV", "length"),
                ("/entry/data/x", "parsnip", "unknown"),
                ("/entry/data/u_zz", "parsnip", "unknown"),
                ("/entry/indenter/load", "kg", "force"),
                (f"{FILM}/young_modulus", "N", "stress"),
                (f"{FILM}/poisson_ratio", "mm", "dimensionless"),
                ("/entry/data/x", None, "has no unit"),
                ("/entry/indenter/load", None, "has no unit"),
            )
        ),
        (
            f"{FILM}/law",
            "rubber",
            None,
            InputError,
            f": {FILM}: .*rubber(.|\n)*linear, neo-hookean, mooney-rivlin",
        ),
        (
            "/entry/indenter/friction_coefficient",
            0.3,
            None,
            InputError,
            ": /entry/indenter/friction_coefficient: .*0.3(.|\n)*Give 0 or inf",
        ),
        ("/entry/indenter/load", 0.0, "N", InputError, ".*load"),
        (f"{FILM}/thickness", -1.0, "mm", InputError, ".*thickness"),
        ("/entry/data/x", [0.0, 1.0], "mm", InputError, ".*u_zz has shape"),
        ("/entry/data/x", [0.0, np.nan, 1.0], "mm", InputError, ".*finite"),
        ("/entry/data/branch", [0, 1, 7], "1", InputError, ".*/entry/data/branch holds 7"),
        ("/entry/indenter/shape", "cone", "1", InputError, '.*/entry/indenter/shape is "cone"'),
    ],
)
def test_what_is_missing_or_wrong_is_named_by_file_and_path(path, value, units, error, words):
    other_program()
    with h5py.File("scan.h5", "r+") as file:
        kept = file.pop(path)[()] if path in file else None
        if value is not None:
            file[path] = kept if value is ... else value
        if units is not None:
            file[path].attrs["units"] = units
    with pytest.raises(error, match=rf"scan\.h5{words}") as caught:
        read_scan("scan.h5")
    assert caught.value.cure or error is not UnitError


def test_a_raster_with_its_axes_swapped_or_without_one_is_refused():
    for name, words in (("swapped", r"axes(.|\n)*Transpose"), ("one", "y as axis 0")):
        path = Path(f"{name}.h5")
        write_scan(make_scan("raster"), path)
        with h5py.File(path, "r+") as file:
            del file.attrs["memscal_content_sha256"]
            if name == "swapped":
                file["/entry/data"].attrs["axes"] = ["x", "y"]
            else:
                del file["/entry/data/y"]
        with pytest.raises(FormatError, match=words):
            read_scan(path)
