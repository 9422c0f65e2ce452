"""References of a calibration: stress at the base of a film, or a source of known form."""

import math
from functools import cached_property

import numpy as np
from scipy.special import j0, j1

from memscal.errors import InputError
from memscal.model.arrays import (
    TINY,
    ArrayPair,
    FloatArray,
    finite_vector,
    floats,
    keyword_array_record,
    require_increasing,
    require_positive,
    table_spline,
    value_record,
)
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter
from memscal.model.provenance import SourceFile
from memscal.model.sizes import MOST_PIXELS

#: Ideal references with what their size is.
IDEAL = {"disc": "radius", "slit": "width", "gaussian": "standard deviation", "point": ""}
#: Radii of the table of an ideal reference, a Gaussian's reach in its widths, an edge's share.
_IDEAL_RADII = 121
_IDEAL_REACH = 6.0
_EDGE = 1e-6


@value_record
class IdealReference:
    r"""A source of known form in place of a stress: no film, rod or load is needed.

    It is 1 in a disc or slit and at the peak of a Gaussian, and A is the reading per unit of it; a
    point has unit integral, and A is the reading's integral over the plane.  The transforms are

    .. math::

        2\pi R^2 \frac{J_1(kR)}{kR}, \qquad W \frac{\sin(kW/2)}{kW/2}, \qquad
        2\pi S^2 e^{-S^2k^2/2}, \qquad 1 .

    Parameters
    ----------
    shape : str
        ``"disc"``, ``"slit"`` (far longer than G is wide, across a line), ``"gaussian"``,
        ``"point"``.
    size : float
        Radius R of a disc, width W of a slit, standard deviation S of a Gaussian, in m.

    Raises
    ------
    InputError
        If there is no such shape, or the size is none.

    Examples
    --------
    >>> float(IdealReference("disc", 0.5e-3).transform(np.zeros(1))[0] / np.pi)
    2.5e-07
    """

    shape: str
    size: float = 0.0
    notes = ""

    def __post_init__(self) -> None:
        if self.shape not in IDEAL:
            raise InputError(
                f"There is no ideal reference {self.shape!r}.",
                cure=f"Give one of {', '.join(IDEAL)}.",
            )
        if self.shape != "point":
            require_positive(f"{IDEAL[self.shape]} of the {self.shape}", self.size, "m")
        elif self.size:
            raise InputError(
                f"A point has no size, but {self.size:g} m is given.",
                cure="Leave it out, or take gaussian:S.",
            )

    def __str__(self) -> str:
        """Return it in words, with its size."""
        words = IDEAL[self.shape] and f" of {IDEAL[self.shape]} {self.size * 1e3:.6g} mm"
        return f"{self.shape}{words}"

    @property
    def unit(self) -> str:
        """The unit of the source, by which that of the reading is divided."""
        return "1/m^2" if self.shape == "point" else "1"

    def transform(self, k: FloatArray) -> FloatArray:
        """Return the Fourier transform at ``k`` (rad/m), in m^2; of a slit across it, in m."""
        phase = floats(k) * self.size
        square = math.pi * self.size**2
        if self.shape == "disc":
            far = phase != 0
            return square * np.divide(2 * j1(phase), phase, out=np.ones_like(phase), where=far)
        if self.shape == "slit":
            return self.size * np.sinc(phase / (2 * math.pi))
        return np.exp(-0.5 * phase**2) * (2 * square or 1.0)

    def profile(self) -> "StressProfile":
        """Return the profile that a calibration takes, with a table to draw; a point has none."""
        ends = {"slit": self.size / 2, "gaussian": _IDEAL_REACH * self.size, "point": 1.0}
        t = np.append(np.linspace(0.0, 1.0, _IDEAL_RADII), 1 + _EDGE)
        heights = {"gaussian": np.exp(-0.5 * (_IDEAL_REACH * t) ** 2), "point": 0 * t}
        values = heights.get(self.shape, np.where(t <= 1, 1.0, 0.0))
        return StressProfile(
            r=ends.get(self.shape, self.size) * t, sigma_zz=values, load=1.0, ideal=self
        )


