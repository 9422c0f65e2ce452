"""``memscal summary``: the results of a batch as tables, a page and a figure."""

from pathlib import Path

import click

from memscal.cli import output as out
from memscal.cli.failures import DONE
from memscal.cli.options import FILE, option, output_options
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
@option("--figure figures", out.FigurePath(), multiple=True, metavar="FILE.png|svg|pdf")(
    "Draw the distributions of A and sigma, failed checks and errors, and the map of the wafer. "
    "May be repeated."
)
@output_options
def command(
    results: Path, output: Path | None, figures: tuple[Path, ...], as_json: bool, force: bool
) -> int:
    """Summarise the results that memscal batch wrote to the folder RESULTS.

    Shows how A (mV/Pa) and sigma (mm) are distributed, which sensors are outliers and why (the
    distance from the median in robust standard deviations, failed checks), how often each check
    failed, the errors by class, and A over the wafer where the manifest gave the places.
    """
    from memscal.extensions.fleet.shards import read_fleet

    output = output or results / "summary.html"
    fleet = read_fleet(results)
    out.prove_writable([output, *figures], force=force)
    with out.working("Drawing"):
        contents = out.reported(fleet, output) | out.rendered(fleet.plot, figures)
    with together():
        out.write_files(contents, force=force)
        if as_json:
            out.emit_json({"schema_version": "1", "page": str(output), **fleet.to_dict()})
        else:
            out.emit_tables(*fleet.tables())
    out.show_messages(fleet.messages)
    for path in contents:
        out.message(f"Written: {path}")
    return DONE
