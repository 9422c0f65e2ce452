"""The length over which an interface yields, from the likelihood along it."""

from __future__ import annotations

import math

from memscal.friction.compliance_results import InterfaceLength
from memscal.friction.family import ProfileFamily
from memscal.friction.interval import profiled
from memscal.friction.law_curves import LawCurve

__all__ = ["interface_length"]

_UM = 1e-6


def interface_length(found: LawCurve, family: ProfileFamily, what: str) -> InterfaceLength:
    """Return a length by profile likelihood, one-sided where the data give only a bound.

    Parameters
    ----------
    found : LawCurve
        The likelihood along the length.
    family : ProfileFamily
        The contacts that were calculated.
    what : str
        Name of the length, for the reason.
    """
    curve = profiled(found.coordinates, found.deviance, family.value_at)
    known = not curve.open_low and not curve.open_high
    return InterfaceLength(
        value=curve.best if known else None,
        standard_uncertainty=curve.standard_uncertainty if known else None,
        interval=curve.interval,
        reason=_reason(what, curve.interval.low, curve.interval.high, family),
        values=found.values,
        deviance=found.deviance,
    )


def _reason(what: str, low: float, high: float | None, family: ProfileFamily) -> str:
    if low > 0 and high is not None:
        return ""
    last = float(family.values[-1])
    end = (
        "one that bears no shear"
        if math.isinf(last)
        else f"the largest that was calculated, {last / _UM:.3g} um,"
    )
    if low > 0:
        return (
            f"The {what} is not identifiable above {low / _UM:.3g} um: larger ones, {end} "
            "included, agree with the data as well. This is a lower bound."
        )
    if high is not None:
        return (
            f"The {what} is not identifiable below {high / _UM:.3g} um: a rigid interface agrees "
            "with the data as well. This is an upper bound."
        )
    return (
        f"The {what} is not identifiable: a rigid interface and {end} agree with the data "
        "equally well."
    )
