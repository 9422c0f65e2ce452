"""The golden outputs: what every command prints with ``--json`` on the shipped data.

``test_golden.py`` compares them, to a tolerance that other processors and libraries keep.

During a refactoring on one machine, from the top of the repository::

    python tests/golden/make.py --check 1e-9          # each number that differs by more
    python tests/golden/make.py --check 1e-9 apply    # the same for some commands only

After a change on purpose, ``python tests/golden/make.py`` writes them anew (or those that are
named), and the signatures of the public names: read the diff before it is committed.

A long list of numbers is kept as its length, a few values, mean and root mean square.  What a run
cannot repeat is masked: dates, digests, and versions of programs.
"""

from __future__ import annotations

import argparse
import contextlib
import gzip
import inspect
import io
import json
import math
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import memscal
from memscal.cli import main as run_memscal

HERE = Path(__file__).parent
TOP = HERE.parents[1]
OUTPUTS = HERE / "outputs"
SIGNATURES = HERE / "signatures.txt"
LINKS = {
    "data": TOP / "calibration_data",
    "meshes": TOP / "tests" / "formats" / "data",
}
"""Folders of the repository by the names that they have where the commands run."""

SPHERE = "data/sphere_experiment"
FILM = "--young-modulus 2.2 --poisson-ratio 0.5 --thickness 2"
EXACT = "--young-modulus-uncertainty 0.1 --poisson-ratio-uncertainty 0.005"
ROD = f"--radius 0.25 --radius-uncertainty 0.0025 {FILM} {EXACT} --thickness-uncertainty 0.02"
OWN_SPHERE = (
    "--indenter sphere --radius 60 --young-modulus 1.9 --poisson-ratio 0.5 --thickness 1.5"
    " --thickness-uncertainty 0.015"
)

