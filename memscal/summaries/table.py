"""Tables of text, and what every result tabulates: quality checks and messages."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, TextIO

from memscal.model.checks import Message, QualityCheck
from memscal.model.notation import printable

__all__ = ["Table", "checks_json", "checks_table", "finite", "readable", "texts_of"]

_LONGEST = 100_000


_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


# How a character is written where the terminal's encoding lacks it.
_PLAIN = {
    "±": "+/-",
    "×": "x",
    "σ": "sigma",
    "χ": "chi",
    "²": "2",
    "ν": "nu",
    "Δ": "d",
    "₀": "0",
    "µ": "u",
    "–": "-",
    "…": "...",
}


def readable(text: str, stream: TextIO | None = None) -> str:
    """Return text without control characters, in characters that the stream can encode.

    A power of ten is spelt out: a terminal that shows ``×10⁻⁷`` as ``x10??`` shows a wrong
    number.
    """
    text = printable(text, _LONGEST)
    encoding = getattr(sys.stdout if stream is None else stream, "encoding", None) or "utf-8"
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        power = re.compile("×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
        text = power.sub(lambda found: "e" + found[1].translate(_SUPERSCRIPTS), text)
        text = "".join(_PLAIN.get(c, c) for c in text)
        text = text.encode(encoding, "replace").decode(encoding)
    return text


def finite(value: float | None) -> float | None:
    """Return a number that JSON can say, ``None`` (null) in place of any other.

    Examples
    --------
    >>> finite(2.5), finite(float("inf")), finite(None)
    (2.5, None, None)
    """
    return float(value) if value is not None and math.isfinite(value) else None


def texts_of(messages: Iterable[Message]) -> list[str]:
    """Return messages as the JSON output holds them."""
    return [each.text for each in messages]


def checks_table(checks: Sequence[QualityCheck]) -> Table:
    """Return quality checks with value and limit, and the chance of such a value where known."""
    rows = [
        (
            check.name.replace("_", " "),
            f"{check.value:.3g}",
            f"{check.limit:.3g}",
            "" if check.p_value is None else f"{check.p_value:.2g}",
            "passed" if check.passed else "FAILED",
        )
        for check in checks
    ]
    failed = frozenset(i for i, check in enumerate(checks) if not check.passed)
    return Table("Quality checks", ("check", "value", "limit", "p", "result"), rows, failed)


def checks_json(checks: Sequence[QualityCheck]) -> list[dict[str, Any]]:
    """Return the entry ``checks`` of a command's JSON object."""
    return [
        {
            "name": check.name,
            "value": finite(check.value),
            "limit": finite(check.limit),
            "passed": check.passed,
            "p_value": None if check.p_value is None else finite(check.p_value),
        }
        for check in checks
    ]


_GAP = "  "


@dataclass(frozen=True)
class Table:
    """A table of text.

    Parameters
    ----------
    title : str
        What it shows.
    head : sequence of str
        Names of the columns.
    rows : sequence of sequence of str
        Cells.
    marked : collection of int
        Rows that stand for a failure.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    marked: frozenset[int] = frozenset()

    def plain(self) -> str:
        """Return the table as aligned text, the last column unpadded."""
        rows = [[readable(cell).replace("\n", " ") for cell in row] for row in self.rows]
        head = [readable(cell) for cell in self.head]
        columns = list(zip(*([head] if any(head) else []), *rows, strict=True))
        widths = [max(len(cell) for cell in column) for column in columns]
        shown = [head, ["-" * width for width in widths]] if any(head) else []
        lines = [
            _GAP + _GAP.join(f"{c:<{w}}" for c, w in zip(row, widths, strict=True)).rstrip()
            for row in [*shown, *rows]
        ]
        return "\n".join([readable(self.title), *lines])

    def html(self) -> str:
        """Return the table as HTML, marked rows in bold."""
        head = "".join(f"<th>{escape(readable(cell))}</th>" for cell in self.head)
        rows = []
        for number, row in enumerate(self.rows):
            cells = "".join(f"<td>{escape(readable(cell))}</td>" for cell in row)
            style = ' style="font-weight: bold"' if number in self.marked else ""
            rows.append(f"<tr{style}>{cells}</tr>")
        shown = f"<thead><tr>{head}</tr></thead>" if any(self.head) else ""
        return (
            f"<table><caption>{escape(readable(self.title))}</caption>"
            f"{shown}<tbody>{''.join(rows)}</tbody></table>"
        )
