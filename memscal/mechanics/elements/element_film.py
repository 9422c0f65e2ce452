r"""Bonded film by mixed finite elements: compliance of its surface, and the field below it.

The displacement is quartic and the mean pressure cubic on triangles.  With the strain
:math:`\varepsilon`, its deviator :math:`e` and the mean pressure :math:`P`,

.. math::

    \int \left(2G\,e(u):e(v) - P\,\mathrm{div}\,v\right) r\,dr\,dz = \text{work of the tractions},
    \qquad
    \int \left(\mathrm{div}\,u + P/K\right) Q\,r\,dr\,dz = 0,

with :math:`1/K = 3(1-2\nu)/2G(1+\nu)`, which vanishes where the film is incompressible.  The pair
is Taylor and Hood's of fourth order, which does not lock (Boffi, Brezzi and Fortin 2013, chapter
8).  Lengths are in film thicknesses and stresses in shear moduli, or the direct solver would lose
digits.  The second coordinate is the depth, and the second displacement the depression.

The equations are factorised once and solved for a unit traction on every ring.  The traction of
the base does the same work as the forces that hold its nodes; its integral is the load to rounding.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import block_array, csc_array, csr_array

from memscal.axisymmetry.hankel import gauss_between, hankel_transform, up_to
from memscal.errors import DomainError
from memscal.mechanics.elements.mesh import TriangleMesh, film_triangles
from memscal.mechanics.surface import SurfaceCompliance, anticlockwise
from memscal.model.arrays import ArrayFunction, FloatArray, IndexArray, Values, array_record, slices
from memscal.model.field_mesh import FieldMesh
from memscal.model.film import ElasticFilm
from memscal.progress import Task

_DEGREE = 4
_SMOOTH_DEGREE = 5
# Exact for the product of two quartics and r.
_ORDER = 5


@array_record
class QuarticLine:
    """Quartics on a straight side of a mesh; ``r`` are corners and quarters, shape (4 m + 1,)."""

    r: FloatArray

    @property
    def corners(self) -> FloatArray:
        """Radii of the triangles' corners."""
        return self.r[::_DEGREE]

    def at(self, r: FloatArray) -> csr_array:
        """Return the matrix, shape (r.size, nodes), from nodal values to values at ``r``."""
        corners = self.corners
        side = np.clip(np.searchsorted(corners, r, side="right") - 1, 0, corners.size - 2)
        along = (r - corners[side]) / np.diff(corners)[side]
        columns = _DEGREE * side[:, None] + np.arange(_DEGREE + 1)
        # The five Lagrange quartics of a side.
        nodes = np.arange(_DEGREE + 1) / _DEGREE
        quartics = np.vander(along, _DEGREE + 1) @ np.linalg.inv(np.vander(nodes))
        rows = np.arange(0, columns.size + 1, _DEGREE + 1)
        return csr_array((quartics.ravel(), columns.ravel(), rows), shape=(r.size, self.r.size))

    @cached_property
    def mass(self) -> csc_array:
        r"""Matrix :math:`\int N_i N_j\,r\,dr`."""
        nodes, weights = gauss_between(self.corners, _ORDER)
        values = self.at(nodes)
        return csc_array(values.T @ values.multiply((weights * nodes)[:, None]))

    def loads_of_hats(self, rings: FloatArray) -> csr_array:
        r"""Return :math:`\int N_i \phi_j\,r\,dr` of the rings' hats, exactly."""
        from scipy.interpolate import BSpline

        knots = np.union1d(rings, self.corners[self.corners < rings[-1]])
        nodes, weights = gauss_between(knots, _ORDER)
        hats = BSpline.design_matrix(nodes, np.pad(rings, 1, mode="edge"), 1)
        return csr_array(self.at(nodes).T @ hats.multiply((weights * nodes)[:, None]))


