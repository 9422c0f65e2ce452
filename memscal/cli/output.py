"""Output of a command: tables and JSON on standard output, messages on standard error, files."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from memscal.errors import OutputError
from memscal.figures import FIGURE_SUFFIXES
from memscal.formats.files import HDF5_SUFFIXES, atomic_write_bytes, ensure_writable, together
from memscal.model.checks import NOISE_ALONE, Message
from memscal.summaries.table import WIDTH, Table, as_it_is, folded, readable, text_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from memscal.model.result import Shown, Told


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
    context = click.get_current_context(silent=True)
    if context is not None:
        # What fails after this does not print a second object.
        context.obj.printed = True


def message(text: str) -> None:
    """Write a message to standard error."""
    text = readable(text, sys.stderr)
    if sys.stderr is not None and sys.stderr.isatty():
        text = "\n  ".join(folded(text, _columns() - 2))
    with suppress(OSError):  # standard error is closed
        click.echo(text, err=True)


def note(text: str) -> None:
    """Write a note, which helps to judge the result."""
    message(f"Note: {text}")


def warn(text: str) -> None:
    """Write a warning, which puts the result in doubt."""
    message(f"Warning: {text}")


#: What messages that say the same of several things differ in.
_PARTICULARS = re.compile(r"\([^)]*\)|[-+]?\d[\d.e+-]*")


def show_messages(messages: Iterable[Message], owners: str = "") -> None:
    """Write messages to standard error, those that say the same once; of how many owners, too."""
    alike: dict[tuple[str, str, str], list[str]] = {}
    # What the answer says is not said again.
    for item in messages:
        if item.kind != NOISE_ALONE:
            key = item.kind, item.severity, _PARTICULARS.sub("", item.text)
            alike.setdefault(key, []).append(item.text)
    for (_, severity, _), (text, *others) in alike.items():
        more = f" ({len(others)} more like it; --json lists all.)" if others else ""
        if owners:
            more = f" ({owners}: {len(others) + 1})"
        (warn if severity == "warning" else note)(text + more)


def error(problem: str, why: str = "", cure: str = "") -> None:
    """Write an error: what is wrong, why that stops the work, and what to do."""
    message(f"Error: {problem}")
    for text in filter(None, (why, cure)):
        message(f"  {text}")


#: Seconds until something is shown, and between two times: on a terminal, and elsewhere in lines.
_ON_TERMINAL = (0.7, 0.2)
_IN_LINES = (10.0, 60.0)
_CLEAR = "\r\x1b[K"


@contextmanager
def working(task: str, *, rate: bool = False) -> Iterator[None]:
    """Show on standard error how much of a long task is done, the time left and the rate."""
    if sys.stderr is None:
        yield
        return
    from threading import Event, Thread
    from time import monotonic

    from memscal.progress import Progress, reporting, span

    done = Event()
    stream = sys.stderr
    start = monotonic()
    counts = [""]
    terminal = stream.isatty()
    (wait, every), begin, end = (_ON_TERMINAL, _CLEAR, "") if terminal else (_IN_LINES, "", "\n")

    def show() -> None:
        with suppress(OSError, ValueError):
            interval = wait
            while not done.wait(interval):
                text = f"{task}{counts[0]} ({span(monotonic() - start)})"
                room = _columns() - 1 if terminal else len(text)
                stream.write(f"{begin}{readable(text, stream)[:room]}{end}")
                stream.flush()
                interval = every
            if terminal and interval == every:
                stream.write(_CLEAR)
                stream.flush()

    def hear(progress: Progress) -> None:
        counts[0] = f": {progress}"
        if rate and progress.rate:
            counts[0] += f", {progress.rate:.3g} a second"

    thread = Thread(target=show, daemon=True)
    thread.start()
    try:
        with reporting(hear):
            yield
    finally:
        done.set()
        thread.join()


#: A terminal of more columns than this leaves the others empty.
_WIDEST = 120


def _columns() -> int:
    """Return for how many columns of text there is room, 80 where nothing says it."""
    return min(_WIDEST, max(40, shutil.get_terminal_size((WIDTH, 24)).columns))


def emit_tables(*tables: Table, answer: str = "") -> None:
    """Print the answer, then tables that have rows, with an empty line between them."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    drawn = sys.stdout is not None and sys.stdout.isatty() and not plain
    emit(text_of(answer, tables, _columns(), _in_bold if drawn else as_it_is))


