"""Outputs that cannot be written: known before anything is computed, and nothing is lost."""

import errno
import os
import warnings
from pathlib import Path

import pytest
from helpers.console import names
from helpers.scans import pressed, sphere_scan
from matplotlib.figure import Figure

import memscal

OLD = b"an artifact from last week"
CALIBRATE = "memscal.calibration.calibrate.calibrate"
PLOT = "memscal.model.result.Result.plot"


def raising(error):
    """A function that fails whatever it is given."""

    def call(*_, **__):
        raise error

    return call


@pytest.fixture(autouse=True)
def _plain_figures(monkeypatch):
    """Draw nothing: what is drawn is no matter here."""
    monkeypatch.setattr(PLOT, lambda *_, **__: Figure(figsize=(1, 1)))


@pytest.fixture
def no_computing(monkeypatch):
    """Fail the test if the calibration is reached."""
    monkeypatch.setattr(CALIBRATE, raising(AssertionError("The calibration was reached.")))


@pytest.mark.usefixtures("no_computing")
@pytest.mark.parametrize("spelling", ["scan.h5", "./scan.h5", "link.h5", "twin.h5"])
def test_an_output_is_never_an_input_even_if_forced(run, scan, folder, spelling):
    before = scan.read_bytes()
    (folder / "link.h5").symlink_to("scan.h5")
    (folder / "twin.h5").hardlink_to(folder / "scan.h5")
    run("calibrate", "scan.h5", "-o", spelling, "--force").exits(4, "also an input")
    assert scan.read_bytes() == before


@pytest.mark.usefixtures("no_computing")
def test_a_report_does_not_replace_the_reference(run, scan):
    run("reference", "rod", "-o", "rod.h5")
    before = Path("rod.h5").read_bytes()
    run("calibrate", scan, "--reference", "rod.h5", "--report", "rod.h5", "--force").exits(4)
    assert Path("rod.h5").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("scan.apparatus.h5", "calibrate scan.h5"),
        ("rod.h5", "reference rod -o rod.h5"),
        ("d.png", "design --figure d.svg --figure d.png"),
        ("sphere_dry.h5", "simulate --experiment sphere --contacts 9 --load 1 -o ."),
        ("sphere.stress.h5", "apply sensor.apparatus.h5 sphere.h5"),
        ("out.h5", "restore sensor.apparatus.h5 sphere.h5 -o out.h5"),
        ("a.html", "apply sensor.apparatus.h5 sphere.h5 -o new.h5 --report a.html"),
        ("r.html", "restore sensor.apparatus.h5 sphere.h5 -o new.h5 --report r.html"),
    ],
)
@pytest.mark.usefixtures("artifact", "scan")
def test_an_old_output_is_replaced_only_if_forced(run, folder, name, line):
    arguments = line.split()
    memscal.write_scan(sphere_scan(pressed(), seed=5), "sphere.h5")
    (folder / name).write_bytes(OLD)
    assert run(*arguments).exits(4, "--force").out == ""
    assert (folder / name).read_bytes() == OLD
    assert "new.h5" not in names(folder)
    assert run(*arguments, "--force").code == 0
    assert (folder / name).read_bytes()[:4] in (b"\x89HDF", b"\x89PNG", b"<!DO")


def test_a_figure_that_fails_leaves_nothing(run, scan, folder, monkeypatch):
    monkeypatch.setattr(PLOT, raising(ZeroDivisionError("division by zero")))
    run("calibrate", scan, "--figure", "a.png").exits(70)
    assert names(folder) == ["scan.h5"]


