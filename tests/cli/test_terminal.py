"""What every command prints on shipped data at 80 columns: whole tables, and the answer first."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.console import Outcome, Run

from memscal.cli import main
from memscal.cli.commands import COMMANDS
from memscal.summaries.table import Table

DATA = Path(__file__).parents[2] / "calibration_data"
SPHERE = DATA / "sphere_experiment"

RUNS = {
    "calibrate": "calibrate loads.h5 -o loads.apparatus.h5 --force",
    "calibrate, drawn": "calibrate rod.h5 -o x.h5 --force --monte-carlo 3",
    "calibrate, rehearsed": "calibrate rod.h5 --dry-run -o new.h5",
    "apply": "apply sensor.h5 dry.h5 lubricated.h5 -o stress.h5 --force",
    "compare": "compare sensor.h5 stress.h5 --friction 0.2 --macroscopic 1.6 --cache contacts",
    "restore": "restore sensor.h5 dry.h5 --load 1.37",
    "reference": "reference sphere --load 0.34 --load 1.37 --friction 0.3",
    "design": "design --noise 1",
    "simulate": "simulate -o synthetic.h5 --force --points 17",
    "simulate, sphere": "simulate --experiment sphere -o experiment --force --points 17 --load 1"
    " --lubricated-load 1 --contacts 9",
    "inspect": "inspect sensor.h5",
    "inspect, stress": "inspect stress.h5",
    "check": "check sensor.h5",
    "explain": "explain",
    "explain, one": "explain applied_force_3",
    "batch": "batch scans -o results --resume --workers 2 --artifacts none",
    "summary": "summary results --force",
}
"""Commands of which each may read what those before it write."""

NO_TABLES = {"certificate", "completion", "import"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with shipped scans, a sensor, measured stress and the results of a batch."""
    work = tmp_path_factory.mktemp("terminal")
    (work / "scans").mkdir()
    for source, name in {
        DATA / "rod_scan_65.h5": "rod.h5",
        DATA / "rod_scan_three_loads.h5": "loads.h5",
        DATA / "rod_scan_33.h5": "scans/a.h5",
        DATA / "rod_scan_light.h5": "scans/b.h5",
        SPHERE / "sphere_dry.h5": "dry.h5",
        SPHERE / "sphere_lubricated.h5": "lubricated.h5",
    }.items():
        shutil.copy(source, work / name)
    measured = f"apply {work / 'sensor.h5'} {work / 'dry.h5'} {work / 'lubricated.h5'}"
    for command in (
        f"calibrate {SPHERE / 'rod_scan.h5'} -o {work / 'sensor.h5'}",
        f"{measured} -o {work / 'stress.h5'}",
        f"batch {work / 'scans'} -o {work / 'results'} --workers 1 --artifacts none",
    ):
        assert main(command.split()) in (0, 1)
    return work


