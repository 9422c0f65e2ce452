"""``memscal import``: a table of numbers to a scan or a reference, or a mesh to a reference."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from memscal.cli import import_reference
from memscal.cli.failures import DONE, debug_option
from memscal.cli.import_reference import reference_options
from memscal.cli.options import (
    FILE,
    Quantity,
    film_from,
    film_options,
    force_option,
    indenter_from,
    json_option,
    radius_options,
    si,
)
from memscal.cli.output import emit, emit_json, message, readable, show_messages
from memscal.cli.targets import prove_writable
from memscal.model.checks import marked_texts

if TYPE_CHECKING:
    from memscal.formats.reference_profile import ImportedProfile
    from memscal.formats.table import ImportedScan

__all__ = ["command"]


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
  memscal import fem.csv -o rod.h5 --format reference --r r --r-unit mm
      --sigma S33 --sigma-unit MPa --sign -1 --load 1
  memscal import fem.vtu -o rod.h5 --format reference --r-unit mm
      --sigma S --sigma-unit MPa --load 1

\b
Columns are given by their names in the header, or by their numbers counted from 1.
Meshes (.vtu, .vtk, .xdmf) need the extra fem-io: pip install "memscal[fem-io]".
"""

_SCAN_NAMES = [
    *("x", "x_unit", "u", "u_unit", "u_scale", "u_sign", "y", "repeat", "u_xz", "u_yz"),
    *("load_column", "load_unit", "load_uncertainty", "title"),
    *("lubrication", "lubricant"),
]
_SENSOR_NAMES = {"name": "sensor_name", "model": "sensor_model", "channel": "channel"}
_SIGNS = ("u_sign", "sign", "shear_sign")
_TABLE_NAMES = ["load", "delimiter", "decimal"]

_ONLY = {
    "scan": [*_SCAN_NAMES, "load_scatter", "position_error", *_SENSOR_NAMES.values()],
    "reference": import_reference.NAMES,
}
_NEEDED = ("x", "x_unit", "u", "u_unit")


@click.command("import", epilog=EXAMPLES)
@click.argument("table", type=FILE)
@click.option(
    "-o", "--output", type=FILE, required=True, metavar="OUT", help="Scan or reference to write."
)
@click.option(
    "--format",
    "kind",
    type=click.Choice(["scan", "reference"]),
    default="scan",
    show_default=True,
    help="What it holds: measured points, or the base stress of a FEM calculation.",
)
@click.option("--x", metavar="COLUMN", help="Scan: column of the position.")
@click.option("--x-unit", metavar="UNIT", help="Scan: unit of the positions, such as mm.")
@click.option("--u", metavar="COLUMN", help="Scan: column of the normal channel's voltage.")
@click.option("--u-unit", metavar="UNIT", help="Scan: unit of the voltages, such as mV.")
@click.option(
    "--y", metavar="COLUMN", help="Scan: column of the second position, of points in a plane."
)
@click.option(
    "--repeat",
    metavar="COLUMN",
    multiple=True,
    help="Scan: column that numbers the repeats. Repeated: each combination of the columns is a "
    "line, such as of the load that was set and of the pass.",
)
@click.option("--u-xz", metavar="COLUMN", help="Scan: column of the channel xz.")
@click.option("--u-yz", metavar="COLUMN", help="Scan: column of the channel yz.")
@click.option("--load", type=Quantity("N"), help="Normal load, in N.")
@click.option("--load-column", metavar="COLUMN", help="Scan: column of the load at each point.")
@click.option(
    "--load-unit", metavar="UNIT", help="Scan: unit of the column of loads.  [default: N]"
)
@click.option(
    "--load-uncertainty",
    type=Quantity("N", open_low=False),
    help="Scan: standard uncertainty of the load common to all points, in N.",
)
@click.option(
    "--load-scatter",
    type=Quantity("percent", open_low=False),
    help="Scan: standard uncertainty of each point's own load, independent from point to point, "
    "in percent: a weight set down by hand.",
)
@click.option(
    "--position-error",
    type=Quantity("um", open_low=False),
    help="Scan: standard uncertainty of each position, independent from point to point, in um.",
)
@click.option(
    "--lubrication",
    type=click.Choice(["dry", "lubricated"]),
    help="Scan: what was between indenter and film.",
)
@click.option("--lubricant", metavar="TEXT", help="Scan: name of the lubricant.")
@click.option(
    "--u-scale",
    type=float,
    metavar="V",
    help="Scan: volts per unit of the readings, for a sensor whose output is not a voltage.",
)
@click.option(
    "--u-sign",
    type=click.Choice(["1", "-1"]),
    help="Scan: -1 where the voltage falls when the indenter presses.  [default: 1]",
)
@click.option("--sensor-name", metavar="TEXT", help="Scan: name of the sensor.")
@click.option("--sensor-model", metavar="TEXT", help="Scan: model of the sensor.")
@click.option("--channel", metavar="TEXT", help="Scan: name of the channel.  [default: zz]")
@click.option("--title", metavar="TEXT", help="Scan: title.")
@reference_options
@click.option(
    "--indenter",
    type=click.Choice(["rod", "sphere"]),
    default="rod",
    show_default=True,
    help="Shape of the indenter.",
)
@radius_options()
@film_options()
@click.option(
    "--delimiter", metavar="CHAR", help="What separates columns; found from the table by default."
)
@click.option(
    "--decimal",
    type=click.Choice([".", ","]),
    help="Decimal mark; found from the table by default.",
)
@json_option
@force_option
@debug_option
def command(table: Path, output: Path, kind: str, as_json: bool, force: bool, **given: Any) -> int:
    """Convert a TABLE (CSV) to a scan or to a reference, or a mesh (VTU, VTK, XDMF) to a reference.

    A table says neither its units nor what was pressed on what: the options do. Readings are kept
    as they are. How many readings, repeats and places were read, and what is missing, is printed,
    and kept in the notes of the file.
    """
    given["repeat"] = given["repeat"] or None
    _check_usage(table, kind, given)
    given |= {name: int(given[name]) for name in _SIGNS if given[name] is not None}
    prove_writable([output], force=force, inputs=[table])
    found = _scan(table, given) if kind == "scan" else import_reference.read(table, given)
    _write(found, output, force)
    warnings = [note for note in found.notes if note.severity == "warning"]
    if as_json:
        emit_json(
            {
                "schema_version": "1",
                "output": str(output),
                "format": kind,
                "notes": marked_texts(found.notes),
            }
        )
    else:
        emit(readable("\n".join(note.text for note in found.notes if note not in warnings)))
    show_messages(warnings)
    message(f"Written: {output}")
    return DONE


