"""The package keeps to its own plan: who may import what, and how long a module may be."""

import ast
import re
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
    "version", "errors", "parallel", "progress", "model", "axisymmetry", "mechanics", "estimation",
    "deconvolution", "apparatus", "calibration", "simulation", "measurement", "friction",
    "planning", "summaries", "figures", "certificate", "cli", "__main__",
]  # fmt: skip
"""The rooms in the order in which data passes them; a room imports only from those before it."""

USERS_OF_FORMATS = {
    "apparatus",
    "calibration",
    "certificate",
    "figures",
    "cli",
    "friction",
    "measurement",
}

ONLY_IN = {
    "h5py": {"formats"}, "pint": {"formats"}, "meshio": {"formats"}, "matplotlib": {"figures"},
    "click": {"cli"}, "skimage": {"deconvolution"}, "skfem": {"mechanics"}, "pyarrow": {"formats"},
    "openpyxl": {"formats"}, "distributed": {"parallel"}, "weasyprint": {"certificate"},
}  # fmt: skip

SLOW = {
    "distributed", "matplotlib", "meshio", "openpyxl", "pint", "pyarrow", "skfem", "skimage",
    "scipy.interpolate", "scipy.optimize", "scipy.signal", "scipy.stats", "weasyprint",
}  # fmt: skip
LONGEST = 600
SHORT = 120
MOST_MODULES = 187
MOST_LINES = 41_950
MOST_LINES_OF_TESTS = 27_800
SHORT_WITH_ONE_IMPORTER = {
    "memscal.cli.commands": "asking for help imports it and nothing that a command needs"
}
"""Modules that are short and have a single importer, each with the reason why it stands alone."""

ONE_ROLE = {"cli", "figures", "summaries", "formats"}
"""Rooms in which a module may have the name of what it shows, reads or commands."""


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


def without_types(tree: ast.Module) -> ast.Module:
    """Leave out what is imported for annotations only."""
    tests = [(node, node.test) for node in tree.body if isinstance(node, ast.If)]
    left_out = [node for node, test in tests if ast.unparse(test) == "TYPE_CHECKING"]
    return ast.Module([node for node in tree.body if node not in left_out], type_ignores=[])


def allowed_rooms(importer: str) -> set[str]:
    if importer == "formats":
        return {"version", "errors", "parallel", "progress", "model", "formats"}
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
    wrong = []
    for name in (name for name in trees if room(name) != "__init__"):
        rooms = {room(other) for other in imported(trees[name]) if other.startswith("memscal.")}
        wrong += [(name, other) for other in rooms - allowed_rooms(room(name))]
    assert wrong == []


def test_each_library_stays_in_its_room(trees: dict[str, ast.Module]) -> None:
    wrong = [
        (name, library)
        for name, tree in trees.items()
        for library in {other.split(".")[0] for other in imported(without_types(tree))}
        if room(name) not in ONLY_IN.get(library, {room(name)})
    ]
    assert wrong == []


def test_slow_libraries_are_imported_only_when_needed(trees: dict[str, ast.Module]) -> None:
    wrong = []
    for name, tree in trees.items():
        at_once = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        names = set(imported(ast.Module(body=list(at_once), type_ignores=[])))
        own = {library for library, rooms in ONLY_IN.items() if room(name) in rooms == {"figures"}}
        wrong += [(name, library) for library in (names & SLOW) - own]
    assert wrong == []


def test_a_module_is_short_enough_to_hold_in_the_head(sources: dict[str, str]) -> None:
    lengths = {name: len(source.splitlines()) for name, source in sources.items()}
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}


def test_the_house_is_small(sources: dict[str, str]) -> None:
    assert len(sources) <= MOST_MODULES
    assert sum(len(source.splitlines()) for source in sources.values()) <= MOST_LINES
    tests = Path(__file__).parent.rglob("*.py")
    assert sum(len(path.read_text().splitlines()) for path in tests) <= MOST_LINES_OF_TESTS


def test_the_map_of_the_house_has_a_line_for_every_room() -> None:
    contributing = Path(__file__).parents[1] / "CONTRIBUTING.md"
    lines = re.findall(r"^- `([\w/.]+)`: ", contributing.read_text(encoding="utf-8"), re.MULTILINE)
    folders = {path.parent for path in PACKAGE.rglob("__init__.py")} - {PACKAGE}
    rooms = {f"{folder.relative_to(PACKAGE).as_posix()}/" for folder in folders}
    assert sorted(lines) == sorted(rooms | {path.name for path in PACKAGE.glob("*.py")})


@pytest.fixture(scope="module")
def arrows(trees: dict[str, ast.Module]) -> dict[str, set[str]]:
    """The modules of ours that each module imports, wherever in it the import stands."""
    packages = {name.removesuffix(".__init__") for name in trees}
    return {
        name: {other for other in imported(tree) if other in packages} - {"memscal", name}
        for name, tree in trees.items()
        if not name.endswith("__init__")
    }


def test_no_modules_import_each_other_in_a_circle(arrows: dict[str, set[str]]) -> None:
    left = dict(arrows)
    while free := [name for name in left if not left[name] & set(left)]:
        for name in free:
            del left[name]
    assert {name: sorted(left[name] & set(left)) for name in left} == {}


def test_a_short_module_serves_several_others(arrows, sources: dict[str, str]) -> None:
    importers = {name: [other for other in arrows if name in arrows[other]] for name in arrows}
    alone = {name for name in arrows if len(importers[name]) == 1}
    short = {name for name in alone if len(sources[name].splitlines()) < SHORT}
    assert short == set(SHORT_WITH_ONE_IMPORTER)


def test_a_name_stands_for_one_thing(trees: dict[str, ast.Module]) -> None:
    owners: dict[str, list[str]] = {}
    for name in trees:
        if room(name) not in ONE_ROLE and not name.endswith("__init__"):
            owners.setdefault(name.rpartition(".")[2], []).append(name)
    assert {name: found for name, found in owners.items() if len(found) > 1} == NAMESAKES


NAMESAKES = {
    "apparatus": ["memscal.apparatus", "memscal.model.apparatus"],  # its methods, and its data
    "checks": ["memscal.calibration.checks", "memscal.friction.checks", "memscal.model.checks"],
}
"""One subject in several rooms: what is computed with the records of the model."""


def test_no_module_merely_hands_names_on(trees: dict[str, ast.Module]) -> None:
    own = (ast.FunctionDef, ast.ClassDef, ast.Assign, ast.AnnAssign)
    idle = []
    for name in (name for name in trees if not name.endswith(("__init__", "__main__"))):
        defined = [ast.unparse(node) for node in trees[name].body if isinstance(node, own)]
        idle += [] if any("__all__" not in source[:10] for source in defined) else [name]
    assert idle == []


def test_no_public_name_is_hidden_by_a_module_of_that_name() -> None:
    # Importing memscal.indent, were there such a module, would replace the function memscal.indent.
    at_the_top = {room(name) for name in MODULES}
    assert at_the_top.isdisjoint(memscal.__all__)