def smooth(line: QuarticLine, values: FloatArray, parity: int) -> ArrayFunction:
    """Return the even (1) or odd (-1) quintic spline of ``r`` nearest to a quartic's values."""
    # Knots at the corners, nearest in the integral of (.)^2 r dr: that of (.) r dr stays.
    from scipy.interpolate import make_lsq_spline

    r, weights = gauss_between(line.corners, _ORDER + 1)
    quartic = line.at(r) @ values
    weights = np.sqrt(weights * r)
    knots = np.append(line.r[2:-1:2], np.full(_SMOOTH_DEGREE + 1, line.r[-1]))

    def mirrored(half: FloatArray, sign: int) -> FloatArray:
        return np.append(sign * half[::-1], half)

    # Mirrored about the axis, so that what is fitted has the right symmetry.
    table = mirrored(r, -1), mirrored(quartic, parity), mirrored(knots, -1)
    return make_lsq_spline(*table, k=_SMOOTH_DEGREE, w=mirrored(weights, 1))


# Exact for what is polynomial: two gradients and r.  It is so also on the axis, where u/r is.
_QUADRATURE = 8


@array_record
class MixedSystem:
    """The equations of a bonded film with a free edge, in film thicknesses, and their factors."""

    mesh: TriangleMesh
    poisson_ratio: float

    def __getstate__(self) -> Values:
        """Return what it is made of; the factorisation cannot be copied, and is soon remade."""
        return {"mesh": self.mesh, "poisson_ratio": self.poisson_ratio}

    @cached_property
    def displacement(self) -> Any:
        """Basis of the displacement, outward and into the film."""
        import skfem

        mesh = skfem.MeshTri(
            np.ascontiguousarray(self.mesh.points.T), np.ascontiguousarray(self.mesh.triangles.T)
        )
        return skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP4()), intorder=_QUADRATURE)

    @cached_property
    def matrix(self) -> csr_array:
        """All equations, symmetric: those of the displacement, then those of the pressure."""
        import skfem
        from skfem.helpers import ddot, div, sym_grad

        softness = 3 * (1 - 2 * self.poisson_ratio) / (2 * (1 + self.poisson_ratio))

        def dilatation(u: Any, r: Any) -> Any:
            return div(u) + u[0] / r

        # scikit-fem carries no types.
        @skfem.BilinearForm  # type: ignore[untyped-decorator]
        def distortion(u: Any, v: Any, w: Any) -> Any:
            r = w.x[0]
            whole = ddot(sym_grad(u), sym_grad(v)) + u[0] * v[0] / r**2
            return 2 * (whole - dilatation(u, r) * dilatation(v, r) / 3) * r

        @skfem.BilinearForm  # type: ignore[untyped-decorator]
        def squeeze(u: Any, q: Any, w: Any) -> Any:
            return -dilatation(u, w.x[0]) * q * w.x[0]

        @skfem.BilinearForm  # type: ignore[untyped-decorator]
        def compression(p: Any, q: Any, w: Any) -> Any:
            return -softness * p * q * w.x[0]

        pressure = self.displacement.with_element(skfem.ElementTriP3())
        coupled = squeeze.assemble(self.displacement, pressure)
        stiff = distortion.assemble(self.displacement)
        soft = compression.assemble(pressure)
        return csr_array(block_array([[stiff, coupled.T], [coupled, soft]]))

    @cached_property
    def free(self) -> IndexArray:
        """What is solved for: all unknowns but those that are held."""
        return np.setdiff1d(np.arange(self.matrix.shape[0]), self._held)

    @cached_property
    def _held(self) -> IndexArray:
        """Nothing moves at the base, and nothing outward on the axis."""
        base = self.displacement.get_dofs(lambda x: x[1] == 1.0).all()
        return np.union1d(base, self.displacement.get_dofs(lambda x: x[0] == 0).all(["u^1"]))

    def side(self, depth: float) -> tuple[QuarticLine, IndexArray, IndexArray]:
        """Return the side of the mesh at a depth, with its outward and inward unknowns."""
        on_side = self.displacement.get_dofs(lambda x: x[1] == depth)
        outward = on_side.all(["u^1"])
        inward = on_side.all(["u^2"])
        r = self.displacement.doflocs[0]
        outward = outward[np.argsort(r[outward])]
        inward = inward[np.argsort(r[inward])]
        return QuarticLine(r[inward]), outward, inward

    @cached_property
    def _factors(self) -> Any:
        from scipy.sparse.linalg import splu

        # SuperLU's defaults.  Its symmetric mode must delay the pivots of the pressures, which are
        # zero where the film is incompressible: it fills four times as much, for 10 times as long.
        return splu(csc_array(self.matrix[self.free][:, self.free]))

    def solve(self, unknowns: IndexArray, loads: FloatArray) -> FloatArray:
        """Return all unknowns, (all,) or (all, n), under loads, (m,) or (m, n), on m of them."""
        right = np.zeros((self.matrix.shape[0], *loads.shape[1:]))
        right[unknowns] = loads
        right[self.free] = self._factors.solve(right[self.free])
        right[self._held] = 0.0
        return right


