"""The time that is written into files."""

from __future__ import annotations

import os
from datetime import UTC, datetime

from memscal.errors import InputError

__all__ = ["timestamp"]


def timestamp() -> str:
    """Return the current time in UTC, in ISO 8601, to the second.

    ``SOURCE_DATE_EPOCH`` (seconds since 1970, https://reproducible-builds.org/specs/)
    takes the clock's place where it is set, so that the same input gives the same bytes.

    Raises
    ------
    InputError
        If ``SOURCE_DATE_EPOCH`` is not a whole number of seconds.

    Examples
    --------
    >>> import os
    >>> os.environ["SOURCE_DATE_EPOCH"] = "0"
    >>> timestamp()
    '1970-01-01T00:00:00+00:00'
    >>> del os.environ["SOURCE_DATE_EPOCH"]
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return datetime.now(UTC).isoformat(timespec="seconds")
    try:
        return datetime.fromtimestamp(int(epoch), UTC).isoformat(timespec="seconds")
    except (ValueError, OverflowError, OSError) as error:
        raise InputError(
            f"SOURCE_DATE_EPOCH is {epoch!r}, but it must be a whole number of seconds since 1970.",
            cure="Correct this environment variable, or unset it.",
        ) from error
