"""Output of a command: tables and JSON on standard output, messages on standard error, files."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from memscal.errors import OutputError
from memscal.formats.files import atomic_write_bytes, ensure_writable, together
from memscal.model.checks import Message
from memscal.summaries.table import Table, readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def emit(text: str) -> None:
    """Print results; a reader that goes away (``| head``) is no failure."""
    if sys.stdout is None:
        return
    try:
        _write_all(sys.stdout, text + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_stdout()
    except OSError as failure:
        raise unprinted(failure) from failure


def unprinted(failure: OSError) -> OutputError:
    """Return the error for results that standard output does not take."""
    _discard_stdout()
    problem = f"The results cannot be printed: {failure.strerror}."
    cure = "Free some space, or send standard output elsewhere."
    return OutputError(problem, why="They go to standard output.", cure=cure)


def _write_all(stream: TextIO, text: str) -> None:
    """Write to the last byte: an unbuffered stream may take fewer without an error."""
    buffer = getattr(stream, "buffer", None)
    if buffer is None:
        stream.write(text)
        return
    stream.flush()
    remaining = memoryview(text.encode(stream.encoding, stream.errors or "strict"))
    while remaining:
        remaining = remaining[buffer.write(remaining) :]


def _discard_stdout() -> None:
    """Send what is still buffered nowhere, or Python would fail on it once more at its end."""
    devnull = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(devnull, sys.stdout.fileno())
    finally:
        os.close(devnull)


def emit_json(value: Mapping[str, Any]) -> None:
    """Print one object of standard JSON; numbers that are not finite are refused."""
    emit(json.dumps(value, indent=2, allow_nan=False))


def message(text: str) -> None:
    """Write a message to standard error."""
    _to_stderr([text])


def note(text: str) -> None:
    """Write a note, which helps to judge the result."""
    _to_stderr([f"Note: {text}"])


def warn(text: str) -> None:
    """Write a warning, which puts the result in doubt."""
    _to_stderr([f"Warning: {text}"])


def show_messages(messages: Iterable[Message]) -> None:
    """Write the messages of a result to standard error, each as a note or a warning."""
    for item in messages:
        (warn if item.severity == "warning" else note)(item.text)


def error(problem: str, why: str = "", cure: str = "") -> None:
    """Write an error: what is wrong, why that stops the work, and what to do."""
    _to_stderr([f"Error: {problem}", *(f"  {text}" for text in (why, cure) if text)])


def _to_stderr(lines: Sequence[str]) -> None:
    width = min(100, max(40, shutil.get_terminal_size().columns))
    for line in lines:
        text = readable(line, sys.stderr)
        if sys.stderr is not None and sys.stderr.isatty():
            indent = "  " if text.startswith("  ") else ""
            text = click.wrap_text(text.strip(), width, indent, "  ")
        try:
            click.echo(text, err=True)
        except OSError:  # standard error is closed
            return


_FIRST_AFTER = 0.7
_EVERY = 0.2
_CLEAR = "\r\x1b[K"


@contextmanager
def working(task: str) -> Iterator[Callable[[str], None]]:
    """Show a task on a terminal, if it takes long; yield what replaces its text."""
    shown = [task]
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda _: None
        return
    from threading import Event, Thread
    from time import monotonic

    done, stream, start = Event(), sys.stderr, monotonic()

    def show() -> None:
        if done.wait(_FIRST_AFTER):
            return
        with suppress(OSError, ValueError):
            while True:
                stream.write(f"{_CLEAR}{shown[0]} ... {monotonic() - start:.0f} s")
                stream.flush()
                if done.wait(_EVERY):
                    break
            stream.write(_CLEAR)
            stream.flush()

    thread = Thread(target=show, daemon=True)
    thread.start()
    try:
        yield lambda text: shown.__setitem__(0, text)
    finally:
        done.set()
        thread.join()


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


FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
"""Those of ``memscal.figures.style``, which would import matplotlib; a test compares them."""

_HDF5_SUFFIXES = (".h5", ".hdf5", ".hdf", ".nxs", ".nx5")


class FigurePath(click.Path):
    """The name of a figure's file, or of another of which the suffix chooses the format."""

    name = "figure"

    def __init__(self, suffixes: Sequence[str] = FIGURE_SUFFIXES) -> None:
        super().__init__()
        self.suffixes = suffixes

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """Refuse a suffix in which nothing can be written."""
        path = Path(str(value))
        if path.suffix.lower() not in self.suffixes:
            self.fail(
                f"{str(path)!r} does not end in {', '.join(self.suffixes)}: the suffix chooses "
                "the format.",
                param,
                ctx,
            )
        return path


def beside(path: Path, suffix: str) -> Path:
    """Return the name of a result beside its input."""
    stem = path.stem if path.suffix.lower() in _HDF5_SUFFIXES else path.name
    return path.parent / f"{stem}{suffix}"


def prove_writable(outputs: Sequence[Path], *, force: bool, inputs: Sequence[Path] = ()) -> None:
    """Refuse outputs that share a name, and prove that each can be written."""
    seen: dict[Path, Path] = {}
    for output in outputs:
        real = Path(os.path.realpath(output))
        if real in seen:
            raise click.UsageError(
                f"Two outputs have the same name: {seen[real]} and {output}. Give each its own."
            )
        seen[real] = output
    for output in outputs:
        ensure_writable(output, overwrite=force, inputs=inputs)


def rendered(draw: Callable[[], Figure], paths: Sequence[Path]) -> dict[Path, bytes]:
    """Return a figure as the bytes of files; without files it is not drawn."""
    if not paths:
        return {}
    from memscal.figures.style import figure_format, render_figure

    figure = draw()
    return {path: render_figure(figure, figure_format(path.suffix)) for path in paths}


def write_files(contents: Mapping[Path, bytes], *, force: bool) -> None:
    """Write files whole, each by its name, all of them or none."""
    with together():
        for path, content in contents.items():
            atomic_write_bytes(path, content, overwrite=force)
