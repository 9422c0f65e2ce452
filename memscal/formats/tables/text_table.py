"""Tables of numbers as text, whose dialect and head are found."""

import codecs
import csv
import hashlib
import itertools
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence, Set
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from memscal.errors import FormatError, counted, placed
from memscal.formats.files import FilePath, read_pieces
from memscal.formats.tables.columns import MAX_NAME, NamedColumns, Parts, Wanted
from memscal.formats.tables.dialect import (
    DELIMITERS,
    Rows,
    filled,
    find_decimal,
    find_delimiter,
    first_of_numbers,
    holds_unit,
    is_number,
    last_name,
    units_in,
    words_of,
)
from memscal.model.arrays import FloatArray
from memscal.model.indenter import Profile
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile
from memscal.model.sizes import MOST_COLUMNS, MOST_TABLE_BYTES, too_large

#: Begins a line of cells, which is no comment: what a spreadsheet writes for an error is a cell.
CELLS = re.compile(r"\s*(?:[^\s#%]|#(?:N/A|(?:DIV/0|REF|NUM|VALUE|NULL)!|NAME\?))", re.IGNORECASE)
#: Share of an indenter's height by which its axis may lie above the lowest point.
_HOLLOW = 1e-3
_MAX_COMMENTS = 20
_MAX_COMMENT = 300
#: Lines from which delimiter, decimal mark and header are found; bytes that are cut into cells at
#: once, and those of the longest line.
_SAMPLE = 250
_BLOCK = 2**16
_LONGEST = 2**22

Numbered = list[tuple[int, str]]


class Sheet(NamedTuple):
    """A sheet of a workbook as text: tabs between cells, a line for each row."""

    name: str
    text: bytes
    sha256: str
    cure: str
    #: Rows that are hidden, and the first and last column and row of merged cells.
    hidden: list[int]
    merged: list[tuple[int, int, int, int]]


