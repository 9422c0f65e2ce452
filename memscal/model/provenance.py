"""Provenance of data: files that were read, processing, time."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import field
from datetime import UTC, datetime
from typing import Any, Self

from memscal.errors import InputError
from memscal.model.arrays import keyword_value_record, value_record
from memscal.model.checks import Messages
from memscal.version import __version__


@value_record
class SourceFile:
    """A file that was read: its base name (a folder may be private) and SHA-256 of its bytes.

    ``altered`` says how it differs from what was written, where that was accepted.

    Examples
    --------
    >>> import memscal
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     memscal.write_scan(memscal.simulate(seed=1), f"{folder}/scan.h5")
    ...     source = memscal.calibrate(f"{folder}/scan.h5").apparatus.process.input_scan
    >>> source.file_name, len(source.sha256)
    ('scan.h5', 64)
    """

    file_name: str
    sha256: str
    altered: str = ""


def source_of(name: str, data: bytes) -> SourceFile:
    """Return a file that was read by its base name and its bytes."""
    return SourceFile(name, hashlib.sha256(data).hexdigest())


def accepted_alterations(*sources: SourceFile | None) -> list[str]:
    """Return in words how each of several files differs from what was written."""
    altered = dict.fromkeys(source for source in sources if source and source.altered)
    return [f"{s.file_name} was changed after it was written: {s.altered}" for s in altered]


@keyword_value_record
class Process:
    """What produced a result: program, options, environment, inputs, messages.

    Parameters
    ----------
    program, version, date : str
        Name and version of the program; date in ISO 8601 with its offset.
    configuration, environment : mapping
        Every option with its value, the seed included; versions of Python and of the numerical
        libraries; both JSON-serialisable.
    messages : tuple of Message
        Notes and warnings that were shown.
    input_scan, input_reference : SourceFile, optional
        The files that were read.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1)).apparatus
    >>> process = apparatus.process
    >>> process.program, process.configuration["method"]
    ('memscal', 'white-noise')
    """

    program: str
    version: str
    date: str
    configuration: Mapping[str, Any] = field(default_factory=dict)
    environment: Mapping[str, Any] = field(default_factory=dict)
    messages: Messages = ()
    input_scan: SourceFile | None = None
    input_reference: SourceFile | None = None

    @classmethod
    def of_now(cls, **stated: Any) -> Self:
        """Return the process of this program, now, with the versions of what it runs on."""
        import platform

        import numpy as np
        import scipy

        stated["environment"] = {
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        }
        return cls(program="memscal", version=__version__, date=timestamp(), **stated)


def timestamp() -> str:
    """Return the current time in UTC, in ISO 8601, to the second; ``SOURCE_DATE_EPOCH`` counts."""
    # This variable (https://reproducible-builds.org/specs/) makes the same input give the same
    # bytes.
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
