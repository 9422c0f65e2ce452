"""The recipe, recipe.toml: what the options of ``memscal import`` can say, for many tables."""

import json
import re
import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click
import numpy as np

from memscal.cli.import_ import READING, command, prepared, stated_options
from memscal.cli.options import Options, Quantity
from memscal.errors import FormatError, InputError
from memscal.formats.files import read_bytes
from memscal.formats.tables.columns import Wanted
from memscal.formats.tables.sheets import open_table

SECTIONS = {
    "table": "x x_unit y u u_unit u_errors noise u_xz u_yz u_sign ceiling repeat branch sliding "
    "time time_unit speed step averaging_length dwell_time holds depth depth_unit baseline "
    "baseline_curvature_uncertainty line_offset_uncertainty title start_time lab sheet scan "
    "skip_rows missing delimiter decimal",
    "film": "young_modulus young_modulus_uncertainty poisson_ratio poisson_ratio_uncertainty "
    "thickness thickness_uncertainty film_law mooney_rivlin_ratio base_slip_uncertainty film_name",
    "indenter": "indenter indenter_name radius radius_uncertainty rod_friction lubrication "
    "lubricant sliding_friction sliding_friction_uncertainty",
    "load": "load load_column load_unit load_uncertainty load_scatter tangential_load",
    "sensor": "layout sensor_name sensor_model channel name_pattern die_pitch gain_uncertainty "
    "low_pass low_pass_uncertainty resonance resonance_uncertainty quality quality_uncertainty "
    "gain_curvature_uncertainty roundness_uncertainty shear_sensitivity_uncertainty",
    "equipment": "load_cell load_cell_serial position_error position_errors_by_repeat "
    "position_scale_uncertainty",
}
"""Keys of each section: options of ``memscal import``, with underscores."""

#: Where each key stands.
_SECTION_OF = {key: section for section, keys in SECTIONS.items() for key in keys.split()}
_LONGEST = 1 << 20
#: Fields of a pattern of names.
_FIELDS = {
    "row": r"(?P<row>-?\d+)",
    "col": r"(?P<col>-?\d+)",
    "sensor": "(?P<sensor>.+)",
    "any": ".*",
}
#: A field that a column of the table states, such as {row:Die row}.
_IN_COLUMN = re.compile(r"\{(row|col|sensor):([^}]+)\}")


def read_recipe(context: click.Context, path: Path) -> None:
    """Take what a recipe states as defaults of a command's options, once each fits its option."""
    try:
        content = tomllib.loads(read_bytes(path, limit=_LONGEST).decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        problem = f"{path.name} is no TOML: {error}."
        raise FormatError(problem, cure="memscal import --save-recipe writes one.") from error
    options = {option.name: option for option in context.command.params}
    stated = {}
    for section, entries in content.items():
        for key, value in entries.items() if isinstance(entries, dict) else [(section, entries)]:
            try:
                if _SECTION_OF.get(key) != section:
                    (near,) = get_close_matches(key, _SECTION_OF, 1, 0)
                    raise click.BadParameter(f"Did you mean {near} in [{_SECTION_OF[near]}]?")
                stated[key] = _as_typed(options[key], value)
                options[key].type_cast_value(context, stated[key])
            except click.BadParameter as error:
                raise FormatError(
                    f"{path.name}: [{section}] {key} is {value!r}.",
                    why=error.message,
                    cure="A key is an option of memscal import, whose --help says what it states.",
                ) from error
    context.default_map = stated


def _as_typed(option: Any, value: Any) -> Any:
    """Return a value as it is given to an option."""
    several = option.multiple or option.nargs > 1
    items = value if isinstance(value, list) else [value]
    if isinstance(value, bool) != option.is_flag or (items is value and not several):
        raise click.BadParameter("A flag is true or false, another option text or a number.")
    words = [str(item) for item in items]
    return words if several else words[0]


def recipe_text(context: click.Context) -> str:
    """Return the recipe of a command's options, as they were given."""
    words = {**(context.default_map or {}), **context.meta["memscal.words"]}
    numbers = [item.name for item in context.command.params if isinstance(item.type, Quantity)]
    lines = ["# Options of memscal import, in their units (memscal import --help)."]
    for section, keys in SECTIONS.items():
        lines += ["", f"[{section}]"]
        for key in keys.split():
            if key in words:
                value = float(words[key]) if key in numbers else words[key]
                lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    return "\n".join([*lines, ""])


def recipe_of(path: Path) -> tuple[Options, Options]:
    """Return what a recipe states, and the options with which it has tables read."""
    context = command.make_context("import", ["table", "-o", "scan", "--recipe", str(path)])
    words = {f"recipe {key}": value for key, value in (context.default_map or {}).items()}
    options = prepared((), "scan", context.params)
    expression_of(options)
    return words, options


def expression_of(options: Options) -> str:
    """Return the pattern of names as a regular expression; refuse a field that is not known."""
    expression = re.escape(_IN_COLUMN.sub("", options["name_pattern"] or "")) or ".*"
    for field in re.findall(r"\\{(.*?)\\}", expression):
        if field not in _FIELDS:
            (near,) = get_close_matches(field, _FIELDS, 1, 0)
            raise click.UsageError(
                f"--name-pattern has no field {{{field}}}. Did you mean {{{near}}}?"
            )
        expression = expression.replace(rf"\{{{field}\}}", _FIELDS[field])
    return expression


def _in_columns(path: Path, options: Options) -> dict[str, str]:
    """Return what columns of a table state, each by one number in all rows."""
    columns = dict(_IN_COLUMN.findall(options["name_pattern"]))
    if not columns:
        return {}
    table = open_table(path, columns, **stated_options(options, READING))
    stated = {}
    for field, values in table.columns({f: Wanted(c) for f, c in columns.items()}).items():
        numbers = np.unique(values[np.isfinite(values)])
        if numbers.size != 1:
            raise InputError(
                f"{table.where(columns[field])} holds {numbers.size} numbers.",
                why="One table is of one sensor, at one place on the wafer.",
                cure="Name a column with one number in all rows, or take it from the file's name.",
            )
        stated[field] = f"{numbers[0]:g}"
    return stated


def place_in_name(path: Path, options: Options) -> Options:
    """Return sensor, place and its unit that the name of a file states; refuse another name."""
    found = re.fullmatch(expression_of(options), path.stem)
    if found is None:
        raise InputError(
            f"{path.name} is not named as {options['name_pattern']}.",
            why="{row} and {col} are whole numbers, {sensor} is a name, {any} is skipped.",
            cure="Rename it, or give a --name-pattern that the names of all tables have.",
        )
    stated = found.groupdict("") | _in_columns(path, options)
    columns, rows = options["die_pitch"] or (1.0, 1.0)
    return {
        "sensor": stated.get("sensor", path.stem),
        "wafer_x": float(stated.get("col", "nan")) * columns,
        "wafer_y": float(stated.get("row", "nan")) * rows,
        "place_unit": "mm" if options["die_pitch"] else "die",
    }
