"""Words and tables for people."""

import io
import sys
import time

import pytest

from memscal.cli.output import emit_tables, working
from memscal.summaries.table import Table


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


TABLE = Table(
    "Quality checks", ("check", "result"), [("drift", "passed"), ("[bold]symmetry", "FAILED")],
    frozenset({1}),
)  # fmt: skip


def test_a_plain_table_is_aligned(capsys: pytest.CaptureFixture[str]):
    emit_tables(TABLE, Table("empty", ("a",), []))
    assert capsys.readouterr().out == (
        "Quality checks\n"
        "  check           result\n"
        "  --------------  ------\n"
        "  drift           passed\n"
        "  [bold]symmetry  FAILED\n"
    )


def test_a_terminal_gets_a_drawn_table_with_cells_as_text(monkeypatch: pytest.MonkeyPatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.delenv("NO_COLOR", raising=False)
    emit_tables(TABLE)
    shown = terminal.getvalue()
    assert "[bold]symmetry" in shown
    assert "\x1b[1;31m" in shown
    assert "─" in shown


def test_progress_of_long_work_leaves_no_trace(monkeypatch: pytest.MonkeyPatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr("memscal.cli.output._FIRST_AFTER", 0.0)
    with working("Sweeping"):
        while "Sweeping" not in terminal.getvalue():
            time.sleep(0.001)
    assert terminal.getvalue().endswith("\r\x1b[K")


def test_progress_is_silent_where_nobody_watches(capsys: pytest.CaptureFixture[str]):
    with working("Sweeping"):
        pass
    assert capsys.readouterr().err == ""
