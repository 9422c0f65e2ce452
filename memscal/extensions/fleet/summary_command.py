"""``memscal summary``: the results of a batch as tables, a page and a figure."""

from pathlib import Path

import click

from memscal.cli import output as out
from memscal.cli.options import FILE, figure_option, option, output_options
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal summary results
  memscal summary results -o fleet.html --figure fleet.png --force
"""


@click.command("summary", epilog=EXAMPLES)
@click.argument("results", type=FILE, metavar="RESULTS")
@option("-o --output", FILE, metavar="FILE.html")(
    "Page to write, without other files, network or scripts.  [default: RESULTS/summary.html]"
)
@figure_option("Draw the distributions of A and sigma, and the maps of the wafer.")
@output_options
def command(
    results: Path, output: Path | None, figures: tuple[Path, ...], as_json: bool, force: bool
) -> None:
    """Summarise the results that memscal batch wrote to the folder RESULTS.

    Shows how A (mV/Pa) and sigma (mm) are distributed, which sensors are outliers and why (the
    distance from the wafer's smooth trend, or the median, in robust standard deviations, failed
    checks), how often each check failed, the errors by class and first sentence, and A and sigma
    over the wafer where the places are known.
    """
    from memscal.extensions.fleet.shards import read_fleet

    output = output or results / "summary.html"
    fleet = read_fleet(results)
    out.prove_writable([output, *figures], force=force)
    files = out.drawn(fleet, figures, output)
    with together():
        out.write_files(files, force=force)
        out.emit_result(fleet, {"page": str(output)}, as_json=as_json)
    out.show_messages(fleet.messages)
    out.say_written([output, *figures])
