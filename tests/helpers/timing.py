"""Time as a ratio: two computations that take turns on the same machine."""

import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any


def once(work: Callable[[], Any]) -> float:
    """Seconds that one run takes."""
    start = perf_counter()
    work()
    return perf_counter() - start


def show(what: str, ratio: float, stated: float, *, gross: float = 5.0) -> None:
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
