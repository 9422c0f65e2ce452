"""What the README promises to a new user is what happens."""

import math
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.bounds import FULL
from helpers.console import numbers, words

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^```console\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
EXAMPLES = re.findall(r"^```python\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def fresh_folder(tmp_path, monkeypatch):
    """A folder that holds the shipped data and nothing else."""
    shutil.copytree(ROOT / "calibration_data", tmp_path / "calibration_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run_installed(arguments):
    """Run the installed program; return the lines that it prints."""
    installed = os.fspath(Path(sys.executable).with_name("memscal"))
    run = subprocess.run([installed, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()
    return run.stdout.splitlines()


def test_set_up_takes_exactly_two_commands():
    assert [block.count("\n") for block in COMMANDS[:2]] == [1, 1]


def test_the_first_command_calibrates_the_shipped_scan(fresh_folder):
    program, *arguments = shlex.split(COMMANDS[0])[-7:]
    assert Path(program).name == "memscal"
    printed = run_installed(arguments)
    assert (fresh_folder / "rod_scan_65.apparatus.h5").is_file()
    assert (fresh_folder / "calibration.png").is_file()
    shown = README.split("```text\n")[1].split("\n```")[0].splitlines()
    for line, expected in zip(printed[: len(shown)], shown, strict=True):
        assert words(line) == words(expected)
        # The last digit of another machine may differ.
        assert numbers(line) == pytest.approx(numbers(expected), rel=0.02, abs=0.02)


@pytest.mark.usefixtures("fresh_folder")
def test_the_example_in_python_runs(monkeypatch):
    if not FULL:
        few = (0.0, 0.1, 0.2, 0.3, math.inf)
        monkeypatch.setattr("memscal.friction.compare.FRICTIONS", few)
    names = {}
    [example] = EXAMPLES
    exec(compile(example, "README.md", "exec"), names)
    fitted = names["fitted"]
    stated = numbers(example.split("# ")[-1])[:3]
    found = (fitted.value, fitted.interval.low, fitted.interval.high)
    assert stated == pytest.approx(found, rel=0.02)
