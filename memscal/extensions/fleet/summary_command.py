"""``memscal summary``: the results of a batch as tables, a page and a figure."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.options import FILE, figure_option, option, output_options
from memscal.extensions.fleet.results import Tolerance
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal summary results
  memscal summary results -o fleet.html --figure fleet.png --force
  memscal summary results --tolerance A=2%,sigma=0.8+-3%
"""
_NUMBER = r"(\d+\.?\d*(?:e-?\d+)?)"
_TOLERANCE = re.compile(rf"(A|sigma)=(?:{_NUMBER}(?:\+-|±))?{_NUMBER}%")


def _tolerances(*given: Any) -> dict[str, Tolerance]:
    """Read tolerances, ``A=2%,sigma=0.8+-3%``."""
    if given[-1] is None:
        return {}
    parts = given[-1].split(",")
    found = filter(None, map(_TOLERANCE.fullmatch, parts))
    tolerances = {m[1]: Tolerance(float(m[3]) / 100, float(m[2]) if m[2] else None) for m in found}
    if len(tolerances) < len(parts):
        raise click.BadParameter(
            f"{given[-1]!r} does not state tolerances. Known are A and sigma, each once: write "
            "A=2%,sigma=3% (of the median) or sigma=0.8+-3% (of 0.8 mm), with decimal points."
        )
    return tolerances


@click.command("summary", epilog=EXAMPLES)
@click.argument("results", type=FILE, metavar="RESULTS")
@option("-o --output", FILE, metavar="FILE.html")(
    "Page to write, without other files, network or scripts.  [default: RESULTS/summary.html]"
)
@figure_option("Draw the distributions of A and sigma, and the maps of the wafer.")
@option("--tolerance tolerances", "LIMITS", callback=_tolerances)(
    "How far A and sigma may be from the median, A=2%,sigma=3%, or from a nominal value in mV/Pa "
    "(or the unit of the readings per Pa) and mm, sigma=0.8+-3%: yield, bins, and FILE.csv beside "
    "the page with pass or fail of each sensor. A failed check or an error fails, too."
)
@output_options
def command(
    results: Path,
    output: Path | None,
    figures: tuple[Path, ...],
    tolerances: dict[str, Tolerance],
    as_json: bool,
    force: bool,
) -> None:
    """Summarise the results that memscal batch wrote to the folder RESULTS.

    Shows how A (mV/Pa) and sigma (mm) are distributed, which sensors are outliers and why (the
    distance from the wafer's smooth trend, or the median, in robust standard deviations, failed
    checks), how often each check failed, the errors by class and first sentence, and A over the
    wafer where the places are known.
    """
    from memscal.extensions.fleet.shards import read_fleet
    from memscal.extensions.fleet.tolerance import prober_table

    output = output or results / "summary.html"
    table = output.with_suffix(".csv") if tolerances else None
    fleet = replace(read_fleet(results), tolerances=tolerances)
    out.prove_writable([output, table, *figures], force=force)
    files = out.drawn(fleet, figures, output)
    if table:
        files[table] = prober_table(fleet)
    with together():
        out.write_files(files, force=force)
        head = {"page": str(output), "prober_table": table and str(table)}
        out.emit_result(fleet, head, as_json=as_json)
    out.show_messages(fleet.messages)
    out.say_written(files)
