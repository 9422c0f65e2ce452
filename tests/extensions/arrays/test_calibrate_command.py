"""``memscal calibrate`` sees the axis of an array, and hands its scan to the joint calibration."""

import pytest
from helpers.array_scans import make_array_scan
from helpers.arrays import full_array
from helpers.builders import make_scan
from helpers.schemas import faults

from memscal import load_array, write_scan
from memscal.extensions.arrays import calibrate_array


@pytest.fixture
def asked(folder, monkeypatch):
    """What the joint calibration is asked for; its result is a known array with a dead sensor."""
    write_scan(make_array_scan(reference=None, synthetic=None), "scan.h5")
    write_scan(make_scan(), "single.h5")
    asked = {}

    def calibrate(scan, **options):
        asked.update(options, scan=scan.name)
        return calibrate_array.ArrayCalibration(full_array())

    monkeypatch.setattr(calibrate_array, "calibrate_array", calibrate)
    return asked


def test_an_array_is_told_by_its_scan_and_its_options_are_handed_on(asked, run):
    outcome = run("calibrate", "scan.h5", "--json")
    outcome.exits(1, "dead taxels", "scan.array.h5 was written and is marked so")
    assert faults("calibrate", outcome.json) == []
    assert load_array("scan.array.h5").sensors == full_array().sensors
    assert asked == {"scan": "scan.h5", "override": False, "accept_altered": False}
    words = "--kernel own --crosstalk full --film-law linear --rod-friction 0 --accept-altered"
    run("calibrate", "scan.h5", "-o", "a.h5", "--report", "a.html", *words.split()).exits(1)
    options = {"kernel": "own", "crosstalk": "full", "film_law": "linear", "rod_friction": 0.0}
    assert options.items() <= asked.items()


@pytest.mark.parametrize(
    ("words", "refused"),
    [
        ("scan.h5 --method tikhonov --sweep", "has no use for --method, --sweep"),
        ("scan.h5 --monte-carlo 5 --dry-run", "array of sensors has no use for --monte-carlo"),
        ("scan.h5 single.h5", "one scan"),
        ("single.h5 --kernel own", "--kernel and --crosstalk belong to"),
    ],
)
def test_options_of_the_other_kind_are_refused_by_name(asked, run, words, refused):
    run("calibrate", *words.split()).exits(2, refused)
    assert not asked


def test_an_array_is_no_single_sensor_and_the_other_way_round(asked, run):
    full_array().save("array.h5")
    for words in ("apply array.h5 single.h5 -o out.h5", "restore array.h5 single.h5"):
        run(*words.split()).exits(3, "array of sensors")
    run("calibrate", "single.h5", "scan.h5").exits(3, "array of 3 sensors")
