"""What the user sees: results on standard output, messages on standard error."""

from __future__ import annotations

import json
import math
import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TextIO

import click

from memscal.errors import OutputError
from memscal.formats.text import printable
from memscal.model.checks import Message

__all__ = [
    "emit",
    "emit_json",
    "error",
    "finite",
    "message",
    "note",
    "readable",
    "show_messages",
    "texts_of",
    "warn",
]

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


def emit(text: str) -> None:
    """Print results.

    A reader that goes away (``| head``) is no failure: the work is done, and its exit code
    says how it went.

    Raises
    ------
    OutputError
        If standard output cannot be written, as on a full disk.
    """
    if sys.stdout is None:
        return
    try:
        _write_all(sys.stdout, text + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_stdout()
    except OSError as failure:
        _discard_stdout()
        raise OutputError(
            f"The results cannot be printed: {failure.strerror}.",
            why="They go to standard output.",
            cure="Free some space, or send standard output elsewhere.",
        ) from failure


def _write_all(stream: TextIO, text: str) -> None:
    """Write to the last byte: an unbuffered stream may take a part and say nothing."""
    buffer = getattr(stream, "buffer", None)
    if buffer is None:
        stream.write(text)
        return
    stream.flush()
    rest = memoryview(text.encode(stream.encoding, stream.errors or "strict"))
    while rest:
        rest = rest[buffer.write(rest) :]


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


def finite(value: float | None) -> float | None:
    """Return a number that JSON can say, ``None`` (null) in place of any other.

    Examples
    --------
    >>> finite(2.5), finite(float("inf")), finite(None)
    (2.5, None, None)
    """
    return float(value) if value is not None and math.isfinite(value) else None


def message(text: str) -> None:
    """Tell the user something, on standard error."""
    _to_stderr([text])


def note(text: str) -> None:
    """Tell the user something that helps to judge the result."""
    _to_stderr([f"Note: {text}"])


def warn(text: str) -> None:
    """Tell the user something that puts the result in doubt."""
    _to_stderr([f"Warning: {text}"])


def show_messages(messages: Iterable[Message]) -> None:
    """Write the messages of a result to standard error, each as a note or a warning."""
    for each in messages:
        (warn if each.severity == "warning" else note)(each.text)


def texts_of(messages: Iterable[Message]) -> list[str]:
    """Return messages as the JSON output holds them."""
    return [each.text for each in messages]


def error(problem: str, why: str = "", cure: str = "") -> None:
    """Say what is wrong, why that stops the work, and what to do."""
    _to_stderr([f"Error: {problem}", *(f"  {part}" for part in (why, cure) if part)])


def _to_stderr(lines: Sequence[str]) -> None:
    for line in lines:
        text = readable(line, sys.stderr)
        if sys.stderr is not None and sys.stderr.isatty():
            indent = "  " if text.startswith("  ") else ""
            text = click.wrap_text(text.strip(), _width(), indent, "  ")
        try:
            click.echo(text, err=True)
        except OSError:  # nobody is left to be told
            return


def _width() -> int:
    import shutil

    return min(100, max(40, shutil.get_terminal_size().columns))
