"""Floats that two computations find alike, but for the order of their sums."""

from typing import Any

import numpy as np


def assert_same_to_rounding(found: Any, expected: Any) -> None:
    """Compare arrays to 1e-12 of the largest value."""
    close = 1e-12 * float(np.max(np.abs(expected)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=close)
