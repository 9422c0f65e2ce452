"""Execute the notebooks and store them with their outputs, without times, paths and versions.

``python docs/store_notebooks.py`` writes them, with names only these; with ``--compare FOLDER`` it
compares what is stored with notebooks that were executed there, and fails where they differ.
"""

import base64
import io
import math
import re
import sys
from difflib import SequenceMatcher
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient
from PIL import Image

NOTEBOOKS = Path(__file__).resolve().parent.with_name("notebooks")
#: What an output may name of this machine: addresses of objects, folders for the time of a run.
LOCAL = re.compile(r" at 0x[0-9a-f]+|/(?:[\w.-]+/)*tmp[\w.-]*/")
NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def few_colours(image: Image.Image) -> Image.Image:
    """Return a picture with a palette of 256 colours, its own: a third of the bytes."""
    return image.quantize(method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)


def smaller(png: str) -> str:
    """Return a PNG (base64) of few colours, without metadata."""
    image = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    written = io.BytesIO()
    few_colours(image).save(written, "PNG", optimize=True)
    return base64.b64encode(written.getvalue()).decode()


def kept(outputs: list[nbformat.NotebookNode]) -> list[nbformat.NotebookNode]:
    """Return outputs as they are stored; progress and warnings are not.

    A kernel may send what a cell prints in several pieces, on a busy machine within a line.
    """
    chosen: list[nbformat.NotebookNode] = []
    for output in outputs:
        if output.output_type != "stream":
            chosen.append(output)
        elif output.name == "stdout" and chosen and chosen[-1].output_type == "stream":
            chosen[-1].text += output.text
        elif output.name == "stdout":
            chosen.append(output)
    for output in chosen:
        if output.output_type == "stream":
            output.text = LOCAL.sub("", output.text)
            continue
        output.metadata = {}
        if "execution_count" in output:
            output.execution_count = None
        for kind, content in output.get("data", {}).items():
            output.data[kind] = smaller(content) if "png" in kind else LOCAL.sub("", content)
    return chosen


def execute(script: Path) -> None:
    """Execute a notebook and write it beside its script."""
    book = script.with_suffix(".ipynb")
    notebook = jupytext.read(book)
    place = {"metadata": {"path": script.parent}}
    NotebookClient(notebook, timeout=1200, resources=place).execute()
    notebook.metadata.pop("language_info", None)
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.execution_count, cell.outputs = None, kept(cell.outputs)
    book.write_text(nbformat.writes(notebook) + "\n", encoding="utf-8")


def printed(book: Path) -> list[str]:
    """Return the lines of a notebook's outputs that are text."""
    cells = [c for c in jupytext.read(book).cells if c.cell_type == "code"]
    outputs = [output for cell in cells for output in kept(cell.outputs)]
    texts = [o.get("text") or o.get("data", {}).get("text/markdown", "") for o in outputs]
    return [line for text in texts for line in text.splitlines()]


def differences(stored: list[str], executed: list[str]) -> list[str]:
    """Return the lines that differ in a word, or in a number by more than 2 % and 0.02."""

    def words(line: str) -> str:
        return " ".join(NUMBER.sub("0", line).replace("-", "").split())

    def close(ours: str, theirs: str) -> bool:
        numbers = ([float(n.replace("−", "-")) for n in NUMBER.findall(x)] for x in (ours, theirs))
        pairs = zip(*numbers, strict=True)
        return all(math.isclose(a, b, rel_tol=0.02, abs_tol=0.02) for a, b in pairs)

    found = []
    matcher = SequenceMatcher(None, [*map(words, stored)], [*map(words, executed)], autojunk=False)
    for tag, first, last, start, stop in matcher.get_opcodes():
        ours, theirs = stored[first:last], executed[start:stop]
        if tag == "equal":
            pairs = zip(ours, theirs, strict=True)
            found += [f"- {a}\n+ {b}" for a, b in pairs if not close(a, b)]
        else:
            found.append("\n".join([*(f"- {a}" for a in ours), *(f"+ {b}" for b in theirs)]))
    return found


if __name__ == "__main__":
    if sys.argv[1:2] == ["--compare"]:
        found = [
            f"{book.name}:\n{difference}"
            for book in sorted(NOTEBOOKS.glob("*.ipynb"))
            for difference in differences(printed(book), printed(Path(sys.argv[2], book.name)))
        ]
        if found:
            sys.exit("\n".join([*found, "Run python docs/store_notebooks.py, and read the diff."]))
    else:
        for path in sorted(NOTEBOOKS.glob("*.py")):
            if len(sys.argv) == 1 or path.stem in sys.argv[1:]:
                execute(path)
