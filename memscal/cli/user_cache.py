"""Where the user's calculated contacts are kept from one run to the next."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from memscal.cli.options import FILE

__all__ = ["cache_from", "cache_options", "user_cache_folder"]

_Command = TypeVar("_Command", bound=Callable[..., Any])


def user_cache_folder() -> Path | None:
    """Return the user's folder of calculated contacts; ``None`` where there is no home.

    ``memscal/contacts`` in ``XDG_CACHE_HOME``, or else in ``~/.cache``.  A relative
    ``XDG_CACHE_HOME`` counts as none, as its specification says.
    """
    named = os.environ.get("XDG_CACHE_HOME", "")
    if named and Path(named).is_absolute():
        return Path(named, "memscal", "contacts")
    try:
        return Path.home() / ".cache" / "memscal" / "contacts"
    except RuntimeError:
        return None


def cache_options(command: _Command) -> _Command:
    """Add ``--cache`` and ``--no-cache``."""
    folder = click.option(
        "--cache",
        type=FILE,
        metavar="FOLDER",
        help="Where calculated contacts are kept for the next run.  [default: memscal/contacts in "
        "the user's cache folder]",
    )
    none = click.option("--no-cache", is_flag=True, help="Calculate anew, and keep nothing.")
    return folder(none(command))


def cache_from(cache: Path | None, no_cache: bool) -> Path | None:
    """Return the folder that the options name; ``None`` for no cache.

    Raises
    ------
    click.UsageError
        If both options are given, or the folder is a file.
    """
    if no_cache and cache is not None:
        raise click.UsageError("Give --cache or --no-cache, not both.")
    if cache is not None and cache.exists() and not cache.is_dir():
        raise click.UsageError(f"--cache names a folder, but {cache} is a file.")
    if no_cache:
        return None
    return user_cache_folder() if cache is None else cache
