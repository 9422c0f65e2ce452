"""Comparisons of what depends on the machine: times, and floats that differ by rounding."""

import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np


def assert_same_to_rounding(found, expected):
    """Compare arrays to 1e-12 of the largest value."""
    close = 1e-12 * float(np.max(np.abs(expected)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=close)


def once(work: Callable[[], Any]) -> float:
    """Seconds that one run takes."""
    start = perf_counter()
    work()
    return perf_counter() - start


def show(what: str, ratio: float, stated: float, *, gross=5.0):
    """Print a ratio of times beside the stated one; only a gross excess is a fault.

    A busy machine may slow down one of two computations by much.
    """
    sys.stdout.write(f"\n{what}: {ratio:.3g} (stated: below {stated:.3g})\n")
    assert ratio < gross * stated


def turns(one: Callable[[], Any], other: Callable[[], Any], rounds: int) -> float:
    """Shortest time of one, in units of the other's; they take turns, and each warms up."""
    one(), other()
    pairs = [(once(one), once(other)) for _ in range(rounds)]
    return min(pair[0] for pair in pairs) / min(pair[1] for pair in pairs)
