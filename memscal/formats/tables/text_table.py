"""Tables of numbers: columns by name or number, and text whose dialect and head are found."""

import codecs
import csv
import hashlib
import os
import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import suppress
from itertools import zip_longest
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from memscal.errors import FormatError, InputError, placed
from memscal.formats.files import read_pieces
from memscal.formats.units import is_common_unit, is_unit, same_unit, to_si
from memscal.model.arrays import FloatArray
from memscal.model.indenter import Profile
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile
from memscal.model.sizes import (
    MOST_COLUMNS,
    MOST_HDF5_BYTES,
    MOST_ROWS,
    MOST_TABLE_BYTES,
    too_large,
)
from memscal.progress import counted

_DELIMITERS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eEdD][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_SHEET_ERROR = re.compile(r"#(?:N/A|(?:DIV/0|REF|NUM|VALUE|NULL)!|NAME\?)", re.IGNORECASE)
#: A number with a separator of thousands, such as -4.000,0.
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[.,' ][0-9]{3})+(?:[.,][0-9]+)?")
#: A name and its unit: x (mm) or x [mm], and x/mm.
_HEADS = (re.compile(r"(.+?)[\s/]*[(\[]([^()\[\]]+)[)\]]"), re.compile(r"([^/]+?)\s*/(.+)"))
#: Cells that mean a missing value, in capital or small letters.
MISSING = ("", "-", "nan", "na", "n/a", "#n/a", "<na>", "nat", "null", "none")
_MAX_NAME = 80
_MAX_COMMENTS = 20
_MAX_COMMENT = 300
_NAMED = 5
#: Lines from which delimiter, decimal mark and header are found; bytes that hold them, and bytes
#: that are then cut into cells at once.
_SAMPLE = 250
_FIRST = 2**16
_BLOCK = 2**22
#: Rows that tell which columns hold numbers: the last ones, for a preamble stands above them.
_LAST = 50
#: What may stand in a block that needs no care: no quote and no sign of a comment.
_PLAIN = bytes({9, 10, *range(32, 127)} - {*b'"#%'})

Rows = list[tuple[str, ...]]
Numbered = list[tuple[int, str]]
Lines = range | list[int] | NDArray[np.int32]


class Wanted(NamedTuple):
    """A column by its name or number, its unit, and words that stand for numbers in it."""

    column: str | int
    unit: str | None = None
    dimension: str = "dimensionless"
    words: Mapping[str, float] = MappingProxyType({})


class NamedColumns:
    """Columns of numbers whose heads may state units; they are read once, part by part."""

    names: tuple[str, ...] = ()
    source: SourceFile | None = None
    notes: tuple[str, ...] = ()
    decimal: str | None = None
    #: What a row is called in messages.
    _row = "row"

    def __init__(self, name: str, missing: Sequence[str] = ()) -> None:
        self._name = name
        self._unit_row = tuple[str, ...]()
        self._missing = {*MISSING, *(word.strip().lower() for word in missing)}
        self._sentinels = [_float(w.replace(",", ".")) for w in missing if _NUMBER.fullmatch(w)]
        # Cells that are no numbers, by column: how many, and the first of them with their lines.
        self._wrong: dict[str | int, tuple[list[int], list[str]]] = {}
        # First row of each part, and the lines of its rows.
        self._lines_of: list[tuple[int, Lines]] = []

    def columns(self, wanted: Mapping[str, Wanted]) -> dict[str, FloatArray]:
        """Read columns in SI units, NaN where a cell is empty; state source and notes."""
        for item in wanted.values():  # a wrong unit is refused before the work
            to_si(0.0, item.unit, item.dimension, self.where(item.column))
        (rows, room) = self._room(len(wanted))
        count = 0
        values = [np.empty(room) for _ in wanted]
        parts = self._parts([*wanted.values()])
        for lines, part in counted(parts, "rows", rows, lambda part: len(part[0])):
            if count + len(lines) > room:
                cure = "Import it when it is complete."
                raise FormatError(f"{self._name} grew while it was read.", cure=cure)
            self._lines_of.append((count, lines))
            for column, numbers in zip(values, part, strict=True):
                if self._sentinels:
                    numbers = np.where(np.isin(numbers, self._sentinels), np.nan, numbers)
                column[count : count + len(lines)] = numbers
            count += len(lines)
        self._refuse_wrong([*wanted.values()])
        self._describe(count)
        return {
            name: to_si(values.pop(0)[:count], item.unit, item.dimension, self.where(item.column))
            for name, item in wanted.items()
        }

    def unit_of(
        self, column: str | int, unit: str | None, option: str, default: str | None = None
    ) -> str:
        """Return the unit of a column: of its head, of the row of units, or the one given."""
        index = self._index(column)
        below = self._unit_row[index] if index < len(self._unit_row) else ""
        head = next((u for u in _cut(self.names[index])[1:] if is_unit(u)), "")
        if below and head and not same_unit(below, head):
            problem = f"{self.where(column)} has the unit {head!r} in its head, and {below!r}."
            raise InputError(problem, why="One of them is wrong.", cure="Correct the table.")
        stated = below or head
        if unit and stated and not same_unit(unit, stated):
            problem = f"{self.where(column)} states the unit {stated!r}, but {option} is {unit!r}."
            cure = "Leave the option out to take the unit of the table, or correct the table."
            raise InputError(problem, why="One of them is wrong.", cure=cure)
        if chosen := unit or stated or default:
            return chosen.strip()
        cure = f"Give it in the head of the column, as in 'x/mm', or as {option}."
        raise InputError(f"{self.where(column)} states no unit that is known.", cure=cure)

    def where(self, column: str | int) -> str:
        """Return file and column as messages name them."""
        return f"{self._name}: column {column!r}"

    def lines(self, rows: Sequence[int]) -> str:
        """Name the lines of the file in which rows stand: the first five, and how many more."""
        starts = [start for start, _ in self._lines_of]
        parts = [(row, self._lines_of[bisect_right(starts, row) - 1]) for row in rows[:_NAMED]]
        numbers = [str(lines[row - start]) for row, (start, lines) in parts]
        more = f" and {len(rows) - _NAMED} more" if len(rows) > _NAMED else ""
        return f"{self._row}{'s' if len(rows) > 1 else ''} {', '.join(numbers)}{more}"

    def all_lines(self) -> NDArray[Any]:
        """Return the line of the file of each row, (n,)."""
        return np.concatenate([np.asarray(lines) for _, lines in self._lines_of])

    def _index(self, column: str | int) -> int:
        if isinstance(column, str) and self.names.count(column) == 1:
            return self.names.index(column)
        heads = [_cut(name)[0] for name in self.names]
        if heads.count(str(column)) > 1:
            named = [n for n, head in zip(self.names, heads, strict=True) if head == str(column)]
            problem = f"{self._name} has several columns {column!r}: {', '.join(named)}."
            raise InputError(problem, cure="Give the number of the column, counted from 1.")
        if str(column) in heads:
            return heads.index(str(column))
        number = int(column) if isinstance(column, int) or column.isdecimal() else 0
        if not 1 <= number <= len(self.names):
            raise InputError(
                f"{self._name} has no column {column!r}.",
                why="Its columns are: " + ", ".join(self.names) + ".",
                cure="Give one of these names, or a number counted from 1. If the columns of the "
                "table are others, state what separates its cells (--delimiter).",
            )
        return number - 1

    def _most(self, columns: int) -> int:
        """Return how many rows of some columns are taken."""
        # A scan has up to three arrays more than columns, and its file must be read again.
        return min(MOST_ROWS, MOST_HDF5_BYTES // (8 * (columns + 3)))

    def _room(self, columns: int) -> tuple[int, int]:
        """Return how many rows to expect, and for how many there must be room; refuse too many."""
        raise NotImplementedError

    def _parts(self, wanted: list[Wanted]) -> Iterator[tuple[Lines, list[FloatArray]]]:
        """Yield the lines and the columns of one part after another."""
        raise NotImplementedError

    def _describe(self, count: int) -> None:
        """State source and notes when all is read."""

    def _numbers(self, cells: Sequence[str], lines: Lines, item: Wanted) -> FloatArray:
        """Return cells of a column as numbers; those that are none are kept for the message."""
        with suppress(ValueError):
            if not (self._comma_alone and any("." in cell for cell in cells)):
                return np.fromiter(map(float, cells), np.float64, len(cells))
        pairs = zip(cells, lines, strict=True)
        return np.array([self._number(cell, line, item) for cell, line in pairs])

    @property
    def _comma_alone(self) -> bool:
        """Whether a point in a number would be a separator of thousands."""
        return False

    def _number(self, cell: str, line: int, item: Wanted) -> float:
        word = cell.lower()
        if word in item.words:
            return item.words[word]
        if word in self._missing:
            return float("nan")
        text = cell.replace(",", ".") if self.decimal == "," else cell
        with suppress(ValueError):
            if not (self._comma_alone and "." in cell):
                return _float(text)
        lines, cells = self._wrong.setdefault(item.column, ([], []))
        lines.append(line)
        cells += [printable(cell, _MAX_NAME)] if len(cells) < _NAMED else []
        return float("nan")

    def _refuse_wrong(self, wanted: list[Wanted]) -> None:
        for item in wanted:
            if item.column not in self._wrong:
                continue
            lines, cells = self._wrong[item.column]
            named = ", ".join(f"{i} ({cell!r})" for i, cell in zip(lines, cells, strict=False))
            more = f" and {len(lines) - _NAMED} more" if len(lines) > _NAMED else ""
            grouped = any(map(_GROUPED.fullmatch, cells))
            raise FormatError(
                f"{self.where(item.column)} holds what is not "
                f"{' or '.join(['a number', *item.words])} in {self._row} {named}{more}.",
                why="Separators of thousands are not read." if grouped else "",
                cure="Correct or remove these lines; name a word that means a missing value "
                "(--missing WORD); state the decimal mark (--decimal); or state how many lines "
                "stand before the header (--skip-rows N).",
            )


def _float(text: str) -> float:
    """Return a number; D as in Fortran begins its power of ten, too."""
    return float(text.replace("D", "E").replace("d", "e"))


def _cut(name: str) -> tuple[str, ...]:
    """Return the name of a column and, if there is one, its unit."""
    return next((m.groups() for m in (head.fullmatch(name) for head in _HEADS) if m), (name,))


class Sheet(NamedTuple):
    """A sheet of a workbook as text: tabs between cells, a line for each row."""

    name: str
    text: bytes
    sha256: str
    cure: str


class TextTable(NamedColumns):
    """A delimited text whose head was read; its columns are read once, in blocks.

    ``#`` or ``%`` begin a comment. What stands above the header is kept in the notes.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        delimiter: str | None = None,
        decimal: str | None = None,
        missing: Sequence[str] = (),
        skip_rows: int = 0,
        sheet: Sheet | None = None,
    ) -> None:
        super().__init__(os.path.basename(os.fspath(path)), missing)
        self._path = path
        self._sheet = sheet
        self._row = "row" if sheet else "line"
        self._digest = hashlib.sha256()
        self._latin = False
        self._width = 0
        self._line = 1
        self._comments: list[int] = []
        self._blocks = self._whole_lines()
        head = b""
        written = Numbered()
        lines = Numbered()
        # A head of a few endless lines, or of comments alone, is looked at no further than this.
        while len(lines) < _SAMPLE and len(head) <= _BLOCK and (block := next(self._blocks, b"")):
            head = head + block
            self._line = 1
            written = self._numbered(head)
            lines = [(n, s) for n, s in written if n > skip_rows and not _is_comment(s)]
        if not lines:
            cure = "Give a table with one row per reading."
            raise FormatError(f"{self._name} holds no table.", cure=cure)
        self._delimiter = delimiter or ("\t" if sheet else _find_delimiter([s for _, s in lines]))
        self._find_head([(n, s) for n, s in written if n > skip_rows], lines)
        self._said = [s for n, s in written if n < self._header[0]]
        self._comments = [n for n, s in written if n > self._first[1][0] and _is_comment(s)]
        with placed(self._name):
            self.decimal = decimal or find_decimal(self._first[0], self._delimiter)
        self._marks = bytes.maketrans(self.decimal.encode()[:1] + b"dD", b".EE")

    def _find_head(self, written: Numbered, lines: Numbered) -> None:
        """Find the first row of numbers, and the header and the row of units above it."""
        rows, places = self._rows(lines)
        if (start := _first_of_numbers(rows, self._missing)) is None:
            sheet = f"sheet {self._sheet.name!r} of " if self._sheet else ""
            cure = self._sheet.cure if self._sheet else "Give a table with rows of numbers."
            raise FormatError(f"{sheet}{self._name} has no row of numbers.", cure=cure)
        above = [(places[i], rows[i]) for i in range(start) if any(rows[i])]
        if not above:  # numpy.savetxt writes the header as a comment
            comments = [(n, s.lstrip(" \t#%")) for n, s in written if n < places[start]]
            found = [(n, self._rows([(n, s)])[0]) for n, s in comments if s]
            above = [(n, cut[0]) for n, cut in found if len(cut[0]) == len(rows[start])]
        self._header = (places[start], False)
        names = tuple[str, ...]()
        if above and _filled(above[-1][1]) >= min(2, len(rows[start])):
            line, names = above.pop()
            title, cells = above[-1] if above else (0, ())
            named = title == line - 1 and _filled(cells) >= _filled(names)
            bare = [cell.strip("()[]- ") for cell in names]
            if named and not any(map(_is_number, cells)) and any(map(is_common_unit, bare)):
                units = tuple(unit if unit and is_unit(unit) else "" for unit in bare)
                if 2 * _filled(units) >= _filled(bare):
                    self._unit_row = units
                    line = title
                    names = cells
            self._header = line, bool(names)
        heads = [*names, *[""] * (self._width - len(names))]
        self.names = tuple(printable(c, _MAX_NAME) or str(i + 1) for i, c in enumerate(heads))
        self._first = rows[start:], places[start:]
        by_rows = not names or self._delimiter == " "
        self._columns = len(rows[start] if by_rows else names)
        after = places[start - 1] if start else 0
        self._require_whole(*self._first, [entry for entry in lines if entry[0] > after])

    def _describe(self, count: int) -> None:
        sha256 = self._sheet.sha256 if self._sheet else self._digest.hexdigest()
        self.source = SourceFile(self._name, sha256)
        mark = "comma" if self.decimal == "," else "point"
        apart = f"separated by a {_DELIMITERS.get(self._delimiter, repr(self._delimiter))}"
        sheet = f"of the sheet {self._sheet.name!r}" if self._sheet else ""
        apart = sheet or f"{apart}, with a decimal {mark}"
        line, headed = self._header
        units = ", a row of units below it" if self._unit_row else ""
        found = headed and bool(units or not all(map(_is_comment, self._said)))
        self.notes = (
            f"Imported from {self._name} (sha256 {sha256}).",
            *["The table is not UTF-8; it was read as Latin-1."] * self._latin,
            *self._sayings(),
            *[f"The header is {self._row} {line}{units}."] * found,
            *[f"Left out as comments: {self._left_out()}."] * bool(self._comments),
            f"Read {count} rows of {self._width} columns {apart}.",
        )

    def _left_out(self) -> str:
        named = ", ".join(map(str, self._comments[:_NAMED]))
        more = len(self._comments) - _NAMED
        several = "s" if len(self._comments) > 1 else ""
        return f"{self._row}{several} {named}{f' and {more} more' if more > 0 else ''}"

    @property
    def _comma_alone(self) -> bool:
        # The numbers of a workbook have points, whatever its texts have.
        return self.decimal == "," and not self._sheet

    def _require_whole(self, rows: Rows, places: list[int], lines: Numbered) -> None:
        """Refuse rows with more cells than the header, or spaces for a cell; and open quotes."""
        if len(rows) < len(lines):
            order = {number: i for i, (number, _) in enumerate(lines)}
            ends = [order[number] for number in places]
            # The first row whose lines are several.
            begun = next(i for i, end in enumerate(ends) if end > i)
            raise FormatError(
                f"{self._name}: a cell of {self._row} {lines[begun][0]} has no end in it.",
                why="A quotation mark stands alone; the readings within would be lost.",
                cure="Take quotation marks out of the rows of numbers, or close them.",
            )
        spaces = self._delimiter == " "
        stated = self._columns
        for row, place in zip(rows, places, strict=True):
            # Cells may be missing at the end; between spaces, any may be.
            if len(row) != stated if spaces else any(row[stated:]):
                raise FormatError(
                    f"{self._name}: {self._row} {place} has {len(row)} cells, the "
                    f"{'header' if self._header[1] and not spaces else 'first row'} {stated}.",
                    why="Which cell belongs to which column is not known.",
                    cure="Correct the table; state what separates its cells (--delimiter), or "
                    "write numbers with a decimal point where commas separate them.",
                )

    def _sayings(self) -> Iterator[str]:
        """Yield what is written above the table: it may say that the data are synthetic."""
        texts = (
            s.strip(f' \t#%"{self._delimiter}').replace("\t", " ").replace('"', "")
            for s in self._said
        )
        said = [printable(text, _MAX_COMMENT).strip() for text in texts]
        yield from (f"The table says: {text}" for text in said[:_MAX_COMMENTS] if text)
        if len(said) > _MAX_COMMENTS:
            yield f"{len(said) - _MAX_COMMENTS} more lines above the table were left out."

    def _room(self, columns: int) -> tuple[int, int]:
        most = self._most(columns)
        lines = sum(max(piece.count(b"\n"), piece.count(b"\r")) for piece in self._raw())
        if lines > most:
            cure = "Average neighbouring readings, or cut the table into several."
            raise too_large(self._name, lines, most, f"lines of {columns} columns", cure=cure)
        # Some may have other ends; room that stays empty is no memory.
        return lines, 2 * lines + _SAMPLE

    def _raw(self) -> Iterator[bytes]:
        if self._sheet:
            return iter([self._sheet.text])
        return read_pieces(self._path, limit=MOST_TABLE_BYTES)

    def _pieces(self) -> Iterator[bytes]:
        """Yield the text piece by piece; UTF-16, which its mark tells, as UTF-8."""
        decode: codecs.IncrementalDecoder | None = None
        for number, piece in enumerate(filter(None, self._raw())):
            self._digest.update(piece)
            if not number and piece.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
                decode = codecs.getincrementaldecoder("utf-16")("replace")
            yield decode.decode(piece).encode() if decode else piece

    def _whole_lines(self) -> Iterator[bytes]:
        """Yield a few lines, then blocks of whole lines."""
        rest = b""
        size = _FIRST
        for piece in self._pieces():
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

    def _parts(self, wanted: list[Wanted]) -> Iterator[tuple[Lines, list[FloatArray]]]:
        indices = [self._index(item.column) for item in wanted]
        yield self._part(*self._first, indices, wanted)
        for block in self._blocks:
            if numbers := self._plain_numbers(block, indices):
                first = self._line
                self._line = self._line + numbers[0].size
                yield range(first, self._line), numbers
            else:
                written = self._numbered(block)
                self._comments += [n for n, s in written if _is_comment(s)]
                lines = [entry for entry in written if not _is_comment(entry[1])]
                rows, places = self._rows(lines)
                self._require_whole(rows, places, lines)
                yield self._part(rows, places, indices, wanted)

    def _part(
        self, rows: Rows, lines: list[int], indices: list[int], wanted: list[Wanted]
    ) -> tuple[Lines, list[FloatArray]]:
        cells = [[row[i] if i < len(row) else "" for row in rows] for i in indices]
        numbers = [self._numbers(c, lines, item) for c, item in zip(cells, wanted, strict=True)]
        return np.array(lines, dtype=np.int32), numbers

    def _plain_numbers(self, block: bytes, indices: list[int]) -> list[FloatArray]:
        """Return columns of a block of bare numbers in rows of one width; of others, nothing."""
        block = block.replace(b"\r\n", b"\n").rstrip(b"\n") + b"\n"
        if self._delimiter not in _DELIMITERS or block.translate(None, _PLAIN):
            return []
        lines = block.translate(self._marks).splitlines()
        mark = self._delimiter.encode()
        spaces = self._delimiter == " "
        width = len(lines[0].split(None if spaces else mark))
        # The ends of the cells, as they follow each other in equal rows.
        ends = block.translate(None, _PLAIN.translate(None, mark + b"\n"))
        equal = spaces or ends == (mark * (width - 1) + b"\n") * len(lines)
        # What needs a look is cut into cells: to be refused, or completed.
        if max(indices) >= width or not equal or width > self._columns:
            return []
        if (spaces and width != self._columns) or (self._comma_alone and b"." in block):
            return []
        try:
            chosen: Any = {} if spaces else {"delimiter": self._delimiter, "usecols": indices}
            numbers = np.loadtxt(lines, ndmin=2, comments=None, **chosen)
        except ValueError:
            return []
        self._width = max(self._width, width)
        columns = numbers.T[indices] if spaces else numbers.T
        return [*columns] if len(numbers) == len(lines) else []

    def _numbered(self, block: bytes) -> Numbered:
        """Return the lines that are not blank, with their numbers in the file."""
        if b"\0" in block:
            raise FormatError(f"{self._name} is not a text file.", cure="Give a table as CSV.")
        try:
            text = block.decode("latin-1" if self._latin else "utf-8-sig")
        except UnicodeDecodeError:
            self._latin = True
            text = block.decode("latin-1")
        # A typographic minus is one.
        lines = text.replace("\r\n", "\n").replace("\r", "\n").replace("−", "-").split("\n")
        first = self._line
        self._line = self._line + len(lines) - 1
        return [(number, line) for number, line in enumerate(lines, first) if line.strip()]

    def _rows(self, lines: Numbered) -> tuple[Rows, list[int]]:
        """Cut lines into cells; return them with the numbers of their lines."""
        if self._delimiter == " ":
            rows = [line.split() for _, line in lines]
            places = [number for number, _ in lines]
        else:
            try:
                reader = csv.reader(
                    (line for _, line in lines), delimiter=self._delimiter, skipinitialspace=True
                )
                cut = [(row, lines[reader.line_num - 1][0]) for row in reader]
            except (csv.Error, TypeError) as error:
                raise FormatError(f"{self._name} cannot be cut into columns: {error}.") from error
            rows = [row for row, _ in cut]
            places = [number for _, number in cut]
        self._width = max(self._width, *map(len, rows), 0)
        if self._width > MOST_COLUMNS:
            cure = "Leave out columns."
            raise too_large(self._name, self._width, MOST_COLUMNS, "columns", cure=cure)
        return [tuple(map(str.strip, row)) for row in rows], places


def _is_comment(line: str) -> bool:
    # What a spreadsheet writes for an error is a cell.
    text = line.lstrip()
    return text[0] in "#%" and not _SHEET_ERROR.match(text)


def _filled(cells: Sequence[str]) -> int:
    return sum(map(bool, cells))


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None


def _first_of_numbers(rows: Rows, missing: Set[str]) -> int | None:
    """Return the first row of a table, below preamble, header and units; none without numbers."""
    counts = [sum(map(_is_number, row)) for row in rows]
    if not (most := min(2, max(counts, default=0))):
        return None
    dense = [row for row, count in zip(rows, counts, strict=True) if count >= most][-_LAST:]
    numeric = []
    for i, cells in enumerate(zip_longest(*dense, fillvalue="")):
        stated = [_is_number(cell) for cell in cells if cell.lower() not in missing]
        numeric += [i] if 2 * sum(stated) >= len(stated) > 0 else []
    of_numbers = [[row[i] for i in numeric if i < len(row)] for row in rows]
    good = [all(_is_number(c) or c.lower() in missing for c in cells) for cells in of_numbers]
    some = [any(map(_is_number, cells)) for cells in of_numbers]
    both = [a and b for a, b in zip(good, some, strict=True)]
    start = both.index(True) if any(both) else some.index(True)
    while start and some[start - 1]:  # a row with a wrong cell, which is refused later
        start -= 1
    return start


def _find_delimiter(lines: list[str]) -> str:
    """Take the delimiter that cuts the most lines into equally many pieces, of numbers."""
    best = " "
    score = 0.0
    for delimiter in _DELIMITERS:
        rows = [line.split(None if delimiter == " " else delimiter) for line in lines[-_LAST:]]
        widths = [len(row) for row in rows]
        common = max(set(widths), key=widths.count)
        cells = [c.strip(' "') for row in rows if len(row) == common for c in row]
        found = widths.count(common) * (0.1 + sum(map(_is_number, cells)) / len(cells))
        if common > 1 and found > score:
            best = delimiter
            score = found
    return best


def find_decimal(rows: Rows, delimiter: str = "") -> str:
    """A comma is the decimal mark only where cells hold one comma each and no point."""
    if delimiter == ",":
        return "."
    some = rows[:200]
    cells = [c for row in some for c in row if _is_number(c)]
    if not any("," in c for c in cells) or any("." in c for c in cells):
        return "."
    for column in zip_longest(*some, fillvalue=""):
        commas = [c for c in column if "," in c and _is_number(c)]
        bare = [c for c in column if "," not in c and _is_number(c)]
        if commas and bare and all(map(_THOUSANDS.fullmatch, commas)):
            raise FormatError(
                f"The commas of {commas[0]!r} may separate thousands: {bare[0]!r} in the same "
                "column has none.",
                why="Separators of thousands are not read.",
                cure="Take them out, or state that commas are decimal (--decimal ,).",
            )
    return ","


def read_indenter_table(path: str | os.PathLike[str], *, r_unit: str, z_unit: str) -> Profile:
    """Read an indenter's profile from a table with one row per radius: radius and height."""
    table = TextTable(path)
    units = {1: r_unit, 2: z_unit}
    columns = table.columns({str(i): Wanted(i, unit, "length") for i, unit in units.items()})
    with placed(os.path.basename(os.fspath(path))):
        # What a microscope calls zero is anywhere.
        return Profile(r=columns["1"], z=columns["2"] - columns["2"].min())
