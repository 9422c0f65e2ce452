r"""Traction between indenter and film: what a contact solution hands to the layer below it."""

from __future__ import annotations

from typing import Protocol

from memscal.model.validation import FloatArray

__all__ = ["HalfSpaceIntegrals", "InterfaceTraction"]

HalfSpaceIntegrals = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
r"""Four parts of a surface's displacements: depression by pressure and by shear, outward
displacement by pressure and by shear."""


class InterfaceTraction(Protocol):
    r"""Axisymmetric pressure and radial shear on the film's surface, within ``radius``.

    Whatever the indenter, the field in the film needs no more than these transforms.
    """

    @property
    def radius(self) -> float:
        """Radius outside which there is no traction, in m."""

    def pressure(self, r: FloatArray) -> FloatArray:
        """Return the pressure at the radii ``r`` (m), in Pa, positive in compression."""

    def shear(self, r: FloatArray) -> FloatArray:
        """Return the radial traction on the film at ``r`` (m), in Pa, positive outward."""

    def pressure_transform(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`\int p\,J_0(kr)\,r\,dr` at ``k`` (rad/m), in N."""

    def shear_transform(self, k: FloatArray) -> FloatArray:
        r"""Return :math:`\int q\,J_1(kr)\,r\,dr` at ``k`` (rad/m), in N."""

    def half_space_integrals(self, r: FloatArray) -> HalfSpaceIntegrals:
        r"""Return what the displacements of a half-space's surface at ``r`` (m) are made of.

        In Pa m: :math:`\int\hat p\,J_0(kr)\,dk`, :math:`\int\hat q\,J_0(kr)\,dk`,
        :math:`\int\hat p\,J_1(kr)\,dk` and :math:`\int\hat q\,J_1(kr)\,dk`.
        """
