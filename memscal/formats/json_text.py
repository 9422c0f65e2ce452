"""JSON as it stands in files: ASCII, sorted, and standard (no NaN)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from memscal.errors import InputError


def to_json(subject: str, value: Any) -> str:
    """Write plain values as JSON; numbers that are not finite become strings."""
    return json.dumps(_plain(subject, value), sort_keys=True, allow_nan=False)


def from_json(subject: str, text: str) -> Any:
    """Read JSON from a file; damaged text becomes an :class:`InputError` that names it."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{subject} is not JSON: {error}.", cure="Write the file again."
        ) from error


def _plain(subject: str, value: Any) -> Any:
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, np.generic):
        return _plain(subject, value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, np.ndarray):
        return _plain(subject, value.tolist())
    if isinstance(value, Mapping):
        return {str(key): _plain(subject, item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(subject, item) for item in value]
    raise InputError(
        f"{subject} holds a {type(value).__name__}, which JSON cannot say.",
        cure="Give numbers, text, truth values, lists and mappings.",
    )
