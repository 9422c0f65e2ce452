r"""Surface of a film: its displacements under tractions on rings, as a contact solver needs them.

Pressure and radial shear are linear between the radii :math:`r_j` of concentric rings (the *hat*
functions); the displacements of the surface are taken at the same radii,
:math:`w_i = \sum_j C^{wp}_{ij}\,p_j + C^{wq}_{ij}\,q_j` and
:math:`u_i = \sum_j C^{up}_{ij}\,p_j + C^{uq}_{ij}\,q_j`, with the depression :math:`w` (positive
into the film) and the outward displacement :math:`u`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from memscal.model.arrays import FloatArray
from memscal.model.field_mesh import FieldMesh


@dataclass(frozen=True, eq=False)
class SurfaceCompliance:
    """Displacements at the rings by unit traction of every ring: (n, n) matrices in m/Pa."""

    r: FloatArray  # m, increasing from 0; a traction of the last ring falls to zero as a step
    normal: FloatArray
    normal_by_shear: FloatArray
    radial_by_pressure: FloatArray
    radial: FloatArray

    @property
    def areas(self) -> FloatArray:
        r"""Integrals of the hats over the surface, in m^2: the load is ``areas @ p``."""
        left, right = self.r[:-1], self.r[1:]
        rising, falling = (right - left) * (left + 2 * right), (right - left) * (2 * left + right)
        return np.asarray((np.append(0.0, rising) + np.append(falling, 0.0)) * np.pi / 3)


class FilmField(Protocol):
    """The field in a film under given tractions at its two faces; radii in m, of any shape."""

    def base_normal(self, r: FloatArray) -> FloatArray:
        """Return the normal stress at the base in Pa, compression positive."""

    def base_shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction of the base on the film in Pa, positive outward."""

    def base_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\sigma_{zz}\,J_0(kr)\,r\,dr` at ``k`` (rad/m), in N."""

    def base_shear_spectrum(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`2\pi\int\tau\,J_1(kr)\,r\,dr` of the base shear at ``k``, in N."""

    def depression(self, r: FloatArray) -> FloatArray:
        """Return the normal displacement of the surface in m, positive into the film."""

    def outward(self, r: FloatArray) -> FloatArray:
        """Return the radial displacement of the surface in m, positive outward."""


@runtime_checkable
class MeshedField(Protocol):
    """A field that was solved on a mesh, and can be shown on it."""

    def mesh(self) -> FieldMesh:
        """Return displacement and stress on the mesh."""
