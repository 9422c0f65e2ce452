"""Tables of numbers as text, whose delimiter, decimal mark and header are detected."""

import csv
import hashlib
import itertools
import os
import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from memscal.errors import FormatError, InputError, placed
from memscal.formats.files import read_pieces
from memscal.formats.units import to_si
from memscal.model.arrays import FloatArray
from memscal.model.indenter import Profile
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile
from memscal.model.scan import BRANCHES
from memscal.model.sizes import (
    MOST_COLUMNS,
    MOST_HDF5_BYTES,
    MOST_ROWS,
    MOST_TABLE_BYTES,
    too_large,
)

_DELIMITERS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eEdD][+-]?\d+)?")
# A name and its unit: x/mm, x (mm) or x [mm].
_HEAD = re.compile(r"([^/(\[]+?)\s*(?:/(.+)|\((.+)\)|\[(.+)\])")
_MISSING = {"", "nan", "na", "n/a", "null", "none", "-"}
_MAX_NAME, _MAX_COMMENTS, _MAX_COMMENT = 80, 20, 300
#: Lines from which delimiter, decimal mark and header are found; bytes that hold them, and bytes
#: that are then cut into cells at once.
_SAMPLE, _FIRST, _BLOCK = 250, 2**16, 2**22
#: What may stand in a block that needs no care: no quote and no sign of a comment.
_PLAIN = bytes({9, 10, *range(32, 127)} - {*b'"#%'})

Rows = list[tuple[str, ...]]


class Wanted(NamedTuple):
    """A column by its name or number, its unit, and words that stand for numbers in it."""

    column: str | int
    unit: str | None = None
    dimension: str = "dimensionless"
    words: Mapping[str, float] = MappingProxyType({})


