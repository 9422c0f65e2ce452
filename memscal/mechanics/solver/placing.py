r"""Where the rings of a contact are placed.

Even rings carry the contact, and a few crowd around every contact radius that will be asked for:
there the pressure bends like a square root, and the shear of a film that sticks at once is
singular.  Under a rod's sharp edge all rings crowd towards it.  Nothing else depends on the
placing: it is found with a coarse contact, and the result is compared on twice as many rings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["even_rings", "rings_around", "rings_under_a_rod"]

# Rings beyond the largest contact, so that it can end where it will.
_MARGIN = 4
# Halvings of the spacing towards a contact's edge, on either side.
_HALVINGS = 5
# A rod's rings crowd as the fourth power of their number counted from the edge.
_CROWDING = 4.0


def even_rings(reach: float, count: int) -> FloatArray:
    """Return ``count`` even rings from the axis to ``reach`` (m)."""
    return np.linspace(0.0, reach, count)


def rings_around(edges: Sequence[float], reach: float, count: int) -> FloatArray:
    """Return rings that resolve contacts of given radii.

    Parameters
    ----------
    edges : sequence of float
        Expected contact radii, in m.
    reach : float
        Radius that pressure reaches, in m: the largest edge, or more where there is no edge.
    count : int
        Even rings up to ``reach``; those at the edges come on top.
    """
    spacing = reach / count
    rings = np.asarray(spacing * np.arange(count + 1 + _MARGIN), dtype=np.float64)
    for edge in edges:
        steps = spacing * 0.5 ** np.arange(1, _HALVINGS + 1)
        rings = np.concatenate([rings, edge - steps, [edge], edge + steps])
    rings = np.asarray(np.unique(rings))
    # Even rings that fall among the crowd would only make slivers.
    finest = spacing * 0.5**_HALVINGS
    keep = np.ones(rings.size, dtype=bool)
    last = 0
    for i in range(1, rings.size):
        keep[i] = rings[i] - rings[last] > 0.6 * finest
        last = i if keep[i] else last
    return np.asarray(rings[keep])


def rings_under_a_rod(radius: float, count: int) -> FloatArray:
    """Return rings from the axis to a rod's edge that crowd towards it, and one on the edge."""
    inward = np.linspace(1.0, 0.0, count) ** _CROWDING
    return radius * (1.0 - inward)
