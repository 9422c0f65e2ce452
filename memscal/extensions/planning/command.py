"""``memscal design``: the uncertainties to expect of a scan that is not made yet."""

from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from memscal.cli import output as out
from memscal.cli.options import (
    FREE_OR_STUCK,
    PAPER,
    POSITION,
    NonNegative,
    Quantity,
    figure_option,
    film_from,
    film_options,
    indenter_from,
    kernel_from,
    kernel_options,
    option,
    output_options,
    radius_options,
    repeatable,
    rod_friction_option,
    si,
)
from memscal.formats.files import together

EXAMPLES = """\b
Examples:
  memscal design
  memscal design --step 0.5 --half-range 10 --repeats 4 --noise 1
  memscal design --load 0.5 --noise-voltage 0.05 --figure design.png
  memscal design --noise 1 --rod-friction inf --want A=1.6% --vary step
  memscal design --thickness-uncertainty 0.005 --load 0.2 --want sigma=1.2% --vary repeats --json
  memscal design --disc-radius 800 --sigma 300 --want resolved=4.5 --vary repeats
"""


def _target(value: str) -> tuple[str, float]:
    """Read a target, ``sigma=1%`` or ``resolved=4`` in rad/mm; the library checks the name."""
    name, equals, text = value.partition("=")
    percent = text.strip().endswith("%")
    try:
        number = float(text.strip().removesuffix("%"))
    except ValueError:
        equals = ""
    if not equals:
        raise click.BadParameter(f"{value!r} is no target: write sigma=1% or resolved=4 (rad/mm).")
    name = name.strip()
    if percent == (name == "resolved"):
        unit = "in rad/mm, without %" if percent else "in percent: write the %"
        raise click.BadParameter(f"{value!r}: {name} is given {unit}.")
    return name, si(number, -2) if percent else si(number, 3)


@click.command("design", epilog=EXAMPLES)
@kernel_options
@option("--load", Quantity("N"), 1.0)("Normal load, in N.")
@option("--load-uncertainty", NonNegative("percent"), 1.0)(
    "Standard uncertainty (k = 1) of the load, in percent."
)
@radius_options(defaults=PAPER)
@film_options(defaults=PAPER)
@option("--step", Quantity("mm"), 0.25)("Distance of neighbouring positions, in mm.")
@option("--half-range", Quantity("mm"), 8.0)("Positions run from minus to plus this, in mm.")
@option("--repeats", click.IntRange(min=1), 1)("How often the line is scanned.")
@option("--noise", Quantity("percent"), 0.5)(
    "Standard deviation of one voltage, in percent of the signal with the rod right above the "
    "sensor."
)
@option("--noise-voltage", Quantity("mV"))("The same in mV, in place of --noise.")
@option("--centre", POSITION, 0.0)("Expected position of the sensor along the scan, in mm.")
@rod_friction_option(f"{FREE_OR_STUCK} Default: the scan will not state it.")
@option("--position-scale-uncertainty", NonNegative("percent"))(
    "Standard uncertainty (k = 1) of the stage's scale, in percent."
)
@option("--line-offset-uncertainty", NonNegative("mm"))(
    "That of the distance at which the line passes the sensor's centre, in mm."
)
@option("--roundness-uncertainty", NonNegative("ratio"))(
    "That of the sensor's axis ratio less one."
)
@option("--method", default="bayesian")(
    "Method of memscal calibrate with which the scan would be evaluated."
)
@repeatable("--want targets", _target, metavar="TARGET")(
    "What to reach by --vary: A=1%, sigma=1% or fwhm=5% at most, relative standard "
    "uncertainty, or resolved=4 at least, in rad/mm. Repeated: all are to be reached."
)
@option("--vary", ["step", "half-range", "repeats"])(
    "What to vary for --want: the coarsest step, shortest range or fewest repeats is found."
)
@figure_option("Draw the expected result.")
@output_options
def command(
    targets: tuple[tuple[str, float], ...],
    figures: tuple[Path, ...],
    vary: str | None,
    as_json: bool,
    force: bool,
    **options: Any,
) -> None:
    """Predict the uncertainties of a calibration before its scan is made.

    They follow, without simulation, from the Fisher information of the planned scan, the prior of
    the estimate and the uncertainties of film, rod and load. Defaults are the paper's. With --want
    and --vary, the smallest scan that reaches the targets is found.
    """
    source = click.get_current_context().get_parameter_source("noise")
    if options["noise_voltage"] is not None and source == ParameterSource.COMMANDLINE:
        raise click.UsageError("--noise and --noise-voltage both state the noise: give one.")
    if bool(targets) != (vary is not None):
        raise click.UsageError("--want and --vary go together: give targets, and what to vary.")
    out.prove_writable(figures, force=force)
    vary = vary and vary.replace("-", "_")

    from memscal.extensions.planning.design import design

    settings = {name: options[name] for name in signature(design).parameters if name in options}
    settings["rod"] = indenter_from("rod", options)
    with out.working("Planning"):
        planned = design(
            film=film_from(options),
            kernel=kernel_from(options),
            want=dict(targets),
            vary=vary,
            **settings,
        )
    with out.working("Drawing"):
        drawn = out.rendered(partial(planned.plot, vary=vary or "step"), figures)
    with together():
        out.write_files(drawn, force=force)
        out.emit_result(planned, {}, as_json=as_json)
    beyond = "G follows from the prior" if planned.method == "bayesian" else "the window hides G"
    out.note(
        f"Beyond the resolved band {beyond}: the uncertainty there does not scatter from scan to "
        "scan, and repeats do not show it."
    )
    out.say_written(figures)
