"""Print the table of the estimator's accuracy that stands in docs/estimation.md.

Run it in a checkout where memscal and its tests' requirements are installed:
``python docs/estimation_table.py``.  A number after it is how many seeds each case has.
"""

from __future__ import annotations

import sys
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

# The cases are the tests' own, so that the table and the tests speak of the same scans.
sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from helpers.estimation_study import (
    BANDS,
    CASES,
    EFFICIENCY,
    FULL_SEEDS,
    MEAN_COVERAGE,
    mean_coverage,
    mean_efficiency,
    study,
)

if TYPE_CHECKING:
    from helpers.estimation_study import Case, Outcome

PROCESSES = 2
HEAD = (
    "| G (lengths in mm) | noise (%) | step (mm) | repeats | off | error of G | limit | worst "
    "| bias of A (u) | RMS of A / bound | "
    + " | ".join(f"{band} (%)" for band in BANDS)
    + " | does not hold |",
    "|:---|" + "---:|" * 3 + ":---:|" + "---:|" * (5 + len(BANDS)) + ":---|",
)


def setting(case: Case) -> list[str]:
    """Return the cells that say what a case is."""
    numbers = [f"{x:g}" for x in (case.noise * 100, case.step * 1e3, case.repeats)]
    return [case.label, *numbers, "yes" if case.off else "no"]


def row(outcome: Outcome) -> str:
    """Return the row of a case."""
    case = outcome.case
    cells = [
        *setting(case),
        f"{outcome.median:.3f}",
        "" if case.limit is None else f"{case.limit:g}",
        f"{outcome.worst:.3f}" + (f" ({outcome.beyond})" if outcome.beyond else ""),
        f"{outcome.bias:+.2f}",
        "" if case.bound is None else f"{outcome.rms / case.bound:.2f}",
        *(
            f"{100 * outcome.coverage(band)[0]:.1f}" if band in outcome.covered else ""
            for band in BANDS
        ),
        ", ".join(sorted(outcome.exceeded())),
    ]
    return "| " + " | ".join(cells) + " |"


def means(outcomes: list[Outcome]) -> list[str]:
    """Return what holds of all cases together: coverage of each band, and efficiency of A."""
    rows = ["| of all cases together | found | limit | does not hold |", "|:---|---:|---:|:---|"]
    low, high = (100 * share for share in MEAN_COVERAGE)
    for band in BANDS:
        share = 100 * mean_coverage(outcomes, band)[0]
        fault = "too narrow" if share < low else "too wide" if share > high else ""
        rows.append(f"| coverage of {band} (%) | {share:.1f} | {low:g} to {high:g} | {fault} |")
    ratio, _ = mean_efficiency(outcomes)
    fault = "above" if ratio > EFFICIENCY else ""
    rows.append(f"| RMS of A / bound, G Gaussian | {ratio:.2f} | {EFFICIENCY:g} | {fault} |")
    return rows


def main(seeds: int) -> None:
    """Calibrate all scans of all cases, and print the table and the averages."""
    with get_context("spawn").Pool(PROCESSES) as pool:
        outcomes = pool.map(partial(study, seeds=seeds), CASES, chunksize=1)
    lines = [*HEAD, *(row(outcome) for outcome in outcomes), "", *means(outcomes)]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else FULL_SEEDS)
