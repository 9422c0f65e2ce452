"""An effective friction coefficient, or a length, in words: with its interval or as a bound."""

from __future__ import annotations

import math
from typing import Protocol

from memscal.friction.results import Interval
from memscal.model.notation import format_bound

__all__ = ["bounded_text", "friction_name", "percent"]


class Bounded(Protocol):
    """What has a value within an interval, or only the interval."""

    @property
    def value(self) -> float | None: ...
    @property
    def interval(self) -> Interval: ...


def bounded_text(found: Bounded, scale: float = 1.0, unit: str = "") -> str:
    """Return a value with its interval, or the bound that is left of it; never a bare number.

    Bounds are rounded outward, so that what is said is not more than what was found.

    Parameters
    ----------
    found : EffectiveFriction or InterfaceLength
        What was found.
    scale : float
        SI units in the unit that is shown.
    unit : str
        Its name; empty for a number without one.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> def found(value, low, high):
    ...     return SimpleNamespace(value=value, interval=Interval(low, high))
    >>> bounded_text(found(0.2134, 0.171, 0.262))
    '0.21 [0.17, 0.26]'
    >>> bounded_text(found(None, 0.2433, None))
    'above 0.24 (95 %)'
    >>> bounded_text(found(0.0, 0.0, 0.0123))
    'below 0.013 (95 %)'
    >>> bounded_text(found(None, 0.0, None))
    'not identifiable'
    >>> bounded_text(found(None, 0.0, 1.23e-6), 1e-6, "um")
    'below 1.3 um (95 %)'
    """
    tail = f" {unit}" if unit else ""
    low, high = found.interval.low / scale, found.interval.high
    level = percent(found.interval.level)
    if high is None:
        if low <= 0:
            return "not identifiable"
        bound = format_bound(low, upper=False)
        if found.value is None:
            return f"above {bound}{tail} ({level})"
        return f"{found.value / scale:.2g} [{bound}, ∞]{tail}"
    high /= scale
    if low <= 0 and (found.value is None or found.value <= 0):
        return f"below {format_bound(high, upper=True)}{tail} ({level})"
    if found.value is None:
        return (
            f"[{format_bound(low, upper=False)}, {format_bound(high, upper=True)}]{tail} ({level})"
        )
    return f"{_rounded(found.value / scale, low, high)}{tail}"


def _rounded(value: float, low: float, high: float) -> str:
    """Return a value and its interval, with the digits that its closer end deserves.

    Two digits of the distance to it if that begins with 1 or 2, one otherwise.
    """
    sides = [side for side in (value - low, high - value) if side > 0]
    places = max(0, -math.floor(math.log10(min(sides) / 3))) if sides else 3
    ends = (f"{end:.{places}f}" if end > 0 else "0" for end in (low, high))
    return f"{value:.{places}f} [{', '.join(ends)}]"


def friction_name(friction: float) -> str:
    """Return a friction coefficient as it is typed: ``0.15`` or ``inf``."""
    return "inf" if math.isinf(friction) else f"{friction:.4g}"


def percent(share: float) -> str:
    """Return a share in percent, with the space of ISO 80000: ``95 %``."""
    return f"{100 * share:.3g} %"
