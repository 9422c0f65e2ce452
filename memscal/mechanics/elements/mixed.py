r"""Mixed finite elements: quartic displacement and cubic mean pressure on triangles.

With the strain :math:`\varepsilon`, its deviator :math:`e` and the mean pressure :math:`P`,

.. math::

    \int \left(2G\,e(u):e(v) - P\,\mathrm{div}\,v\right) r\,dr\,dz = \text{work of the tractions},
    \qquad
    \int \left(\mathrm{div}\,u + P/K\right) Q\,r\,dr\,dz = 0,

with :math:`1/K = 3(1-2\nu)/2G(1+\nu)`, which vanishes where the film is incompressible.  The pair
is Taylor and Hood's of fourth order, which does not lock (Boffi, Brezzi and Fortin 2013, chapter
8).  Lengths are in film thicknesses and stresses in shear moduli, or the direct solver would lose
digits.  The second coordinate is the depth, and the second displacement the depression.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array, csr_array

from memscal.axisymmetry.hankel import gauss_between
from memscal.mechanics.elements.mesh import TriangleMesh
from memscal.model.arrays import FloatArray

_DEGREE = 4
_SMOOTH_DEGREE = 5
# Exact for the product of two quartics and r.
_ORDER = 5


@dataclass(frozen=True, eq=False)
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
        along = (r - corners[side]) / (corners[side + 1] - corners[side])
        columns = _DEGREE * side[:, None] + np.arange(_DEGREE + 1)
        return _sparse(_quartics(along), columns, self.r.size)

    @cached_property
    def mass(self) -> csr_array:
        r"""Matrix :math:`\int N_i N_j\,r\,dr`."""
        nodes, weights = gauss_between(self.corners, _ORDER)
        values = self.at(nodes)
        return csr_array(values.T @ values.multiply((weights * nodes)[:, None]))

    def loads_of_hats(self, rings: FloatArray) -> csr_array:
        r"""Return :math:`\int N_i \phi_j\,r\,dr` of the rings' hats, exactly."""
        knots = np.union1d(rings, self.corners[self.corners < rings[-1]])
        nodes, weights = gauss_between(knots, _ORDER)
        hats = _hat_values(rings, nodes)
        return csr_array(self.at(nodes).T @ hats.multiply((weights * nodes)[:, None]))


def _hat_values(rings: FloatArray, r: FloatArray) -> csr_array:
    """Return the matrix, shape (r.size, rings.size), of the rings' hats at ``r``."""
    element = np.clip(np.searchsorted(rings, r, side="right") - 1, 0, rings.size - 2)
    rising = (r - rings[element]) / (rings[element + 1] - rings[element])
    values = np.stack([1 - rising, rising], axis=1)
    return _sparse(values, np.stack([element, element + 1], axis=1), rings.size)


def _sparse(values: FloatArray, columns: NDArray[np.int64], count: int) -> csr_array:
    """Return the matrix of ``count`` columns that has a row of ``values`` at ``columns`` a row."""
    rows = np.arange(0, columns.size + 1, columns.shape[1])
    return csr_array((values.ravel(), columns.ravel(), rows), shape=(len(values), count))


def smooth(
    line: QuarticLine, values: FloatArray, parity: int
) -> Callable[[FloatArray], FloatArray]:
    """Return the even (1) or odd (-1) quintic spline of ``r`` nearest to a quartic's values."""
    # Knots at the corners, nearest in the integral of (.)^2 r dr: that of (.) r dr stays.
    from scipy.interpolate import make_lsq_spline

    r, weights = gauss_between(line.corners, _ORDER + 1)
    quartic, weights = line.at(r) @ values, np.sqrt(weights * r)
    knots = np.concatenate([line.r[2:-1:2], np.full(_SMOOTH_DEGREE + 1, line.r[-1])])

    def mirrored(half: FloatArray, sign: int) -> FloatArray:
        return np.concatenate([sign * half[::-1], half])

    # Mirrored about the axis, so that what is fitted has the right symmetry.
    table = mirrored(r, -1), mirrored(quartic, parity), mirrored(knots, -1)
    spline = make_lsq_spline(*table, k=_SMOOTH_DEGREE, w=mirrored(weights, 1))
    return lambda radius: np.asarray(spline(radius))


def _quartics(along: FloatArray) -> FloatArray:
    """Return the five Lagrange quartics of a side, shape (n, 5), at ``along`` from 0 to 1."""
    nodes = np.arange(_DEGREE + 1) / _DEGREE
    values = np.ones((along.size, _DEGREE + 1))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            values[:, i] *= (along - other) / (node - other)
    return values


# Exact for what is polynomial: two gradients and r.  It is so also on the axis, where u/r is.
_QUADRATURE = 8


@dataclass(frozen=True, eq=False)
class MixedSystem:
    """The equations of a bonded film with a free edge, in film thicknesses, and their factors."""

    mesh: TriangleMesh
    poisson_ratio: float

    def __getstate__(self) -> dict[str, Any]:
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
    def pressure(self) -> Any:
        """Basis of the mean pressure."""
        import skfem

        return self.displacement.with_element(skfem.ElementTriP3())

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

        coupled = squeeze.assemble(self.displacement, self.pressure)
        stiff, soft = distortion.assemble(self.displacement), compression.assemble(self.pressure)
        return csr_array(block_array([[stiff, coupled.T], [coupled, soft]]))

    @cached_property
    def free(self) -> NDArray[np.int64]:
        """What is solved for: all unknowns but those that are held."""
        return np.setdiff1d(np.arange(self.matrix.shape[0]), self._held)

    @cached_property
    def _held(self) -> NDArray[np.int64]:
        """Nothing moves at the base, and nothing outward on the axis."""
        deepest = self.mesh.points[:, 1].max()
        base = self.displacement.get_dofs(lambda x: x[1] == deepest).all()
        return np.union1d(base, self.displacement.get_dofs(lambda x: x[0] == 0).all(["u^1"]))

    def side(self, depth: float) -> tuple[QuarticLine, NDArray[np.int64], NDArray[np.int64]]:
        """Return the side of the mesh at a depth, with its outward and inward unknowns."""
        on_side = self.displacement.get_dofs(lambda x: x[1] == depth)
        outward, inward = on_side.all(["u^1"]), on_side.all(["u^2"])
        r = self.displacement.doflocs[0]
        outward, inward = outward[np.argsort(r[outward])], inward[np.argsort(r[inward])]
        return QuarticLine(r[inward]), outward, inward

    @cached_property
    def _factors(self) -> Any:
        from scipy.sparse.linalg import splu

        # SuperLU's defaults.  Its symmetric mode must delay the pivots of the pressures, which are
        # zero where the film is incompressible: it fills four times as much, for 10 times as long.
        return splu(csc_array(self.matrix[self.free][:, self.free]))

    def solve(self, unknowns: NDArray[np.int64], loads: FloatArray) -> FloatArray:
        """Return all unknowns, shape (all, n), under loads, shape (unknowns.size, n), on some."""
        right = np.zeros((self.matrix.shape[0], loads.shape[1]))
        right[unknowns] = loads
        right[self.free] = self._factors.solve(right[self.free])
        right[self._held] = 0.0
        return right
