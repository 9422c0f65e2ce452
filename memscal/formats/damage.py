"""Whatever a library raises on damaged bytes, as one kind of error."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from memscal.errors import FormatError, MemscalError, UnsafeFileError
from memscal.formats.text import printable

__all__ = ["damage_named"]


@contextlib.contextmanager
def damage_named(
    problem: str,
    *,
    why: str = "The file is damaged or incomplete",
    cure: str = "Get the file again from where it came from.",
) -> Iterator[None]:
    """Turn whatever a library raises on damaged bytes into one kind of error.

    Parameters
    ----------
    problem : str
        The file, the path inside it, and what cannot be done, without a full stop.
    why : str
        What it means, without a full stop: the library's own words follow.
    cure : str
        What the user can do.

    Raises
    ------
    FormatError
        In place of any other exception; errors of memscal itself pass.
    UnsafeFileError
        If memory ran out.
    """
    try:
        yield
    except MemscalError:
        raise
    except MemoryError as error:
        raise UnsafeFileError(f"{problem}: it asks for more memory than there is.") from error
    except Exception as error:
        said = printable(" ".join(str(error).split()), 200) or type(error).__name__
        raise FormatError(
            f"{problem}.",
            why=f"{why} ({said}).",
            cure=cure,
        ) from error
