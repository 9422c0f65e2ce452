"""``memscal import``: a table of numbers to a scan or a reference, or a mesh to a reference."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli import output as out
from memscal.cli.failures import DONE
from memscal.cli.options import (
    FILE,
    FILM_NUMBERS,
    FREE_OR_STUCK,
    LAW,
    POSITION,
    Options,
    declared_options,
    files_argument,
    film_from,
    film_options,
    indenter_from,
    laboratory_option,
    named,
    option,
    output_options,
    radius_options,
    rod_friction_option,
    with_laboratory,
)
from memscal.errors import MemscalError
from memscal.extensions import hook
from memscal.formats.files import together
from memscal.model.checks import import_notes, marked_texts
from memscal.summaries.table import readable

if TYPE_CHECKING:
    from memscal.formats.tables.reference import ImportedProfile
    from memscal.formats.tables.scan import ImportedScan
    from memscal.model.checks import Message

_SHARED = ("r_unit", "sigma", "sigma_unit", "shear", "sign", "shear_sign", "value", "solver")
_TABLE_ONLY = ("r",)
_MESH_ONLY = ("vertical", "base", "centre")
READING = ("sheet", "skip_rows", "missing", "delimiter", "decimal")


def _read_reference(path: Path, mesh: bool, options: Options) -> ImportedProfile:
    """Read the reference with the options given; for the others the library's defaults hold."""
    setting = stated_options(options, (*_SHARED, "load", "film", "indenter"))
    if not mesh:
        from memscal.formats.tables.reference import read_reference_table

        setting |= stated_options(options, _TABLE_ONLY)
        return read_reference_table(path, reading=stated_options(options, READING), **setting)

    setting |= stated_options(options, _MESH_ONLY)
    profile: ImportedProfile = hook("read_reference_mesh")(path, **setting)
    return profile


EXAMPLES = """\b
Examples:
  memscal import scan.csv -o scan.h5 --x position --x-unit mm --u voltage --u-unit mV
      --load 1 --radius 0.25 --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2
  memscal import raster.csv -o raster.h5 --x 1 --y 2 --x-unit um --u 5 --u-unit V
      --repeat 3 --load-column 4
      --radius 0.5 --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2
  memscal import sphere.csv -o dry.h5 --x x --x-unit mm --u U --u-unit mV --load-column "load set"
      --repeat "load set" --repeat pass --load-scatter 2 --lubrication dry
      --indenter sphere --radius 60 --young-modulus 1.9 --poisson-ratio 0.5 --thickness 1.5
  memscal import current.csv -o scan.h5 --x x --u current
  memscal import scan.xlsx -o scan.h5 --sheet Data --x Weg --u Spannung --noise 0.04 --missing n.a.
  memscal import log.csv -o scan.h5 --x x --u U --load-column F --holds --figure holds.png
  memscal import slid.csv -o slid.h5 --time t --speed 1 --u U --sliding direction --low-pass 10
      --load 1.37 --tangential-load Q --indenter sphere --radius 128.8
      --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2
  memscal import row.csv -o row.h5 --x x --u "u_*" --layout layout.csv
      --load 1 --radius 0.25 --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2
  memscal import die_00.csv -o die_00.h5 --x x --u U --load 1 --save-recipe recipe.toml
  memscal import dies/*.csv -o scans --recipe recipe.toml --name-pattern "die_{row}_{col}"
  memscal import fem.csv -o rod.h5 --format reference --r r --r-unit mm
      --sigma S33 --sigma-unit MPa --sign -1 --load 1
  memscal import fem.vtu -o rod.h5 --format reference --r-unit mm
      --sigma S --sigma-unit MPa --load 1

\b
Columns are given by their names in the header, or by their numbers counted from 1 where no name
is a number. Units stand in the header (x [mm], x/mm) or in a row below it. Missing values are
empty cells and the words nan, na, n/a, #n/a, nat, null, none and -. Workbooks and Parquet need the
extra tables: pip install ".[tables]"; TDMS needs the extra recorded.
Meshes (.vtu, .vtk, .xdmf) need the extra fem-io: pip install ".[fem-io]".
"""


