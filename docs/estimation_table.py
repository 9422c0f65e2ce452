"""Print the study of the estimator's accuracy, as docs/estimation_study.csv holds it.

Run it in a checkout where memscal and its tests' requirements are installed:
``python docs/estimation_table.py [seeds] [pattern] > docs/estimation_study.csv``: how many seeds
each case has, and a regular expression for the names of the cases to run.  The coverage at each
radius and the averages of all cases, which docs/accuracy.md states, go to standard error.
"""

from __future__ import annotations

import csv
import re
import sys
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

# The cases are the tests' own, so that the table and the tests speak of the same scans.
sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import numpy as np
from helpers.bounds import root_mean_square
from helpers.estimation_study import (
    BANDS,
    CASES,
    EFFICIENCY,
    FULL_SEEDS,
    MEAN_COVERAGE,
    RADII,
    mean_coverage,
    mean_efficiency,
    study,
)

if TYPE_CHECKING:
    from helpers.estimation_study import Case, Outcome

PROCESSES = 2
HEAD = [
    *("G (lengths in mm)", "noise (%)", "step (mm)", "repeats", "off"),
    *("error of G", "limit", "worst", "bias of G (u)", "error / u of G"),
    *("G (%)", "lowest (%)", "at (mm)", "bias of A (%)", "bias of A (u)", "RMS of A / bound"),
    *("A (%)", "z of A", "σ (%)", "z of σ", "FWHM (%)", "z of FWHM", "does not hold"),
]


def setting(case: Case) -> list[str]:
    """Return the cells that say what a case is."""
    numbers = [f"{x:g}" for x in (case.step * 1e3, case.repeats)]
    return [case.label, case.percent, *numbers, "yes" if case.off else "no"]


def row(outcome: Outcome) -> list[str]:
    """Return the cells of a case."""
    case, ratio, held = outcome.case, outcome.ratio, outcome.held.mean(axis=0)
    beyond = outcome.beyond(case.goal)
    cells = [
        *setting(case),
        f"{np.median(outcome.g):.3f}",
        f"{case.largest_error(case.goal):g}",
        f"{outcome.g.max():.3f}" + (f" ({beyond})" if beyond else ""),
        f"{np.abs(outcome.bias_g[0]).max():.2f}",
        f"{ratio.min():.2f} to {ratio.max():.2f}",
        *(f"{100 * share:.1f}" for share in (held.mean(), held.min())),
        f"{1e3 * RADII[held.argmin()]:.1f}",
        f"{100 * outcome.a.mean():+.2f}",
        f"{outcome.z['A'].mean():+.2f}",
        "" if case.bound is None else f"{root_mean_square(outcome.a) / case.bound:.2f}",
    ]
    for band in BANDS:
        stated = band in outcome.z
        cells.append(f"{100 * outcome.coverage(band)[0]:.1f}" if stated else "")
        cells.append(f"{root_mean_square(outcome.z[band]):.2f}" if stated else "")
    return [*cells, ", ".join(outcome.exceeded(case.goal))]


def by_radius(outcomes: list[Outcome]) -> list[str]:
    """Return the coverage (%) of the band of G at every radius, of each kind of case."""
    kinds: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        kinds.setdefault(outcome.case.kind, []).append(outcome)
    lines = ["G at (mm): " + ", ".join(f"{1e3 * r:.1f}" for r in RADII)]
    for kind, together in kinds.items():
        coverage = np.mean([outcome.held.mean(axis=0) for outcome in together], axis=0)
        lines.append(f"{kind}: " + ", ".join(f"{100 * share:.0f}" for share in coverage))
    return lines


def means(outcomes: list[Outcome]) -> list[str]:
    """Return what holds of all cases together: coverage of each band, and efficiency of A."""
    lines = []
    for band, (low, high) in MEAN_COVERAGE.items():
        share = 100 * mean_coverage(outcomes, band)[0]
        lines.append(f"coverage of {band}: {share:.1f} %, limits {100 * low:g} to {100 * high:g}")
    ratio, _ = mean_efficiency(outcomes)
    lines.append(f"RMS of A / bound, G Gaussian: {ratio:.2f}, limit {EFFICIENCY:g}")
    return lines


def main(seeds: int, pattern: str) -> None:
    """Calibrate all scans of the cases, and print the tables."""
    names = [name for name in CASES if re.search(pattern, name)]
    with get_context("spawn").Pool(PROCESSES) as pool:
        outcomes = pool.map(partial(study, seeds=seeds), names, chunksize=1)
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(HEAD)
    table.writerows(row(outcome) for outcome in outcomes)
    lines = by_radius(outcomes) if pattern else [*by_radius(outcomes), *means(outcomes)]
    sys.stderr.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else FULL_SEEDS,
        sys.argv[2] if len(sys.argv) > 2 else "",
    )
