"""What commands print, and the structure of the pages and figures they write, stay the same."""

import difflib
from pathlib import Path

import pytest
from golden.make import Runs
from golden.views import VIEW_COMMANDS, VIEWS, view


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    return Runs(tmp_path_factory.mktemp("views"))


@pytest.mark.parametrize("name", VIEW_COMMANDS)
def test_a_view_is_the_golden_one(name: str, runs: Runs) -> None:
    golden = (VIEWS / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    changes = list(difflib.unified_diff(golden, view(name, runs).splitlines(), lineterm="", n=1))
    assert changes == [], "\n".join(changes[:40])


def test_every_golden_view_has_its_command() -> None:
    assert {path.stem for path in Path(VIEWS).glob("*.txt")} == set(VIEW_COMMANDS)
