"""Tables of all kinds: sheets of a workbook, Parquet files, and columns in memory by themselves.

A workbook is a zip file of XML: what it inflates to, and how many elements that holds, is known
before openpyxl sees it.
"""

import hashlib
import io
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from os import PathLike
from pathlib import PurePath
from types import MappingProxyType
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, UnsafeFileError, counted, placed
from memscal.extensions import hook
from memscal.formats.files import damage_named, read_bytes
from memscal.formats.tables.columns import MAX_NAME, Lines, NamedColumns, Parts, Wanted
from memscal.formats.tables.dialect import find_decimal
from memscal.formats.tables.text_table import Sheet, TextTable
from memscal.model.arrays import FloatArray, unmasked
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile, source_of
from memscal.model.sizes import MOST_FILE_BYTES, MOST_OTHER_TAGS, MOST_TAGS, too_large
from memscal.progress import Task

_KINDS = {".xlsx": "workbook", ".xlsm": "workbook", ".parquet": "Parquet", ".pq": "Parquet"}
_OTHERS = (".xls", ".xlsb", ".ods", ".numbers")
#: Options of reading by the kinds of tables that have a use for them.
_USES = {
    "delimiter": ("text", "SPEC file"),
    "scan": ("SPEC file",),
    "decimal": ("text", "SPEC file", "TDMS file", *_KINDS.values(), "table in memory"),
    "skip_rows": ("text", "SPEC file", "workbook"),
    "sheet": ("workbook",),
}
_PIECE = 2**16
_NONE: Mapping[str, Any] = MappingProxyType({})
#: What a sheet holds besides its values: hidden rows, merged cells, and formulas without results
#: (of an empty text the result is empty), in whose place openpyxl would give nothing.
_HIDDEN = re.compile(rb'<(?:\w+:)?row\b(?=[^>]*\bhidden="(?:1|true)")[^>]*?\br="(\d+)"')
_MERGED = re.compile(rb'<(?:\w+:)?mergeCell\b[^>]*\bref="([A-Z0-9:]+)"')
_NO_RESULT = re.compile(
    rb'<(\w+:)?c\b(?![^>]*\bt="str")(?:[^>]*?(\br="\w+"))?[^>]*>\s*<(?:\w+:)?f\b[^>]*(?:/>|>[^<]*</[^>]*>)'
    rb"\s*(?:<(?:\w+:)?v\s*/>|<(?:\w+:)?v>\s*</[^>]*>)?\s*</(?:\w+:)?c>"
)
_SAID = rb'<\1c \2 t="str"><\1v>a formula without a stored result</\1v></\1c>'


def open_table(
    source: Any, named: Mapping[str, Any] = _NONE, *, gaps: bool = False, **reading: Any
) -> NamedColumns:
    """Open a table of any kind: a path, or columns in memory (a mapping, a data frame).

    ``named`` are the columns of a scan that are asked for, or ``None``, by the names of its arrays.
    With ``gaps`` rows below the head are readings though nothing stands in them.
    """
    reading = {name: value for name, value in reading.items() if value or value == 0}
    path = isinstance(source, str | PathLike)
    ending = PurePath(source).suffix.lower() if path else ""
    if ending in _OTHERS:
        problem = f"{source} is a workbook of a kind that is not read."
        raise FormatError(problem, cure="Save it as .xlsx or as CSV.")
    kind = "table in memory"
    if path:
        kind = _KINDS.get(ending) or hook("kind_of_record")(source)
    useless = [name for name in reading if kind not in _USES.get(name, (kind,))]
    if useless:
        options = ", ".join(f"{name} (--{name.replace('_', '-')})" for name in useless)
        raise InputError(f"{options} has no effect on a {kind}.", cure="Leave it out.")
    if kind == "text":
        return TextTable(source, gaps=gaps, **reading)
    if not path:
        return _columns_in_memory(source, **reading)
    if ending not in _KINDS:
        record: NamedColumns = hook("open_record")(kind, source, named, **reading)
        return record
    name = PurePath(source).name
    with _reading(f"{name} cannot be read"):
        if kind == "workbook":
            return _sheet_table(name, read_bytes(source), gaps=gaps, **reading)
        return _parquet_table(name, read_bytes(source), **reading)


