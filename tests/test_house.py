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
    "version", "errors", "threads", "model", "axisymmetry", "mechanics", "deconvolution",
    "estimation", "apparatus", "calibration", "laboratory", "measurement", "friction", "planning",
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
LONGEST = 320


def room(module: str) -> str:
    """The folder, or the module at the top, that a module of ours belongs to."""
    return [*module.split("."), "__init__"][1]


def imported(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
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


@pytest.fixture(params=MODULES, scope="module")
def module(request: pytest.FixtureRequest) -> tuple[str, str]:
    """A module's room and its source."""
    name: str = request.param
    return room(name), MODULES[name].read_text(encoding="utf-8")


def test_imports_point_only_to_earlier_rooms(module: tuple[str, str]) -> None:
    importer, source = module
    if importer == "__init__":
        return
    ours = {room(name) for name in imported(ast.parse(source)) if name.startswith("memscal.")}
    assert ours <= allowed_rooms(importer)


def test_each_library_stays_in_its_room(module: tuple[str, str]) -> None:
    importer, source = module
    libraries = {name.split(".")[0] for name in imported(ast.parse(source))}
    assert {
        library for library in libraries if importer not in ONLY_IN.get(library, {importer})
    } == set()


def test_slow_libraries_are_imported_only_when_needed(module: tuple[str, str]) -> None:
    importer, source = module
    at_import_time = [
        node for node in ast.parse(source).body if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    names = set(imported(ast.Module(body=list(at_import_time), type_ignores=[])))
    own = {library for library, rooms in ONLY_IN.items() if importer in rooms == {"figures"}}
    assert (names & SLOW) - own == set()


def test_a_module_is_short_enough_to_hold_in_the_head(module: tuple[str, str]) -> None:
    assert len(module[1].splitlines()) <= LONGEST


def test_no_public_name_is_hidden_by_a_module_of_that_name() -> None:
    # Importing memscal.indent, were there such a module, would replace the function memscal.indent.
    at_the_top = {room(name) for name in MODULES}
    assert at_the_top.isdisjoint(memscal.__all__)
