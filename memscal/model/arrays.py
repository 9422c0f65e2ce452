"""The few checks that the dataclasses share."""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.errors import InputError, UnitWarning

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
ArrayPair = tuple[FloatArray, FloatArray]
ArrayTriple = tuple[FloatArray, FloatArray, FloatArray]
ArrayFunction = Callable[[FloatArray], FloatArray]

Arrays = dict[str, FloatArray]
Columns = dict[str, NDArray[Any]]
Values = dict[str, Any]
"""Arrays, and any values, by their names."""

Axes = tuple[str, ...]
"""Names of the axes of an array."""

_Class = TypeVar("_Class")


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field,))
def array_record(cls: type[_Class]) -> type[_Class]:
    """Make a class a frozen dataclass that equals itself alone: arrays have no single truth."""
    # It shows its fields where neither it nor a base says how it is shown.
    return dataclass(frozen=True, eq=False, repr=cls.__repr__ is object.__repr__)(cls)


@dataclass_transform(
    frozen_default=True, eq_default=False, kw_only_default=True, field_specifiers=(field,)
)
def keyword_array_record(cls: type[_Class]) -> type[_Class]:
    """Make a class a record of arrays whose fields are given by their names."""
    return dataclass(frozen=True, kw_only=True, eq=False, repr=cls.__repr__ is object.__repr__)(cls)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def value_record(cls: type[_Class]) -> type[_Class]:
    """Make a class a frozen dataclass that equals another of the same values."""
    return dataclass(frozen=True)(cls)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(field,))
def keyword_value_record(cls: type[_Class]) -> type[_Class]:
    """Make a class a record of values whose fields are given by their names."""
    return dataclass(frozen=True, kw_only=True)(cls)


#: In place of zero where a divisor or a logarithm must not be that.
TINY = float(np.finfo(float).tiny)
#: Sizes of numbers, in SI units, whose squares and quotients neither overflow nor vanish.
_SMALLEST = 1e-30
_LARGEST = 1e30
#: Wide ranges of what films and indenters have, in SI units; a thousand times the lowest is usual.
_SIZES = {
    "young_modulus": ("Young's modulus", "Pa", 1e3, 1e10),
    "thickness": ("The thickness of the film", "m", 1e-6, 0.1),
    "radius": ("The radius of the indenter", "m", 1e-6, 0.1),
}
_PREFIXES = {"m": 1e-3, "u": 1e-6, "k": 1e3, "M": 1e6, "G": 1e9}
_SHOWN: dict[Any, Any] = {}


def floats(values: ArrayLike) -> FloatArray:
    """Return values as an array of floating-point numbers."""
    return np.asarray(values, dtype=np.float64)


def require_number(name: str, value: Any) -> None:
    """Refuse a value that is not one number."""
    try:
        math.isnan(value)
    except TypeError:
        raise InputError(f"{name} is {value!r}, but one number is needed.") from None


def require_positive(name: str, value: float, unit: str = "") -> None:
    """Refuse a value that is not a finite number above zero, or no quantity at all."""
    require_number(name, value)
    if not 0 < value < math.inf:
        problem = f"{name} is {value:g} {unit}".rstrip() + ", but it must be finite and above zero."
        raise InputError(problem, cure="Check the value and its unit.")
    require_size(name, value, unit)


def warn_of_units(*records: Any) -> None:
    """Warn of the film and the indenter of no set-up, and name the unit that was probably meant."""
    for record in records:
        for name, (words, unit, low, high) in _SIZES.items():
            # A sphere's radius is that of its curvature: a lens has metres.
            most = high * (1000 if getattr(record, "shape", "") == "sphere" else 1)
            value = getattr(record, name, low)
            if low <= value <= most:
                continue
            prefix = min(_PREFIXES, key=lambda p: abs(math.log(value * _PREFIXES[p] / low / 1e3)))
            meant = value * _PREFIXES[prefix]
            text = (
                f"{words} is {value:g} {unit}. Probably {value:g} "
                f"{prefix}{unit} was meant, which is {meant:g} {unit}."
            )
            # Of one place in the code, so that each text is shown once.
            warnings.warn_explicit(text, UnitWarning, "memscal", 1, registry=_SHOWN)


