"""``memscal calibrate`` of the scan of an array, which is told by the names of its sensors."""

from pathlib import Path

import click
from click.core import ParameterSource

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.options import LAW

#: Options that the calibration of an array takes, and those of what is written.
_TAKEN = ("kernel", "crosstalk", "reference", *LAW, "rod_friction", "override", "accept_altered")
_WRITTEN = ("scans", "output", "as_json", "report", "figures", "force")


def calibrate_array_file(context: click.Context) -> int:
    """Calibrate the array of a command's scan, and return the exit code."""
    asked = context.params
    scan: Path = asked["scans"][0]
    useless = [
        parameter.opts[-1]
        for parameter in context.command.params
        if context.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE
        and parameter.name not in (*_TAKEN, *_WRITTEN)
    ]
    if useless:
        problem = f"The scan of an array of sensors has no use for {', '.join(useless)}."
        raise click.UsageError(problem)
    if len(asked["scans"]) > 1:
        raise click.UsageError("An array is calibrated from one scan.")
    output = asked["output"] or out.default_name(scan, ".array.h5")
    outputs = [output, asked["report"], *asked["figures"]]
    out.prove_writable(outputs, force=asked["force"], inputs=[scan, asked["reference"]])

    from memscal.extensions.arrays.calibrate_array import calibrate_array

    with out.working("Calibrating the array"):
        options = {name: asked[name] for name in _TAKEN if asked[name] is not None}
        array = calibrate_array(scan, **options).array
    out.deliver(array, output, array.save, asked, "artifact")
    return exit_code_of(array.checks, then=f" {output.name} was written and is marked so.")
