"""Import of several tables, each by itself, to a folder of scans."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from memscal.cli import output as out
from memscal.cli.failures import CHECK_FAILED, DONE
from memscal.cli.import_ import convert, prepared
from memscal.cli.options import Options
from memscal.errors import InputError, MemscalError
from memscal.extensions.fleet.many import attempted
from memscal.extensions.fleet.recipe import expression_of, place_in_name, recipe_text
from memscal.extensions.fleet.shards import (
    TABLE_SUFFIXES,
    expanded,
    make_folder,
    manifest_scans,
    require_same,
    write_batch,
)
from memscal.model.checks import Message, marked_texts
from memscal.progress import Task
from memscal.summaries.table import Table


def import_tables(context: click.Context, options: Options) -> int:
    """Convert tables to files in a folder, and print what was refused; return the exit code."""
    asked = context.params
    folder = asked["output"]
    recipe = asked["save_recipe"]
    force = asked["force"]
    writing = not asked["dry_run"]
    if asked["figure"]:
        raise click.UsageError("--figure belongs to one table.")
    targets = _targets(expanded(asked["tables"]), folder)
    text = recipe_text(context)
    stated = dict(re.findall("(.+) = (.+)", text))
    options = prepared(targets.values(), asked["kind"], options)
    expression_of(options)
    wanted = [path for path in targets if force or not (asked["resume"] and path.exists())]
    counts = {"tables": len(targets), "kept": len(targets) - len(wanted)}
    record = folder / "import.json"
    if counts["kept"]:
        require_same(record, stated)
    if writing:
        there = [path for path in wanted if path.exists()]
        out.prove_writable([*there, recipe], force=force, inputs=targets.values())
        make_folder(folder)
        write_batch(record, {"options": stated})
    jobs = {}
    for path in wanted:
        output = path if writing else None
        table = targets[path]
        jobs[str(table)] = partial(convert, table, output, asked["kind"], options, force=force)
    refused = attempt_all(jobs, counts, as_json=asked["as_json"])
    files = {}
    if recipe and len(refused) < len(jobs):
        files[recipe] = text
    if options["name_pattern"]:
        lines = ["path,sensor,wafer_x,wafer_y,place_unit"]
        for path, table in targets.items():
            if str(table) not in refused:
                place = place_in_name(table, options).values()
                lines.append('"{}","{}",{},{},{}'.format(path.name, *place))
        files[folder / "manifest.csv"] = "\n".join([*lines, ""])
    if writing:
        out.write_files({path: text.encode() for path, text in files.items()}, force=True)
        out.say_written([folder, *files])
    return CHECK_FAILED if refused else DONE


def _targets(sources: Iterable[Path], folder: Path) -> dict[Path, Path]:
    """Return tables by the files to which they are written; refuse two for one."""
    targets = dict[Path, Path]()
    for source in sources:
        tables = [source]
        if source.is_dir():
            tables = [source / scan.path for scan in manifest_scans([source], TABLE_SUFFIXES)]
        for table in tables:
            target = folder / f"{table.stem}.h5"
            if target in targets:
                raise InputError(
                    f"{targets[target]} and {table} would both be written to {target}.",
                    cure="Rename one of them, or import them to folders of their own.",
                )
            targets[target] = table
    if not targets:
        endings = ", ".join(TABLE_SUFFIXES)
        raise InputError(f"The folder holds no tables, whose names end in {endings}.")
    return targets


def attempt_all(
    jobs: Mapping[str, Callable[[], Any]], counts: Mapping[str, int], *, as_json: bool
) -> dict[str, MemscalError]:
    """Do jobs, by the names of their inputs; print what comes of them, and return what fails."""
    notes: list[Message] = []
    refused = {}
    attempts = ((name, attempted(name, job)) for name, job in jobs.items())
    with out.working("Reading"):
        for name, done in Task("tables", len(jobs)).counted(attempts):
            if isinstance(done, MemscalError):
                refused[name] = done
            else:
                notes += done if isinstance(done, Sequence) else done.messages
    numbers = {**counts, "read": len(jobs) - len(refused), "refused": len(refused)}
    problems = [{"path": name, **vars(error)} for name, error in refused.items()]
    causes = [tuple(problem.values()) for problem in problems]
    table = Table("Refused", ("input", "problem", "why", "cure"), causes)
    told = {"problems": problems, "notes": marked_texts(notes)}
    emit_counts("Tables", numbers, told, table, as_json=as_json)
    if not as_json:
        out.show_messages(notes, "tables")
    return refused


def emit_counts(
    title: str,
    counts: Mapping[str, object],
    told: Mapping[str, object],
    *tables: Table,
    as_json: bool,
) -> None:
    """Print numbers of inputs and tables, or in JSON the numbers and what else is told."""
    if as_json:
        out.emit_json({"schema_version": "1", **counts, **told})
    else:
        rows = [(name.replace("_", " "), str(number)) for name, number in counts.items()]
        out.emit_tables(Table(title, ("", ""), rows), *tables)
