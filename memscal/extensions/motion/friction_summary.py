"""Comparisons with sliding contacts, as tables and a mapping."""

from memscal.extensions.motion.compare_sliding import SlidingComparison
from memscal.model import records
from memscal.model.arrays import Values
from memscal.model.quantities import MM, by_name
from memscal.summaries import comparison as comparisons
from memscal.summaries.comparison import correlated as correlated
from memscal.summaries.comparison import frame as frame
from memscal.summaries.declared import members, plain
from memscal.summaries.table import Table, checks_json, checks_table, verdict, worst_checks

_SPEED = by_name(records.SLIDING.quantities)["speed"]
_UM = 1e-6


def _speeds(comparison: SlidingComparison) -> list[tuple[str, str, str]]:
    """Return speed, lubrication and friction in words."""
    return [
        (f"{speed / MM:.4g} mm/s", state, str(found))
        for (state, speed), found in comparison.speeds.items()
    ]


def answer(comparison: SlidingComparison) -> str:
    """Return the coefficient of all passes, or of each speed, and how the checks stand."""
    if not comparison.speeds:
        return comparisons.answer(comparison)
    lines = [
        f"At {speed}{', ' if state else ''}{state}: μ = {found}."
        for speed, state, found in _speeds(comparison)
    ]
    return "\n".join([*lines, verdict(comparison.checks)])


def tables(comparison: SlidingComparison) -> list[Table]:
    """Return the friction by load and by speed, its budget, and the checks."""
    head = ("speed", "state", "friction")
    return [
        *comparisons.tables(comparison),
        Table("Sliding friction by speed [95 % interval]", head, _speeds(comparison), labels=2),
        checks_table(worst_checks(comparison.checks)),
    ]


def mapping(comparison: SlidingComparison) -> Values:
    """Return what ``compare --sliding --json`` prints but for files."""
    speeds = []
    for (lubrication, speed), found in comparison.speeds.items():
        place = {"lubrication": lubrication, **members([_SPEED], None, speed=speed)}
        speeds.append(place | comparisons.estimate_json(comparison, found))
    return comparisons.mapping(comparison) | {
        "backlash": {"standard_uncertainty": plain(comparison.backlash, _UM), "unit": "um"},
        "speeds": speeds,
        "checks": checks_json(comparison.checks),
        "overridden": list(comparison.measured.overridden),
    }
