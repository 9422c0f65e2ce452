"""What the documentation says is so: numbers, messages, examples; notebooks are their scripts."""

import csv
import inspect
import math
import os
import re
import runpy
import shlex
import shutil
import tomllib
from functools import lru_cache
from pathlib import Path
from types import UnionType

import jupytext
import numpy as np
import pytest
from helpers.bench import Bench
from helpers.bounds import FULL
from helpers.console import numbers, words
from helpers.folders import SHIPPED
from helpers.scans import simulate
from ophyd.sim import SynAxis, SynSignal

import memscal
from memscal.cli import main
from memscal.cli.commands import memscal as program
from memscal.cli.compare import figure_stems
from memscal.errors import FitError

DOCS = Path(__file__).parent.parent / "docs"
NOTEBOOKS = DOCS.with_name("notebooks")
FRONT = ("README.md", "CHANGELOG.md")


def text_of(path):
    return path.read_text(encoding="utf-8")


def cells_of(line):
    return [cell.strip() for cell in line.split("|")[1:-1]]


def pair(cell):
    """Numbers of a cell: incremental and total loading."""
    return [float(text) for text in cell.removeprefix("radius").split("/")]


@lru_cache
def sphere_table(ratio):
    """Cells of the table of the paper's sphere, as its script prints them, by load and friction."""
    frictions = (0.0, 0.2, math.inf) if ratio == 0.5 else (0.0, math.inf)
    every = {} if FULL else {"frictions": frictions}
    rows = runpy.run_path(str(DOCS / "sphere_table.py"))["table"](ratio, **every)
    return {(load, friction): cells for load, friction, *cells in map(cells_of, rows[2:])}


def stated_rows(section):
    text = text_of(DOCS / "sphere.md").split(f"## {section}\n")[1]
    return [cells_of(line) for line in text.split("##")[0].splitlines() if line.startswith("| ")][
        1:
    ]


def test_the_table_of_the_paper_s_sphere_is_what_its_script_prints():
    stated = {(load, friction): row for load, friction, *row in stated_rows("ν = 0.5")}
    assert len(stated) == 36
    printed = sphere_table(0.5)
    assert len(printed) == (36 if FULL else 12)
    for key, row in printed.items():
        for cell, found in zip(stated[key], row, strict=True):
            # Another processor may round the last digit differently.
            assert pair(cell) == pytest.approx(pair(found), rel=7e-4)


def test_the_comparison_with_the_paper_s_sphere_is_by_the_same_script():
    stated = stated_rows("Comparison with the paper")
    assert len(stated) == 9
    for load, quantity, _, *values in stated:
        friction = "∞" if "∞" in quantity else "0"
        column = 0 if quantity.startswith("depth") else 1
        for ratio, value in zip((0.5, 0.495), values, strict=True):
            found = pair(sphere_table(ratio)[load, friction][column])[: len(pair(value))]
            assert pair(value) == pytest.approx(found, abs=0.006 if column else 0.06)


@pytest.fixture(scope="module")
def kinds():
    """The cases of the study of the Bayesian estimate, by the kind of sensor."""
    kinds = {}
    with (DOCS / "estimation_study.csv").open(encoding="utf-8", newline="") as file:
        for case in csv.DictReader(file):
            kind = re.match(r"[a-zA-Z ]+", case["G (lengths in mm)"])[0].strip()
            kinds.setdefault(kind, []).append(case)
    return kinds


@pytest.mark.parametrize(
    ("page", "columns"),
    [
        ("estimation.md", {3: ("error of G", 3), 5: ("bias of A (u)", 2)}),
        ("accuracy.md", {2: ("G (%)", 1), 5: ("A (%)", 1), 6: ("z of A", 2)}),
    ],
)
def test_a_page_sums_up_the_study_of_the_bayesian_estimate(page, columns, kinds):
    text = text_of(DOCS / page)
    rows = [cells_of(line) for line in text.splitlines() if line.startswith("| ")]
    found = {row[0].split(",")[0]: row for row in rows if row[0].split(",")[0] in kinds}
    for kind, cases in kinds.items():
        assert found[kind][1] == str(len(cases))
        for column, (name, digits) in columns.items():
            values = [float(case[name]) for case in cases]
            stated = [float(number) for number in found[kind][column].split(" to ")]
            ends = {round(min(values), digits), round(max(values), digits)}
            assert sorted(set(stated)) == sorted(ends), (kind, name)


