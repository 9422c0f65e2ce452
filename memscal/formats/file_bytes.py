"""Reading a file's bytes: a regular file of bounded size, once, without waiting for anyone."""

from __future__ import annotations

import os
import stat

from memscal.errors import InputError, UnsafeFileError
from memscal.formats.schema import MAX_FILE_BYTES

__all__ = ["read_bytes"]


def read_bytes(path: str | os.PathLike[str], *, limit: int = MAX_FILE_BYTES) -> bytes:
    """Read a regular file of bounded size, once, without ever waiting for another program.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be read.
    UnsafeFileError
        If it is not a regular file, or too large.
    """
    shown = os.fspath(path)
    flags = os.O_RDONLY
    for name in ("O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY"):
        flags |= getattr(os, name, 0)
    try:
        descriptor = os.open(shown, flags)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{shown} cannot be read: {reason}.", cure="Check the name and the permissions."
        ) from error
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise UnsafeFileError(
                f"{shown} is not a regular file.",
                why="A folder, pipe or device could keep a program waiting for ever.",
                cure="Give the name of a file.",
            )
        if status.st_size > limit:
            raise _too_large(shown, status.st_size, limit)
        return _read_whole(descriptor, shown, limit)
    finally:
        os.close(descriptor)


def _read_whole(descriptor: int, shown: str, limit: int) -> bytes:
    """Read to the end; a file that grows meanwhile still meets the limit."""
    parts, size = [], 0
    try:
        while part := os.read(descriptor, min(2**20, limit + 1 - size)):
            parts.append(part)
            size += len(part)
            if size > limit:
                raise _too_large(shown, size, limit)
    except OSError as error:
        raise InputError(f"{shown} cannot be read: {error.strerror}.") from error
    return b"".join(parts)


def _too_large(shown: str, size: int, limit: int) -> UnsafeFileError:
    return UnsafeFileError(
        f"{shown} has {size:,} bytes, but at most {limit:,} are read.",
        why="A scan or an apparatus function is far smaller.",
        cure="Check that it is the right file; leave out data that memscal does not need.",
    )
