"""What starting memscal loads: cold start is part of the product."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

LIST_LIBRARIES = """
import json, sys
roots = {name.partition(".")[0] for name in sys.modules}
print(json.dumps(sorted(roots - sys.stdlib_module_names)), file=sys.stderr)
"""


def libraries_after(code: str) -> set[str]:
    """Libraries in a fresh interpreter after some code, without those that were there before."""

    def loaded(start: str) -> set[str]:
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


def test_naming_the_package_loads_nothing_else() -> None:
    assert libraries_after("import memscal") == {"memscal"}


@pytest.mark.parametrize("arguments", ["'--help'", "'--version'", "'calibrate', '--help'"])
def test_asking_for_help_loads_click_alone(arguments: str) -> None:
    assert libraries_after(HELP.format(arguments=arguments)) == {"memscal", "click"}


def test_calibrating_is_possible_without_the_libraries_of_other_jobs() -> None:
    loaded = libraries_after("import memscal; memscal.calibrate, memscal.read_scan")
    assert loaded.isdisjoint({"matplotlib", "meshio", "pint", "rich", "skfem", "skimage"})
