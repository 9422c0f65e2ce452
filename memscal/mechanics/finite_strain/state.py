"""Field in a film at finite strain, and its traction under the indenter, in SI units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import gauss_between, hankel_transform
from memscal.mechanics.film_response import RingTraction
from memscal.mechanics.finite_strain.pressing import Pressed, Pressing
from memscal.model.arrays import FloatArray
from memscal.model.field_mesh import FieldMesh

_MM = 1e-3
_MPA = 1e6


@dataclass(frozen=True, eq=False)
class FiniteStrainField:
    """The field in a film at finite strain; see :class:`memscal.mechanics.surface.FilmField`."""

    # An element of the bonded base does not deform: its Cauchy traction is the nominal one.
    # ``depression`` and ``outward`` are functions of a point's radius *before* the deformation.
    pressing: Pressing
    pressed: Pressed

    @cached_property
    def base(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Radii at the base (m), pressure and outward shear on the film there (Pa)."""
        # Of the splines that do the same work as the nodal forces on every displacement that is
        # linear between the corners: more accurate than stresses taken inside the elements, and in
        # balance with the load to rounding.
        elements = self.pressing.elements
        forces, nodes = elements.forces(self.pressed.x), elements.base
        r = elements.nodes[0][nodes][::2]
        # The hat on the axis has hardly any area: its force is added to that of the next one.
        normal, shear = (
            np.linalg.solve(_spline_masses(r, parity), _without_axis(_on_corners(forces[which])))
            for parity, which in ((1, nodes + elements.n), (-1, nodes))
        )
        return np.asarray(r[1:]) * _MM, np.asarray(normal * _MPA), np.asarray(shear * _MPA)

    @cached_property
    def surface(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Radii of the surface's nodes before deformation, their depression and outward shift."""
        elements, x = self.pressing.elements, self.pressed.x
        nodes = elements.surface
        r, w, u = elements.nodes[0][nodes], -x[nodes + elements.n], x[nodes]
        return r * _MM, w * _MM, u * _MM

    def base_normal(self, r: FloatArray) -> FloatArray:
        """Return the normal stress at the base in Pa, compression positive; 0 beyond the film."""
        return _interpolated(self.base[0], self.base[1], r, parity=1)

    def base_shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction of the base on the film in Pa, positive outward."""
        return _interpolated(self.base[0], self.base[2], r, parity=-1)

    def base_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\sigma_{zz}\,J_0(kr)\,r\,dr` at ``k`` (rad/m), in N."""
        return hankel_transform(self.base[0], self.base[1], np.ravel(k)).reshape(np.shape(k))

    def base_shear_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\tau\,J_1(kr)\,r\,dr` of the base shear at ``k``, in N."""
        r, shear = self.base[0], self.base[2]
        return hankel_transform(r, shear, np.ravel(k), order=1).reshape(np.shape(k))

    def depression(self, r: FloatArray) -> FloatArray:
        """Return how far the points at ``r`` before deformation (m) moved into the film, in m."""
        return _interpolated(self.surface[0], self.surface[1], r, parity=0)

    def outward(self, r: FloatArray) -> FloatArray:
        """Return how far the points at ``r`` before deformation (m) moved outward, in m."""
        return _interpolated(self.surface[0], self.surface[2], r, parity=0)

    def mesh(self) -> FieldMesh:
        """Return displacement and Cauchy stress on the undeformed mesh."""
        elements, x = self.pressing.elements, self.pressed.x
        basis = elements.bases[0]
        corners = basis.doflocs[:, basis.element_dofs[:3]]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        turned = first[0] * second[1] < first[1] * second[0]
        triangles = basis.element_dofs.T.copy()
        triangles[turned] = triangles[turned][:, [0, 2, 1, 5, 4, 3]]
        return FieldMesh(
            points=elements.nodes.T * _MM,
            triangles=triangles,
            displacement=x[: 2 * elements.n].reshape(2, -1).T * _MM,
            stress=elements.nodal_stress(x) * _MPA,
            notes=f"{elements.material.law} film at finite strain under {self.pressed.load:.6g} N",
        )


def interface_traction(pressing: Pressing, pressed: Pressed) -> RingTraction:
    """Return pressure and shear (Pa) at the deformed radii of the corners in contact."""
    # Means over the hats of the corners: nodal forces of quadratic elements are no tractions (that
    # on the axis has no area).  A rod's wall is left out.
    elements, x = pressing.elements, pressed.x
    nodes = elements.surface
    forces = elements.forces(x)
    touching = np.isin(nodes, pressed.touching)
    place = np.zeros(nodes.size)
    place[touching] = pressed.place
    _, (along, up), _ = pressing.face.contour(place)
    radial, upward = forces[nodes] * touching, forces[nodes + elements.n] * touching
    pushed, dragged = up * radial - along * upward, along * radial + up * upward
    r, z = elements.nodes[0][nodes] + x[nodes], x[nodes + elements.n]
    # The axis is held: its radial force is not the indenter's.
    if r[0] < 1e-12:
        dragged[0] = 0.0
    side = np.hypot(np.diff(r[::2]), np.diff(z[::2]))
    left, right = r[:-2:2], r[2::2]
    falling, rising = side * (2 * left + right), side * (left + 2 * right)
    area = np.pi / 3 * (np.append(falling, 0.0) + np.append(0.0, rising))

    chosen = np.flatnonzero(touching[::2] & (along[::2] > 1e-6))
    chosen = chosen[np.argsort(r[::2][chosen], kind="stable")]
    pressure, shear = _on_corners(pushed) / area, _on_corners(dragged) / area
    return RingTraction(r[::2][chosen] * _MM, pressure[chosen] * _MPA, shear[chosen] * _MPA)


def _on_corners(forces: FloatArray) -> FloatArray:
    """Return the forces on hats between corners; nodes are corners and middles by turns."""
    halves = forces[1::2] / 2
    return np.asarray(forces[::2] + np.append(halves, 0.0) + np.append(0.0, halves))


def _without_axis(rows: FloatArray) -> FloatArray:
    """Add the first row to the second, and leave it out."""
    return np.concatenate([rows[:1] + rows[1:2], rows[2:]])


def _spline(r: FloatArray, values: FloatArray, parity: int) -> Callable[[FloatArray], FloatArray]:
    """Return an even (1) or odd (-1) cubic spline through a table that begins off the axis."""
    from scipy.interpolate import CubicSpline

    mirrored = np.concatenate([parity * values[3::-1], values])
    spline = CubicSpline(np.concatenate([-r[3::-1], r]), mirrored)
    return lambda radii: np.asarray(spline(radii))


def _spline_masses(r: FloatArray, parity: int) -> FloatArray:
    """Return integrals around the axis of hats times splines that are 1 at one corner off it."""
    nodes, weights = gauss_between(r, order=6)
    splines = _spline(r[1:], np.eye(r.size - 1), parity)(nodes)
    corner = np.arange(r.size)
    hats = np.maximum(0.0, 1 - np.abs(np.interp(nodes, r, corner) - corner[:, None]))
    return _without_axis(hats @ (splines * (2 * np.pi * nodes * weights)[:, None]))


def _interpolated(nodes: FloatArray, values: FloatArray, r: ArrayLike, parity: int) -> FloatArray:
    """Return a table's values at ``r``: by an even or odd spline, or without overshoot (0)."""
    from scipy.interpolate import PchipInterpolator

    radii = np.asarray(r, dtype=np.float64)
    spline = _spline(nodes, values, parity) if parity else PchipInterpolator(nodes, values)
    return np.where(radii <= nodes[-1], spline(np.minimum(radii, nodes[-1])), 0.0)


def outermost(pressing: Pressing, pressed: Pressed) -> float:
    """Return the radius after deformation at which the contact ends, in mm, between two nodes."""
    nodes = pressing.elements.surface
    r = pressing.elements.nodes[0][nodes] + pressed.x[nodes]
    last = int(np.flatnonzero(np.isin(nodes, pressed.touching))[-1])
    return float((r[last] + r[min(last + 1, r.size - 1)]) / 2)
