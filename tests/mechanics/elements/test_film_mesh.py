"""The mesh of the film's cross-section covers it, follows the rings, and stays small."""

import numpy as np
import pytest

from memscal.mechanics.elements.mesh import film_triangles

EVEN = np.linspace(0.0, 1.0, 201)
TOWARD_AN_EDGE = np.append(0.125 * (1 - np.geomspace(1.0, 1e-5, 150)), 0.125)
LIKE_A_ROD = 0.125 * (1 - np.linspace(1.0, 0.0, 200) ** 4)
UNEVEN = np.unique(np.concatenate([np.linspace(0, 2, 60), 1.2 + 0.03 * 0.5 ** np.arange(12)]))
RINGS = {"even": EVEN, "edge": TOWARD_AN_EDGE, "rod": LIKE_A_ROD, "uneven": UNEVEN}


@pytest.mark.parametrize("name", RINGS)
def test_corners_on_the_surface_are_rings_and_the_last_ring_is_one(name):
    mesh = film_triangles(RINGS[name], radius=12.5)
    rings = RINGS[name]
    surface = np.sort(mesh.points[mesh.points[:, 1] == 0, 0])
    inside = surface[surface <= rings[-1]]
    assert np.all(np.isin(inside, rings))
    assert inside[-1] == rings[-1]
    # A quartic has four intervals between its nodes: no ring is without a node of its own.
    assert np.max(np.diff(np.searchsorted(rings, inside))) <= 2