COMMANDS = {
    "calibrate-line": "calibrate data/rod_scan_33.h5 -o line.h5",
    "calibrate-tikhonov": "calibrate data/rod_scan_65.h5 -o t.h5 --method tikhonov",
    "calibrate-evidence": "calibrate data/rod_scan_65.h5 -o e.h5 --method evidence",
    "calibrate-draw": "calibrate data/rod_scan_33.h5 -o d.h5 --method white-noise-draw --seed 3",
    "calibrate-wiener": "calibrate data/rod_scan_33.h5 -o w.h5 --method wiener",
    "calibrate-raster": "calibrate data/rod_scan_raster.h5 -o raster.h5",
    "calibrate-three-loads": "calibrate data/rod_scan_three_loads.h5 -o loads.h5",
    "calibrate-two-scans": "calibrate data/rod_scan_33.h5 data/rod_scan_65.h5 -o two.h5",
    "calibrate-sweep": "calibrate data/rod_scan_33.h5 -o sweep.h5 --sweep",
    "calibrate-correlated": "calibrate data/rod_scan_33.h5 -o correlated.h5 --reference fem.h5"
    " --correlation thickness,poisson_ratio=0.5 --alternative rod_fem.h5",
    "calibrate-dry-run": "calibrate data/rod_scan_33.h5 -o dry_run.h5 --dry-run",
    "calibrate-sphere": f"calibrate {SPHERE}/rod_scan.h5 -o sensor.h5",
    "calibrate-messy": "calibrate messy.h5 -o messy_sensor.h5",
    "calibrate-shear": "calibrate files/line.scan.h5 --channel xz -o shear.h5",
    "reference-rod": "reference rod --load 0.5 --load 1",
    "reference-rod-fem": "reference rod --backend fem --rings 24 -o rod_fem.h5",
    "reference-rod-finite": "reference rod --strain finite --friction inf --load 0.02"
    " --film-radius 2 -o finite.h5",
    "reference-sphere": "reference sphere --load 0.69 --load 2.75 --young-modulus 1.9",
    "reference-sphere-friction": "reference sphere --load 1 --load 2.75 --friction 0.3",
    "reference-sphere-total": "reference sphere --depth 20 --friction 0.3 --loading total",
    "reference-sphere-fem": "reference sphere --depth 20 --friction inf --backend fem --rings 16",
    "reference-sphere-slip-length": "reference sphere --friction 1.6 --slip-length 1.82",
    "reference-sphere-rough": "reference sphere --exponential 0.5 0.01",
    "reference-cone": "reference cone --inclination 2 --load 0.5",
    "reference-frictionless": "reference sphere --load 1 -o mu0.h5",
    "reference-coefficient": "reference sphere --load 1 --friction 0.2 -o mu02.h5",
    "reference-sticking": "reference sphere --load 1 --friction inf -o sticking.h5",
    "simulate-line": "simulate -o synthetic.h5 --points 17 --seed 1",
    "simulate-raster": "simulate -o square.h5 --points 9 --raster --disc-radius 800 --sigma 300",
    "simulate-sphere": "simulate --experiment sphere -o experiment --points 33 --friction 0.2"
    " --load 1 --lubricated-load 1 --contacts 25 --spacing 0.6 --seed 2008",
    "import-line": 'import data/rod_scan_messy.csv -o messy.h5 --repeat repeat --x "x (mm)"'
    ' --x-unit mm --u "U (mV)" --u-unit mV --load-column "load (N)" --load 1'
    f" --load-uncertainty 0.01 {ROD}",
    "import-sphere": 'import data/tables/sphere_dry.csv -o own.h5 --x "x (mm)" --x-unit mm'
    ' --u "U (mV)" --u-unit mV --load-column "set load (N)" --repeat "set load (N)" --repeat pass'
    f" --load-scatter 1 --position-error 10 --lubrication dry {OWN_SPHERE}",
    "import-reference": "import data/rod_reference_fem.csv -o fem.h5 --format reference"
    ' --r "r (mm)" --r-unit mm --sigma "S33 (MPa)" --sigma-unit MPa --shear "S13 (MPa)" --sign -1'
    ' --shear-sign -1 --load 1 --solver "finite elements"',
    "import-mesh": "import meshes/vtk_film.vtu -o mesh.h5 --format reference --r-unit mm --sigma S"
    " --sigma-unit MPa --load 1",
    "apply": f"apply sensor.h5 {SPHERE}/sphere_dry.h5 -o stress.h5",
    "apply-override": "apply messy_sensor.h5 experiment/sphere_dry.h5 -o other.h5 --override",
    "compare": f"compare sensor.h5 {SPHERE}/sphere_dry.h5 {SPHERE}/sphere_lubricated.h5"
    " --loading incremental --friction 0.2 --macroscopic 0.2"
    " --macroscopic-uncertainty 0.02 --cache contacts",
    "compare-total": "compare line.h5 experiment/sphere_dry.h5"
    " experiment/sphere_lubricated.h5 --friction 0.2 --loading total --cache contacts --override",
    "compare-interface": "compare line.h5 experiment/sphere_dry.h5 --friction 0.2 --override"
    " --loading incremental --macroscopic 1.6 --interface --cache contacts",
    "compare-references": "compare line.h5 experiment/sphere_dry.h5 --reference mu0.h5"
    " --reference mu02.h5 --reference sticking.h5 --override",
    "restore-rod": "restore line.h5 data/rod_scan_65.h5 -o restored.h5",
    "restore-sphere": "restore line.h5 experiment/sphere_dry.h5 --expected mu02.h5",
    "design": "design --noise 1 --step 0.5 --repeats 4",
    "design-tikhonov": "design --load 0.5 --noise-voltage 0.05 --method tikhonov",
    "design-goal": "design --noise 1 --want A=1.3% --vary step",
    "inspect-scan": f"inspect {SPHERE}/sphere_dry.h5",
    "inspect-reference": "inspect fem.h5",
    "inspect-artifact": "inspect sensor.h5",
    "inspect-stress": "inspect other.h5",
    "check-artifact": "check data/rod_scan_65.apparatus.h5",
    "check-stress": "check stress.h5",
}
"""Arguments of the program by the name of the golden file; what one writes others read."""


# ------------------------------------------------------------------------------ running commands


