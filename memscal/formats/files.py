"""Bytes of files: written whole or not at all, never over an input; read within a limit."""

import errno
import fcntl
import os
import re
import secrets
import stat
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from memscal.errors import FormatError, InputError, MemscalError, OutputError, UnsafeFileError
from memscal.model.notation import printable
from memscal.model.sizes import MOST_FILE_BYTES, too_large

FilePath = str | os.PathLike[str]
"""The path of a file."""

HDF5_SUFFIXES = (".h5", ".hdf5", ".hdf", ".nxs", ".nx5")
"""Endings of HDF5 files."""

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
    path: FilePath, *, overwrite: bool = False, inputs: Iterable[FilePath] = ()
) -> None:
    """Prove that an output can be written, by writing beside it: permissions show no full disk."""
    with _Transaction() as proof:
        proof.write(_checked_target(path, overwrite=overwrite, inputs=inputs), b"\0", overwrite)


def atomic_write_bytes(
    path: FilePath, data: bytes | memoryview, *, overwrite: bool = False
) -> None:
    """Write a file whole or not at all: beside the target, flushed, then renamed in one step."""
    target = _checked_target(path, overwrite=overwrite)
    with together():
        _OPEN.get().write(target, data, overwrite)


@contextmanager
def together(folder: FilePath | None = None) -> Iterator[None]:
    """Have all files that are written in a block take their names at its end, or none of them.

    A folder is made for them if it does not exist; it goes if they fail.
    """
    if _OPEN.get(None) is not None:
        yield  # as a part of the block that is open
        return
    with _Transaction() as transaction:
        if folder is not None:
            transaction.make(Path(folder))
        token = _OPEN.set(transaction)
        try:
            yield
        finally:
            _OPEN.reset(token)
        transaction.commit()


@dataclass
class _File:
    """A file on its way to its target; ``before`` is a name of what it replaces."""

    target: Path
    overwrite: bool
    temporary: Path
    before: Path | None = None
    replaces: bool = False
    placed: bool = False


class _Transaction(ExitStack):
    """Files that are written and flushed beside their targets, and then renamed."""

    def __init__(self) -> None:
        super().__init__()
        self._files: list[_File] = []

    def make(self, folder: Path) -> None:
        """Make a folder for the files; one that is there stays."""
        with _blamed(folder), suppress(FileExistsError):
            folder.mkdir()
            self.callback(_removed, folder.rmdir)  # takes nothing from one that holds the files

    def write(self, target: Path, data: bytes | memoryview, overwrite: bool) -> None:
        """Write and flush a file beside its target; it keeps the permissions of the old one."""
        _remove_orphans(target.parent)
        file = _File(target, overwrite, _beside(target))
        self._files.append(file)
        with _blamed(target):
            mode = None
            with suppress(FileNotFoundError):
                mode = stat.S_IMODE(os.stat(target).st_mode)
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
            # The umask sets the mode of a new one.
            descriptor = os.open(file.temporary, flags, 0o666 if mode is None else 0o600)
            self._lock(descriptor, file.temporary)
            remaining = memoryview(data)
            while remaining:
                remaining = remaining[os.write(descriptor, remaining) :]
            if mode is not None:
                os.chmod(file.temporary, mode)
            os.fsync(descriptor)

    def commit(self) -> None:
        """Rename all files; where one of them cannot be, give the others back what was there."""
        try:
            for file in self._files:
                with _blamed(file.target):
                    file.replaces = file.overwrite and file.target.exists()
                    if file.replaces and len(self._files) > 1:
                        self._keep(file)
                    if file.overwrite:
                        os.replace(file.temporary, file.target)
                    else:
                        _place_new(file.temporary, file.target)
                    file.placed = True
        except BaseException as error:
            stay = [file.target for file in reversed(self._files) if not _given_back(file)]
            if stay and isinstance(error, OutputError):
                others = [file.target for file in self._files if file.target not in stay]
                new, old = (", ".join(map(str, paths)) for paths in (stay, others))
                raise OutputError(
                    error.problem, why=f"New is now: {new}. As before is: {old}.", cure=error.cure
                ) from error
            raise
        for folder in {file.target.parent for file in self._files}:
            _sync_folder(folder)

    def _keep(self, file: _File) -> None:
        """Give what is there a second name, locked; a disk without hard links has no way back."""
        with suppress(OSError):
            file.before = _beside(file.target)
            self._lock(os.open(file.target, os.O_RDONLY), file.before)
            os.link(file.target, file.before)

    def _lock(self, descriptor: int, temporary: Path) -> None:
        """Lock an open file, where the disk has locks, until its temporary name goes at the end."""
        self.callback(os.close, descriptor)
        self.callback(_removed, temporary.unlink)
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)


