"""Tables of text, and what every result tabulates: quality checks and messages."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import Any, TextIO

from memscal.model.checks import Message, QualityCheck
from memscal.model.notation import printable

_LONGEST = 100_000

_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


# How a character is written where the terminal's encoding lacks it.
_PLAIN = dict(zip("×²Δ₀µ–", "x2d0u-", strict=True)) | {
    "±": "+/-", "σ": "sigma", "χ": "chi", "ν": "nu", "…": "..."
}  # fmt: skip


def readable(text: str, stream: TextIO | None = None) -> str:
    """Return text without control characters, in characters that the stream can encode."""
    text = printable(text, _LONGEST)
    encoding = getattr(sys.stdout if stream is None else stream, "encoding", None) or "utf-8"
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        # A terminal that shows ×10⁻⁷ as x10?? shows a wrong number.
        power = re.compile("×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
        text = power.sub(lambda match: "e" + match[1].translate(_SUPERSCRIPTS), text)
        text = "".join(_PLAIN.get(c, c) for c in text)
        text = text.encode(encoding, "replace").decode(encoding)
    return text


def finite(value: float | None) -> float | None:
    """Return a number that JSON can say, ``None`` (null) in place of any other."""
    return float(value) if value is not None and math.isfinite(value) else None


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
    shown: list[QualityCheck] = []
    for kind, of_kind in kinds.items():
        passed = [check for check in of_kind if check.passed]
        shown += [check for check in of_kind if not check.passed]
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


_GAP = "  "
#: The characters of a cell that a page shows in one line: numbers with uncertainty and unit fit.
_ONE_LINE = 32


@dataclass(frozen=True)
class Table:
    """A table of text: its title, names of the columns (or none), cells, and rows that failed."""

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
        """Return the table as HTML, each row headed by its first text, marked rows in bold."""
        lines = [f"<table>\n<caption>{_cell(self.title)}</caption>"]
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
