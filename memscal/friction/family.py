r"""Calculated base stresses along one parameter of the interface, at each load of a scan.

A family holds the transforms :math:`\hat\sigma(k; P, \theta)` of the base stress of contacts that
were solved at a few values of one parameter :math:`\theta`: the friction coefficient, or a length
by which the interface yields.  Between the values it interpolates in the bounded coordinate

.. math:: t = \frac{\theta}{\theta + \theta_0}, \qquad 0 \le t \le 1,

in which :math:`\theta = \infty` is the point :math:`t = 1`, by a monotone cubic (Fritsch and
Carlson): past the friction at which the contact sticks wholly nothing changes any more, and an
interpolant must not ring there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import InputError
from memscal.model.arrays import FloatArray, freeze_arrays, require_positive
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere

__all__ = [
    "FRICTION_SCALE",
    "FamilyMember",
    "LogDerivatives",
    "ProfileFamily",
    "bounded",
    "poisson_ratios",
    "scaled_changes",
]

FRICTION_SCALE = 0.3
"""Friction at the middle of the bounded coordinate: there a contact begins to stick wholly."""

#: A value this much, relatively, beyond the last one of a family is the last one.
_ROUNDING = 1e-9


def bounded(value: float, scale: float) -> float:
    """Return the bounded coordinate of a value: 1 where it is infinite.

    Examples
    --------
    >>> bounded(0.3, 0.3), bounded(math.inf, 0.3)
    (0.5, 1.0)
    """
    return 1.0 if math.isinf(value) else value / (value + scale)


@dataclass(frozen=True, eq=False)
class FamilyMember:
    """Base-stress transforms of one member of a family, at L loads and K wavenumbers.

    Parameters
    ----------
    value : float
        The parameter of the member.
    loads : ndarray, shape (L,)
        Loads in N.
    spectra : ndarray, shape (L, K)
        Transforms of the base stress, in N.
    by_load : ndarray, shape (L, K)
        Their derivatives by the logarithm of the load, in N.
    changes : mapping of str to ndarray, shape (L, K)
        Their changes by one standard uncertainty of each source, in N.
    by_coordinate : ndarray, shape (L, K)
        Their derivatives by the bounded coordinate, in N.
    """

    value: float
    loads: FloatArray
    spectra: FloatArray
    by_load: FloatArray
    changes: Mapping[str, FloatArray]
    by_coordinate: FloatArray


@dataclass(frozen=True, eq=False)
class ProfileFamily:
    r"""Base-stress transforms of contacts along one parameter, at each load.

    Parameters
    ----------
    name : str
        ``"amontons"``, ``"elasto-plastic"``, ``"normal-compliance"`` or ``"external"``.
    loading : str
        ``"incremental"`` or ``"total"``; ``""`` where it is unknown or makes no difference.
    wavenumbers : Wavenumbers
        Nodes k, shape (K,).
    loads : ndarray, shape (L,)
        Loads in N, in the order in which they were asked for.
    values : ndarray, shape (M,)
        Values of the parameter, increasing from 0 or above; the last may be ``inf``.  A friction
        coefficient, or a length in m.
    scale : float
        :math:`\theta_0` of the bounded coordinate, in the unit of ``values``.
    spectra : ndarray, shape (M, L, K)
        Transforms :math:`2\pi\int\sigma_{zz}\,J_0(kr)\,r\,dr`, in N.
    by_load : ndarray, shape (M, L, K)
        Their derivatives by the logarithm of the load, in N.
    changes : mapping of str to ndarray, shape (M, L, K)
        Their change by one standard uncertainty of ``"young_modulus"``, ``"thickness"``,
        ``"poisson_ratio"`` and ``"indenter_radius"``: only of those whose uncertainty is stated.
    depths, contact_radii : ndarray, shape (M, L)
        Indentation depths and contact radii in m; NaN where they are not known.
    convergence : ndarray, shape (M, L)
        Largest change under refinement, relative to the largest stress; NaN where not known.
    notes : tuple of str
        What was assumed, in words.
    order : int
        Zero for the normal stress; one for the shear, whose transforms are
        :math:`2\pi\int\tau\,J_1(kr)\,r\,dr`.

    Raises
    ------
    InputError
        If the shapes disagree, the values do not increase, or the scale is not positive.

    Examples
    --------
    >>> from memscal.friction.calculated import amontons_family
    >>> from memscal.model.film import ElasticFilm
    >>> from memscal.model.indenter import Sphere
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> family = amontons_family(
    ...     film, Sphere(radius=128.8e-3), [0.34], friction=(0.0, 0.2, 0.4), reach=8e-3
    ... )
    >>> member = family.at(0.1)
    >>> stress = family.wavenumbers.synthesise(member.spectra[0], np.array(0.0))
    >>> print(f"{stress / 1e3:.0f} kPa on the axis")
    30 kPa on the axis
    >>> round(family.value_at(family.coordinate(0.1)), 9)
    0.1
    """

    name: str
    loading: str
    wavenumbers: Wavenumbers
    loads: FloatArray
    values: FloatArray
    scale: float
    spectra: FloatArray
    by_load: FloatArray
    changes: Mapping[str, FloatArray]
    depths: FloatArray
    contact_radii: FloatArray
    convergence: FloatArray
    notes: tuple[str, ...] = field(default=())
    order: int = 0

    def __post_init__(self) -> None:
        arrays = ("loads", "values", "spectra", "by_load")
        freeze_arrays(self, *arrays, "depths", "contact_radii", "convergence")
        kept = {source: np.array(change) for source, change in self.changes.items()}
        for change in kept.values():
            change.setflags(write=False)
        object.__setattr__(self, "changes", MappingProxyType(kept))
        require_positive("scale of a profile family", self.scale)
        self._require_shapes()
        if np.any(np.isnan(self.values)) or self.values[0] < 0 or np.any(np.diff(self.values) <= 0):
            raise InputError(
                f"The values of a profile family are {', '.join(f'{v:g}' for v in self.values)}.",
                why="They increase strictly, from 0 or above.",
                cure="Sort them, and give each once.",
            )

    def _require_shapes(self) -> None:
        table = (self.values.size, self.loads.size)
        whole = (*table, self.wavenumbers.k.size)
        wanted: dict[str, tuple[FloatArray, tuple[int, ...]]] = {
            "spectra": (self.spectra, whole),
            "by_load": (self.by_load, whole),
            **{f"changes[{name!r}]": (c, whole) for name, c in self.changes.items()},
            "depths": (self.depths, table),
            "contact_radii": (self.contact_radii, table),
            "convergence": (self.convergence, table),
        }
        for name, (array, shape) in wanted.items():
            if array.shape != shape:
                raise InputError(
                    f"{name} of a profile family has shape {array.shape}, not {shape}."
                )

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what was computed on demand; a mapping proxy cannot be pickled."""
        state = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return state | {"changes": dict(self.changes)}

    @property
    def coordinates(self) -> FloatArray:
        """Bounded coordinates of the values, shape (M,)."""
        return np.array([self.coordinate(float(value)) for value in self.values])

    def coordinate(self, value: float) -> float:
        r"""Return the bounded coordinate :math:`t = \theta/(\theta + \theta_0)` of a value.

        Raises
        ------
        InputError
            If the value is negative or not a number.
        """
        if math.isnan(value) or value < 0:
            raise InputError(f"A {self.name} family has no value {value:g}: it is not negative.")
        return bounded(value, self.scale)

    def value_at(self, coordinate: float) -> float:
        """Return the value at a bounded coordinate: the inverse of :meth:`coordinate`.

        Raises
        ------
        InputError
            If the coordinate does not lie from 0 to 1.
        """
        if not 0 <= coordinate <= 1:
            raise InputError(f"A bounded coordinate is {coordinate:g}, but it lies from 0 to 1.")
        return math.inf if coordinate == 1 else self.scale * coordinate / (1 - coordinate)

    def at(self, value: float) -> FamilyMember:
        """Return the member at any value between the first and the last.

        Raises
        ------
        InputError
            If the family does not reach the value.
        """
        known, t = self.coordinates, self.coordinate(value)
        if not known[0] - _ROUNDING <= t <= known[-1] + _ROUNDING:
            raise InputError(
                f"A {self.name} family from {self.values[0]:g} to {self.values[-1]:g} does not "
                f"reach {value:g}.",
                why="It is interpolated, not extrapolated.",
                cure="Calculate it with a value beyond.",
            )
        t = min(max(t, known[0]), known[-1])
        found = self._interpolant(t)
        slope = self._slope(t)[0]
        changes = dict(zip(self.changes, found[2:], strict=True))
        return FamilyMember(float(value), self.loads, found[0], found[1], changes, slope)

    def only(self, loads_index: int | Sequence[int]) -> ProfileFamily:
        """Return the family at one or several of its loads, by index, in the order given."""
        chosen = np.atleast_1d(np.asarray(loads_index, dtype=np.intp))
        return replace(
            self,
            loads=self.loads[chosen],
            spectra=self.spectra[:, chosen],
            by_load=self.by_load[:, chosen],
            changes={name: change[:, chosen] for name, change in self.changes.items()},
            depths=self.depths[:, chosen],
            contact_radii=self.contact_radii[:, chosen],
            convergence=self.convergence[:, chosen],
        )

    @cached_property
    def _stack(self) -> FloatArray:
        """Everything that is interpolated, shape (M, 2 + sources, L, K)."""
        return np.stack([self.spectra, self.by_load, *self.changes.values()], axis=1)

    @cached_property
    def _pieces(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.coordinates, self._stack, axis=0)

    def _interpolant(self, t: float) -> FloatArray:
        return self._stack[0] if self.values.size == 1 else np.asarray(self._pieces(t))

    def _slope(self, t: float) -> FloatArray:
        if self.values.size == 1:
            return np.zeros_like(self._stack[0])
        return np.asarray(self._pieces(t, 1))


