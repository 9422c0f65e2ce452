"""``memscal calibrate``: what it writes, prints and returns."""

import shutil

import pytest
from helpers.console import names
from helpers.scans import simulate

import memscal
from memscal.cli.options import si


def test_a_failed_check_is_exit_code_1_and_marked(run, drifting_scan, folder):
    done = run("calibrate", drifting_scan, "-o", "out.h5", "--json").exits(1)
    assert {c["name"]: c["passed"] for c in done.json["checks"]}["baseline_drift"] is False
    apparatus = memscal.load_apparatus("out.h5")
    assert not apparatus.passed
    assert next(c.meaning for c in apparatus.checks if c.name == "baseline_drift") in done.err
    assert "out.h5 was written and is marked" in done.err


def test_a_dry_run_checks_everything_and_writes_nothing(run, scan, folder):
    done = run("calibrate", scan, "--dry-run", "--figure", "a.png", "--report", "a.html").exits(0)
    for name in ("scan.apparatus.h5", "a.png", "a.html", "65 points", "rod, solved on the film"):
        assert name in done.out
    assert names(folder) == ["scan.h5"]


@pytest.fixture
def lawless(folder):
    """A scan that does not state its film's law."""
    path = folder / "scan.h5"
    memscal.write_scan(simulate(seed=1, state_law=False), path)
    return path


def test_a_reference_of_another_film_is_refused_or_its_override_recorded(run, lawless):
    run("reference", "rod", "--thickness", "2.1", "-o", "thick.h5")
    both = "film thickness  2 mm (u 0.02)     2.1 mm (u not stated)"
    for further in ([], ["--dry-run"]):
        refused = run("calibrate", lawless, "--reference", "thick.h5", *further)
        refused.exits(3, "--override", "the scan scan.h5  the reference thick.h5")
        assert both in refused.err
    done = run("calibrate", lawless, "--reference", "thick.h5", "--override")
    assert "Overridden: film thickness 2 mm" in done.err
    process = memscal.load_apparatus("scan.apparatus.h5").process
    (message,) = (m for m in process.messages if m.kind == "override")
    assert message.severity == "warning"
    assert [f"Overridden: {text}." for text in process.configuration["override"]] == [message.text]


def test_a_method_its_options_and_its_seed_reach_the_artifact(run, scan, monkeypatch):
    monkeypatch.setattr("memscal.calibration.drawn_scatter.draw_count", lambda _: 3)
    options = ["--method", "white-noise-draw", "--option", "amplitude=0.5", "--seed", 6]
    told = run("calibrate", scan, *options, "-o", "out.h5", "--json").json
    configuration = memscal.load_apparatus("out.h5").process.configuration
    assert told["method"] == configuration["method"] == "white-noise-draw"
    assert configuration["options"]["amplitude"] == 0.5
    assert configuration["seed"] == 6


def test_the_name_of_the_artifact_keeps_what_is_no_suffix(run, good_scan, folder):
    shutil.copy(good_scan, folder / "film_0.5mm")
    assert run("calibrate", "film_0.5mm").code == 0
    assert (folder / "film_0.5mm.apparatus.h5").is_file()


@pytest.mark.parametrize(("typed", "power"), [(0.14, -3), (2.2, 6), (561.0, -6), (1e-4, -3)])
def test_a_number_typed_in_a_unit_is_the_number_that_python_reads_in_si(typed, power):
    mantissa, _, exponent = repr(typed).partition("e")
    assert si(typed, power) == float(f"{mantissa}e{int(exponent or 0) + power}")
