"""``memscal compare``: from files to friction; exit codes, refusals, and what it writes."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.console import Run, names
from helpers.friction_results import comparison, interface_comparison
from helpers.scans import known_apparatus

import memscal
from memscal.cli.compare import cache_from, user_cache_folder
from memscal.cli.failures import CHECK_FAILED
from memscal.simulation.experiment import PAPER_SPHERE, simulate_experiment
from memscal.simulation.rod_scan import PAPER_FILM

CHECKED, USAGE, REFUSED, NOT_WRITTEN = CHECK_FAILED, 2, 3, 4
MU = 0.15
Give = Callable[..., None]
Patch = pytest.MonkeyPatch


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a calibrated sensor, dry and lubricated contacts, and calculated contacts."""
    folder = tmp_path_factory.mktemp("bench")
    known = known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.005)
    made = simulate_experiment(loads=(1.37, 2.75), lubricated_loads=(2.75,), friction=MU, seed=3)
    replace(known, sensor=made.dry.sensor, film=made.dry.film).save(folder / "sensor.apparatus.h5")
    memscal.write_scan(made.dry, folder / "dry.h5")
    assert made.lubricated is not None
    memscal.write_scan(made.lubricated, folder / "lubricated.h5")
    return folder


@pytest.fixture
def compare(run: Run, bench: Path, folder: Path) -> Run:
    """Compare the bench's scans in an empty folder, with a cache that the tests share."""

    def compare_(*arguments: object, scans: tuple[str, ...] = ("dry.h5",)) -> Any:
        files = [bench / "sensor.apparatus.h5", *(bench / name for name in scans)]
        assert folder == Path.cwd()
        return run("compare", *files, "--cache", bench / "cache", *arguments)

    return compare_


QUICK = ("--friction", 0.2, "--friction", 0.1, "--loading", "incremental")


@pytest.fixture
def made_by_hand(monkeypatch: Patch) -> Callable[..., None]:
    """Let the comparison give a result made by hand, and remember what it was asked."""

    def give(found: Any = None, asked: dict[str, Any] | None = None) -> None:
        def compare(*_: object, **options: Any) -> Any:
            if asked is not None:
                asked.update(options)
            return comparison(lubrications=("dry",), loads=(1.37,)) if found is None else found

        monkeypatch.setattr("memscal.friction.compare.compare", compare)

    return give


def test_it_finds_the_friction_of_an_experiment(compare: Run, folder: Path):
    done = compare(*QUICK, "--json", scans=("dry.h5", "lubricated.h5"))
    assert done.code in (0, CHECKED), done.err
    told = done.json
    assert [scan["file_name"] for scan in told["scans"]] == ["dry.h5", "lubricated.h5"]
    by_lubrication = {found["lubrication"]: found for found in told["joint"]}
    dry, lubricated = (by_lubrication[name]["interval"] for name in ("dry", "lubricated"))
    # Three standard uncertainties in place of two: this is one seed, and a rule for all of them.
    assert dry["low"] - 0.1 < MU < dry["high"] + 0.1
    assert lubricated["low"] < 0.05
    for load in told["loads"]:
        assert load["S_max"]["standard_uncertainty"] > 0
        expected = load["ratio"]["value"] * load["p0_max"]["value"]
        assert load["S_max"]["value"] == pytest.approx(expected)
        # In their order, with no friction and full stick, which need not be asked for.
        profiles = load["by_loading"]["incremental"]["profiles"]
        assert [p["friction_coefficient"] for p in profiles] == [0.0, 0.1, 0.2, None]
    assert names(folder) == []


@pytest.mark.usefixtures("folder")
def test_measured_stress_gives_the_numbers_of_its_scans(run: Run, compare: Run, bench: Path):
    scans = ("dry.h5", "lubricated.h5")
    written = bench / "contacts.stress.h5"
    run("apply", bench / "sensor.apparatus.h5", *(bench / n for n in scans), "-o", written)
    of_scans = compare(*QUICK, "--json", scans=scans)
    of_stress = compare(*QUICK, "--json", scans=("contacts.stress.h5",))
    assert of_stress.code == of_scans.code
    for one, other in zip(flat(of_scans.json), flat(of_stress.json), strict=True):
        assert other == (pytest.approx(one, rel=1e-9) if isinstance(one, float) else one)