def cells(path):
    return [(cell.cell_type, cell.source) for cell in jupytext.read(path).cells]


def test_every_notebook_has_its_script_and_says_the_same():
    scripts = {path.stem: path for path in NOTEBOOKS.glob("*.py")}
    books = {path.stem: path for path in NOTEBOOKS.glob("*.ipynb")}
    assert books
    assert scripts.keys() == books.keys()
    for name, script in scripts.items():
        assert cells(script) == cells(books[name]), f"jupytext --sync notebooks/{name}.py"


def blocks(page, language):
    """Return the blocks of code of a page."""
    text = text_of(DOCS / page)
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def test_every_message_of_the_troubleshooting_page_is_one_that_memscal_gives():
    page = text_of(DOCS / "troubleshooting.md")
    quoted = re.findall(r"^\| `(.+?)`", page, flags=re.MULTILINE)
    assert len(quoted) > 20
    package = Path(memscal.__path__[0])
    sources = "".join(text_of(path) for path in package.rglob("*.py"))
    joined = re.sub(r'"\s+f?"', "", sources)  # a text over several lines
    filled = re.sub("…+", "…", re.sub(r"\{[^{}]*\}", "…", joined))
    assert [message for message in quoted if message not in filled] == []


def test_an_extra_is_installed_from_the_folder_never_from_an_index():
    extras = tomllib.loads(text_of(DOCS.with_name("pyproject.toml")))["project"][
        "optional-dependencies"
    ]
    [every] = extras["all"]
    assert set(every.removeprefix("memscal[")[:-1].split(",")) == set(extras) - {"all", "peers"}
    sources = (Path(memscal.__file__).parent.rglob("*.py"), DOCS.rglob("*.md"))
    pages = [*map(DOCS.with_name, FRONT), *NOTEBOOKS.glob("*.py")]
    asked = []
    for path in pages + [path for paths in sources for path in paths]:
        asked += re.findall(r'pip install [\\"\']*([\w.-]*\[[^\]]*\]|memscal)', text_of(path))
    named = {name.removeprefix(".[").removesuffix("]") for name in asked}
    assert {"tables", "all"} < named <= {*extras, "{extra}"}


def test_every_option_in_the_documentation_exists():
    unknown = []
    for page in (*DOCS.glob("*.md"), DOCS.with_name("README.md")):
        text = text_of(page).replace("\\\n", "")
        for line in re.findall(r"^memscal .*", text, flags=re.MULTILINE):
            name, *arguments = shlex.split(line.split(" > ")[0], comments=True)[1:]
            command = program.get_command(None, name)
            known = {option for p in command.params for option in p.opts} if command else set()
            given = {word for word in arguments if re.match("--?[a-z]", word)}
            unknown += [(page.name, line, option) for option in given - known]
    assert unknown == []


def follow(page, run):
    """Run the commands of a page, in the working folder; return what each printed."""
    outcomes = {}
    for line in "".join(blocks(page, "console")).splitlines():
        command, *arguments = shlex.split(line)[1:]
        outcomes[command] = run(command, *arguments).exits(0)
    return outcomes


def test_the_page_on_tables_imports_the_shipped_ones(folder, run):
    for table in SHIPPED.glob("tables/*.csv"):
        shutil.copy(table, folder)
    follow("import_tables.md", run)


def test_the_page_on_incomplete_scans_calibrates_them(folder, run, capsys):
    shutil.copy(SHIPPED / "tables" / "rod.csv", folder)
    assert (
        "mV (relative: the load is not known)" in follow("incomplete_scan.md", run)["calibrate"].out
    )
    run_examples("incomplete_scan.md")
    ratio, u = numbers(capsys.readouterr().out)
    # Two scans of one sensor.
    assert 0 < abs(ratio - 1) < 3 * u < 0.1


