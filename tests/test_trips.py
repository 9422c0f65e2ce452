"""Through how many files a reader of each main job has to go: those whose functions it calls."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest

import memscal

PACKAGE = Path(memscal.__path__[0])
MOST_FILES = {"calibrate": 35, "measure_stress": 35, "compare": 46}


def files_called(job: Callable[[], object]) -> list[str]:
    """Files of the package in which a job calls functions; what it imports is loaded before."""
    job()
    names: set[str] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            names.add(frame.f_code.co_filename)

    sys.setprofile(note)
    try:
        job()
    finally:
        sys.setprofile(None)
    paths = (Path(name) for name in names)
    return sorted(str(p.relative_to(PACKAGE)) for p in paths if p.is_relative_to(PACKAGE))


@pytest.fixture(scope="module")
def jobs() -> dict[str, Callable[[], object]]:
    """The three main jobs; the rod's contact is kept from one calibration to the next."""
    made = memscal.simulate_experiment(friction=0.2, loads=[1.0], seed=1)
    apparatus = memscal.calibrate(made.rod).apparatus
    return {
        "calibrate": lambda: memscal.calibrate(made.rod),
        "measure_stress": lambda: memscal.measure_stress(made.dry, apparatus),
        "compare": lambda: memscal.compare(made.dry, apparatus, friction=(0.0, 0.2)),
    }


@pytest.mark.parametrize("name", MOST_FILES)
def test_a_job_runs_through_few_files(name: str, jobs: dict[str, Callable[[], object]]) -> None:
    files = files_called(jobs[name])
    sys.stdout.write("\n  ".join([f"{name}: {len(files)} files", *files, ""]))
    assert len(files) <= MOST_FILES[name]