#: Smaller steps of Poisson's ratio would show the rings' placing beside the change.
_SMALLEST_STEP = 0.01


@dataclass(frozen=True, eq=False)
class LogDerivatives:
    """Transforms and their derivatives by logarithms, arrays of one shape, in N.

    Parameters
    ----------
    spectra : ndarray
        The transforms.
    load, wavenumber : ndarray
        Derivatives by load and wavenumber.
    length, strength : ndarray
        Derivatives by the length over which the interface yields and by the strength of its law;
        zero for a rigid interface.
    """

    spectra: FloatArray
    load: FloatArray
    wavenumber: FloatArray
    length: FloatArray
    strength: FloatArray


def scaled_changes(
    film: ElasticFilm, indenter: Sphere, by: LogDerivatives
) -> Mapping[str, FloatArray]:
    """Return the changes by one standard uncertainty that follow from the scales of a contact.

    Parameters
    ----------
    film, indenter
        Their stated uncertainties count; what is not stated is left out.
    by : LogDerivatives
        Transforms and what is known of their derivatives.

    Returns
    -------
    mapping of str to ndarray, in N
        ``"young_modulus"``, ``"thickness"`` and ``"indenter_radius"``, as far as stated.

    Examples
    --------
    A transform that is in proportion to the load does not depend on Young's modulus:

    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3,
    ...                    young_modulus_uncertainty=2.2e5)
    >>> one, nothing = np.ones(3), np.zeros(3)
    >>> by = LogDerivatives(one, load=one, wavenumber=nothing, length=nothing, strength=nothing)
    >>> scaled_changes(film, Sphere(radius=0.1288), by)
    {'young_modulus': array([0., 0., 0.])}
    """
    stiffer = by.spectra - by.load
    derivatives = {
        "young_modulus": stiffer,
        "thickness": 3 * stiffer + by.wavenumber - 2 * by.length - by.strength,
        "indenter_radius": -stiffer + by.length + by.strength,
    }
    stated = {
        "young_modulus": (film.young_modulus, film.young_modulus_uncertainty),
        "thickness": (film.thickness, film.thickness_uncertainty),
        "indenter_radius": (indenter.radius, indenter.radius_uncertainty),
    }
    return {
        source: np.asarray(derivatives[source] * (uncertainty / value))
        for source, (value, uncertainty) in stated.items()
        if uncertainty is not None
    }


def poisson_ratios(film: ElasticFilm) -> tuple[float, float] | None:
    """Return the two Poisson's ratios whose difference shows its influence.

    ``None`` where its uncertainty is not stated or zero.  An incompressible film is at the end of
    the range: the difference is then one-sided.
    """
    if not (u := film.poisson_ratio_uncertainty):
        return None
    step = max(u, _SMALLEST_STEP)
    return min(film.poisson_ratio + step, 0.5), max(film.poisson_ratio - step, 0.0)