@pytest.fixture
def at_80(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Outcome]:
    """Run a command line in the folder, where there are 80 columns."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "80")
    return lambda line: run(*line.split())


NUMBER = re.compile(r"\(?-?[\d.]+ ± [\d.]+\)?(?:×10\S+)?(?: [^\W\d]\S*)?|[\d.]+ \[[^\]]+\]")


def test_every_command_that_prints_tables_is_run() -> None:
    assert {name.split(",")[0] for name in RUNS} == COMMANDS.keys() - NO_TABLES


@pytest.mark.parametrize("name", RUNS)
def test_tables_are_whole_at_80_columns(at_80, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    tables: list[Table] = []
    plain = Table.plain
    monkeypatch.setattr(Table, "plain", lambda self, *_: tables.append(self) or plain(self, *_))
    shown = at_80(RUNS[name])
    assert shown.code in (0, 1), shown.err
    lines = shown.out.splitlines()
    assert [line for line in lines if len(line) > 80] == []
    assert tables
    for table in tables:
        whole = plain(table, 10_000)
        # Each number, with its uncertainty, unit or interval, stands on one line.
        numbers = [number for line in whole.splitlines() for number in NUMBER.findall(line)]
        narrow = [number for line in lines for number in NUMBER.findall(line)]
        assert [number for number in numbers if number not in narrow] == []
        # No word of a name, nor of a cell, is lost or broken: paths are words.
        words = {word for row in (table.head, *table.rows) for cell in row for word in cell.split()}
        assert sorted(words - set(shown.out.split())) == []


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        (
            "calibrate",
            r"Use A = \(.*\)\S* mV/Pa \(method white-noise\)\.",
            r"Its Gaussian of σ = .*",
        ),
        (
            "apply",
            r"S_zz up to \(.*\) kPa at 0\.34 N, \(.*\) kPa at 2\.75 N\.",
            r"6 profiles: total force over applied load 1\.0\d+ ± 0\.\d+\. All \d+ checks passed\.",
        ),
        (
            "compare",
            r"Dry: μ = 0\.\d+ \[0\.\d+, 0\.\d+\].*",
            r"Lubricated: μ below 0\.\d+ \(95 %\), taken as 0\. All \d+ checks passed\.",
        ),
        (
            "restore",
            r"Stress on the axis \(.*\) kPa; force \(.*\) N at 1\.37 N\.",
            r"All 6 checks passed\.",
        ),
    ],
)
def test_brief_ends_with_the_answer_with_which_the_tables_begin(at_80, name, first, last) -> None:
    lines = at_80(f"{RUNS[name]} --brief").out.splitlines()
    assert re.match(first, lines[0])
    assert re.search(f"{last}$", " ".join(lines))
    assert len(lines) in (2, 3)
    assert at_80(RUNS[name]).out.splitlines()[: len(lines) + 1] == [*lines, ""]
    at_80(f"{RUNS[name]} --brief --json").exits(2, "Give --brief or --json, not both.")


def test_failed_checks_are_named_in_the_answer(at_80) -> None:
    shown = at_80("restore sensor.h5 dry.h5 --load 2.75 --brief")
    failed = re.findall(r"Quality check (\w+) failed", shown.err)
    assert len(failed) > 1
    names = ", ".join(failed).replace("_", " ")
    assert f"{len(failed)} of 6 checks FAILED: {names}." in " ".join(shown.out.split())
    assert f"{len(failed)} quality checks failed ({names}): memscal explain CHECK" in shown.err


def test_a_load_of_several_is_restored_by_its_number(at_80) -> None:
    single = at_80("restore sensor.h5 dry.h5 --load 1.4 --json").json
    assert single["load"]["value"] == 1.37
    assert abs(single["force"]["value"] - 1.37) < 3 * single["force"]["standard_uncertainty"]
    at_80("restore sensor.h5 dry.h5").exits(3, "go from 0.34 to 2.75 N", "--load")
    at_80("restore sensor.h5 dry.h5 --load 2").exits(3, "0.34, 0.69, 1.37, 2.75 N", "none of 2 N")


def test_a_wide_terminal_is_used_up_to_120_columns(at_80, monkeypatch) -> None:
    longest = []
    for columns in ("80", "100", "200"):
        monkeypatch.setenv("COLUMNS", columns)
        longest.append(max(map(len, at_80("inspect sensor.h5").out.splitlines())))
    assert 70 < longest[0] <= 80 < longest[1] <= 100 < longest[2] <= 120


def test_explain_knows_each_check_by_the_names_of_tables_and_files(at_80) -> None:
    by_name = at_80("explain joint_chi_square_dry").out
    assert by_name.startswith("joint chi square\n")
    assert "one friction coefficient" in by_name
    assert at_80("explain applied-force").out == at_80("explain applied_force_12").out
    assert at_80("explain applied_force_all").out.startswith("applied force all\n")
    at_80("explain gausian_misfit").exits(2, "Did you mean gaussian_misfit?")
    [told] = at_80("explain tail_share --json").json["checks"]
    assert told["if_it_fails"] == "scan farther"