def test_where_one_output_cannot_be_replaced_all_stay(run, scan, folder, monkeypatch):
    rename = os.replace

    def replace(source, target):
        if Path(target).name == "b.svg":
            raise OSError(errno.EIO, "broken")
        rename(source, target)

    old = [folder / name for name in ("a.h5", "b.svg")]
    for path in old:
        path.write_bytes(OLD)
    before = names(folder)
    monkeypatch.setattr(os, "replace", replace)
    done = run("calibrate", scan, "-o", "a.h5", "--figure", "b.svg", "--force")
    done.exits(4, "b.svg", "what was there before is untouched")
    assert {path.read_bytes() for path in old} == {OLD}
    assert names(folder) == before


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("batch loop -o new", 3),
        ("calibrate loop", 3),
        ("calibrate scan.h5 -o loop --force", 4),
        ("calibrate scan.h5 --figure loop.svg", 4),
        ("simulate --experiment sphere -o loop", 4),
    ],
)
def test_a_circle_of_links_is_refused(run, scan, folder, line, code):
    for ending in ("", ".svg"):
        (folder / f"loop{ending}").symlink_to(f"circle{ending}")
        (folder / f"circle{ending}").symlink_to(f"loop{ending}")
    run(*line.split()).exits(code, "loop")


def test_an_input_without_permission_is_refused_and_no_usage_error(run, scan, monkeypatch):
    """The permission is taken away for root, too."""

    def denied(path, *arguments, **options):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)

    monkeypatch.setattr(os, "access", lambda *_, **__: False)
    monkeypatch.setattr("memscal.formats.files.os.open", denied)
    run("inspect", scan).exits(3, "cannot be read: Permission denied", "permissions")


def test_an_internal_error_has_no_traceback(run, scan, monkeypatch):
    monkeypatch.setattr(CALIBRATE, raising(RuntimeError("the flux capacitor\nis empty")))
    failed = run("calibrate", scan).exits(70)
    assert "memscal failed by a fault of its own" in failed.err
    assert "the flux capacitor is empty" in failed.err
    assert "--debug" in failed.err
    assert "Traceback" not in failed.err
    for arguments in (["--debug", "calibrate", scan], ["calibrate", scan, "--debug"]):
        run(*arguments).exits(70, "Traceback", "flux capacitor")


def test_running_out_of_memory_is_said_so(run, scan, monkeypatch):
    monkeypatch.setattr(CALIBRATE, raising(MemoryError()))
    run("calibrate", scan).exits(70, "out of memory")


@pytest.mark.parametrize(
    ("failure", "kind", "code"),
    [
        (RuntimeError("flux"), "RuntimeError", 70),
        (MemoryError(), "MemoryError", 70),
        (KeyboardInterrupt(), "Interrupted", 130),
    ],
)
def test_json_of_any_failure_is_one_object(run, scan, monkeypatch, failure, kind, code):
    monkeypatch.setattr(CALIBRATE, raising(failure))
    error = run("calibrate", scan, "--json").exits(code).json["error"]
    assert (error["class"], error["exit_code"]) == (kind, code)


def test_what_fails_after_the_results_are_printed_prints_no_second_object(run, monkeypatch):
    monkeypatch.setattr("memscal.formats.files.os.replace", raising(KeyboardInterrupt()))
    monkeypatch.setattr("memscal.formats.files.os.link", raising(KeyboardInterrupt()))
    done = run("reference", "rod", "-o", "rod.h5", "--json").exits(130, "Interrupted")
    assert "error" not in done.json


@pytest.fixture
def meanwhile(monkeypatch):
    """Let something happen while the calibration is computed."""
    from memscal.calibration.calibrate import calibrate

    def happens(action):
        monkeypatch.setattr(CALIBRATE, lambda *a, **more: (action(), calibrate(*a, **more))[1])

    return happens


def test_a_python_warning_becomes_one_line(run, scan, meanwhile):
    def warn():
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn("the film is old", UserWarning, stacklevel=1)

    meanwhile(warn)
    done = run("calibrate", scan).exits(0)
    assert "Warning: UserWarning: the film is old" in done.err.splitlines()


@pytest.mark.parametrize("name", ["out.h5", "out.png"])
def test_a_file_that_appears_during_the_computing_is_not_replaced(
    run, scan, folder, meanwhile, name
):
    meanwhile(lambda: (folder / name).write_bytes(OLD))
    run("calibrate", scan, "-o", "out.h5", "--figure", "out.png").exits(4)
    assert (folder / name).read_bytes() == OLD
