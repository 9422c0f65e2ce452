"""Rigid axisymmetric indenters."""

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.model.arrays import (
    FloatArray,
    finite_vector,
    floats,
    keyword_array_record,
    keyword_value_record,
    require_increasing,
    require_non_negative,
    require_positive,
)


class Indenter:
    """A rigid axisymmetric indenter; its face is a height over the radius.

    Examples
    --------
    >>> import memscal
    >>> isinstance(memscal.Sphere(radius=0.1), memscal.Indenter)
    True
    """

    shape: ClassVar[str]
    """Name of the shape as it stands in files."""

    @property
    def extent(self) -> float:
        """Largest radius at which the face is known, in m; ``inf`` where it has no end."""
        raise NotImplementedError

    def height(self, r: ArrayLike) -> FloatArray:
        """Return the face's height above its lowest point in m at radii ``r`` (m), or ``inf``."""
        raise NotImplementedError


@keyword_value_record
class RoundIndenter(Indenter):
    """An indenter that one radius describes.

    Parameters
    ----------
    radius, radius_uncertainty : float
        Radius of the rod or of the sphere's curvature, and its standard uncertainty (k = 1), in m;
        ``None`` means "not stated".
    name : str
        Which indenter it is, where there are several: calibrations with the same one share the
        error of its radius.

    Examples
    --------
    >>> import memscal
    >>> isinstance(memscal.Sphere(radius=0.1), memscal.RoundIndenter)
    True
    >>> isinstance(memscal.Cone(inclination=0.1), memscal.RoundIndenter)
    False
    """

    radius: float
    radius_uncertainty: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        require_positive(f"{self.shape} radius", self.radius, "m")
        require_non_negative(f"uncertainty of the {self.shape} radius", self.radius_uncertainty)

    @property
    def extent(self) -> float:
        """The radius, in m."""
        return self.radius


@keyword_value_record
class Rod(RoundIndenter):
    """A rigid flat-ended cylinder, the indenter of the calibration scan.

    Examples
    --------
    >>> Rod(radius=0.25e-3).shape
    'rod'
    """

    shape = "rod"

    def height(self, r: ArrayLike) -> FloatArray:
        """Return 0 under the rod and ``inf`` beyond its edge."""
        return np.where(np.asarray(r) <= self.radius, 0.0, np.inf)


@keyword_value_record
class Sphere(RoundIndenter):
    """A rigid sphere, the indenter of the contact scans; ``radius`` is its curvature's.

    Examples
    --------
    >>> sphere = Sphere(radius=128.8e-3)
    >>> print(f"{float(sphere.height(2e-3)) * 1e6:.3f} um")
    15.529 um
    """

    shape = "sphere"

    def height(self, r: ArrayLike) -> FloatArray:
        r"""Return :math:`R - \sqrt{R^2 - r^2}`, in m; the sphere itself, not its parabola."""
        radii = floats(r)
        inside = np.minimum(radii, self.radius)
        rise = inside**2 / (self.radius + np.sqrt((self.radius - inside) * (self.radius + inside)))
        return np.where(radii <= self.radius, rise, np.inf)


@keyword_value_record
class Cone(Indenter):
    """A rigid cone.

    Parameters
    ----------
    inclination : float
        Angle between the cone's face and the film's surface, in rad, above 0 (flat) and below a
        right angle.

    Examples
    --------
    >>> Cone(inclination=math.radians(45)).height(1e-3).round(9)
    np.float64(0.001)
    """

    shape = "cone"
    inclination: float

    def __post_init__(self) -> None:
        if not 0 < self.inclination < math.pi / 2:
            raise InputError(
                f"The cone's inclination is {self.inclination:g} rad, but it must lie between 0 "
                "and a right angle (1.5708).",
                cure="Give the angle between its face and the film's surface, in rad.",
            )

    @property
    def extent(self) -> float:
        """A cone has no end."""
        return math.inf

    def height(self, r: ArrayLike) -> FloatArray:
        """Return r tan(inclination), in m."""
        return floats(r) * math.tan(self.inclination)


@keyword_array_record
class Profile(Indenter):
    """A rigid indenter of any axisymmetric shape, such as a worn or a measured tip.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Radii from 0 upward, in m, four or more.
    z : ndarray, shape (n,)
        Height of the face in m, its lowest 0; a cubic spline goes through the table.

    Examples
    --------
    A sphere that has worn flat by 5 um at its apex:

    >>> def worn(r):
    ...     return np.maximum(r**2 / (2 * 0.1288) - 5e-6, 0.0)
    >>> Profile.from_function(worn, extent=8e-3).extent
    0.008
    """

    shape = "profile"
    r: FloatArray
    z: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "r", finite_vector("r of the indenter's profile", self.r))
        object.__setattr__(self, "z", finite_vector("height of the indenter's profile", self.z))
        require_increasing("r of the indenter's profile", self.r)
        if self.r.size != self.z.size or self.r.size < 4 or self.r[0] != 0:
            raise InputError(
                f"The indenter's profile has {self.r.size} radii from {self.r[0] * 1e3:g} mm and "
                f"{self.z.size} heights.",
                cure="Give a height for each of four or more radii, the first at the axis (0).",
            )
        lowest = self.z.min()
        height = np.ptp(self.z)
        if abs(lowest) > 1e-9 * height or height == 0:
            raise InputError(
                f"The lowest height of the indenter's profile is {lowest * 1e6:.4g} um, and its "
                f"highest {self.z.max() * 1e6:.4g} um.",
                why="Heights count from the point that touches first, and a flat end is a rod.",
                cure="Subtract the lowest height from the table; press a Rod if it is flat.",
            )

    @classmethod
    def from_function(
        cls, height: Callable[[FloatArray], ArrayLike], *, extent: float, points: int = 2001
    ) -> "Profile":
        """Return the profile of a function: ``points`` even radii up to ``extent``, all in m."""
        require_positive("extent of the indenter's profile", extent, "m")
        r = np.linspace(0.0, extent, points)
        return cls(r=r, z=np.broadcast_to(height(r), r.shape))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Profile) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def __repr__(self) -> str:
        """Return its size in place of its table."""
        return (
            f"<Profile: {self.r.size} radii to {self.r[-1] * 1e3:.4g} mm, "
            f"heights to {self.z.max() * 1e6:.4g} um>"
        )

    @property
    def extent(self) -> float:
        """The last radius of the table, in m."""
        return float(self.r[-1])

    def height(self, r: ArrayLike) -> FloatArray:
        """Return the height at ``r`` in m by a monotone cubic spline, in m."""
        from scipy.interpolate import PchipInterpolator

        radii = floats(r)
        inside = PchipInterpolator(self.r, self.z)(np.minimum(radii, self.extent))
        return np.where(radii <= self.extent, inside, np.inf)

    def _content(self) -> tuple[bytes, bytes]:
        return self.r.tobytes(), self.z.tobytes()
