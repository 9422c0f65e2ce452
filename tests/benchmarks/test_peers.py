"""G against the programs that people reach for: error and time on the same scans, in one run.

The peers are given the scan's true centre, baseline and drift, and all but DeerLab choose their
settings by the G that is looked for (see tests/helpers/peers.py); ours is given the scan.

Set MEMSCAL_FULL_STUDY for 40 seeds in place of a few.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from time import perf_counter

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.peers import PEERS, RADII, Kernel
from helpers.scans import RING, TAILS, plane_error, simulated

import memscal
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan

pytestmark = pytest.mark.benchmark

METHOD = "evidence"
SEEDS = 40 if FULL else 6
# A disc's error has two humps, where it is taken for a Gaussian and where it is not: few seeds
# tell neither.
DISC_SEEDS = 40 if FULL else 24
OURS = "memscal"
INSTALLED = [peer for peer in PEERS if find_spec(peer)]


@dataclass(frozen=True)
class Case:
    """A kernel, and what its scans are taken with."""

    kernel: Kernel
    noise: float
    repeats: int = 1
    seeds: int = SEEDS

    def scans(self) -> Iterator[Scan]:
        for seed in range(self.seeds):
            yield simulated(kernel=self.kernel, noise=self.noise, repeats=self.repeats, seed=seed)


def gaussian(sigma: float) -> memscal.GaussianMixture:
    return memscal.GaussianMixture((1.0,), (sigma,))


CASES = {
    f"Gaussian {sigma * 1e3:g} mm, {noise:.1%}": Case(gaussian(sigma), noise)
    for sigma in (0.45e-3, 0.561e-3, 0.75e-3)
    for noise in (0.001, 0.005, 0.02)
}
CASES |= {"tails": Case(TAILS, 0.003, repeats=2), "ring": Case(RING, 0.003, repeats=2)}
CASES["disc"] = Case(memscal.SmoothedDisc(0.8e-3, 0.3e-3), 0.003, repeats=2, seeds=DISC_SEEDS)


def ours(scan: Scan, truth: Kernel) -> FloatArray:
    return memscal.calibrate(scan, method=METHOD).apparatus.radial(RADII)


@dataclass(frozen=True)
class Outcome:
    """Medians over the seeds."""

    error: float
    seconds: float


@lru_cache
def study(name: str) -> dict[str, Outcome]:
    """Ours and every installed peer on the scans of a case, taking turns."""
    case = CASES[name]
    wanted = case.kernel.radial(RADII)
    runners: dict[str, Callable[[Scan, Kernel], FloatArray]] = {OURS: ours}
    runners |= {peer: PEERS[peer] for peer in INSTALLED}
    rows: dict[str, list[tuple[float, float]]] = {runner: [] for runner in runners}
    for scan in [next(case.scans()), *case.scans()]:
        for runner, find in runners.items():
            start = perf_counter()
            found = find(scan, case.kernel)
            seconds = perf_counter() - start
            rows[runner].append((plane_error(RADII, found, wanted), seconds))
    # The first round warms up: it imports and fills caches.
    return {runner: Outcome(*np.median(row[1:], axis=0)) for runner, row in rows.items()}


def lines(names: set[str]) -> Iterator[str]:
    """The table of the cases that were run."""
    runners = [OURS, *INSTALLED]
    yield f"Median error of G over {SEEDS} seeds, of a disc {DISC_SEEDS} (and time over ours)"
    yield " " * 24 + "".join(f"{runner:>16}" for runner in runners)
    for name in [name for name in CASES if name in names]:
        found = study(name)
        cells = (
            f"{found[runner].error:.3f} ({found[runner].seconds / found[OURS].seconds:.2f})"
            for runner in runners
        )
        yield f"{name:<24}" + "".join(f"{cell:>16}" for cell in cells)


@pytest.fixture(scope="module")
def table(request: pytest.FixtureRequest) -> Iterator[set[str]]:
    """Names of the cases that were run; their table is shown when all are."""
    done: set[str] = set()
    yield done
    plugins = request.config.pluginmanager
    reporter, capture = (plugins.get_plugin(n) for n in ("terminalreporter", "capturemanager"))
    if reporter is not None:  # a worker of many has no terminal
        with capture.global_and_fixture_disabled():
            for line in ["", *lines(done)]:
                reporter.write_line(line)


@pytest.mark.parametrize("peer", PEERS)
@pytest.mark.parametrize("name", CASES)
def test_g_is_found_better_than_by(peer: str, name: str, table: set[str]) -> None:
    pytest.importorskip(peer, reason=f"{peer}, a program to compare with, is not installed")
    table.add(name)
    found = study(name)
    assert found[OURS].error < found[peer].error
