"""References of a calibration: stress at the base of a film, or a source of known form."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import j1

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

#: Ideal references with what their size is.
IDEAL = {"disc": "radius", "slit": "width", "gaussian": "standard deviation", "point": ""}
#: Radii of the table of an ideal reference, a Gaussian's reach in its widths, an edge's share.
_IDEAL_RADII, _IDEAL_REACH, _EDGE = 121, 6.0, 1e-6


@dataclass(frozen=True)
class IdealReference:
    r"""A source of known form in place of a stress: no film, rod or load is needed.

    Of value 1 in a disc or slit and at the peak of a Gaussian, so that the conversion constant is
    the reading per unit of the source; a point has unit integral, and the conversion constant is
    the reading's integral over the plane.  The transforms, in m^2 (of a slit, in m, across it), are

    .. math::

        2\pi R^2 \frac{J_1(kR)}{kR}, \qquad W \frac{\sin(kW/2)}{kW/2}, \qquad
        2\pi S^2 e^{-S^2k^2/2}, \qquad 1 .

    Parameters
    ----------
    shape : str
        ``"disc"``, ``"slit"`` (far longer than G is wide, across a line scan), ``"gaussian"`` or
        ``"point"``.
    size : float
        Radius of a disc, width of a slit, standard deviation of a Gaussian, in m; 0 of a point.

    Raises
    ------
    InputError
        If there is no such shape, or the size is none.

    Examples
    --------
    >>> disc = IdealReference("disc", 0.5e-3)
    >>> float(disc.transform(np.zeros(1))[0] / np.pi)
    2.5e-07
    """

    shape: str
    size: float = 0.0

    def __post_init__(self) -> None:
        if self.shape not in IDEAL:
            cure = f"Give one of {', '.join(IDEAL)}."
            raise InputError(f"There is no ideal reference {self.shape!r}.", cure=cure)
        if self.shape != "point":
            require_positive(f"{IDEAL[self.shape]} of the {self.shape}", self.size, "m")
        elif self.size:
            raise InputError(f"A point has no size, but {self.size:g} m is given.")

    def __str__(self) -> str:
        """Return it in words, with its size."""
        words = IDEAL[self.shape] and f" of {IDEAL[self.shape]} {self.size * 1e3:.6g} mm"
        return f"{self.shape}{words}"

    @property
    def unit(self) -> str:
        """The unit of the source, by which that of the reading is divided."""
        return "1/m^2" if self.shape == "point" else "1"

    def transform(self, k: FloatArray) -> FloatArray:
        """Return the Fourier transform at ``k`` (rad/m)."""
        phase = np.asarray(k, dtype=np.float64) * self.size
        if self.shape == "disc":
            ratio = np.divide(2 * j1(phase), phase, out=np.ones_like(phase), where=phase != 0)
            return np.asarray(math.pi * self.size**2 * ratio)
        if self.shape == "slit":
            return np.asarray(self.size * np.sinc(phase / (2 * math.pi)))
        if self.shape == "gaussian":
            return np.asarray(2 * math.pi * self.size**2 * np.exp(-0.5 * phase**2))
        return np.ones_like(phase)

    def profile(self) -> "StressProfile":
        """Return the profile that a calibration takes, with a table to draw; a point has none."""
        half = {"slit": self.size / 2, "gaussian": _IDEAL_REACH * self.size}
        end = half.get(self.shape, self.size) or 1.0
        r = np.linspace(0.0, end, _IDEAL_RADII)
        values = (
            np.exp(-0.5 * (r / self.size) ** 2) if self.shape == "gaussian" else np.ones(r.size)
        )
        if self.shape in ("disc", "slit"):
            r, values = np.append(r, end * (1 + _EDGE)), np.append(values, 0.0)
        values *= self.shape != "point"
        return StressProfile(r=r, sigma_zz=values, load=1.0, ideal=self)


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
    ideal : IdealReference, optional
        The source of known form that the table is of: nothing of it is in Pa or N.

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
    ideal: IdealReference | None = None

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
