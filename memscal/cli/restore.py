"""``memscal restore``: a scan and a calibrated sensor to the stress at the base of the film."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.options import FILE, Quantity, accept_altered_option, option, report_options
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal restore sensor.apparatus.h5 sphere.h5
  memscal restore sensor.apparatus.h5 sphere.h5 --load 1.37 -o stress.h5 --figure stress.png
  memscal restore sensor.apparatus.h5 sphere.h5 --report stress.html
  memscal restore sensor.apparatus.h5 sphere.h5 --expected sticking.h5 --json
"""


@click.command("restore", epilog=EXAMPLES)
@click.argument("artifact", type=FILE)
@click.argument("scan", type=FILE)
@option("-o --output", FILE, metavar="OUT")(
    "Reference file to write (memscal-reference): the restored stress with its uncertainty."
)
@option("--expected", FILE, metavar="FILE")(
    "A calculated stress at the base (memscal-reference), such as memscal reference writes: "
    "adds the check expected_stress. By default the scan's indenter is pressed on its film without "
    "friction, to be shown beside the result."
)
@option("--load", Quantity("N"))("Which load of a scan of several is restored, in N.")
@option("--override", is_flag=True)(
    "Go on although sensor, channel or film of artifact and scan differ: recorded in the output."
)
@accept_altered_option
@option("--figure figures", out.FigurePath(), multiple=True, metavar="FILE.png|svg|pdf")(
    "Draw the restored, the measured and the calculated stress, and residuals. May be repeated."
)
@report_options
def command(artifact: Path, scan: Path, as_json: bool, force: bool, **options: Any) -> int:
    """Restore the stress at the base of a film from a SCAN with a calibrated sensor (ARTIFACT).

    Takes the sensor's conversion constant A and apparatus function G as known, and finds the
    radial stress that explains the voltages, with its standard uncertainty, total force and
    quality checks. No contact is calculated for it: only the film's elasticity is used.

    A failed quality check is exit code 1: the result is written all the same.
    """
    from memscal.apparatus import load_apparatus
    from memscal.formats.reference import read_reference, write_reference
    from memscal.formats.scan import read_scan

    output, expected, figures, report = (
        options[name] for name in ("output", "expected", "figures", "report")
    )
    accepted = {"accept_altered": options["accept_altered"]}
    apparatus = load_apparatus(artifact, **accepted)
    data = read_scan(scan, **accepted)
    stress = None if expected is None else read_reference(expected, **accepted)
    inputs = [path for path in (artifact, scan, expected) if path is not None]
    out.prove_writable([output, *figures, report], force=force, inputs=inputs)

    from memscal.errors import MemscalError
    from memscal.measurement.restore import restore
    from memscal.mechanics.press_rod import press_rod

    with out.working("Restoring"):
        settings = {name: options[name] for name in ("load", "override")}
        restored = restore(data, apparatus, expected=stress, **settings)
        if stress is None:
            # The calculated contact is shown beside it; one that has no solution is left out.
            try:
                contact = press_rod(*restored.scan.set_up)
                restored = replace(restored, comparison=restored.compare(contact))
            except MemscalError as failure:
                out.note(f"No contact is shown beside the result: {failure.problem}")
    with out.working("Drawing"):
        drawn = out.rendered(restored.plot, figures) | out.reported(restored, report)
    with together():
        if output is not None:
            write_reference(restored.profile(), output, overwrite=force)
        out.write_files(drawn, force=force)
        if as_json:
            written = None if output is None else str(output)
            out.emit_json({"schema_version": "1", "output": written, **restored.to_dict()})
        else:
            out.emit_result(restored, brief=options["brief"])
    out.show_messages(restored.messages)
    for path in (*filter(None, [output]), *drawn):
        out.message(f"Written: {path}")
    return exit_code_of(restored.checks)
