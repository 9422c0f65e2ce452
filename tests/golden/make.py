"""The golden outputs: what every command of ``commands.txt`` prints with ``--json``.

``test_golden.py`` compares them, to a share of their uncertainty.

During a refactoring on one machine, from the top of the repository::

    python tests/golden/make.py --check 1e-9          # each number that differs by more
    python tests/golden/make.py --check 1e-9 apply    # the same for some commands only

After a change on purpose, ``python tests/golden/make.py`` writes them anew (or those that are
named), and the signatures of the public names: read the diff before it is committed.

A long list of numbers is kept as its length, a few values, mean and root mean square.  What a run
cannot repeat is masked: dates, digests, and versions of programs.
"""

import argparse
import contextlib
import functools
import gzip
import inspect
import io
import json
import math
import pkgutil
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

from numpy.typing import ArrayLike

import memscal
from memscal.cli import main as run_memscal
from memscal.model.arrays import FloatArray

HERE = Path(__file__).parent
TOP = HERE.parents[1]
OUTPUTS = HERE / "outputs"
SIGNATURES = HERE / "signatures.txt"
LINKS = {"data": TOP / "calibration_data", "meshes": TOP / "tests" / "data"}
"""Folders of the repository by the names that they have where the commands run."""

LINES = (HERE / "commands.txt").read_text(encoding="utf-8").splitlines()
COMMANDS = {name: arguments for name, _, arguments in (line.partition(": ") for line in LINES)}
"""Arguments of the program by the name of the golden file; what one writes others read."""


SOLVED = (
    "memscal.calibration.calibrate.calibrate",
    "memscal.calibration.calibrate.Calibration.sweep",
    "memscal.extensions.planning.design.design",
    "memscal.friction.compare.compare",
    "memscal.measurement.measure_stress.measure_stress",
    "memscal.measurement.restore.restore",
)
"""Functions by which a command finds what it then prints, draws and writes."""

NAMES_OF_FILES = {"-o", "--report", "--figure", "--figures", "--figure-format", "--sweep-figure"}
"""Options that change nothing of what a command finds."""