class Table:
    """A delimited text file whose head was read; its columns are read once, in blocks.

    ``#`` or ``%`` begin a comment. The first line is the header where a cell of it is no number.
    """

    source: SourceFile
    notes: list[str]

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        delimiter: str | None = None,
        decimal: str | None = None,
    ) -> None:
        self._path, self._name = path, os.path.basename(os.fspath(path))
        self._digest, self._latin, self._width = hashlib.sha256(), False, 0
        self._blocks = self._whole_lines()
        head, lines = b"", list[str]()
        # A head of a few endless lines, or of comments alone, is looked at no further than this.
        while len(lines) < _SAMPLE and len(head) <= _BLOCK and (block := next(self._blocks, b"")):
            head += block
            written = self._lines(head)
            lines = [line for line in written if not _is_comment(line)]
        if not lines:
            cure = "Give a table with one row per reading."
            raise FormatError(f"{self._name} holds no table.", cure=cure)
        self._comments = _head_comments(written)
        self._delimiter = delimiter or _find_delimiter(lines)
        rows = self._rows(lines)
        numbers = _MISSING | {*BRANCHES}
        headed = not all(_NUMBER.fullmatch(cell) or cell.lower() in numbers for cell in rows[0])
        header = rows[0] if headed else tuple(str(i + 1) for i in range(self._width))
        self.names = tuple(printable(cell, _MAX_NAME) for cell in header)
        self._first = rows[1:] if headed else rows
        if not self._first:
            cure = "Give a table with rows."
            raise FormatError(f"{self._name} has a header, but no rows.", cure=cure)
        self.decimal = decimal or _find_decimal(self._first, self._delimiter)
        self._marks = bytes.maketrans(self.decimal.encode()[:1] + b"dD", b".EE")

    def columns(self, wanted: Mapping[str, Wanted]) -> dict[str, FloatArray]:
        """Read columns in SI units, NaN where a cell is empty; state source and notes."""
        for item in wanted.values():  # a wrong unit is refused before the work
            to_si(0.0, item.unit, item.dimension, self.where(item.column))
        room, count = self._room(len(wanted)), 0
        values = [np.empty(room) for _ in wanted]
        for part in self._parts([*wanted.values()]):
            if count + part[0].size > room:
                cure = "Import it when it is complete."
                raise FormatError(f"{self._name} grew while it was read.", cure=cure)
            for column, numbers in zip(values, part, strict=True):
                column[count : count + numbers.size] = numbers
            count += part[0].size
        self.source = SourceFile(self._name, self._digest.hexdigest())
        mark = "comma" if self.decimal == "," else "point"
        apart = f"separated by a {_DELIMITERS.get(self._delimiter, repr(self._delimiter))}"
        self.notes = [
            f"Imported from {self._name} (sha256 {self.source.sha256}).",
            *["The table is not UTF-8; it was read as Latin-1."] * self._latin,
            *self._comments,
            f"Read {count} rows of {self._width} columns {apart}, with a decimal {mark}.",
        ]
        return {
            name: to_si(values.pop(0)[:count], item.unit, item.dimension, self.where(item.column))
            for name, item in wanted.items()
        }

    def unit_of(self, column_name: str | int, unit: str | None, option: str) -> str:
        """Return the unit of a column: the one given, or that of its head."""
        head = _HEAD.fullmatch(self.names[self._index(column_name)])
        if stated := unit or (head and next(filter(None, head.groups()[1:]))):
            return stated.strip()
        cure = f"Give it in the head of the column, as in 'x/mm', or as {option}."
        raise InputError(f"{self.where(column_name)} states no unit.", cure=cure)

    def where(self, column_name: str | int) -> str:
        """Return file and column as messages name them."""
        return f"{self._name}: column {column_name!r}"

    def _index(self, column_name: str | int) -> int:
        if isinstance(column_name, str) and column_name in self.names:
            if self.names.count(column_name) > 1:
                problem = f"{self._name} has several columns named {column_name!r}."
                raise InputError(problem, cure="Give the number of the column, counted from 1.")
            return self.names.index(column_name)
        heads = [match and match[1] for match in map(_HEAD.fullmatch, self.names)]
        if heads.count(str(column_name)) == 1:
            return heads.index(str(column_name))
        number = int(column_name) if isinstance(column_name, int) or column_name.isdecimal() else 0
        if not 1 <= number <= len(self.names):
            raise InputError(
                f"{self._name} has no column {column_name!r}.",
                why="Its columns are: " + ", ".join(self.names) + ".",
                cure="Give one of these names, or a number counted from 1.",
            )
        return number - 1

    def _room(self, columns: int) -> int:
        """Return for how many rows there must be room; refuse a table of too many."""
        # A scan has up to three arrays more than columns, and its file must be read again.
        most = min(MOST_ROWS, MOST_HDF5_BYTES // (8 * (columns + 3)))
        pieces = read_pieces(self._path, limit=MOST_TABLE_BYTES)
        lines = sum(piece.count(b"\n") or piece.count(b"\r") for piece in pieces)
        if lines > most:
            cure = "Average neighbouring readings, or cut the table into several."
            raise too_large(self._name, lines, most, f"lines of {columns} columns", cure=cure)
        return 2 * lines + _SAMPLE  # some may have other ends; room that stays empty is no memory

    def _whole_lines(self) -> Iterator[bytes]:
        """Yield a few lines, then blocks of whole lines."""
        rest, size = b"", _FIRST
        for piece in read_pieces(self._path, limit=MOST_TABLE_BYTES):
            self._digest.update(piece)
            rest += piece
            while len(rest) > size:
                if end := rest.rfind(b"\n", 0, size) + 1 or rest.rfind(b"\r", 0, size) + 1:
                    yield rest[:end]
                    rest = rest[end:]
                elif size == _BLOCK:
                    raise too_large("A line", len(rest), _BLOCK, "bytes", cure="Give a table.")
                size = _BLOCK
        if rest:
            yield rest

    def _parts(self, wanted: list[Wanted]) -> Iterator[list[FloatArray]]:
        """Yield the columns of one block after another."""
        indices = [self._index(item.column) for item in wanted]
        yield self._numbers(self._first, indices, wanted, 0)
        count = len(self._first)
        for block in self._blocks:
            if (numbers := self._plain_numbers(block, indices)) is None:
                rows = self._rows([s for s in self._lines(block) if not _is_comment(s)])
                numbers = self._numbers(rows, indices, wanted, count)
            yield numbers
            count += numbers[0].size

    def _plain_numbers(self, block: bytes, indices: list[int]) -> list[FloatArray] | None:
        """Return columns of a block of bare numbers in rows of one width; of others, nothing."""
        block = block.replace(b"\r\n", b"\n")
        if self._delimiter not in _DELIMITERS or block.translate(None, _PLAIN):
            return None
        block = block.rstrip(b"\n").translate(self._marks) + b"\n"
        if self._delimiter == " ":
            while b"  " in block:
                block = block.replace(b"  ", b" ")
            block = block.replace(b" \n", b"\n").replace(b"\n ", b"\n").lstrip(b" ")
        delimiter = self._delimiter.encode()
        width, count = block.count(delimiter, 0, block.find(b"\n")) + 1, block.count(b"\n")
        # The ends of the cells, as they follow each other in equal rows.
        ends = block.translate(None, _PLAIN.translate(None, delimiter + b"\n"))
        if max(indices) >= width or ends != (delimiter * (width - 1) + b"\n") * count:
            return None
        cells = block[:-1].replace(b"\n", delimiter).split(delimiter)
        if b"" in cells:
            if width == 1 or delimiter == b"\t":  # of a blank line, perhaps
                return None
            cells = [cell or b"nan" for cell in cells]
        self._width = max(self._width, width)
        try:
            return [np.fromiter(map(float, cells[i::width]), np.float64, count) for i in indices]
        except ValueError:
            return None

    def _lines(self, block: bytes) -> list[str]:
        """Return the lines that are not blank."""
        if b"\0" in block:
            raise FormatError(f"{self._name} is not a text file.", cure="Give a table as CSV.")
        try:
            text = block.decode("latin-1" if self._latin else "utf-8-sig")
        except UnicodeDecodeError:
            self._latin, text = True, block.decode("latin-1")
        return [line for line in text.splitlines() if line.strip()]

    def _rows(self, lines: list[str]) -> Rows:
        rows = [line.split() for line in lines] if self._delimiter == " " else []
        try:
            rows = rows or [*csv.reader(lines, delimiter=self._delimiter, skipinitialspace=True)]
        except (csv.Error, TypeError) as error:
            raise FormatError(f"{self._name} cannot be cut into columns: {error}.") from error
        self._width = max(self._width, *map(len, rows), 0)
        if self._width > MOST_COLUMNS:
            cure = "Leave out columns."
            raise too_large(self._name, self._width, MOST_COLUMNS, "columns", cure=cure)
        return [tuple(map(str.strip, row)) for row in rows]

    def _numbers(
        self, rows: Rows, indices: list[int], wanted: list[Wanted], start: int
    ) -> list[FloatArray]:
        """Return columns of rows, before which ``start`` rows stand."""
        columns = []
        for i, item in zip(indices, wanted, strict=True):
            cells = [row[i] if i < len(row) else "" for row in rows]
            try:
                numbers = [*map(float, cells)]
            except ValueError:
                numbers = [self._number(cell, start + k, item) for k, cell in enumerate(cells)]
            columns.append(np.array(numbers, dtype=np.float64))
        return columns

    def _number(self, cell: str, k: int, item: Wanted) -> float:
        if cell.lower() in item.words:
            return item.words[cell.lower()]
        if cell.lower() in _MISSING:
            return float("nan")
        text = cell.replace(self.decimal, ".") if self.decimal != "." else cell
        try:
            return float(text.replace("D", "E").replace("d", "e"))
        except ValueError as error:
            raise FormatError(
                f"{self.where(item.column)}, data row {k + 1}: {printable(cell, _MAX_NAME)!r} "
                f"is not {' or '.join(['a number', *item.words])}.",
                cure="Correct or remove this row, or state the decimal mark.",
            ) from error


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


def _find_decimal(rows: Rows, delimiter: str) -> str:
    """A comma is the decimal mark only where cells hold one comma each and no point."""
    if delimiter == ",":
        return "."
    cells = [c for row in rows[:200] for c in row if _NUMBER.fullmatch(c)]
    return "," if any("," in c for c in cells) and not any("." in c for c in cells) else "."


def read_indenter_table(path: str | os.PathLike[str], *, r_unit: str, z_unit: str) -> Profile:
    """Read an indenter's profile from a table with one row per radius: radius and height."""
    table = Table(path)
    units = {1: r_unit, 2: z_unit}
    columns = table.columns({str(i): Wanted(i, unit, "length") for i, unit in units.items()})
    with placed(table.source.file_name):
        # What a microscope calls zero is anywhere.
        return Profile(r=columns["1"], z=columns["2"] - columns["2"].min())
