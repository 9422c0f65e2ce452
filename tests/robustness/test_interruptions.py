"""Runs that are killed or told to end, full disks, flipped bits: outputs are whole or not there.

The whole campaign is ``nox --session robustness``.
"""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time

import pytest
from helpers.builders import make_artifact, make_scan
from helpers.console import names, run_program
from helpers.scans import simulate
from robustness.campaign import SHARE, count, number

from memscal import MemscalError, write_scan
from memscal.formats.artifact import write_artifact
from memscal.formats.inspection import check, describe

CALIBRATE = "calibrate scan.h5 -o out.h5 --figure out.png --report out.html"
#: Three files that nothing is drawn for.
SIMULATE = "simulate --experiment sphere --contacts 9 --load 1 --force -o ."
COMMAND = (CALIBRATE if SHARE else SIMULATE).split()
OUTPUTS = (
    {"out.h5", "out.png", "out.html"}
    if SHARE
    else {"rod_scan.h5", "sphere_dry.h5", "sphere_lubricated.h5"}
)
#: What the shell says of a process that a signal has ended, and what the program says.
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}


@pytest.fixture
def folder(tmp_path):
    """A folder with a scan."""
    write_scan(simulate(noise=0.005, seed=1, points=33), tmp_path / "scan.h5")
    return tmp_path


def start(folder, *arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "memscal", *arguments],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """How long a run takes."""
    folder = tmp_path_factory.mktemp("timed")
    write_scan(simulate(noise=0.005, seed=1, points=33), folder / "scan.h5")
    begin = time.monotonic()
    process = start(folder, *COMMAND)
    process.communicate()
    assert process.returncode in (0, 1)
    return time.monotonic() - begin


def interrupted(folder, number, delay):
    """Run the command, send a signal after a while; return exit code and messages."""
    process = start(folder, *COMMAND)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(delay)
    process.send_signal(number)
    said = process.communicate()[1]
    return process.returncode, said


def test_a_killed_run_leaves_whole_outputs_or_none_and_the_next_clears_up(folder, seed, whole):
    draw = random.Random(seed)
    for _ in range(number(2, 250)):
        code, _ = interrupted(folder, signal.SIGKILL, draw.uniform(0, 1.1 * whole))
        assert code in (0, 1, -signal.SIGKILL)
        count("runs that were killed", "done before" if code >= 0 else "killed")
        for name in OUTPUTS & {*names(folder)}:
            path = folder / name
            assert path.stat().st_size > 1000
            if name.endswith(".h5"):
                assert all(finding.passed for finding in check(path))
            path.unlink()
    # What may still belong to a process that lives is left for a minute.
    before = time.time() - 120
    for left in folder.glob(".memscal-*.tmp"):
        os.utime(left, (before, before))
    process = start(folder, *COMMAND)
    process.communicate()
    assert process.returncode in (0, 1)
    assert {*names(folder)} == OUTPUTS | {"scan.h5"}


def test_a_run_that_is_told_to_end_says_so_and_leaves_nothing(folder, seed, whole):
    draw = random.Random(seed)
    for _ in range(number(1, 84)):
        for sent, expected in list(CODES.items())[:: 1 if SHARE else 2]:
            code, said = interrupted(folder, sent, draw.uniform(0, whole))
            count(f"runs that {sent.name} ended", f"exit {code}")
            # Before its first line of Python runs, the system ends it.
            assert code in (0, 1, expected, -sent), said
            # Until the module is found, it is Python that says what interrupted it.
            assert "Traceback" not in said or "_get_module_details" in said
            left = {*names(folder)} - {"scan.h5"}
            # All or none: the last moment of a run is after they are in their places.
            assert left == OUTPUTS or (code not in (0, 1) and left == set())
            for name in left:
                (folder / name).unlink()


@contextlib.contextmanager
def full_disk(folder, size):
    """A small file system, where this process may mount one; otherwise a limit of every file."""
    disk = folder / "disk"
    disk.mkdir()
    options = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", os.fspath(disk)]
    mounted = subprocess.run(options, check=False, capture_output=True).returncode == 0
    try:
        yield disk
    finally:
        if mounted:
            subprocess.run(["umount", os.fspath(disk)], check=True)


@pytest.mark.parametrize("kibibytes", [4, 64, 300, 800] if SHARE else [4, 300])
def test_a_disk_that_fills_leaves_what_was_there(folder, kibibytes):
    with full_disk(folder, kibibytes * 1024) as disk:
        old = b"what was there"
        (disk / "out.h5").write_bytes(old)
        outputs = ("-o", "disk/out.h5", "--figure", "disk/out.png")
        limit = None if os.path.ismount(disk) else kibibytes * 1024
        done = run_program("calibrate", "scan.h5", "--force", *outputs, cwd=folder, limit=limit)
        assert "Traceback" not in done.stderr
        assert done.returncode == 4, done.stderr
        assert names(disk) == ["out.h5"]
        assert (disk / "out.h5").read_bytes() == old


def test_no_flipped_bit_of_a_file_goes_unnoticed(tmp_path, seed):
    draw = random.Random(seed)
    write_artifact(make_artifact(), tmp_path / "artifact.h5")
    write_scan(make_scan(), tmp_path / "scan.h5")
    for name in ("artifact.h5", "scan.h5"):
        path = tmp_path / name
        good = path.read_bytes()
        known = described(path)
        for _ in range(number(12, 500)):
            damaged = bytearray(good)
            at = draw.randrange(len(good))
            damaged[at] ^= 1 << draw.randrange(8)
            path.write_bytes(damaged)
            passed = all(finding.passed for finding in check(path))
            count(f"bits flipped of {name}", "harmless" if passed else "refused")
            if passed:
                assert described(path) == known, f"the bit flipped in byte {at} of {name}"
        path.write_bytes(good)


def described(path):
    """What a file holds, apart from the digest of its bytes."""
    try:
        return {key: value for key, value in describe(path).items() if key != "sha256"}
    except MemscalError as failure:
        return {"refused": str(failure)}
