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


def test_the_options_say_what_the_table_does_not(run: Run, table: Path):
    labels = [
        "--sensor-name",
        "S1",
        "--sensor-model",
        "MEMS",
        "--title",
        "Monday's scan",
        "--noise",
        0.04,
    ]
    run("import", table, "-o", "scan.h5", *COLUMNS, *SET_UP, *labels, "--noise", 0.04)
    scan = memscal.read_scan("scan.h5")
    assert scan.film == memscal.ElasticFilm(
        young_modulus=2.2e6,
        poisson_ratio=0.5,
        thickness=2e-3,
        young_modulus_uncertainty=0.1e6,
        poisson_ratio_uncertainty=0.004,
        thickness_uncertainty=0.02e-3,
    )
    assert scan.indenter == memscal.Rod(radius=0.25e-3, radius_uncertainty=0.002e-3)
    assert (scan.load, scan.load_uncertainty) == (1.0, 0.01)
    assert (scan.sensor.name, scan.sensor.model, scan.sensor.channel) == ("S1", "MEMS", "zz")
    assert scan.title == "Monday's scan"
    np.testing.assert_allclose(scan.u_zz_errors, np.full(65, 4e-5))
    run("import", table, "-o", "turned.h5", *COLUMNS, *SET_UP, "--u-sign", -1).exits(0)
    np.testing.assert_allclose(memscal.read_scan("turned.h5").u_zz, -scan.u_zz, rtol=1e-12)


def test_the_law_of_the_film_and_the_friction_of_the_rod_are_stated(run: Run, table: Path):
    law = ["--film-law", "mooney-rivlin", "--mooney-rivlin-ratio", 0.2]
    run("import", table, "-o", "a.h5", *COLUMNS, *SET_UP, *law, "--rod-friction", "inf").exits(0)
    scan = memscal.read_scan("a.h5")
    assert (scan.film.law, scan.film.mooney_rivlin_ratio) == ("mooney-rivlin", 0.2)
    assert scan.rod_friction == np.inf
    assert " mooney-rivlin\n" in run("inspect", "a.h5").out
    sphere = ["--indenter", "sphere", "--rod-friction", "0"]
    run("import", table, "-o", "b.h5", *COLUMNS, *SET_UP, *sphere).exits(2, "--indenter rod")


def test_contacts_state_their_lubrication_and_the_scatter_of_their_loads(run: Run, folder: Path):
    rows = np.stack([np.arange(9.0), np.arange(9.0), np.linspace(0.9, 1.1, 9)], axis=1)
    write_table(folder / "scan.csv", "position,voltage,force", rows)
    wet = ["--load-scatter", 2, "--lubrication", "lubricated", "--lubricant", "glycerol"]
    assert run("import", "scan.csv", "-o", "one.h5", *COLUMNS, *SET_UP, *wet).code == 0
    one = memscal.read_scan("one.h5")
    assert (one.lubrication, one.lubricant) == ("lubricated", "glycerol")
    np.testing.assert_allclose(one.normal_load, np.full(9, 1.0), rtol=1e-12)
    np.testing.assert_allclose(one.normal_load_errors, np.full(9, 0.02), rtol=1e-12)
    column = ["--load-column", "force", *wet]
    assert run("import", "scan.csv", "-o", "each.h5", *COLUMNS, *SET_UP, *column).code == 0
    each = memscal.read_scan("each.h5")
    np.testing.assert_allclose(each.normal_load_errors, 0.02 * rows[:, 2], rtol=1e-12)
    assert "glycerol" in run("inspect", "each.h5").out


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