class Runs:
    """Runs of the commands in one folder, each once, after those whose outputs it reads.

    What is asked twice, to be printed as JSON and as text, is found once.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        unpack(folder / "files")
        self.printed: dict[str, Any] = {}
        self._results: dict[str, dict[str, Any]] = {}
        self._found: dict[tuple[str, ...], Any] = {}
        self._question: tuple[str, ...] = ()
        for name, target in LINKS.items():
            (folder / name).symlink_to(target)

    def __getitem__(self, name: str) -> dict[str, Any]:
        if name not in self._results:
            arguments = shlex.split(COMMANDS[name])
            code, out, err = self.run([*arguments, "--json"])
            if not out:
                raise AssertionError(f"memscal {COMMANDS[name]}\n{err}")
            self.printed[name] = json.loads(out)
            printed = reduced(self.printed[name])
            result = {"command": COMMANDS[name], "exit_code": code, "output": printed}
            self._results[name] = result
        return self._results[name]

    def run(self, arguments: list[str]) -> tuple[int, str, str]:
        """Run a command, after those whose outputs it reads; return code and what it printed."""
        read = {argument.partition("/")[0] for argument in arguments} - {output(arguments)}
        for name, command in COMMANDS.items():
            if output(shlex.split(command)) in read:
                self[name]
        out = io.StringIO()
        err = io.StringIO()
        self._question = asked(arguments)
        with contextlib.ExitStack() as stack:
            for path in SOLVED:
                stack.enter_context(self._once(path))
            # Work that is shared among processes is that of other tests: each takes long to start.
            stack.enter_context(mock.patch("os.cpu_count", return_value=1))
            stack.enter_context(contextlib.chdir(self.folder))
            stack.enter_context(contextlib.redirect_stdout(out))
            stack.enter_context(contextlib.redirect_stderr(err))
            code = run_memscal(arguments)
        self._question = ()
        return code, out.getvalue(), err.getvalue()

    def _once(self, path: str) -> contextlib.AbstractContextManager[Any]:
        """Let a function answer the question of a command once."""
        place, _, name = path.rpartition(".")
        owner = pkgutil.resolve_name(place)
        function = getattr(owner, name)

        @functools.wraps(function)
        def once(*values: Any, **options: Any) -> Any:
            # What was imported meanwhile keeps this function.
            if not self._question:
                return function(*values, **options)
            key = path, *self._question
            if key not in self._found:
                self._found[key] = function(*values, **options)
            return self._found[key]

        return mock.patch.object(owner, name, once)


def asked(arguments: list[str]) -> tuple[str, ...]:
    """Return the arguments of a command that change what it finds."""
    words = iter(arguments)
    kept = []
    for word in words:
        if word in NAMES_OF_FILES:
            next(words)
        elif word != "--json":
            kept.append(word)
    return tuple(kept)


def unpack(folder: Path) -> None:
    """Unpack the files that version 0.1 wrote: HDF5 compresses no metadata, gzip does."""
    folder.mkdir()
    for path in (HERE / "files").glob("*.h5.gz"):
        (folder / path.stem).write_bytes(gzip.decompress(path.read_bytes()))


def output(arguments: list[str]) -> str | None:
    """File or folder that a command writes."""
    return arguments[arguments.index("-o") + 1] if "-o" in arguments else None


LONGEST = 12
"""Numbers of a list that is kept whole."""

MASKS = {r"\b[0-9a-f]{64}\b": "<sha256>", r"\b\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\S*": "<date>"}
VERSIONS = {"version", "environment"}
"""Keys with versions of programs; the versions of schemas are kept."""


def reduced(value: Any) -> Any:
    """Return a JSON value with twelve digits, long lists of numbers made short, and masks."""
    if isinstance(value, dict):
        return {k: "<version>" if k in VERSIONS else reduced(v) for k, v in value.items()}
    if isinstance(value, list):
        if len(value) > LONGEST and all(item is None or _is_number(item) for item in value):
            return _summary(value)
        return [reduced(item) for item in value]
    if isinstance(value, str):
        for pattern, mask in MASKS.items():
            value = re.sub(pattern, mask, value)
        return value
    return float(f"{value:.12g}") if isinstance(value, float) else value


def _summary(numbers: list[float | None]) -> dict[str, Any]:
    finite = [float(number) for number in numbers if number is not None]
    step = math.ceil(len(numbers) / 5)
    count = max(len(finite), 1)
    return {
        "length": len(numbers),
        "missing": len(numbers) - len(finite),
        "some": reduced(numbers[step // 2 :: step]),
        "mean": reduced(math.fsum(finite) / count),
        "root_mean_square": reduced(math.sqrt(math.fsum(x**2 for x in finite) / count)),
    }


OF_ONE_KIND = {"value", "some", "maximum"}
"""Keys of objects whose numbers have one scale: quantities, long lists, ranges; budgets too."""

SCALES = {"p_value": 1.0, "chi2": 1.0, "convergence": 1.0}
"""Scales of numbers that may be as small as rounding makes them."""

STATISTICS = {
    "standard_uncertainty", "relative_uncertainty", "budget", "checks", "draws", "reconvolution",
    "p_value", "chi2", "size_for_one_u", "size_for_one_u_of_fwhm",
}  # fmt: skip
"""Keys of what says how well a number is known, and need not be known better than that."""


def differences(
    golden: Any,
    result: Any,
    tolerance: float,
    share: float = 0.0,
    path: str = "",
    scale: float = 0.0,
    uncertainty: float = 0.0,
) -> Iterator[str]:
    """Yield each place where two results differ.

    Numbers may differ by ``tolerance`` of themselves or of ``scale``, the largest number beside
    them: a number that is a difference near zero is no more accurate than what it is a difference
    of.  They may differ by ``share`` of their standard uncertainty, too, and statistics by that
    share of themselves: by no more do processors and libraries change the result of a search.
    """
    if isinstance(golden, dict) and isinstance(result, dict):
        for key in sorted(golden.keys() ^ result.keys()):
            yield f"{path}.{key}: {'missing' if key in golden else 'new'}"
        if "budget" in path.rpartition(".")[2] or golden.keys() & OF_ONE_KIND:
            scale = max(scale, _scale(golden.values()))
        stated = golden.get("standard_uncertainty") or 0.0
        for key in golden.keys() & result.keys():
            own = max(tolerance, share) if key in STATISTICS else tolerance
            size = SCALES.get(key, SCALES.get(str(golden.get("name")), scale))
            own_uncertainty = stated if key == "value" else 0.0
            items = golden[key], result[key]
            yield from differences(*items, own, share, f"{path}.{key}", size, own_uncertainty)
    elif isinstance(golden, list) and isinstance(result, list):
        if len(golden) != len(result):
            yield f"{path}: {len(golden)} items expected, {len(result)} found"
        scale = max(scale, _scale(golden))
        for i, items in enumerate(zip(golden, result, strict=False)):
            yield from differences(*items, tolerance, share, f"{path}[{i}]", scale)
    elif isinstance(golden, float) and isinstance(result, float):
        size = max(abs(golden), abs(result), scale)
        if not abs(result - golden) <= max(tolerance * size, share * uncertainty):
            relative = abs(result - golden) / size
            yield f"{path}: {golden!r} expected, {result!r} found, {relative:.1e} of {size:.3g}"
    elif type(golden) is not type(result) or golden != result:
        yield f"{path}: {golden!r} expected, {result!r} found"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _scale(values: Any) -> float:
    """Return the largest magnitude among the numbers of a list or an object."""
    return max((abs(value) for value in values if isinstance(value, float)), default=0.0)


def signatures() -> str:
    """Return the signatures of all public names, and of the members of public classes."""
    lines = []
    for name in sorted(memscal.__all__):
        value = getattr(memscal, name)
        if callable(value):
            lines += _signature(name, value)
        if isinstance(value, type):
            for member in sorted(_members(value)):
                definition = inspect.getattr_static(value, member)
                getter = getattr(definition, "fget", None) or getattr(definition, "func", None)
                if getter is not None:
                    returned = inspect.signature(getter).return_annotation
                    lines += [f"{name}.{member}: {_type(returned)}"]
                elif callable(getattr(value, member)):
                    lines += _signature(f"{name}.{member}", getattr(value, member))
    return "\n".join(lines) + "\n"


def _signature(name: str, value: Any) -> list[str]:
    signature = inspect.signature(value)
    lines = [f"{name}() -> {_type(signature.return_annotation)}"]
    for parameter in signature.parameters.values():
        if parameter.name != "self":
            keyword = "keyword " if parameter.kind is parameter.KEYWORD_ONLY else ""
            default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
            lines.append(f"    {keyword}{parameter.name}: {_type(parameter.annotation)}{default}")
    return lines


def _type(annotation: Any) -> str:
    """Return an annotation without modules; what NumPy's types consist of is its own affair."""
    if isinstance(annotation, str) or annotation is inspect.Signature.empty:
        return annotation if isinstance(annotation, str) else "not stated"
    text = re.sub(r"(?:\w+\.)+", "", inspect.formatannotation(annotation))
    text = re.sub(r"^Union\[(.*), NoneType\]$", r"\1 | None", text)
    for alias, name in ((ArrayLike, "ArrayLike"), (FloatArray, "FloatArray")):
        own = re.sub(r"(?:\w+\.)+", "", inspect.formatannotation(alias))
        text = text.replace(own, name).replace(own.removeprefix("Union[")[:-1], name)
    return text


