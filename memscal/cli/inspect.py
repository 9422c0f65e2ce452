"""``memscal inspect``: contents of a file."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from memscal.cli.failures import DONE, debug_option
from memscal.cli.options import FILE, accept_altered_option, json_option
from memscal.cli.output import emit_json, emit_tables
from memscal.model.notation import format_measured
from memscal.summaries.table import Table, stated_text

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
def command(file: Path, accept_altered: bool, as_json: bool) -> int:
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
    return DONE


def _tables(contents: Mapping[str, Any]) -> Iterator[Table]:
    rows = [
        ("schema", f"{contents['schema']} {contents['schema_version']}"),
        ("title", contents["title"]),
        ("sha256", contents["sha256"]),
        ("altered", contents.get("altered", "")),
    ]
    yield Table(str(contents["file"]), ("", ""), [row for row in rows if row[1]])

    quantities = [
        (item["name"].replace("_", " "), _value(item), item["path"])
        for item in contents["quantities"]
    ]
    yield Table(
        "Quantities (± standard uncertainty, k = 1)", ("quantity", "value", "path"), quantities
    )
    arrays = []
    for item in contents["arrays"]:
        shape = " x ".join(str(n) for n in item["shape"]) or "one"
        low, high = (_number(item[name], ".5g") for name in ("minimum", "maximum"))
        arrays.append((item["path"], shape, low, high, item["unit"], str(item["missing"] or "-")))
    head = ("path", "shape", "from", "to", "unit", "missing")
    shown = len(head) - all(row[-1] == "-" for row in arrays)
    yield Table("Arrays", head[:shown], [row[:shown] for row in arrays])
    checks = []
    failed = set()
    meanings = []
    for i, check in enumerate(contents["checks"]):
        name = check["name"].replace("_", " ")
        numbers = (check["value"], check["limit"])
        result = "passed" if check["passed"] else "FAILED"
        checks.append((name, *(_number(number, ".3g") for number in numbers), result))
        if not check["passed"]:
            failed.add(i)
            meanings.append((name, check["meaning"]))
    columns = ("check", "value", "limit", "result")
    yield Table("Quality checks", columns, checks, frozenset(failed))
    yield Table("What the failures mean", ("", ""), meanings)
    yield from _provenance(contents["provenance"])


def _value(item: Mapping[str, Any]) -> str:
    if item["value"] is None:
        return "not a number"
    if isinstance(item["value"], str):
        return item["value"]
    factor, unit = _unit_to_show(item)
    spread = item["standard_uncertainty"]
    if spread is None:
        return f"{item['value'] * factor:.6g}" + ("" if unit == "1" else f" {unit}")
    return format_measured(item["value"] * factor, spread * factor, unit)


def _unit_to_show(item: Mapping[str, Any]) -> tuple[float, str]:
    """Return the unit in which the command line asks for such a quantity, and the factor to it."""
    from memscal.formats.units import dimension_of, to_si

    unit = str(item["unit"])
    dimension = dimension_of(unit, str(item["path"]))
    if dimension == "length":
        return float(to_si(1e3, unit, dimension, str(item["path"]))), "mm"
    if dimension == "stress" and str(item["name"]).endswith("modulus"):
        return float(to_si(1e-6, unit, dimension, str(item["path"]))), "MPa"
    return 1.0, unit


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def _provenance(provenance: Mapping[str, Any]) -> Iterator[Table]:
    """Yield a table of what stands alone, then one for each group of options or versions."""
    rows = []
    groups = []
    for name, value in provenance.items():
        words = name.replace("_", " ")
        if isinstance(value, Mapping):
            held = [(key.replace("_", " "), stated_text(item)) for key, item in value.items()]
            groups.append(Table(words.capitalize(), ("", ""), held))
        elif isinstance(value, list):
            rows += [(words, str(item)) for item in value]
        else:
            rows += [(words, line) for line in str(value).splitlines() if line]
    yield from (Table("Provenance", ("", ""), rows), *groups)
