"""``memscal calibrate``: a rod scan to an apparatus function."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli import output as out
from memscal.cli.failures import DONE, debug_option, exit_code_of
from memscal.cli.options import (
    FILE,
    FILM_LAWS,
    NonNegative,
    Options,
    accept_altered_option,
    brief_option,
    figure_option,
    files_argument,
    flag,
    force_option,
    json_option,
    noise_record_option,
    option,
    options_of,
    out_option,
    repeatable,
    report_option,
    rod_friction_option,
)
from memscal.extensions import hook
from memscal.formats.files import together

if TYPE_CHECKING:
    from memscal.calibration.calibrate import Calibration
    from memscal.deconvolution.division import Method
    from memscal.model.scan import Scan
    from memscal.model.stress import StressProfile

#: Processes that share the draws, where there are as many cores.
_MOST_WORKERS = 8


def _drawn(calibration: Calibration, draws: int, seed: int) -> Any:
    """Draw in processes, show how many draws are done, and where they and the budget disagree."""
    from memscal.model.checks import Message
    from memscal.model.quantities import estimated_quantity

    # Starting a process takes about as long as forty draws of a line.
    workers = max(1, min(os.cpu_count() or 1, _MOST_WORKERS, draws // 40))
    with out.working("Calibrating drawn scans"):
        drawn = hook("monte_carlo")(calibration, draws=draws, seed=seed, workers=workers)
    differing = [c for c in drawn.comparisons if not c.agrees]
    texts = [f"{estimated_quantity(c.name).words}: {c.reason}" for c in differing]
    out.show_messages([*drawn.messages, *(Message("disagreement", text) for text in texts)])
    return drawn


def _chosen_method(
    method: str | None, options: tuple[str, ...], seed: int | None, channel: str
) -> Method:
    """Set up the method, by default the channel's; a wrong name or option is a usage error."""
    from memscal.deconvolution.division import create_regulariser
    from memscal.errors import InputError

    method = method or ("white-noise" if channel == "zz" else "bayesian")
    values = dict(map(_option, options))
    if "seed" in values:
        raise click.UsageError("Give the seed as --seed, not as --option.")
    try:
        if values:
            _check_kinds(values, create_regulariser(method))
        regulariser = create_regulariser(method, seed=seed or 0, **values)
    except InputError as failure:
        raise click.UsageError(f"{failure.problem} {failure.cure}".strip()) from failure
    if seed is not None and not hasattr(regulariser, "seed"):
        out.note(f"--seed changes nothing here: {regulariser.name} draws no random numbers.")
    return regulariser


def _correlation(text: str) -> tuple[tuple[str, str], float]:
    """Read INPUT,INPUT=R."""
    pair, _, value = text.partition("=")
    first, comma, second = (word.strip() for word in pair.partition(","))
    try:
        coefficient = float(value)
    except ValueError:
        coefficient = math.nan
    if not (comma and math.isfinite(coefficient)):
        raise click.UsageError(f"--correlation {text!r} is not of the form INPUT,INPUT=R.")
    return (first, second), coefficient


