"""``memscal batch``: many scans, each by itself, in shards, to Parquet tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from functools import partial
from operator import itemgetter
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from memscal.cli import output as out
from memscal.cli.calibrate import calibration_options, calibration_settings
from memscal.cli.failures import CHECK_FAILED, DONE, debug_option
from memscal.cli.options import FILE, files_argument, flag, json_option, option, report_option
from memscal.errors import MemscalError

if TYPE_CHECKING:
    from memscal.extensions.fleet.batch import Batch, Counts

EXAMPLES = """\b
Examples:
  memscal batch scans -o results --report scans.html
  memscal batch wafer.csv -o results --resume --method bayesian --artifacts none
  memscal batch dies/*.csv -o results --recipe recipe.toml --dry-run
  memscal batch wafer.csv -o results --resume --scheduler tcp://node1:8786
  memscal summary results
"""


@click.command("batch", epilog=EXAMPLES)
@files_argument("FOLDER|MANIFEST|SCAN...", "sources")
@option("-o --output results", FILE, metavar="RESULTS", required=True)(
    "Folder of the results, which must not exist yet: tables (Parquet) in RESULTS/shards, "
    "artifacts in RESULTS/artifacts."
)
@option("--recipe", FILE, metavar="recipe.toml")(
    "The inputs are tables, read as this file states, which memscal import --save-recipe writes."
)
@flag("--resume")(
    "Continue in RESULTS: shards stay if their file is whole and is of the same scans and version; "
    "the others are calibrated. Other options than before are refused."
)
@option("--workers", click.IntRange(1, 512), metavar="N")(
    "Processes on this machine.  [default: one for each core]"
)
@option("--scheduler", "ADDRESS")(
    "Scheduler of a Dask cluster, such as tcp://node1:8786, whose workers see the same files."
)
@option("--shard-size", click.IntRange(min=2), metavar="SCANS")(
    "Scans of a shard: a task, and a table. What is under way when a batch is killed is lost.  "
    "[default: a 64th of the scans, 4 to 256; with --resume as before]"
)
@option("--artifacts", ["failed", "all", "none"], "failed")(
    "Of which calibrations artifacts are written, too: of those with a failed check, all, or none."
)
@calibration_options
@report_option
@flag("--force")(
    "Calibrate every scan anew, with whatever options; replace the page of --report, too."
)
@flag("--dry-run")("Read every input, say which are refused, and write nothing.")
@json_option
@debug_option
def command(
    sources: tuple[Path, ...],
    results: Path,
    recipe: Path | None,
    resume: bool,
    workers: int | None,
    scheduler: str | None,
    shard_size: int | None,
    artifacts: str,
    report: Path | None,
    force: bool,
    dry_run: bool,
    as_json: bool,
    **settings: Any,
) -> int:
    """Calibrate with every scan in a folder, that a manifest lists, or that is named.

    A manifest is a text file with the path of a scan a line, relative to its own folder, or a CSV
    file with a column path and optional wafer_x, wafer_y (mm), the sensor's place on its wafer,
    and sensor, its name. With --recipe they are tables.

    Each scan is a row of a table: A, widths, uncertainties, checks, G(r), digests, by the method
    alone that is asked for; a scan that cannot be calibrated has its error there, and the exit
    code is 1. What is done stays when the program is interrupted or killed: --resume does the
    rest.
    """
    if workers and scheduler:
        raise click.UsageError("--workers and --scheduler exclude each other: give one of them.")
    from memscal.extensions.fleet.batch import Batch
    from memscal.extensions.fleet.import_tables import attempt_all, emit_counts
    from memscal.extensions.fleet.recipe import recipe_of
    from memscal.extensions.fleet.results_summary import error_groups
    from memscal.extensions.fleet.shards import expanded, make_folder, read_fleet, shard_paths
    from memscal.progress import span

    chosen = calibration_settings(**settings)
    paths = expanded(sources)
    words, reading = recipe_of(recipe) if recipe else ({}, None)
    words |= settings | {"artifacts": artifacts}
    batch = Batch(paths, results, chosen, artifacts, words, reading, force, shard_size)
    if report is not None and results not in report.parents:
        scans = (batch.folder / scan.path for scan in batch.scans())
        out.prove_writable([report], force=force, inputs=[*paths, *scans])
    batch = batch.prepare(resume=resume)
    if dry_run:
        numbers = {"scans": batch.count, "shards": len([*batch.shards()])}
        jobs = {scan.path: partial(batch.read, batch.folder / scan.path) for scan in batch.scans()}
        return CHECK_FAILED if attempt_all(jobs, numbers, as_json=as_json) else DONE
    make_folder(results / "shards")
    start = monotonic()
    out.prove_writable([report], force=force)  # in the folder of results, too, which is there now
    total = batch.count
    try:
        outcomes = list(_outcomes(batch, workers, scheduler))
    except (KeyboardInterrupt, MemscalError):
        if shard_paths(results):
            out.note("The shards that are done stay: --resume does the rest.")
        raise
    seconds = monotonic() - start
    done = sum(outcomes, Counter())
    errors = done["errors"]
    failed = done["failed"]
    counts = {
        "scans": total,
        "passed": total - errors - failed,
        "failed_checks": failed,
        "errors": errors,
        "shards_written": len(outcomes) - done["kept"],
        "shards_kept": done["kept"],
        "time": span(seconds),
    }
    told = {"results": str(results), "time": {"value": round(seconds, 1), "unit": "s"}}
    emit_counts("Batch", counts, told, as_json=as_json)
    if errors:
        with suppress(MemscalError):  # sensors of several kinds, which a summary refuses
            for group in error_groups(read_fleet(results))[:4]:
                out.message("{scans} of {error_class}, as {first}: {problem}".format(**group))
    out.say_written([results])
    if report is not None:  # whose errors are told after what the batch has done
        out.write_files(out.reported(read_fleet(results), report), force=force)
        out.say_written([report])
    if not errors + failed:
        return DONE
    what = f"{errors} of {total} scans could not be calibrated, {failed} failed a quality check"
    out.warn(f"{what}: memscal summary {results}")
    return CHECK_FAILED


def _outcomes(batch: Batch, workers: int | None, scheduler: str | None) -> Iterator[Counts]:
    """Yield the counts of a batch, and show how far it is."""
    from memscal.parallel import cluster, cores, worker_pool
    from memscal.progress import Task

    with ExitStack() as stack:
        if scheduler:
            executor, most = stack.enter_context(cluster(scheduler))
        else:
            count = workers or cores()
            executor = stack.enter_context(worker_pool(count))

            def most() -> int:
                return 2 * count

        stack.enter_context(out.working("Calibrating", rate=True))
        size = itemgetter("scans")
        kept = itemgetter("kept")
        yield from Task("scans", batch.count).counted(batch.run(executor, most), size, kept)
