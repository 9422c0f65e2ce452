r"""Where the rings of a contact are placed.

Even rings carry the contact, and a few crowd around every contact radius that will be asked for:
there the pressure bends like a square root, and the shear of a film that sticks at once is
singular.  Under a rod's sharp edge all rings crowd towards it.  Nothing else depends on the
placing: it is found with a coarse contact, and the result is compared on twice as many rings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["even_rings", "rings_around", "rings_under_a_rod"]

# Rings beyond the largest contact, so that it can end where it will.
_MARGIN = 4
# At a contact's edge the spacing has shrunk by this factor, and grows away from it by this share
# of the distance.
_FINEST = 1 / 16
_GROWTH = 0.4
# A rod's rings crowd as the fourth power of their number counted from the edge.
_CROWDING = 4.0
# Radii at which the spacing is tabulated.
_SAMPLES = 100_001


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
    r = np.linspace(0.0, reach + _MARGIN * spacing, _SAMPLES)
    local = np.full(r.size, spacing)
    for edge in edges:
        graded = np.hypot(_FINEST * spacing, _GROWTH * (r - edge))
        local = np.minimum(local, graded)
    # Where the number of rings passed so far is whole, there is one.
    passed = np.concatenate([[0.0], np.cumsum(np.diff(r) / 2 * (1 / local[1:] + 1 / local[:-1]))])
    return np.interp(np.arange(math.floor(passed[-1]) + 1), passed, r)


def rings_under_a_rod(radius: float, count: int) -> FloatArray:
    """Return rings from the axis to a rod's edge that crowd towards it, and one on the edge."""
    inward = np.linspace(1.0, 0.0, count) ** _CROWDING
    return radius * (1.0 - inward)
