"""The house keeps to its plan: who may import what; and to its budget of what there is to read."""

import ast
import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from helpers.measures import measures, most_arguments

import memscal
from memscal import extensions

PACKAGE = Path(memscal.__path__[0])
TESTS = Path(__file__).parent
MODULES = {
    ".".join(("memscal", *path.relative_to(PACKAGE).with_suffix("").parts)): path
    for path in sorted(PACKAGE.rglob("*.py"))
}
BUDGET = tomllib.loads((TESTS / "house_budget.toml").read_text(encoding="utf-8"))

FLOW = [
    "version",
    "errors",
    "parallel",
    "progress",
    "model",
    "readings",
    "axisymmetry",
    "mechanics",
    "estimation",
    "deconvolution",
    "apparatus",
    "calibration",
    "measurement",
    "friction",
    "summaries",
    "figures",
    "cli",
    "extensions",
    "acquire",
    "__main__",
]
"""The rooms in the order in which data passes them; a room imports only from those before it."""

USERS_OF_FORMATS = {
    "apparatus",
    "calibration",
    "cli",
    "extensions",
    "figures",
    "friction",
    "measurement",
}

TABLE = "memscal.extensions"
"""The table of extensions holds names as text: every room may read it."""

ONLY_IN = {
    "click": {"cli", "extensions"},
    "distributed": {"parallel"},
    "h5py": {"formats"},
    "loky": {"parallel"},
    "matplotlib": {"figures", "extensions"},
    "meshio": {"extensions"},
    "openpyxl": {"formats"},
    "pint": {"formats"},
    "pyarrow": {"formats", "extensions"},
    "skfem": {"mechanics", "extensions"},
    "skimage": {"deconvolution"},
    "typst": {"extensions"},
}

SLOW = {
    "distributed",
    "loky",
    "matplotlib",
    "meshio",
    "openpyxl",
    "pint",
    "pyarrow",
    "scipy.interpolate",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "skfem",
    "skimage",
    "typst",
}

ONE_ROLE = {"cli", "extensions", "figures", "formats", "summaries"}
"""Rooms in which a module may have the name of what it shows, reads or commands."""

NAMESAKES = {
    "apparatus": ["memscal.apparatus", "memscal.model.apparatus"],  # its methods, and its data
    "assumptions": ["memscal.calibration.assumptions", "memscal.model.assumptions"],
    "checks": ["memscal.calibration.checks", "memscal.friction.checks", "memscal.model.checks"],
}
"""One subject in several rooms: what is computed with the records of the model."""


def room(module):
    """The folder, or the module at the top, that a module of ours belongs to."""
    return [*module.split("."), "__init__"][1]


def extension(module):
    """The extension that a module belongs to; empty for the core."""
    parts = module.split(".")
    return parts[2] if parts[1] == "extensions" and len(parts) > 3 else ""


