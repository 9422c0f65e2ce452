"""Tables of numbers as text, whose delimiter, decimal mark and header are detected."""

import csv
import hashlib
import itertools
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.errors import FormatError, InputError, placed
from memscal.formats.files import read_bytes
from memscal.formats.units import to_si
from memscal.model.arrays import FloatArray
from memscal.model.indenter import Profile
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile
from memscal.model.scan import BRANCHES

_MAX_COLUMNS = 1000
_DELIMITERS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eEdD][+-]?\d+)?")
# A name and its unit: x/mm, x (mm) or x [mm].
_HEAD = re.compile(r"([^/(\[]+?)\s*(?:/(.+)|\((.+)\)|\[(.+)\])")
_MISSING = {"", "nan", "na", "n/a", "null", "none", "-"}
_MAX_NAME, _MAX_COMMENTS, _MAX_COMMENT = 80, 20, 300


@dataclass(frozen=True, eq=False)
class Table:
    """A table as it stands in a file: the cells of its columns, by name and by number."""

    source: SourceFile
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    decimal: str
    notes: tuple[str, ...]

    def column(
        self, column_name: str | int, words: Mapping[str, float] | None = None
    ) -> FloatArray:
        """Return a column as numbers, NaN where a cell is empty; words stand for their numbers."""
        i = self._index(column_name)
        values = np.empty(len(self.rows))
        for k, row in enumerate(self.rows):
            values[k] = self._number(row[i] if i < len(row) else "", k, column_name, words or {})
        return values

    def quantity(self, column_name: str | int, unit: str, dimension: str) -> FloatArray:
        """Return a column of numbers in a unit, in SI units."""
        return to_si(self.column(column_name), unit, dimension, self.where(column_name))

    def unit_of(self, column_name: str | int, unit: str | None, option: str) -> str:
        """Return the unit of a column: the one given, or that of its head."""
        head = _HEAD.fullmatch(self.names[self._index(column_name)])
        if stated := unit or (head and next(filter(None, head.groups()[1:]))):
            return stated.strip()
        cure = f"Give it in the head of the column, as in 'x/mm', or as {option}."
        raise InputError(f"{self.where(column_name)} states no unit.", cure=cure)

    def where(self, column_name: str | int) -> str:
        """Return file and column as messages name them."""
        return f"{self.source.file_name}: column {column_name!r}"

    def _index(self, column_name: str | int) -> int:
        if isinstance(column_name, str) and column_name in self.names:
            if self.names.count(column_name) > 1:
                problem = f"{self.source.file_name} has several columns named {column_name!r}."
                raise InputError(problem, cure="Give the number of the column, counted from 1.")
            return self.names.index(column_name)
        heads = [match and match[1] for match in map(_HEAD.fullmatch, self.names)]
        if heads.count(str(column_name)) == 1:
            return heads.index(str(column_name))
        number = int(column_name) if isinstance(column_name, int) or column_name.isdecimal() else 0
        if not 1 <= number <= len(self.names):
            raise InputError(
                f"{self.source.file_name} has no column {column_name!r}.",
                why="Its columns are: " + ", ".join(self.names) + ".",
                cure="Give one of these names, or a number counted from 1.",
            )
        return number - 1

    def _number(
        self, cell: str, k: int, column_name: str | int, words: Mapping[str, float]
    ) -> float:
        if cell.lower() in words:
            return words[cell.lower()]
        if cell.lower() in _MISSING:
            return float("nan")
        text = cell.replace(self.decimal, ".") if self.decimal != "." else cell
        try:
            return float(text.replace("D", "E").replace("d", "e"))
        except ValueError as error:
            raise FormatError(
                f"{self.where(column_name)}, data row {k + 1}: "
                f"{printable(cell, _MAX_NAME)!r} is not {' or '.join(['a number', *words])}.",
                cure="Correct or remove this row, or state the decimal mark.",
            ) from error


