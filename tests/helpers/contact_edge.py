"""The contact radius, from pressures or forces that are known at nodes only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["contact_radius", "load_beyond"]

FloatArray = NDArray[np.float64]


def load_beyond(r: FloatArray, pressure: FloatArray) -> FloatArray:
    """Load carried outside each radius, of a pressure that is linear between them."""
    inner, outer = r[:-1], r[1:]
    first, last = pressure[:-1], pressure[1:]
    rings = (outer - inner) * (first * (2 * inner + outer) + last * (inner + 2 * outer)) * np.pi / 3
    return np.append(np.cumsum(rings[::-1])[::-1], 0.0)


def contact_radius(r: FloatArray, beyond: FloatArray, guess: float) -> float:
    """Radius outside which no load is carried, by extrapolation from well inside the contact.

    Pressure goes to zero like a square root, so that ``beyond ** (2/3)`` goes to zero linearly
    in the square of the radius; and unlike the pressure itself it does not waver at the nodes
    that the edge cuts.
    """
    for _ in range(4):
        inside = (r >= 0.5 * guess) & (r <= 0.95 * guess)
        shape = np.polynomial.Polynomial.fit(beyond[inside] ** (2 / 3), r[inside] ** 2, 3)
        guess = float(np.sqrt(shape(0.0)))
    return guess