def _take_recipe(context: click.Context, _: click.Parameter, path: Path | None) -> None:
    """Take a recipe's words as defaults of the options that come after this one."""
    if path:
        hook("read_recipe")(context, path)


class _Time(click.ParamType):  # type: ignore[type-arg] # older releases of click are not generic
    """A date or a time of ISO 8601, which stays text."""

    name = "time"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Refuse what is no date."""
        try:
            datetime.fromisoformat(value)
        except ValueError:
            self.fail(f"{value!r} is no date or time such as 2026-11-20T09:30:00.", param, ctx)
        return value


OPTIONS = tomllib.loads(Path(__file__).with_name("import_options.toml").read_text("utf-8"))
"""Options, by what they are of."""
KINDS = {
    "file": FILE,
    "figure": out.FigurePath(),
    "time": _Time(),
    "place": (POSITION, POSITION),
    "pitch": click.FloatRange(0, min_open=True),
    "count": click.IntRange(0),
    "ordinal": click.IntRange(1),
}
"""What a value of theirs may be, beside a number in a unit, one of some choices, and text."""
_INDENTER = ("indenter", "radius", "radius_uncertainty", "rod_friction", "indenter_name")
_CELL_NAMES = {"name": "load_cell", "serial_number": "load_cell_serial"}
_SENSOR_NAMES = {"name": "sensor_name", "model": "sensor_model", "channel": "channel"}
_SIGNS = ("u_sign", "sign", "shear_sign")
_OF_REFERENCE = (*_TABLE_ONLY, *_SHARED, *_MESH_ONLY)
_OF_BOTH = (
    "load",
    "indenter",
    "radius",
    "radius_uncertainty",
    *FILM_NUMBERS,
    *LAW,
    *READING,
)
_NEEDED = {"scan": ("x", "u"), "reference": ("sigma",)}
_NEEDED_WITH_MESH = ("r_unit", "sigma_unit")
#: Columns that a message names.
_NAMED = 12


@click.command("import", epilog=EXAMPLES)
@files_argument("TABLE|FOLDER...", "tables")
@option("-o --output", FILE, required=True, metavar="OUT|FOLDER")(
    "Scan or reference to write; of several tables the folder, which has TABLE.h5 of each."
)
@option(
    "--recipe",
    FILE,
    callback=_take_recipe,
    is_eager=True,
    expose_value=False,
    metavar="recipe.toml",
)("File (TOML) with what is not given here.")
@declared_options(OPTIONS["scan"], KINDS)
@laboratory_option("Scan: ")
@declared_options(OPTIONS["reference"], KINDS)
@radius_options("the rod or of the sphere's curvature")
@film_options()
@rod_friction_option(FREE_OR_STUCK)
@declared_options(OPTIONS["table"], KINDS)
@output_options
@click.pass_context
def command(
    context: click.Context,
    /,
    tables: tuple[Path, ...],
    output: Path,
    kind: str,
    as_json: bool,
    force: bool,
    save_recipe: Path | None,
    resume: bool,
    dry_run: bool,
    **options: Any,
) -> int:
    """Convert a TABLE or a mesh (VTU, VTK, XDMF) to a scan or a reference, or several of them.

    Tables are text (CSV, SPEC), .xlsx, Parquet, HDF5 (its columns are paths) and TDMS.

    The options state the film and the indenter, which a table does not, and units that it does not
    state; a scan to be calibrated with a reference of its own needs no film, indenter or load.
    Readings are kept as they are. What was read, and what was pressed on what, is printed and
    kept in the notes of the file. A table of several that is refused is named with its cause, the
    others are written, and the exit code is 1.
    """
    if len(tables) > 1 or tables[0].is_dir() or output.is_dir():
        code: int = hook("import_tables")(context, options)
        return code
    if resume:
        raise click.UsageError("--resume belongs to several tables, whose -o is a folder.")
    options = prepared(tables, kind, options)
    table = tables[0]
    figures = options["figure"] or ()
    inputs = [*hook("with_drawn_in")(table), options["lab"], options["layout"]]
    out.prove_writable([output, *figures, save_recipe], force=force, inputs=inputs)
    with together():
        with out.working("Reading"):
            notes = convert(table, None if dry_run else output, kind, options, force=force)
        if save_recipe and not dry_run:
            out.write_files({save_recipe: hook("recipe_text")(context).encode()}, force=force)
        warnings = [note for note in notes if note.severity == "warning"]
        if as_json:
            out.emit_json(
                {
                    "schema_version": "1",
                    "output": str(output),
                    "format": kind,
                    "notes": marked_texts(notes),
                }
            )
        else:
            out.emit(readable("\n".join(note.text for note in notes if note not in warnings)))
    out.show_messages(warnings)
    if not dry_run:
        out.say_written([output, save_recipe])
    return DONE


def prepared(tables: Iterable[Path], kind: str, options: Options) -> Options:
    """Return the options as tables of a kind are read with them, or say which are wrong."""
    given = ("u", "repeat", "missing", "figure", "holds", "position_errors_by_repeat")
    options = options | {name: options[name] or None for name in given}
    for table in tables:
        _check_usage(table, kind, hook("is_mesh")(table), options)
    options |= {name: int(options[name]) for name in _SIGNS if options[name] is not None}
    return {**options, "film": None, "indenter": None, **_set_up(options)}


def convert(
    table: Path, output: Path | None, kind: str, options: Options, *, force: bool
) -> Sequence[Message]:
    """Write what a table or a mesh holds, where there is an output; return the notes on it."""
    if kind == "reference":
        from memscal.formats.reference import write_reference

        reference = _read_reference(table, hook("is_mesh")(table), options)
        if output is not None:
            write_reference(reference.profile, output, overwrite=force)
        return reference.notes
    from memscal.formats.scan import write_scan
    from memscal.readings.noise_record import noise_of
    from memscal.summaries.not_stated import not_stated

    scan = read_table(table, options)
    if output is not None:
        write_scan(scan, output, overwrite=force)
        if scan.holds is not None:
            out.write_files(out.rendered(scan.holds.plot, options["figure"] or ()), force=force)
    if scan.motion == "rest":
        return [*scan.messages, *import_notes([noise_of(scan).text(scan.reading)])]
    texts = [
        f"Not stated: {row['words']:<38}{row['option']:<33}{row['cost']}"
        for row in not_stated(scan)
    ]
    return [*scan.messages, *import_notes(texts)]


def _check_usage(path: Path, kind: str, mesh: bool, options: Options) -> None:
    """Name every option that is missing, or that belongs to something else, at once."""
    if kind == "scan" and mesh:
        raise click.UsageError(f"{path.name} is a mesh, and no scan: add --format reference.")
    needed = list(_NEEDED[kind])
    if kind == "reference":
        needed += _NEEDED_WITH_MESH if mesh else _TABLE_ONLY
    elif not stated_options(options, ("x", "u")) and hook("kind_of_record")(path) == "HDF5 file":
        needed = []  # but what it plots
    elif stated_options(options, ("y", "time", "speed", "step", "motion")):
        needed.remove("x")  # the library knows what they need, and says it
    missing = [name for name in needed if options[name] is None]
    if missing:
        raise click.UsageError(
            f"A {kind} needs more: add {named(missing)}. {_example(path, missing, options)}"
        )
    other = "reference" if kind == "scan" else "scan"
    others: Iterable[str] = _OF_REFERENCE
    if kind == "reference":
        others = [name for name in options if name not in (*_OF_REFERENCE, *_OF_BOTH)]
    misplaced = stated_options(options, others)
    if misplaced:
        raise click.UsageError(f"{named(misplaced)} belong to --format {other}.")
    if options["value"] is not None and options["load"] is not None:
        raise click.UsageError("Give --load, or --value in its place.")
    if options["rod_friction"] is not None and options["indenter"] == "sphere":
        raise click.UsageError("--rod-friction belongs to --indenter rod.")
    of_holds = stated_options(options, ("depth", "depth_unit", "baseline", "figure"))
    if of_holds and options["holds"] is None:
        raise click.UsageError(f"{named(of_holds)} belong to --holds.")
    if not mesh and options["shear_sign"] is not None and options["shear"] is None:
        raise click.UsageError("--shear-sign belongs to --shear.")
    unused = stated_options(options, (*_TABLE_ONLY, *READING) if mesh else _MESH_ONLY)
    if unused and kind == "reference":
        problem = f"A {'mesh' if mesh else 'table'} has no use for {named(unused)}."
        raise click.UsageError(problem)


def _example(table: Path, missing: Sequence[str], options: Options) -> str:
    """Return a command for the user's own table, with its first columns as x and u."""
    from memscal.formats.tables.sheets import open_table

    columns: Sequence[str] = ()
    if {*missing} <= {"x", "u"}:
        with suppress(MemscalError):
            columns = open_table(table, **stated_options(options, READING)).names
    taken = [*options.values(), *(options["u"] or ())]
    free = [column for column in columns if column not in taken]
    if len(free) < len(missing):
        return "See the examples of `memscal import --help`."
    line = ["memscal", "import", str(table)]
    if options["x"] or "x" in missing:
        line += ["--x", options["x"] or free.pop(0)]
    for column in options["u"] or [free.pop(0)]:
        line += ["--u", column]
    return (
        f"The columns of {table.name} are {', '.join(columns[:_NAMED])}. For instance: "
        f"{shlex.join([*line, '-o', f'{table.stem}.h5'])}"
    )


