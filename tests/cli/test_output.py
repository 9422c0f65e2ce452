"""Words and tables for people, on a terminal and elsewhere."""

import io
import re
import sys
import time

import pytest

from memscal.cli.output import emit_tables, working
from memscal.progress import Task
from memscal.summaries.table import Table


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    encoding = "utf-8"

    def isatty(self):
        return True


TABLE = Table(
    "Quality checks",
    ("check", "result"),
    [("drift", "passed"), ("[bold]symmetry", "FAILED")],
    frozenset({1}),
)
PLAIN = (
    "Quality checks\n"
    "  check           result\n"
    "  --------------  ------\n"
    "  drift           passed\n"
    "  [bold]symmetry  FAILED\n"
)


def at_terminal(monkeypatch):
    """Have both streams go to a terminal of 80 columns."""
    both = Terminal()
    monkeypatch.setattr(sys, "stdout", both)
    monkeypatch.setattr(sys, "stderr", both)
    for name, value in (("TERM", "xterm-256color"), ("COLUMNS", "80"), ("NO_COLOR", "")):
        monkeypatch.setenv(name, value)
    return both


def test_a_terminal_gets_bold_titles_and_failures_in_red(monkeypatch):
    terminal = at_terminal(monkeypatch)
    emit_tables(TABLE)
    title, *_, failed = terminal.getvalue().splitlines()
    assert title == "\x1b[1mQuality checks\x1b[0m"
    assert failed == "\x1b[31m\x1b[1m  [bold]symmetry  FAILED\x1b[0m"
    assert re.sub(r"\x1b\[\d+m", "", terminal.getvalue()) == PLAIN


@pytest.mark.parametrize("name", ["NO_COLOR", "TERM"])
def test_without_colour_nothing_is_bold(monkeypatch, name):
    terminal = at_terminal(monkeypatch)
    monkeypatch.setenv(name, "dumb")
    emit_tables(TABLE)
    assert terminal.getvalue() == PLAIN


WIDE = Table(
    "A title of many words that says what all of the numbers in the table below it are about",
    ("", "state", *(f"quantity {i} (kPa)" for i in range(9))),
    [(str(row), "dry", *(f"(26.14 ± 0.{row}{i})×10⁻⁵ mV/Pa" for i in range(9))) for row in (1, 2)],
    labels=2,
)


@pytest.mark.parametrize("width", [40, 60, 80, 120])
def test_columns_wrap_beside_their_labels_and_none_is_lost(width):
    lines = WIDE.plain(width).splitlines()
    assert max(map(len, lines)) <= width
    for row in (1, 2):
        parts = [line for line in lines if line.startswith(f"  {row}  dry  ")]
        assert "".join(parts).count("±") == 9
        assert re.findall(r"± (0\.\d\d)\)×10⁻⁵ mV/Pa", "".join(parts)) == [
            f"0.{row}{i}" for i in range(9)
        ]
    assert len(parts) == {40: 9, 60: 9, 80: 5, 120: 3}[width]


def wait_for(shown, pattern):
    """Wait for what another thread writes; on a busy machine it may come late."""
    start = time.monotonic()
    while not re.search(pattern, shown()):
        assert time.monotonic() - start < 300
        time.sleep(0.001)


def test_progress_is_counted_on_a_terminal_and_leaves_no_trace(monkeypatch):
    terminal = at_terminal(monkeypatch)
    monkeypatch.setattr("memscal.cli.output._ON_TERMINAL", (0.0, 0.001))
    with working("Drawing"):
        for item in Task("draws", 5).counted(range(5)):
            if item == 1:
                wait_for(terminal.getvalue, r"Drawing: 2 of 5 draws, \d+ s left \(\d+ s\)")
    assert terminal.getvalue().endswith("\r\x1b[K")


def test_progress_is_a_line_now_and_then_where_nobody_watches(monkeypatch):
    monkeypatch.setattr(sys, "stderr", written := io.StringIO())
    with working("Sweeping"):
        pass
    assert written.getvalue() == ""
    monkeypatch.setattr("memscal.cli.output._IN_LINES", (0.01, 0.01))
    with working("Sweeping"):
        for item in Task("draws", 3).counted(range(3)):
            if item == 0:
                wait_for(written.getvalue, r"Sweeping: 1 of 3 draws, \d+ s left \(\d+ s\)\n")
    assert re.fullmatch(r"(Sweeping(: [123] of 3 draws[^\r\n]*)? \(\d+ s\)\n)+", written.getvalue())
