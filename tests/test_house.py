"""The package keeps to its own plan: who may import what, and how long a module may be."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import memscal

PACKAGE = Path(memscal.__path__[0])
MODULES = {
    ".".join(("memscal", *path.relative_to(PACKAGE).with_suffix("").parts)): path
    for path in sorted(PACKAGE.rglob("*.py"))
}

FLOW = [
    "version", "errors", "threads", "model", "axisymmetry", "mechanics", "estimation",
    "deconvolution", "apparatus", "calibration", "laboratory", "measurement", "friction",
    "planning",
    "figures", "cli", "__main__",
]  # fmt: skip
"""The rooms in the order in which data passes them; a room imports only from those before it."""

USERS_OF_FORMATS = {"apparatus", "calibration", "figures", "cli", "friction", "measurement"}

ONLY_IN = {
    "h5py": {"formats"},
    "pint": {"formats"},
    "meshio": {"formats"},
    "matplotlib": {"figures"},
    "click": {"cli"},
    "rich": {"cli"},
    "skimage": {"deconvolution"},
    "skfem": {"mechanics"},
}

SLOW = {
    "matplotlib", "meshio", "pint", "skfem", "skimage",
    "scipy.interpolate", "scipy.optimize", "scipy.signal", "scipy.stats",
}  # fmt: skip
LONGEST = 600


def room(module: str) -> str:
    """The folder, or the module at the top, that a module of ours belongs to."""
    return [*module.split("."), "__init__"][1]


LATE = {"save"}
"""Methods by which a result uses what stands above it: they import it when they are called."""


def early(tree: ast.AST) -> Iterator[ast.AST]:
    """Every node that is not within a late method."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.FunctionDef) and node.name in LATE):
            yield node
            yield from early(node)


def imported(tree: ast.AST) -> Iterator[str]:
    for node in early(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            # "from memscal import model" names the room in the alias, not in the module.
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def allowed_rooms(importer: str) -> set[str]:
    if importer == "formats":
        return {"version", "errors", "threads", "model", "formats"}
    earlier = set(FLOW[: FLOW.index(importer) + 1])
    return earlier | ({"formats"} if importer in USERS_OF_FORMATS else set())


@pytest.fixture(scope="module")
def sources() -> dict[str, str]:
    """The source of every module, by name."""
    return {name: path.read_text(encoding="utf-8") for name, path in MODULES.items()}


@pytest.fixture(scope="module")
def trees(sources: dict[str, str]) -> dict[str, ast.Module]:
    return {name: ast.parse(source) for name, source in sources.items()}


def test_imports_point_only_to_earlier_rooms(trees: dict[str, ast.Module]) -> None:
    wrong = {
        name: rooms - allowed_rooms(room(name))
        for name, tree in trees.items()
        if room(name) != "__init__"
        and not (rooms := {room(other) for other in imported(tree) if other.startswith("memscal.")})
        <= allowed_rooms(room(name))
    }
    assert wrong == {}


def test_each_library_stays_in_its_room(trees: dict[str, ast.Module]) -> None:
    wrong = [
        (name, library)
        for name, tree in trees.items()
        for library in {other.split(".")[0] for other in imported(tree)}
        if room(name) not in ONLY_IN.get(library, {room(name)})
    ]
    assert wrong == []


def test_slow_libraries_are_imported_only_when_needed(trees: dict[str, ast.Module]) -> None:
    wrong = []
    for name, tree in trees.items():
        at_import_time = [
            node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)
        ]
        names = set(imported(ast.Module(body=list(at_import_time), type_ignores=[])))
        own = {library for library, rooms in ONLY_IN.items() if room(name) in rooms == {"figures"}}
        wrong += [(name, library) for library in (names & SLOW) - own]
    assert wrong == []


def test_a_module_is_short_enough_to_hold_in_the_head(sources: dict[str, str]) -> None:
    lengths = {name: len(source.splitlines()) for name, source in sources.items()}
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}


def test_no_public_name_is_hidden_by_a_module_of_that_name() -> None:
    # Importing memscal.indent, were there such a module, would replace the function memscal.indent.
    at_the_top = {room(name) for name in MODULES}
    assert at_the_top.isdisjoint(memscal.__all__)
