"""Running the program in this process, on scans of its own making."""

import shutil
from pathlib import Path

import pytest
from helpers.console import Outcome, Run
from helpers.scans import known_apparatus

import memscal
from memscal.cli import main


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run ``memscal`` with arguments."""

    def run_(*arguments: object) -> Outcome:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return Outcome(code, printed.out, printed.err)

    return run_


@pytest.fixture(scope="session")
def good_scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan with nothing wrong in it."""
    path = tmp_path_factory.mktemp("good") / "scan.h5"
    memscal.write_scan(memscal.simulate(seed=1), path)
    return path


@pytest.fixture(scope="session")
def drifting_scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan whose baseline drifts by far more than the quality check allows."""
    path = tmp_path_factory.mktemp("drifting") / "scan.h5"
    memscal.write_scan(memscal.simulate(seed=1, drift=0.2), path)
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    return work


@pytest.fixture
def scan(good_scan: Path, folder: Path) -> Path:
    """A copy of the good scan in the folder."""
    return Path(shutil.copy(good_scan, folder / "scan.h5"))


@pytest.fixture
def artifact(folder: Path) -> Path:
    """A sensor whose G and A are known, in the folder."""
    path = folder / "sensor.apparatus.h5"
    known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.01).save(path)
    return path
