"""``memscal calibrate`` of the scan of an array, which is told by the names of its sensors."""

from pathlib import Path

import click
from click.core import ParameterSource

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.options import LAW
from memscal.formats.files import together
from memscal.formats.hdf5.reader import open_hdf5

#: Options that an array alone has, those of its calibration, and those of what is written.
_OWN = ("kernel", "crosstalk")
_TAKEN = (*_OWN, "reference", *LAW, "rod_friction", "override", "accept_altered")
_WRITTEN = ("scans", "output", "as_json", "report", "figures", "force")


def calibrated_array(context: click.Context) -> int | None:
    """Calibrate the array of a command's scan; return the exit code, None of a single sensor."""
    asked = context.params
    scan: Path = asked["scans"][0]
    with open_hdf5(scan) as file:
        single = not file.has("/entry/data/sensor_names")
    given = {
        parameter.name: parameter.opts[-1]
        for parameter in context.command.params
        if context.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE
    }
    allowed = given.keys() - _OWN if single else {*_TAKEN, *_WRITTEN}
    useless = [option for name, option in given.items() if name not in allowed]
    if useless:
        kind = "a single sensor" if single else "an array of sensors"
        raise click.UsageError(f"The scan of {kind} has no use for {', '.join(useless)}.")
    if single:
        return None
    if len(asked["scans"]) > 1:
        raise click.UsageError("An array is calibrated from one scan.")
    force = asked["force"]
    output = asked["output"] or out.default_name(scan, ".array.h5")
    outputs = [output, asked["report"], *asked["figures"]]
    out.prove_writable(outputs, force=force, inputs=[scan, asked["reference"]])

    from memscal.extensions.arrays.calibrate_array import calibrate_array

    with out.working("Calibrating the array"):
        options = {name: asked[name] for name in _TAKEN if asked[name] is not None}
        calibration = calibrate_array(scan, **options)
    files = out.drawn(calibration, asked["figures"], asked["report"])
    with together():
        calibration.array.save(output, overwrite=force)
        out.write_files(files, force=force)
        out.emit_result(calibration, {"artifact": str(output)}, as_json=asked["as_json"])
    out.show_messages(calibration.array.process.messages)
    out.say_written(outputs)
    then = f" {output.name} was written and is marked so."
    return exit_code_of(calibration.checks, then=then)
