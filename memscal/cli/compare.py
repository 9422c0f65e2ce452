"""``memscal compare``: measured against calculated stress, and the friction that explains it."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli import output as out
from memscal.cli.options import (
    FILE,
    NonNegative,
    Options,
    artifact_argument,
    contact_options,
    figure_option,
    files_argument,
    flag,
    option,
    repeatable,
    report_options,
)
from memscal.figures import FIGURE_SUFFIXES
from memscal.formats.files import together

if TYPE_CHECKING:
    from memscal.apparatus import ApparatusFunction
    from memscal.friction.results import FrictionComparison


def figure_stems(lubrications: Iterable[str], *, interface: bool) -> list[str]:
    """Return the stems of all figures' names, without matplotlib; a test compares both."""
    stems = []
    for name in dict.fromkeys(lubrications):
        tail = f"-{name}" if name else ""
        stems += [f"profiles{tail}", f"friction-set{tail}"]
    stems += ["maxima", "effective-friction", "likelihood"]
    return [*stems, "interface"] if interface else stems


def user_cache_folder() -> Path | None:
    """Return the user's folder of contacts, by the rules of the system; none without a home."""
    from platformdirs import user_cache_path

    folder = user_cache_path("memscal", appauthor=False) / "contacts"
    return folder if folder.is_absolute() else None


def cache_from(cache: Path | None, no_cache: bool) -> Path | None:
    """Return the folder that the options name; ``None`` for no cache."""
    if no_cache and cache is not None:
        raise click.UsageError("Give --cache or --no-cache, not both.")
    if cache is not None and cache.exists() and not cache.is_dir():
        raise click.UsageError(f"--cache names a folder, but {cache} is a file.")
    if no_cache:
        return None
    return user_cache_folder() if cache is None else cache


_COEFFICIENT = NonNegative("ratio", infinite=True)
_FORMATS = [suffix.removeprefix(".") for suffix in FIGURE_SUFFIXES]

EXAMPLES = """\b
Examples:
  memscal compare sensor.apparatus.h5 dry.h5
  memscal compare sensor.apparatus.h5 dry.stress.h5
  memscal compare sensor.apparatus.h5 dry.h5 lubricated.h5 --macroscopic 1.6 --report friction.html
  memscal compare sensor.apparatus.h5 dry.h5 --friction 0.1 --friction 0.2 --json
  memscal compare sensor.apparatus.h5 dry.h5 --loading incremental --interface --macroscopic 1.6
  memscal compare sensor.apparatus.h5 dry.h5 --reference fem0.h5 --reference fem03.h5
  memscal compare sensor.apparatus.h5 sliding.h5 --sliding --backlash 5
  memscal compare shear.apparatus.h5 dry.stress.h5 --channel xz
  memscal compare sensor.apparatus.h5 dry.stress.h5 --shear shear.apparatus.h5
"""