def flat(told: Any) -> Iterator[Any]:
    """Every value of a JSON object, in order."""
    if isinstance(told, dict | list):
        for value in told.values() if isinstance(told, dict) else told:
            yield from flat(value)
    else:
        yield told


def test_stress_of_another_sensor_is_refused(run: Run, compare: Run, bench: Path, folder: Path):
    known = memscal.load_apparatus(bench / "sensor.apparatus.h5")
    replace(known, load=2 * known.load).save(folder / "other.apparatus.h5")
    written = folder / "dry.stress.h5"
    assert run("apply", "other.apparatus.h5", bench / "dry.h5", "-o", written).code == 0
    refused(compare(*QUICK, scans=(str(written),)), "other.apparatus.h5")
    done = compare(*QUICK, "--override", "--json", scans=(str(written),))
    assert "another apparatus function" in done.json["overridden"][0]
    memscal.measure_stress(bench / "lubricated.h5", known).save(folder / "wet.stress.h5")
    both = (str(written), str(folder / "wet.stress.h5"))
    refused(compare(*QUICK, scans=both), "other.apparatus.h5")


def test_profiles_calculated_elsewhere_replace_ours(compare: Run, folder: Path):
    tables = []
    for friction in (0.0, 0.3, float("inf")):
        contact = memscal.indent(PAPER_FILM, PAPER_SPHERE, load=2.75, friction=friction)
        memscal.write_reference(contact.profile(), folder / f"fem_{friction:g}.h5")
        tables += ["--reference", f"fem_{friction:g}.h5"]
    done = compare(*tables, "--json", scans=("lubricated.h5",))
    assert done.code in (0, CHECKED), done.err
    told = done.json
    assert [table["file_name"] for table in told["references"]] == tables[1::2]
    (load,) = told["loads"]
    (by_loading,) = load["by_loading"].values()
    coefficients = [profile["friction_coefficient"] for profile in by_loading["profiles"]]
    assert coefficients == [0.0, 0.3, None]
    chi_square = [profile["chi2"] for profile in by_loading["profiles"]]
    assert chi_square[0] < chi_square[1]  # it is lubricated


def test_tables_name_every_load_within_a_hundred_columns(compare: Run):
    done = compare(*QUICK)
    assert max(map(len, done.out.splitlines())) < 100
    for words in ("1.37", "2.75", "S_max/p0_max", "by the profile", "Quality checks", "χ²"):
        assert words in done.out


def test_a_second_run_takes_the_contacts_from_the_cache(compare: Run, bench: Path):
    first = compare(*QUICK, "--json")
    kept = {path.name: path.stat().st_ino for path in (bench / "cache").iterdir()}
    assert kept
    assert {path.name: path.stat().st_ino for path in (bench / "cache").iterdir()} == kept
    assert first.out == compare(*QUICK, "--json").out


def test_a_damaged_cache_is_made_anew(compare: Run, bench: Path):
    first = compare(*QUICK, "--json")
    for path in (bench / "cache").iterdir():
        path.write_bytes(b"not a table")
    assert compare(*QUICK, "--json").out == first.out


def refused(done: Any, words: str) -> None:
    assert done.code == REFUSED, (done.code, done.err)
    assert done.out == ""
    assert done.err.startswith("Error: ")
    assert "Traceback" not in done.err
    assert words in done.err


def test_a_rod_scan_is_refused(run: Run, bench: Path, folder: Path):
    memscal.write_scan(memscal.simulate(seed=1), folder / "rod.h5")
    done = run("compare", bench / "sensor.apparatus.h5", "rod.h5", "--no-cache")
    refused(done, "rod")
    assert "calibrate" in done.err


def test_files_in_the_wrong_order_are_refused(run: Run, bench: Path):
    done = run("compare", bench / "dry.h5", bench / "sensor.apparatus.h5", "--no-cache")
    refused(done, "memscal-artifact")


def test_a_run_of_missing_points_is_refused_with_its_place(run: Run, bench: Path, folder: Path):
    scan = memscal.read_scan(bench / "dry.h5")
    u = scan.u_zz.copy()
    u[1, 8:24] = np.nan
    memscal.write_scan(replace(scan, u_zz=u), folder / "gap.h5")
    done = run("compare", bench / "sensor.apparatus.h5", "gap.h5", "--no-cache", *QUICK)
    refused(done, "16 neighbouring points are missing")


