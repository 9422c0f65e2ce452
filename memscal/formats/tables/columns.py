"""Columns of numbers: chosen by name or number, with units from their heads, read part by part."""

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from memscal.errors import FormatError, InputError
from memscal.formats.tables.dialect import (
    GROUPED,
    MISSING,
    UNIT,
    are_units,
    cut_head,
    holds_unit,
    is_number,
    number_of,
)
from memscal.formats.units import is_unit, reading_of, same_unit, to_si
from memscal.model.arrays import Arrays, FloatArray
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile
from memscal.model.sizes import MOST_HDF5_BYTES, MOST_ROWS, too_large
from memscal.progress import Task

MAX_NAME = 80
_NAMED = 5
#: No quantity is as large: instruments write such numbers, mostly 9.9E37, for an overload.
_OVERLOAD = 1e30
#: What cells that are not read may be.
_CAUSES = (
    (GROUPED.fullmatch, "Separators of thousands are not read."),
    (holds_unit, "Units stand in the cells; they are read in the head of the column alone."),
    (
        re.compile(r".+E[3-9]\d+").fullmatch,
        "Instruments write such a number for an overload; --missing 9.9E37 leaves that one out.",
    ),
    (UNIT.fullmatch, "Units change from row to row; one is read for the whole column."),
)
#: Units of an example, of columns that are no lengths.
_UNITS = {"u": "mV", "load": "N", "time": "s", "sigma": "Pa"}
#: Room beyond the rows that were counted.
_SPARE = 250

Column = str | int
"""The name or the number of a column."""

Lines = range | list[int] | NDArray[np.int32]
Parts = Iterator[tuple[Lines, list[FloatArray]]]
"""Lines and columns of one part after another."""


class Wanted(NamedTuple):
    """A column by its name or number, its unit, and words that stand for numbers in it."""

    column: Column
    unit: str | None = None
    dimension: str = "dimensionless"
    words: Mapping[str, float] = MappingProxyType({})


