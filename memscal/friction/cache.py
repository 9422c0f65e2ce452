"""Families that are kept from one run to the next: what they depend on, and as which numbers."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import asdict

from memscal.formats.contact_table import (
    ContactTable,
    find_contact_table,
    keep_contact_table,
    table_key,
)
from memscal.friction.paths import LoadingPath
from memscal.model.validation import FloatArray
from memscal.version import __version__

__all__ = ["CacheFolder", "family_key", "find_table", "keep_table"]

CacheFolder = str | os.PathLike[str] | None
"""A folder in which families are kept; ``None`` keeps none."""

#: Raised where the same request gives other numbers within one version.
_REVISION = 1


def family_key(
    paths: Sequence[LoadingPath], values: FloatArray, scale: float, k: FloatArray
) -> str:
    """Return the SHA-256 of all that the numbers of a family depend on.

    Film, sphere, loads, friction, loading and interface of every path, the wavenumbers, and the
    version of the program; the film's name does not count.
    """
    plain = [asdict(path) for path in paths]
    for path in plain:
        path["film"].pop("name")
        if path["order"] == 0:
            path.pop("order")
    for path, own in zip(plain, paths, strict=True):
        path["law"] = type(own.interface.normal).__name__
    return table_key(
        {
            "version": __version__,
            "revision": _REVISION,
            "paths": plain,
            "values": values.tolist(),
            "scale": scale,
            "k": hashlib.sha256(k.tobytes()).hexdigest(),
        }
    )


def find_table(cache: CacheFolder, key: str) -> ContactTable | None:
    """Return the table that was kept under a key, or ``None``."""
    return None if cache is None else find_contact_table(cache, key)


def keep_table(cache: CacheFolder, key: str, table: ContactTable) -> None:
    """Keep a table in a folder; without a folder, do nothing."""
    if cache is not None:
        keep_contact_table(cache, key, table)