def run_examples(page):
    """Run the Python of a page, as a module of its name; return its names."""
    names = {"__name__": page.removesuffix(".md")}
    for example in blocks(page, "python"):
        exec(compile(example, page, "exec"), names)
    return names


def test_the_page_on_mechanics_prints_what_it_shows(folder, run):
    printed = follow("mechanics.md", run)["reference"].out.splitlines()
    assert (folder / "sphere.png").is_file()
    expected = blocks("mechanics.md", "text")[0].splitlines()
    rule = next(i for i, line in enumerate(expected) if line.startswith("  ---"))
    assert printed[:rule] == expected[:rule]
    for line, shown in zip(printed[rule + 1 :], expected[rule + 1 :], strict=True):
        # Depths, radii and stresses; the last digit of another machine may differ.
        assert numbers(line)[:6] == pytest.approx(numbers(shown)[:6], rel=2e-3)
    assert run_examples("mechanics.md")["down"].load == pytest.approx(1.37)


def test_the_way_from_contacts_to_friction_prints_what_is_shown(folder, run, monkeypatch):
    """The whole chain, from files only; unless in full, by fewer contacts in one process."""
    if not FULL:
        monkeypatch.setattr(os, "cpu_count", lambda: 1)
        few = (0.0, 0.05, 0.1, 0.2, 0.3, math.inf)
        monkeypatch.setattr("memscal.friction.compare.FRICTIONS", few)
    printed = follow("measured_stress.md", run) | follow("friction.md", run)
    assert {"contacts.stress.h5", "contacts.png", "friction.png"} <= set(os.listdir(folder))
    for command, page in (("apply", "measured_stress.md"), ("compare", "friction.md")):
        expected = blocks(page, "text")[0].splitlines()
        assert len(expected) > 8
        if command == "compare" and not FULL:
            expected = expected[: expected.index("", 4)]
        lines = printed[command].out.splitlines()[: len(expected)]
        for line, shown in zip(lines, expected, strict=True):
            assert words(line) == words(shown)
            # The last digit of another machine may differ.
            assert numbers(line) == pytest.approx(numbers(shown), rel=0.02, abs=0.02)
    assert len(run_examples("measured_stress.md")["measured"].profiles) == 6
    assert run_examples("friction.md")["comparison"].joint["dry"]["total"].interval.low < 0.1


def test_the_page_on_the_response_runs(folder, run, capsys):
    assert "not resolved" in follow("response.md", run)["response"].out
    assert (folder / "response.png").is_file()
    seen = run_examples("response.md")["seen"]
    assert np.all(seen.smallest_stress > 0)


def test_the_page_on_readings_in_motion_runs():
    contact = run_examples("motion.md")["contact"]
    assert contact.base_centroid - contact.surface_centroid == pytest.approx(0.6e-3, rel=0.01)
    text = text_of(DOCS / "motion.md")
    places = 1e-5 * np.arange(150)
    stresses = [
        memscal.slide(contact.film, contact.indenter, load=1.37, friction=mu).base_stress(places)
        for mu in (0.0, 0.1, 0.3)
    ]
    ratios = [stress.max() / stresses[0].max() for stress in stresses[1:]]
    peaks = [1e3 * places[stress.argmax()] for stress in stresses[1:]]
    assert f"{ratios[0]:.3f}, {ratios[1]:.3f}, 1.035" in text
    assert f"{peaks[0]:.2f}, {peaks[1]:.2f}, 0.98 mm ahead" in text


def test_the_page_on_arrays_runs(folder, run):
    assert "T09" in follow("arrays.md", run)["calibrate"].out
    assert (folder / "grid.png").is_file()
    names = run_examples("arrays.md")
    assert np.all(names["gain"] > 1.015 * names["array"].conversion_constants)
    contacts = names["contacts"]
    scan = names["scan"]
    off = [contacts.x - scan.x[10:19], contacts.y - scan.y[14], contacts.force - 1.0]
    u = np.sqrt(np.diagonal(contacts.covariance, axis1=1, axis2=2))
    assert np.abs(off / u.T).max() < 4.5
    assert len(names["found"]) == 9


