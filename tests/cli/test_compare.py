"""``memscal compare``: from files to friction; exit codes, refusals, and what it writes."""

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.console import names
from helpers.friction_results import comparison
from helpers.records import assert_same
from helpers.scans import known_apparatus, simulate_experiment

import memscal
from memscal.cli.compare import cache_from, user_cache_folder
from memscal.cli.failures import CHECK_FAILED

CHECKED = CHECK_FAILED
REFUSED = 3


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A folder with a calibrated sensor, dry and lubricated contacts, and calculated contacts."""
    folder = tmp_path_factory.mktemp("bench")
    known = known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.005)
    made = simulate_experiment(loads=(1.37, 2.75), lubricated_loads=(2.75,), friction=0.15, seed=3)
    replace(known, sensor=made.dry.sensor, film=made.dry.film).save(folder / "sensor.apparatus.h5")
    memscal.write_scan(made.dry, folder / "dry.h5")
    assert made.lubricated is not None
    memscal.write_scan(made.lubricated, folder / "lubricated.h5")
    return folder


@pytest.fixture
def compare(run, bench, folder, monkeypatch):
    """Compare the bench's scans in an empty folder, with a cache that the tests share."""
    monkeypatch.setattr("os.cpu_count", lambda: 1)

    def compare_(*arguments, scans=("dry.h5",)):
        files = [bench / "sensor.apparatus.h5", *(bench / name for name in scans)]
        assert folder == Path.cwd()
        return run("compare", *files, "--cache", bench / "cache", *arguments)

    return compare_


QUICK = ("--friction", 0.2, "--friction", 0.1, "--loading", "incremental")


@pytest.mark.usefixtures("folder")
def test_measured_stress_gives_the_numbers_of_its_scans(run, compare, bench):
    scans = ("dry.h5", "lubricated.h5")
    written = bench / "contacts.stress.h5"
    run("apply", bench / "sensor.apparatus.h5", *(bench / n for n in scans), "-o", written)
    of_scans = compare(*QUICK, "--json", scans=scans)
    of_stress = compare(*QUICK, "--json", scans=("contacts.stress.h5",))
    assert of_stress.code == of_scans.code
    assert_same(of_stress.json, of_scans.json, rtol=1e-9)
    for load in of_scans.json["loads"]:
        # In their order, with no friction and full stick, which need not be asked for.
        profiles = load["by_loading"]["incremental"]["profiles"]
        assert [p["friction_coefficient"]["value"] for p in profiles] == [0.0, 0.1, 0.2, None]
    assert names(Path.cwd()) == []


def test_stress_of_another_sensor_is_refused(run, compare, bench, folder):
    known = memscal.load_apparatus(bench / "sensor.apparatus.h5")
    replace(known, load=2 * known.load).save(folder / "other.apparatus.h5")
    written = folder / "dry.stress.h5"
    assert run("apply", "other.apparatus.h5", bench / "dry.h5", "-o", written).code == 0
    compare(*QUICK, scans=(str(written),)).exits(REFUSED, "other.apparatus.h5")
    done = compare(*QUICK, "--override", "--json", scans=(str(written),))
    assert done.json["overridden"][0].startswith("apparatus function other.apparatus.h5 (digest")
    memscal.measure_stress(bench / "lubricated.h5", known).save(folder / "wet.stress.h5")
    both = (str(written), str(folder / "wet.stress.h5"))
    compare(*QUICK, scans=both).exits(REFUSED, "other.apparatus.h5")


def test_a_failed_check_is_exit_code_1_after_the_results(compare, monkeypatch):
    found = comparison(lubrications=("dry",), failed=True)
    monkeypatch.setattr("memscal.friction.compare.compare", lambda *_, **__: found)
    done = compare()
    done.exits(CHECKED, "bracketing")
    assert "Effective friction coefficient" in done.out


def test_the_cache_is_the_users_own(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert user_cache_folder() == tmp_path / "memscal" / "contacts"
    assert cache_from(None, no_cache=True) is None
    assert cache_from(tmp_path, no_cache=False) == tmp_path
    # A relative one is to be ignored, by the specification.
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert user_cache_folder() == tmp_path / ".cache" / "memscal" / "contacts"
