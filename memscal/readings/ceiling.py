"""Readings at a ceiling, where amplifier or converter is at its end: found in holds, left out."""

from collections.abc import Sequence

import numpy as np
from scipy.special import bdtrc

from memscal.model.arrays import FloatArray, IndexArray

#: Rows of a hold pile up at a ceiling if chance makes so many of them once in so many logs, and
#: their share is so many times that of any other hold at its own highest.
_CHANCE = 1e-6
_FARTHER = 2.0


def without_clipped(
    u: FloatArray, ceiling: float, highest: FloatArray | None = None
) -> tuple[FloatArray, int]:
    """Return readings, missing where they, or their ``highest`` row, are at a ceiling; how many."""
    clipped = (u if highest is None else highest) >= ceiling
    return np.where(clipped, np.nan, u), int(clipped.sum())


def ceiling_of_holds(
    u: FloatArray, held: Sequence[IndexArray], highest: FloatArray
) -> float | None:
    """Return the largest reading of a log if rows of holds pile up at it, as no noise makes them.

    ``held``: the rows of each hold, ``highest`` (m,) its largest reading.
    """
    piled = np.array([np.sum(u[run] == u[run].max()) for run in held])
    size = np.array([run.size for run in held])
    share = piled / size
    below = highest < highest.max()
    if not below.any():
        return None
    fullest = int(np.argmax(share * ~below))
    usual = piled[below].sum() / size[below].sum()
    chance = bdtrc(piled[fullest] - 1, size[fullest], usual)
    beyond = share[fullest] > _FARTHER * share[below].max()
    return float(highest.max()) if beyond and chance < _CHANCE else None
