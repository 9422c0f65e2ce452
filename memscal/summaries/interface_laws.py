"""Laws of the interface and their evidence, as tables and as JSON."""

from __future__ import annotations

import math
from typing import Any

from memscal.friction.results import (
    BoundedEstimate,
    ImpliedFriction,
    InterfaceComparison,
    InterfaceLaw,
    LawComparison,
    percent,
)
from memscal.summaries.table import Table, finite, texts_of


def friction_name(friction: float) -> str:
    """Return a friction coefficient as it is typed: ``0.15`` or ``inf``."""
    return "inf" if math.isinf(friction) else f"{friction:.4g}"


_UM = 1e-6
_MPA_PER_MM = 1e9


def tables(comparison: InterfaceComparison) -> list[Table]:
    """Return evidence and lengths, and what a slip length means at each load."""
    shown = []
    for direction, compared in comparison.by_direction.items():
        rows = [[prior.prior, f"{prior.log_factor:.1f}"] for prior in compared.priors]
        title = f"The same against {compared.laws[0].name}, under other priors"
        shown += [_law_table(direction, compared), _length_table(direction, compared)]
        shown.append(Table(title, ["prior", "ln of the Bayes factor"], rows))
        if compared.implied is not None:
            shown.append(_implied_table(compared.implied))
    return shown


def _law_table(direction: str, compared: LawComparison) -> Table:
    best = max(law.log_evidence for law in compared.laws)
    title = (
        f"Laws of the {compared.lubrication or 'contact'} interface, {direction}: "
        "evidence over all loads, below the best"
    )
    rows = [
        [
            law.name,
            _best(compared, law),
            f"{law.log_evidence - best:.1f}",
            f"{law.least / law.degrees:.2f}" if law.degrees > 0 else "",
            f"{law.p_value:.2g}",
        ]
        for law in compared.laws
    ]
    return Table(title, ["law", "best", "ln of evidence", "χ²/ν", "p"], rows)


def _best(compared: LawComparison, law: InterfaceLaw) -> str:
    """Return the free parameters where the likelihood is largest; the last law's is a length."""
    if law is compared.laws[-1]:
        return ", ".join(f"{value / _UM:.3g} um" for value in law.best)
    return ", ".join(friction_name(float(f"{value:.3g}")) for value in law.best)


def _length_table(direction: str, compared: LawComparison) -> Table:
    """Return the length by which the interface yields, and how the evidence stands."""
    words = "slip length" if direction == "tangential" else "length"
    length = str(compared.length)
    rows = []
    for factor in compared.factors:
        yielding = factor.favoured == compared.laws[-1].name
        law, side = (factor.against, "for") if yielding else (factor.favoured, "against")
        value = f"{factor.value:.3g}" if factor.value < 1e6 else f"{factor.value:.1e}"
        rows.append([law, value, f"{side} it, {factor.words}"])
    level = f" [{percent(compared.length.interval.level)} interval]" if "[" in length else ""
    title = f"The law that yields, {words} {length}{level}, against the others"
    return Table(title, ["law", "Bayes factor", "evidence"], rows)


def _implied_table(implied: ImpliedFriction) -> Table:
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


def mapping(comparison: InterfaceComparison) -> dict[str, Any]:
    """Return laws, evidence and lengths as JSON says them."""
    directions = {name: _laws_json(compared) for name, compared in comparison.by_direction.items()}
    return directions | {"warnings": texts_of(comparison.messages)}


def _laws_json(compared: LawComparison) -> dict[str, Any]:
    implied = compared.implied
    return {
        "lubrication": compared.lubrication,
        "loads_n": [finite(load) for load in compared.loads],
        "laws": [_law_json(law) for law in compared.laws],
        "bayes_factors": [
            {
                "favoured": factor.favoured,
                "against": factor.against,
                "log_factor": finite(factor.log_factor),
                "words": factor.words,
            }
            for factor in compared.factors
        ],
        "length": _length_json(compared.length),
        "other_priors": [
            {"prior": prior.prior, "log_factor": finite(prior.log_factor)}
            for prior in compared.priors
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


def _length_json(length: BoundedEstimate) -> dict[str, Any]:
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