def installed(library: str, what: str, extra: str) -> Any:
    """Import a library that an extra brings; say where it is not installed what needs it."""
    try:
        return import_module(library)
    except ModuleNotFoundError as error:
        raise InputError(
            f"{what} is read by {library.partition('.')[0]}, which is not installed.",
            cure=f'Install it with the extra "{extra}": pip install ".[{extra}]"',
        ) from error


_reading = partial(damage_named, why="Its reader gave no table back", cure="Save it as CSV.")


def _sheet_table(name: str, data: bytes, *, sheet: str | None = None, **reading: Any) -> TextTable:
    """Return a sheet of a workbook, by default the first that is visible, as text."""
    openpyxl = installed("openpyxl", "A workbook", "tables")
    plain = _inflated(data, name)
    book = openpyxl.load_workbook(plain, read_only=True, data_only=True, keep_links=False)
    if sheet is not None and sheet not in book.sheetnames:
        why = f"Its sheets are: {', '.join(book.sheetnames)}."
        raise InputError(f"{name} has no sheet {sheet!r}.", why=why, cure="Give one of them.")
    visible = [one.title for one in book.worksheets if one.sheet_state == "visible"]
    chosen = book[sheet or visible[0]]
    xml = zipfile.ZipFile(plain).read(chosen._worksheet_path)
    claimed = chosen.max_row or 0
    chosen.reset_dimensions()  # which may claim billions of cells
    text = io.BytesIO()
    cells = 0
    for row in Task("rows", claimed).counted(chosen.iter_rows(values_only=True)):
        cells += max(len(row), 1)
        _limit(name, cells, MOST_TAGS, "cells")
        # An empty row is one of empty cells.
        text.write(("\t".join(map(_cell, row)) or "\t").encode() + b"\n")
    cure = (
        f"Name the sheet of the table (--sheet): {', '.join(book.sheetnames)}. Of formulas the "
        "results must be stored: save it in a spreadsheet program."
    )
    content = Sheet(
        chosen.title,
        text.getvalue(),
        hashlib.sha256(data).hexdigest(),
        cure,
        [*map(int, _HIDDEN.findall(xml))],
        [openpyxl.utils.range_boundaries(ref.decode()) for ref in _MERGED.findall(xml)],
    )
    return TextTable(name, sheet=content, **reading)


def _inflated(data: bytes, name: str) -> io.BytesIO:
    """Return the XML of a workbook unpacked, if it is neither too large nor of another kind."""
    plain = io.BytesIO()
    total = 0
    tags = {True: 0, False: 0}
    with zipfile.ZipFile(io.BytesIO(data)) as packed, zipfile.ZipFile(plain, "w") as unpacked:
        # Others are pictures and programs.
        for entry in packed.infolist():
            if not entry.filename.endswith((".xml", ".rels")):
                continue
            pieces = []
            in_sheet = entry.filename.startswith("xl/worksheets/")
            most = MOST_TAGS if in_sheet else MOST_OTHER_TAGS
            part = "sheets" if in_sheet else "texts and styles"
            with packed.open(entry) as member:
                while piece := member.read(_PIECE):
                    pieces.append(piece)
                    total += len(piece)
                    tags[in_sheet] += piece.count(b"<")
                    _limit(name, tags[in_sheet], most, f"tags of XML in its {part}")
                    _limit(name, total, MOST_FILE_BYTES, "bytes when it is unpacked")
            xml = _NO_RESULT.sub(_SAID, b"".join(pieces))
            # Entities multiply, and other encodings hide them.
            encoding = re.search(rb"encoding\s*=\s*[\"']([^\"']*)", xml[:200])
            if b"\0" in xml or b"<!" in xml or (encoding and encoding[1].lower() != b"utf-8"):
                where = f"{name}: {printable(entry.filename, MAX_NAME)}"
                problem = f"{where} has declarations or an encoding that no workbook has."
                raise UnsafeFileError(problem, cure="Save the sheet as CSV.")
            unpacked.writestr(entry.filename, xml)
    return plain


