"""What the documentation says is so: numbers, messages, examples; notebooks are their scripts."""

import doctest
import inspect
import re
import runpy
import shlex
import shutil
from pathlib import Path

import jupytext
import nbformat
import pytest
from helpers.bench import Bench
from helpers.scans import simulate

import memscal
from memscal.cli import main
from memscal.cli.commands import memscal as program
from memscal.cli.compare import figure_stems

DOCS = Path(__file__).parent.parent / "docs"
NOTEBOOKS = DOCS.with_name("notebooks")


@pytest.mark.parametrize("poisson_ratio", [0.5, 0.495])
def test_the_table_of_the_paper_s_sphere_is_what_its_script_prints(poisson_ratio: float) -> None:
    rows = runpy.run_path(str(DOCS / "sphere_table.py"))["table"](poisson_ratio)
    printed = (DOCS / "mechanics.md").read_text(encoding="utf-8")
    section = printed.split(f"### ν = {poisson_ratio}\n")[1].split("###")[0]
    stated = [line for line in section.splitlines() if line.startswith("|")]
    assert len(stated) == len(rows) == 38
    for line, row in zip(stated[2:], rows[2:], strict=True):
        # Another processor may round the last digit differently.
        ours, theirs = ([cell.split("/") for cell in text.split("|")[3:7]] for text in (row, line))
        assert line.split("|")[1:3] == row.split("|")[1:3]
        for mine, its in zip(ours, theirs, strict=True):
            assert [float(x) for x in its] == pytest.approx([float(x) for x in mine], rel=7e-4)


def cells(path: Path) -> list[tuple[str, str]]:
    return [(cell.cell_type, cell.source) for cell in jupytext.read(path).cells]


def test_every_notebook_has_its_script_and_says_the_same() -> None:
    scripts = {path.stem: path for path in NOTEBOOKS.glob("*.py")}
    books = {path.stem: path for path in NOTEBOOKS.glob("*.ipynb")}
    assert books
    assert scripts.keys() == books.keys()
    for name, script in scripts.items():
        assert cells(script) == cells(books[name]), f"jupytext --sync notebooks/{name}.py"


