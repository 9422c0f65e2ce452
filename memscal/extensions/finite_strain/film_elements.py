r"""Finite elements for the film at finite strain: energy, forces and their exact tangent.

With the deformation gradient :math:`F` (components rr, rz, zr, zz, hoop), :math:`J = \det F` and
:math:`G = 2(C_1 + C_2)` the Mooney-Rivlin energy (neo-Hookean where :math:`C_2 = 0`) per
undeformed volume is

.. math:: W = C_1(I_1 - 3) + C_2(I_2 - 3) - (2C_1 + 4C_2)(J - 1) + \tfrac{K}{2}(J - 1)^2,
          \qquad I_1 = F:F, \quad I_2 = \mathrm{cof} F:\mathrm{cof} F,
          \quad K = \lambda + 2C_1,

without a logarithm, so that Newton's method may pass through trial states that are turned inside
out (Smith, de Goes and Kim, ACM Trans. Graphics 37 (2018) 12, eq. 13).  A share :math:`\kappa` of
:math:`K` acts directly, the rest by a pressure :math:`p = (\kappa - K)(J - 1)`, which stays finite
where :math:`K` does not.  Displacement is
quadratic and pressure linear on triangles of the undeformed cross-section (Taylor and Hood).
Lengths are in mm, stresses in MPa, forces in N; in SI units the direct solver loses digits.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from memscal.mechanics.elements.mesh import graded
from memscal.model.arrays import (
    ArrayPair,
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    value_record,
)
from memscal.model.film import ElasticFilm

_PASCAL_TO_MPA = 1e-6
# Share of K that does not go through the pressure, in shear moduli: enough to keep elements from
# buckling (Auricchio et al., IJNME 95 (2013)), too little to make them lock.
_HELD = 1.0


def determinant(F: FloatArray) -> FloatArray:
    """Return the volume ratio J of gradients of shape (..., 5)."""
    return (F[..., 0] * F[..., 3] - F[..., 1] * F[..., 2]) * F[..., 4]


def cofactor(F: FloatArray) -> FloatArray:
    """Return the derivative of J by the gradient, shape (..., 5)."""
    rr, rz, zr, zz, hoop = np.moveaxis(F, -1, 0)
    return np.stack([zz * hoop, -zr * hoop, -rz * hoop, rr * hoop, rr * zz - rz * zr], axis=-1)


# Pairs of components, the third that J has with them, and its sign.
_TRIPLES = ((0, 3, 4, 1), (1, 2, 4, -1), (0, 4, 3, 1), (3, 4, 0, 1), (1, 4, 2, -1), (2, 4, 1, -1))


def _curvature(F: FloatArray) -> FloatArray:
    """Return the second derivative of J by the gradient, linear in it, shape (..., 5, 5)."""
    second = np.zeros((*F.shape, 5))
    for i, j, k, sign in _TRIPLES:
        second[..., i, j] = second[..., j, i] = sign * F[..., k]
    return second


@value_record
class Rubber:
    """The film's material, in MPa: with lengths in mm, the unknowns are then of like size."""

    c1: float
    c2: float
    held: float  # kappa
    softness: float  # 1/(K - kappa), 0 where the film is incompressible

    @classmethod
    def of(cls, film: ElasticFilm) -> Rubber:
        r"""Return the material with the film's moduli at small strain."""
        G = film.shear_modulus * _PASCAL_TO_MPA
        ratio = film.mooney_rivlin_ratio or 0.0
        c1 = G / 2 / (1 + ratio)
        c2 = G / 2 * ratio / (1 + ratio)
        compliance = (1 - 2 * film.poisson_ratio) / (G - 2 * c2 * (1 - 2 * film.poisson_ratio))
        held = _HELD * G / (1 + 2 * _HELD * G * compliance)
        return cls(c1, c2, held, compliance / (1 - held * compliance))

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G at small strain."""
        return 2 * (self.c1 + self.c2)

    def energy(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the stored energy per undeformed volume, shape (...), where p has settled."""
        swelling = determinant(F) - 1
        strain = self.c1 * (np.sum(F**2, axis=-1) - 3) - (2 * self.c1 + 4 * self.c2) * swelling
        strain += self.c2 * (np.sum(cofactor(F) ** 2, axis=-1) - 3)
        return np.asarray(strain + self.held / 2 * swelling**2 + self.softness / 2 * p**2)

    def _pressing(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return minus the factor of the cofactor in the stress."""
        pressure = 2 * self.c1 + 4 * self.c2 + p - self.held * (determinant(F) - 1)
        return pressure[..., None]

    def stress(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the nominal (first Piola-Kirchhoff) stress, shape (..., 5)."""
        cof = cofactor(F)
        stress = 2 * self.c1 * F - self._pressing(F, p) * cof
        if self.c2:
            stress += 2 * self.c2 * (_curvature(F) @ cof[..., None])[..., 0]
        return stress

    def tangent(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the derivative of the nominal stress by the gradient, shape (..., 5, 5)."""
        cof = cofactor(F)
        second = _curvature(F)
        stiffness = self.held * cof[..., :, None] * cof[..., None, :]
        stiffness -= self._pressing(F, p)[..., None] * second
        if self.c2:
            stiffness += 2 * self.c2 * (second @ second + _curvature(cof))
        stiffness[..., range(5), range(5)] += 2 * self.c1
        return stiffness

    def cauchy(self, F: FloatArray, p: FloatArray) -> FloatArray:
        """Return the Cauchy stress rr, zz, hoop and rz, tension positive, shape (..., 4)."""
        S = np.moveaxis(self.stress(F, p), -1, 0)
        rr, rz, zr, zz, hoop = np.moveaxis(F, -1, 0)
        kirchhoff = [
            S[0] * rr + S[1] * rz,
            S[2] * zr + S[3] * zz,
            S[4] * hoop,
            S[0] * zr + S[1] * zz,
        ]
        return np.stack(kirchhoff, axis=-1) / determinant(F)[..., None]


# Sides below the contact, as a share of the rod's radius or of the contact's ...
_SHARE_OF_ROD = 0.5
_SHARE_OF_CONTACT = 0.025
# ... growing from one to the next away from it by this share, up to this many thicknesses near
# the contact and far from it, beyond so many thicknesses.
_GROWTH = 0.3
_WIDEST_NEAR = 0.08
_WIDEST_FAR = 0.6
_NEAR_A_ROD = 1.5
_NEAR_A_SPHERE = 4.0
# Growth of the sides with the distance from where the surface is folded around the rod's edge.
_SLOPE = 0.7

# Thickness and radius in mm, and how many times finer than by default the mesh is.
FilmSize = tuple[float, float, float]
# How much finer than by default sides at a rod's edge are, and how much more slowly they grow.
Finer = tuple[float, float]


def mesh_below_a_rod(
    size: FilmSize, *, rod: float, fold: tuple[float, float], finest: float, finer: Finer
) -> Any:
    """Return a mesh (mm) that is finest where the rod's edge folds the surface."""
    thickness, _, refinement = size
    finest = finest / finer[0] / refinement
    slope = _SLOPE / finer[1]
    side = min(_SHARE_OF_ROD * rod, _WIDEST_NEAR * thickness) / refinement
    mesh = _tensor(np.linspace(0.0, rod, max(2, round(rod / side)) + 1), side, _NEAR_A_ROD, size)
    while True:
        r, z = mesh.p[:, mesh.t]
        longest = np.hypot(r - np.roll(r, 1, axis=0), z - np.roll(z, 1, axis=0)).max(axis=0)
        away = np.maximum(np.maximum(fold[0] - r, r - fold[1]), 0.0)
        distance = np.hypot(away, thickness - z).min(axis=0)
        # A triangle that is cut has sides up to sqrt(2) of the size that is asked for.
        long = longest > np.sqrt(2) * (finest + slope * distance)
        cut = np.flatnonzero(long & (longest < 3 * side))
        if not cut.size:
            return mesh
        mesh = mesh.refined(cut)


def mesh_below_a_sphere(size: FilmSize, *, contact: float) -> Any:
    """Return a mesh (mm) that is fine up to a radius somewhat beyond the contact."""
    thickness, _, refinement = size
    side = min(_SHARE_OF_CONTACT * contact, _WIDEST_NEAR * thickness) / refinement
    even = np.linspace(0.0, contact, int(np.ceil(contact / side)) + 1)
    return _tensor(even, side, _NEAR_A_SPHERE, size)


def _tensor(even: FloatArray, side: float, reach: float, size: FilmSize) -> Any:
    """Return triangles on a grid that grows away from the contact, outward and downward."""
    import skfem

    thickness, radius, refinement = size
    contact = even[-1]
    grow = 1 + _GROWTH / refinement
    near, far = (widest * thickness / refinement for widest in (_WIDEST_NEAR, _WIDEST_FAR))
    edge = contact + reach * thickness
    r = graded(contact, radius, side, grow, lambda r: near if r < edge else far)
    depth = graded(0.0, thickness, side / grow, grow, lambda _: near)
    heights = thickness - depth[::-1]
    heights[0] = 0.0
    return skfem.MeshTri.init_tensor(np.append(even, r[1:]), heights)


# Exact for the square of a quadratic, times its radius and its Jacobian.
_QUADRATURE = 5


@array_record
class FilmElements:
    """Forces for the unknowns (n radial and n upward displacements in mm, m pressures in MPa)."""

    mesh: Any
    material: Rubber

    @cached_property
    def bases(self) -> tuple[Any, Any]:
        """Quadratic functions for one component of displacement, and linear ones for pressure."""
        import skfem

        displacement = skfem.Basis(self.mesh, skfem.ElementTriP2(), intorder=_QUADRATURE)
        return displacement, displacement.with_element(skfem.ElementTriP1())

    @property
    def n(self) -> int:
        """Nodes of displacement."""
        return int(self.bases[0].N)

    @property
    def size(self) -> int:
        """Unknowns."""
        return 2 * self.n + int(self.bases[1].N)

    @cached_property
    def nodes(self) -> FloatArray:
        """Radius and height of the undeformed nodes of displacement, in mm, shape (2, n)."""
        return np.asarray(self.bases[0].doflocs)

    @cached_property
    def thickness(self) -> float:
        """Thickness of the film, in mm."""
        return float(self.nodes[1].max())

    @cached_property
    def surface(self) -> IndexArray:
        """Nodes of the surface, from the axis outward."""
        return self._line(self.nodes[1] > self.thickness * (1 - 1e-9))

    @cached_property
    def base(self) -> IndexArray:
        """Nodes of the base, from the axis outward."""
        return self._line(self.nodes[1] < self.thickness * 1e-9)

    @cached_property
    def held(self) -> IndexArray:
        """Unknowns that stay zero: the base is bonded, and the axis stays where it is."""
        axis = np.flatnonzero(self.nodes[0] < 1e-9 * self.thickness)
        return np.unique(np.concatenate([self.base, self.base + self.n, axis]))

    def _line(self, chosen: BoolArray) -> IndexArray:
        nodes = np.flatnonzero(chosen)
        return nodes[np.argsort(self.nodes[0][nodes], kind="stable")]

    @cached_property
    def _shape(self) -> tuple[FloatArray, FloatArray, FloatArray, IndexArray]:
        """Return gradients (cells, points, 5, 12), pressures, volumes and numbers of unknowns."""
        displacement, pressure = self.bases
        radius = np.asarray(displacement.global_coordinates())[0]
        gradients, pressures = _shapes(displacement, pressure, radius)
        volumes = 2 * np.pi * radius * displacement.dx
        moving = displacement.element_dofs
        dofs = np.concatenate([moving, moving + self.n, pressure.element_dofs + 2 * self.n])
        return gradients, pressures, volumes, dofs.T

    def _state(self, x: FloatArray, shapes: Any = None) -> ArrayPair:
        """Return the deformation gradient (cells, points, 5) and the pressure (cells, points)."""
        gradients, pressures = shapes or self._shape[:2]
        unknowns = x[self._shape[3]][:, :, None]
        cells, points = pressures.shape[:2]
        F = (gradients.reshape(cells, -1, 12) @ unknowns[:, :12]).reshape(cells, points, 5)
        F[..., [0, 3, 4]] += 1.0
        return F, (pressures @ unknowns[:, 12:])[..., 0]

    def volume_ratio(self, x: FloatArray) -> FloatArray:
        """Return J at the points of integration, shape (cells, points)."""
        return determinant(self._state(x)[0])

    def interpolated(self, x: FloatArray, mesh: FilmElements) -> FloatArray:
        """Return the unknowns ``x`` of another mesh of the same film at this mesh's nodes."""
        displacement, pressure = mesh.bases
        moved = displacement.probes(self.nodes) @ x[: 2 * mesh.n].reshape(2, -1).T
        pressures = pressure.probes(self.bases[1].doflocs) @ x[2 * mesh.n :]
        return np.concatenate([moved.T.ravel(), pressures])

    def energy(self, x: FloatArray) -> float:
        """Return the stored energy, in mJ."""
        return float(np.sum(self.material.energy(*self._state(x)) * self._shape[2]))

    def forces(self, x: FloatArray) -> FloatArray:
        """Return the derivative of the energy: the forces (N) to apply to the nodes."""
        F, p = self._state(x)
        gradients, pressures, volumes, dofs = self._shape
        cells = p.shape[0]
        stress = (self.material.stress(F, p) * volumes[..., None]).reshape(cells, -1)
        swelling = (determinant(F) - 1 + self.material.softness * p) * volumes
        pushed = (stress[:, None, :] @ gradients.reshape(cells, -1, 12))[:, 0]
        values = np.concatenate([pushed, -(swelling[:, None, :] @ pressures)[:, 0]], axis=1)
        return np.bincount(dofs.ravel(), values.ravel(), self.size).astype(np.float64)

    def tangent(self, x: FloatArray) -> sparse.csr_array:
        """Return the derivative of the forces by the unknowns: symmetric, of shape (size, size)."""
        F, p = self._state(x)
        gradients, pressures, volumes, dofs = self._shape
        cells = p.shape[0]
        stiffness = self.material.tangent(F, p) * volumes[..., None, None]
        flat = gradients.reshape(cells, -1, 12)
        stiff = flat.transpose(0, 2, 1) @ (stiffness @ gradients).reshape(cells, -1, 12)
        squeeze = cofactor(F)[..., None, :] * volumes[..., None, None] @ gradients
        against = -pressures.transpose(0, 2, 1)
        couple = against @ squeeze[:, :, 0]
        soft = against @ (pressures * (self.material.softness * volumes)[..., None])
        whole = np.block([[stiff, couple.transpose(0, 2, 1)], [couple, soft]])
        count = dofs.shape[1]
        entries = (np.repeat(dofs, count, axis=1).ravel(), np.tile(dofs, count).ravel())
        return sparse.coo_array((whole.ravel(), entries), shape=(self.size, self.size)).tocsr()

    def is_inside_out(self, x: FloatArray) -> bool:
        """Whether a triangle, as a whole, is turned inside out: no state of a film."""
        # Where the rod's edge folds the film, J strays from 1 between the few pressures that
        # hold it there: triangles keep their volume, points do not.
        F, _ = self._state(x)
        volumes = self._shape[2]
        kept = np.sum(determinant(F) * volumes, axis=1) / np.sum(volumes, axis=1)
        # Also where it is not a number.
        return not (np.all(kept > 0) and np.all(F[..., 4] > 0))

    def nodal_stress(self, x: FloatArray) -> FloatArray:
        """Return the mean Cauchy stress rr, zz, hoop, rz at the nodes in MPa, shape (n, 4)."""
        import skfem

        element = skfem.ElementTriP2()
        at_nodes = (element.doflocs.T, np.ones(6))
        displacement = skfem.Basis(self.mesh, element, quadrature=at_nodes)
        pressure = displacement.with_element(skfem.ElementTriP1())
        radius = np.asarray(displacement.global_coordinates())[0]
        stress = self.material.cauchy(*self._state(x, _shapes(displacement, pressure, radius)))
        dofs = displacement.element_dofs.T.ravel()
        sums = [np.bincount(dofs, stress[..., i].ravel()) for i in range(4)]
        return np.stack(sums, axis=-1) / np.bincount(dofs)[:, None]


def _shapes(displacement: Any, pressure: Any, radius: FloatArray) -> ArrayPair:
    """Return the gradients (cells, points, 5, 12) and pressures of the shape functions."""
    gradients = np.zeros((*radius.shape, 5, 12))
    on_axis = radius < 1e-12
    for i, (field,) in enumerate(displacement.basis):
        value = np.broadcast_to(field, radius.shape)
        slope = np.moveaxis(field.grad, 0, -1)
        gradients[:, :, :2, i] = gradients[:, :, 2:4, 6 + i] = slope
        # u/r on the axis is the slope of u.
        hoop = np.where(on_axis, slope[..., 0], value / np.where(on_axis, 1.0, radius))
        gradients[:, :, 4, i] = hoop
    pressures = [np.broadcast_to(field, radius.shape) for (field,) in pressure.basis]
    return gradients, np.stack(pressures, axis=-1)