@click.command("compare", epilog=EXAMPLES)
@artifact_argument
@files_argument("SCAN|STRESS...")
@repeatable("--friction friction", _COEFFICIENT, metavar="MU")(
    "Friction coefficient to calculate profiles for, beside 0 and inf (the film sticks "
    "wherever it is touched); between them profiles are interpolated. Repeated: several.  "
    "[default: nine between 0 and inf]"
)
@repeatable("--loading loadings", ["incremental", "total"])(
    "A point sticks where it first touched (incremental), or as if loaded in one step "
    "(total). May be repeated.  [default: both]"
)
@repeatable("--reference references", FILE)(
    "Profiles calculated elsewhere (memscal-reference), in place of memscal's: one file for "
    "each load and friction coefficient. Repeated."
)
@option("--lubricated", ["frictionless", "apart"])(
    "Fit lubricated loads with no friction (--lubricated-friction 0) together with the dry ones, "
    "or each kind by itself.  [default: together]"
)
@option("--lubricated-friction", NonNegative("ratio"), 0.015, metavar="MU")(
    "Width of the half-normal distribution of the friction coefficient of lubricated loads; 0 "
    "holds it at none."
)
@option("--between-scan-gain", NonNegative("percent"), 0.5)(
    "Standard uncertainty of the gain of each scan that the others do not share, in percent."
)
@option("--shear", FILE, metavar="ARTIFACT")(
    "Artifact of the tangential channel of the sensor: coefficients of all loads together are by "
    "normal stress and shear together (experimental)."
)
@option("--macroscopic", _COEFFICIENT, metavar="MU")(
    "Friction coefficient measured in sliding, to compare with."
)
@option("--macroscopic-uncertainty", NonNegative("ratio"), metavar="U")(
    "Standard uncertainty (k = 1) of --macroscopic."
)
@option("--channel", ["zz", "xz", "yz"], "zz")(
    "xz or yz: compare the shear that a tangential channel measured, by its own ARTIFACT, with the "
    "points of one STRESS file (experimental)."
)
@flag("--interface")(
    "Also explain the profiles by an interface that yields before it slips, at the "
    "macroscopic friction, and report which of the two explanations is more likely."
)
@flag("--sliding")(
    "Compare scans of a sphere that slid (/entry/indenter/motion) with contacts that slide."
)
@option("--backlash", NonNegative("um"))(
    "Standard uncertainty of the difference of positions between sliding forth and back, in um, "
    "which have one centre then.  [default: each has its own]"
)
@contact_options
@option("--cache", FILE, metavar="FOLDER")(
    "Where calculated contacts are kept for the next run.  [default: memscal/contacts in "
    "the user's cache folder]"
)
@flag("--no-cache")("Calculate all contacts, and store none.")
@figure_option("Draw profiles, residuals, maxima and friction coefficients on one page.")
@option("--figures folder", FILE, metavar="FOLDER")(
    "Draw each figure into a file of its own in this folder: profiles, profiles for a set of "
    "coefficients, maxima, effective friction, likelihood, interface."
)
@option("--figure-format", _FORMATS, "png")("Format of --figures.")
@report_options
def command(
    artifact: Path, scans: tuple[Path, ...], as_json: bool, force: bool, **options: Any
) -> int:
    """Compare the stress that contact SCANs measured with calculated contacts.

    In place of the scans, give the measured STRESS that memscal apply wrote of them. The sensor's
    conversion constant and apparatus function come from ARTIFACT. A sphere is pressed on the film
    by calculation, at the measured loads and with several friction coefficients; the calculated
    stress, blurred by the apparatus function, is compared with the measured one, for each load and
    for all loads. The effective friction coefficient is given with a confidence interval, or as a
    bound where the data determine no more, by the maximum of each profile and by all its points.

    A failed quality check is exit code 1: the results are printed all the same.
    """
    _check_usage(options, scans)
    cache = cache_from(options["cache"], options["no_cache"])

    from memscal.apparatus import load_apparatus
    from memscal.cli.failures import exit_code_of
    from memscal.formats.opened import opened_contacts
    from memscal.formats.reference import read_reference
    from memscal.friction.compare import compare, scans_of
    from memscal.summaries.comparison import file_json, notes

    accepted = {"accept_altered": options["accept_altered"]}
    apparatus = load_apparatus(artifact, **accepted)
    channel = options["channel"]
    _require_channel(apparatus, artifact, channel)
    data = opened_contacts(scans, noise_record=options["noise_record"], **accepted)
    references = [read_reference(path, **accepted) for path in options["references"]]
    page_figures = options["figures"]
    report = options["report"]
    folder = options["folder"]
    named = _named_figures(options, (scan.lubrication for scan in scans_of(data)))
    outputs = [*page_figures, *named.values(), report]
    if folder is not None and not folder.is_dir():
        outputs = [*page_figures, folder, report]  # the folder is made at the end
    inputs = [artifact, *scans, *options["references"], options["shear"]]
    inputs.append(options["noise_record"])
    out.prove_writable(outputs, force=force, inputs=inputs)
    friction = options["friction"]
    settings = {name: options[name] for name in _SETTINGS}
    with out.working("Comparing with calculated contacts"):
        comparison = compare(
            data,
            apparatus,
            friction=sorted({0.0, *friction, math.inf}) if friction else None,
            loading=options["loadings"] or ("incremental", "total"),
            references=references or None,
            cache=cache,
            workers=min(2, os.cpu_count() or 1),
            **settings,
        )
    files = out.drawn(comparison, page_figures, report)
    if named:
        files |= _drawn(comparison, named)
    with together(folder):
        out.write_files(files, force=force)
        if as_json:
            read: dict[str, Any] = {"artifact": file_json(apparatus.source)}
            if channel == "zz":
                read["references"] = [file_json(profile.source) for profile in references]
                read["figures"] = [*map(str, (*page_figures, *named.values()))]
            out.emit_json(comparison.to_dict() | read)
        else:
            out.emit_result(comparison, {}, as_json=False, brief=options["brief"])
    out.show_messages(notes(comparison))
    out.say_written(files)
    return exit_code_of(comparison.checks)


