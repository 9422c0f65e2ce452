"""A radial stress profile at the base of the film: the reference of a calibration."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from memscal.errors import InputError
from memscal.model.arrays import (
    FloatArray,
    finite_vector,
    require_increasing,
    require_positive,
    table_spline,
)
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.provenance import SourceFile


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StressProfile:
    r"""Stress at the base of the film as a function of radius, for one load.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Distance from the axis of the indenter, in m; increasing, from 0 or above.
    sigma_zz : ndarray, shape (n,)
        Normal stress at the base, in Pa, positive in compression.
    load : float
        The normal load :math:`P` that produces it, in N.
    sigma_rz : ndarray, shape (n,), optional
        Radial traction of the base on the film, in Pa, positive outward.
    sigma_zz_errors : ndarray, shape (n,), optional
        Standard uncertainty of ``sigma_zz``, in Pa; a calibration takes it as common to all radii.
    film, indenter, depth, contact_radius, stick_radius : optional
        What was pressed on what; indentation depth and radii, in m.
    friction_coefficient, loading : float, str, optional
        Amontons' coefficient, ``inf`` for full stick; ``"incremental"``, ``"total"``, or ``""``
        where it makes no difference or is unknown.
    solver, discretisation : str
        The program or method, and its mesh or quadrature.
    convergence : float, optional
        Estimated relative error of ``sigma_zz``, of its maximum.
    notes, source : str, SourceFile, optional
        What was done to it and what its author wrote at its head; the file it was read from.

    Raises
    ------
    InputError
        If the axis does not increase or the shapes disagree.

    Examples
    --------
    >>> profile = StressProfile(r=[0.0, 1e-3], sigma_zz=[2.0e5, 1.0e5], load=1.0)
    >>> profile.sigma_zz.max()
    np.float64(200000.0)
    """

    unit: ClassVar[str] = "Pa"

    r: FloatArray
    sigma_zz: FloatArray
    load: float
    sigma_rz: FloatArray | None = None
    sigma_zz_errors: FloatArray | None = None
    depth: float | None = None
    contact_radius: float | None = None
    stick_radius: float | None = None
    friction_coefficient: float | None = None
    loading: str = ""
    film: ElasticFilm | None = None
    indenter: Indenter | None = None
    solver: str = ""
    discretisation: str = ""
    convergence: float | None = None
    notes: str = ""
    source: SourceFile | None = None

    def __post_init__(self) -> None:
        require_positive("load of the stress profile", self.load, "N")
        for name in ("r", "sigma_zz", "sigma_rz", "sigma_zz_errors"):
            values = getattr(self, name)
            if values is not None:
                values = finite_vector(f"{name} of the stress profile", values)
                object.__setattr__(self, name, values)
        require_increasing("r of the stress profile", self.r)
        if self.r[0] < 0:
            raise InputError(
                "r of the stress profile is negative.", cure="Give radii, not positions."
            )
        for name in ("sigma_zz", "sigma_rz", "sigma_zz_errors"):
            values = getattr(self, name)
            if values is not None and values.shape != self.r.shape:
                raise InputError(
                    f"{name} of the stress profile has {values.size} values for {self.r.size} "
                    "radii."
                )

    def __repr__(self) -> str:
        """Return what it is of in place of thousands of array elements."""
        peak = float(np.abs(self.sigma_zz).max()) * 1e-3
        return (
            f"<StressProfile: load {self.load:.4g} N, {self.r.size} radii to "
            f"{self.r[-1] * 1e3:.4g} mm, largest stress {peak:.4g} kPa>"
        )

    @property
    def force(self) -> float:
        r"""Force :math:`2\pi\int\sigma_{zz}\,r\,dr` that the table itself carries, in N.

        The integral, from the axis to the last radius, is that of the cubic spline through
        :math:`\sigma_{zz}\,r`, mirrored as the odd function that it is: its error falls with
        the fourth power of the spacing, also for the uneven radii of a mesh.  Through a table with
        an edge goes a monotone spline.
        """
        if self.r[-1] == 0:
            return 0.0
        # Three mirrored radii make the axis an inner point of the spline.
        inner = slice(1, 4) if self.r[0] == 0 else slice(0, 3)
        density = self.sigma_zz * self.r
        spline, _ = table_spline(
            np.concatenate([-self.r[inner][::-1], self.r]),
            np.concatenate([-density[inner][::-1], density]),
        )
        return float(2 * np.pi * spline.integrate(0.0, self.r[-1]))
