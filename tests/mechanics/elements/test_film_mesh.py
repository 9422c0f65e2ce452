"""The mesh of the film's cross-section covers it, follows the rings, and stays small."""

import numpy as np
import pytest

from memscal.mechanics.elements.mesh import TriangleMesh, film_triangles

EVEN = np.linspace(0.0, 1.0, 201)
TOWARD_AN_EDGE = np.append(0.125 * (1 - np.geomspace(1.0, 1e-5, 150)), 0.125)
LIKE_A_ROD = 0.125 * (1 - np.linspace(1.0, 0.0, 200) ** 4)
UNEVEN = np.unique(np.concatenate([np.linspace(0, 2, 60), 1.2 + 0.03 * 0.5 ** np.arange(12)]))
RINGS = {"even": EVEN, "edge": TOWARD_AN_EDGE, "rod": LIKE_A_ROD, "uneven": UNEVEN}


def areas(mesh: TriangleMesh) -> np.ndarray:
    (r0, d0), (r1, d1), (r2, d2) = np.moveaxis(mesh.points[mesh.triangles], 0, -1)
    return np.abs((r1 - r0) * (d2 - d0) - (r2 - r0) * (d1 - d0)) / 2


@pytest.mark.parametrize("radius", [2.0, 12.5, 1000.0])
@pytest.mark.parametrize("name", RINGS)
def test_the_triangles_cover_the_film_once(name: str, radius: float) -> None:
    mesh = film_triangles(RINGS[name], radius=radius, thickness=1.0)
    assert areas(mesh).sum() == pytest.approx(radius, rel=1e-12)
    assert areas(mesh).min() > 0
    np.testing.assert_array_equal(np.unique(mesh.triangles), np.arange(mesh.points.shape[0]))
    # Every side belongs to two triangles, but those on the boundary: no node hangs.
    sides = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    pairs, count = np.unique(sides, axis=0, return_counts=True)
    (r1, d1), (r2, d2) = np.moveaxis(mesh.points[pairs[count == 1]], 0, -1)
    assert np.all(((r1 == r2) & np.isin(r1, [0, radius])) | ((d1 == d2) & np.isin(d1, [0, 1])))
    assert count.max() == 2


@pytest.mark.parametrize("name", RINGS)
def test_corners_on_the_surface_are_rings_and_the_last_ring_is_one(name: str) -> None:
    mesh = film_triangles(RINGS[name], radius=12.5, thickness=1.0)
    rings = RINGS[name]
    surface = np.sort(mesh.points[mesh.points[:, 1] == 0, 0])
    inside = surface[surface <= rings[-1]]
    assert np.all(np.isin(inside, rings))
    assert inside[-1] == rings[-1]
    # A quartic has four intervals between its nodes: no ring is without a node of its own.
    assert np.max(np.diff(np.searchsorted(rings, inside))) <= 2
