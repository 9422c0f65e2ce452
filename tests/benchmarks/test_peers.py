"""G against the programs that people reach for: error and time on the same scans, in one run.

The peers are given the scan's true centre, baseline and drift, and all but DeerLab and
inference-tools choose their settings by the G that is looked for (see tests/helpers/peers.py); ours
is given the scan.  Whether our band holds discs drawn at random is in the estimator's own study.

Set MEMSCAL_FULL_STUDY for 40 seeds in place of a few, of discs drawn at random 100.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from time import perf_counter

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.estimation_study import CASES as STUDIED
from helpers.peers import PEERS, RADII, Kernel
from helpers.scans import plane_error

import memscal
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan

pytestmark = pytest.mark.benchmark

METHOD = "evidence"
# A disc's error has two humps, where it is taken for a Gaussian and where it is not: few seeds
# tell neither.
SEEDS = {"discs at random": 100 if FULL else 24, "disc": 40 if FULL else 24}
FACTORS = {"discs at random": 1.2}
"""How much larger than a peer's our error may be: of sharp edges that the film hides most of."""
OURS = "memscal"
INSTALLED = [peer for peer in PEERS if find_spec(peer)]


OTHERS = ("mixture", "ring", "disc", "discs at random")
NAMES = [
    *list(STUDIED)[:9],
    *(next(name for name, case in STUDIED.items() if case.kind == kind) for kind in OTHERS),
]
"""Gaussians of three widths at three noises, and one sensor of each other kind."""


def seeds_of(name: str) -> int:
    return SEEDS.get(STUDIED[name].kind, 40 if FULL else 6)


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
    case = STUDIED[name]
    runners: dict[str, Callable[[Scan, Kernel], FloatArray]] = {OURS: ours}
    runners |= {peer: PEERS[peer] for peer in INSTALLED}
    rows: dict[str, list[tuple[float, float]]] = {runner: [] for runner in runners}
    for seed in (0, *range(seeds_of(name))):
        scan, kernel = case.scan(seed), case.drawn(seed)[0]
        for runner, find in runners.items():
            start = perf_counter()
            found = find(scan, kernel)
            seconds = perf_counter() - start
            rows[runner].append((plane_error(RADII, found, kernel.radial(RADII)), seconds))
    # The first round warms up: it imports and fills caches.
    return {runner: Outcome(*np.median(row[1:], axis=0)) for runner, row in rows.items()}


def lines(names: set[str]) -> Iterator[str]:
    """The table of the cases that were run."""
    runners = [OURS, *INSTALLED]
    yield "Median error of G (and time over ours)"
    yield " " * 48 + "".join(f"{runner:>16}" for runner in runners)
    for name in [name for name in NAMES if name in names]:
        found = study(name)
        cells = (
            f"{found[runner].error:.3f} ({found[runner].seconds / found[OURS].seconds:.2f})"
            for runner in runners
        )
        yield f"{name:<48}" + "".join(f"{cell:>16}" for cell in cells)


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
@pytest.mark.parametrize("name", NAMES)
def test_g_is_found_better_than_by(peer: str, name: str, table: set[str]) -> None:
    pytest.importorskip(peer, reason=f"{peer}, a program to compare with, is not installed")
    table.add(name)
    found = study(name)
    assert found[OURS].error < FACTORS.get(STUDIED[name].kind, 1.0) * found[peer].error
