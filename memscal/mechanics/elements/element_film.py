"""Bonded film by finite elements: compliance of its surface, and the field below it.

The equations (:mod:`memscal.mechanics.elements.mixed`) are factorised once and solved for a unit
traction on every ring.  The traction of the base does the same work as the forces that hold its
nodes, and its integral is the load to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import DomainError
from memscal.mechanics.elements.mesh import film_triangles
from memscal.mechanics.elements.mixed import MixedSystem, smooth
from memscal.mechanics.surface import SurfaceCompliance
from memscal.model.arrays import FloatArray
from memscal.model.field_mesh import FieldMesh
from memscal.model.film import ElasticFilm

# A quartic triangle has 15 nodes, at quarters of its sides and of the lines between them: they
# are the nodes of four quadratic triangles.
_QUARTERS = 4
_CORNERS = (((0, 0), (2, 0), (0, 2)), ((2, 0), (4, 0), (2, 2)), ((0, 2), (2, 2), (0, 4)),
            ((2, 2), (0, 2), (2, 0)))  # fmt: skip


def field_mesh(system: MixedSystem, solution: FloatArray, film: ElasticFilm) -> FieldMesh:
    """Return displacement and stress at all nodes; the strain is the mean over triangles there."""
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
    displacement[index, 0], displacement[index, 1] = solution[outward], -solution[inward]

    def averaged(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(index.ravel(), values.T.ravel()) / np.bincount(index.ravel()))

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
        notes=f"Linear elastic film, E = {film.young_modulus:g} Pa, nu = {film.poisson_ratio:g}, "
        f"thickness {film.thickness * 1e3:g} mm, bonded at z = 0. Stress positive in tension.",
    )


def _at_local_points(system: MixedSystem, solution: FloatArray, local: FloatArray) -> Any:
    """Return the displacement's gradient and the mean pressure at points of every triangle."""
    import skfem

    basis, points = system.displacement, (local.T, np.ones(local.shape[0]))
    at_nodes = skfem.Basis(basis.mesh, basis.elem, quadrature=points)
    moved, pressed = np.split(solution, [basis.N])
    cubic = at_nodes.with_element(system.pressure.elem)
    return at_nodes.interpolate(moved).grad, np.asarray(cubic.interpolate(pressed))


