"""Tables of text, and what every result tabulates: quality checks and messages."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import zip_longest
from typing import Any, NamedTuple, TextIO

from memscal.model.checks import Message, QualityCheck
from memscal.model.notation import printable

_LONGEST = 100_000

_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


# How a character is written where the terminal's encoding lacks it.
_PLAIN = str.maketrans("×²Δ₀µ–", "x2d0u-") | str.maketrans(
    {"±": "+/-", "σ": "sigma", "χ": "chi", "ν": "nu", "μ": "mu", "…": "..."}
)


def readable(text: str, stream: TextIO | None = None) -> str:
    """Return text without control characters, in characters that the stream can encode."""
    text = printable(text, _LONGEST)
    encoding = getattr(sys.stdout if stream is None else stream, "encoding", None) or "utf-8"
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        # A terminal that shows ×10⁻⁷ as x10?? shows a wrong number.
        power = "×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)"
        text = re.sub(power, lambda match: "e" + match[1].translate(_SUPERSCRIPTS), text)
        text = text.translate(_PLAIN).encode(encoding, "replace").decode(encoding)
    return text


def finite(value: float | None) -> float | None:
    """Return a number that JSON can say, ``None`` (null) in place of any other."""
    return float(value) if value is not None and math.isfinite(value) else None


def percent(share: float) -> str:
    """Return a share in percent, with the space of ISO 80000: ``95 %``, ``1000 %``."""
    return f"{float(f'{100 * share:.3g}'):g} %"


def stated_text(value: object) -> str:
    """Return an option's value for reading: groups as "name: value", not as Python."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key}: {stated_text(item)}" for key, item in value.items()) or "none"
    if isinstance(value, list | tuple):
        return "; ".join(map(stated_text, value)) or "none"
    return "not given" if value is None else str(value)


def texts_of(messages: Iterable[Message]) -> list[str]:
    """Return messages as the JSON output holds them."""
    return [message.text for message in messages]


CHECKS = "Quality checks"
"""Title of the table of quality checks."""


def worst_checks(checks: Iterable[QualityCheck]) -> list[QualityCheck]:
    """Return what failed, and of checks that were made several times the closest to failing."""
    kinds: dict[str, list[QualityCheck]] = {}
    for check in checks:
        kinds.setdefault(check.kind, []).append(check)
    shown = []
    for kind, made in kinds.items():
        passed = [check for check in made if check.passed]
        shown += [check for check in made if not check.passed]
        if passed:
            worst = max(passed, key=lambda check: check.value / (check.limit or 1.0))
            name = f"{kind}, worst of {len(passed)}" if len(passed) > 1 else worst.name
            shown.append(replace(worst, name=name))
    return shown


def checks_table(checks: Sequence[QualityCheck], *, meanings: bool = False) -> Table:
    """Return quality checks with value, limit, p-value, and on request what each one means."""
    rows = [
        (
            check.name.replace("_", " "),
            f"{check.value:.3g}",
            "-" if math.isinf(check.limit) else f"{check.limit:.3g}",
            "" if check.p_value is None else f"{check.p_value:.2g}",
            "passed" if check.passed else "FAILED",
            *([check.meaning] if meanings else []),
        )
        for check in checks
    ]
    failed = frozenset(i for i, check in enumerate(checks) if not check.passed)
    head = ("check", "value", "limit", "p", "result", *(["meaning"] if meanings else []))
    return Table(CHECKS, head, rows, failed)


#: Kinds of failed checks that a sentence names.
_NAMED = 4


def verdict(checks: Sequence[QualityCheck]) -> str:
    """Return as a sentence how many checks passed, and the kinds of those that failed."""
    failed = [check.kind.replace("_", " ") for check in checks if not check.passed]
    if not failed:
        if len(checks) == 1:
            return "The check passed."
        return f"All {len(checks)} checks passed." if checks else ""
    kinds = [*dict.fromkeys(failed)]
    named = f"{', '.join(kinds[:_NAMED])}{', and others' if len(kinds) > _NAMED else ''}"
    return f"{len(failed)} of {len(checks)} checks FAILED: {named}."


def checks_json(checks: Sequence[QualityCheck]) -> list[dict[str, Any]]:
    """Return the entry ``checks`` of a command's JSON object."""
    return [
        {
            "name": check.name,
            "value": finite(check.value),
            "limit": finite(check.limit),
            "passed": check.passed,
            "p_value": finite(check.p_value),
        }
        for check in checks
    ]


#: Columns of text for which tables are made where no terminal says how many it has.
WIDTH = 80
_GAP = "  "
#: The characters of a cell that a page shows in one line: numbers with uncertainty and unit fit.
_ONE_LINE = 32
#: Prose is folded rather than widen its column beyond this.
_PROSE = 24
_LETTER = r"[^\W\d_⁰¹²³⁴⁵⁶⁷⁸⁹]"
#: Where a line may end: between words, not within a number, its uncertainty, unit or interval.
_BETWEEN_WORDS = re.compile(
    rf"(?<={_LETTER}) (?![±%=<>\[×/])|(?<={_LETTER}[,;:.)]) |(?<=[,;:.]) (?!inf)(?={_LETTER})"
)


def folded(text: str, width: int) -> list[str]:
    """Return lines of text of a width, or longer where a number or a path is."""
    lines = []
    for paragraph in text.split("\n"):
        line, *chunks = _BETWEEN_WORDS.split(paragraph)
        for chunk in chunks:
            if len(line) + 1 + len(chunk) > width:
                lines.append(line)
                line = chunk
            else:
                line += f" {chunk}"
        lines.append(line)
    return lines


