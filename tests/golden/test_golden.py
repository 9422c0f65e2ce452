"""The results that every command prints, and the public names, stay what they were."""

from __future__ import annotations

from pathlib import Path

import pytest
from golden.make import COMMANDS, OUTPUTS, SIGNATURES, Runs, differences, load, signatures

TOLERANCE = 1e-6
"""Iterative solvers stop at other last digits with other processors and builds of BLAS."""

TOLERANCE_OF_DRAWS = 1e-4
"""A draw divides by what is nearly zero at some wavenumbers, and magnifies the last digits."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    return Runs(tmp_path_factory.mktemp("golden"))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_prints_the_golden_results(name: str, runs: Runs) -> None:
    tolerance = TOLERANCE_OF_DRAWS if name in {"calibrate-draw", "calibrate-sweep"} else TOLERANCE
    found = list(differences(load(name), runs[name], tolerance))
    assert not found, "\n".join(found[:20])


def test_every_golden_output_has_its_command() -> None:
    assert {path.stem for path in Path(OUTPUTS).glob("*.json")} == set(COMMANDS)


def test_public_signatures_are_those_of_the_text_file() -> None:
    assert signatures() == SIGNATURES.read_text(encoding="utf-8"), (
        "A public signature changed. If that is meant, run `python tests/golden/make.py`, and read"
        " the diff of tests/golden/signatures.txt: is each change in the changelog, and does old"
        " code still run?"
    )
