"""Print the tables of the estimator's accuracy that stand in docs/estimation.md.

Run it in a checkout where memscal and its tests' requirements are installed:
``python docs/estimation_table.py [seeds] [pattern]``: how many seeds each case has, and a part of
the names of the cases to run (a regular expression), after which each case's band by radius
follows.
"""

from __future__ import annotations

import re
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
    FULL_SEEDS,
    RADII,
    mean_coverage,
    mean_efficiency,
    study,
)

if TYPE_CHECKING:
    from helpers.estimation_study import Case, Outcome

PROCESSES = 2
HEAD = (
    "| G (lengths in mm) | noise (%) | step (mm) | repeats | off | error of G | limit | worst "
    "| bias of G | G, mean (%) | lowest (%) | at (mm) | largest (%) | error / u of G "
    "| bias of A (%) | bias of A (u) | rms z of A | RMS of A / bound | "
    + " | ".join(f"{band} (%)" for band in BANDS)
    + " | does not hold |",
    "|:---|" + "---:|" * 3 + ":---:|" + "---:|" * (13 + len(BANDS)) + ":---|",
)


def setting(case: Case) -> list[str]:
    """Return the cells that say what a case is."""
    numbers = [f"{x:g}" for x in (case.step * 1e3, case.repeats)]
    return [case.label, case.percent, *numbers, "yes" if case.off else "no"]


def row(outcome: Outcome) -> str:
    """Return the row of a case."""
    case, held, ratio = outcome.case, outcome.held, outcome.ratio
    cells = [
        *setting(case),
        f"{outcome.median:.3f}",
        f"{case.limit:g}",
        f"{outcome.worst:.3f}" + (f" ({outcome.beyond})" if outcome.beyond else ""),
        f"{outcome.bias_g:.3f}",
        f"{100 * held.mean():.1f}",
        f"{100 * held.min():.1f}",
        f"{1e3 * RADII[held.argmin()]:.1f}",
        f"{100 * held.max():.1f}",
        f"{ratio.min():.2f} to {ratio.max():.2f}",
        f"{100 * outcome.a.mean():+.2f}",
        f"{outcome.bias:+.2f}",
        f"{outcome.z:.2f}",
        "" if case.bound is None else f"{outcome.rms / case.bound:.2f}",
        *(
            f"{100 * outcome.coverage(band)[0]:.1f}" if band in outcome.covered else ""
            for band in BANDS
        ),
        ", ".join(sorted(outcome.exceeded())),
    ]
    return "| " + " | ".join(cells) + " |"


def by_radius(outcomes: list[Outcome]) -> list[str]:
    """Return the coverage of each case's band of G at every radius, in %."""
    radii = " | ".join(f"{1e3 * r:.1f}" for r in RADII)
    lines = [f"| band of G (%) at (mm) | {radii} |", "|:---|" + "---:|" * RADII.size]
    for outcome in outcomes:
        shares = " | ".join(f"{100 * share:.0f}" for share in outcome.held)
        lines.append(f"| {outcome.case.name} | {shares} |")
    return lines


def means(outcomes: list[Outcome]) -> list[str]:
    """Return what holds of all cases together: coverage of each band, and efficiency of A."""
    rows = ["| of all cases together | found |", "|:---|---:|"]
    rows += [
        f"| coverage of {band} (%) | {100 * mean_coverage(outcomes, band)[0]:.1f} |"
        for band in BANDS
        if any(band in outcome.covered for outcome in outcomes)
    ]
    if any(outcome.case.bound for outcome in outcomes):
        rows.append(f"| RMS of A / bound, G Gaussian | {mean_efficiency(outcomes)[0]:.2f} |")
    return rows


def main(seeds: int, pattern: str) -> None:
    """Calibrate all scans of the cases, and print the tables."""
    names = [name for name in CASES if re.search(pattern, name)]
    with get_context("spawn").Pool(PROCESSES) as pool:
        outcomes = pool.map(partial(study, seeds=seeds), names, chunksize=1)
    lines = [*HEAD, *(row(outcome) for outcome in outcomes), "", *means(outcomes)]
    lines += ["", *by_radius(outcomes)]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else FULL_SEEDS,
        sys.argv[2] if len(sys.argv) > 2 else "",
    )
