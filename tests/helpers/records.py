"""Results, records and JSON compared at every depth."""

import dataclasses
from collections.abc import Mapping

import numpy as np

EXACT = 4.5e-16
"""Twice the rounding of one multiplication and one division by a power of ten."""


def assert_same(found, expected, *, but=(), rtol: float = EXACT, where=""):
    """Compare two values field by field and item by item, floats to a relative tolerance."""
    if dataclasses.is_dataclass(expected):
        assert isinstance(found, type(expected)), where
        names = [field.name for field in dataclasses.fields(expected) if field.name not in but]
        pairs = {f".{name}": (getattr(found, name), getattr(expected, name)) for name in names}
    elif isinstance(expected, Mapping):
        assert set(found) == set(expected), where
        pairs = {f"[{key}]": (found[key], value) for key, value in expected.items()}
    elif isinstance(expected, tuple | list):
        assert len(found) == len(expected), where
        pairs = {f"[{i}]": pair for i, pair in enumerate(zip(found, expected, strict=True))}
    elif isinstance(expected, np.ndarray | float):
        assert found is not None, where
        np.testing.assert_allclose(found, expected, rtol=rtol, atol=0, err_msg=where)
        return
    else:
        assert found == expected, where
        return
    for place, pair in pairs.items():
        assert_same(*pair, but=but, rtol=rtol, where=where + place)
