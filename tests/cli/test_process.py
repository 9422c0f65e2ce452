"""The program as a process of its own: streams and exit codes."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

MEMSCAL = [sys.executable, "-m", "memscal"]


def run(
    *arguments: str, cwd: Path, limit: int | None = None, stdout: int = subprocess.PIPE, **env: str
) -> subprocess.CompletedProcess[str]:
    """Run the program, with a limit to the size of every file, which holds for root too."""
    return subprocess.run(
        [*MEMSCAL, *arguments], cwd=cwd, env={**os.environ, **env}, stdout=stdout,
        stderr=subprocess.PIPE, text=True, encoding="utf-8", check=False,
        preexec_fn=limit and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))),
    )  # fmt: skip


def test_a_failed_check_is_the_exit_code_of_the_process(drifting_scan: Path, folder: Path):
    done = run("calibrate", str(drifting_scan), "-o", "out.h5", cwd=folder)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert (folder / "out.h5").is_file()


def test_a_file_size_limit_leaves_the_old_artifact(scan: Path, folder: Path):
    (folder / "out.h5").write_bytes(b"old")
    done = run("calibrate", "scan.h5", "-o", "out.h5", "--force", cwd=folder, limit=4096)
    assert done.returncode == 4, done.stderr
    assert (folder / "out.h5").read_bytes() == b"old"
    assert sorted(os.listdir(folder)) == ["out.h5", "scan.h5"]


def test_a_reader_that_goes_away_is_no_failure(scan: Path, folder: Path):
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run("inspect", "scan.h5", cwd=folder, stdout=writing)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_results_that_cannot_be_printed_are_exit_code_4(scan: Path, folder: Path, unbuffered):
    with (folder / "shown.txt").open("w") as shown:
        stream = {"cwd": folder, "stdout": shown.fileno(), "limit": 16}
        done = run("inspect", "scan.h5", **stream, PYTHONUNBUFFERED=unbuffered)
    assert done.returncode == 4
    assert "cannot be printed: File too large" in done.stderr
    assert "Exception ignored" not in done.stderr


def test_a_terminal_without_the_characters_still_shows_the_right_number(scan: Path, folder: Path):
    done = run("calibrate", "scan.h5", cwd=folder, PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert "+/-" in done.stdout
    (line,) = [text for text in done.stdout.splitlines() if "constant with" in text]
    assert "e-5 mV/Pa" in line


def test_a_wrong_clock_is_refused_in_our_words(scan: Path, folder: Path):
    done = run("calibrate", "scan.h5", cwd=folder, SOURCE_DATE_EPOCH="yesterday")
    assert done.returncode == 3
    assert "SOURCE_DATE_EPOCH is 'yesterday'" in done.stderr
    done = run("calibrate", "scan.h5", cwd=folder, SOURCE_DATE_EPOCH="")
    assert done.returncode == 0, done.stderr
