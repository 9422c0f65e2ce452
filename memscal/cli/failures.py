"""Exit codes and messages of exceptions; a traceback is shown with --debug only."""

import errno
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Timer, current_thread, main_thread
from typing import Any, TypeVar

import click

from memscal.cli.output import emit_json, error, message, unprinted, warn
from memscal.errors import MemscalError
from memscal.model.checks import QualityCheck

DONE = 0
CHECK_FAILED = 1
USAGE = 2
REFUSED = 3
INTERNAL = 70
INTERRUPTED = 130

#: What standard output may answer.
_UNPRINTED = (errno.EPIPE, errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)

_Command = TypeVar("_Command", bound=Callable[..., Any])


@dataclass
class Session:
    """State of one run of the program: whether tracebacks are shown, and an object was printed."""

    debug: bool = False
    printed: bool = False


def _set_debug(ctx: click.Context, _: click.Parameter, debug: bool) -> None:
    if debug:
        ctx.ensure_object(Session).debug = True


def debug_option(command: _Command) -> _Command:
    """Add ``--debug``, before or after the name of a command."""
    return click.option(
        "--debug",
        is_flag=True,
        expose_value=False,
        is_eager=True,
        callback=_set_debug,
        help="Show Python's traceback with an error.",
    )(command)


def _handle_ending(handler: Any) -> dict[int, Any]:
    """Set a handler of the signals that end a program; one that nohup has it ignore stays so."""
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    return {
        n: signal.signal(n, handler) for n in numbers if signal.getsignal(n) is not signal.SIG_IGN
    }


class _Ended(KeyboardInterrupt):
    """A signal came; of the class itself Python would kill the process after the clean-up."""


@contextmanager
def _interruptible() -> Iterator[list[int]]:
    """Have SIGTERM and SIGHUP end the work as Ctrl-C does, cleaned up; yield what came."""
    came = []

    def interrupt(number: int, _: object) -> None:
        came.append(number)
        raise _Ended

    def again(unraisable: Any) -> None:
        """Send a signal once more that came where Python ignores errors, as in a destructor."""
        if isinstance(unraisable.exc_value, _Ended):
            Timer(0.01, os.kill, (os.getpid(), came.pop())).start()
        else:
            usual(unraisable)

    usual = sys.unraisablehook
    sys.unraisablehook = again
    before = _handle_ending(interrupt) if current_thread() is main_thread() else {}
    try:
        yield came
    except Exception as failure:
        if not came:
            raise
        # A library may have made another error of it.
        raise _Ended from failure
    finally:
        sys.unraisablehook = usual
        for number, handler in before.items():
            signal.signal(number, handler)


def guarded(command: click.Command, arguments: Sequence[str] | None) -> int:
    """Run a command; return its exit code, or that of its failure after saying what it was."""
    session = Session()
    given = sys.argv[1:] if arguments is None else arguments
    came = []
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
            with _interruptible() as came:
                done = command.main(given, prog_name="memscal", standalone_mode=False, obj=session)
                return done if isinstance(done, int) else DONE
        except (Exception, KeyboardInterrupt) as failure:  # noqa: BLE001 - the last resort
            if session.debug:
                import traceback

                click.echo(traceback.format_exc(), file=sys.stderr, nl=False)
            described = _reported(failure, came)
        # A usage error is raised before options have values: the flag is looked for as typed.
        if described and "--json" in given and not session.printed:
            emit_json({"error": described})
        return int(described.get("exit_code", DONE))


def _reported(failure: BaseException, came: Sequence[int]) -> dict[str, Any]:
    """Say what a failure was; return it as an object, empty where it is none."""
    if isinstance(failure, click.Abort) and isinstance(failure.__cause__, EOFError):
        failure = failure.__cause__
    if isinstance(failure, OSError) and failure.filename is None and failure.errno in _UNPRINTED:
        # click printed a help text; a reader that goes away is no failure.
        away = failure.errno == errno.EPIPE
        failure = unprinted(failure)
        if away:
            return {}
    kind = type(failure).__name__
    code = INTERNAL
    why = cure = ""
    if isinstance(failure, click.UsageError):
        kind = "UsageError"
        code = USAGE
        problem = failure.format_message()
        cure = f"See {failure.ctx.command_path if failure.ctx else 'memscal'} --help."
        failure.show()
    elif isinstance(failure, click.Abort | KeyboardInterrupt):
        kind = "Interrupted"
        code = 128 + came[0] if came else INTERRUPTED
        problem = "Interrupted. Nothing was left half-written."
        message(problem)
    else:
        if isinstance(failure, MemscalError):
            code = failure.exit_code
            problem = failure.problem
            why = failure.why
            cure = failure.cure
        elif isinstance(failure, MemoryError):
            problem = "The computer ran out of memory."
            cure = "Close other programs, or give a scan with fewer points."
        else:
            text = " ".join(str(failure).split())
            fault = kind + (f" ({text})" if text else "")
            problem = f"memscal failed by a fault of its own, not of its input: {fault}."
            cure = "Please report it, with what `memscal --debug` and the same arguments print."
        error(problem, why, cure)
    return {"class": kind, "problem": problem, "why": why, "cure": cure, "exit_code": code}


def _show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Show a Python warning as one plain line, without the line of code that raised it."""
    warn(f"{category.__name__}: {message}")


def exit_code_of(checks: Sequence[QualityCheck], then: str = "") -> int:
    """Return the exit code of quality checks; warn of those that failed, each kind once."""
    failed = [check for check in checks if not check.passed]
    if not failed:
        return DONE
    count = "A quality check" if len(failed) == 1 else f"{len(failed)} quality checks"
    kinds: dict[str, list[str]] = {}
    for check in failed:
        kinds.setdefault(check.kind.replace("_", " "), []).append(check.profile)
    words = ", ".join(" ".join([kind, *profiles]).strip() for kind, profiles in kinds.items())
    warn(f"{count} failed ({words}): memscal explain CHECK tells what to do.{then}")
    return CHECK_FAILED
