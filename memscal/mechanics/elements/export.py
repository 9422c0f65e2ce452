"""The field inside the film on a mesh, for programs that draw or compare meshes."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.mechanics.elements.mixed import MixedSystem
from memscal.model.field_mesh import FieldMesh
from memscal.model.film import ElasticFilm
from memscal.model.validation import FloatArray

__all__ = ["field_mesh"]

# A quartic triangle has 15 nodes, at quarters of its sides and of the lines between them: they
# are the nodes of four quadratic triangles.
_QUARTERS = 4
_CORNERS = (((0, 0), (2, 0), (0, 2)), ((2, 0), (4, 0), (2, 2)), ((0, 2), (2, 2), (0, 4)),
            ((2, 2), (0, 2), (2, 0)))  # fmt: skip


def field_mesh(system: MixedSystem, solution: FloatArray, film: ElasticFilm) -> FieldMesh:
    """Return displacement and stress at all nodes of the quartic triangles.

    Parameters
    ----------
    system : MixedSystem
        The finite elements.
    solution : ndarray, shape (n,)
        Displacements in film thicknesses, then mean pressures in shear moduli.
    film : ElasticFilm
        Gives both their units.

    Notes
    -----
    The mean pressure is continuous; the strain is not, and is averaged over the triangles that
    meet at a node.
    """
    import skfem

    # Outward and inward unknowns of the 15 nodes of each triangle, in the element's own order.
    dofs = np.asarray(system.displacement.element_dofs)
    local = np.asarray(skfem.ElementTriP4.doflocs)
    outward, inward = dofs[0::2], dofs[1::2]
    nodes, index = np.unique(inward, return_inverse=True)
    index = index.reshape(inward.shape)
    gradient, squeeze = _at_local_points(system, solution, local)
    r, depth = system.displacement.doflocs[:, nodes]
    displacement = np.empty((nodes.size, 2))
    displacement[index, 0] = solution[outward]
    displacement[index, 1] = -solution[inward]

    def averaged(values: FloatArray) -> FloatArray:
        count = np.bincount(index.ravel())
        return np.asarray(np.bincount(index.ravel(), values.T.ravel()) / count)

    radial, vertical = averaged(gradient[0][0]), averaged(gradient[1][1])
    hoop = np.where(r > 0, displacement[:, 0] / np.where(r > 0, r, 1.0), radial)
    slip = averaged(gradient[0][1] + gradient[1][0])
    mean, volume = averaged(squeeze), (radial + vertical + hoop) / 3
    stress = [2 * (strain - volume) - mean for strain in (radial, vertical, hoop)]
    return FieldMesh(
        points=film.thickness * np.stack([r, 1 - depth], axis=1),
        triangles=_quadratic_triangles(index, local, system),
        displacement=film.thickness * displacement,
        stress=film.shear_modulus * np.stack([*stress, -slip], axis=1),
        notes=(
            f"Linear elastic film, E = {film.young_modulus:g} Pa, nu = {film.poisson_ratio:g}, "
            f"thickness {film.thickness * 1e3:g} mm, bonded at z = 0. "
            "Stress positive in tension."
        ),
    )


def _at_local_points(system: MixedSystem, solution: FloatArray, local: FloatArray) -> Any:
    """Return the displacement's gradient and the mean pressure at points of every triangle."""
    import skfem

    at_nodes = skfem.Basis(
        system.displacement.mesh,
        system.displacement.elem,
        quadrature=(local.T, np.ones(local.shape[0])),
    )
    moved, pressed = np.split(solution, [system.displacement.N])
    cubic = at_nodes.with_element(system.pressure.elem)
    return at_nodes.interpolate(moved).grad, np.asarray(cubic.interpolate(pressed))


def _quadratic_triangles(
    index: NDArray[np.int64], local: FloatArray, system: MixedSystem
) -> NDArray[np.int64]:
    """Return four quadratic triangles for each quartic one, anticlockwise with z upward."""
    place = {tuple(np.rint(_QUARTERS * each).astype(int)): i for i, each in enumerate(local)}
    found = []
    for corners in _CORNERS:
        around = [*corners, corners[0]]
        middles = [((a[0] + b[0]) // 2, (a[1] + b[1]) // 2) for a, b in pairwise(around)]
        found.append(index[[place[each] for each in (*corners, *middles)]].T)
    triangles = np.concatenate(found)
    # With the depth as second coordinate, what turns anticlockwise there is clockwise here.
    r, depth = system.displacement.mesh.p[:, system.displacement.mesh.t]
    turn = (r[1] - r[0]) * (depth[2] - depth[0]) - (r[2] - r[0]) * (depth[1] - depth[0])
    turned = np.tile(turn > 0, len(_CORNERS))
    triangles[turned] = triangles[turned][:, [0, 2, 1, 5, 4, 3]]
    return triangles
