"""``memscal calibrate``: a rod scan to an apparatus function."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli.calibration_outputs import Outputs
from memscal.cli.calibration_setup import artifact_beside, chosen_method, correlation
from memscal.cli.failures import DONE, debug_option
from memscal.cli.options import FILE, force_option, json_option
from memscal.cli.output import emit_json, message, note, show_messages
from memscal.cli.progress import working
from memscal.cli.targets import FigurePath, prove_writable

if TYPE_CHECKING:
    from memscal.calibration.monte_carlo import MonteCarlo
    from memscal.calibration.procedure import Calibration
    from memscal.calibration.sweep import Sweep
    from memscal.cli.tables import Table
    from memscal.deconvolution.problem import Regulariser
    from memscal.model.scan import Scan
    from memscal.model.stress import StressProfile

__all__ = ["command"]

EXAMPLES = """\b
Examples:
  memscal calibrate scan.h5
  memscal calibrate scan.h5 -o sensor.apparatus.h5 --figure scan.png --report scan.html
  memscal calibrate scan.h5 --reference fem.h5 --json --sweep
  memscal calibrate scan.h5 --method richardson-lucy --option iterations=80
  memscal calibrate scan.h5 --method evidence --monte-carlo 1000
  memscal calibrate scan.h5 --channel xz
