"""``memscal compare``: measured against calculated stress, and the friction that explains it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from memscal.cli.compare_outputs import FigureFiles
from memscal.cli.failures import debug_option
from memscal.cli.options import FILE, Quantity, force_option, json_option
from memscal.cli.output import emit_json, message, show_messages
from memscal.cli.progress import working
from memscal.cli.targets import FIGURE_SUFFIXES, FigurePath
from memscal.cli.user_cache import cache_from, cache_options

if TYPE_CHECKING:
    from memscal.friction.results import FrictionComparison
    from memscal.model.provenance import SourceFile
    from memscal.model.stress import StressProfile

__all__ = ["command"]

_COEFFICIENT = Quantity("ratio", open_low=False, infinite=True)

EXAMPLES = """\b
Examples:
  memscal compare sensor.apparatus.h5 dry.h5
  memscal compare sensor.apparatus.h5 dry.stress.h5
  memscal compare sensor.apparatus.h5 dry.h5 lubricated.h5 --macroscopic 1.6 --figure friction.pdf
  memscal compare sensor.apparatus.h5 dry.h5 --friction 0.1 --friction 0.2 --json
  memscal compare sensor.apparatus.h5 dry.h5 --loading incremental --interface --macroscopic 1.6
  memscal compare sensor.apparatus.h5 dry.h5 --reference fem0.h5 --reference fem03.h5
