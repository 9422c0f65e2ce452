"""Laws of the interface and their evidence, as tables and as JSON."""

from __future__ import annotations

import math
from typing import Any, Protocol

from memscal.friction.results import (
    InterfaceComparison,
    InterfaceLaw,
    InterfaceLength,
    Interval,
    LawComparison,
)
from memscal.model.notation import format_bound
from memscal.summaries.table import Table, finite, texts_of

__all__ = ["bounded_text", "friction_name", "interface_json", "interface_tables", "percent"]


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


_UM = 1e-6
_MPA_PER_MM = 1e9


def _parts(found: InterfaceComparison) -> dict[str, LawComparison]:
    """Return what was compared, by the direction in which the interface yields."""
    both = {"tangential": found.tangential, "normal": found.normal}
    return {name: part for name, part in both.items() if part is not None}


def interface_tables(found: InterfaceComparison) -> list[Table]:
    """Return evidence and lengths, and what a slip length means at each load."""
    tables = []
    for direction, part in _parts(found).items():
        tables.append(_law_table(direction, part))
        tables += [_length_table(direction, part), _priors_table(part)]
        if part.implied is not None:
            tables.append(_implied_table(part))
    return tables


def _law_table(direction: str, part: LawComparison) -> Table:
    best = max(law.log_evidence for law in part.laws)
    title = (
        f"Laws of the {part.lubrication or 'contact'} interface, {direction}: "
        "evidence over all loads, below the best"
    )
    rows = [
        [
            law.name,
            _best(part, law),
            f"{law.log_evidence - best:.1f}",
            f"{law.least / law.degrees:.2f}" if law.degrees > 0 else "",
            f"{law.p_value:.2g}",
        ]
        for law in part.laws
    ]
    return Table(title, ["law", "best", "ln of evidence", "χ²/ν", "p"], rows)


def _best(part: LawComparison, law: InterfaceLaw) -> str:
    """Return the free parameters where the likelihood is largest; the last law's is a length."""
    if law is part.laws[-1]:
        return ", ".join(f"{value / _UM:.3g} um" for value in law.best)
    return ", ".join(friction_name(float(f"{value:.3g}")) for value in law.best)


def _length_table(direction: str, part: LawComparison) -> Table:
    """Return the length by which the interface yields, and how the evidence stands."""
    words = "slip length" if direction == "tangential" else "length"
    found = bounded_text(part.length, _UM, "um")
    rows = []
    for factor in part.factors:
        yielding = factor.favoured == part.laws[-1].name
        rows.append(
            [
                factor.against if yielding else factor.favoured,
                _factor(factor.value),
                f"{'for' if yielding else 'against'} it, {factor.words}",
            ]
        )
    level = f" [{percent(part.length.interval.level)} interval]" if "[" in found else ""
    title = f"The law that yields, {words} {found}{level}, against the others"
    return Table(title, ["law", "Bayes factor", "evidence"], rows)


def _priors_table(part: LawComparison) -> Table:
    rows = [[prior.prior, f"{prior.log_factor:.1f}"] for prior in part.priors]
    title = f"The same against {part.laws[0].name}, under other priors"
    return Table(title, ["prior", "ln of the Bayes factor"], rows)


def _factor(value: float) -> str:
    return f"{value:.3g}" if value < 1e6 else f"{value:.1e}"


def _implied_table(part: LawComparison) -> Table:
    implied = part.implied
    if implied is None:
        return Table("", ("",), [])
    rows = []
    for load, friction, pressure, stiffness in zip(
        implied.loads, implied.friction, implied.pressures, implied.stiffnesses, strict=True
    ):
        low, high = sorted((friction[0], friction[2]))
        soft, stiff = sorted((stiffness[0], stiffness[2]))
        rows.append([
            f"{load:.4g}",
            _between(friction[1], low, high),
            f"{pressure / 1e3:.4g}",
            _between(*(value / _MPA_PER_MM for value in (stiffness[1], soft, stiff))),
        ])  # fmt: skip
    head = ["load (N)", "effective coefficient", "mean pressure (kPa)", "stiffness (MPa/mm)"]
    return Table("What the slip length means at each load [its 95 % interval]", head, rows)


def _between(value: float, low: float, high: float) -> str:
    return f"{_short(value)} [{_short(low)}, {_short(high)}]"


def _short(value: float) -> str:
    return friction_name(float(f"{value:.2g}"))


def interface_json(found: InterfaceComparison) -> dict[str, Any]:
    """Return laws, evidence and lengths as JSON says them."""
    return {name: _part_json(part) for name, part in _parts(found).items()} | {
        "warnings": texts_of(found.messages)
    }


def _part_json(part: LawComparison) -> dict[str, Any]:
    implied = part.implied
    return {
        "lubrication": part.lubrication,
        "loads_n": [finite(load) for load in part.loads],
        "laws": [_law_json(law) for law in part.laws],
        "bayes_factors": [
            {
                "favoured": factor.favoured,
                "against": factor.against,
                "log_factor": finite(factor.log_factor),
                "words": factor.words,
            }
            for factor in part.factors
        ],
        "length": _length_json(part.length),
        "other_priors": [
            {"prior": prior.prior, "log_factor": finite(prior.log_factor)} for prior in part.priors
        ],
        "implied": None
        if implied is None
        else [
            {
                "load_n": finite(load),
                "effective_friction_coefficient": [finite(mu) for mu in friction],
                "mean_pressure_kpa": finite(pressure / 1e3),
                "stiffness_mpa_per_mm": [finite(k / _MPA_PER_MM) for k in stiffness],
            }
            for load, friction, pressure, stiffness in zip(
                implied.loads, implied.friction, implied.pressures, implied.stiffnesses, strict=True
            )
        ],
    }


def _law_json(law: InterfaceLaw) -> dict[str, Any]:
    return {
        "name": law.name,
        "best": [finite(value) for value in law.best],
        "log_evidence": finite(law.log_evidence),
        "log_likelihood": finite(law.log_likelihood),
        "numerical_error": finite(law.numerical_error),
        "chi2": finite(law.least),
        "degrees": law.degrees,
        "p_value": finite(law.p_value),
    }


def _length_json(length: InterfaceLength) -> dict[str, Any]:
    def um(value: float | None) -> float | None:
        return None if value is None else finite(value / _UM)

    return {
        "value": um(length.value),
        "standard_uncertainty": um(length.standard_uncertainty),
        "unit": "um",
        "interval": {
            "low": um(length.interval.low),
            "high": um(length.interval.high),
            "level": length.interval.level,
        },
        "reason": length.reason or None,
    }