# A quartic triangle has 15 nodes, at quarters of its sides and of the lines between them: they
# are the nodes of four quadratic triangles, here by their numbers in the element's own order.
_QUARTERS = np.array(
    [
        (0, 4, 10, 3, 12, 9),
        (4, 1, 7, 5, 6, 13),
        (10, 7, 2, 14, 8, 11),
        (7, 10, 4, 14, 12, 13),
    ]
)


# Tractions solved together: bounds the memory.
_BATCH = 128
# Radii between two nodes of the base at which its stress is tabulated for its spectrum.
_PER_NODE = 4


@array_record
class ElementFilm:
    """A bonded film with tractions on rings ``r`` (m, from 0) and a free edge at ``radius`` (m)."""

    film: ElasticFilm
    r: FloatArray
    radius: float

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
        rings = self.r / self.film.thickness
        mesh = film_triangles(rings, radius=self.radius / self.film.thickness)
        return MixedSystem(mesh, self.film.poisson_ratio)

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Displacements of the rings under tractions on the rings."""
        unit = np.eye(2 * self.r.size)
        moved = np.empty_like(unit)
        task = Task("tractions", len(unit))
        for batch in slices(len(unit), _BATCH):
            field = self.field(*np.split(unit[:, batch], 2))
            moved[:, batch] = np.vstack([field.surface(self.r, order) for order in (0, 1)])
            task.tell(batch.stop)
        return SurfaceCompliance(self.r, moved)

    @property
    def discretisation(self) -> str:
        """What was discretised and how finely, in words."""
        triangles = len(self.system.mesh.triangles)
        return (
            f"finite elements, quartic displacement and cubic pressure (Taylor-Hood): {triangles} "
            f"triangles, {self.system.free.size} unknowns, free edge at {self.radius * 1e3:g} mm"
        )

    def field(self, pressure: FloatArray, shear: FloatArray) -> ElementField:
        """Return the field under ``pressure`` and ``shear`` (Pa) at the rings, (n,) or (n, m)."""
        line, outward, inward = self.system.side(0.0)
        hats = line.loads_of_hats(self.r / self.film.thickness)
        modulus = self.film.shear_modulus
        loads = np.concatenate([hats @ (pressure / modulus), hats @ (shear / modulus)])
        solution = self.system.solve(np.append(inward, outward), loads)
        return ElementField(self.film, self.radius, self.system, solution)


@array_record
class ElementField:
    """The field in a film under a traction, zero beyond the film's edge at ``radius`` (m)."""

    film: ElasticFilm
    radius: float
    system: MixedSystem
    solution: FloatArray  # displacements in film thicknesses, mean pressures in shear moduli

    def mesh(self) -> FieldMesh:
        """Return displacement and stress at all nodes, the strain as the mean over triangles."""
        import skfem

        film = self.film
        basis = self.system.displacement
        # Outward and inward unknowns of the 15 nodes of each triangle, in the element's own order.
        dofs = basis.element_dofs
        local = skfem.ElementTriP4.doflocs
        outward = dofs[0::2]
        inward = dofs[1::2]
        nodes, index = np.unique(inward, return_inverse=True)
        index = index.reshape(inward.shape)
        # The displacement's gradient and the mean pressure at the nodes of every triangle.
        rule = (local.T, np.ones(len(local)))
        at_nodes = skfem.Basis(basis.mesh, basis.elem, quadrature=rule)
        moved, pressed = np.split(self.solution, [basis.N])
        gradient = at_nodes.interpolate(moved).grad
        squeeze = np.asarray(at_nodes.with_element(skfem.ElementTriP3()).interpolate(pressed))
        r, depth = basis.doflocs[:, nodes]
        displacement = np.empty((nodes.size, 2))
        displacement[index, 0] = self.solution[outward]
        displacement[index, 1] = -self.solution[inward]

        def averaged(values: FloatArray) -> FloatArray:
            return np.bincount(index.ravel(), values.T.ravel()) / np.bincount(index.ravel())

        radial = averaged(gradient[0][0])
        vertical = averaged(gradient[1][1])
        hoop = np.divide(displacement[:, 0], r, out=radial.copy(), where=r > 0)
        slip = averaged(gradient[0][1] + gradient[1][0])
        mean = averaged(squeeze)
        volume = (radial + vertical + hoop) / 3
        stress = [2 * (strain - volume) - mean for strain in (radial, vertical, hoop)]
        points = film.thickness * np.column_stack([r, 1 - depth])
        return FieldMesh(
            points=points,
            triangles=anticlockwise(points, np.concatenate(np.moveaxis(index[_QUARTERS], 2, 1))),
            displacement=film.thickness * displacement,
            stress=film.shear_modulus * np.column_stack([*stress, -slip]),
            notes=f"Linear elastic film, E = {film.young_modulus:g} Pa, "
            f"nu = {film.poisson_ratio:g}, thickness {film.thickness * 1e3:g} mm, "
            "bonded at z = 0. Stress positive in tension.",
        )

    def spectrum(self, k: FloatArray, order: int) -> FloatArray:
        """Return the transform of normal stress or traction at ``k`` (rad/m), in N."""
        nodes = self.system.side(1.0)[0].r * self.film.thickness
        index = np.arange(_PER_NODE * (nodes.size - 1) + 1) / _PER_NODE
        r = np.interp(index, np.arange(nodes.size), nodes)
        return hankel_transform(r, self.base(r, order), k, order=order)

    @cached_property
    def _tractions(self) -> tuple[ArrayFunction, ...]:
        """Normal and radial traction at the base, in Pa, at radii in film thicknesses."""
        from scipy.sparse.linalg import spsolve

        line, outward, inward = self.system.side(1.0)
        forces = self.system.matrix[np.append(inward, outward)] @ self.solution
        pushed, held = forces.reshape(2, -1) * self.film.shear_modulus
        mass = line.mass
        # On the axis there is no shear.
        shear = np.append(0.0, spsolve(mass[1:, 1:], held[1:]))
        return smooth(line, -spsolve(mass, pushed), 1), smooth(line, shear, -1)

    def base(self, r: FloatArray, order: int) -> FloatArray:
        """Return normal stress or outward traction at the base in Pa."""
        h = self.film.thickness
        return up_to(self.radius / h, self._tractions[order], r / h)

    def surface(self, r: FloatArray, order: int) -> FloatArray:
        """Return depression or outward displacement of the surface in m."""
        flat = np.ravel(r)
        if np.any(flat > self.radius):
            raise DomainError(
                f"There is no surface at {flat.max():g} m: the film ends at {self.radius:g} m.",
                cure="Ask for smaller radii, or give a wider film.",
            )
        line, outward, inward = self.system.side(0.0)
        values = line.at(flat / self.film.thickness) @ self.solution[outward if order else inward]
        return self.film.thickness * values.reshape(np.shape(r) + values.shape[1:])
