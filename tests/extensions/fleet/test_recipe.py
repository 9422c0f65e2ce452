"""Recipes: many tables that are imported, or calibrated, with what the options say for one."""

import re
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click
import numpy as np
import pandas as pd
import pytest
from helpers.scans import simulated

import memscal
from memscal.cli import main
from memscal.cli.import_ import command
from memscal.extensions.fleet.recipe import SECTIONS

COLUMNS = (
    "--x x --x-unit mm --u U --u-unit uV --repeat pass --u-sign -1 --position-error 5 "
    "--position-scale-uncertainty 0.1 --gain-uncertainty 0.3 "
)
SET_UP = (
    "--radius 0.25 --radius-uncertainty 0.0025 --rod-friction 0 --load 0.3 --load-cell balance "
    "--young-modulus 2.1 --poisson-ratio 0.5 --thickness 2.03 --film-law neo-hookean"
)


@pytest.fixture
def tables(folder, monkeypatch):
    """Three tables, of which one has no numbers, and the recipe of the first."""
    monkeypatch.setattr("memscal.parallel.worker_pool", ThreadPoolExecutor)
    Path("dies").mkdir()
    for i in range(2):
        scan = simulated(noise=0.002, points=33, seed=i)
        rows = np.stack([scan.x * 1e3, -scan.u_zz.ravel() * 1e6, np.ones(33)], axis=1)
        np.savetxt(f"dies/die_{i}_7.csv", rows, delimiter=",", header="x,U,pass", comments="")
    Path("dies/die_1_8.csv").write_text("x,U,pass\n0,much,1\n1,2,1\n2,1,1\n")
    line = ["import", "dies/die_0_7.csv", "-o", "die.h5", "--save-recipe", "recipe.toml"]
    assert main([*line, *COLUMNS.split(), *SET_UP.split()]) == 0
    return sorted(Path("dies").iterdir())


def change(old, new):
    path = Path("recipe.toml")
    path.write_text(path.read_text().replace(old, new))


def without_name(scan):
    return {name: value for name, value in vars(scan).items() if name not in ("sensor", "source")}


def test_every_option_of_an_import_of_scans_has_one_place_in_a_recipe():
    keys = [key for keys in SECTIONS.values() for key in keys.split()]
    about = {item.name: item.help for item in command.params if isinstance(item, click.Option)}
    others = {name for name, text in about.items() if re.match("Reference|Mesh", text)}
    of_a_run = {"output", "kind", "recipe", "save_recipe", "figure", "as_json", "force"}
    of_a_run |= {"resume", "dry_run", "debug", "motion"}
    assert sorted(keys) == sorted(about.keys() - others - of_a_run)


def test_a_recipe_says_what_the_options_said(run, tables):
    again = "import dies/die_0_7.csv -o again.h5 --recipe recipe.toml --save-recipe same.toml"
    run(*again.split()).exits(0)
    assert Path("same.toml").read_bytes() == Path("recipe.toml").read_bytes()
    first, second = (memscal.read_scan(f"{name}.h5") for name in ("die", "again"))
    np.testing.assert_equal(without_name(second), without_name(first))
    stated = tomllib.loads(Path("same.toml").read_text())
    assert (stated["film"]["thickness"], stated["load"]["load"]) == (2.03, 0.3)
    run(*again.split(), "--force", "--thickness", "1.9").exits(0)
    assert memscal.read_scan("again.h5").film.thickness == 1.9e-3


def test_tables_are_imported_each_by_itself_and_named_by_their_files(run, tables):
    line = ["import", *tables, "-o", "scans", "--recipe", "recipe.toml"]
    named = ["--name-pattern", "die_{row}_{col}", "--die-pitch", "5", "4"]
    assert run(*line, "--dry-run").exits(1).out.count("die_1_8.csv") == 2
    assert not Path("scans").exists()
    told = run(*line, *named, "--json").exits(1).json
    assert (told["tables"], told["read"], told["refused"]) == (3, 2, 1)
    (problem,) = told["problems"]
    assert problem["path"] == "dies/die_1_8.csv"
    assert "'much'" in problem["problem"]
    rows = pd.read_csv("scans/manifest.csv")
    assert rows.to_dict("list") == {
        "path": ["die_0_7.h5", "die_1_7.h5"],
        "sensor": ["die_0_7", "die_1_7"],
        "wafer_x": [35, 35],
        "wafer_y": [0, 4],
        "place_unit": ["mm", "mm"],
    }
    scan = memscal.read_scan("scans/die_1_7.h5")
    assert scan.sensor.name == "die_1_7"
    run(*line, *named).exits(4, "exists already")
    before = Path("scans/die_0_7.h5").stat().st_mtime_ns
    tables[2].write_text(tables[0].read_text())
    again = run(*line, *named, "--resume", "--json").exits(0).json
    assert (again["kept"], again["read"]) == (2, 1)
    assert Path("scans/die_0_7.h5").stat().st_mtime_ns == before
    change("thickness = 2.03", "thickness = 1.9")
    run(*line, *named, "--resume").exits(3, "options: thickness: 2.03, now 1.9.")
    run(*line, *named[2:], "--resume", "--name-pattern", "die_{rw}_{col}").exits(2, "mean {row}?")
    assert Path("scans/die_0_7.h5").stat().st_mtime_ns == before
    run(*line, *named[:2], "--resume", "--force").exits(0, "law neo-hookean. (tables: 3)")
    assert set(pd.read_csv("scans/manifest.csv")["place_unit"]) == {"die"}
    other = run(*line, "--name-pattern", "chip_{row}", "--force", "--json").exits(1).json
    assert other["problems"][0]["problem"] == "die_0_7.csv is not named as chip_{row}."


