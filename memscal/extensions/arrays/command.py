"""``memscal locate``: where contacts press on an array of sensors, and how strongly."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.options import (
    FILE,
    NonNegative,
    Quantity,
    indenter_from,
    option,
    output_options,
)
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal locate array.h5 frames.csv -o contacts.csv
  memscal locate array.h5 frames.csv --indenter rod:0.25 --shear 0 -o contacts.csv
  memscal locate array.h5 frames.csv --indenter sphere:5 --rest rest.csv
"""


def _indenter(ctx: click.Context, param: click.Parameter, text: str) -> Any:
    """Read an indenter: ``point``, ``rod:MM`` or ``sphere:MM``."""
    shape, _, radius = text.partition(":")
    if text == "point":
        return text
    if shape not in ("rod", "sphere") or not radius:
        raise click.BadParameter(f"{text!r} is not point, rod:MM or sphere:MM.", ctx, param)
    return indenter_from(shape, {"radius": Quantity("mm").convert(radius, param, ctx)})


@click.command("locate", epilog=EXAMPLES)
@click.argument("array", type=FILE)
@click.argument("frames", type=FILE)
@option("--indenter", "point|rod:MM|sphere:MM", "point", callback=_indenter)(
    "What presses: a point, or a rod or a sphere of a radius in mm (not the diameter)."
)
@option("--shear", NonNegative("ratio"), 0.3)(
    "Standard deviation of the shear over the normal force along each axis; 0: there is none."
)
@option("--rest", FILE, metavar="rest.csv")(
    "Frames without contact, whose mean is subtracted; without them frames are tared."
)
@option("-o --output", out.FigurePath((".csv",)), metavar="contacts.csv")(
    "Table to write: place and force of each frame, with uncertainties and flags."
)
@output_options
def command(
    array: Path, frames: Path, rest: Path | None, output: Path | None, **options: Any
) -> None:
    """Find where contacts press on a calibrated ARRAY in each of the FRAMES, and how strongly.

    FRAMES is a table with a row for each frame and a column for each sensor, named after it, with
    its unit: "T00 [mV]". A column "frame" or "t" is carried over. An empty cell is a missing
    reading. One contact is sought in each frame.
    """
    out.prove_writable([output], force=options["force"], inputs=[array, frames, rest])
    from memscal.extensions.arrays.contacts_summary import csv_text
    from memscal.extensions.arrays.frames import read_frames
    from memscal.extensions.arrays.sensor_array import load_array

    held = load_array(array)
    u, carried = read_frames(held, frames)
    zero = None if rest is None else read_frames(held, rest)[0]
    with out.working("Locating"):
        contacts = held.locate(u, options["indenter"], options["shear"], zero)
    contacts = replace(contacts, **carried)
    files = {} if output is None else {output: csv_text(contacts).encode("utf-8")}
    with together():
        out.write_files(files, force=options["force"])
        head = {"contacts": output and str(output)}
        out.emit_result(contacts, head, as_json=options["as_json"])
    out.say_written(files)