#: Sides of a field in pixels, what may be left at its border, how even its axes are, and the
#: least share of its sum in that of its moduli.
_FEWEST = 8
_BORDER = 0.05
_EVEN = 1e-3
_LEAST = 1e-3
#: Rings of a field, to a pixel, in which its mean is summed up; directions over half a turn.
_RINGS = 16
_WAYS = 8


@keyword_array_record
class StressField:
    r"""A field in two dimensions that takes the place of a stress: U is :math:`A\,G \otimes` it.

    The centroid of its moduli is at the scan's position.  Of a beam that moves over a sensor at
    rest, give the field turned by 180 degrees, unless it is symmetric.

    Parameters
    ----------
    x, y : ndarray, shape (n,), (m,)
        Even axes, in m, increasing.
    values : ndarray, shape (m, n)
        Values, less any background.
    unit : str, default "Pa"
        Their unit, by which that of the reading is divided.
    load : float, optional
        Load that produces the field, in N; else its strength is that at the scan's nominal load.
    notes, source : str, SourceFile, optional
        What was taken of a file, and the file.

    Raises
    ------
    InputError
        If axes are uneven, a value is not finite, or the field is cut off or adds up to nothing.

    Examples
    --------
    >>> x = np.linspace(-1e-3, 1e-3, 41)
    >>> field = StressField(x=x, y=x, values=np.exp(-np.add.outer(x**2, 2 * x**2) / 0.08e-6))
    >>> round(1e6 * float(field.transform(np.zeros(1))[0] / np.pi), 4)
    0.0566
    """

    x: FloatArray
    y: FloatArray
    values: FloatArray
    unit: str = "Pa"
    load: float | None = None
    notes: str = ""
    source: SourceFile | None = None

    def __post_init__(self) -> None:
        for name in ("x", "y"):
            axis = finite_vector(f"{name} of the field", getattr(self, name))
            object.__setattr__(self, name, axis)
            require_increasing(f"{name} of the field", axis)
            steps = np.diff(axis)
            if not _FEWEST <= axis.size <= MOST_PIXELS or np.ptp(steps) > _EVEN * steps.mean():
                raise InputError(
                    f"{name} of the field has {axis.size} values, or uneven ones: not {_FEWEST} to "
                    f"{MOST_PIXELS} even ones.",
                    cure="Cut out what is not zero, and interpolate it to even pixels.",
                )
        shape = np.shape(self.values)
        expected = (self.y.size, self.x.size)
        if shape != expected:
            raise InputError(f"The field has shape {shape}, but y and x make it {expected}.")
        values = finite_vector("The field", np.ravel(self.values)).reshape(expected)
        object.__setattr__(self, "values", values)
        border = np.concatenate([values[0], values[-1], values[:, 0], values[:, -1]])
        left = np.abs(border).mean() / max(np.abs(values).max(), TINY)
        if left > _BORDER or not values.sum() > _LEAST * np.abs(values).sum():
            raise InputError(
                f"The field adds up to {values.sum():.3g}, with {left:.1%} of its largest value "
                "left at its border.",
                why="A field adds up to more than zero, and is zero where it ends.",
                cure="Change its sign, subtract the background, or give a larger field.",
            )
        if self.load is not None:
            require_positive("load of the field", self.load, "N")

    def __str__(self) -> str:
        """Return it in words."""
        wide = np.ptp(self.x) * 1e3
        high = np.ptp(self.y) * 1e3
        name = f" from {self.source.file_name}" if self.source else ""
        return f"field of {wide:.4g} mm x {high:.4g} mm{name}"

    @cached_property
    def _offsets(self) -> ArrayPair:
        """Positions along y and x from the axis of the field, in m."""
        share = np.abs(self.values) / np.abs(self.values).sum()
        return self.y - share.sum(axis=1) @ self.y, self.x - share.sum(axis=0) @ self.x

    @property
    def cell_area(self) -> float:
        """Area of a pixel, in m^2."""
        return float((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))

    def plane(self, ky: FloatArray, kx: FloatArray) -> FloatArray:
        """Return the Fourier transform about the axis, (ky, kx), complex; 0 beyond the pixels'."""
        sides = []
        for k, offset in zip((ky, kx), self._offsets, strict=True):
            inside = np.abs(k) <= np.pi / (offset[1] - offset[0])
            sides.append(np.exp(-1j * np.multiply.outer(k, offset)) * inside[:, None])
        return np.asarray(sides[0] @ self.values @ sides[1].T * self.cell_area)

    def _rings(self, per_pixel: int) -> tuple[FloatArray, ...]:
        """Return mean radius, sum and number of the pixels in rings about the axis."""
        radius = np.hypot.outer(*self._offsets).ravel()
        ring = np.rint(radius * per_pixel / math.sqrt(self.cell_area)).astype(int)
        summed = radius, self.values.ravel(), np.ones(radius.size)
        sums = [floats(np.bincount(ring, part)) for part in summed]
        radii, totals, counts = (part[sums[2] > 0] for part in sums)
        return radii / counts, totals, counts

    def transform(self, k: FloatArray) -> FloatArray:
        """Return the Hankel transform of the mean over directions about the axis."""
        r, total, _ = self._rings(_RINGS)
        return j0(np.multiply.outer(k, r)) @ total * self.cell_area

    def unevenness(self, k: FloatArray) -> float:
        """Return the share of the transform up to the last of ``k`` that is not round."""
        angle = np.arange(_WAYS) * np.pi / _WAYS
        sides = [
            np.exp(-1j * np.multiply.outer(np.multiply.outer(k, way).ravel(), offset))
            for way, offset in zip((np.sin(angle), np.cos(angle)), self._offsets, strict=True)
        ]
        polar = np.sum((sides[0] @ self.values) * sides[1], axis=1).reshape(k.size, -1)
        uneven = polar - polar.real.mean(axis=1, keepdims=True)
        powers = [np.sum(k @ np.abs(part) ** 2) for part in (uneven, polar)]
        return float(np.sqrt(powers[0] / powers[1]))

    def profile(self) -> "StressProfile":
        """Return the profile that a calibration takes, with the mean over directions as table."""
        r, total, count = self._rings(1)
        mean = total / count
        load = self.load or 1.0
        return StressProfile(r=r, sigma_zz=mean, load=load, field=self, source=self.source)


