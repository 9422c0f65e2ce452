"""``memscal creep``: the creep of a sensor, from its readings while an indenter rests on it."""

from functools import partial
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.import_ import stated_options
from memscal.cli.options import FILE, figure_option, option, report_options

EXAMPLES = """\b
Examples:
  memscal creep dwell.csv --time t --time-unit s --u U --u-unit mV -o creep.h5
  memscal creep dwell.h5 -o creep.h5 --json --figure creep.png
"""


@click.command("creep", epilog=EXAMPLES)
@click.argument("record", type=FILE)
@option("-o --output", FILE, metavar="creep.h5", required=True)(
    "File to write (memscal-creep), for memscal calibrate --creep."
)
@option("--time", "COLUMN")("Table: column of the times.")
@option("--time-unit", "UNIT")("Table: unit of the times, where it states none.")
@option("--u", "COLUMN")("Table: column of the readings.")
@option("--u-unit", "UNIT")("Table: unit of the readings, where it states none.")
@figure_option("Draw the record with the creep that was found, and what is left.")
@report_options
def command(record: Path, output: Path, **options: Any) -> int:
    """Find the creep of a sensor in its readings while an indenter rests on it (RECORD).

    RECORD is a table with times and readings (--time, --u), or a memscal-scan along time alone that
    states its indenter. It begins at the contact, and its readings are zero without contact. Found
    are the share of the reading that comes late, its time, and the level at the end of the record.

    A record in which no creep is seen is refused, and the share that would have been seen is said.
    A failed quality check is exit code 1: the file is written and states it.
    """
    outputs = [output, options["report"], *options["figures"]]
    out.prove_writable(outputs, force=options["force"], inputs=[record])
    from memscal.extensions.motion.creep import creep_of, write_creep
    from memscal.formats.scan import read_scan
    from memscal.formats.tables.scan import import_table, records_of

    given = stated_options(options, ("time", "u", "time_unit", "u_unit"))
    columns = {"motion": "rest", **given}
    records = records_of(columns)
    dwell = import_table(record, **records, **columns) if given else read_scan(record)
    creep = creep_of(dwell)
    out.deliver(creep, output, partial(write_creep, creep), options, "creep")
    return exit_code_of(creep.checks, then=f" {output.name} was written and is marked so.")