def _quadratic_triangles(
    index: NDArray[np.int64], local: FloatArray, system: MixedSystem
) -> NDArray[np.int64]:
    """Return four quadratic triangles for each quartic one, anticlockwise with z upward."""
    place = {tuple(np.rint(_QUARTERS * point).astype(int)): i for i, point in enumerate(local)}
    quarters = []
    for corners in _CORNERS:
        around = [*corners, corners[0]]
        middles = [((a[0] + b[0]) // 2, (a[1] + b[1]) // 2) for a, b in pairwise(around)]
        quarters.append(index[[place[node] for node in (*corners, *middles)]].T)
    triangles = np.concatenate(quarters)
    # With the depth as second coordinate, what turns anticlockwise there is clockwise here.
    r, depth = system.displacement.mesh.p[:, system.displacement.mesh.t]
    turn = (r[1] - r[0]) * (depth[2] - depth[0]) - (r[2] - r[0]) * (depth[1] - depth[0])
    turned = np.tile(turn > 0, len(_CORNERS))
    triangles[turned] = triangles[turned][:, [0, 2, 1, 5, 4, 3]]
    return triangles


# Tractions solved together: bounds the memory.
_BATCH = 128
# Radii between two nodes of the base at which its stress is tabulated for its spectrum.
_PER_NODE = 4


@dataclass(frozen=True, eq=False)
class ElementFilm:
    """A bonded film with tractions on rings ``r`` (m, from 0) and a free edge at ``radius`` (m)."""

    film: ElasticFilm
    r: FloatArray
    radius: float = 25e-3
    refinement: int = 1  # how many times shorter than by default the sides of the triangles are

    def __post_init__(self) -> None:
        if self.r[-1] > self.radius:
            raise DomainError(
                f"The outermost ring, at {self.r[-1] * 1e3:.4g} mm, lies beyond the film's edge at "
                f"{self.radius * 1e3:.4g} mm.",
                cure="Give a wider film, or a smaller contact.",
            )

    @cached_property
    def system(self) -> MixedSystem:
        """The finite-element equations, in film thicknesses and shear moduli."""
        rings, radius = self.r / self.film.thickness, self.radius / self.film.thickness
        mesh = film_triangles(rings, radius=radius, thickness=1.0, refinement=self.refinement)
        return MixedSystem(mesh, self.film.poisson_ratio)

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Displacements of the rings under tractions on the rings."""
        system, rings = self.system, self.r / self.film.thickness
        line, outward, inward = system.side(0.0)
        hats, seen = line.loads_of_hats(rings).tocsc(), line.at(rings)
        scale = self.film.thickness / self.film.shear_modulus
        moved = np.empty((2, 2, rings.size, rings.size))
        for source, unknowns in enumerate((inward, outward)):
            for start in range(0, rings.size, _BATCH):
                batch = slice(start, start + _BATCH)
                solution = system.solve(unknowns, hats[:, batch].toarray())
                moved[source, 0, :, batch] = scale * (seen @ solution[inward])
                moved[source, 1, :, batch] = scale * (seen @ solution[outward])
        return SurfaceCompliance(self.r, moved[0, 0], moved[1, 0], moved[0, 1], moved[1, 1])

    @property
    def discretisation(self) -> str:
        """What was discretised and how finely, in words."""
        triangles = self.system.mesh.triangles.shape[0]
        return (
            f"finite elements, quartic displacement and cubic pressure (Taylor-Hood): {triangles} "
            f"triangles, {self.system.free.size} unknowns, free edge at {self.radius * 1e3:g} mm"
        )

    def field(self, pressure: FloatArray, shear: FloatArray) -> ElementField:
        """Return the field under ``pressure`` and ``shear`` (Pa) at the rings, shapes (n,)."""
        line, outward, inward = self.system.side(0.0)
        hats = line.loads_of_hats(self.r / self.film.thickness)
        modulus = self.film.shear_modulus
        loads = np.concatenate([hats @ (pressure / modulus), hats @ (shear / modulus)])
        solution = self.system.solve(np.concatenate([inward, outward]), loads[:, None])
        return ElementField(self.film, self.radius, self.system, solution[:, 0])


@dataclass(frozen=True, eq=False)
class ElementField:
    """The field in a film under a traction; see :class:`memscal.mechanics.surface.FilmField`."""

    film: ElasticFilm
    radius: float
    system: MixedSystem
    solution: FloatArray  # displacements in film thicknesses, mean pressures in shear moduli

    def base_normal(self, r: FloatArray) -> FloatArray:
        """Return the normal stress at the base in Pa; zero beyond the film's edge."""
        return self._at_base(0, r)

    def base_shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction of the base on the film in Pa; zero beyond its edge."""
        return self._at_base(1, r)

    def base_spectrum(self, k: FloatArray) -> FloatArray:
        """Return the transform of the base stress at ``k`` (rad/m), in N, to 1e-5 of the load."""
        r = self._fine_radii
        return hankel_transform(r, self.base_normal(r), np.ravel(k)).reshape(np.shape(k))

    def base_shear_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\tau\,J_1(kr)\,r\,dr` of the base shear at ``k``, in N."""
        r = self._fine_radii
        return hankel_transform(r, self.base_shear(r), np.ravel(k), order=1).reshape(np.shape(k))

    def depression(self, r: FloatArray) -> FloatArray:
        """Return the normal displacement of the surface in m, positive into the film."""
        return self._at_surface(1, r)

    def outward(self, r: FloatArray) -> FloatArray:
        """Return the radial displacement of the surface in m; see :meth:`depression`."""
        return self._at_surface(0, r)

    def mesh(self) -> FieldMesh:
        """Return displacement and stress inside the film, on quadratic triangles."""
        return field_mesh(self.system, self.solution, self.film)

    @property
    def _fine_radii(self) -> FloatArray:
        """Radii at which the base's tractions are tabulated for their spectra, in m."""
        nodes = self.system.side(1.0)[0].r * self.film.thickness
        index = np.arange(_PER_NODE * (nodes.size - 1) + 1) / _PER_NODE
        return np.interp(index, np.arange(nodes.size), nodes)

    @cached_property
    def _base(self) -> tuple[Callable[[FloatArray], FloatArray], ...]:
        """Normal and radial traction at the base, in Pa, at radii in film thicknesses."""
        from scipy.sparse.linalg import spsolve

        line, outward, inward = self.system.side(1.0)
        forces = self.system.matrix[np.concatenate([inward, outward])] @ self.solution
        pushed, held = forces.reshape(2, -1) * self.film.shear_modulus
        mass = csc_array(line.mass)
        # On the axis there is no shear.
        shear = np.append(0.0, spsolve(mass[1:, 1:], held[1:]))
        return smooth(line, -spsolve(mass, pushed), 1), smooth(line, shear, -1)

    def _at_base(self, component: int, r: FloatArray) -> FloatArray:
        flat = np.ravel(np.asarray(r, dtype=np.float64))
        values = self._base[component](np.minimum(flat, self.radius) / self.film.thickness)
        return np.where(flat <= self.radius, values, 0.0).reshape(np.shape(r))

    def _at_surface(self, component: int, r: FloatArray) -> FloatArray:
        """Return the displacement outward (0) or inward (1) at ``r``, in m."""
        flat = np.ravel(np.asarray(r, dtype=np.float64))
        if np.any(flat > self.radius):
            raise DomainError(
                f"There is no surface at {flat.max():g} m: the film ends at {self.radius:g} m.",
                cure="Ask for smaller radii, or give a wider film.",
            )
        line, *unknowns = self.system.side(0.0)
        values = line.at(flat / self.film.thickness) @ self.solution[unknowns[component]]
        return np.asarray(self.film.thickness * values).reshape(np.shape(r))
