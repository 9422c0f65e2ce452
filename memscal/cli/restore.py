"""``memscal restore``: a scan and a calibrated sensor to the stress at the base of the film."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.options import (
    FILE,
    Quantity,
    artifact_argument,
    contact_options,
    figure_option,
    option,
    out_option,
    report_options,
)
from memscal.errors import MemscalError

EXAMPLES = """\b
Examples:
  memscal restore sensor.apparatus.h5 sphere.h5
  memscal restore sensor.apparatus.h5 sphere.h5 --load 1.37 -o stress.h5 --figure stress.png
  memscal restore sensor.apparatus.h5 sphere.h5 --report stress.html
  memscal restore sensor.apparatus.h5 sphere.h5 --expected sticking.h5 --json
"""


@click.command("restore", epilog=EXAMPLES)
@artifact_argument
@click.argument("scan", type=FILE)
@out_option(
    "Reference file to write (memscal-reference): the restored stress with its uncertainty."
)
@option("--expected", FILE)(
    "A calculated stress at the base (memscal-reference), such as memscal reference writes: "
    "adds the check expected_stress. By default the scan's indenter is pressed on its film without "
    "friction, to be shown beside the result."
)
@option("--load", Quantity("N"))("Which load of a scan of several is restored, in N.")
@option("--direction", ["forth", "back"])(
    "Which direction is restored of a scan whose indenter slid forth and back."
)
@contact_options
@figure_option("Draw the restored, the measured and the calculated stress, and residuals.")
@report_options
def command(artifact: Path, scan: Path, **options: Any) -> int:
    """Restore the stress at the base of a film from a SCAN with a calibrated sensor (ARTIFACT).

    Takes the sensor's conversion constant A and apparatus function G as known, and finds the
    radial stress that explains the voltages, with its standard uncertainty, total force and
    quality checks. No contact is calculated for it: only the film's elasticity is used.

    A failed quality check is exit code 1: the result is written all the same.
    """
    from memscal.formats.reference import write_reference
    from memscal.measurement.restore import restore
    from memscal.mechanics.press_rod import press_rod

    output = options["output"]
    outputs = [output, *options["figures"], options["report"]]
    inputs = [artifact, scan, options["expected"], options["noise_record"]]
    out.prove_writable(outputs, force=options["force"], inputs=inputs)
    with out.working("Restoring"):
        names = ("expected", "load", "direction", "noise_record", "override", "accept_altered")
        settings = {name: options[name] for name in names}
        restored = restore(scan, artifact, **settings)
        if settings["expected"] is None and restored.scan.motion != "sliding":
            try:
                contact = press_rod(*restored.scan.set_up)
                restored = replace(restored, comparison=restored.compare(contact))
            except MemscalError as failure:
                out.note(f"No contact is shown beside the result: {failure.problem}")
    out.deliver(restored, output, partial(write_reference, restored.profile()), options)
    return exit_code_of(restored.checks)
