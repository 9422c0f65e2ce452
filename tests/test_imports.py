"""What importing memscal loads, and which of its names are public."""

import json
import subprocess
import sys
from inspect import isfunction
from typing import get_args, get_type_hints

import pytest
from helpers.folders import SHIPPED

import memscal

SCAN = str(SHIPPED / "rod_scan_65.h5")
NOT_PUBLIC = {
    "ArrayReadings",
    "BudgetComparison",
    "FilmField",
    "Holds",
    "InputEffect",
    "KernelModes",
    "LawComparison",
    "NoiseSpectrum",
    "Region",
    "OtherEstimate",
    "Posterior",
    "Reading",
    "ScanPoints",
    "SetUp",
    "Solution",
    "Stream",
    "StressComparison",
    "Wave",
}
"""Types of what results hold that no user constructs, and of how a result was computed."""

LIST_LIBRARIES = """
import json, sys
roots = {name.partition(".")[0] for name in sys.modules}
print(json.dumps(sorted(roots - sys.stdlib_module_names)), file=sys.stderr)
"""


def libraries_after(code):
    """Libraries in a fresh interpreter after some code, without those that were there before."""

    def loaded(start):
        script = f"import atexit\natexit.register(lambda: exec({LIST_LIBRARIES!r}))\n{start}"
        run = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        return set(json.loads(run.stderr.splitlines()[-1]))

    return loaded(code) - loaded("")


HELP = """
import sys
from memscal.cli import main
sys.argv = ["memscal", {arguments}]
sys.exit(main())
"""


def test_importing_the_package_loads_only_its_lazy_loader():
    assert libraries_after("import memscal") == {"lazy_loader", "memscal"}


@pytest.mark.parametrize("arguments", ["'--help'", "'--version'", "'calibrate', '--help'"])
def test_asking_for_help_loads_click_alone(arguments):
    assert libraries_after(HELP.format(arguments=arguments)) == {"click", "lazy_loader", "memscal"}


def test_calibrating_is_possible_without_the_libraries_of_other_jobs():
    loaded = libraries_after("import memscal; memscal.calibrate, memscal.read_scan")
    assert loaded.isdisjoint({"matplotlib", "meshio", "pint", "skfem", "skimage"})


@pytest.mark.parametrize("arguments", [["--help"], ["calibrate", SCAN, "-o", "artifact.h5"]])
def test_help_and_a_plain_calibration_load_no_extension(arguments, tmp_path):
    listing = "print([m for m in sys.modules if m.startswith('memscal.extensions.')])"
    code = f"import sys; from memscal.cli import main; main({arguments!r}); {listing}"
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines()[-1] == "[]"


def classes(hint):
    """The classes of memscal that a type hint names."""
    if isinstance(hint, type) and hint.__module__.startswith("memscal."):
        yield hint
    for argument in get_args(hint):
        yield from classes(argument)


def offered(public):
    """The type hints of what a public function returns, or of a public class's attributes."""
    names = {name: getattr(memscal, name) for name in memscal.__all__}
    members = [public]
    if isinstance(public, type):
        members = [member for name, member in vars(public).items() if not name.startswith("_")]
        hints = get_type_hints(public, localns=names)
        yield from (hint for name, hint in hints.items() if not name.startswith("_"))
    for member in members:
        held = [name for name in ("fget", "func", "__func__") if hasattr(member, name)]
        function = getattr(member, held[0]) if held else member
        if isfunction(function):
            yield get_type_hints(function, localns=names).get("return")


def test_every_type_that_a_public_name_offers_is_public():
    hidden = {
        offer.__name__
        for name in memscal.__all__
        for hint in offered(getattr(memscal, name))
        for offer in classes(hint)
        if getattr(memscal, offer.__name__, None) is not offer
    }
    assert hidden == NOT_PUBLIC
