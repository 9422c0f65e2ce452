"""Presses of a log without positions, which are counted: each is at the next place."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.holds import Holds

#: Shares of the way from lifted to pressed: above the second a load presses, at the first it is
#: lifted again; so with a depth, which waits anywhere above the film.
_ENDS = {"load": (0.05, 0.1), "depth": (0.4, 0.6)}
#: A log is lifted, and presses, in at least so many rows.
_FEWEST = 5


def count_presses(press: FloatArray, kind: str) -> tuple[NDArray[Any], int]:
    """Count the presses before each row of a load or a depth, (n,); return it, and their number."""
    stated = np.sort(press[np.isfinite(press)])
    way = np.zeros(press.size)
    if stated.size >= 2 * _FEWEST:
        lifted, top = stated[[_FEWEST - 1, -_FEWEST]]
        way = (press - lifted) / (top - lifted or 1.0)
    low, high = _ENDS[kind]
    # Between the ends the indenter does what it did before: noise there is no press.
    told = (way < low) | (way > high)
    last = np.maximum.accumulate(np.where(told, np.arange(press.size), 0))
    changes = np.diff((way[last] > high).astype(int), prepend=0)
    return np.cumsum(changes < 0), int(np.sum(changes > 0))


def require_all_held(holds: Holds, presses: int) -> None:
    """Refuse holds that are not as many as the presses that were counted."""
    held = np.unique(holds.mean["x"].round(9)).size
    if presses != held:
        raise InputError(
            f"Of {presses} presses that are counted {held} are holds.",
            why="Where a press is missing or too many, all later places are shifted.",
            cure="Correct the log, or give the positions (--x COLUMN).",
        )
