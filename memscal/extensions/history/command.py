"""``memscal history``: whether a sensor has changed, and when it is to be calibrated again."""

import re
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.failures import CHECK_FAILED, DONE
from memscal.cli.options import (
    FILE,
    figure_option,
    files_argument,
    option,
    output_options,
    repeatable,
)
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal history w7_*.apparatus.h5
  memscal history w7_*.apparatus.h5 -o history.html --tolerance A=1% --figure history.png
  memscal history w7_*.apparatus.h5 --repair 2026-03-01 --json
"""


def _tolerance(*given: str) -> float:
    """Read a tolerance, ``A=2%``."""
    found = re.fullmatch(r"A=(\d+\.?\d*)%", given[-1].replace(" ", ""))
    if found is None:
        raise click.BadParameter(f"{given[-1]!r} is no tolerance of A: write A=2%.")
    return float(found[1]) / 100


@click.command("history", epilog=EXAMPLES)
@files_argument("ARTIFACT...", "artifacts")
@option("-o --output", FILE, metavar="FILE.html")(
    "Page to write, without other files, network or scripts."
)
@option("--tolerance", "A=PERCENT", "A=2%", callback=_tolerance)(
    "Change of A that is allowed until the next calibration."
)
@repeatable("--repair repairs", "DATE")(
    "Date of a repair, such as 2026-03-01: what is before it is shown, not tested. Repeated."
)
@figure_option("Draw A and sigma by date.")
@output_options
def command(
    artifacts: tuple[Path, ...],
    output: Path | None,
    figures: tuple[Path, ...],
    as_json: bool,
    force: bool,
    **options: Any,
) -> int:
    """Say whether a sensor has changed between its calibrations, and when the next one is due.

    ARTIFACT: the apparatus functions of one sensor, one for each date. Errors that they share,
    through a film, indenter, load cell or stage of the same name, cancel. The exit code is 1 where
    a change is significant. Of one date, E_n compares methods, rods or laboratories pair by pair.
    """
    from memscal.extensions.history.history import history

    out.prove_writable([output, *figures], force=force, inputs=artifacts)
    found = history(artifacts, **options)
    files = out.drawn(found, figures, output)
    with together():
        out.write_files(files, force=force)
        out.emit_result(found, {"page": output and str(output)}, as_json=as_json)
    out.show_messages(found.messages)
    out.say_written(files)
    return CHECK_FAILED if found.changed else DONE