def test_the_page_on_histories_runs(folder):
    history = run_examples("history.md")["history"]
    assert history.next_date > "2025-11-01"
    assert {"A", "sigma"} < set(history.quantities)


def test_the_page_on_plans_finds_the_repeats_that_it_names(folder, run):
    for line in blocks("plan_a_scan.md", "console")[1].splitlines():
        outcome = run(*shlex.split(line)[1:], "--json").exits(0)
    assert outcome.json["plan"]["repeats"] == 8
    assert (folder / "design.png").is_file()
    assert run_examples("plan_a_scan.md")["enough"].plan.repeats > 1


def test_the_examples_of_the_page_on_python_run(folder):
    shutil.copytree(SHIPPED, folder / "calibration_data")
    names = run_examples("api.md")
    assert names["apparatus"].gaussian_sigma == pytest.approx(561e-6, rel=0.05)
    assert names["sigma"] == pytest.approx(561e-6, rel=0.05)


def test_the_citation_names_the_version():
    citation = text_of(DOCS.with_name("CITATION.cff"))
    assert f"\nversion: {memscal.__version__}\n" in citation


def test_every_public_name_has_an_example_that_runs_and_a_place_in_the_reference():
    # The doctests of docstrings run where they stand.
    public = {name: getattr(memscal, name) for name in memscal.__all__ if name[0] != "_"}
    own = {name: thing for name, thing in public.items() if not isinstance(thing, UnionType)}
    assert [name for name, thing in own.items() if ">>>" not in (inspect.getdoc(thing) or "")] == []
    listed = re.findall(r"^   (\w+)$", text_of(DOCS / "api.md"), re.MULTILINE)
    assert sorted(listed) == sorted(public)


def test_pages_teach_public_names_only():
    rooms = [path.name for path in Path(memscal.__path__[0]).iterdir() if path.is_dir()]
    private = re.compile(rf"(?<!click:: )\bmemscal\.({'|'.join(rooms)})\.")
    pages = [*DOCS.glob("*.md"), DOCS.with_name("README.md")]
    found = [(page.name, name) for page in pages for name in private.findall(text_of(page))]
    assert found == []


def test_every_page_can_be_reached_from_the_start_page():
    start = text_of(DOCS / "index.md")
    linked = set(re.findall(r"\]\((\w+\.md)", start))
    trees = "".join(blocks("index.md", "{toctree}"))
    in_tree = {f"{name}.md" for name in re.findall(r"^(\w+)$", trees, re.MULTILINE)}
    written = {page.name for page in DOCS.glob("*.md")} - {"index.md"}
    assert (linked, in_tree) == (written, written)


def test_a_page_is_read_in_minutes():
    pages = {page: len(text_of(page).split()) for page in DOCS.glob("*.md")}
    front = [len(text_of(DOCS.with_name(name)).split()) for name in FRONT]
    assert {page.name: count for page, count in pages.items() if count > 1200} == {}
    assert front[0] <= 1300
    assert sum(pages.values()) + sum(front) <= 46_700


def test_the_methods_of_the_page_on_a_method_of_ones_own_calibrate(monkeypatch, capsys):
    monkeypatch.chdir(SHIPPED)
    monkeypatch.setattr("memscal.calibration.drawn_scatter.draw_count", lambda _: 3)
    names = run_examples("own_method.md")
    assert "(method richardson-lucy)" in capsys.readouterr().out
    with pytest.raises(FitError, match="not distinct from zero"):
        memscal.calibrate(names["scan"], method=names["UnsupervisedWiener"]())