class TextTable(NamedColumns):
    """A delimited text whose head was read; its columns are read once, in blocks.

    ``#`` or ``%`` begin a comment. What stands above the header is kept in the notes. With ``gaps``
    rows of missing values alone begin the table, too, and lines of tabs alone are such rows.
    """

    def __init__(
        self,
        path: FilePath,
        *,
        delimiter: str | None = None,
        decimal: str | None = None,
        missing: Sequence[str] = (),
        skip_rows: int | None = None,
        sheet: Sheet | None = None,
        gaps: bool = False,
    ) -> None:
        super().__init__(PurePath(path).name, missing)
        self._path = path
        self._sheet = sheet
        self._gaps = gaps
        self._row = "row" if sheet else "line"
        self._digest = hashlib.sha256()
        self._latin = False
        self._reach = 0  # cells of the longest row
        self._line = 1
        self._blocks = self._whole_lines()
        lines = Numbered()
        comments = Numbered()
        skipped = skip_rows or 0
        seen = 0
        # A head of a few endless lines, or of comments alone, is looked at no further than this.
        while len(lines) < _SAMPLE + skipped and seen <= _LONGEST:
            block = next(self._blocks, b"")
            if not block:
                break
            more_lines, more_comments = self._numbered(block)
            seen += len(block)
            lines += more_lines
            comments += more_comments
        below = [entry for entry in lines if entry[0] > skipped]
        if not below:
            cure = "Give a table with one row per reading."
            raise FormatError(f"{self._name} holds no table.", cure=cure)
        stated = "\t" if sheet or delimiter == "TAB" else delimiter
        self._sure = stated is not None
        self._delimiter = stated or find_delimiter([s for _, s in below])
        self._find_head(below, [entry for entry in comments if entry[0] > skipped])
        self._said = [line for n, line in sorted(lines + comments) if n < self._header]
        self._comments: list[int] = []
        self._leave_out([entry for entry in comments if entry[0] > self._first[1][0]])
        if skip_rows is None and not self._headed:
            self._refuse_counted()
        marks = {",": ""}.get(self._delimiter, "," if sheet else ",.")
        with placed(self._name):
            self.decimal = decimal or find_decimal(self._first[0], marks)
        # The numbers of a workbook have points, whatever its texts have.
        self._comma_alone = self.decimal == "," and not sheet

    def _find_head(self, lines: Numbered, comments: Numbered) -> None:
        """Find the first row of numbers, and the header and the row of units above it."""
        cut, places = self._rows(lines)
        rows = [[cell.strip() for cell in row] for row in cut]
        start = first_of_numbers(rows, self._missing)
        while self._gaps and start and self._missing.issuperset(map(str.lower, rows[start - 1])):
            start -= 1
        if start == len(rows):
            sheet = f"sheet {self._sheet.name!r} of " if self._sheet else ""
            cure = self._sheet.cure if self._sheet else "Give a table with rows of numbers."
            why = "Units stand in its cells." if any(map(holds_unit, rows[-1])) else ""
            raise FormatError(f"{sheet}{self._name} has no row of numbers.", why=why, cure=cure)
        width = len(rows[start])
        above = [(places[i], rows[i]) for i in range(start) if any(rows[i])]
        if not above:
            before = [(number, line) for number, line in comments if number < places[start]]
            above = self._commented_heads(before, {width, width - (not rows[start][-1])})
        names: list[str] = []
        self._header = places[start]
        if above and filled(above[-1][1]) >= min(2, width):
            self._header, names = above.pop()
            line, title = above[-1] if above else (0, [])
            units = units_in(names)
            whole = filled(title) >= filled(names) and not any(map(is_number, title))
            if units and line == self._header - 1 and whole:
                self._unit_row = units
                self._header = line
                names = title
        unfit = [len(row) for row in (names, self._unit_row) if len(row) not in (0, width)]
        if unfit and self._delimiter == " ":
            self._unfit = (
                f"The head in {self._row} {self._header} has {unfit[0]} words, the rows {width} "
                "cells: a name has a blank, or the first cells are names of rows."
            )
            counts = [row[0].strip('"') for row in rows[start : start + 2]]
            if unfit[0] == width - 1 and counts == ["1", "2"]:  # as R writes them
                cure = f"Name all columns, or leave this line out (--skip-rows {self._header})."
                raise FormatError(f"{self._name}: {self._unfit}", cure=cure)
            names = []
            self._unit_row = ()
            self._header = places[start]
        self._headed = bool(names)
        longest = max(len(names), *map(len, rows[start:]))
        heads = [*names, *[""] * (longest - len(names))]
        self.names = tuple(printable(c, MAX_NAME) or str(i + 1) for i, c in enumerate(heads))
        self._first = rows[start:], places[start:]
        self._columns = len(names) or width
        self._named_columns = last_name(names)
        after = places[start - 1] if start else 0
        self._require_whole(*self._first, [entry for entry in lines if entry[0] > after])

    def _refuse_counted(self) -> None:
        """Refuse a first row that may number the columns, from 0 or 1, perhaps but the first."""
        first = self._first[0][0]
        counted = first[not is_number(first[0]) :]
        numbers = [*map(str, range(len(counted) + 1))]
        line = self._first[1][0]
        if len(first) > 1 and counted in (numbers[:-1], numbers[1:]):
            raise FormatError(
                f"{self._name}: {self._row} {line} ({', '.join(first)}) looks like numbers of "
                "columns, but may be a reading.",
                cure="State how many lines stand before the first reading: "
                f"--skip-rows {line}, or --skip-rows {line - 1}.",
            )

    def _commented_heads(self, comments: Numbered, widths: Set[int]) -> list[tuple[int, list[str]]]:
        """Return comments with as many cells as a row: numpy.savetxt writes the header as one."""
        heads = []
        for number, line in comments:
            text = line.lstrip(" \t#%")
            if text:
                (row,) = self._rows([(number, text)])[0]
                if len(row) in widths:
                    heads.append((number, [cell.strip() for cell in row]))
        return heads

    def _leave_out(self, comments: Numbered) -> None:
        """Leave out comments among the rows, and look for a head in them."""
        self._comments += [number for number, _ in comments]
        heads = self._commented_heads(comments, {self._columns}) if self._headed else []
        names = {self._cut(name)[0] for name in self.names}
        self._again.update(n for n, row in heads if {self._cut(c)[0] for c in row} <= names)

    def _describe(self, count: int) -> None:
        self._refuse_more_names()
        sha256 = self._sheet.sha256 if self._sheet else self._digest.hexdigest()
        self.source = SourceFile(self._name, sha256)
        notes = [f"Imported from {self._name} (sha256 {sha256})."]
        if self._latin:
            notes.append("The table is not UTF-8; it was read as Latin-1.")
        notes += self._sayings()
        units = ", a row of units below it" if self._unit_row else ""
        if self._headed and (units or any(map(CELLS.match, self._said))):
            notes.append(f"The header is {self._row} {self._header}{units}.")
        if self._comments:
            notes.append(f"Left out as comments: {self._named(self._comments)}.")
        if self._sheet:
            apart = f"of the sheet {self._sheet.name!r}"
            hidden = self._sheet.hidden
            if hidden:
                notes.append(f"Hidden, and read as all others: {self._named(hidden)}.")
        else:
            mark = "comma" if self.decimal == "," else "point"
            delimiter = DELIMITERS.get(self._delimiter, repr(self._delimiter))
            apart = f"separated by a {delimiter}, with a decimal {mark}"
        notes.append(
            f"Read {counted(count, 'rows')} of {counted(len(self.names), 'columns')} {apart}."
        )
        self.notes = tuple(notes)

    def _refuse_more_names(self) -> None:
        """Refuse names without cells, unless the delimiter is stated: rows may end in one."""
        if not self._sure and self._reach < self._named_columns:
            raise FormatError(
                f"{self._name}: the head in {self._row} {self._header} has {self._named_columns} "
                f"names, but no row more than {counted(self._reach, 'cells')}.",
                why="The last columns are empty, or the names are not above their cells.",
                cure="If columns are empty, state what separates cells (--delimiter ',' or TAB).",
            )

    def _require_whole(self, rows: Rows, places: list[int], lines: Numbered) -> None:
        """Refuse rows with more cells than the header, or spaces for a cell; and open quotes."""
        if len(rows) < len(lines):
            # Rows end on the lines of their numbers: the first one that does not has several.
            begun = next(line for (line, _), end in zip(lines, places, strict=False) if line != end)
            raise FormatError(
                f"{self._name}: a cell of {self._row} {begun} has no end in it.",
                why="A quotation mark stands alone; the readings within would be lost.",
                cure="Take quotation marks out of the rows of numbers, or close them.",
            )
        stated = self._columns
        by_blanks = self._delimiter == " "
        for row, place in zip(rows, places, strict=True):
            # An empty last cell is none, but with gaps: rows may end in a delimiter.
            self._reach = max(self._reach, len(row) - (not (self._gaps or row[-1].strip())))
            # Between delimiters cells may be missing at the end.
            if not any(map(str.strip, row[stated:])) and not (by_blanks and len(row) < stated):
                continue
            by = "header" if self._headed else "first row"
            raise FormatError(
                f"{self._name}: {self._row} {place} has "
                f"{counted(len(row), 'cells')}, the {by} {stated}.",
                why="Which cell belongs to which column is not known, or another table begins.",
                cure="Correct the table, or give each a file of its own; state what separates its "
                "cells (--delimiter), or write numbers with a decimal point where commas separate "
                "them.",
            )

    def _sayings(self) -> Iterator[str]:
        """Yield what is written above the table: it may say that the data are synthetic."""
        for line in self._said[:_MAX_COMMENTS]:
            bare = line.strip(f' \t#%"{self._delimiter}').replace("\t", " ").replace('"', "")
            text = printable(bare, _MAX_COMMENT).strip()
            if text:
                yield f"The table says: {text}"
        if len(self._said) > _MAX_COMMENTS:
            yield f"{len(self._said) - _MAX_COMMENTS} more lines above the table were left out."

    def _count(self) -> int:
        return sum(max(piece.count(b"\n"), piece.count(b"\r")) for piece in self._raw())

    def _raw(self) -> Iterator[bytes]:
        if self._sheet:
            text = self._sheet.text
            return (text[i : i + _LONGEST] for i in range(0, len(text), _LONGEST))
        return read_pieces(self._path, limit=MOST_TABLE_BYTES)

    def _pieces(self) -> Iterator[bytes]:
        """Yield the text piece by piece; UTF-16, which its mark tells, as UTF-8."""
        decode = None
        for number, piece in enumerate(filter(None, self._raw())):
            self._digest.update(piece)
            if number == 0 and piece.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
                decode = codecs.getincrementaldecoder("utf-16")("replace")
            yield decode.decode(piece).encode() if decode else piece

    def _whole_lines(self) -> Iterator[bytes]:
        """Yield blocks of whole lines."""
        rest = b""
        for piece in self._pieces():
            rest += piece
            while len(rest) > _BLOCK:
                end = _line_end(rest)
                if end:
                    yield rest[:end]
                    rest = rest[end:]
                elif len(rest) > _LONGEST:
                    raise too_large("A line", len(rest), _LONGEST, "bytes", cure="Give a table.")
                else:
                    break
        if rest:
            yield rest

    def _parts(self, wanted: list[Wanted]) -> Parts:
        indices = [self.index_of(item.column) for item in wanted]
        rows, places = self._first
        for left, top, right, bottom in self._sheet.merged if self._sheet else ():
            if bottom >= places[0] and any(left <= i + 1 <= right for i in indices):
                raise FormatError(
                    f"{self._name}: cells of the rows {top} to {bottom} are merged.",
                    why="Which row, and which column, the one value belongs to is not known.",
                    cure="Split them, and write into each cell what is meant.",
                )
        self.others = ", ".join(self._look_at_others(indices))
        wanted = wanted + self._others
        yield places, self._columns_of(rows, places, indices, wanted)
        for block in self._blocks:
            numbers = self._bare_numbers(block)
            if numbers is not None and max(indices) < self._columns:
                self._reach = self._columns
                yield range(self._line, self._line + len(numbers)), [*numbers.T[indices]]
                self._line += len(numbers)
                continue
            lines, comments = self._numbered(block)
            self._leave_out(comments)
            rows, places = self._rows(lines)
            self._require_whole(rows, places, lines)
            columns = self._columns_of(rows, places, indices, wanted)
            yield np.array(places, dtype=np.int32), columns

    def _look_at_others(self, read: list[int]) -> Iterator[str]:
        """Yield names of columns that vary; read those that begin with numbers or units, too."""
        rows, _ = self._first
        for i, cells in enumerate(itertools.zip_longest(*rows, fillvalue="")):
            if i in read:
                continue
            if len({*cells}) > 1:
                yield self.names[i]
            if self._is_watched(self.names[i], cells):
                read.append(i)

    def _bare_numbers(self, block: bytes) -> FloatArray | None:
        """Return a block of bare numbers in full rows, in a fifth of the time that cells take."""
        if not block.isascii() or block.isspace() or (self._comma_alone and b"." in block):
            return None
        lines = block.replace(b",", b".") if self._comma_alone else block
        delimiter = None if self._delimiter == " " else self._delimiter
        rows = lines.splitlines()
        try:
            numbers = np.loadtxt(rows, delimiter=delimiter, comments=None, ndmin=2)
        except ValueError:
            return None
        whole = numbers.shape == (len(rows), self._columns) and not np.isinf(numbers).any()
        return numbers if whole else None

    def _columns_of(
        self, rows: Rows, places: list[int], indices: list[int], wanted: list[Wanted]
    ) -> list[FloatArray]:
        cells = [*itertools.zip_longest(*rows, fillvalue="")]
        empty = ("",) * len(rows)
        return [
            self._numbers(cells[i] if i < len(cells) else empty, places, item)
            for i, item in zip(indices, wanted, strict=True)
        ]

    def _numbered(self, block: bytes) -> tuple[Numbered, Numbered]:
        """Return lines of cells, and comments, with their numbers in the file."""
        if b"\0" in block:
            raise FormatError(f"{self._name} is not a text file.", cure="Give a table as CSV.")
        try:
            text = block.decode("latin-1" if self._latin else "utf-8-sig")
        except UnicodeDecodeError:
            self._latin = True
            text = block.decode("latin-1")
        # A typographic minus is one.
        written = text.replace("\r\n", "\n").replace("\r", "\n").replace("−", "-").split("\n")
        lines = Numbered()
        comments = Numbered()
        for number, line in enumerate(self._table_of(written), self._line):
            if CELLS.match(line) or (self._gaps and "\t" in line and line.isspace()):
                lines.append((number, line))
            elif line.strip():
                comments.append((number, line))
        self._line += len(written) - 1
        return lines, comments

    def _table_of(self, lines: Sequence[str]) -> Iterable[str]:
        """Return lines as they stand in the table, empty where they are no part of it."""
        return lines

    def _rows(self, lines: Numbered) -> tuple[Rows, list[int]]:
        """Cut lines into cells; return them with the numbers of their lines."""
        places = [number for number, _ in lines]
        texts = [line for _, line in lines]
        if self._delimiter == " ":
            rows = [words_of(line) or [""] for line in texts]
        else:
            try:
                reader = csv.reader(texts, delimiter=self._delimiter, skipinitialspace=True)
                cut = [(row, reader.line_num) for row in reader]
            except (csv.Error, TypeError) as error:
                raise FormatError(f"{self._name} cannot be cut into columns: {error}.") from error
            rows = [row for row, _ in cut]
            places = [places[line - 1] for _, line in cut]
        widest = max(map(len, rows), default=0)
        if widest > MOST_COLUMNS:
            cure = "Leave out columns."
            raise too_large(self._name, widest, MOST_COLUMNS, "columns", cure=cure)
        return rows, places