def _require_channel(apparatus: ApparatusFunction, path: Path, channel: str) -> None:
    """Refuse the artifact of another channel."""
    from memscal.errors import InputError

    given = apparatus.sensor.channel
    if given != channel and (apparatus.order or channel != "zz"):
        raise InputError(
            f"The artifact {path} is of channel {given}, not of {channel}.",
            cure=f"Give that of memscal calibrate --channel {channel} --method bayesian.",
        )


def _named_figures(options: Options, lubrications: Iterable[str]) -> dict[str, Path]:
    """Return the files of --figures by their stems."""
    folder = options["folder"]
    if folder is None:
        return {}
    if folder.exists() and not folder.is_dir():
        raise click.UsageError(f"--figures names a folder, but {folder} is a file.")
    stems = figure_stems(lubrications, interface=options["interface"])
    if options["sliding"]:
        stems = ["sliding"]
    return {stem: folder / f"{stem}.{options['figure_format']}" for stem in stems}


def _drawn(comparison: FrictionComparison, named: Mapping[str, Path]) -> out.Files:
    from memscal.figures.friction import comparison_figures

    files: out.Files = {}
    with out.working("Drawing"):
        for stem, draw in comparison_figures(comparison).items():
            files |= out.rendered(draw, [named[stem]])
    return files


#: Options that are those of :func:`memscal.compare`.
_SETTINGS = (
    "lubricated",
    "lubricated_friction",
    "between_scan_gain",
    "macroscopic",
    "macroscopic_uncertainty",
    "interface",
    "shear",
    "sliding",
    "backlash",
    "override",
    "accept_altered",
)
#: Options that the comparison of a shear does not have, and how they are typed.
_NORMAL_STRESS_ONLY = {
    "references": "reference",
    "lubricated": "lubricated",
    "shear": "shear",
    "macroscopic": "macroscopic",
    "interface": "interface",
    "sliding": "sliding",
    "figures": "figure",
    "folder": "figures",
}


def _check_usage(options: Options, scans: Sequence[Path]) -> None:
    channel = options["channel"]
    if channel != "zz":
        if len(scans) > 1:
            raise click.UsageError(f"--channel {channel} takes one STRESS file.")
        for name, typed in _NORMAL_STRESS_ONLY.items():
            if options[name]:
                raise click.UsageError(f"--{typed} has no effect with --channel {channel}.")
    friction = options["friction"]
    loadings = options["loadings"]
    for name, values in (("friction", friction), ("loading", loadings)):
        twice = [value for value in values if values.count(value) > 1]
        if twice:
            raise click.UsageError(f"--{name} {twice[0]} is given twice.")
    if options["references"] and (friction or loadings):
        raise click.UsageError(
            "--reference brings its own friction coefficients and loading: leave out --friction "
            "and --loading."
        )
    if options["macroscopic"] is None:
        if options["macroscopic_uncertainty"] is not None:
            raise click.UsageError("--macroscopic-uncertainty needs --macroscopic.")
        if options["interface"]:
            raise click.UsageError(
                "--interface needs --macroscopic: the friction coefficient at which an interface "
                "that yields begins to slip."
            )