@pytest.mark.usefixtures("tables")
def test_columns_state_the_place_and_the_number_of_a_sensor(run):
    plain = Path("dies/die_0_7.csv").read_text(encoding="utf-8").splitlines()
    for name, die in (("a", 3), ("b", 4)):
        rows = [f"{plain[0]},die row,nr", *(f"{row},{die},1{die}" for row in plain[1:])]
        Path(f"{name}.csv").write_text("\n".join(rows), encoding="utf-8")
    line = ["import", "a.csv", "b.csv", "-o", "scans", "--recipe", "recipe.toml", "--name-pattern"]
    run(*line, "{row:die row}{sensor:nr}").exits(0)
    rows = pd.read_csv("scans/manifest.csv")
    assert [*rows["sensor"]] == [13, 14]
    assert [*rows["wafer_y"]] == [3, 4]
    assert memscal.read_scan("scans/a.h5").sensor.name == "13"
    run(*line, "{row:x}", "--force").exits(1)
    assert "column 'x' holds" in run(*line, "{row:x}", "--force", "--json").out


def test_a_batch_of_tables_is_that_of_their_scans(run, tables):
    change("[sensor]", '[sensor]\nname_pattern = "die_{row}_{col}"')
    run("import", "dies", "-o", "scans", "--recipe", "recipe.toml").exits(1)
    run("batch", "scans/manifest.csv", "-o", "of_scans").exits(0)
    line = ["batch", "dies/die*", "-o", "results", "--recipe", "recipe.toml"]
    dry = run(*line, "--dry-run", "--json").exits(1).json
    assert (dry["scans"], dry["shards"], dry["refused"]) == (3, 1, 1)
    assert not Path("results").exists()
    run(*line).exits(1, "1 of 3 scans could not be calibrated")
    rows, expected = (pd.read_parquet(f"{name}/shards") for name in ("results", "of_scans"))
    assert list(rows["path"]) == [
        "../dies/die_0_7.csv",
        "../dies/die_1_7.csv",
        "../dies/die_1_8.csv",
    ]
    assert "'much'" in rows["error"][2]
    same = ["conversion_constant", "gaussian_sigma_errors", "sensor", "wafer_x", "wafer_y"]
    pd.testing.assert_frame_equal(rows[same][:2], expected[same], rtol=1e-9)
    change("thickness = 2.03", "thickness = 1.5")
    run(*line, "--resume").exits(3, "recipe thickness: 2.03, now 1.5")
    assert "shards written  1" in run(*line, "--force").exits(1).out


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("thickness = 2.03", 'thickness = "2,03"', "[film] thickness is '2,03'. not a comma."),
        ("thickness = 2.03", "thickness = true", "[film] thickness is True. A flag is true"),
        (
            "thickness = 2.03",
            "thicknes = 2.03",
            "[film] thicknes is 2.03. mean thickness in [film]?",
        ),
        (
            "[load]",
            "[load]\nname_pattern = 1",
            "[load] name_pattern is 1. name_pattern in [sensor]?",
        ),
        ('film_law = "neo', 'film_law = "new', "is 'new-hookean'. 'neo-hookean'"),
        ('x = "x"', 'x = ["x", "y"]', "[table] x is ['x', 'y']. text or a number"),
        ("[film]", "[foil]", "[foil] young_modulus is 2.1. young_modulus in [film]"),
        ("[table]", "holds = 1\n[table]", "recipe.toml: [holds] holds is 1. holds in [table]"),
        ("[table]", "[table", "is no TOML"),
    ],
)
def test_a_recipe_that_is_wrong_is_refused_with_what_is_allowed(run, tables, old, new, words):
    change(old, new)
    done = run("import", *tables, "-o", "scans", "--recipe", "recipe.toml").exits(3)
    assert all(word in done.err for word in words.split(". "))
    assert not Path("scans").exists()


def test_two_tables_of_one_name_and_tables_without_a_recipe_are_refused(run, tables):
    Path("others").mkdir()
    Path("others/die_0_7.txt").touch()
    line = ["import", *tables, "others", "-o", "scans", "--recipe", "recipe.toml"]
    run(*line).exits(3, "dies/die_0_7.csv and others/die_0_7.txt would both be written")
    assert not Path("scans").exists()
    Path("empty").mkdir()
    run("import", "empty", *line[-4:]).exits(3, "holds no tables", ".csv, .tsv")
    for source in ("dies", "dies/*.csv"):
        run("batch", source, "-o", "results").exits(3, "--save-recipe", "--recipe recipe.toml")
    assert not Path("results").exists()