def _line_end(text: bytes) -> int:
    """Return where the last whole line of a block ends, or the first line, if that is longer."""
    for end in (b"\n", b"\r"):
        place = text.rfind(end, 0, _BLOCK) + 1 or text.find(end, _BLOCK, -1) + 1
        if place:
            return place
    return 0


def read_indenter_table(path: FilePath, *, r_unit: str | None, z_unit: str | None) -> Profile:
    """Read an indenter's profile from a table with one row per radius: radius and height."""
    table = TextTable(path, skip_rows=0)
    r_unit = table.unit_of(1, r_unit, "r_unit (--r-unit)", "mm")
    z_unit = table.unit_of(2, z_unit, "z_unit (--z-unit)", "um")
    wanted = {"1": Wanted(1, r_unit, "length"), "2": Wanted(2, z_unit, "length")}
    columns = table.columns(wanted)
    name = PurePath(path).name
    with placed(name):
        # What a microscope calls zero is anywhere.
        profile = Profile(r=columns["1"], z=columns["2"] - columns["2"].min())
    if profile.z[0] > _HOLLOW * profile.z.max():
        lowest = profile.r[profile.z.argmin()]
        warnings.warn(
            f"{name}: the lowest height is {lowest * 1e3:.4g} mm from the axis, so that a ring "
            "touches first. If the table goes across the tip, let r begin at its apex.",
            stacklevel=2,
        )
    return profile