def read_table(
    path: str | os.PathLike[str], *, delimiter: str | None = None, decimal: str | None = None
) -> Table:
    """Read a delimited text file; ``#`` or ``%`` begin a comment."""
    # The first line is the header where one of its cells is no number.
    data = read_bytes(path)
    name = os.path.basename(os.fspath(path))
    source = SourceFile(name, hashlib.sha256(data).hexdigest())
    notes = [f"Imported from {name} (sha256 {source.sha256})."]
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
        notes.append("The table is not UTF-8; it was read as Latin-1.")
    if "\0" in text:
        raise FormatError(f"{name} is not a text file.", cure="Give a table as CSV.")
    written = [line for line in text.splitlines() if line.strip()]
    lines = [line for line in written if not _is_comment(line)]
    if not lines:
        raise FormatError(f"{name} holds no table.", cure="Give a table with one row per reading.")
    notes += _head_comments(written)
    delimiter = delimiter or _find_delimiter(lines)
    rows = _split(name, lines, delimiter)
    headed = not all(_NUMBER.fullmatch(c) or c.lower() in _MISSING | {*BRANCHES} for c in rows[0])
    width = max(len(row) for row in rows)
    header = rows[0] if headed else tuple(str(i + 1) for i in range(width))
    body = tuple(rows[1:] if headed else rows)
    if not body:
        raise FormatError(f"{name} has a header, but no rows.", cure="Give a table with rows.")
    decimal = decimal or _find_decimal(body, delimiter)
    mark = "comma" if decimal == "," else "point"
    notes.append(
        f"Read {len(body)} rows of {width} columns separated by a "
        f"{_DELIMITERS.get(delimiter, repr(delimiter))}, with a decimal {mark}."
    )
    names = tuple(printable(cell, _MAX_NAME) for cell in header)
    return Table(source, names, rows=body, decimal=decimal, notes=tuple(notes))


def _is_comment(line: str) -> bool:
    return line.lstrip()[0] in "#%"


def _head_comments(lines: list[str]) -> list[str]:
    """Return what is written above the table: it may say that the data are synthetic."""
    head = itertools.takewhile(_is_comment, lines)
    shown = [printable(line.lstrip(" \t#%"), _MAX_COMMENT).strip() for line in head]
    notes = [f"The table says: {line}" for line in shown[:_MAX_COMMENTS] if line]
    if len(shown) > _MAX_COMMENTS:
        notes.append(f"{len(shown) - _MAX_COMMENTS} more lines of comment were left out.")
    return notes


def _find_delimiter(lines: list[str]) -> str:
    """Take the delimiter that cuts the most lines into equally many pieces."""
    sample = lines[:50]
    best, score = " ", 0.0
    for delimiter in _DELIMITERS:
        widths = [len(line.split(None if delimiter == " " else delimiter)) for line in sample]
        common = max(set(widths), key=widths.count)
        if common > 1 and widths.count(common) > score:
            best, score = delimiter, widths.count(common)
    return best


def _split(name: str, lines: list[str], delimiter: str) -> list[tuple[str, ...]]:
    rows = [line.split() for line in lines]
    if delimiter != " ":
        try:
            rows = list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))
        except (csv.Error, TypeError) as error:
            raise FormatError(f"{name} cannot be cut into columns: {error}.") from error
    cut = [tuple(cell.strip() for cell in row) for row in rows]
    if max(len(row) for row in cut) > _MAX_COLUMNS:
        raise FormatError(f"{name} has more than {_MAX_COLUMNS} columns.")
    return cut


def _find_decimal(rows: tuple[tuple[str, ...], ...], delimiter: str) -> str:
    """A comma is the decimal mark only where cells hold one comma each and no point."""
    if delimiter == ",":
        return "."
    cells = [c for row in rows[:200] for c in row if _NUMBER.fullmatch(c)]
    return "," if any("," in c for c in cells) and not any("." in c for c in cells) else "."


def read_indenter_table(path: str | os.PathLike[str], *, r_unit: str, z_unit: str) -> Profile:
    """Read an indenter's profile from a table with one row per radius: radius and height."""
    table = read_table(path)
    radii, heights = table.quantity(1, r_unit, "length"), table.quantity(2, z_unit, "length")
    with placed(table.source.file_name):
        # What a microscope calls zero is anywhere.
        return Profile(r=radii, z=heights - heights.min())
