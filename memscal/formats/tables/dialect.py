"""The dialect of a table of text: what parts its cells, its decimal mark, head and first row."""

import itertools
import re
from collections.abc import Sequence, Set

from memscal.errors import FormatError
from memscal.formats.units import is_common_unit, is_unit

DELIMITERS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eEdD][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
#: A number with a separator of thousands, such as -4.000,0.
GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[.,' ][0-9]{3})+(?:[.,][0-9]+)?")
#: A name and its unit: x (mm) or x [mm], and x/mm.
_HEADS = (re.compile(r"(.+?)[\s/]*[(\[]([^()\[\]]+)[)\]]"), re.compile(r"([^/]+?)\s*/(.+)"))
#: Cells that mean a missing value, in capital or small letters.
MISSING = ("", "-", "nan", "na", "n/a", "#n/a", "<na>", "nat", "null", "none")
#: Rows that tell which columns hold numbers: the last ones, for a preamble stands above them.
_LAST = 50

Rows = list[list[str]]


def number_of(text: str) -> float:
    """Return a number; D as in Fortran begins its power of ten, too."""
    return float(text.replace("D", "E").replace("d", "e"))


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


def first_of_numbers(rows: Rows, missing: Set[str]) -> int | None:
    """Return the first row of a table, below preamble, header and units; none without numbers."""
    counts = [sum(map(is_number, row)) for row in rows]
    most = min(2, max(counts, default=0))
    if not most:
        return None
    dense = [row for row, count in zip(rows, counts, strict=True) if count >= most]
    numeric = []
    for i, column in enumerate(itertools.zip_longest(*dense[-_LAST:], fillvalue="")):
        stated = [is_number(cell) for cell in column if cell.lower() not in missing]
        if 2 * sum(stated) >= len(stated) > 0:
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


def find_delimiter(lines: list[str]) -> str:
    """Take the delimiter that cuts the most lines into equally many pieces, of numbers."""
    best = " "
    highest = 0.0
    for delimiter in DELIMITERS:
        rows = [line.split(None if delimiter == " " else delimiter) for line in lines[-_LAST:]]
        widths = [len(row) for row in rows]
        common = max(set(widths), key=widths.count)
        cells = itertools.chain(*(row for row in rows if len(row) == common))
        numbers = sum(is_number(cell.strip(' "')) for cell in cells)
        equal = widths.count(common)
        score = equal * (0.1 + numbers / (common * equal))
        if common > 1 and score > highest:
            best = delimiter
            highest = score
    return best


def find_decimal(rows: Rows, delimiter: str = "") -> str:
    """A comma is the decimal mark only where cells hold one comma each and no point."""
    if delimiter == ",":
        return "."
    some = rows[:200]
    cells = [cell for cell in itertools.chain(*some) if is_number(cell)]
    if not any("," in c for c in cells) or any("." in c for c in cells):
        return "."
    for column in itertools.zip_longest(*some, fillvalue=""):
        commas = [c for c in column if "," in c and is_number(c)]
        bare = [c for c in column if "," not in c and is_number(c)]
        if commas and bare and all(map(_THOUSANDS.fullmatch, commas)):
            raise FormatError(
                f"The commas of {commas[0]!r} may separate thousands: {bare[0]!r} in the same "
                "column has none.",
                why="Separators of thousands are not read.",
                cure="Take them out, or state that commas are decimal (--decimal ,).",
            )
    return ","
