"""Each notebook is a pair: a script that is edited and reviewed, and a notebook that is read."""

from pathlib import Path

import jupytext

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"


def cells(path: Path) -> list[tuple[str, str]]:
    return [(cell.cell_type, cell.source) for cell in jupytext.read(path).cells]


def test_every_notebook_has_its_script_and_says_the_same() -> None:
    scripts = {path.stem: path for path in NOTEBOOKS.glob("*.py")}
    books = {path.stem: path for path in NOTEBOOKS.glob("*.ipynb")}
    assert books
    assert scripts.keys() == books.keys()
    for name, script in scripts.items():
        assert cells(script) == cells(books[name]), f"jupytext --sync notebooks/{name}.py"
