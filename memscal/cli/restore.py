"""``memscal restore``: a scan and a calibrated sensor to the stress at the base of the film."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from memscal.cli.failures import debug_option
from memscal.cli.options import FILE, force_option, json_option
from memscal.cli.output import (
    FigurePath,
    emit_json,
    message,
    note,
    prove_writable,
    show_messages,
    working,
)

if TYPE_CHECKING:
    from memscal.measurement.restoration import Comparison, Restoration
    from memscal.model.scan import Scan

__all__ = ["command"]

EXAMPLES = """\b
Examples:
  memscal restore sensor.apparatus.h5 sphere.h5
  memscal restore sensor.apparatus.h5 sphere.h5 -o stress.h5 --figure stress.png
  memscal restore sensor.apparatus.h5 sphere.h5 --expected sticking.h5 --json
"""


@click.command("restore", epilog=EXAMPLES)
@click.argument("artifact", type=FILE)
@click.argument("scan", type=FILE)
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="OUT",
    help="Reference file to write (memscal-reference): the restored stress with its uncertainty.",
)
@click.option(
    "--expected",
    type=FILE,
    metavar="FILE",
    help="A calculated stress at the base (memscal-reference), such as memscal reference writes: "
    "adds the check expected_stress. By default the scan's indenter is pressed on its film without "
    "friction, to be shown beside the result.",
)
@click.option(
    "--figure",
    "figures",
    type=FigurePath(),
    multiple=True,
    metavar="FILE.png|svg|pdf",
    help="Draw the restored, the measured and the calculated stress, and residuals. May be "
    "repeated.",
)
@json_option
@force_option
@debug_option
def command(
    artifact: Path,
    scan: Path,
    output: Path | None,
    expected: Path | None,
    figures: tuple[Path, ...],
    as_json: bool,
    force: bool,
) -> int:
    """Restore the stress at the base of a film from a SCAN with a calibrated sensor (ARTIFACT).

    Takes the sensor's conversion constant A and apparatus function G as known, and finds the
    radial stress that explains the voltages, with its standard uncertainty, total force and
    quality checks. No contact is calculated for it: only the film's elasticity is used.

    A failed quality check is exit code 1: the result is written all the same.
    """
    from memscal.apparatus import load_apparatus
    from memscal.formats.reference import read_reference
    from memscal.formats.scan import read_scan

    known, data = load_apparatus(artifact), read_scan(scan)
    wanted = None if expected is None else read_reference(expected)
    files = [path for path in (output, *figures) if path is not None]
    prove_writable(files, force=force, inputs=[p for p in (artifact, scan, expected) if p])

    from memscal.measurement.restore import restore

    with working("Restoring"):
        found = restore(data, known, expected=wanted)
        compared = found.comparison or _calculated(found, data)
    with working("Drawing"):
        ready = _rendered(found, compared, figures)
    if output is not None:
        from memscal.formats.reference import write_reference

        write_reference(found.profile(), output, overwrite=force)
    if ready:
        from memscal.formats.files import atomic_write_bytes

        for path, content in ready.items():
            atomic_write_bytes(path, content, overwrite=force)
    return _tell(found, compared, output, files, as_json)


def _calculated(found: Restoration, scan: Scan) -> Comparison | None:
    """Compare with the frictionless contact; one that has no solution is left out."""
    from memscal.errors import MemscalError
    from memscal.mechanics.indent import indent

    try:
        return found.compare(indent(scan.film, scan.indenter, load=scan.load))
    except MemscalError as failure:
        note(f"No contact is shown beside the result: {failure.problem}")
        return None


def _rendered(
    found: Restoration, compared: Comparison | None, figures: tuple[Path, ...]
) -> dict[Path, bytes]:
    if not figures:
        return {}
    from memscal.figures.stress import restoration_figure
    from memscal.figures.style import figure_format, render_figure

    figure = restoration_figure(found, compared)
    return {path: render_figure(figure, figure_format(path.suffix)) for path in figures}


def _tell(
    found: Restoration,
    compared: Comparison | None,
    output: Path | None,
    files: list[Path],
    as_json: bool,
) -> int:
    """Print the results and the messages; return the exit code."""
    from memscal.cli.failures import exit_code_of
    from memscal.cli.output import emit_tables
    from memscal.summaries.stress import restoration_json, restoration_tables

    if as_json:
        emit_json(restoration_json(found, compared, output))
    else:
        emit_tables(*restoration_tables(found, compared))
    show_messages(found.messages)
    for path in files:
        message(f"Written: {path}")
    return exit_code_of(found.checks)