def _option(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not (equals and name.isidentifier()):
        raise click.UsageError(f"--option {text!r} is not of the form NAME=VALUE.")
    with contextlib.suppress(ValueError):
        return name, json.loads(value)
    return name, value


def _check_kinds(values: Options, usual: Method) -> None:
    """Refuse text where the method's default is a number, or a fraction where it is a count."""
    for name, value in values.items():
        default = getattr(usual, name, None)
        number = type(value) in (int, float) and math.isfinite(value)
        if isinstance(default, float) and not number:
            raise click.UsageError(
                f"--option {name}={value}: {name} is a number, such as {default}."
            )
        if type(default) is int and type(value) is not int:
            raise click.UsageError(f"--option {name}={value}: {name} is a whole number.")


EXAMPLES = """\b
Examples:
  memscal calibrate scan.h5
  memscal calibrate scan.h5 -o sensor.apparatus.h5 --figure scan.png --report scan.html
  memscal calibrate scan.h5 --reference fem.h5 --json --sweep
  memscal calibrate scan.h5 --reference disc:0.5mm
  memscal calibrate scan.h5 --reference beam.png --pixel-size 5um
  memscal calibrate scan.h5 --method tikhonov --option amplitude=0.5
  memscal calibrate scan.h5 --method bayesian --monte-carlo 1000
  memscal calibrate scan.h5 --channel xz
  memscal calibrate fast_scan.h5 --creep creep.h5
  memscal calibrate array_scan.h5 -o array.h5 --kernel auto --crosstalk nearest
"""


def _complete_method(_: click.Context, __: click.Parameter, incomplete: str) -> list[str]:
    from memscal.deconvolution.division import regulariser_names

    return [name for name in regulariser_names() if name.startswith(incomplete)]


calibration_options = options_of(
    option("--reference", FILE)(
        "Stress at the base of the film (memscal-reference); or a source, for which film and rod "
        "are not used: disc:R, slit:W, gaussian:S (radius, width, standard deviation: disc:0.5mm),"
        " point. Or a field: HDF5, .npy, PNG, TIFF. By default the one in the scan, or else the "
        "rod is solved on the film. With one that states no film the scan needs none."
    ),
    option("--pixel-size", "LENGTH")(
        "Size of the pixels of a reference that is an array or image, such as 5um."
    ),
    option("--alternative", FILE)(
        "The same stress by another model of the film (memscal-reference): its difference is "
        "counted as an uncertainty of the model's form, in place of the linear film's."
    ),
    option("--film-law", [*FILM_LAWS])(
        "Law of the film by which the rod is solved, taken as known. By default the one that scan "
        "or reference state; else neo-hookean, and its difference from linear is counted "
        "(model_form)."
    ),
    option("--mooney-rivlin-ratio", NonNegative("ratio"))("C2/C1 of --film-law mooney-rivlin."),
    rod_friction_option(
        "Whether the film slides freely under the rod (0) or sticks (inf), which matters at finite"
        " strain. By default as the scan states it; else midway, and the rest is counted."
    ),
    repeatable("--correlation correlations", metavar="INPUT,INPUT=R")(
        "Correlation coefficient of two inputs' errors: thickness,poisson_ratio=0.5. Repeatable."
    ),
    option("--channel", ["zz", "xz", "yz"], "zz")(
        "Which voltage is calibrated. xz, yz: the shear, experimental, by method bayesian, to "
        "SCAN.xz.apparatus.h5."
    ),
    option("--method", "NAME", shell_complete=_complete_method)(
        "Whose A and G are written: bayesian (from the scan's points: the more precise, for "
        "friction), or a division of the smoothed voltages by the stress: white-noise (the "
        "paper's, as its exact expectation), white-noise-draw (one seeded draw, as published), "
        "tikhonov, wiener, or a plug-in's. The other of bayesian and division is computed, too, "
        "and stands beside it.  [default: white-noise]"
    ),
    option("--centre", ["common", "per-repeat"])(
        "Whether the repeats of a scan share their centre, or each has a centre, baseline and "
        "drift of its own.  [default: per-repeat where a common centre has a p-value below 1/1000]"
    ),
    repeatable("--option options", metavar="NAME=VALUE")(
        "A parameter of the method, such as amplitude=0.5 (a factor on the noise amplitude that "
        "the rule chooses). May be repeated."
    ),
    option("--seed", click.IntRange(min=0), metavar="N")("Seed of random numbers.  [default: 0]"),
    option("--creep", FILE)(
        "Creep of the sensor (memscal creep), by which a scan made in motion is corrected."
    ),
    flag("--override")(
        "Go on although a reference is of another film, rod or load than its scan: recorded."
    ),
    accept_altered_option,
    flag("--relative")(
        "For scans at constant depth or of unknown load: no load counts, A is relative, and states"
        " no pascals."
    ),
)
"""How a scan is calibrated: what :func:`calibration_settings` takes."""


def calibration_settings(
    *,
    reference: Path | None,
    pixel_size: str | None,
    alternative: Path | None,
    correlations: tuple[str, ...],
    method: str | None,
    options: tuple[str, ...],
    seed: int | None,
    **others: Any,
) -> Options:
    """Return the options of :func:`memscal.calibrate` that options of the command line ask for."""
    accepted = others["accept_altered"]
    return {
        "method": _chosen_method(method, options, seed, others["channel"]),
        "correlations": dict(map(_correlation, correlations)),
        "reference": reference and _read_reference(reference, pixel_size, accepted),
        "alternative": alternative and _read_reference(alternative, None, accepted),
        "seed": seed or 0,
        **others,
    }


@click.command("calibrate", epilog=EXAMPLES)
@files_argument()
@out_option(
    "Artifact to write; by default SCAN.apparatus.h5 beside SCAN.h5, of an array SCAN.array.h5."
)
@calibration_options
@option("--kernel", ["common", "own", "auto", "measured"])(
    "Array: one G of all sensors; a G of each; these where the evidence of a raster prefers them; "
    "or maps of what each sensor reads, without G and pascals.  [default: common]"
)
@option("--crosstalk", ["auto", "none", "nearest", "full"])(
    "Array: pairs whose crosstalk is estimated: of neighbours, none, or all.  [default: auto, "
    "which is nearest]"
)
@repeatable("--free", ["thickness"])(
    "Estimate the film's thickness, too, from scans with several rods, or at several loads on a "
    "film of a stated law that is not linear; the stated thickness is its prior."
)
@json_option
@brief_option
@report_option
@figure_option("Draw scan, apparatus function and transfer function.")
@flag("--sweep sweeping")(
    "Show how the results depend on the noise amplitude, over two decades and eight seeds."
)
@option("--sweep-figure", out.FigurePath(), metavar="FILE.png|svg|pdf")(
    "Draw the sweep; implies --sweep."
)
@option("--monte-carlo draws", click.IntRange(min=2), metavar="DRAWS")(
    "Draw noise and all uncertain inputs this many times (1000 is usual), and compare what "
    "scatters with the budget of uncertainties. Each draw is calibrated like the scan."
)
@flag("--compact")(
    "Leave G over the plane out of the artifact where it is round, which halves its size."
)
@noise_record_option
@force_option
@flag("--dry-run")("Read and check every input, print what would be done, and write nothing.")
@debug_option
def command(
    scans: tuple[Path, ...],
    output: Path | None,
    reference: Path | None,
    alternative: Path | None,
    as_json: bool,
    brief: bool,
    report: Path | None,
    figures: tuple[Path, ...],
    sweeping: bool,
    sweep_figure: Path | None,
    draws: int | None,
    noise_record: Path | None,
    compact: bool,
    force: bool,
    dry_run: bool,
    **settings: Any,
) -> int:
    """Find a sensor's apparatus function from a rod scan, or from several of one sensor.

    Smooths the scan's readings, divides their field by the stress that the rod makes at the base
    of the film, and writes the conversion constant A (mV/Pa, or the readings' unit over Pa), the
    apparatus function G (1/mm^2, unit integral), both Gaussian widths (mm), their standard
    uncertainties, and quality checks to an artifact. A and G are those of the method; the first
    line states which to use.

    Several scans, at other loads, with other rods or films, are fitted together: A and G are
    shared, and each scan has its own centre and baseline.

    The scan of an array of sensors is calibrated as an array: A of each sensor, what it reads of
    its neighbours (crosstalk), places, and the shape of G; without --brief and --dry-run.

    A failed quality check is exit code 1: the artifact is written and states it.
    """
    from memscal.formats.hdf5.reader import open_hdf5

    with open_hdf5(scans[0]) as file:
        array = file.has("/entry/data/sensor_names")
    if array:
        code: int = hook("calibrate_array_file")(click.get_current_context())
        return code
    if settings.pop("kernel") or settings.pop("crosstalk"):
        raise click.UsageError("--kernel and --crosstalk belong to the scan of an array.")
    channel = settings["channel"]
    ending = ".apparatus.h5" if channel == "zz" else f".{channel}.apparatus.h5"
    output = output or out.default_name(scans[0], ending)
    settings = calibration_settings(reference=reference, alternative=alternative, **settings)
    data = _read(scans, reference, noise_record, settings)
    outputs = list(filter(None, (output, report, *figures, sweep_figure)))
    out.prove_writable(
        outputs,
        force=force,
        inputs=[*scans, reference, alternative, noise_record, settings["creep"]],
    )
    if dry_run:
        _rehearse(data, settings, outputs, as_json)
        return DONE

    from memscal.calibration.calibrate import calibrate

    with out.working(f"Calibrating by {settings['method'].name}"):
        calibration = calibrate(data, **settings)
    further = {}
    if sweeping or sweep_figure:
        with out.working("Sweeping the noise amplitude"):
            further["sweep"] = calibration.sweep(seed=settings["seed"])
    if draws is not None:
        further["monte_carlo"] = _drawn(calibration, draws, settings["seed"])
    files = out.drawn(calibration, figures, report)
    if sweep_figure is not None:
        files |= out.drawn(further["sweep"], [sweep_figure])
    apparatus = calibration.apparatus.compact() if compact else calibration.apparatus
    with together():
        apparatus.save(output, overwrite=force)
        out.write_files(files, force=force)
        head = {"artifact": str(output)}
        out.emit_result(calibration, head, as_json=as_json, brief=brief, further=further)
    out.show_messages(apparatus.process.messages)
    out.say_written(outputs)
    then = f" {output.name} was written and is marked so."
    return exit_code_of(apparatus.checks, then=then)


def _read(
    paths: tuple[Path, ...], reference: Path | None, noise_record: Path | None, settings: Options
) -> Sequence[Scan]:
    from memscal.formats.opened import opened_scans
    from memscal.model.sizes import MOST_OF_LINES

    stated = {"accept_altered": settings["accept_altered"], "noise_record": noise_record}
    scans = opened_scans(paths, MOST_OF_LINES, **stated)
    for scan, path in zip(scans, paths, strict=True):
        if reference is not None and scan.reference is not None:
            out.note(f"{reference.name} is used in place of the reference in {path.name}.")
    return scans


def _read_reference(path: Path, pixel_size: str | None, accepted: bool) -> StressProfile:
    from memscal.errors import InputError
    from memscal.formats.reference import length, read_reference

    if path.suffix.lower() in (".csv", ".txt", ".tsv", ".dat"):
        raise InputError(
            f"The reference {path} looks like a table, not like a memscal-reference file.",
            why="A table states neither its units nor the load it was calculated for.",
            cure=f"Convert it first, such as: memscal import {path} --format reference --r r "
            "--r-unit mm --sigma sigma_zz --sigma-unit Pa --load 1 "
            f"-o {path.with_suffix('.h5')}",
        )
    size = None if pixel_size is None else length(pixel_size, "The pixel size")
    return read_reference(path, pixel_size=size, accept_altered=accepted)


def _rehearse(
    scans: Sequence[Scan], settings: Options, outputs: Sequence[Path], as_json: bool
) -> None:
    """Check what a calibration checks before it computes, and print what it would do."""
    from memscal.calibration.prepare import Request, prepare
    from memscal.calibration.stages import require_channel_method
    from memscal.estimation.points import joined_points, measured_points, scans_of_repeats
    from memscal.estimation.reference_spectra import reference_spectra
    from memscal.model.checks import override_messages
    from memscal.summaries.calibration import rehearsal_json, rehearsal_table

    channel = settings["channel"]
    plan = (settings["method"].name, outputs)
    require_channel_method(channel, settings["method"])
    prepared = prepare(scans, Request(**settings))
    out.show_messages(override_messages(prepared.overridden))
    separate = list(prepared.scans)
    owners = tuple(range(len(prepared.scans)))
    if settings["centre"] == "per-repeat":
        separate, owners = scans_of_repeats(separate, channel)
    readings = [measured_points(scan, channel) for scan in separate]
    reference_spectra([prepared.stresses[i] for i in owners], readings)
    stress = prepared.stresses[0]
    taken = prepared.scans[0]
    if as_json:
        out.emit_json(rehearsal_json(stress, *plan))
    else:
        load = taken.load if prepared.reading.per == "Pa" else None
        taken = replace(taken, load=load)
        out.emit_tables(rehearsal_table(taken, joined_points(readings), stress, *plan))
    out.message("Nothing was written (--dry-run).")
