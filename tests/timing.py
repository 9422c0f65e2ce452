"""Time as a ratio: two computations that take turns on the same machine."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any


def once(work: Callable[[], Any]) -> float:
    """Seconds that one run takes."""
    start = perf_counter()
    work()
    return perf_counter() - start


def turns(one: Callable[[], Any], other: Callable[[], Any], rounds: int) -> float:
    """Median time of one, in units of the other's; they take turns, and each warms up."""
    one(), other()
    pairs = [(once(one), once(other)) for _ in range(rounds)]
    return median(pair[0] for pair in pairs) / median(pair[1] for pair in pairs)