def _members(value: type) -> set[str]:
    """Return the public names that memscal's own classes define, with the inherited ones."""
    ours = [base for base in value.__mro__ if base.__module__.startswith("memscal")]
    return {name for base in ours for name in vars(base) if not name.startswith("_")}


def load(name: str) -> dict[str, Any]:
    """Read a golden output."""
    golden: dict[str, Any] = json.loads((OUTPUTS / f"{name}.json").read_text(encoding="utf-8"))
    return golden


def text(result: dict[str, Any]) -> str:
    """Return a golden output as it is stored: innermost lists and objects on lines of their own."""

    def joined(match: re.Match[str]) -> str:
        return re.sub(r"\n +", " ", match[0]).replace("{ ", "{").replace("[ ", "[")

    indented = json.dumps(result, indent=1, ensure_ascii=False)
    return re.sub(r"[\[{]\n[^\[\]{}]*\n *[\]}]", joined, indented) + "\n"


def main() -> int:
    """Write the golden outputs, or compare with them."""
    parser = argparse.ArgumentParser(description="Make the golden outputs, or compare with them.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="golden outputs; by default all")
    parser.add_argument("--check", type=float, metavar="TOLERANCE", help="compare, write nothing")
    arguments = parser.parse_args()
    if arguments.check is None and not arguments.names:
        SIGNATURES.write_text(signatures(), encoding="utf-8")
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(Path(folder))
        for name in arguments.names or COMMANDS:
            if arguments.check is None:
                (OUTPUTS / f"{name}.json").write_text(text(runs[name]), encoding="utf-8")
                continue
            for difference in differences(load(name), runs[name], arguments.check):
                failed = True
                sys.stdout.write(f"{name}{difference}\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