def _limit(name: str, size: int, most: int, of: str) -> None:
    if size > most:
        cure = "Save the sheet as CSV."
        raise too_large(name, size, most, of, cure=cure, error=UnsafeFileError)


def _cell(value: Any) -> str:
    """Return a cell as text; that of a text cell is quoted, so that it is no comment."""
    if isinstance(value, int | float):
        return repr(value)
    return "" if value is None else '"' + " ".join(str(value).split()).replace('"', '""') + '"'


class FrameTable(NamedColumns):
    """Columns that another library holds or reads, each by ``column(index)``."""

    def __init__(
        self,
        name: str,
        names: Sequence[Any],
        rows: int,
        column: Callable[[int], Any],
        *,
        units: Sequence[str] = (),
        source: SourceFile | None = None,
        decimal: str | None = None,
        missing: Sequence[str] = (),
    ) -> None:
        super().__init__(name, missing)
        self.names = tuple(printable(head, MAX_NAME) for head in names)
        self.source = source
        self.decimal = decimal
        self._unit_row = tuple(units)
        self._rows = rows
        self._column = column

    def _count(self) -> int:
        return self._rows

    def _parts(self, wanted: list[Wanted]) -> Parts:
        lines = range(1, self._rows + 1)
        yield lines, [self._converted(item, lines) for item in wanted]
        # Others of texts are looked at in memory: those of a file would have to be read.
        read = [self.index_of(item.column) for item in wanted]
        for i in range(len(self.names) if self.source is None else 0):
            values = np.asarray(self._column(i), dtype=object).ravel()
            text = "".join(value for value in values if isinstance(value, str))
            if i in read or not text or "," in text:
                continue
            cells = [str(value).strip() for value in values]
            if self._is_watched(self.names[i], cells):
                self._numbers(cells, lines, self._others[-1])

    def _converted(self, item: Wanted, lines: Lines) -> FloatArray:
        index = self.index_of(item.column)
        with _reading(f"{self._name} cannot be read"):
            values = np.asarray(unmasked(self._column(index)))
        if values.shape != (self._rows,):
            problem = f"{self.where(item.column)} has shape {values.shape} in {self._rows} rows."
            raise InputError(problem, cure="Give one value for each row.")
        if values.dtype.kind in "iufb":
            return values.astype(np.float64)
        cells = ["" if value is None else str(value).strip() for value in values.tolist()]
        with placed(self.where(item.column)):
            self.decimal = self.decimal or find_decimal([[cell, "0"] for cell in cells], ",")
        return self._numbers(cells, lines, item)

    def _describe(self, count: int) -> None:
        sha256 = f" (sha256 {self.source.sha256})" if self.source else ""
        self.notes = (
            f"Imported from {self._name}{sha256}.",
            f"Read {counted(count, 'rows')} of {counted(len(self.names), 'columns')}.",
        )


def _columns_in_memory(frame: Any, **reading: Any) -> FrameTable:
    """Return a mapping of columns, or a data frame of any library, as a table."""
    keys = list(frame if isinstance(frame, Mapping) else getattr(frame, "columns", ()))
    if not keys:
        cure = "Give a path, a data frame with columns, or a mapping of names to arrays."
        raise InputError(
            f"An object of type {type(frame).__name__} is no table with columns.", cure=cure
        )
    rows = np.size(frame[keys[0]])
    return FrameTable("a table in memory", keys, rows, lambda i: frame[keys[i]], **reading)


def _parquet_table(name: str, data: bytes, **reading: Any) -> FrameTable:
    """Return a Parquet file as a table; its fields may state units in their metadata."""
    parquet = installed("pyarrow.parquet", "A Parquet", "tables")
    file = parquet.ParquetFile(io.BytesIO(data))
    heads = file.schema_arrow
    units = [
        ((head.metadata or {}).get(b"units") or b"").decode("utf-8", "replace") for head in heads
    ]
    source = source_of(name, data)

    def column(index: int) -> Any:
        # Columns of one name are read together.
        same = heads.names[:index].count(heads[index].name)
        return file.read(columns=[heads[index].name]).column(same)

    rows = file.metadata.num_rows
    return FrameTable(name, heads.names, rows, column, units=units, source=source, **reading)
