"""Progress of long work: how much of it is done, to a callback, to the log, or as a bar.

What takes long counts its parts (:class:`Task`) or the steps that are done (:func:`in_steps`,
:func:`done_with`), wherever in a call it is; a public function tells the ``progress`` that it was
given of all of them (:func:`reported`).
"""

import logging
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import wraps
from html import escape
from inspect import signature
from time import monotonic
from typing import Any, Literal, TypeAlias, TypedDict, TypeVar, cast

from memscal.errors import require_names

_LOG = logging.getLogger("memscal")
#: Seconds between two lines of the log about one task.
_EVERY = 10.0

_Item = TypeVar("_Item")
_Function = TypeVar("_Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Progress:
    """How much of a task is done: what a ``progress`` callback is called with.

    Parameters
    ----------
    task : str
        What is counted: ``"draws"``, ``"contacts"``, ``"loads"``, ``"scans"``, ...
    done, total : float
        How many are done, and of how many, 0 if that is not known; of ``"the loading"`` the share
        of the work, of 1.
    seconds : float
        Since the task began.
    kept : float
        How many were done before that, as in a batch that is resumed.

    Examples
    --------
    >>> import memscal
    >>> progress = memscal.Progress("contacts", 137, 500, seconds=30.0)
    >>> print(progress)
    137 of 500 contacts, 79 s left
    >>> calibration = memscal.calibrate(memscal.simulate(seed=1))
    >>> heard = []
    >>> drawn = memscal.monte_carlo(calibration, draws=2, progress=heard.append)
    >>> [(progress.task, progress.done, progress.total) for progress in heard]
    [('draws', 1, 2), ('draws', 2, 2)]
    """

    task: str
    done: float
    total: float
    seconds: float
    kept: float = 0.0

    @property
    def rate(self) -> float:
        """How many are done in a second; of what was done before, none."""
        return (self.done - self.kept) / max(self.seconds, 1e-9)

    @property
    def left(self) -> float:
        """Seconds that the rest takes at the pace so far; infinite before anything is done."""
        return (self.total - self.done) / self.rate if self.rate else float("inf")

    def __str__(self) -> str:
        """Return the count with the time left."""
        if self.total == 1:
            text = f"{self.done:.0%} of {self.task}"
        else:
            total = f" of {self.total:,.0f}" if self.total else ""
            text = f"{self.done:,.0f}{total} {self.task}"
        return f"{text}, {span(self.left)} left" if self.kept < self.done < self.total else text


_Hears = Callable[[Progress], None]
Listener: TypeAlias = _Hears | Literal[True] | None
"""What is told of progress: a callback, or ``True`` for a bar; ``None`` for what is told now."""


class Watched(TypedDict, total=False):
    """What a function of many arguments has by :func:`reported`."""

    progress: Listener


_LISTENER: ContextVar[_Hears | None] = ContextVar("listener", default=None)
_STEPS: ContextVar["tuple[Task, Sequence[str]] | None"] = ContextVar("steps", default=None)


def nobody(_: Progress) -> None:
    """Hear of tasks within one that is counted: nothing is made of them."""


def span(seconds: float) -> str:
    """Return a time in words: 12 s, 3 min, 2.5 h."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.0f} s"


@contextmanager
def reporting(listener: Listener) -> Iterator[None]:
    """Have a listener told of all work within."""
    if listener is None:
        yield
        return
    token = _LISTENER.set(_bar() if listener is True else listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)


@dataclass(eq=False)
class Task:
    """A task that is counted from now on, to whoever is told of progress now."""

    name: str
    total: float
    done: float = 0
    listener: _Hears | None = field(default_factory=_LISTENER.get)
    start: float = field(default_factory=monotonic)
    logged: float = 0.0  # seconds from the start to the last line of the log

    def tell(self, done: float, kept: float = 0.0) -> None:
        """Tell how much of it is done, and was done before."""
        self.done = done
        if self.listener is nobody:
            return
        seconds = monotonic() - self.start
        progress = Progress(self.name, done, self.total, seconds, kept)
        if seconds - self.logged >= _EVERY or (self.logged and done == self.total):
            _LOG.info("%s", progress)
            self.logged = seconds
        if self.listener is not None:
            self.listener(progress)

    def counted(
        self,
        items: Iterable[_Item],
        size: Callable[[_Item], float] = lambda _: 1,
        kept: Callable[[_Item], bool] = lambda _: False,
    ) -> Iterator[_Item]:
        """Yield its items, told of as they come: their sizes, and what was done before."""
        rest = iter(items)
        before: float = 0
        while True:
            try:
                with reporting(nobody):
                    item = next(rest)
            except StopIteration:
                return
            before += size(item) if kept(item) else 0
            self.tell(self.done + size(item), before)
            yield item


@contextmanager
def in_steps(*names: str) -> Iterator[None]:
    """Begin a task of named steps; what is called within says which it is done with."""
    token = _STEPS.set((Task("steps", len(names)), names))
    try:
        yield
    finally:
        _STEPS.reset(token)


def done_with(step: str) -> None:
    """Tell that a step is done, of a task in steps if there is one."""
    steps = _STEPS.get()
    if steps is not None:
        task, names = steps
        number = names.index(step) + 1
        # What is repeated within a later step, as by another law of the film, counts for nothing.
        if number > task.done:
            task.tell(number)


def reported(function: _Function) -> _Function:
    """Have the ``progress`` that a function is given told of all work within it.

    An argument that the function does not have is refused, and the nearest one named.
    """
    known = signature(function).parameters

    @wraps(function)
    def with_progress(*args: Any, progress: Listener = None, **options: Any) -> Any:
        require_names(f"{function.__name__}() has no argument", options, known)
        with reporting(progress):
            return function(*args, **options)

    return cast("_Function", with_progress)


def _bar() -> _Hears:
    """Return what shows a bar in a notebook, or else a line on standard error."""
    if "ipykernel" in sys.modules and hasattr(sys.modules["IPython"].get_ipython(), "kernel"):
        from IPython.display import HTML, display

        shown = display(HTML(""), display_id=True)
        bar = '<progress value="{0.done}" max="{0.total}"></progress> {1}'
        return lambda progress: shown.update(HTML(bar.format(progress, escape(str(progress)))))

    def line(progress: Progress) -> None:
        end = "\n" if progress.done >= progress.total else ""
        sys.stderr.write(f"\r{progress!s:<60}{end}")
        sys.stderr.flush()

    return line
