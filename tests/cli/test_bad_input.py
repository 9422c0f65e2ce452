"""What cannot be calibrated: plain words, the right exit code, and the old output still there."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.console import names

import memscal
from memscal.mechanics.press_rod import press_rod

OLD = b"an artifact from last week"
SIGNAL = "/entry/data/u_zz"
SCAN = memscal.simulate(seed=1)


@pytest.fixture
def refused(run, folder):
    """Calibrate with --force over an old output, and look for words in the refusal."""
    out = folder / "out.h5"
    out.write_bytes(OLD)

    def refused_(*arguments, words):
        before = names(folder)
        done = run("calibrate", *arguments, "-o", out, "--force").exits(3, *words)
        assert done.out == ""
        assert done.err.startswith("Error: ")
        assert "Traceback" not in done.err
        assert out.read_bytes() == OLD
        assert names(folder) == before

    return refused_


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda signal: signal.attrs.__delitem__("units"), (f"scan.h5: {SIGNAL}", "unit")),
        (lambda signal: signal.write_direct(np.full(65, np.nan)), ("missing (NaN)",)),
    ],
)
def test_a_file_that_was_spoilt_is_refused(refused, scan, change, words):
    with h5py.File(scan, "r+") as file:
        del file.attrs["memscal_content_sha256"]
        change(file[SIGNAL])
    refused(scan, words=words)


def altered(path):
    """Change a number in a file without its digest."""
    with h5py.File(path, "r+") as file:
        file["/entry/sample/film/thickness"][()] *= 1.001
    return path


@pytest.mark.parametrize(
    "line",
    [
        "calibrate scan.h5 -o out.h5",
        "calibrate scan.h5 --dry-run",
        "apply sensor.apparatus.h5 scan.h5 --override -o out.h5",
        "restore sensor.apparatus.h5 scan.h5 --override -o out.h5",
        "inspect scan.h5",
        "batch manifest -o results --artifacts all --workers 1",
    ],
)
@pytest.mark.usefixtures("artifact")
def test_an_altered_file_is_used_by_no_command_unless_that_is_recorded(run, scan, line):
    arguments = line.split()
    altered(scan)
    Path("manifest").write_text("scan.h5\n")
    batch = arguments[0] == "batch"
    words = "was changed after it was written: its content does not fit its digest"
    if not batch:
        run(*arguments).exits(3, words, "--accept-altered")
    done = run(*arguments, "--accept-altered")
    assert done.code in (0, 1), done.err
    if arguments[0] == "inspect":
        assert "does not fit its digest" in done.out
        return
    assert batch or words in done.err
    for path in [Path("out.h5")] if not batch else [*Path("results").rglob("*.apparatus.h5")]:
        if path.exists():
            assert words in run("inspect", path, "--json").out.replace("\\n", " ")


@pytest.mark.parametrize(
    ("scan", "words"),
    [
        (replace(SCAN, indenter=memscal.Rod(radius=1.2e-3)), ("rod's width is 2.4 mm", "of 2 mm")),
        (replace(SCAN, u_zz=-SCAN.u_zz), ("falls by", "sign of u_zz", "--u-sign -1")),
        (
            replace(SCAN, indenter=memscal.Sphere(radius=0.1288)),
            ("made with a sphere", "needs a rod"),
        ),
        (
            replace(SCAN, motion="sliding"),
            ("made with a sliding indenter", "entry/indenter/motion", "memscal compare --sliding"),
        ),
    ],
)
def test_a_scan_of_no_use_is_refused(refused, scan, words):
    memscal.write_scan(scan, "scan.h5")
    refused("scan.h5", words=words)


def test_a_reference_shorter_than_the_scan_is_refused(refused, scan):
    rod = press_rod(SCAN.film, memscal.Rod(radius=0.25e-3), 1.0)
    memscal.write_reference(rod.profile(np.linspace(0.0, 2e-3, 100)), "short.h5")
    for further in ([], ["--dry-run"]):
        words = ("ends at r = 2 mm", "Extend the reference")
        refused(scan, "--reference", "short.h5", *further, words=words)
