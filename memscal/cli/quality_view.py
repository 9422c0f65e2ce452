"""Quality checks as every command shows them: a table, JSON, and the exit code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from memscal.cli.failures import CHECK_FAILED, DONE
from memscal.cli.output import finite, warn
from memscal.cli.tables import Table
from memscal.model.checks import QualityCheck

__all__ = ["checks_json", "checks_table", "exit_code_of"]


def checks_table(checks: Sequence[QualityCheck]) -> Table:
    """Return quality checks with value and limit, and the chance of such a value where known."""
    rows = [
        (
            check.name.replace("_", " "),
            f"{check.value:.3g}",
            f"{check.limit:.3g}",
            "" if check.p_value is None else f"{check.p_value:.2g}",
            "passed" if check.passed else "FAILED",
        )
        for check in checks
    ]
    failed = frozenset(i for i, check in enumerate(checks) if not check.passed)
    return Table("Quality checks", ("check", "value", "limit", "p", "result"), rows, failed)


def checks_json(checks: Sequence[QualityCheck]) -> list[dict[str, Any]]:
    """Return the entry ``checks`` of a command's JSON object."""
    return [
        {
            "name": check.name,
            "value": finite(check.value),
            "limit": finite(check.limit),
            "passed": check.passed,
            "p_value": None if check.p_value is None else finite(check.p_value),
        }
        for check in checks
    ]


def exit_code_of(
    checks: Sequence[QualityCheck], named: Sequence[str] | None = None, then: str = ""
) -> int:
    """Return the exit code that quality checks give; warn of those that failed.

    Parameters
    ----------
    checks : sequence of QualityCheck
        All checks.
    named : sequence of str, optional
        How those that failed are told; by default, each by its name.
    then : str
        What to say after that.
    """
    failed = [check.name for check in checks if not check.passed]
    if not failed:
        return DONE
    count = "A quality check" if len(failed) == 1 else f"{len(failed)} quality checks"
    words = ", ".join(name.replace("_", " ") for name in (failed if named is None else named))
    warn(f"{count} failed ({words}).{then}")
    return CHECK_FAILED
