"""How much of the campaign runs, and the table of what was found."""

import os
from collections import Counter

#: Share of the whole campaign; none of it is the reduced form, which every run of the tests takes.
SHARE = float(os.environ.get("MEMSCAL_ROBUSTNESS") or 0.0)
#: Outcomes by what was tried.
COUNTS = {}


def number(reduced, whole):
    """Return how many inputs, runs or bits a test draws."""
    return max(reduced, round(SHARE * whole))


def count(tried, outcome):
    """Count an outcome."""
    COUNTS.setdefault(tried, Counter())[outcome] += 1


def table():
    """Return the lines of the table in docs/robustness.md."""
    lines = ["| Tried | Number | Outcomes |", "| --- | ---: | --- |"]
    for tried, outcomes in sorted(COUNTS.items()):
        shares = ", ".join(f"{outcome}: {times}" for outcome, times in sorted(outcomes.items()))
        lines.append(f"| {tried} | {outcomes.total():,} | {shares} |")
    return lines
