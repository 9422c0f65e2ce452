"""A solved contact: what stands between indenter and film, and what reaches the base."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.mechanics.base_stress import (
    base_normal_spectrum,
    base_normal_stress,
    base_shear_stress,
)
from memscal.mechanics.traction import InterfaceTraction
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray

__all__ = ["Contact"]

# Default radii of a profile, in film thicknesses.  The film passes nothing that varies faster
# than exp(-kh): with these steps, near the contact and far from it, a cubic spline is good to
# 1e-6 of the maximum.
_NEAR_STEP = 0.02
_FAR_STEP = 0.05
_NEAR_REACH = 6.0
_FAR_REACH = 26.0
# The profile ends where the stress stays below this fraction of its maximum, which happens
# within the far reach for any Poisson's ratio.
_PROFILE_FLOOR = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Contact:
    r"""A rigid indenter pressed on a bonded film, solved; from :func:`memscal.indent`.

    Parameters
    ----------
    film, indenter
        What was pressed on what.
    load : float
        Normal load :math:`P`, in N.
    depth : float
        Indentation depth :math:`\delta`, in m.
    contact_radius, stick_radius : float
        Radius of the contact and of the part of it that sticks, in m.
    friction : float
        Amontons' coefficient; ``inf`` for a contact that sticks all over.
    loading : str
        ``"incremental"`` or ``"total"``; ``""`` where it makes no difference (any rod).
    backend : str
        ``"hankel"``: linear elasticity by Hankel transforms.
    convergence : float
        Largest change of the base stress under refinement, relative to its maximum.
    discretisation : str
        What was refined, in words.
    traction : InterfaceTraction
        Pressure and shear at the interface.

    Notes
    -----
    Stresses are in Pa at radii in m.  Normal stress is positive in compression.  Shear is the
    traction on the film, positive outward, at both of its faces: under the indenter it is the
    indenter's, at the base it is the base's, which holds the film back and is negative.

    Examples
    --------
    >>> from memscal.mechanics.indent import indent
    >>> from memscal.model.indenter import Rod
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = indent(film, Rod(radius=0.25e-3), load=1.0)
    >>> [round(float(s)) for s in contact.base_stress([0.0, 1e-3, 4e-3])]
    [181805, 92873, 102]
    """

    film: ElasticFilm
    indenter: Indenter
    load: float
    depth: float
    contact_radius: float
    stick_radius: float
    friction: float
    loading: str
    backend: str
    convergence: float
    discretisation: str
    traction: InterfaceTraction

    def base_stress(self, r: ArrayLike) -> FloatArray:
        r"""Return the normal stress :math:`\sigma_{zz}` at the base, compression positive.

        Parameters
        ----------
        r : array_like
            Radii from 0 upward, in m, of any shape.

        Returns
        -------
        ndarray, shape of ``r``
            The stress in Pa.  Set to zero where it has decayed below 1e-13 of its maximum.

        Raises
        ------
        InputError
            If a radius is negative or not finite.
        """
        return base_normal_stress(self.film, self.traction, _radii(r))

    def base_spectrum(self, k: ArrayLike) -> FloatArray:
        r"""Return the two-dimensional Fourier transform of the base stress, in N.

        At ``k`` in rad/m, of any shape and sign:
        :math:`2\pi\int\sigma_{zz}\,J_0(kr)\,r\,dr`, which is the load at k = 0.
        """
        wavenumbers = np.abs(np.asarray(k, dtype=np.float64))
        return 2 * np.pi * base_normal_spectrum(self.film, self.traction, wavenumbers)

    def base_shear(self, r: ArrayLike) -> FloatArray:
        r"""Return the radial traction of the base on the film, in Pa, positive outward.

        As :meth:`base_stress`; with the third axis from base to surface it is
        :math:`-\sigma_{rz}`, and it is negative where the film is squeezed outward.
        """
        return base_shear_stress(self.film, self.traction, _radii(r))

    def interface_pressure(self, r: ArrayLike) -> FloatArray:
        """Return the pressure between indenter and film in Pa; zero outside the contact.

        Under a rod it grows without bound towards the edge; the edge itself counts as outside.
        """
        return self.traction.pressure(_radii(r))

    def interface_shear(self, r: ArrayLike) -> FloatArray:
        """Return the radial traction on the film in Pa, positive outward; zero outside."""
        return self.traction.shear(_radii(r))

    def profile(self, r: ArrayLike | None = None) -> StressProfile:
        """Return the stress at the base as a table, such as a calibration divides by.

        Parameters
        ----------
        r : array_like, shape (n,), optional
            Increasing radii in m.  By default 50 per film thickness near the contact and 20
            far from it, out to where the stress stays below 1e-9 of its maximum: a cubic
            spline through them is accurate to 1e-6 of the maximum.
        """
        return self._default_profile if r is None else self._tabulated(_radii(r))

    @cached_property
    def _default_profile(self) -> StressProfile:
        radii = self._default_radii()
        sigma_zz = np.abs(self.base_stress(radii))
        last = np.flatnonzero(sigma_zz >= _PROFILE_FLOOR * sigma_zz.max())[-1] + 2
        return self._tabulated(radii[:last])

    def _tabulated(self, radii: FloatArray) -> StressProfile:
        return StressProfile(
            r=radii,
            sigma_zz=self.base_stress(radii),
            sigma_rz=self.base_shear(radii),
            load=self.load,
            depth=self.depth,
            contact_radius=self.contact_radius,
            stick_radius=self.stick_radius,
            friction_coefficient=self.friction,
            loading=self.loading,
            film=self.film,
            indenter=self.indenter,
            solver=f"memscal, {self.backend} backend",
            discretisation=self.discretisation,
            convergence=self.convergence,
        )

    def _default_radii(self) -> FloatArray:
        edge = self.contact_radius / self.film.thickness
        near = np.arange(0.0, edge + _NEAR_REACH, _NEAR_STEP)
        far = near[-1] + np.arange(_FAR_STEP, _FAR_REACH - _NEAR_REACH, _FAR_STEP)
        return np.concatenate([near, far]) * self.film.thickness


def _radii(r: ArrayLike) -> FloatArray:
    """Return radii as an array; refuse what is no radius."""
    radii = np.asarray(r, dtype=np.float64)
    if not np.all(np.isfinite(radii)):
        raise InputError("A radius is not finite.", cure="Leave missing positions out.")
    if np.any(radii < 0):
        raise InputError(
            f"A radius is {radii.min():g} m, but radii are not negative.",
            cure="Give distances from the indenter's axis, such as abs(x - centre).",
        )
    return radii