def _check_usage(path: Path, kind: str, given: dict[str, Any]) -> None:
    """Name every option that is missing, or that belongs to something else, at once."""
    if kind == "scan" and import_reference.is_mesh(path):
        raise click.UsageError(f"{path.name} is a mesh, and no scan: add --format reference.")
    names = _NEEDED if kind == "scan" else import_reference.needed(path)
    missing = [name for name in names if given[name] is None]
    if missing:
        raise click.UsageError(
            f"A {kind} needs more: add {_named(missing)}. See the examples of "
            "`memscal import --help`."
        )
    if kind == "scan" and given["load"] is None and given["load_column"] is None:
        raise click.UsageError("The load is not given: add --load (in N) or --load-column.")
    other = "reference" if kind == "scan" else "scan"
    strange = [name for name in _ONLY[other] if given[name] is not None]
    if strange:
        raise click.UsageError(f"{_named(strange)} belong to --format {other}.")
    if kind == "reference":
        what, unused = import_reference.strange(path, given)
        if unused:
            raise click.UsageError(f"A {what} has no use for {_named(unused)}.")


def _named(names: Sequence[str]) -> str:
    return ", ".join("--" + name.replace("_", "-") for name in names)


def _given(values: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return the options that were given, so that the library's own defaults hold."""
    return {name: values[name] for name in names if values[name] is not None}


def _scan(path: Path, given: dict[str, Any]) -> ImportedScan:
    film, indenter = film_from(given), indenter_from(given["indenter"], given)
    from memscal.formats.table import read_scan_table
    from memscal.model.scan import StressSensor

    labels = {key: given[name] for key, name in _SENSOR_NAMES.items() if given[name] is not None}
    return read_scan_table(
        path,
        **_given(given, [*_SCAN_NAMES, *_TABLE_NAMES]),
        load_scatter=si(given["load_scatter"], -2),
        x_error=si(given["position_error"], -6),
        film=film,
        indenter=indenter,
        sensor=StressSensor(**labels),
    )


def _write(found: ImportedScan | ImportedProfile, output: Path, force: bool) -> None:
    from memscal.formats.table import ImportedScan

    if isinstance(found, ImportedScan):
        from memscal.formats.scan import write_scan

        write_scan(found.scan, output, overwrite=force)
    else:
        from memscal.formats.reference import write_reference

        write_reference(found.profile, output, overwrite=force)
