"""Progress of a long step on standard error: its name and its time, on a terminal only."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

__all__ = ["working"]

_FIRST_AFTER = 0.7
_EVERY = 0.2
_CLEAR = "\r\x1b[K"


@contextmanager
def working(what: str) -> Iterator[Callable[[str], None]]:
    """Show what is being done, and for how long, on a terminal and only if it takes long.

    Yields a function that replaces the text.
    """
    shown = [what]
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