#: Lines of --brief.
_BRIEF = 4


def emit_result(
    result: Told,
    head: Mapping[str, Any],
    *,
    as_json: bool,
    brief: bool = False,
    further: Mapping[str, Told] | None = None,
) -> None:
    """Print the answer of a result, and unless that is enough its tables and those of others.

    Or one JSON object: the head, the result, and the further results by their names.
    """
    others = further or {}
    if as_json:
        values = {name: other.to_dict() for name, other in others.items()}
        emit_json({**head, **result.to_dict(), **values})
    elif brief:
        kept = result.answer().split("\n")
        while len(folded("\n".join(kept), _columns())) > _BRIEF and len(kept) > 1:
            kept.pop()
        emit_tables(answer="\n".join(kept))
    else:
        tables = result.tables()
        for other in others.values():
            tables += other.tables()
        emit_tables(*tables, answer=result.answer())


def _in_bold(text: str, failed: bool) -> str:
    return click.style(text, bold=True, fg="red" if failed else None)


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


def default_name(path: Path, suffix: str) -> Path:
    """Return the name of a result beside its input."""
    stem = path.stem if path.suffix.lower() in HDF5_SUFFIXES else path.name
    return path.parent / f"{stem}{suffix}"


def prove_writable(
    outputs: Iterable[Path | None], *, force: bool, inputs: Iterable[Path | None] = ()
) -> None:
    """Refuse outputs that share a name, and prove that each that is asked for can be written."""
    wanted = list(filter(None, outputs))
    read = list(filter(None, inputs))
    seen: dict[Path, Path] = {}
    for output in wanted:
        real = Path(os.path.realpath(output))
        if real in seen:
            raise click.UsageError(
                f"Two outputs have the same name: {seen[real]} and {output}. Give each its own."
            )
        seen[real] = output
    for output in wanted:
        ensure_writable(output, overwrite=force, inputs=read)


Files = dict[Path, bytes]
"""Contents of files, by their names."""


def rendered(draw: Callable[[], Figure], paths: Sequence[Path]) -> Files:
    """Return a figure as the bytes of files; without files it is not drawn."""
    if not paths:
        return {}
    from memscal.figures.style import figure_format, render_figure

    figure = draw()
    return {path: render_figure(figure, figure_format(path.suffix)) for path in paths}


def reported(result: Told, path: Path | None) -> Files:
    """Return a result's page as the bytes of its file, if one is asked for."""
    return {} if path is None else {path: result.report().encode()}


def drawn(result: Shown, figures: Sequence[Path] = (), report: Path | None = None) -> Files:
    """Return figure and page of a result as the bytes of their files."""
    with working("Drawing"):
        return rendered(result.plot, figures) | reported(result, report)


def say_written(paths: Iterable[Path | None]) -> None:
    """Name the files that were written, where there are any."""
    for path in filter(None, paths):
        message(f"Written: {path}")


def write_files(contents: Mapping[Path, bytes], *, force: bool) -> None:
    """Write files whole, each by its name, all of them or none."""
    with together():
        for path, content in contents.items():
            atomic_write_bytes(path, content, overwrite=force)


def deliver(
    result: Any,
    output: Path | None,
    save: Callable[..., None],
    options: Mapping[str, Any],
    key: str = "output",
) -> None:
    """Write a result, its figures and its page, all of them or none; print it, and what it says."""
    force = options["force"]
    files = drawn(result, options["figures"], options["report"])
    with together():
        if output is not None:
            save(output, overwrite=force)
        write_files(files, force=force)
        head = {key: output and str(output)}
        emit_result(result, head, as_json=options["as_json"], brief=options["brief"])
    show_messages(result.messages)
    say_written([output, *files])