def blocks(page: str, language: str) -> list[str]:
    """Return the blocks of code of a page."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def test_every_message_of_the_troubleshooting_page_is_one_that_memscal_gives() -> None:
    page = (DOCS / "troubleshooting.md").read_text(encoding="utf-8")
    quoted = re.findall(r"^\| `(.+?)`", page, flags=re.MULTILINE)
    assert len(quoted) > 20
    package = Path(memscal.__path__[0])
    sources = "".join(path.read_text(encoding="utf-8") for path in package.rglob("*.py"))
    joined = re.sub(r'"\s+f?"', "", sources)  # a text over several lines
    filled = re.sub("…+", "…", re.sub(r"\{[^{}]*\}", "…", joined))
    assert [message for message in quoted if message not in filled] == []


def test_every_option_in_the_documentation_exists() -> None:
    unknown = []
    for page in (*DOCS.glob("*.md"), DOCS.with_name("README.md")):
        text = page.read_text(encoding="utf-8").replace("\\\n", "")
        for line in re.findall(r"^memscal .*", text, flags=re.MULTILINE):
            name, *arguments = shlex.split(line.split(" > ")[0], comments=True)[1:]
            command = program.get_command(None, name)
            known = {option for p in command.params for option in p.opts} if command else set()
            given = {word for word in arguments if re.match("--?[a-z]", word)}
            unknown += [(page.name, line, option) for option in given - known]
    assert unknown == []


def test_the_page_on_tables_imports_the_shipped_ones(tmp_path: Path, monkeypatch) -> None:
    for table in DOCS.with_name("calibration_data").glob("tables/*.csv"):
        shutil.copy(table, tmp_path)
    monkeypatch.chdir(tmp_path)
    for line in "".join(blocks("import_tables.md", "console")).splitlines():
        assert main(shlex.split(line)[1:]) == 0, line


def test_the_citation_names_the_version() -> None:
    citation = DOCS.with_name("CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {memscal.__version__}\n" in citation


def test_every_public_name_has_an_example_that_runs_and_a_place_in_the_reference() -> None:
    # The doctests of docstrings run where they stand; those of the page of results run here.
    page = (DOCS / "results.md").read_text(encoding="utf-8")
    shown = {
        name
        for names in re.findall(r"^### (.*)$", page, re.MULTILINE)
        for name in names.split(", ")
    }
    test = doctest.DocTestParser().get_doctest(
        "\n".join(blocks("results.md", "python")), {}, "docs/results.md", None, 0
    )
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    assert runner.run(test, clear_globs=False).failed == 0
    public = {name: getattr(memscal, name) for name in memscal.__all__ if name[0] != "_"}
    own = {name for name, thing in public.items() if ">>>" in (inspect.getdoc(thing) or "")}
    assert set(public) - own - shown == set()
    made = {type(value) for value in test.globs.values()}
    classes = {thing for name, thing in public.items() if name in shown - own}
    concrete = {c for c in classes if isinstance(c, type) and not getattr(c, "_is_protocol", False)}
    assert {c for c in concrete if not any(issubclass(each, c) for each in made)} == set()
    listed = re.findall(r"^   (\w+)$", (DOCS / "api.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(public)


def test_the_methods_of_the_page_on_a_method_of_ones_own_calibrate(monkeypatch, capsys) -> None:
    monkeypatch.chdir(DOCS.with_name("calibration_data"))
    names: dict[str, object] = {"__name__": "own_method"}
    for block in blocks("own_method.md", "python"):
        exec(compile(block, "own_method.md", "exec"), names)
    assert "(method richardson-lucy)" in capsys.readouterr().out
    spiked = memscal.calibrate(names["scan"], method=names["UnsupervisedWiener"]()).apparatus
    assert [c.name for c in spiked.checks if not c.passed and c.name.startswith("shape_")]


@pytest.mark.filterwarnings("ignore:It is not known whether this device:FutureWarning")  # drivers
def test_the_recipe_with_pymeasure_records_a_scan_that_can_be_calibrated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.chdir(tmp_path)
    scan = simulate(points=33, noise=0.0)
    bench = Bench(scan, noise=0.005 * scan.u_zz.max(), seed=seed)
    procedure, run = blocks("acquisition.md", "python")
    names: dict[str, object] = {"__name__": "recipe"}
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


def test_notebooks_are_stored_with_outputs_and_nothing_of_a_machine() -> None:
    books = {book: book.read_text(encoding="utf-8") for book in NOTEBOOKS.glob("*.ipynb")}
    for book, text in books.items():
        assert text.count('"image/png": "') > 3, book.name
        words = re.sub(r'"image/png": "[^"]*"', "", text)
        assert set(re.findall(r'"execution_count": (\w+)', words)) == {"null"}
        local = r"/tmp|/home|/root|/Users|0x[0-9a-f]{6}|\d\d:\d\d:\d\d|\"execution\"|\"version\""
        assert re.findall(local, words) == []
    assert sum(len(text) for text in books.values()) < 2e6


def test_a_stored_output_differs_by_a_word_a_line_or_more_than_the_last_digit_of_a_number() -> None:
    differences = runpy.run_path(str(DOCS / "store_notebooks.py"))["differences"]
    stored = ["A = 1.017e+00 mV", "all checks passed", "x = −3.21"]
    assert differences(stored, ["A = 1.016e+00 mV", "all checks passed", "x = −3.20"]) == []
    for line, other in ((0, "A = 1.1 mV"), (1, "all checks failed"), (2, "x = 3.21")):
        changed = [*stored[:line], other, *stored[line + 1 :]]
        assert len(differences(stored, changed)) == 1
    assert len(differences(stored, stored[:2])) == 1
    assert differences(stored[1:], stored) == ["+ A = 1.017e+00 mV"]


def test_what_a_kernel_sends_in_pieces_is_stored_as_one_text() -> None:
    kept = runpy.run_path(str(DOCS / "store_notebooks.py"))["kept"]

    def stream(text: str, name: str = "stdout") -> nbformat.NotebookNode:
        return nbformat.v4.new_output("stream", name=name, text=text)

    picture = nbformat.v4.new_output("display_data", {"text/plain": "<Figure>"})
    sent = [stream("all checks"), stream("a warning\n", "stderr"), stream(" passed"), stream("\n")]
    outputs = kept([*sent, picture, stream("x = 1\n")])
    assert outputs == [stream("all checks passed\n"), picture, stream("x = 1\n")]


def test_every_picture_is_there_with_words_and_made_by_a_command_or_script_of_the_page() -> None:
    readme = DOCS.with_name("README.md").read_text(encoding="utf-8")
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[(.+)\]\(images/([\w-]+)\.png\)", page)
    commands = "".join(re.findall(r"^```console\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    assert len(shown) >= 15
    for words, name in shown:
        assert len(words) > 20
        assert f"{name}.png" in commands or name in figure_stems(["dry"], interface=True)
    stored = {path.stem for path in (DOCS / "images").glob("*.png")}
    assert stored == {name for _, name in shown} | {"overview"}
    assert "](docs/images/overview.png)" in readme
    assert sum(path.stat().st_size for path in (DOCS / "images").iterdir()) < 1.5e6
