"""Every quality check is explained, in the program as in the documentation."""

import re
from pathlib import Path

import memscal
from memscal.model.checks import EXPLANATIONS

ROOT = Path(__file__).parents[2]
DECLARED = re.compile(r"\b(?:check|reduced_check|_added|_tested)\(\s*f?\"(\w+?)(?:_?\{(\w*)|\")")


def test_every_check_that_is_declared_is_explained():
    sources = (path.read_text() for path in Path(memscal.__path__[0]).rglob("*.py"))
    names = {match[1] for source in sources for match in DECLARED.finditer(source)}
    assert len(names) > 25
    assert names - EXPLANATIONS.keys() - {"held_out"} == set()


def test_the_documentation_explains_checks_in_the_same_words():
    pages = [ROOT / "docs" / "quality.md", ROOT / "docs" / "arrays.md", ROOT / "docs" / "motion.md"]
    rows = "\n".join(page.read_text(encoding="utf-8") for page in pages).splitlines()
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows if "| `" in row]
    assert {row[0].strip("`"): (row[1], row[3]) for row in cells} == EXPLANATIONS
