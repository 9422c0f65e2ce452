"""Errors that memscal raises on purpose; each states what is wrong, why, and what to do.

The command line exits with the ``exit_code`` of an error; a user catches :class:`MemscalError`.
"""

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches


class MemscalError(Exception):
    """Base of every error that memscal raises on purpose.

    Parameters
    ----------
    problem, why, cure : str
        What is wrong (the file, the path inside it, the value, the unit), why this stops the work,
        and what the user can do.

    Examples
    --------
    >>> import memscal
    >>> try:
    ...     memscal.Rod(radius=-1e-3)
    ... except memscal.MemscalError as error:
    ...     print(error.problem)
    rod radius is -0.001 m, but it must be finite and above zero.
    """

    exit_code = 3

    def __init__(self, problem: str, *, why: str = "", cure: str = "") -> None:
        self.problem = problem
        self.why = why
        self.cure = cure
        super().__init__("\n".join(text for text in (problem, why, cure) if text))


class InputError(MemscalError, ValueError):
    """A value, an array or an option that cannot be worked with."""


class ArgumentError(InputError, TypeError):
    """An argument or an option of a name that is not known."""


class DomainError(InputError):
    """A request outside the range in which the mechanical model holds."""


class UnitError(InputError):
    """A unit that is missing, unknown, or of the wrong dimension."""


class FormatError(InputError):
    """A file that does not hold what its format requires."""


class SchemaVersionError(FormatError):
    """A file written under a newer major version of its schema."""


class UnsafeFileError(FormatError):
    """A file refused unread: it could read other files, run code, hang or exhaust the memory."""


class FitError(MemscalError):
    """Data that do not determine the parameters that are asked of them."""


class ConvergenceError(MemscalError):
    """A numerical solution that did not reach its stated accuracy.

    ``last`` is the last state that did converge, such as a :class:`memscal.Contact`, or ``None``.
    """

    last: object | None = None


class UnitWarning(UserWarning):
    """A value of a size that no set-up has: a unit was probably mistaken."""


class OutputError(MemscalError):
    """An output that was not written; what was there before is untouched."""

    exit_code = 4


def counted(number: int, things: str) -> str:
    """Return a number of things in words: "1 point", "3 points"."""
    return f"{number} {things.removesuffix('s') if number == 1 else things}"


@contextmanager
def placed(where: str) -> Iterator[None]:
    """Say in an error about a value in which file, and where in it, the value stands."""
    try:
        yield
    except InputError as error:
        if where in error.problem:
            raise
        raise type(error)(f"{where}: {error.problem}", why=error.why, cure=error.cure) from error


def require_names(problem: str, given: Iterable[str], known: Collection[str]) -> None:
    """Refuse names that are not known, in the words of the problem, and name the nearest one."""
    unknown = sorted(str(name) for name in given if name not in known)
    if unknown:
        near = get_close_matches(unknown[0], known, 1)
        meant = f"Did you mean {near[0]}? " if near else ""
        cure = f"{meant}Choose from {', '.join(known)}." if known else ""
        raise ArgumentError(f"{problem} {', '.join(unknown)}.", cure=cure)
