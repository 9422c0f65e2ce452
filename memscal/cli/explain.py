"""``memscal explain``: what a quality check tests, and what to do if it fails."""

import re

import click

from memscal.cli.failures import debug_option
from memscal.cli.options import json_option
from memscal.cli.output import emit_json, emit_tables
from memscal.model.checks import EXPLANATIONS
from memscal.summaries.table import Table

EXAMPLES = """\b
Examples:
  memscal explain
  memscal explain gaussian_misfit
  memscal explain "applied force 3"
"""


@click.command("explain", epilog=EXAMPLES)
@click.argument("check", required=False)
@json_option
@debug_option
def command(check: str | None, as_json: bool) -> None:
    """Explain a quality CHECK: what it tests, and what to do if it fails; without one, list all.

    Names are those of the tables, with blanks or underscores; a profile's number makes no
    difference.
    """
    names = list(EXPLANATIONS) if check is None else [_kind(check)]
    if as_json:
        checks = []
        for name in names:
            tests, cure = EXPLANATIONS[name]
            checks.append({"name": name, "tests": tests, "if_it_fails": cure})
        emit_json({"schema_version": "1", "checks": checks})
    elif check is None:
        rows = [(name.replace("_", " "), EXPLANATIONS[name][0]) for name in names]
        emit_tables(Table("Quality checks", ("check", "what it tests"), rows))
    else:
        tests, cure = EXPLANATIONS[names[0]]
        rows = [("what it tests", tests), ("if it fails", cure)]
        emit_tables(Table(names[0].replace("_", " "), ("", ""), rows))


def _kind(check: str) -> str:
    """Return the kind of a check, or refuse a name that no check has."""
    from difflib import get_close_matches

    name = re.sub(r"\W+", "_", check.strip().lower())
    # A number is that of a profile; joint_chi_square_dry is of a kind of loads.
    fitting = [kind for kind in EXPLANATIONS if f"{name}_".startswith(f"{kind}_")]
    if fitting:
        return max(fitting, key=len)
    close = get_close_matches(name, EXPLANATIONS)
    hint = f"Did you mean {' or '.join(close)}?" if close else "memscal explain lists all."
    raise click.UsageError(f"There is no check {check!r}. {hint}")
