"""Golden views: what commands print as text, and the structure of the pages and figures they write.

Numbers are masked, for the golden outputs hold them; so are layout and coordinates.  After a change
on purpose, ``python tests/golden/views.py`` writes them anew: read the diff.
"""

import base64
import re
import shlex
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from html.parser import HTMLParser
from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree as ET

from golden.make import HERE, Runs

VIEWS = HERE / "views"
LINES = (HERE / "commands_of_views.txt").read_text(encoding="utf-8").splitlines()
VIEW_COMMANDS = {name: arguments for name, _, arguments in (line.partition(": ") for line in LINES)}

_NUMBER = re.compile(r"[-+−]?\d[\d.,]*(?:e[-+]?\d+)?|[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_TIMED = re.compile(r"\(\d+ s\)$")
_SVG = "{http://www.w3.org/2000/svg}"
#: Attributes of pages that say what an element is, or what a reader hears of it.
_ATTRIBUTES = ("class", "role", "aria-label", "alt", "scope", "lang", "http-equiv")
_UNSEEN = {"style", "script"}


def masked(text: str) -> str:
    """Return a line without its numbers, digests and spacing."""
    text = re.sub(r"\S{200,}|\b[0-9a-f]{64}\b|\b\d{4}-\d\d-\d\dT\S+", "#", text)
    # The number of a certificate is a part of its artifact's digest.
    text = re.sub(r"EXAMPLE-[0-9A-F]+", "EXAMPLE-#", text)
    text = re.sub(r"\b(nan|inf)\b", "#", _NUMBER.sub("#", text))
    return re.sub(r"[\s─-]+", " ", text).strip()


class _Page(HTMLParser):
    """Elements of a page with their words, a line each, and the structure of its figures."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.unseen = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.unseen = tag in _UNSEEN
        stated = [f"{key}={masked(value or '')}" for key, value in attrs if key in _ATTRIBUTES]
        self.lines.append(" ".join([f"<{tag}>", *stated]))
        kind, _, content = (dict(attrs).get("src") or "").partition(";base64,")
        if kind == "data:image/svg+xml":
            self.lines += figure_structure(base64.b64decode(content).decode("utf-8"))

    def handle_endtag(self, tag: str) -> None:
        self.unseen = False

    def handle_data(self, data: str) -> None:
        if not self.unseen and masked(data):
            self.lines.append(masked(data))


def page_structure(content: str) -> list[str]:
    """Return the elements of a page in their order, each with its words."""
    page = _Page()
    page.feed(content)
    return page.lines


def figure_structure(content: str) -> list[str]:
    """Return what each panel of a figure shows: its words, and how many elements of each kind."""
    lines = []
    for group in ET.fromstring(content).iter(f"{_SVG}g"):
        name = group.get("id", "")
        if not re.fullmatch(r"axes_\d+", name):
            continue
        kinds: Counter[str] = Counter()
        words = []
        for child in group.iter():
            kind = re.sub(r"_\d+$", "", child.get("id", ""))
            if child.tag == f"{_SVG}g" and kind:
                kinds[kind] += 1
            elif child.tag == f"{_SVG}text":
                text = masked("".join(child.itertext()))
                words += [text] if text.strip("# ") else []
        lines.append(f"{name}: {', '.join(f'{n} {kind}' for kind, n in sorted(kinds.items()))}")
        lines += [f"  {text}" for text in words]
    return lines


def xml_structure(content: str) -> list[str]:
    """Return the elements of an XML document with their words, a line each."""
    lines = []
    for element in ET.fromstring(content).iter():
        tag = element.tag.rpartition("}")[2]
        lines.append(f"<{tag}> {masked(element.text or '')}".rstrip())
    return lines


STRUCTURES = {".html": page_structure, ".svg": figure_structure, ".xml": xml_structure}


def view(name: str, runs: Runs) -> str:
    """Run a command; return what it printed and the structure of what it drew, as text."""
    before = set(runs.folder.rglob("*"))
    code, out, err = runs.run(shlex.split(VIEW_COMMANDS[name]))
    sections = [f"memscal {VIEW_COMMANDS[name]}", f"exit code {code}", "", "stdout"]
    sections += [masked(line) for line in out.splitlines()]
    # What says how long something took comes on a slow machine alone.
    messages = err.replace(str(runs.folder), "FOLDER").splitlines()
    sections += ["", "stderr", *(masked(line) for line in messages if not _TIMED.search(line))]
    for path in sorted(set(runs.folder.rglob("*")) - before):
        if path.suffix in STRUCTURES:
            content = path.read_text(encoding="utf-8")
            sections += ["", path.relative_to(runs.folder).as_posix()]
            sections += STRUCTURES[path.suffix](content)
    return "\n".join(_counted(sections)) + "\n"


def _counted(lines: list[str]) -> Iterator[str]:
    """Yield lines, runs of equal ones as one with their number."""
    for line, run in groupby(lines):
        count = len(list(run))
        yield line if count == 1 or not line else f"{line} ({count} times)"


def main() -> None:
    """Write the golden views."""
    VIEWS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(Path(folder))
        for name in sys.argv[1:] or VIEW_COMMANDS:
            (VIEWS / f"{name}.txt").write_text(view(name, runs), encoding="utf-8")


if __name__ == "__main__":
    main()
