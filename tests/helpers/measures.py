"""Measures of source code: tokens, statements, and what makes either hard to read."""

import ast
import io
import tokenize
from collections import Counter
from pathlib import Path

NOT_READ = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}
"""Kinds of tokens that stand for layout and comments."""

LONGEST_FUNCTION = 60
"""Lines of code that fit on a screen."""


def measures(path: Path) -> Counter[str]:
    """Count what there is to read in a file, docstrings and comments left out."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    docstrings = set(_docstrings(tree))
    counted = Counter[str]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        counted["tokens"] += token.type not in NOT_READ and token.start not in docstrings
    counted["unformatted"] = sum(
        "fmt: skip" in line or "fmt: off" in line for line in text.splitlines()
    )
    for node in ast.walk(tree):
        counted["statements"] += isinstance(node, ast.stmt)
        counted["walrus"] += isinstance(node, ast.NamedExpr)
        counted["parallel"] += isinstance(node, ast.Assign) and _is_parallel(node)
        if isinstance(node, ast.FunctionDef):
            counted["long_functions"] += _length(node) > LONGEST_FUNCTION
    return counted


def most_arguments(path: Path) -> int:
    """Return the number of arguments of the function that takes most."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node.args for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    counts = (len(a.posonlyargs) + len(a.args) + len(a.kwonlyargs) for a in functions)
    return max(counts, default=0)


def _docstrings(tree):
    """Yield where docstrings start."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(
            node
        ):
            yield node.body[0].lineno, node.body[0].col_offset


def _is_parallel(node):
    targets = any(isinstance(target, ast.Tuple) for target in node.targets)
    return targets and isinstance(node.value, ast.Tuple)


def _length(node):
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0
