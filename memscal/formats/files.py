"""Bytes of files: written whole or not at all, never over an input; read within a limit."""

import contextlib
import errno
import os
import secrets
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path

from memscal.errors import InputError, OutputError, UnsafeFileError
from memscal.model.sizes import MOST_FILE_BYTES, too_large

_UNTOUCHED = "Nothing was written; what was there before is untouched."
_CURES = {
    errno.ENOSPC: "Free some space on this disk, or choose another folder.",
    errno.EDQUOT: "Free some of your disk quota, or choose another folder.",
    errno.EROFS: "Choose a folder on a disk that is not read-only.",
    errno.EACCES: "Choose a folder in which you may write.",
    errno.EPERM: "Choose a folder in which you may write.",
    errno.ENOENT: "Create the folder first, or correct its name.",
    errno.ENOTDIR: "Correct the path: a part of it is a file, not a folder.",
    errno.ENAMETOOLONG: "Choose a shorter name.",
}
_NO_HARD_LINKS = {errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK}


def ensure_writable(
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    inputs: Iterable[str | os.PathLike[str]] = (),
) -> None:
    """Prove that an output can be written, by writing beside it: permissions show no full disk."""
    with _beside(_checked_target(path, overwrite=overwrite, inputs=inputs)) as temporary:
        _write_durably(temporary, b"\0")


def atomic_write_bytes(
    path: str | os.PathLike[str], data: bytes | memoryview, *, overwrite: bool = False
) -> None:
    """Write a file whole or not at all: beside the target, flushed, then renamed in one step."""
    target = _checked_target(path, overwrite=overwrite)
    with _beside(target) as temporary:
        _write_durably(temporary, data)
        if overwrite:
            os.replace(temporary, target)
        else:
            _place_new(temporary, target)
        _sync_folder(target.parent)


def _checked_target(
    path: str | os.PathLike[str], *, overwrite: bool, inputs: Iterable[str | os.PathLike[str]] = ()
) -> Path:
    """Follow symbolic links to the real target and refuse what must not be replaced."""
    shown = os.fspath(path)
    if not shown or "\0" in shown:
        raise OutputError(f"{shown!r} is not the name of a file.", cure="Give the output a name.")
    target = Path(os.path.realpath(shown))
    try:
        status = os.stat(target)
    except FileNotFoundError:
        return target
    except OSError as error:
        raise _output_error(Path(shown), error) from error
    for source in inputs:
        with contextlib.suppress(OSError):
            if os.path.samestat(status, os.stat(source)):
                why = f"Writing it would destroy what is being read. {_UNTOUCHED}"
                cure = "Give the output another name."
                raise OutputError(f"The output {shown} is also an input.", why=why, cure=cure)
    if not stat.S_ISREG(status.st_mode):
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
        why = "A result is written as one regular file that takes its name when it is whole."
        cure = "Give the name of a file."
        raise OutputError(f"The output {shown} is {kind}.", why=why, cure=cure)
    if not overwrite:
        cure = "Choose another name, or allow overwriting (--force; overwrite=True in Python)."
        raise OutputError(f"The output {shown} exists already.", why=_UNTOUCHED, cure=cure)
    return target


@contextlib.contextmanager
def _beside(target: Path) -> Iterator[Path]:
    """Yield the name of a temporary file beside a target, and remove the file at the end."""
    temporary = target.parent / f".memscal-{secrets.token_hex(8)}.tmp"
    try:
        yield temporary
    except OSError as error:
        raise _output_error(target, error) from error
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary)


def _write_durably(temporary: Path, data: bytes | memoryview) -> None:
    """Write and flush to the disk; the mode 0o666 leaves the permissions to the umask."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    for name in ("O_CLOEXEC", "O_NOFOLLOW", "O_BINARY"):
        flags |= getattr(os, name, 0)
    descriptor = os.open(temporary, flags, 0o666)
    try:
        remaining = memoryview(data)
        while remaining:
            remaining = remaining[os.write(descriptor, remaining) :]
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _place_new(temporary: Path, target: Path) -> None:
    """Give the temporary file its name, only if no other file has taken it in the meantime."""
    try:
        os.link(temporary, target)
    except OSError as error:
        if error.errno not in _NO_HARD_LINKS:
            raise
        os.replace(temporary, target)  # a file system without hard links


def _sync_folder(folder: Path) -> None:
    """Make the new name durable; some systems cannot, and the content is safe without it."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | getattr(os, "O_DIRECTORY", 0))
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _output_error(target: Path, error: OSError) -> OutputError:
    reason = os.strerror(error.errno) if error.errno else str(error)
    problem = f"The output {target} cannot be written: {reason}."
    cure = _CURES.get(error.errno or 0, "Choose another folder, or another name.")
    return OutputError(problem, why=_UNTOUCHED, cure=cure)


def read_bytes(path: str | os.PathLike[str], *, limit: int = MOST_FILE_BYTES) -> bytes:
    """Read a regular file of bounded size, once, without ever waiting for another program."""
    return b"".join(read_pieces(path, limit=limit))


def read_pieces(path: str | os.PathLike[str], *, limit: int) -> Iterator[bytes]:
    """Yield the same in pieces of up to 1 MiB; a file that grows meanwhile meets the limit, too."""
    shown = os.fspath(path)
    flags = os.O_RDONLY
    for name in ("O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY"):
        flags |= getattr(os, name, 0)
    try:
        descriptor = os.open(shown, flags)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        problem = f"{shown} cannot be read: {reason}."
        raise InputError(problem, cure="Check the name and the permissions.") from error
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            why = "A folder, pipe or device could keep a program waiting for ever."
            cure = "Give the name of a file."
            raise UnsafeFileError(f"{shown} is not a regular file.", why=why, cure=cure)
        size, total, piece = status.st_size, 0, b""
        while max(size, total) <= limit:
            yield piece
            if not (piece := os.read(descriptor, 2**20)):
                return
            total += len(piece)
        cure = "Check that it is the right file; leave out data that memscal does not need."
        raise too_large(shown, max(size, total), limit, "bytes", cure=cure, error=UnsafeFileError)
    except OSError as error:
        raise InputError(f"{shown} cannot be read: {error.strerror}.") from error
    finally:
        os.close(descriptor)