_Style = Callable[[str, bool], str]
"""What makes a line bold, or bold and red where it tells of a failure."""


def as_it_is(text: str, _: bool) -> str:
    """Return text without a style."""
    return text


def text_of(
    answer: str, tables: Iterable[Table], width: int = WIDTH, style: _Style = as_it_is
) -> str:
    """Return an answer, if there is one, and the tables that have rows."""
    lines = folded(readable(answer), width) if answer else []
    blocks = [table.plain(width, style) for table in tables if table.rows]
    head = ["\n".join(style(line, False) for line in lines)] if lines else []
    return "\n\n".join([*head, *blocks])


def table_of(differences: Iterable[Sequence[str]]) -> str:
    """Return what each two places state of quantities, places first, as aligned lines."""
    rows: list[Sequence[str]] = []
    for here, there, *stated in differences:
        head = ["quantity", here, there]
        if head not in rows:
            rows.append(head)
        rows.append(stated)
    return Table("", [""] * 3, rows).plain()


@dataclass(frozen=True)
class Table:
    """A table of text: its title, names of the columns (or none), cells, and rows that failed.

    ``labels``: how many columns at the left say what a row is about.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    marked: frozenset[int] = frozenset()
    labels: int = 1

    def plain(self, width: int = WIDTH, style: _Style = as_it_is) -> str:
        """Return aligned text; columns that have no room follow below, beside the same labels."""
        columns = [_column(texts) for texts in zip(self.head, *self.rows, strict=True)]
        title = [style(line, False) for line in folded(readable(self.title), width)]
        blocks = []
        for part in _parts(columns, self.labels, width):
            lines = self._part(part, _widths(part, width), style)
            blocks.append("\n".join([*title, *lines]))
            title = []
        return "\n\n".join(blocks)

    def _part(
        self, columns: Sequence[_Column], widths: Sequence[int], style: _Style
    ) -> Iterator[str]:
        """Yield the lines of columns, each with its width."""
        cells = []
        for column, width in zip(columns, widths, strict=True):
            cells.append([folded(cell, width) for cell in column.cells])
        for i, row in enumerate(zip(*cells, strict=True)):
            deepest = max(map(len, row))
            if i == 0:  # the names stand upon the rule
                row = tuple([""] * (deepest - len(cell)) + cell for cell in row)
            for line in zip_longest(*row, fillvalue=""):
                padded = (f"{c:<{w}}" for c, w in zip(line, widths, strict=True))
                text = _GAP + _GAP.join(padded).rstrip()
                if i or any(self.head):
                    yield style(text, True) if i - 1 in self.marked else text
            if i == 0 and any(self.head):
                yield _GAP + _GAP.join("-" * width for width in widths)

    def html(self, kind: str = "") -> str:
        """Return the table as HTML of a class, each row headed by its first text, marks in bold."""
        lines = [f'<table class="{kind}">' if kind else "<table>"]
        if self.title:
            lines.append(f"<caption>{_cell(self.title)}</caption>")
        if any(self.head):
            heads = (f'<th scope="col">{_cell(c)}</th>' if c else "<td></td>" for c in self.head)
            lines.append(f"<thead><tr>{''.join(heads)}</tr></thead>")
        lines.append("<tbody>")
        for i, row in enumerate(self.rows):
            mark = ' class="failed" style="font-weight: bold"' if i in self.marked else ""
            heading = next((k for k, cell in enumerate(row) if cell), None)
            cells = ""
            for k, cell in enumerate(row):
                tag = 'th scope="row"' if k == heading else "td"
                long = ' class="long"' if len(cell) > _ONE_LINE else ""
                cells += f"<{tag}{long}>{_cell(cell)}</{tag[:2]}>"
            lines.append(f"<tr{mark}>{cells}</tr>")
        return "\n".join([*lines, "</tbody>\n</table>"])


def _cell(text: str) -> str:
    return escape(printable(text, _LONGEST))


class _Column(NamedTuple):
    """Cells of a column, and its width: with every break there may be, folded, unfolded."""

    cells: Sequence[str]
    tight: int
    folded: int
    longest: int


def _column(texts: Sequence[str]) -> _Column:
    cells = [readable(text).replace("\n", " ") for text in texts]
    chunks = [max(map(len, _BETWEEN_WORDS.split(cell))) for cell in cells]
    tight = max(chunks)
    prose = min(_PROSE, max(map(len, cells[1:]), default=0))
    return _Column(cells, tight, max(tight, prose), max(map(len, cells)))


def _parts(columns: Sequence[_Column], labels: int, width: int) -> Iterator[Sequence[_Column]]:
    """Divide columns among tables of a width, each of which begins with the labels."""
    part = [*columns[:labels]]
    for column in columns[labels:]:
        needed = _total([other.folded for other in (*part, column)])
        if len(part) > labels and needed > width:
            yield part
            part = [*columns[:labels]]
        part.append(column)
    yield part


def _widths(part: Sequence[_Column], width: int) -> list[int]:
    """Return widths of columns that use the room there is, labels first."""
    widths = [column.folded for column in part]
    if _total(widths) > width:
        widths = [column.tight for column in part]
    room = width - _total(widths)
    missing = [column.longest - least for column, least in zip(part, widths, strict=True)]
    for i in sorted(range(len(part)), key=lambda i: (i > 0, missing[i])):
        more = max(min(missing[i], room), 0)
        widths[i] += more
        room -= more
    return widths


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + len(_GAP) * len(widths)