"""


@click.command("compare", epilog=EXAMPLES)
@click.argument("artifact", type=FILE)
@click.argument("scans", type=FILE, nargs=-1, required=True, metavar="SCAN|STRESS...")
@click.option(
    "--friction",
    "friction",
    type=_COEFFICIENT,
    multiple=True,
    metavar="MU",
    help="Friction coefficient to calculate profiles for, beside 0 and inf (the film sticks "
    "wherever it is touched); between them profiles are interpolated. Repeated: several.  "
    "[default: nine between 0 and inf]",
)
@click.option(
    "--loading",
    "loadings",
    type=click.Choice(["incremental", "total"]),
    multiple=True,
    help="A point sticks where it first touched (incremental), or as if loaded in one step "
    "(total). May be repeated.  [default: both]",
)
@click.option(
    "--reference",
    "references",
    type=FILE,
    multiple=True,
    metavar="FILE",
    help="Profiles calculated elsewhere (memscal-reference), in place of memscal's: one file for "
    "each load and friction coefficient. Repeated.",
)
@click.option(
    "--macroscopic",
    type=_COEFFICIENT,
    metavar="MU",
    help="Friction coefficient measured in sliding, to compare with.",
)
@click.option(
    "--macroscopic-uncertainty",
    type=Quantity("ratio", open_low=False),
    metavar="U",
    help="Standard uncertainty (k = 1) of --macroscopic.",
)
@click.option(
    "--interface",
    is_flag=True,
    help="Also explain the profiles by an interface that yields before it slips, at the "
    "macroscopic friction, and say which of the two explanations is more likely.",
)
@click.option(
    "--override",
    is_flag=True,
    help="Compare although sensor, channel or film of artifact and scan differ; recorded.",
)
@cache_options
@click.option(
    "--figure",
    "single",
    type=FigurePath(),
    multiple=True,
    metavar="FILE.png|svg|pdf",
    help="Draw profiles, residuals, maxima and friction coefficients on one page. May be repeated.",
)
@click.option(
    "--figures",
    "folder",
    type=FILE,
    metavar="FOLDER",
    help="Draw each figure into a file of its own in this folder: profiles, profiles for a set of "
    "coefficients, maxima, effective friction, likelihood, interface.",
)
@click.option(
    "--figure-format",
    type=click.Choice([suffix.removeprefix(".") for suffix in FIGURE_SUFFIXES]),
    default="png",
    show_default=True,
    help="Format of --figures.",
)
@json_option
@force_option
@debug_option
def command(
    artifact: Path,
    scans: tuple[Path, ...],
    friction: tuple[float, ...],
    loadings: tuple[str, ...],
    references: tuple[Path, ...],
    macroscopic: float | None,
    macroscopic_uncertainty: float | None,
    interface: bool,
    override: bool,
    cache: Path | None,
    no_cache: bool,
    single: tuple[Path, ...],
    folder: Path | None,
    figure_format: str,
    as_json: bool,
    force: bool,
) -> int:
    """Compare the stress that contact SCANs measured with calculated contacts.

    In place of the scans, give the measured STRESS that memscal apply wrote of them. The sensor's
    conversion constant and apparatus function come from ARTIFACT. A sphere is pressed on the film
    by calculation, at the measured loads and with several friction coefficients; what reaches the
    sensor is held against what it measured, load by load and over all loads. The effective friction
    coefficient comes with a confidence interval, or as a bound where the data tell no more, by the
    maximum of each profile and by the whole of it.

    A failed quality check is exit code 1: the results are printed all the same.
    """
    _check_usage(friction, loadings, references, macroscopic, macroscopic_uncertainty, interface)
    kept = cache_from(cache, no_cache)

    from memscal.apparatus import load_apparatus
    from memscal.formats.opened import opened_contacts
    from memscal.friction.requirements import scans_of

    known, data = load_apparatus(artifact), opened_contacts(scans)
    tables = _read_references(references)
    lubrications = tuple(dict.fromkeys(scan.lubrication for scan in scans_of(data)))
    files = FigureFiles(single, folder, figure_format, lubrications, interface)
    files.prove(force=force, inputs=[artifact, *scans, *references])

    from memscal.friction.procedure import compare

    with working("Comparing with calculated contacts"):
        found = compare(
            data,
            known,
            friction=_coefficients(friction),
            loading=loadings or ("incremental", "total"),
            references=tables or None,
            macroscopic=macroscopic,
            macroscopic_uncertainty=macroscopic_uncertainty,
            interface=interface,
            override=override,
            cache=kept,
            workers=_workers(),
        )
    with working("Drawing"):
        ready = files.rendered(found)
    files.write(ready, force=force)
    _tell(found, artifact, tables, files.paths, as_json)
    for path in files.paths:
        message(f"Written: {path}")
    return _judged(found)


def _coefficients(given: tuple[float, ...]) -> tuple[float, ...] | None:
    """Return coefficients in their order, from none to full stick; ``None`` for the usual ones."""
    return tuple(sorted({0.0, *given, math.inf})) if given else None


def _workers() -> int:
    """Return how many processes calculate contacts: two where there are two cores."""
    import os

    return min(2, os.cpu_count() or 1)


def _check_usage(
    friction: tuple[float, ...],
    loadings: tuple[str, ...],
    references: tuple[Path, ...],
    macroscopic: float | None,
    uncertainty: float | None,
    interface: bool,
) -> None:
    """Refuse options that do not go together, before anything is read."""
    for name, values in (("friction", friction), ("loading", loadings)):
        twice = [value for value in values if values.count(value) > 1]
        if twice:
            raise click.UsageError(f"--{name} {twice[0]} is given twice.")
    if references and (friction or loadings):
        raise click.UsageError(
            "--reference brings its own friction coefficients and loading: leave out --friction "
            "and --loading."
        )
    if uncertainty is not None and macroscopic is None:
        raise click.UsageError("--macroscopic-uncertainty needs --macroscopic.")
    if interface and macroscopic is None:
        raise click.UsageError(
            "--interface needs --macroscopic: the friction coefficient at which an interface that "
            "yields begins to slip."
        )


def _read_references(paths: tuple[Path, ...]) -> list[StressProfile]:
    from memscal.formats.reference import read_reference

    return [read_reference(path) for path in paths]


def _source(path: Path) -> SourceFile:
    """Return the artifact's name and the SHA-256 of its bytes."""
    import hashlib

    from memscal.formats.file_bytes import read_bytes
    from memscal.model.provenance import SourceFile

    return SourceFile(path.name, hashlib.sha256(read_bytes(path)).hexdigest())


def _tell(
    found: FrictionComparison,
    artifact: Path,
    references: list[StressProfile],
    files: list[Path],
    as_json: bool,
) -> None:
    """Print the results and the messages."""
    from memscal.cli.compare_json import comparison_json
    from memscal.cli.compare_notes import comparison_notes
    from memscal.cli.compare_view import comparison_tables
    from memscal.cli.tables import emit_tables

    if as_json:
        sources = [profile.source for profile in references]
        emit_json(comparison_json(found, _source(artifact), sources, files))
    else:
        emit_tables(*comparison_tables(found))
    show_messages(comparison_notes(found))


def _judged(found: FrictionComparison) -> int:
    from memscal.cli.compare_notes import failures
    from memscal.cli.quality_view import exit_code_of

    named = [
        f"{kind} {' '.join(check.profile for check in failed)}".strip()
        for kind, failed in failures(found.checks).items()
    ]
    return exit_code_of(found.checks, named)
