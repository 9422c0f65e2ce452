"""Several scans of one experiment as the files of one folder: all of them, or none."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from memscal.errors import OutputError
from memscal.formats.atomic import ensure_writable
from memscal.formats.scan import write_scan
from memscal.model.scan import Scan

__all__ = ["ensure_folder_writable", "write_scans"]


def ensure_folder_writable(
    folder: str | os.PathLike[str], names: Iterable[str], *, overwrite: bool
) -> None:
    """Prove that files of these names can be written in a folder, which need not exist yet.

    Raises
    ------
    OutputError
        If one cannot be written, or exists and may not be replaced.
    """
    target = Path(folder)
    if not target.exists() and not target.is_symlink():
        ensure_writable(target)
        return
    if not target.is_dir():
        raise OutputError(
            f"The output {target} is not a folder.",
            why="An experiment is several scans, each a file of its own.",
            cure="Give the name of a folder; a new one is made.",
        )
    for name in names:
        ensure_writable(target / name, overwrite=overwrite)


def write_scans(
    scans: Mapping[str, Scan], folder: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write scans as memscal-scan files of one folder, all of them or none.

    All are written whole under other names first, and only then take their own.

    Parameters
    ----------
    scans : mapping of str to Scan
        The scans by the names of their files.
    folder : path
        The folder; it is made if it does not exist.
    overwrite : bool
        Whether existing files may be replaced.

    Raises
    ------
    OutputError
        If a file exists or cannot be written; what was there before is then untouched.

    Examples
    --------
    >>> from memscal.laboratory.rod_scan import simulate
    >>> with tempfile.TemporaryDirectory() as place:
    ...     write_scans({"one.h5": simulate(), "two.h5": simulate(seed=1)}, f"{place}/run")
    ...     sorted(os.listdir(f"{place}/run"))
    ['one.h5', 'two.h5']
    """
    target = Path(folder)
    ensure_folder_writable(target, tuple(scans), overwrite=overwrite)
    made = not target.exists()
    staging: str | None = None
    try:
        target.mkdir(exist_ok=True)
        staging = tempfile.mkdtemp(prefix=".memscal-", dir=target)
        for name, scan in scans.items():
            write_scan(scan, Path(staging, name))
        for name in scans:
            os.replace(Path(staging, name), target / name)
    except OSError as error:
        raise OutputError(
            f"The output {target} cannot be written: {error.strerror}.",
            cure="Choose another folder.",
        ) from error
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)
        if made:
            # Of a folder that holds the scans this takes nothing away.
            with contextlib.suppress(OSError):
                target.rmdir()