class NamedColumns:
    """Columns of numbers whose heads may state units; they are read once, part by part."""

    names: tuple[str, ...] = ()
    defaults: Mapping[str, str] = MappingProxyType({})
    """Columns that the file itself names for some arrays of a scan where none is asked for."""
    source: SourceFile | None = None
    notes: tuple[str, ...] = ()
    others = ""
    """Names of the columns that were not asked for; of a text those that vary in its first rows."""
    decimal: str | None = None
    #: What a row is called in messages, and what cuts a head into the name and its unit.
    _row = "row"
    _cut = staticmethod(cut_head)
    #: Whether a point in a number would be a separator of thousands.
    _comma_alone = False

    def __init__(self, name: str, missing: Sequence[str] = ()) -> None:
        self._name = name
        self._unit_row = tuple[str, ...]()
        # Why a head was not taken, and lines in which a head stands once more.
        self._unfit = ""
        self._again = set[int]()
        # Columns not asked for, in whose cells other words are no readings.
        self._others: list[Wanted] = []
        # Units that columns of units state in every row.
        self._stated: list[str] = []
        self._missing = {*MISSING, *(word.strip().lower() for word in missing)}
        self._sentinels = [number_of(w.replace(",", ".")) for w in missing if is_number(w)]
        # Cells that are no numbers, by column: how many, and the first of them with their lines.
        self._wrong: dict[Column, tuple[list[int], list[str]]] = {}
        # Lines of the rows, part by part.
        self._lines_of: list[Lines] = []

    def columns(self, wanted: Mapping[str, Wanted]) -> Arrays:
        """Read columns in SI units, NaN where a cell is empty; state source and notes."""
        items = [*wanted.values()]
        for item in items:  # a wrong unit is refused before the work
            to_si(0.0, item.unit, item.dimension, self.where(item.column))
        asked = [self.index_of(item.column) for item in items]
        self.others = ", ".join(n for i, n in enumerate(self.names) if i not in asked)
        # A scan has up to three arrays more than columns, and its file must be read again.
        most = min(MOST_ROWS, MOST_HDF5_BYTES // (8 * (len(wanted) + 3)))
        rows = self._count()
        if rows > most:
            cure = "Average neighbouring readings, or cut the table into several."
            of = f"{self._row}s of {len(wanted)} columns"
            raise too_large(self._name, rows, most, of, cure=cure)
        count = 0
        # Lines may have other ends than were counted; room that stays empty is no memory.
        values = [np.empty(2 * rows + _SPARE) for _ in wanted]
        parts = self._parts(items)
        for lines, part in Task("rows", rows).counted(parts, lambda part: len(part[0])):
            self._lines_of.append(lines)
            # Columns that were not asked for may follow: they were looked at.
            for item, column, numbers in zip(items, values, part, strict=False):
                if self._sentinels:
                    numbers = np.where(np.isin(numbers, self._sentinels), np.nan, numbers)
                for i in np.flatnonzero(np.abs(numbers) >= _OVERLOAD):
                    self._reject(f"{numbers[i]:g}".replace("e+", "E"), lines[i], item.column)
                column[count : count + len(lines)] = numbers
            count += len(lines)
        self._refuse_wrong(items)
        for item in items:
            self._refuse_other_unit(item)
        self._describe(count)
        return {
            name: to_si(values.pop(0)[:count], item.unit, item.dimension, self.where(item.column))
            for name, item in wanted.items()
        }

    def unit_of(
        self, column: Column, unit: str | None, option: str, default: str | None = None
    ) -> str:
        """Return the unit of a column: of its head, of the row of units, or the one given."""
        index = self.index_of(column)
        below = self._unit_row[index] if index < len(self._unit_row) else ""
        head = next((u for u in self._cut(self.names[index])[1:] if is_unit(u)), "")
        if below and head and not same_unit(below, head):
            problem = f"{self.where(column)} has the unit {head!r} in its head, and {below!r}."
            raise InputError(problem, why="One of them is wrong.", cure="Correct the table.")
        stated = below or head
        if unit and stated and not same_unit(unit, stated):
            raise InputError(
                f"{self.where(column)} states the unit {stated!r}, but {option} is {unit!r}.",
                why="One of them is wrong.",
                cure="Leave the option out to take the unit of the table, or correct the table.",
            )
        chosen = unit or stated or default
        if not chosen:
            example = f"{column}/{_UNITS.get(option.partition('_')[0], 'mm')}"
            cure = f"Give it in the head of the column, as in {example!r}, or as {option}. Where "
            cure += "it is not known: 1 of readings; of positions any, and calibrate with a source "
            cure += "(--reference point), so that all lengths are in it."
            raise InputError(f"{self.where(column)} states no unit that is known.", cure=cure)
        return chosen.strip()

    @property
    def heads(self) -> list[str]:
        """Names of the columns without units."""
        return [self._cut(name)[0] for name in self.names]

    def where(self, column: Column) -> str:
        """Return file and column as messages name them."""
        return f"{self._name}: column {column!r}"

    def lines(self, rows: Sequence[int]) -> str:
        """Name the lines of the file in which rows stand: the first five, and how many more."""
        return self._named(self.all_lines()[rows])

    def _named(self, lines: Lines) -> str:
        several = "s" if len(lines) > 1 else ""
        return f"{self._row}{several} {', '.join(map(str, lines[:_NAMED]))}{_more(lines)}"

    def all_lines(self) -> NDArray[Any]:
        """Return the line of the file of each row, (n,)."""
        return np.concatenate(self._lines_of)

    def index_of(self, column: Column) -> int:
        """Return the number of a column, from 0, that is given by its name, head or number."""
        if isinstance(column, str) and self.names.count(column) == 1:
            return self.names.index(column)
        heads = self.heads
        sought = str(column)
        if heads.count(sought) > 1:
            named = [n for n, head in zip(self.names, heads, strict=True) if head == sought]
            problem = f"{self._name} has several columns {column!r}: {', '.join(named)}."
            raise InputError(problem, cure="Give the number of the column, counted from 1.")
        if sought in heads:
            return heads.index(sought)
        counted = [str(i + 1) for i in range(len(heads))]
        # Where names number columns otherwise, a number that is no name does not count them.
        other = [head for head, i in zip(heads, counted, strict=True) if head != i]
        if sought not in counted or {"0", *counted}.intersection(other):
            raise InputError(
                f"{self._name} has no column {column!r}.",
                why=self._unfit or "Its columns are: " + ", ".join(self.names) + ".",
                cure="Give the name of one of its columns, or a number counted from 1 where no "
                "name is a number. If the columns of the table are others, state what separates "
                "its cells (--delimiter).",
            )
        return int(sought) - 1

    def _count(self) -> int:
        """Return how many rows there are, or may be."""
        raise NotImplementedError

    def _parts(self, wanted: list[Wanted]) -> Parts:
        """Yield the lines and the columns of one part after another."""
        raise NotImplementedError

    def _describe(self, count: int) -> None:
        """State source and notes when all is read."""

    def _numbers(self, cells: Sequence[str], lines: Lines, item: Wanted) -> FloatArray:
        """Return cells of a column as numbers; those that are none are kept for the message."""
        written = "".join(cells)
        texts = [cell.replace(",", ".") for cell in cells] if self.decimal == "," else cells
        if "_" not in written and not (self._comma_alone and "." in written):
            with suppress(ValueError):
                numbers = np.fromiter(map(float, texts), np.float64, len(cells))
                if not np.isinf(numbers).any():
                    return numbers
        pairs = zip(cells, lines, strict=True)
        return np.array([self._number(cell, line, item) for cell, line in pairs])

    def _number(self, cell: str, line: int, item: Wanted) -> float:
        cell = cell.strip()
        word = cell.lower()
        if word in item.words:
            return item.words[word]
        if word in self._missing:
            return np.nan
        text = cell.replace(",", ".") if self.decimal == "," else cell
        with suppress(ValueError):
            if not (self._comma_alone and "." in cell):
                return number_of(text)
        self._reject(cell, line, item.column)
        return np.nan

    def _is_watched(self, name: str, cells: Sequence[str]) -> bool:
        """Whether a column not asked for begins with numbers or a unit: no word may follow."""
        begun = [cell for cell in cells[: len(cells) // 2] if cell.lower() not in self._missing]
        units = {begun[0].lower(): 0.0} if begun and are_units(begun) else {}
        # A letter alone may be a flag, and a unit another column's.
        others = tuple(f"{other}_" for other in self.others.split(", "))
        if (units or "unit" in name.lower()) and not name.startswith(others):
            self._stated += filter(UNIT.fullmatch, begun[:1])
        numbers = [*itertools.dropwhile(lambda cell: not is_number(cell), begun)]
        # Words above whole numbers are a summary, as words below numbers are.
        usual = is_number if numbers == begun else str.isdigit
        if not units and not (numbers and all(map(usual, numbers))):
            return False
        self._others.append(Wanted(name, words=units))
        return True

    def _reject(self, cell: str, line: int, column: Column) -> None:
        lines, cells = self._wrong.setdefault(column, ([], []))
        lines.append(line)
        if cell in self.names:
            self._again.add(line)
        if len(cells) < _NAMED:
            cells.append(printable(cell, MAX_NAME))

    def _refuse_other_unit(self, item: Wanted) -> None:
        """Refuse a unit where a column of units of its kind states another."""
        where = self.where(item.column)
        unit = item.unit or "1"
        stated = [u for u in self._stated if reading_of(u, where).si == reading_of(unit, where).si]
        if stated and not any(same_unit(unit, one) for one in stated):
            raise InputError(
                f"{where} is in {unit}, but a column of units says {stated[0]}.",
                why="One of them is wrong.",
                cure="State the unit of the table, or leave its column of units out.",
            )

    def _refuse_wrong(self, wanted: list[Wanted]) -> None:
        if self._again:
            again = self._named(sorted(self._again))
            problem = f"{self._name}: the head of the table stands again in {again}."
            raise FormatError(
                problem, why="Another table begins there.", cure="Give each a file of its own."
            )
        for item in wanted + self._others:
            lines, cells = self._wrong.get(item.column, ([], []))
            # Others count where the table begins or ends in words, as a summary does, or a unit
            # changes.
            watched = item in self._others and not item.words
            if not lines or (watched and {*self.all_lines()[[0, -1]]}.isdisjoint(lines)):
                continue
            named = ", ".join(f"{i} ({cell!r})" for i, cell in zip(lines, cells, strict=False))
            why = next((text for test, text in _CAUSES if any(map(test, cells))), "")
            words = f", and none of {', '.join(item.words)}," if item.words else ""
            raise FormatError(
                f"{self.where(item.column)} holds what is not a number{words} in "
                f"{self._row} {named}{_more(lines)}.",
                why=why,
                cure="Correct or remove these lines; name a word that means a missing value "
                "(--missing WORD); state the decimal mark (--decimal); or state how many lines "
                "stand before the header (--skip-rows N).",
            )


def _more(lines: Lines) -> str:
    """Say how many lines there are beyond those that are named."""
    return f" and {len(lines) - _NAMED} more" if len(lines) > _NAMED else ""
