"""The dialect of a table of text: what parts its cells, its decimal mark, head and first row."""

import math
import re
from collections.abc import Sequence, Set
from itertools import chain, zip_longest

from memscal.errors import FormatError
from memscal.formats.units import is_common_unit, is_unit

DELIMITERS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
#: D begins a power of ten, as in Fortran, where a sign or a decimal mark tells it from a name, 1D5.
NUMBER = re.compile(
    r"[+-]?(?:(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+|[dD][+-]\d+)?|\d*[.,]\d*[dD]\d+)"
)
_MEASURED = re.compile(rf"{NUMBER.pattern}\s*([^\d\s].*)")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
#: A number with a separator of thousands, such as -4.000,0.
GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.,' ][0-9]{3})+(?:[.,][0-9]+)?")
UNIT = re.compile(r"[fpnuµμmkMG]?(?:V|A|T|Pa|N)|[nuµμmc]?m")
#: A name and its unit: x (mm) or x [mm], and x/mm; x_mm, x in mm, where the unit is no letter.
_HEADS = (
    re.compile(r"(.+?)[\s/]*[(\[]([^()\[\]]+)[)\]]"),
    re.compile(r"([^/]+?)\s*/(.+)"),
    re.compile(rf"(.+?)(?:\s+in)?[\s_:,]+(?=..)({UNIT.pattern})"),
)
#: A word between blanks; one that is a name has the unit in brackets that follows it.
_WORD = re.compile(r"[^\W\d]\S*\s+(?:\([^()]*\)|\[[^\[\]]*\])|\S+")
_REMARK = re.compile(r"comment|remark|note|bemerk|kommentar", re.IGNORECASE)
#: Cells that mean a missing value, in capital or small letters.
MISSING = ("", "-", "nan", "na", "n/a", "#n/a", "<na>", "nat", "null", "none")
#: Rows that tell which columns hold numbers: the last ones, for a preamble stands above them.
_LAST = 50

Rows = list[list[str]]


def number_of(text: str) -> float:
    """Return a number, or NaN; Python's ``1_0`` and ``inf`` are none."""
    number = float(text.replace("D", "E").replace("d", "e"))
    if not is_number(text) and not math.isnan(number):
        raise ValueError(text)
    return number


def holds_unit(cell: str) -> bool:
    """Whether a cell is a number and its unit, such as -6 mm."""
    match = _MEASURED.fullmatch(cell)
    return match is not None and is_unit(match[1])


def are_units(cells: Sequence[str]) -> bool:
    """Whether all cells are units of readings, and one has a prefix: letters alone may be flags."""
    return all(map(UNIT.fullmatch, cells)) and max(map(len, cells)) > 1


def words_of(line: str) -> list[str]:
    """Cut a line at its blanks, but not between a name and its unit in brackets."""
    return _WORD.findall(line) if "(" in line or "[" in line else line.split()


def cut_head(name: str) -> tuple[str, ...]:
    """Return the name of a column and, if there is one, its unit."""
    for head in _HEADS:
        match = head.fullmatch(name)
        if match:
            return match.groups()
    return (name,)


def filled(cells: Sequence[str]) -> int:
    """Return how many cells are not empty."""
    return sum(map(bool, cells))


def last_name(heads: Sequence[str]) -> int:
    """Return the number of the last column with a name; rows may lack one for remarks."""
    stated = [i for i, head in enumerate(heads, 1) if head and not _REMARK.match(head)]
    return max(stated, default=0)


def units_in(cells: Sequence[str]) -> tuple[str, ...]:
    """Return the units in a row that holds units alone, "" where a cell is none."""
    bare = [cell.strip("()[]- ") for cell in cells]
    if not any(map(is_common_unit, bare)):
        return ()
    units = tuple(text if text and is_unit(text) else "" for text in bare)
    return units if 2 * filled(units) >= filled(bare) else ()


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma."""
    return NUMBER.fullmatch(cell) is not None


def first_of_numbers(rows: Rows, missing: Set[str]) -> int:
    """Return the first row of a table, below preamble, header and units, or how many there are."""
    counts = [sum(map(is_number, row)) for row in rows]
    most = min(2, max(counts, default=0))
    if not most:
        return len(rows)
    dense = [row for row, count in zip(rows, counts, strict=True) if count >= most]
    numeric = []
    for i, column in enumerate(zip_longest(*dense[-_LAST:], fillvalue="")):
        words = sum(not is_number(cell) and cell.lower() not in missing for cell in column)
        if 2 * words <= len(column):  # an empty column holds no words, either
            numeric.append(i)
    good = []
    some = []
    for row in rows:
        cells = [row[i] for i in numeric if i < len(row)]
        some.append(any(map(is_number, cells)))
        whole = all(is_number(cell) or cell.lower() in missing for cell in cells)
        good.append(some[-1] and whole)
    start = good.index(True) if any(good) else some.index(True)
    while start and some[start - 1]:  # a row with a wrong cell, which is refused later
        start -= 1
    return start


def _several_numbers(cell: str) -> bool:
    return sum(map(is_number, cell.split())) > 1


def find_delimiter(lines: list[str]) -> str:
    """Take the delimiter that cuts the most lines into equally many pieces, of numbers."""
    best = " "
    highest = 0.0
    last = lines[-_LAST:]
    by_tabs = [line.split("\t") for line in last[len(last) // 2 :]]
    count = {len(row) for row in by_tabs}
    # Blanks would close up a column that is empty, or cut a text.
    tabs = len(count) == 1 < max(count) and not any(map(_several_numbers, chain(*by_tabs)))
    for delimiter in DELIMITERS:
        if delimiter == " " and tabs:
            break
        rows = [line.split(None if delimiter == " " else delimiter) for line in last]
        widths = [len(row) for row in rows]
        common = max(set(widths), key=widths.count)
        whole = chain(*(row for row in rows if len(row) == common))
        stated = [cell.strip(' "') for cell in whole if cell.strip()]
        tests = (is_number(c) or c.lower() in MISSING or holds_unit(c) for c in stated)
        numbers = sum(tests) - sum(map(_several_numbers, stated))
        score = widths.count(common) * (0.1 + numbers / max(len(stated), 1))
        if common > 1 and score > highest:
            best = delimiter
            highest = score
    return best


def find_decimal(rows: Rows, marks: str) -> str:
    """Return the decimal mark of rows; of these marks one is refused that may part thousands.

    A comma is it only where cells hold one comma each and no point.
    """
    by_column = zip_longest(*rows[:200], fillvalue="")
    columns = [[cell for cell in column if is_number(cell)] for column in by_column]
    columns = [column for column in columns if column]
    written = "".join(chain(*columns))
    mark = "," if "," in written and "." not in written else "."
    if mark not in marks:
        return "."
    shown = [column for column in columns if any(mark in cell for cell in column)]
    doubtful = []
    mixed = False
    for column in shown:
        marked = [cell for cell in column if mark in cell]
        if all(map(_THOUSANDS.fullmatch, marked)):
            doubtful.append(marked[0])
            # Of points some of 100 to 999 tell it, too: 1 and 1.125 are often written so.
            bare = {*column}.difference(marked)
            mixed |= any(mark == "," or len(cell.strip("+-")) == 3 for cell in bare)
    alone = len(doubtful) == len(shown) < len(columns) and (mark == "," or len(shown) == 1)
    if mixed or alone:
        raise FormatError(
            f"{doubtful[0]!r} has a decimal mark, or its {mark!r} may separate thousands.",
            why="Separators of thousands are not read.",
            cure=f"State that the mark is decimal (--decimal {mark}), or take the separators out.",
        )
    return mark
