"""``memscal check``: safety, schema, digest and content of a file."""

from pathlib import Path

import click

from memscal.cli.failures import DONE, REFUSED, debug_option
from memscal.cli.options import FILE, json_option
from memscal.cli.output import emit_json, emit_tables, error
from memscal.summaries.table import Table

EXAMPLES = """\b
Examples:
  memscal check scan.apparatus.h5
  memscal check scan.h5 --json
"""


@click.command("check", epilog=EXAMPLES)
@click.argument("file", type=FILE)
@json_option
@debug_option
def command(file: Path, as_json: bool) -> int:
    """Check that a file is safe to read, follows its schema, and is as it was written.

    Exit code 0: the file is in order. Exit code 3: it is not, and would be refused as an input.
    Whether a calibration's own quality checks passed is shown by memscal inspect.
    """
    from memscal.formats.inspection import check

    findings = check(file)
    passed = all(finding.passed for finding in findings)
    problem = f"{file} is not in order: see {findings[-1].name}."
    if as_json:
        report = {
            "schema_version": "1",
            "file": str(file),
            "passed": passed,
            "findings": [vars(finding) for finding in findings],
        }
        if not passed:
            refusal = {"class": "FormatError", "problem": problem, "why": "", "cure": ""}
            report["error"] = refusal | {"exit_code": REFUSED}
        emit_json(report)
    else:
        rows = [(f.name, "passed" if f.passed else "FAILED", f.meaning) for f in findings]
        failed = frozenset(i for i, f in enumerate(findings) if not f.passed)
        emit_tables(Table(str(file), ("step", "result", "finding"), rows, failed))
    if passed:
        return DONE
    error(problem)
    return REFUSED
