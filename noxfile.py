#!/usr/bin/env python3
# /// script
# dependencies = ["nox>=2025.2.9"]
# ///
"""Every check of the project, each in a fresh environment: ``nox --list`` names them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import nox

nox.needs_version = ">=2025.2.9"
nox.options.default_venv_backend = "virtualenv"

ROOT = Path(__file__).parent
GROUPS = nox.project.load_toml("pyproject.toml")

NOTHING_FROM_OUTSIDE = {"PYTHONPATH": "", "PYTHONNOUSERSITE": "1"}
"""Environment in which only what the session installed can be imported."""

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment in which linear algebra, here of small matrices, does not compete with itself."""

# The judge of accessibility that runs in a browser, as npm names it.
AXE = "axe-core@4.14.1"

# Cores that this process may use, of which a machine can have more.
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

# A worker to a core, of half a gigabyte. A file stays on one worker, where its fixtures are made
# once; files start in the order given, of which the long ones come first.
IN_PARALLEL = (f"--numprocesses={min(CORES, 8)}", "--dist=loadfile", "--no-loadscope-reorder")


def group(name: str) -> list[str]:
    """Requirements of one of the dependency groups in pyproject.toml."""
    return list(nox.project.dependency_groups(GROUPS, name))


@contextmanager
def outside_the_checkout(session: nox.Session, *, requirements: list[str]) -> Iterator[Path]:
    """Install the built wheel and step into a copy of the tests that has no sources beside it."""
    with TemporaryDirectory(prefix="memscal-") as folder:
        wheels, copy = Path(folder, "wheel"), Path(folder, "outside")
        pip = ("python", "-m", "pip", "wheel", "--quiet", "--no-deps")
        session.run(*pip, "--wheel-dir", os.fspath(wheels), os.fspath(ROOT))
        (wheel,) = wheels.glob("memscal-*.whl")
        session.install(os.fspath(wheel), *requirements)

        for name in ("tests", "notebooks", "calibration_data", "docs"):
            clutter = shutil.ignore_patterns("__pycache__", ".*")
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, copy / name, ignore=clutter)
        for file in (*ROOT.glob("*.md"), *map(ROOT.joinpath, ("pyproject.toml", "CITATION.cff"))):
            shutil.copy(file, copy)
        with session.chdir(copy):
            yield copy


def run_pytest(session: nox.Session, *arguments: str) -> None:
    """Run pytest on whatever the session installed, and on nothing else."""
    environment = NOTHING_FROM_OUTSIDE | ONE_THREAD
    session.run("pytest", "-p", "no:cacheprovider", *arguments, env=environment)


@nox.session
def tests(session: nox.Session) -> None:
    """Test the built wheel: unit tests and doctests."""
    with outside_the_checkout(session, requirements=group("test")):
        rooms = ("accuracy", "benchmarks", "judges", "pages")  # they have sessions of their own
        elsewhere = [f"--ignore=tests/{room}" for room in rooms]
        everything = ("tests", *elsewhere, "--pyargs", "memscal")
        run_pytest(session, *IN_PARALLEL, "--durations=20", *(session.posargs or everything))


@nox.session
def studies(session: nox.Session) -> None:
    """Run the statistical studies, and those against other programs, in reduced form."""
    with outside_the_checkout(session, requirements=group("test")):
        run_pytest(session, *IN_PARALLEL, "tests", "-m", "accuracy", *session.posargs)


@nox.session
def notebooks(session: nox.Session) -> None:
    """Execute the notebooks; their stored outputs must be those of the built wheel."""
    with outside_the_checkout(session, requirements=group("test")) as copy:
        executed = shutil.copytree(copy / "notebooks", copy / "executed")
        books = sorted(os.fspath(book) for book in executed.glob("*.ipynb"))
        run_pytest(session, *IN_PARALLEL, "--nbmake", "--overwrite", *books)
        compare = ("python", "docs/store_notebooks.py", "--compare", os.fspath(executed))
        session.run(*compare, env=NOTHING_FROM_OUTSIDE)


@nox.session(default=False)
def benchmarks(session: nox.Session) -> None:
    """Print how fast memscal is beside other ways to the same numbers, on this machine."""
    with outside_the_checkout(session, requirements=group("test")):
        run_pytest(session, "-m", "benchmark", "--capture=no", "tests/benchmarks", *session.posargs)