class Runs:
    """Runs of the commands in one folder, each once, after those whose outputs it reads."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        unpack(folder / "files")
        self._results: dict[str, dict[str, Any]] = {}
        for name, target in LINKS.items():
            (folder / name).symlink_to(target)

    def __getitem__(self, name: str) -> dict[str, Any]:
        if name not in self._results:
            for needed in inputs(name):
                self[needed]
            self._results[name] = self._run(name)
        return self._results[name]

    def _run(self, name: str) -> dict[str, Any]:
        out, err = io.StringIO(), io.StringIO()
        with (
            contextlib.chdir(self.folder),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            code = run_memscal([*shlex.split(COMMANDS[name]), "--json"])
        if not out.getvalue():
            raise AssertionError(f"memscal {COMMANDS[name]}\n{err.getvalue()}")
        printed = reduced(json.loads(out.getvalue()))
        return {"command": COMMANDS[name], "exit_code": code, "output": printed}


def unpack(folder: Path) -> None:
    """Unpack the files that version 0.1 wrote: HDF5 compresses no metadata, gzip does."""
    folder.mkdir()
    for path in (HERE / "files").glob("*.h5.gz"):
        (folder / path.stem).write_bytes(gzip.decompress(path.read_bytes()))


def inputs(name: str) -> list[str]:
    """Commands that write what a command reads."""
    arguments = shlex.split(COMMANDS[name])
    first = [argument.partition("/")[0] for argument in arguments]
    written = {name: output(name) for name in COMMANDS}
    return [other for other, file in written.items() if other != name and file in first]


def output(name: str) -> str | None:
    """File or folder that a command writes."""
    arguments = shlex.split(COMMANDS[name])
    return arguments[arguments.index("-o") + 1] if "-o" in arguments else None


# ------------------------------------------------------------------------ what is kept of a result

LONGEST = 12
"""Numbers of a list that is kept whole."""

MASKS = [
    (re.compile(r"\b[0-9a-f]{64}\b"), "<sha256>"),
    (re.compile(r"\b\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\S*"), "<date>"),
]
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
        for pattern, mask in MASKS:
            value = pattern.sub(mask, value)
        return value
    return float(f"{value:.12g}") if isinstance(value, float) else value


def _summary(numbers: list[float | None]) -> dict[str, Any]:
    finite = [float(number) for number in numbers if number is not None]
    step = math.ceil(len(numbers) / 5)
    mean = math.fsum(finite) / max(len(finite), 1)
    square = math.fsum(number**2 for number in finite) / max(len(finite), 1)
    return {
        "length": len(numbers),
        "missing": len(numbers) - len(finite),
        "some": reduced(numbers[step // 2 :: step]),
        "mean": reduced(mean),
        "root_mean_square": reduced(math.sqrt(square)),
    }


# -------------------------------------------------------------------------------------- comparison


def differences(
    expected: Any, found: Any, tolerance: float, path: str = "", scale: float = 0.0
) -> Iterator[str]:
    """Yield each place where two results differ: numbers by more than a relative tolerance.

    The tolerance is relative to a number or to ``scale``, the largest number beside it: a number
    that is a difference near zero is no more accurate than what it is a difference of.
    """
    if isinstance(expected, dict) and isinstance(found, dict):
        for key in sorted(expected.keys() ^ found.keys()):
            yield f"{path}.{key}: {'missing' if key in expected else 'new'}"
        if "budget" in path.rpartition(".")[2] or expected.keys() & OF_ONE_KIND:
            scale = max(scale, _scale(expected.values()))
        for key in expected:
            if key in found:
                beside = SCALES.get(key, scale)
                yield from differences(
                    expected[key], found[key], tolerance, f"{path}.{key}", beside
                )
    elif isinstance(expected, list) and isinstance(found, list):
        if len(expected) != len(found):
            yield f"{path}: {len(expected)} items expected, {len(found)} found"
        scale = max(scale, _scale(expected))
        for i, (item, other) in enumerate(zip(expected, found, strict=False)):
            yield from differences(item, other, tolerance, f"{path}[{i}]", scale)
    elif isinstance(expected, float) and isinstance(found, float):
        size = max(abs(expected), abs(found), scale)
        if not abs(found - expected) <= tolerance * size:
            relative = abs(found - expected) / size
            yield f"{path}: {expected!r} expected, {found!r} found, {relative:.1e} of {size:.3g}"
    elif type(expected) is not type(found) or expected != found:
        yield f"{path}: {expected!r} expected, {found!r} found"


OF_ONE_KIND = {"value", "some", "maximum"}
"""Keys of objects whose numbers have one scale: quantities, long lists, ranges; budgets too."""

SCALES = {"p_value": 1.0, "chi2": 1.0, "convergence": 1.0}
"""Scales of numbers that may be as small as rounding makes them."""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _scale(values: Any) -> float:
    """Return the largest magnitude among the numbers of a list or an object."""
    return max((abs(value) for value in values if isinstance(value, float)), default=0.0)


# -------------------------------------------------------------------------------------- signatures


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
                    lines += [f"{name}.{member}: {inspect.signature(getter).return_annotation}"]
                elif callable(getattr(value, member)):
                    lines += _signature(f"{name}.{member}", getattr(value, member))
    return "\n".join(lines) + "\n"


def _signature(name: str, value: Any) -> list[str]:
    signature = inspect.signature(value)
    lines = [f"{name}() -> {signature.return_annotation}"]
    for parameter in signature.parameters.values():
        if parameter.name != "self":
            keyword = "keyword " if parameter.kind is parameter.KEYWORD_ONLY else ""
            default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
            lines.append(f"    {keyword}{parameter.name}: {parameter.annotation}{default}")
    return lines


def _members(value: type) -> set[str]:
    """Return the public names that memscal's own classes define, with the inherited ones."""
    ours = [base for base in value.__mro__ if base.__module__.startswith("memscal")]
    return {name for base in ours for name in vars(base) if not name.startswith("_")}


# ------------------------------------------------------------------------------------ command line


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
    names = arguments.names or list(COMMANDS)
    if arguments.check is None and not arguments.names:
        SIGNATURES.write_text(signatures(), encoding="utf-8")
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(Path(folder))
        for name in names:
            result = runs[name]
            if arguments.check is None:
                OUTPUTS.mkdir(exist_ok=True)
                (OUTPUTS / f"{name}.json").write_text(text(result), encoding="utf-8")
                continue
            for difference in differences(load(name), result, arguments.check):
                failed += 1
                sys.stdout.write(f"{name}{difference}\n")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