"""


def _complete_method(_: click.Context, __: click.Parameter, incomplete: str) -> list[str]:
    from memscal.deconvolution.registry import regulariser_names

    return [name for name in regulariser_names() if name.startswith(incomplete)]


@click.command("calibrate", epilog=EXAMPLES)
@click.argument("scans", type=FILE, nargs=-1, required=True, metavar="SCAN...")
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="OUT",
    help="Artifact to write; by default SCAN.apparatus.h5 beside SCAN.h5.",
)
@click.option(
    "--reference",
    type=FILE,
    metavar="FILE",
    help="Stress at the base of the film (memscal-reference). By default the one in the scan, or "
    "else the rod is solved on the film.",
)
@click.option(
    "--alternative",
    type=FILE,
    metavar="FILE",
    help="The same stress by another model of the film (memscal-reference), such as finite strain: "
    "its difference is counted as an uncertainty of the model's form.",
)
@click.option(
    "--correlation",
    "correlations",
    multiple=True,
    metavar="INPUT,INPUT=R",
    help="Correlation coefficient of two inputs' errors: thickness,poisson_ratio=0.5. Repeatable.",
)
@click.option(
    "--channel",
    type=click.Choice(("zz", "xz", "yz")),
    default="zz",
    show_default=True,
    help="Which voltage is calibrated. xz, yz: the shear, experimental, by method evidence, to "
    "SCAN.xz.apparatus.h5.",
)
@click.option(
    "--method",
    metavar="NAME",
    shell_complete=_complete_method,
    help="How G is found: evidence (from the scan's points, the most accurate), or by a division "
    "of fields: white-noise (its exact expectation), white-noise-draw (one "
    "seeded draw, as published), tikhonov, wiener, unsupervised-wiener, richardson-lucy, or a "
    "plug-in's.  [default: white-noise]",
)
@click.option(
    "--option",
    "options",
    multiple=True,
    metavar="NAME=VALUE",
    help="A parameter of the method, such as amplitude=0.5 (a factor on the noise amplitude that "
    "the rule chooses). May be repeated.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), metavar="N", help="Seed of random numbers.  [default: 0]"
)
@json_option
@click.option("--report", type=FILE, metavar="FILE.html", help="Write a report as one HTML page.")
@click.option(
    "--figure",
    "figures",
    type=FigurePath(),
    multiple=True,
    metavar="FILE.png|svg|pdf",
    help="Draw scan, apparatus function and transfer function. May be repeated.",
)
@click.option(
    "--sweep",
    "sweeping",
    is_flag=True,
    help="Show how the results depend on the noise amplitude, over two decades and eight seeds.",
)
@click.option(
    "--sweep-figure",
    type=FigurePath(),
    metavar="FILE.png|svg|pdf",
    help="Draw the sweep; implies --sweep.",
)
@click.option(
    "--monte-carlo",
    "draws",
    type=click.IntRange(min=2),
    metavar="DRAWS",
    help="Draw noise and all uncertain inputs this many times (1000 is usual), and compare what "
    "scatters with the budget of uncertainties. Each draw is calibrated like the scan.",
)
@force_option
@click.option(
    "--dry-run",
    is_flag=True,
    help="Read and check every input, say what would be done, and write nothing.",
)
@debug_option
def command(
    scans: tuple[Path, ...],
    output: Path | None,
    reference: Path | None,
    alternative: Path | None,
    correlations: tuple[str, ...],
    channel: str,
    method: str | None,
    options: tuple[str, ...],
    seed: int | None,
    as_json: bool,
    report: Path | None,
    figures: tuple[Path, ...],
    sweeping: bool,
    sweep_figure: Path | None,
    draws: int | None,
    force: bool,
    dry_run: bool,
) -> int:
    """Find a sensor's apparatus function from a rod scan, or from several of one sensor.

    Divides the scan's field by the stress that the rod makes at the base of the film, and writes
    the conversion constant A (mV/Pa), the apparatus function G (1/mm^2, unit integral), both
    Gaussian widths (mm), their standard uncertainties, and quality checks to an artifact.

    Several scans, at other loads, with other rods or films, are fitted together: A and G are
    shared, and each scan has its own centre and baseline.

    A failed quality check is exit code 1: the artifact is written and says so.
    """
    output = output or artifact_beside(scans[0], channel)
    outputs = Outputs(output, report, figures, sweep_figure)
    regulariser = chosen_method(method, options, seed, channel)
    correlated = dict(correlation(text) for text in correlations)
    data, profile = _read(scans, reference)
    other = None if alternative is None else _read_reference(alternative)
    inputs = [path for path in (*scans, reference, alternative) if path is not None]
    prove_writable(outputs.paths, force=force, inputs=inputs)
    if dry_run:
        _rehearse(data, profile, channel, regulariser, outputs, as_json)
        return DONE

    from memscal.calibration.procedure import calibrate

    with working(f"Calibrating by {regulariser.name}"):
        found = calibrate(
            data,
            reference=profile,
            alternative=other,
            channel=channel,
            method=regulariser,
            correlations=correlated,
            seed=seed or 0,
        )
    swept = None
    if sweeping or sweep_figure:
        with working("Sweeping the noise amplitude"):
            swept = found.sweep(seed=seed or 0)
    drawn = None
    if draws is not None:
        from memscal.cli.monte_carlo_view import drawn_with_progress

        drawn = drawn_with_progress(found, draws, seed or 0)
    with working("Drawing"):
        ready = outputs.rendered(found, swept)
    outputs.write(found, ready, force=force)
    return _tell(found, swept, drawn, outputs, as_json)


def _read(
    paths: tuple[Path, ...], reference: Path | None
) -> tuple[list[Scan], StressProfile | None]:
    """Read the inputs, and refuse an indenter that cannot calibrate."""
    from memscal.estimation.reference import require_calibration_rod
    from memscal.formats.scan import read_scan

    scans = [read_scan(path) for path in paths]
    for scan, path in zip(scans, paths, strict=True):
        require_calibration_rod(scan)
        if reference is not None and scan.reference is not None:
            note(f"The reference in {path.name} gives way to {reference.name}.")
    return scans, None if reference is None else _read_reference(reference)


def _read_reference(path: Path) -> StressProfile:
    from memscal.errors import InputError
    from memscal.formats.reference import read_reference

    if path.suffix.lower() in (".csv", ".txt", ".tsv", ".dat"):
        raise InputError(
            f"The reference {path} looks like a table, not like a memscal-reference file.",
            why="A table does not say its units, nor the load it was calculated for.",
            cure=f"Convert it first, such as: memscal import {path} --format reference --r r "
            "--r-unit mm --sigma sigma_zz --sigma-unit Pa --load 1 "
            f"-o {path.with_suffix('.h5')}",
        )
    return read_reference(path)


def _rehearse(
    scans: list[Scan],
    profile: StressProfile | None,
    channel: str,
    regulariser: Regulariser,
    outputs: Outputs,
    as_json: bool,
) -> None:
    """Go as far as the calibration goes before it computes, and say what it would do."""
    from memscal.calibration.solution import require_channel_method
    from memscal.cli.calibration_view import rehearsal_json, rehearsal_table
    from memscal.cli.tables import emit_tables
    from memscal.estimation.points import joined_points, measured_points
    from memscal.estimation.reference import (
        reference_profile,
        reference_spectra,
        require_one_sensor,
    )

    require_one_sensor(scans)
    require_channel_method(channel, regulariser)
    parts = [measured_points(scan, channel) for scan in scans]
    stresses = [reference_profile(scan, profile) for scan in scans]
    reference_spectra(stresses, parts, [scan.film.thickness for scan in scans])
    points = joined_points(parts)
    if as_json:
        emit_json(rehearsal_json(stresses[0], regulariser.name, outputs.paths))
    else:
        emit_tables(rehearsal_table(scans[0], points, stresses[0], regulariser.name, outputs.paths))
    message("Nothing was written (--dry-run).")


def _tell(
    found: Calibration,
    swept: Sweep | None,
    drawn: MonteCarlo | None,
    outputs: Outputs,
    as_json: bool,
) -> int:
    """Print the results and the messages; return the exit code."""
    from memscal.cli.calibration_view import calibration_json, calibration_tables
    from memscal.cli.quality_view import exit_code_of
    from memscal.cli.tables import emit_tables

    if as_json:
        emit_json(calibration_json(found, outputs.artifact) | _further_json(swept, drawn))
    else:
        emit_tables(*calibration_tables(found), *_further_tables(swept, drawn))
    show_messages(found.apparatus.process.messages)
    for path in outputs.paths:
        message(f"Written: {path}")
    checks = found.apparatus.checks
    return exit_code_of(checks, then=f" {outputs.artifact.name} was written and is marked so.")


def _further_json(swept: Sweep | None, drawn: MonteCarlo | None) -> dict[str, Any]:
    from memscal.cli.monte_carlo_view import monte_carlo_json
    from memscal.cli.sweep_view import sweep_json

    found: dict[str, Any] = {} if swept is None else {"sweep": sweep_json(swept)}
    return found if drawn is None else found | {"monte_carlo": monte_carlo_json(drawn)}


def _further_tables(swept: Sweep | None, drawn: MonteCarlo | None) -> list[Table]:
    from memscal.cli.monte_carlo_view import monte_carlo_table
    from memscal.cli.sweep_view import sweep_table

    tables = [] if swept is None else [sweep_table(swept)]
    return tables if drawn is None else [*tables, monte_carlo_table(drawn)]
