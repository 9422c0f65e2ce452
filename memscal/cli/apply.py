"""``memscal apply``: contact scans and a calibrated sensor to measured stress."""

from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.options import (
    artifact_argument,
    contact_options,
    figure_option,
    files_argument,
    out_option,
    report_options,
)

EXAMPLES = """\b
Examples:
  memscal apply sensor.apparatus.h5 sphere.h5
  memscal apply sensor.apparatus.h5 dry.h5 lubricated.h5 -o sphere.stress.h5 --figure sphere.png
  memscal apply sensor.apparatus.h5 sphere.h5 --report sphere.html --json --force
"""


@click.command("apply", epilog=EXAMPLES)
@artifact_argument
@files_argument()
@out_option("File to write (memscal-stress). By default beside the first scan: SCAN.stress.h5.")
@contact_options
@figure_option("Draw the profiles of all loads, linear and logarithmic.")
@report_options
def command(artifact: Path, scans: tuple[Path, ...], **options: Any) -> int:
    """Turn contact SCANs into measured stress with a calibrated sensor (ARTIFACT).

    For each load of each scan, finds centre and baseline and gives the profile S_zz = U/A at the
    base of the film with its standard uncertainty, its maximum, and its total force, which is
    compared with the applied load. S_zz is the stress as the sensor blurs it: compare it with
    calculated stress by memscal compare.

    A failed quality check is exit code 1: the result is written all the same.
    """
    from memscal.measurement.measure_stress import measure_stress

    written = options["output"] or out.default_name(scans[0], ".stress.h5")
    outputs = [written, *options["figures"], options["report"]]
    out.prove_writable(
        outputs, force=options["force"], inputs=[artifact, *scans, options["noise_record"]]
    )
    with out.working("Measuring"):
        names = ("noise_record", "override", "accept_altered")
        accepted = {name: options[name] for name in names}
        stress = measure_stress(scans, artifact, **accepted)
    out.deliver(stress, written, stress.save, options)
    return exit_code_of(stress.checks)