def stated_options(values: Options, names: Iterable[str]) -> Options:
    """Return the options that were given, so that the library's own defaults hold."""
    return {name: values[name] for name in names if values[name] is not None}


#: What can be done where a property of the film is not known.
_UNKNOWN = (
    " One that is not known: of a linear film (--film-law linear) any modulus serves; give the "
    "others as guessed, with their uncertainty, or leave the film out, and calibrate with "
    "--reference point."
)


def _set_up(options: Options) -> Options:
    stated: Options = {}
    if stated_options(options, (*FILM_NUMBERS, *LAW, "film_name")):
        stated["film"] = film_from(options, _UNKNOWN)
    if stated_options(options, _INDENTER):
        stated["indenter"] = indenter_from(options["indenter"] or "rod", options)
    return stated


def read_table(path: Path, options: Options) -> ImportedScan:
    """Read a scan with options that are prepared."""
    from memscal.formats.tables.scan import (
        ARRAYS,
        import_table,
        records_of,
        stated_in_words,
        with_notes,
    )
    from memscal.model.instrument import Dynamics, LoadCell, StressSensor

    if options["name_pattern"]:
        name = hook("place_in_name")(path, options)["sensor"]
        options = {**options, "sensor_name": options["sensor_name"] or name}
    sensor = {field: options[option] for field, option in _SENSOR_NAMES.items()}
    load_cell = {field: options[option] for field, option in _CELL_NAMES.items()}
    stated = stated_options(options, options)
    dynamics = stated_options(options, options.keys() & vars(Dynamics()).keys())
    sensor["dynamics"] = Dynamics(**dynamics) if dynamics else None
    stated["sensor"] = StressSensor(**stated_options(sensor, sensor))
    stated["load_cell"] = LoadCell(**stated_options(load_cell, _CELL_NAMES))
    stated["x_error"] = options["position_error"]
    columns = stated_options(options, ("x", "u", *ARRAYS))
    bare = import_table(path, **columns, **records_of(stated))
    scan = with_laboratory(options["lab"], bare)
    known = stated_in_words(bare)
    added = [text for text in stated_in_words(scan) if text not in known]
    return with_notes(scan, [f"With {options['lab'].name}: {text}" for text in added])
