"""Triangles for the film at finite strain: fine below the contact, finest at a rod's edge."""

from __future__ import annotations

from typing import Any

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["mesh_below_a_rod", "mesh_below_a_sphere"]

# Sides below the contact, as a share of the rod's radius or of the contact's ...
_SHARE_OF_ROD = 0.25
_SHARE_OF_CONTACT = 0.025
# ... growing from one to the next away from it by this share, up to this many thicknesses near
# the contact and far from it.
_GROWTH = 0.3
_WIDEST_BELOW_A_ROD = 0.06
_WIDEST_BELOW_A_SPHERE = 0.08
_WIDEST_FAR = 0.6
_NEAR = 4.0
# Growth of the sides with the distance from where the surface is folded around the rod's edge.
_SLOPE = 0.7


def mesh_below_a_rod(
    *,
    rod: float,
    thickness: float,
    radius: float,
    refinement: float,
    fold: tuple[float, float],
    finest: float,
) -> Any:
    """Return a mesh of the cross-section that is finest where the rod's edge folds the surface.

    Parameters
    ----------
    rod, thickness, radius : float
        Radius of the rod, and thickness and radius of the film, in mm.
    refinement : float
        How many times shorter than by default the sides are.
    fold : tuple of float
        Undeformed radii between which the surface comes to lie around the edge, in mm.
    finest : float
        Sides there, in mm, at the refinement 1.
    """
    near = _WIDEST_BELOW_A_ROD * thickness / refinement
    side = min(_SHARE_OF_ROD * rod / refinement, near)
    even = np.linspace(0.0, rod, max(2, round(rod / side)) + 1)
    mesh = _tensor(even, (side, near), rod, thickness, radius, refinement)
    while True:
        r, z = mesh.p[:, mesh.t]
        longest = np.hypot(r - np.roll(r, 1, axis=0), z - np.roll(z, 1, axis=0)).max(axis=0)
        away = np.maximum(np.maximum(fold[0] - r, r - fold[1]), 0.0)
        distance = np.hypot(away, thickness - z).min(axis=0)
        # A triangle that is cut has sides up to sqrt(2) of the size that is asked for.
        long = longest > np.sqrt(2) * (finest / refinement + _SLOPE * distance)
        if not np.any(long & (longest < 3 * side)):
            return mesh
        mesh = mesh.refined(np.flatnonzero(long & (longest < 3 * side)))


def mesh_below_a_sphere(
    *, contact: float, thickness: float, radius: float, refinement: float
) -> Any:
    """Return a mesh of the cross-section, fine up to a radius somewhat beyond the contact's.

    Parameters
    ----------
    contact, thickness, radius : float
        Largest contact radius to expect, thickness and radius of the film, in mm.
    refinement : float
        How many times shorter than by default the sides are.
    """
    near = _WIDEST_BELOW_A_SPHERE * thickness / refinement
    side = min(_SHARE_OF_CONTACT * contact / refinement, near)
    count = int(np.ceil(contact / side))
    even = np.linspace(0.0, contact, count + 1)
    return _tensor(even, (side, near), contact, thickness, radius, refinement)


def _tensor(
    even: FloatArray,
    sides: tuple[float, float],
    contact: float,
    thickness: float,
    radius: float,
    refinement: float,
) -> Any:
    """Return triangles on a grid that grows away from the contact, outward and downward."""
    import skfem

    grow = 1 + _GROWTH / refinement
    (side, near), far = sides, _WIDEST_FAR * thickness / refinement
    r, step = [contact], side
    while r[-1] < radius:
        step = min(step * grow, near if r[-1] < contact + _NEAR * thickness else far)
        left = radius - r[-1]
        r.append(radius if left < 1.5 * step else r[-1] + step)
    depth, step = [0.0], side
    while depth[-1] < thickness:
        left = thickness - depth[-1]
        depth.append(thickness if left < 1.5 * step else depth[-1] + step)
        step = min(step * grow, near)
    heights = thickness - np.array(depth[::-1])
    heights[0] = 0.0
    return skfem.MeshTri.init_tensor(np.concatenate([even, r[1:]]), heights)
