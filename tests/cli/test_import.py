"""``memscal import``."""

from pathlib import Path

import numpy as np
import pytest
from helpers.console import Run, names

import memscal

SET_UP = [
    *("--load", 1, "--load-uncertainty", 0.01, "--radius", 0.25, "--radius-uncertainty", 0.002),
    *("--young-modulus", 2.2, "--young-modulus-uncertainty", 0.1, "--poisson-ratio", 0.5),
    *("--poisson-ratio-uncertainty", 0.004, "--thickness", 2, "--thickness-uncertainty", 0.02),
]
COLUMNS = ["--x", "position", "--x-unit", "mm", "--u", "voltage", "--u-unit", "mV"]


def write_table(path: Path, head: str, rows: np.ndarray) -> Path:
    lines = [head, *(",".join(repr(float(value)) for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def table(folder: Path) -> Path:
    """A line scan as a table, in mm and mV."""
    scan = memscal.simulate(seed=1)
    rows = np.stack([scan.x * 1e3, scan.u_zz * 1e3], axis=1)
    return write_table(folder / "scan.csv", "position,voltage", rows)


@pytest.mark.parametrize(
    ("arguments", "hints"),
    [
        ([], ["--x", "--u"]),
        ([*COLUMNS, "--thickness", 1], ["--young-modulus", "--poisson-ratio"]),
        ([*COLUMNS, *SET_UP, "--sigma", "s"], ["--sigma", "--format reference"]),
        ([*COLUMNS, *SET_UP, "--shear-sign", -1], ["--shear-sign"]),
        (["--format", "reference"], ["--r", "--sigma", "--load"]),
    ],
)
def test_all_that_is_missing_is_named(run: Run, table: Path, folder: Path, arguments, hints):
    refused = run("import", table, "-o", "scan.h5", *arguments).exits(2)
    assert all(hint in refused.err for hint in hints), refused.err
    assert names(folder) == ["scan.csv"]


def test_the_table_itself_is_never_replaced(run: Run, table: Path):
    before = table.read_bytes()
    run("import", table, "-o", table, *COLUMNS, *SET_UP, "--force").exits(4)
    assert table.read_bytes() == before


@pytest.mark.parametrize(("arguments", "code", "words"), [
    (["--load", 80, "--load-unit", "g"], 3, "80 g weigh 0.785 N"),
    (["--load", 1, "--sheet", "A"], 3, "--sheet) has no effect on a text"),
    (["--load", 1, "--indenter", "sphere"], 2, "--radius"), (["--figure", "a.png"], 2, "--holds"),
    ([*SET_UP, "--thickness", 1500], 3, "Probably 1.5 mm was meant"),
    ([*SET_UP, "--thickness", 0.02], 3, "times the film's thickness of 0.02 mm"),
])  # fmt: skip
@pytest.mark.filterwarnings("default::memscal.errors.UnitWarning")
def test_an_option_without_effect_or_of_no_set_up_is_refused(
    run: Run, table: Path, folder: Path, arguments, code, words
):
    run("import", table, "-o", "scan.h5", *COLUMNS, *arguments).exits(code, words)
    assert names(folder) == ["scan.csv"]


def test_a_log_of_presses_is_averaged_and_drawn(run: Run, folder: Path):
    x = np.repeat(np.linspace(-8, 8, 17), 20)
    load = np.tile(np.repeat([0.0, 1.0], 10), 17)
    noise = np.random.default_rng(1).normal(size=(2, x.size)) * 1e-3
    rows = np.stack([x, load * np.exp(-(x**2)) + noise[0], load + noise[1]], axis=1)
    write_table(folder / "log.csv", "x/mm,u/mV,F [N]", rows)
    log = ["--x", "x", "--u", "u", "--load-column", "F", "--holds", "--figure", "log.png"]
    told = run("import", "log.csv", "-o", "scan.h5", *log, *SET_UP[4:]).exits(0).out
    assert "17 holds of 10 to 10 rows, the first in lines 12 to 21" in told
    assert (folder / "log.png").read_bytes().startswith(b"\x89PNG")
    scan = memscal.read_scan("scan.h5")
    np.testing.assert_allclose(scan.u_zz, 1e-3 * np.exp(-(scan.x**2) * 1e6), atol=2e-6)
