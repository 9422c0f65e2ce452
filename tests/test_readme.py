"""What the README promises to a new user is what happens."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^```console\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
SPHERE = next(block for block in COMMANDS if "reference sphere" in block)
CHAIN = next(block for block in COMMANDS if "--experiment sphere" in block)
EXAMPLES = re.findall(r"^```python\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def fresh_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that holds the shipped data and nothing else."""
    shutil.copytree(ROOT / "calibration_data", tmp_path / "calibration_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run_installed(arguments: list[str]) -> list[str]:
    """Run the installed program; return the lines that it prints."""
    installed = os.fspath(Path(sys.executable).with_name("memscal"))
    run = subprocess.run([installed, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()
    return run.stdout.splitlines()


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def numbers(line: str) -> list[float]:
    return [float(text) for text in NUMBER.findall(line)]


def words(line: str) -> list[str]:
    """What is left of a line of a table without its numbers and rules."""
    return NUMBER.sub("", line).replace("-", "").split()


def test_set_up_takes_exactly_two_commands() -> None:
    assert [block.count("\n") for block in COMMANDS[:2]] == [1, 1]


def test_the_first_command_calibrates_the_shipped_scan(fresh_folder: Path) -> None:
    program, *arguments = shlex.split(COMMANDS[0])[-7:]
    assert Path(program).name == "memscal"
    run_installed(arguments)
    assert (fresh_folder / "rod_scan_65.apparatus.h5").is_file()
    assert (fresh_folder / "calibration.png").is_file()


def test_the_commands_for_the_best_estimate_and_its_plan_run(fresh_folder: Path) -> None:
    best = next(block for block in COMMANDS if "--method bayesian" in block)
    for line in best.strip().splitlines():
        run_installed(shlex.split(line)[1:])
    assert (fresh_folder / "best.apparatus.h5").is_file()
    assert (fresh_folder / "design.png").is_file()


def test_the_sphere_s_command_prints_what_is_shown(fresh_folder: Path) -> None:
    printed = run_installed(shlex.split(SPHERE)[1:])
    assert (fresh_folder / "sphere.png").is_file()
    expected = README.split(SPHERE)[1].split("```text\n")[1].split("```")[0].splitlines()
    names = next(i for i, line in enumerate(expected) if line.startswith("  ---"))
    assert printed[:names] == expected[:names]
    for ours, theirs in zip(printed[names + 1 :], expected[names + 1 :], strict=True):
        # Depths, radii and stresses; the last digit of another machine may differ.
        numbers = [[float(cell) for cell in line.split()[:6]] for line in (ours, theirs)]
        assert numbers[0] == pytest.approx(numbers[1], rel=2e-3)


def test_the_way_from_contacts_to_friction_prints_what_is_shown(fresh_folder, monkeypatch) -> None:
    """The whole chain, from files only; in a cache of its own, so that it starts from cold."""
    monkeypatch.setenv("XDG_CACHE_HOME", os.fspath(fresh_folder / "cache"))
    lines = [shlex.split(line)[1:] for line in CHAIN.strip().splitlines()]
    printed = {arguments[0]: run_installed(arguments) for arguments in lines}
    for name in ("contacts.stress.h5", "contacts.png", "friction.png"):
        assert (fresh_folder / name).is_file()
    applied, compared = README.split(CHAIN)[1].split("```text\n")[1:3]
    for command, shown in (("apply", applied), ("compare", compared)):
        expected = shown.split("\n```")[0].splitlines()
        assert len(expected) > 8
        for ours, theirs in zip(printed[command][: len(expected)], expected, strict=True):
            assert words(ours) == words(theirs)
            # The last digit of another machine may differ.
            assert numbers(ours) == pytest.approx(numbers(theirs), rel=0.02, abs=0.02)


@pytest.mark.usefixtures("fresh_folder")
def test_the_example_in_python_runs() -> None:
    names: dict[str, object] = {}
    for example in EXAMPLES:
        exec(compile(example, "README.md", "exec"), names)
    fitted = names["fitted"]
    stated = numbers(EXAMPLES[0].split("# ")[-1])[:3]
    found = (fitted.value, fitted.interval.low, fitted.interval.high)
    assert stated == pytest.approx(found, rel=0.02)
    assert names["apparatus"].gaussian_sigma == pytest.approx(561e-6, rel=0.05)
