"""Settings for all tests."""

import gc
import logging
import os
import secrets
import shutil
import signal
import sys
from pathlib import Path

# Before numpy loads: threads on matrices as small as ours cost ten times the work itself.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

# A run under nohup, or in the background of a script, ignores them, and so would the programs that
# tests start and end.
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)

import pytest  # noqa: E402
from helpers.console import Outcome  # noqa: E402
from helpers.nexus import definitions_folder, structure, violations  # noqa: E402
from helpers.scans import known_apparatus, simulate  # noqa: E402
from hypothesis import settings  # noqa: E402

import memscal  # noqa: E402
from memscal.cli import main  # noqa: E402
from memscal.formats.hdf5 import writer  # noqa: E402

# A deadline is a clock: on a busy machine it would fail what is right.
settings.register_profile("memscal", deadline=None, print_blob=True)
settings.load_profile("memscal")

REMEMBERING = ("memscal.mechanics.solver.refinement", "memscal.extensions.finite_strain.solve")

FULL_STUDY = bool(os.environ.get("MEMSCAL_FULL_STUDY"))

MARKERS = {
    "accuracy": "accuracy",
    "benchmarks": "benchmark",
    "judges": "judges",
    "pages": "pages",
}
"""Folders whose tests have sessions of their own, and their markers."""


def pytest_report_header():
    """Say in the head of a report what is not run."""
    text = "studies: reduced; those marked full_study are deselected (set MEMSCAL_FULL_STUDY)"
    return [] if FULL_STUDY else [text]


def pytest_collection_modifyitems(config, items):
    """Mark what has a session of its own, and deselect the studies without a reduced form."""
    for item in items:
        if item.path.parent.name in MARKERS:
            item.add_marker(MARKERS[item.path.parent.name])
    full = [item for item in items if item.get_closest_marker("full_study") and not FULL_STUDY]
    config.hook.pytest_deselected(items=full)
    items[:] = [item for item in items if item not in full]


def pytest_collection_finish():
    """Keep what was collected out of later searches for garbage, of which each would visit it."""
    gc.freeze()


@pytest.fixture
def seed():
    """Return another seed in every run; the log of a failed test names it."""
    value = secrets.randbits(32)
    logging.getLogger(__name__).info("seed %d", value)
    return value


@pytest.fixture(scope="session", autouse=True)
def _every_file_is_valid(tmp_path_factory):
    """Validate the files that tests write against our application definitions."""
    encode = writer.tree_to_bytes
    seen = set[frozenset[str]]()
    folder = tmp_path_factory.mktemp("nexus")

    def validated(root):
        data = encode(root)
        layout = structure(root)
        if layout not in seen and root.attributes.get(writer.SCHEMA_ATTRIBUTE) in writer.DEFINED:
            if not seen:
                definitions_folder(folder / "definitions")
            seen.add(layout)
            (folder / "written.h5").write_bytes(data)
            assert violations(folder / "written.h5", folder / "definitions") == []
        return data

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "tree_to_bytes", validated)
        yield


@pytest.fixture(scope="session", autouse=True)
def _contacts_are_kept_for_this_run_alone(
    tmp_path_factory,
):
    """Share calculated contacts among tests and workers, and begin from cold."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", os.fspath(shared / "cache"))
        yield


@pytest.fixture(scope="module", autouse=True)
def _forget_what_was_solved(request):
    """Free the contacts and meshes that a file's tests kept: gigabytes, over all files."""
    yield
    for module in (request.module, *(sys.modules.get(name) for name in REMEMBERING)):
        for value in list(vars(module).values()) if module else []:
            if hasattr(value, "cache_clear"):
                value.cache_clear()
    gc.collect()


@pytest.fixture
def run(capsys):
    """Run ``memscal`` with arguments."""

    def run_(*arguments):
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return Outcome(code, printed.out, printed.err)

    return run_


@pytest.fixture(scope="session")
def good_scan(tmp_path_factory):
    """A scan with nothing wrong in it."""
    path = tmp_path_factory.mktemp("good") / "scan.h5"
    memscal.write_scan(memscal.simulate(seed=1), path)
    return path


@pytest.fixture(scope="session")
def drifting_scan(tmp_path_factory):
    """A scan whose baseline drifts by far more than the quality check allows."""
    path = tmp_path_factory.mktemp("drifting") / "scan.h5"
    memscal.write_scan(simulate(seed=1, drift=0.2), path)
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    return work


@pytest.fixture
def scan(good_scan, folder):
    """A copy of the good scan in the folder."""
    return Path(shutil.copy(good_scan, folder / "scan.h5"))


@pytest.fixture(scope="session")
def known_artifact(tmp_path_factory):
    """A sensor whose G and A are known."""
    path = tmp_path_factory.mktemp("known") / "sensor.apparatus.h5"
    known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.01).save(path)
    return path


@pytest.fixture
def artifact(known_artifact, folder):
    """A copy of the known sensor in the folder."""
    return Path(shutil.copy(known_artifact, folder))
