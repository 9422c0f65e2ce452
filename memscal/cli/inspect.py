"""``memscal inspect``: contents of a file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from memscal.cli.failures import debug_option
from memscal.cli.options import FILE, accept_altered_option, json_option
from memscal.cli.output import emit_json, emit_tables
from memscal.model.notation import format_measured
from memscal.summaries.table import Table, stated_text

Item = Mapping[str, Any]
"""An object of JSON, as the description of a file has it."""

EXAMPLES = """\b
Examples:
  memscal inspect scan.apparatus.h5
  memscal inspect scan.h5 --json
"""


@click.command("inspect", epilog=EXAMPLES)
@click.argument("file", type=FILE)
@accept_altered_option
@json_option
@debug_option
def command(file: Path, accept_altered: bool, as_json: bool) -> None:
    """Show what a scan, a reference, an artifact or a file of measured stress holds.

    Quantities with their standard uncertainties, arrays with shape and range, quality checks, and
    the origin of the data. Lengths are shown in mm and moduli in MPa; with --json, numbers are
    in the units of the file.
    """
    from memscal.formats.inspection import describe

    contents = describe(file, accept_altered=accept_altered)
    if as_json:
        emit_json(contents)
    else:
        emit_tables(*_tables(contents))


def _tables(contents: Item) -> Iterator[Table]:
    rows = [("schema", f"{contents['schema']} {contents['schema_version']}")]
    named = [name for name in ("title", "sha256", "altered") if contents.get(name)]
    rows += [(name, contents[name]) for name in named]
    yield Table(contents["file"], ("", ""), rows)

    layout = contents.get("layout", {})
    places = [(name, *map(_number, place)) for name, place in layout.items()]
    yield Table(f"Layout of {len(places)} sensors", ("sensor", "x (mm)", "y (mm)"), places)
    quantities = [(_words(item), _value(item), item["path"]) for item in contents["quantities"]]
    title = "Quantities (± standard uncertainty, k = 1)"
    yield Table(title, ("quantity", "value", "path"), quantities)
    yield _arrays(contents["arrays"])
    checks = contents["checks"]
    failed = {i: check for i, check in enumerate(checks) if not check["passed"]}
    head = ("check", "value", "limit", "result")
    shown = []
    for check in checks:
        value = _number(check["value"], ".3g")
        limit = _number(check["limit"], ".3g")
        shown.append((_words(check), value, limit, "passed" if check["passed"] else "FAILED"))
    yield Table("Quality checks", head, shown, frozenset(failed))
    meanings = [(_words(check), check["meaning"]) for check in failed.values()]
    yield Table("What the failures mean", ("", ""), meanings)
    yield from _provenance(contents["provenance"])


def _arrays(arrays: Sequence[Item]) -> Table:
    """Return paths, shapes, ranges and units; the number of missing values where there are any."""
    head = ["path", "shape", "from", "to", "unit"]
    missing = any(item["missing"] for item in arrays)
    if missing:
        head.append("missing")
    rows = []
    for item in arrays:
        shape = " x ".join(map(str, item["shape"])) or "one"
        low = _number(item["minimum"])
        row = [item["path"], shape, low, _number(item["maximum"]), item["unit"]]
        if missing:
            row.append(str(item["missing"] or "-"))
        rows.append(row)
    return Table("Arrays", head, rows)


def _words(item: Item) -> str:
    return str(item["name"]).replace("_", " ")


def _value(item: Item) -> str:
    value = item["value"]
    if value is None:
        return "not a number"
    if isinstance(value, str):
        return value
    factor, unit = _unit_to_show(item)
    value *= factor
    spread = item["standard_uncertainty"]
    if spread is None:
        return f"{value:.6g}" + ("" if unit == "1" else f" {unit}")
    return format_measured(value, spread * factor, unit)


def _unit_to_show(item: Item) -> tuple[float, str]:
    """Return the unit in which the command line asks for such a quantity, and the factor to it."""
    from memscal.formats.units import dimension_of, to_si

    unit = item["unit"]
    path = item["path"]
    dimension = dimension_of(unit, path)
    if dimension == "length":
        return float(to_si(1e3, unit, dimension, path)), "mm"
    if dimension == "stress" and item["name"].endswith("modulus"):
        return float(to_si(1e-6, unit, dimension, path)), "MPa"
    return 1.0, unit


def _number(value: float | None, form: str = ".5g") -> str:
    return "-" if value is None else f"{value:{form}}"


def _provenance(provenance: Item) -> Iterator[Table]:
    """Yield a table of what stands alone, then one for each group of options or versions."""
    rows = []
    groups = []
    for name, value in provenance.items():
        words = name.replace("_", " ")
        if isinstance(value, Mapping):
            held = [(key.replace("_", " "), stated_text(item)) for key, item in value.items()]
            groups.append(Table(words.capitalize(), ("", ""), held))
        else:
            lines = value if isinstance(value, list) else str(value).splitlines()
            rows += [(words, line) for line in lines if line]
    yield Table("Provenance", ("", ""), rows)
    yield from groups
