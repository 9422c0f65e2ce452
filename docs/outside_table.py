"""Print the study outside the model, as docs/outside_study.csv holds it.

Run it in a checkout where memscal and its tests' requirements are installed:
``python docs/outside_table.py > docs/outside_study.csv``.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

# The rows are the tests' own, so that the table and the tests speak of the same scans.
sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from helpers.outside_study import ROWS, SYMBOLS, outcome

if TYPE_CHECKING:
    from helpers.outside_study import Outcome

RUNS = 10
DRAWS = 20
HEAD = [
    *("not as stated", "wrong", "by 2 u at", "by 3 u at", "counted: rms z", "alarmed there"),
    *("named over found", "told by", "shown by"),
]


def cells(found: Outcome) -> list[str]:
    """Return the cells of a row."""
    row = found.row
    sizes = []
    for size in (found.two, found.three):
        shown = f"{size * row.per_unit:.2g} {row.unit}".strip()
        sizes.append(shown if math.isfinite(size) else "never")
    alarmed = ""
    if found.check:
        alarmed = f"{100 * found.alarmed:.0f} %: {found.check}"
    return [
        row.name,
        SYMBOLS[row.parameter],
        *sizes,
        " / ".join(f"{z:.1f}" for z in found.counted),
        alarmed,
        "" if found.named is None else f"{found.named:.2f}",
        ", ".join(found.told_by) or "nothing",
        row.shown_by,
    ]


def main() -> None:
    """Run all rows of the study, and print the table."""
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(HEAD)
    for row in ROWS.values():
        table.writerow(cells(outcome(row, RUNS, DRAWS)))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