@pytest.mark.filterwarnings("ignore:It is not known whether this device:FutureWarning")  # drivers
def test_the_recipe_with_pymeasure_records_a_scan_that_can_be_calibrated(
    tmp_path, monkeypatch, seed
):
    monkeypatch.chdir(tmp_path)
    scan = simulate(points=33, noise=0.0)
    bench = Bench(scan, noise=0.005 * scan.u_zz.max(), seed=seed)
    procedure, run, *_ = blocks("acquisition.md", "python")
    names = {"__name__": "recipe"}
    exec(compile(procedure, "acquisition.md", "exec"), names)
    names |= {"STAGE": bench.stage, "VOLTMETER": bench.voltmeter, "sleep": lambda _: None}
    exec(compile(run, "acquisition.md", "exec"), names)
    assert (bench.readings, bench.dragged, bench.enabled) == (2 * 33 * 10, 0, set())
    assert bench.position["2"] > 0  # the rod is left lifted
    for line in blocks("acquisition.md", "console")[1].strip().splitlines():
        assert main(shlex.split(line)[1:]) in (0, 1)
    found = memscal.load_apparatus("sensor.apparatus.h5").parameters
    for name in ("conversion_constant", "gaussian_sigma"):
        assert abs(found[name] - scan.synthetic[name]) < 5 * found.uncertainty(name)


def test_the_recipe_with_bluesky_stops_when_it_knows_enough_and_its_files_are_imported(
    tmp_path, monkeypatch, seed
):
    monkeypatch.chdir(tmp_path)
    plan, settings, run, files = blocks("acquisition.md", "python")[2:]
    names = {}
    for block in (plan, settings, files):
        exec(compile(block, "acquisition.md", "exec"), names)
    made = simulate(rod=names["rod"], half_range=12e-3, points=193, noise=0.0, **names["known"])
    random = np.random.default_rng(seed)
    stage, lift = (SynAxis(name=name) for name in ("stage", "lift"))

    def read():
        volts = np.interp(1e-3 * stage.position, made.x, made.u_zz)
        noise = 0.005 * made.u_zz.max() * random.standard_normal()
        return 1e3 * (volts + noise) * (lift.position == 0)

    names |= {
        "stage": stage,
        "lift": lift,
        "sensor": SynSignal(func=read, name="sensor"),
        "REST": 0,
    }
    exec(compile(run, "acquisition.md", "exec"), names)
    assert lift.position > 0
    places = memscal.acquire.positions(names["planned"])
    recorded = names["live"].scan()
    np.testing.assert_allclose(recorded.x, places[: recorded.x.size], atol=1e-12)
    found = names["live"].result.apparatus.parameters
    u = found.uncertainty("conversion_constant")
    a = found["conversion_constant"]
    assert abs(a - 1e-7) < 5 * u
    # Of a hundred runs one or two end without what they want.
    assert u <= 0.03 * a or recorded.x.size == places.size
    for line in blocks("acquisition.md", "console")[3].strip().splitlines():
        assert main(shlex.split(line)[1:]) == 0
    for name in ("from_table.h5", "from_file.h5"):
        scan = memscal.read_scan(name)
        np.testing.assert_allclose(
            [scan.x, scan.u_zz], [recorded.x, recorded.u_zz], rtol=1e-9, atol=1e-15
        )


def test_notebooks_are_stored_with_outputs_and_nothing_of_a_machine():
    books = {book: text_of(book) for book in NOTEBOOKS.glob("*.ipynb")}
    for book, text in books.items():
        assert text.count('"image/png": "') > 3, book.name
        words = re.sub(r'"image/png": "[^"]*"', "", text)
        assert set(re.findall(r'"execution_count": (\w+)', words)) == {"null"}
        local = r"/tmp|/home|/root|/Users|0x[0-9a-f]{6}|\d\d:\d\d:\d\d|\"execution\"|\"version\""
        assert re.findall(local, words) == []
    assert sum(len(text) for text in books.values()) < 2e6


def test_every_picture_is_there_with_words_and_made_by_a_command_or_script_of_the_page():
    readme = text_of(DOCS.with_name("README.md"))
    page = text_of(DOCS / "gallery.md")
    shown = re.findall(r"!\[(.+)\]\(images/([\w-]+)\.png\)", page)
    commands = "".join(blocks("gallery.md", "console"))
    assert len(shown) >= 15
    for caption, name in shown:
        assert len(caption) > 20
        assert f"{name}.png" in commands or name in figure_stems(["dry"], interface=True)
    stored = {path.stem for path in (DOCS / "images").glob("*.png")}
    assert stored == {name for _, name in shown} | {"overview"}
    assert "](docs/images/overview.png)" in readme
    assert sum(path.stat().st_size for path in (DOCS / "images").iterdir()) < 1.5e6