@nox.session(default=False)
def accuracy(session: nox.Session) -> None:
    """Run studies and tests in full: over every seed, in every case."""
    with outside_the_checkout(session, requirements=group("test")):
        session.env["MEMSCAL_FULL_STUDY"] = "1"
        every = ("tests", "-m", "not benchmark and not judges and not pages")
        run_pytest(session, *IN_PARALLEL, *every, *session.posargs)


@nox.session(default=False)
def robustness(session: nox.Session) -> None:
    """Run the whole campaign of damaged inputs, kills and flipped bits; print its table."""
    with outside_the_checkout(session, requirements=group("test")):
        session.env["MEMSCAL_ROBUSTNESS"] = os.environ.get("MEMSCAL_ROBUSTNESS", "1")
        run_pytest(session, "tests/robustness", *session.posargs)


@nox.session(default=False)
def coverage(session: nox.Session) -> None:
    """Show which lines of the built wheel no test reaches."""
    with outside_the_checkout(session, requirements=[*group("test"), "pytest-cov"]):
        run_pytest(session, "tests", "--cov", "--cov-report=term-missing")


@nox.session
def judges(session: nox.Session) -> None:
    """Have other programs validate the files that the built wheel writes."""
    with outside_the_checkout(session, requirements=group("judges")):
        run_pytest(session, "-m", "judges", "tests/judges", *session.posargs)


@nox.session(python=["3.12", "3.13"], default=False)
def later_pythons(session: nox.Session) -> None:
    """Import everything and calibrate by a later Python, where there is one (nox says if not)."""
    with outside_the_checkout(session, requirements=["hypothesis>=6.110", "pytest>=8.2"]):
        quick = ("tests/test_arguments.py", "tests/test_imports.py", "tests/axisymmetry")
        run_pytest(session, *(session.posargs or quick))


@nox.session
def docs(session: nox.Session) -> None:
    """Build the documentation into site/, without a warning and without the network."""
    with outside_the_checkout(session, requirements=group("docs")) as copy:
        shutil.copy(ROOT / "LICENSE", copy)
        shutil.rmtree(ROOT / "site", ignore_errors=True)
        strict = ("--fail-on-warning", "--keep-going", "--nitpicky", "--jobs", "auto", "--quiet")
        site = os.fspath(ROOT / "site")
        session.run("sphinx-build", *strict, "--conf-dir", "docs", ".", site)


@nox.session
def packages(session: nox.Session) -> None:
    """Build source distribution and wheel; install each on its own, and calibrate with it."""
    session.install("build>=1.2")
    with TemporaryDirectory(prefix="memscal-") as folder, session.chdir(folder):
        session.run("python", "-m", "build", "--outdir", "dist", os.fspath(ROOT))
        made = sorted(Path("dist").iterdir())
        assert [path.suffix for path in made] == [".whl", ".gz"], made
        for path in made:
            session.install("--force-reinstall", os.fspath(path))
            session.run("memscal", "simulate", "-o", "scan.h5", "--force", env=NOTHING_FROM_OUTSIDE)
            calibrate = ("memscal", "calibrate", "scan.h5", "--report", "scan.html", "--force")
            session.run(*calibrate, env=NOTHING_FROM_OUTSIDE, silent=True)


@nox.session(requires=["docs"])
def pages(session: nox.Session) -> None:
    """Have a browser open, judge and print the pages of the wheel and the site."""
    for program in ("chromium", "npm"):
        if not shutil.which(program):
            session.error(f"{program} is not installed: apt-get install {program}")
    with outside_the_checkout(session, requirements=group("pages")) as copy:
        fetch = ("npm", "install", "--silent", "--no-audit", "--no-fund", "--ignore-scripts")
        session.run(*fetch, "--prefix", os.fspath(copy / "npm"), AXE, external=True)
        session.env["MEMSCAL_AXE"] = os.fspath(copy / "npm/node_modules/axe-core/axe.min.js")
        session.env["MEMSCAL_SITE"] = os.fspath(ROOT / "site")
        run_pytest(session, "-m", "pages", "tests/pages", *session.posargs)


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, formatting, spelling, and the set-up of the repository itself."""
    session.install(*group("lint"))
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("codespell")
    session.run("rumdl", "check", ".")
    session.run("repo-review", ".", "--show", "err")


@nox.session
def typecheck(session: nox.Session) -> None:
    """Check the types of the package, strictly."""
    session.install(*group("typecheck"), ".")
    session.run("mypy")


if __name__ == "__main__":
    nox.main()
