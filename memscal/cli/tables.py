"""Tables for people: drawn by rich on a terminal, plain aligned text anywhere else."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from memscal.cli.output import emit, readable

__all__ = ["Table", "emit_tables"]

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


def emit_tables(*tables: Table) -> None:
    """Print tables that have rows, with an empty line between them."""
    filled = [table for table in tables if table.rows]
    if sys.stdout is not None and sys.stdout.isatty():
        emit(_drawn(filled))
    else:
        emit("\n\n".join(table.plain() for table in filled))


def _drawn(tables: Sequence[Table]) -> str:
    from rich import box
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    console = Console(highlight=False)
    blocks = []
    for table in tables:
        drawn = RichTable(
            box=box.SIMPLE_HEAD if any(table.head) else None,
            show_header=any(table.head),
            padding=(0, 1),
        )
        for name in table.head:
            # A narrow terminal breaks names between words, not within.
            longest = max((len(word) for word in name.split()), default=0)
            drawn.add_column(Text(readable(name)), overflow="fold", min_width=longest)
        for k, row in enumerate(table.rows):
            # Text, not markup: a cell may hold what stood in a file.
            cells = (Text(readable(cell)) for cell in row)
            drawn.add_row(*cells, style="bold red" if k in table.marked else "")
        with console.capture() as capture:
            console.print(Text(readable(table.title)), style="bold")
            console.print(drawn)
        blocks.append("\n".join(line for line in capture.get().splitlines() if line.strip()))
    return "\n\n".join(blocks)
