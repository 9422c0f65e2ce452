"""Printed results, pages, figures, public names and contents of old files stay what they were."""

import difflib
import re
from collections.abc import Iterator
from typing import Any

import pytest
from golden.make import COMMANDS, OUTPUTS, SIGNATURES, Runs, differences, load, signatures
from golden.views import VIEW_COMMANDS, VIEWS, view
from helpers.schemas import faults

TOLERANCE = 1e-6
"""Iterative solvers stop at other last digits with other processors and builds of BLAS."""

SHARE = 1e-3
"""Of a standard uncertainty, and of statistics: what two processors differ by in a search."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    return Runs(tmp_path_factory.mktemp("golden"))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_prints_the_golden_results(name, runs):
    changes = list(differences(load(name), runs[name], TOLERANCE, SHARE))
    assert not changes, "\n".join(changes[:20])
    assert faults(COMMANDS[name].partition(" ")[0], runs.printed[name]) == []


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
def test_a_view_is_the_golden_one(name, runs):
    golden = (VIEWS / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    changes = list(difflib.unified_diff(golden, view(name, runs).splitlines(), lineterm="", n=1))
    assert changes == [], "\n".join(changes[:40])


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


def test_every_golden_file_has_its_command():
    assert {path.stem for path in OUTPUTS.glob("*.json")} == set(COMMANDS)
    assert {path.stem for path in VIEWS.glob("*.txt")} == set(VIEW_COMMANDS)


def test_public_signatures_are_those_of_the_text_file():
    assert signatures() == SIGNATURES.read_text(encoding="utf-8"), (
        "A public signature changed. If that is meant, run `python tests/golden/make.py`, and read"
        " the diff of tests/golden/signatures.txt: is each change in the changelog, and does old"
        " code still run?"
    )