def imported(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            # "from memscal import model" names the room in the alias, not in the module.
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def without_types(tree):
    """Leave out what is imported for annotations only."""
    tests = [(node, node.test) for node in tree.body if isinstance(node, ast.If)]
    left_out = [node for node, test in tests if ast.unparse(test) == "TYPE_CHECKING"]
    return ast.Module([node for node in tree.body if node not in left_out], type_ignores=[])


def allowed_rooms(importer):
    if importer == "formats":
        return {*FLOW[: FLOW.index("readings") + 1], "formats"}
    earlier = set(FLOW[: FLOW.index(importer) + 1])
    return earlier | ({"formats"} if importer in USERS_OF_FORMATS else set())


@pytest.fixture(scope="module")
def trees():
    return {name: ast.parse(path.read_text("utf-8")) for name, path in MODULES.items()}


@pytest.fixture(scope="module")
def arrows(trees):
    """The modules of ours that each module imports, wherever in it and for whatever use."""
    modules = {name.removesuffix(".__init__") for name in trees}
    return {
        name: {other for other in imported(tree) if other in modules} - {"memscal", TABLE, name}
        for name, tree in trees.items()
        if name not in ("memscal.__init__", f"{TABLE}.__init__")
    }


def test_imports_point_only_to_earlier_rooms(arrows):
    wrong = []
    for name, others in arrows.items():
        rooms = {room(other) for other in others}
        wrong += [(name, other) for other in rooms - allowed_rooms(room(name))]
    assert wrong == []


def test_an_extension_imports_no_other_one_but_those_that_the_table_names(arrows):
    wrong = []
    for name, others in arrows.items():
        own = extension(name)
        used = {extension(other) for other in others} - {"", own}
        wrong += [(name, other) for other in used - set(extensions.USES.get(own, ()))]
    assert wrong == []


def test_the_table_names_what_there_is():
    for name, (module, _) in extensions.COMMANDS.items():
        assert extensions.module(module).command.name == name
    for summary, figure in extensions.VIEWS.values():
        if summary:
            assert callable(extensions.module(summary).tables)
        if figure:
            module, _, function = figure.rpartition(".")
            assert callable(getattr(extensions.module(module), function))
    for name in extensions.HOOKS:
        assert callable(extensions.hook(name))


def test_public_names_are_those_that_the_stub_states_for_type_checkers():
    stub = (PACKAGE / "__init__.pyi").read_text(encoding="utf-8")
    stated = re.findall(r"^from \.([\w.]+) import (\w+) as \2$", stub, re.MULTILINE)
    assert sorted(memscal.__all__) == sorted(name for _, name in stated)
    for module, name in stated:
        assert getattr(memscal, name) is getattr(extensions.module(module), name)


def test_each_library_stays_in_its_room(trees):
    wrong = [
        (name, library)
        for name, tree in trees.items()
        for library in {other.split(".")[0] for other in imported(without_types(tree))}
        if room(name) not in ONLY_IN.get(library, {room(name)})
    ]
    assert wrong == []


def test_slow_libraries_are_imported_only_when_needed(trees):
    wrong = []
    for name, tree in trees.items():
        at_once = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        libraries = set(imported(ast.Module(body=list(at_once), type_ignores=[]))) & SLOW
        if room(name) == "figures" or name.endswith("figure"):
            libraries -= {"matplotlib"}
        wrong += [(name, library) for library in libraries]
    assert wrong == []


def test_no_modules_import_each_other_in_a_circle(arrows):
    left = dict(arrows)
    while free := [name for name in left if not left[name] & set(left)]:
        for name in free:
            del left[name]
    assert {name: sorted(left[name] & set(left)) for name in left} == {}


def test_a_name_stands_for_one_thing(trees):
    owners = {}
    for name in trees:
        if room(name) not in ONE_ROLE and not name.endswith("__init__"):
            owners.setdefault(name.rpartition(".")[2], []).append(name)
    assert {name: found for name, found in owners.items() if len(found) > 1} == NAMESAKES


def test_no_module_merely_hands_names_on(trees):
    own = (ast.FunctionDef, ast.ClassDef, ast.Assign, ast.AnnAssign)
    idle = []
    for name in (name for name in trees if not name.endswith(("__init__", "__main__"))):
        defined = [ast.unparse(node) for node in trees[name].body if isinstance(node, own)]
        idle += [] if any("__all__" not in source[:10] for source in defined) else [name]
    assert idle == []


def test_no_public_name_is_hidden_by_a_module_of_that_name():
    # Importing memscal.indent, were there such a module, would replace the function memscal.indent.
    at_the_top = {room(name) for name in MODULES}
    assert at_the_top.isdisjoint(memscal.__all__)


def test_the_map_of_the_house_has_a_line_for_every_room():
    contributing = TESTS.parent / "CONTRIBUTING.md"
    lines = re.findall(r"^- `([\w/.]+)`: ", contributing.read_text(encoding="utf-8"), re.MULTILINE)
    folders = {path.parent for path in PACKAGE.rglob("__init__.py")} - {PACKAGE}
    rooms = {f"{folder.relative_to(PACKAGE).as_posix()}/" for folder in folders}
    assert sorted(lines) == sorted(rooms | {path.name for path in PACKAGE.glob("*.py")})


@pytest.fixture(scope="module")
def read():
    """What there is to read in every module."""
    return {name: measures(path) for name, path in MODULES.items()}


def within(budget, found):
    """Lines that say where more was found than the budget allows, or a line is missing."""
    lines = [f"{name}: no budget" for name in found if name not in budget]
    return lines + [
        f"{name}: {found[name]:,} of {most:,}"
        for name, most in budget.items()
        if found[name] > most
    ]


def test_each_room_and_extension_keeps_to_its_budget_of_tokens(read):
    core = Counter[str]()
    extended = Counter[str]()
    for name, counted in read.items():
        if extension(name):
            extended[extension(name)] += counted["tokens"]
        else:
            core["top" if name.count(".") == 1 else room(name)] += counted["tokens"]
    assert within(BUDGET["core"], core) + within(BUDGET["extensions"], extended) == []


def test_the_package_is_light_and_not_dense(read):
    total = sum(read.values(), Counter[str]())
    limits = BUDGET["package"]
    core = sum(counted["tokens"] for name, counted in read.items() if not extension(name))
    assert total["tokens"] <= limits["tokens"]
    assert core <= limits["tokens_of_core"]
    assert total["tokens"] <= limits["tokens_per_statement"] * total["statements"]
    assert 1e3 * total["parallel"] <= limits["parallel_per_1000_statements"] * total["statements"]
    for name in ("walrus", "unformatted", "long_functions"):
        assert total[name] <= limits[name], name
    assert max(map(most_arguments, MODULES.values())) <= limits["most_arguments"]
    assert len(memscal.__all__) <= limits["public_names"]


def test_the_tests_are_lighter_than_the_package(read):
    total = sum((measures(path) for path in TESTS.rglob("*.py")), Counter[str]())
    package = sum(counted["tokens"] for counted in read.values())
    assert total["tokens"] <= BUDGET["tests"]["share_of_package"] * package
    assert total["unformatted"] <= BUDGET["tests"]["unformatted"]