def require_size(
    name: str, values: ArrayLike, unit: str = "", *, smallest: float = _SMALLEST
) -> None:
    """Refuse numbers of a size that no quantity has, in whatever unit it was stated."""
    sizes = np.abs(values)
    largest = np.max(sizes, where=np.isfinite(sizes), initial=0.0)
    if largest and not smallest <= largest <= _LARGEST:
        raise InputError(
            f"{name} is {largest:.3g} {unit}".rstrip() + ", a size that no quantity has.",
            why=f"In SI units quantities lie from {_SMALLEST:g} to {_LARGEST:g}.",
            cure="Check the values and their unit.",
        )


def require_non_negative(name: str, value: float | None) -> None:
    """Refuse a value that is stated, and is not a finite number of at least zero."""
    if value is None:
        return
    require_number(name, value)
    if not 0 <= value < math.inf:
        raise InputError(f"{name} is {value:g}, but it must be finite and not negative.")


def require_range(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    """Refuse a value outside the closed range from ``low`` to ``high``."""
    if not low <= value <= high:
        raise InputError(
            f"{name} is {value:g} {unit}".rstrip() + f", but it must lie from {low:g} to {high:g}.",
            cure="Check the value and its unit.",
        )


def unmasked(values: Any) -> Any:
    """Return values with NaN in the place of each that numpy has masked."""
    parts = values if isinstance(values, list | tuple) else [values]
    masked = any(map(np.ma.isMaskedArray, parts))
    return np.ma.array(values, dtype=object).filled(np.nan) if masked else values


def slices(count: int, most: int) -> list[slice]:
    """Return slices of up to so many items each, which together cover ``count`` of them."""
    return [slice(start, min(start + most, count)) for start in range(0, count, most)]


def frozen_array(
    values: ArrayLike, *, dtype: Any = np.float64, name: str = "The array"
) -> NDArray[Any]:
    """Return a read-only copy, so that a frozen dataclass stays frozen; NaN where it is masked."""
    try:
        array = np.array(unmasked(values), dtype=dtype)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is no array of numbers: {error}.") from error
    array.setflags(write=False)
    return array


@array_record
class FrozenArrays:
    """Base of a frozen dataclass whose arrays are read-only copies of what it was made of."""

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray | list):
                object.__setattr__(self, item.name, frozen_array(value, name=item.name))


def finite_vector(name: str, values: ArrayLike) -> FloatArray:
    """Return a read-only 1-D copy; refuse another shape or a value that is not finite."""
    array = frozen_array(values, name=name)
    if array.ndim != 1 or array.size == 0:
        raise InputError(f"{name} has shape {array.shape}, but a 1-D array with values is needed.")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} holds a value that is not finite.")
    return array


def require_increasing(name: str, values: FloatArray) -> None:
    """Refuse an axis that does not strictly increase."""
    if np.any(np.diff(values) <= 0):
        raise InputError(f"{name} must increase strictly.", cure="Sort it; merge equal positions.")


def table_spline(x: FloatArray, y: FloatArray) -> tuple[Any, bool]:
    """Return a cubic spline through a table (n,) or (n, m); a monotone one of an edge, and True."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    # A table has an edge where it changes by a twentieth of its range within an interval that is
    # narrower than a tenth of its neighbours.
    widths = np.diff(x)
    jumps = np.abs(np.diff(y, axis=0))
    narrow = widths[1:-1] < 0.1 * np.minimum(widths[:-2], widths[2:])
    sharp = bool(np.any(jumps[1:-1][narrow] > 0.05 * np.ptp(y, axis=0)))
    # A cubic spline swings about an edge, by more than the table holds.
    return (PchipInterpolator if sharp else CubicSpline)(x, y), sharp


class ByContent:
    """A record with arrays that is equal to another of its class with the same content."""

    def __eq__(self, other: object) -> bool:
        return same_content(self, other) if isinstance(other, type(self)) else NotImplemented

    # Arrays have no hash; object's own is declared as a method.
    __hash__ = None  # type: ignore[assignment]


def same_content(first: Any, second: Any) -> bool:
    """Whether two records hold the same, array by array; NaN is equal to NaN."""
    if isinstance(first, np.ndarray | float):
        alike = isinstance(second, np.ndarray | float | int)
        return alike and np.array_equal(first, second, equal_nan=True)
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(
            same_content(first[key], second[key]) for key in first
        )
    if isinstance(first, tuple | list) and isinstance(second, tuple | list):
        return len(first) == len(second) and all(map(same_content, first, second))
    if is_dataclass(first) and type(first) is type(second):
        return same_content(vars(first), vars(second))
    return bool(first == second)
