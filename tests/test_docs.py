"""Numbers in the documentation are those that memscal calculates; notebooks are their scripts."""

import runpy
from pathlib import Path

import jupytext
import pytest

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
