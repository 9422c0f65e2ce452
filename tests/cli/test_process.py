"""The program as a process of its own: streams and exit codes."""

import os
from pathlib import Path

import pytest
from helpers.console import run_program

FULL = Path("/dev/full")
NEEDS_FULL = pytest.mark.skipif(not FULL.exists(), reason="The system has no /dev/full.")


def test_a_reader_that_goes_away_is_no_failure(scan, folder):
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run_program("inspect", "scan.h5", cwd=folder, stdout=writing)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_results_that_cannot_be_printed_are_exit_code_4(scan, folder, unbuffered):
    with (folder / "shown.txt").open("w") as shown:
        stream = {"cwd": folder, "stdout": shown.fileno(), "limit": 16}
        done = run_program("inspect", "scan.h5", **stream, PYTHONUNBUFFERED=unbuffered)
    assert done.returncode == 4
    assert "cannot be printed: File too large" in done.stderr
    assert "Exception ignored" not in done.stderr


@NEEDS_FULL
@pytest.mark.parametrize("arguments", [["--help"], ["calibrate", "--help"], ["--version"]])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_help_that_cannot_be_printed_is_exit_code_4(folder, arguments, unbuffered):
    with FULL.open("w") as full:
        stream = {"cwd": folder, "stdout": full.fileno(), "PYTHONUNBUFFERED": unbuffered}
        done = run_program(*arguments, **stream)
    assert (done.returncode, "cannot be printed: No space" in done.stderr) == (4, True)


@NEEDS_FULL
def test_a_result_that_cannot_be_printed_is_not_written_either(folder):
    with FULL.open("w") as full:
        done = run_program("reference", "rod", "-o", "rod.h5", cwd=folder, stdout=full.fileno())
    assert done.returncode == 4
    assert "cannot be printed: No space left" in done.stderr
    assert os.listdir(folder) == []


def test_a_terminal_without_the_characters_still_shows_the_right_number(scan, folder):
    done = run_program("calibrate", "scan.h5", cwd=folder, PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert "+/-" in done.stdout
    (line,) = [text for text in done.stdout.splitlines() if "constant with" in text]
    assert "e-5 mV/Pa" in line


def test_a_wrong_clock_is_refused_in_our_words(scan, folder):
    done = run_program("calibrate", "scan.h5", cwd=folder, SOURCE_DATE_EPOCH="yesterday")
    assert done.returncode == 3
    assert "SOURCE_DATE_EPOCH is 'yesterday'" in done.stderr