@keyword_array_record
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
    ideal, field : IdealReference, StressField, optional
        The source that the table is of, in the unit of the source.

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
    field: StressField | None = None

    def __post_init__(self) -> None:
        require_positive("load of the stress profile", self.load, "N")
        for name in ("r", "sigma_zz", "sigma_rz", "sigma_zz_errors"):
            stated = getattr(self, name)
            if stated is not None:
                values = finite_vector(f"{name} of the stress profile", stated)
                object.__setattr__(self, name, values)
                if values.size != self.r.size:
                    raise InputError(
                        f"{name} of the stress profile has {values.size} values for "
                        f"{self.r.size} radii."
                    )
        require_increasing("r of the stress profile", self.r)
        if self.r[0] < 0:
            raise InputError(
                "r of the stress profile is negative.", cure="Give radii, not positions."
            )

    def __repr__(self) -> str:
        """Return what it is of in place of thousands of array elements."""
        peak = np.abs(self.sigma_zz).max() * 1e-3
        return (
            f"<StressProfile: load {self.load:.4g} N, {self.r.size} radii to "
            f"{self.r[-1] * 1e3:.4g} mm, largest stress {peak:.4g} kPa>"
        )

    @property
    def form(self) -> IdealReference | StressField | None:
        """The source that it is of, in place of a stress below a film."""
        return self.ideal or self.field

    @property
    def unit(self) -> str:
        """The unit of its values: Pa, or that of the source."""
        return self.form.unit if self.form else "Pa"

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
        radii, values = (np.append(-v[inner][::-1], v) for v in (self.r, density))
        spline, _ = table_spline(radii, values)
        return float(2 * np.pi * spline.integrate(0.0, self.r[-1]))
