"""Runs of the commands of ``commands_of_files.txt`` write the same bytes at the same time.

One in this process, and one in another with another hash of texts, which shares the work among
processes. Set MEMSCAL_FULL_STUDY for all
commands; else those that simulate, calibrate and compare run.
"""

import contextlib
import hashlib
import os
import subprocess
import sys
from pathlib import Path
from unittest import mock

from golden.make import HERE, LINKS
from helpers.bounds import FULL

from memscal.cli import main

LINES = (HERE / "commands_of_files.txt").read_text(encoding="utf-8").splitlines()
COMMANDS = [c for c in LINES if FULL or c.split()[0] in ("simulate", "calibrate", "compare")]
ENVIRONMENT = {"SOURCE_DATE_EPOCH": "1700000000", "PYTHONHASHSEED": "2"}


def run_all(commands: list[str]) -> None:
    for command in commands:
        assert main(command.split()) in (0, 1), command


def digests(folder: Path) -> dict[str, str]:
    """Return the digest of every file of a folder."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_two_runs_write_the_same_bytes(tmp_path, monkeypatch):
    here = tmp_path / "here"
    elsewhere = tmp_path / "elsewhere"
    for folder in (here, elsewhere):
        folder.mkdir()
        for name, target in LINKS.items():
            (folder / name).symlink_to(target)
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with contextlib.chdir(here), mock.patch("os.cpu_count", return_value=1):
        run_all(COMMANDS)
    path = os.pathsep.join(sys.path)
    program = "import sys\nfrom golden.test_bytes import run_all\nrun_all(sys.argv[1:])"
    command = [sys.executable, "-c", program, *COMMANDS]
    environment = {**os.environ, "PYTHONPATH": path}
    subprocess.run(command, cwd=elsewhere, env=environment, check=True)
    written = digests(here)
    assert digests(elsewhere) == written
    kinds = {Path(name).suffix for name in written}
    assert kinds >= {".h5", ".html", ".png", *([".pdf", ".svg", ".vtu"] if FULL else [])}
    assert {name.partition("/")[0] for name in written} >= {"contacts", "experiment"}