_OPEN: ContextVar[_Transaction] = ContextVar("the files that are written together")


def _given_back(file: _File) -> bool:
    """Put back what was at a target before; return whether it is there."""
    if not file.placed:
        return True
    try:
        if not file.replaces:
            os.unlink(file.target)
        elif file.before is None:
            return False
        else:
            os.replace(file.before, file.target)
    except OSError:
        return False
    return True


def _checked_target(path: FilePath, *, overwrite: bool, inputs: Iterable[FilePath] = ()) -> Path:
    """Follow symbolic links to the real target and refuse what must not be replaced."""
    shown = os.fspath(path)
    if not shown or "\0" in shown:
        raise OutputError(f"{shown!r} is not the name of a file.", cure="Give the output a name.")
    target = Path(os.path.realpath(shown))
    with _blamed(Path(shown)):
        try:
            status = os.stat(target)
        except FileNotFoundError:
            return target
    for source in inputs:
        with suppress(OSError):
            if os.path.samestat(status, os.stat(source)):
                raise OutputError(
                    f"The output {shown} is also an input.",
                    why=f"Writing it would destroy what is being read. {_UNTOUCHED}",
                    cure="Give the output another name.",
                )
    if not stat.S_ISREG(status.st_mode):
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
        raise OutputError(
            f"The output {shown} is {kind}.",
            why="A result is written as one regular file that takes its name when it is whole.",
            cure="Give the name of a file.",
        )
    if not overwrite:
        raise OutputError(
            f"The output {shown} exists already.",
            why=_UNTOUCHED,
            cure="Choose another name, or allow overwriting (--force; overwrite=True in Python).",
        )
    return target


def _beside(target: Path) -> Path:
    return target.parent / f".memscal-{secrets.token_hex(8)}.tmp"


@contextmanager
def _blamed(target: Path) -> Iterator[None]:
    """Say of what the system refuses which output it was."""
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        problem = f"The output {target} cannot be written: {reason}."
        cure = _CURES.get(error.errno or 0, "Choose another folder, or another name.")
        raise OutputError(problem, why=_UNTOUCHED, cure=cure) from error


def _removed(remove: Callable[[], None]) -> None:
    """Remove what is left of a file or folder, if anything is."""
    with suppress(OSError):
        remove()


#: Seconds after which a temporary file without a lock is that of a process that was killed.
_ORPHANED = 60.0
_TEMPORARY = re.compile(r"\.memscal-[0-9a-f]{16}\.tmp")


@lru_cache(maxsize=4096)
def _remove_orphans(folder: Path) -> None:
    """Remove from a folder, once in a process, what killed processes left of their outputs."""
    with suppress(OSError), os.scandir(folder) as items:
        left = [item.path for item in items if _TEMPORARY.fullmatch(item.name)]
        for path in left:
            with suppress(OSError):
                _remove_orphan(path)


def _remove_orphan(path: str) -> None:
    descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        status = os.fstat(descriptor)
        if stat.S_ISREG(status.st_mode) and time.time() - status.st_mtime > _ORPHANED:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)  # refused while its writer lives
            os.unlink(path)
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
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def read_bytes(path: FilePath, *, limit: int = MOST_FILE_BYTES) -> bytes:
    """Read a regular file of bounded size, once, without ever waiting for another program."""
    return b"".join(read_pieces(path, limit=limit))


def read_pieces(path: FilePath, *, limit: int) -> Iterator[bytes]:
    """Yield the same in pieces of up to 1 MiB; a file that grows meanwhile meets the limit, too."""
    shown = os.fspath(path)
    try:
        descriptor = os.open(shown, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY)
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
        size = status.st_size
        total = 0
        piece = b""
        while max(size, total) <= limit:
            yield piece
            if not (piece := os.read(descriptor, 2**20)):
                return
            total += len(piece)
        raise too_large(
            shown,
            max(size, total),
            limit,
            "bytes",
            cure="Check that it is the right file; leave out data that memscal does not need.",
            error=UnsafeFileError,
        )
    except OSError as error:
        raise InputError(f"{shown} cannot be read: {error.strerror}.") from error
    finally:
        os.close(descriptor)


@contextmanager
def damage_named(
    problem: str,
    *,
    why: str = "The file is damaged or incomplete",
    cure: str = "Get the file again from where it came from.",
) -> Iterator[None]:
    """Turn what a library raises on damaged bytes into a FormatError; add its words to ``why``."""
    try:
        yield
    except MemscalError:
        raise
    except MemoryError as error:
        raise UnsafeFileError(f"{problem}: it asks for more memory than there is.") from error
    except Exception as error:
        reason = printable(" ".join(str(error).split()), 200) or type(error).__name__
        raise FormatError(f"{problem}.", why=f"{why} ({reason}).", cure=cure) from error
