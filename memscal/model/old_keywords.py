"""Keywords that a record holds now: they work as arguments of their own for one version more."""

import warnings
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any


def with_old_keywords(
    function: str, old: Mapping[str, Any], /, *, stacklevel: int = 3, **records: Any
) -> list[Any]:
    """Return the records, in order, with the values of old keywords; warn of each, refuse others.

    ``records`` are dataclasses by the argument that takes them now; with ``stacklevel`` 3 the
    warning points to the caller of the function that calls this one.
    """
    for name, value in old.items():
        holders = [key for key, held in records.items() if name in {f.name for f in fields(held)}]
        if not holders:
            raise TypeError(f"{function}() got an unexpected keyword argument {name!r}")
        [argument] = holders
        kind = type(records[argument]).__name__
        warnings.warn(
            f"{function}({name}=...) becomes {function}({argument}={kind}({name}=...)).",
            DeprecationWarning,
            stacklevel=stacklevel,
        )
        records[argument] = replace(records[argument], **{name: value})
    return list(records.values())
