"""``memscal import``: a table of numbers to a scan or a reference, or a mesh to a reference."""

from __future__ import annotations

import shlex
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
    NonNegative,
    Options,
    Quantity,
    film_from,
    film_options,
    indenter_from,
    laboratory_option,
    motion_options,
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
_SIGN = click.Choice(["1", "-1"])


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
@click.argument("tables", type=FILE, nargs=-1, required=True, metavar="TABLE|FOLDER...")
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
@option("--save-recipe", FILE, metavar="recipe.toml")(
    "File to write what was given to, for --recipe of import and batch."
)
@option("--name-pattern", "PATTERN")(
    "Scan: what the names of tables state, such as die_{row}_{col}: {row} and {col} the place on "
    "the wafer (to FOLDER/manifest.csv); {sensor} its name, which is otherwise the table's; {any} "
    "is skipped. {row:COLUMN} takes it from a column with one number."
)
@option("--die-pitch", click.FloatRange(0, min_open=True), nargs=2, metavar="MM MM")(
    "Scan: distance of columns and of rows on the wafer, in mm.  [default: places count dies]"
)
@option("--resume", is_flag=True)(
    "Several tables: keep scans that are there; other options than FOLDER/import.json has are "
    "refused."
)
@option("--dry-run", is_flag=True)(
    "Read every table, say what would be written, and write nothing."
)
@option("--format kind", click.Choice(["scan", "reference"]), "scan")(
    "What it holds: measured points, or the base stress of a FEM calculation."
)
@option("--x", "COLUMN")("Scan: column of the position.")
@option("--x-unit", "UNIT")(
    "Scan: unit of the positions, such as mm.  [default: that of the column's head, x/mm]"
)
@option("--u", "COLUMN", multiple=True)(
    "Scan: column of the normal channel's voltage or reading. May be repeated, and * stands for "
    "any text: the columns of the sensors of an array, named as their heads without units. Frames "
    "without positions need no import: memscal locate reads their table."
)
@option("--layout", FILE)(
    "Scan of an array: table of where its sensors are, with the columns sensor, x and y (and "
    "x_errors, y_errors, and board, the number of shared electronics), units in the heads, and one "
    "row for each sensor."
)
@option("--u-unit --unit u_unit", "UNIT")(
    "Scan: unit of the readings, of any kind, such as mV, pA, uT, Pa, or 1 of counts.  [default: "
    "that of the column's head]"
)
@option("--y", "COLUMN")(
    "Scan: column of the second position, of points in a plane, or of a line along y."
)
@option("--time", "COLUMN")("Scan: column of the time of each reading, which is kept.")
@option("--time-unit", "UNIT")(
    "Scan: unit of the times, s or ms.  [default: that of the column's head]"
)
@option("--speed", Quantity("mm/s", low=-float("inf")))(
    "Scan: speed of the stage, in mm/s. Without --x the position is speed times time."
)
@option("--sliding", "forth|back|COLUMN")(
    "Scan of an indenter that slid: forth, to larger x, or back, or the column that says it (1 or "
    "forth, -1 or back). With --speed and --time positions go back with it."
)
@option("--tangential-load", "COLUMN")("Scan: column of the load along the line at each point.")
@motion_options
@option("--step", Quantity("mm"))(
    "Scan: distance of neighbouring places, in mm. They are counted by --x or, with --holds and "
    "without --x, by the presses of the load or the depth."
)
@option("--averaging-length", Quantity("mm"))(
    "Scan: way over which each reading is the mean, in mm, centred on its position."
)
@option("--dwell dwell_time", NonNegative("s"))(
    "Scan: how long the indenter was held at each place before its reading, in s."
)
@option("--noise-record motion", flag_value="rest")(
    "Readings in time (--time) with nothing pressed, without --x: what --noise-record of other "
    "commands takes."
)
@option("--u-errors", "COLUMN")("Scan: column of each reading's standard uncertainty.")
@option("--noise", Quantity("unit of u"))(
    "Scan: standard uncertainty of each reading, one number, in the unit of u."
)
@option("--holds", is_flag=True)(
    "Scan: the table is a log in the order of time. Holds, where the indenter presses at rest, are "
    "found, and each is averaged with its scatter."
)
@option("--depth", "COLUMN")(
    "Holds: column that tells when the indenter presses: it grows as the indenter is lowered, or "
    "is 1 where it presses and 0 elsewhere. It is not kept."
)
@option("--depth-unit", "UNIT")("Holds: unit of the depth.  [default: that of the column's head]")
@option("--baseline", click.Choice(["before-each"]))(
    "Holds: the reading before each press is subtracted from it."
)
@option("--figure", out.FigurePath(), multiple=True, metavar="FILE.png|svg|pdf")(
    "Scan: the log with the holds that were found."
)
@option("--repeat", "COLUMN", multiple=True)(
    "Scan: column that numbers the repeats. Repeated: each combination of the columns is a "
    "line, such as of the load that was set and of the pass."
)
@option("--branch", "COLUMN")(
    "Scan: column that says approach (or 1) where the indenter was loaded, retreat (or 2) where "
    "it was unloaded."
)
@option("--u-xz", "COLUMN")("Scan: column of the channel xz.")
@option("--u-yz", "COLUMN")("Scan: column of the channel yz.")
@option("--load", Quantity("N"))(
    "Normal load, in N.  [default: not stated; of a reference the force that it carries]"
)
@option("--value", Quantity("N"))(
    "Reference without a load: the force, in N, that it is scaled to carry."
)
@option("--load-column", "COLUMN")("Scan: column of the load at each point.")
@option("--load-unit", "UNIT")("Scan: unit of the column of loads.  [default: N]")
@option("--load-uncertainty", NonNegative("N"))(
    "Scan: standard uncertainty of the load common to all points, in N."
)
@option("--load-scatter", NonNegative("percent"))(
    "Scan: standard uncertainty of each point's own load, independent from point to point, "
    "in percent, such as of weights set down by hand."
)
@option("--position-error", NonNegative("um"))(
    "Scan: standard uncertainty of each position, one for all repeats at it, in um."
)
@option("--position-errors-by-repeat", is_flag=True)(
    "Scan: errors of positions are new in each repeat."
)
@option("--position-scale-uncertainty", NonNegative("percent"))(
    "Scan: standard uncertainty of the stage's scale, common to all positions, in percent."
)
@option("--gain-uncertainty", NonNegative("percent"))(
    "Scan: standard uncertainty of the gain of the sensor's chain, in percent."
)
@option("--gain-curvature-uncertainty", NonNegative("ratio"))(
    "Scan: standard uncertainty of b, where a reading is U (1 - b U/Umax)."
)
@option("--roundness-uncertainty", NonNegative("ratio"))(
    "Scan: standard uncertainty of the sensor's axis ratio, which is taken to be one."
)
@option("--line-offset-uncertainty", NonNegative("mm"))(
    "Scan: standard uncertainty of the distance at which the line passes the sensor, in mm."
)
@option("--base-slip-uncertainty", NonNegative("ratio", high=1.0))(
    "Scan: standard uncertainty of the film's slip on its base: 0 bonded, 1 free."
)
@option("--baseline-curvature-uncertainty", NonNegative("ratio"))(
    "Scan: standard uncertainty of the baseline from edge to centre, over the largest signal."
)
@option("--shear-sensitivity-uncertainty", NonNegative("mm"))(
    "Scan: standard uncertainty of the length by which the sensor responds to shear, in mm."
)
@option("--lubrication", click.Choice(["dry", "lubricated"]))(
    "Scan: what was between indenter and film."
)
@option("--lubricant", "TEXT")("Scan: name of the lubricant.")
@option("--u-sign", _SIGN)(
    "Scan: -1 where the voltage falls when the indenter presses.  [default: 1]"
)
@option("--ceiling", Quantity("unit of u"))(
    "Scan: end of amplifier or converter, in the unit of u, after --u-sign: readings at or above "
    "it are left out."
)
@option("--sensor-name", "TEXT")("Scan: name of the sensor.")
@option("--sensor-model", "TEXT")("Scan: model of the sensor.")
@option("--channel", "TEXT")("Scan: name of the channel.  [default: zz]")
@option("--load-cell", "TEXT")(
    "Scan: name of the load cell or balance; its common error counts once where calibration and "
    "contacts name the same one."
)
@option("--load-cell-serial", "TEXT")("Scan: serial number of the load cell.")
@option("--title", "TEXT")("Scan: title.")
@option("--start-time", _Time())("Scan: when it began, 2026-11-20 or 2026-11-20T09:30:00+01:00.")
@laboratory_option("Scan: ")
@option("--r", "COLUMN")("Reference: column of the radius.")
@option("--r-unit", "UNIT")(
    "Reference: unit of the radius, or of a mesh's coordinates, such as mm."
)
@option("--sigma", "COLUMN|FIELD")(
    "Reference: column of the normal stress at the base; in a mesh the field of it, "
    "or of the stress tensor, and FIELD:2 is its component 2."
)
@option("--sigma-unit", "UNIT")("Reference: unit of the stresses, such as MPa.")
@option("--shear", "COLUMN|FIELD")(
    "Reference: the radial shear stress; in a mesh a stress tensor's own by default."
)
@option("--sign", _SIGN)(
    "Reference: -1 where compression is negative.  [default: 1 for a table, -1 for a mesh]"
)
@option("--shear-sign", _SIGN)(
    "Reference: -1 where the shear is the stress component S13 with axis 3 from the "
    "base to the surface; 1 where it is the base's traction on the film, positive outward."
    "  [default: 1 for a table; for a mesh S13, whichever way its axis points]"
)
@option("--solver", "TEXT")("Reference: the program that calculated it.")
@option("--vertical", click.Choice(["x", "y", "z"]))(
    "Mesh: axis across the film.  [default: the second of a section's two; z in 3-D]"
)
@option("--base", POSITION)(
    "Mesh: position of the base on that axis, in mm.  [default: the lowest]"
)
@option("--centre", (POSITION, POSITION), metavar="MM MM")(
    "Mesh in 3-D: where the indenter's axis meets the base, in mm.  [default: 0 0]"
)
@option("--indenter", click.Choice(["rod", "sphere"]))("Shape of the indenter.  [default: rod]")
@radius_options("the rod or of the sphere's curvature")
@option("--indenter-name", "TEXT")(
    "Scan: name of the indenter; calibrations by the same one share the error of its radius."
)
@film_options()
@option("--film-name", "TEXT")(
    "Scan: name of the film; calibrations through the same one share what is not known of it."
)
@rod_friction_option(FREE_OR_STUCK)
@option("--sheet", "NAME")("Sheet of a workbook.  [default: the first that is visible]")
@option("--scan", click.IntRange(1), metavar="N")(
    "Scan: which one of a file of SPEC or Bluesky: the number after #S, or counted from 1."
)
@option("--skip-rows", click.IntRange(0), metavar="N")(
    "Lines before the header, or the first reading.  [default: found from the table]"
)
@option("--missing", "WORD", multiple=True)(
    "A word, or a number such as -9999, that means a missing value, besides those below."
)
@option("--delimiter", "CHAR")("What separates columns, or TAB; found from the table by default.")
@option("--decimal", click.Choice([".", ","]))("Decimal mark; found from the table by default.")
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
            text = hook("recipe_text")(context)
            out.write_files({save_recipe: text.encode()}, force=force)
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


def stated_options(values: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Return the options that were given, so that the library's own defaults hold."""
    return {name: values[name] for name in names if values[name] is not None}


#: What can be done where a property of the film is not known.
_UNKNOWN = (
    " One that is not known: of a linear film (--film-law linear) any modulus serves; give the "
    "others as guessed, with their uncertainty, or leave the film out, and calibrate with "
    "--reference point."
)


def _set_up(options: Options) -> dict[str, Any]:
    stated: dict[str, Any] = {}
    if stated_options(options, (*FILM_NUMBERS, *LAW, "film_name")):
        stated["film"] = film_from(options, _UNKNOWN)
    if stated_options(options, _INDENTER):
        stated["indenter"] = indenter_from(options["indenter"] or "rod", options)
    return stated


def read_table(path: Path, options: Options) -> ImportedScan:
    """Read a scan with options that are prepared."""
    from memscal.formats.tables.scan import ARRAYS, import_table, records_of
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
    scan = import_table(path, **columns, **records_of(stated))
    return with_laboratory(options["lab"], scan)
