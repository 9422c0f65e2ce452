"""``memscal response``: which waves of pressure a sensor under its film resolves."""

import math
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.options import (
    FILE,
    Quantity,
    artifact_argument,
    figure_option,
    option,
    output_options,
    repeatable,
)
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal response sensor.apparatus.h5 --wavelength 8 --wavelength 4
  memscal response sensor.apparatus.h5 --wavelength 4 --speed 1 --friction 0.5 --json
  memscal response sensor.apparatus.h5 --wavelength 4 --speed 1 --noise-record rest.h5 --length 50
"""


@click.command("response", epilog=EXAMPLES)
@artifact_argument
@repeatable("--wavelength wavelengths", Quantity("mm"), required=True)(
    "Wavelength of the pressure along the film, in mm. May be repeated."
)
@repeatable("--speed speeds", Quantity("mm/s"))(
    "Speed with which it passes the sensor, in mm/s. May be repeated."
)
@option("--friction", Quantity("ratio", low=-math.inf), 0.0)(
    "Shear over pressure on the film; negative where the film is dragged to smaller x."
)
@option("--noise-record", FILE)(
    "Readings of the sensor at rest (memscal import --noise-record): the smallest stress is found."
)
@option("--length", Quantity("mm"))("Length over which a wave is observed, in mm.")
@figure_option("Draw the gain and, of a noise record, the smallest stress by wavelength and speed.")
@output_options
def command(
    artifact: Path,
    wavelengths: tuple[float, ...],
    speeds: tuple[float, ...],
    figures: tuple[Path, ...],
    as_json: bool,
    force: bool,
    **options: Any,
) -> None:
    """Find what a calibrated sensor (ARTIFACT) reads of waves of pressure on its film.

    The gain is the reading per pressure of a wave, with its uncertainty and phase; a wave that the
    calibration does not resolve has none. With a noise record, a speed and a length, the smallest
    amplitude is found that is seen at three standard uncertainties.
    """
    out.prove_writable(figures, force=force, inputs=[artifact, options["noise_record"]])
    from memscal.extensions.response.response import response

    seen = response(artifact, wavelengths, speeds or None, **options)
    files = out.drawn(seen, figures)
    with together():
        out.write_files(files, force=force)
        out.emit_result(seen, {"artifact": str(artifact)}, as_json=as_json)
    out.say_written(figures)
