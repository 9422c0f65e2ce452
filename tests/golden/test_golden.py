"""Printed results, pages, figures, public names and contents of old files stay what they were."""

import difflib
import re
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from golden.make import COMMANDS, OUTPUTS, SIGNATURES, Runs, differences, load, signatures
from golden.views import VIEW_COMMANDS, VIEWS, view
from numpy.testing import assert_allclose

import memscal

TOLERANCE = 1e-6
"""Iterative solvers stop at other last digits with other processors and builds of BLAS."""

SHARE = 1e-3
"""Of a standard uncertainty, and of statistics: what two processors differ by in a search."""

FILES: dict[str, tuple[Any, dict[str, Any]]] = {
    "line.scan.h5": (memscal.read_scan, {
        "u_zz.shape": (33,), "load": 1.0, "direction": "x", "sensor.name": "a simulated sensor",
        "film.poisson_ratio_uncertainty": 0.005, "indenter.shape": "rod",
        "indenter.radius": 0.25e-3, "indenter.radius_uncertainty": 2.5e-6,
    }),
    "raster.scan.h5": (memscal.read_scan, {
        "u_zz.shape": (9, 33), "y.size": 9, "title": "A scan", "film.roughness_rms": 1.82e-6,
        "notes": "Two lines\nof notes, with an é.",
    }),
    "reference.h5": (memscal.read_reference, {
        "load": 1.0, "depth": 0.587e-3, "contact_radius": 0.25e-3, "solver": "closed form",
        "friction_coefficient": 0.0, "film.young_modulus": 2.2e6,
    }),
    "artifact.h5": (memscal.load_apparatus, {
        "conversion_constant": 3e-8, "gaussian_sigma": 561e-6, "resolved_wavenumber": 3700.0,
        "field.g.shape": (13, 17), "process.input_scan.file_name": "scan.h5",
    }),
    "stress.h5": (memscal.read_stress, {}),
}  # fmt: skip
"""Files that version 0.1 wrote, one of each schema 1.0.0: a later version must read them."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    return Runs(tmp_path_factory.mktemp("golden"))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_prints_the_golden_results(name, runs: Runs):
    changes = list(differences(load(name), runs[name], TOLERANCE, SHARE))
    assert not changes, "\n".join(changes[:20])


@pytest.mark.parametrize(
    ("changed", "places"),
    [
        ({"value": 1.00009, "standard_uncertainty": 0.1}, []),
        ({"value": 1.0002, "standard_uncertainty": 0.1}, [".value"]),
        ({"value": 1.0, "standard_uncertainty": 0.10005}, []),
        ({"value": 1.0, "standard_uncertainty": 0.102}, [".standard_uncertainty"]),
    ],
)
def test_numbers_are_compared_within_a_share_of_their_uncertainty(changed, places):
    golden = {"value": 1.0, "standard_uncertainty": 0.1}
    found = differences(golden, changed, TOLERANCE, SHARE)
    assert [place.partition(":")[0] for place in found] == places


@pytest.mark.parametrize("name", VIEW_COMMANDS)
def test_a_view_is_the_golden_one(name: str, runs: Runs) -> None:
    golden = (VIEWS / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    changes = list(difflib.unified_diff(golden, view(name, runs).splitlines(), lineterm="", n=1))
    assert changes == [], "\n".join(changes[:40])


def test_every_golden_view_has_its_command() -> None:
    assert {path.stem for path in Path(VIEWS).glob("*.txt")} == set(VIEW_COMMANDS)


def test_json_has_one_convention_of_units():
    """A quantity is an object of value, uncertainty and unit; no key names a unit."""
    # Ranges of a file's arrays stand in the unit beside them; notes of a file are its own.
    in_key = re.compile(r"_(mm|um|n|k?pa|mv|si|per_\w+|seconds)$")

    def offenders(value: Any, path: str) -> Iterator[str]:
        if isinstance(value, dict):
            if "unit" in value and not value.keys() & {"value", "maximum"}:
                yield path
            for key, item in value.items():
                if in_key.search(key) and not isinstance(item, str):
                    yield f"{path}.{key}"
                yield from () if key == "configuration" else offenders(item, f"{path}.{key}")
        elif isinstance(value, list):
            for item in value:
                yield from offenders(item, f"{path}[]")

    outputs = {name: load(name)["output"] for name in COMMANDS}
    assert {place for name, told in outputs.items() for place in offenders(told, name)} == set()


def test_every_golden_output_has_its_command():
    assert {path.stem for path in Path(OUTPUTS).glob("*.json")} == set(COMMANDS)


def test_public_signatures_are_those_of_the_text_file():
    assert signatures() == SIGNATURES.read_text(encoding="utf-8"), (
        "A public signature changed. If that is meant, run `python tests/golden/make.py`, and read"
        " the diff of tests/golden/signatures.txt: is each change in the changelog, and does old"
        " code still run?"
    )


def test_files_of_version_0_1_say_what_they_said(runs: Runs):
    """To the readers what the golden outputs ``inspect-old-...`` say of the files."""
    records = {name: read(runs.folder / "files" / name) for name, (read, _) in FILES.items()}
    for name, (_, values) in FILES.items():
        for path, value in values.items():
            expected = pytest.approx(value, rel=1e-9) if isinstance(value, float) else value
            assert attrgetter(path)(records[name]) == expected, (name, path)

    line, raster, reference, apparatus, stress = records.values()
    assert_allclose(line.u_zz[:3], [1.3730e-4, 1.7451e-4, 1.5166e-4], atol=1e-8)
    assert np.isnan(raster.u_zz).sum() == 9
    assert_allclose(reference.sigma_rz, 100 * reference.r * reference.sigma_zz)
    assert apparatus.budget["conversion_constant"] == pytest.approx({"noise": 1e-10, "load": 3e-10})
    axis = 1 / (2 * np.pi * 561e-6**2)
    assert_allclose(apparatus.radial([0.0, 1e-3]) / axis, [1, np.exp(-0.5 / 0.561**2)], atol=0.01)
    (profile,) = stress.profiles
    assert_allclose(profile.s_zz, 5e4 * np.exp(-((profile.r / 1e-3) ** 2)))
    errors = [profile.errors_by(source) for source in profile.roots]
    assert_allclose(np.diag(profile.covariance), np.sum(np.square(errors), axis=0))