@pytest.mark.parametrize("missing", ["sensor.apparatus.h5", "dry.h5"])
def test_a_missing_file_is_refused_by_its_name(run: Run, bench: Path, folder: Path, missing):
    files = {name: bench / name for name in ("sensor.apparatus.h5", "dry.h5")}
    files[missing] = folder / "missing.h5"
    refused(run("compare", *files.values(), "--no-cache"), "missing.h5")


@pytest.mark.parametrize(("arguments", "words"), [
    (["--friction", "-0.1"], "of at least 0"),
    (["--friction", "0.1", "--friction", "0.1"], "twice"),
    (["--loading", "sideways"], "incremental"),
    (["--macroscopic-uncertainty", "0.1"], "--macroscopic"), (["--interface"], "--macroscopic"),
    (["--reference", "a.h5", "--friction", "0", "--friction", "inf"], "--reference"),
    (["--cache", "here", "--no-cache"], "not both"), (["--figure", "table.txt"], ".png"),
])  # fmt: skip
def test_options_that_do_not_go_together_are_exit_code_2(run: Run, bench: Path, arguments, words):
    done = run("compare", bench / "sensor.apparatus.h5", bench / "dry.h5", *arguments).exits(USAGE)
    assert done.out == ""
    assert words in done.err


def test_a_failed_check_is_exit_code_1_after_the_results(compare: Run, made_by_hand: Give):
    made_by_hand(comparison(lubrications=("dry",), failed=True))
    done = compare()
    done.exits(CHECKED, "bracketing")
    assert "Effective friction coefficient" in done.out


def test_the_options_reach_the_comparison(compare: Run, made_by_hand: Give, bench: Path):
    asked: dict[str, Any] = {}
    made_by_hand(asked=asked)
    compare("--macroscopic", 1.6, "--macroscopic-uncertainty", 0.2, "--interface", "--override")
    assert asked["loading"] == ("incremental", "total")
    assert asked["friction"] is None
    assert (asked["macroscopic"], asked["macroscopic_uncertainty"]) == (1.6, 0.2)
    assert asked["interface"]
    assert asked["override"]
    assert asked["cache"] == bench / "cache"


def test_a_page_and_all_figures_are_written(compare: Run, made_by_hand: Give, folder: Path):
    made_by_hand(comparison(lubrications=("dry",), loads=(1.37,), interface=interface_comparison()))
    options = ("--macroscopic", 1.6, "--interface", "--figures", "drawn", "--figure-format", "svg")
    done = compare("--figure", "page.png", *options).exits(0)
    assert (folder / "page.png").read_bytes().startswith(b"\x89PNG")
    assert names(folder / "drawn") == [
        "effective-friction.svg", "friction-set-dry.svg", "interface.svg", "likelihood.svg",
        "maxima.svg", "profiles-dry.svg",
    ]  # fmt: skip
    assert "Written: drawn/maxima.svg" in done.err.replace("\\", "/")


def test_nothing_is_overwritten_without_force(compare: Run, made_by_hand: Give, folder: Path):
    made_by_hand()
    (folder / "drawn").mkdir()
    (folder / "drawn" / "maxima.png").write_bytes(b"mine")
    assert compare("--figures", "drawn").code == NOT_WRITTEN
    assert names(folder / "drawn") == ["maxima.png"]
    assert (folder / "drawn" / "maxima.png").read_bytes() == b"mine"
    assert compare("--figures", "drawn", "--force").code == 0
    assert (folder / "drawn" / "maxima.png").read_bytes().startswith(b"\x89PNG")


def test_a_folder_is_proven_writable_before_computing(compare: Run, monkeypatch: Patch):
    def reached(*_: object, **__: object) -> None:
        raise AssertionError("The comparison was reached.")

    monkeypatch.setattr("memscal.friction.compare.compare", reached)
    assert compare("--figures", "no/such/folder").code == NOT_WRITTEN


def test_the_cache_is_the_users_own(monkeypatch: Patch, tmp_path: Path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert user_cache_folder() == tmp_path / "memscal" / "contacts"
    assert cache_from(None, no_cache=True) is None
    assert cache_from(tmp_path, no_cache=False) == tmp_path
    # A relative one is to be ignored, by the specification.
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert user_cache_folder() == tmp_path / ".cache" / "memscal" / "contacts"
