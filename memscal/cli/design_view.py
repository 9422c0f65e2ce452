"""How ``memscal design`` tells what is to be expected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from memscal.cli.output import emit_json, note

if TYPE_CHECKING:
    from memscal.planning.outcome import Design

__all__ = ["tell"]

#: Parameter, its name in words, its symbol, its unit, and how many of it an SI unit has.
_SHOWN = (
    ("conversion_constant", "conversion constant A", "A", "mV/Pa", 1e3),
    ("gaussian_sigma", "Gaussian width sigma", "sigma", "mm", 1e3),
    ("fwhm", "full width at half maximum", "FWHM", "mm", 1e3),
)
#: Contributions below this share of the largest are rounding to a reader.
_NEGLIGIBLE = 5e-3
_WORDS = {
    "noise": "noise",
    "regularisation": "what the film hides of G",
    "window": "what the window hides of G",
    "thickness": "film thickness",
    "poisson_ratio": "Poisson's ratio",
    "rod_radius": "rod radius",
    "young_modulus": "Young's modulus",
}
_HIDDEN = (
    "G beyond the resolved band is the prior's: its uncertainty there does not scatter from scan "
    "to scan, and repeats do not show it."
)


def tell(planned: Design, wishes: Mapping[str, float], *, as_json: bool) -> None:
    """Print the design as tables or as one JSON object."""
    if as_json:
        emit_json(_object(planned, wishes))
    else:
        from memscal.cli.tables import Table, emit_tables

        emit_tables(
            Table(_title(planned), ("", ""), _plan_rows(planned)),
            Table(
                "Expected, with standard uncertainties (k = 1)",
                ("", "value", "uncertainty", "relative"),
                _rows(planned),
            ),
            Table("Contributions, in percent", *_contributions(planned)),
        )
    note(_HIDDEN)


def _title(planned: Design) -> str:
    return f"A planned scan (nothing was measured), for method {planned.method}"


def _plan_rows(planned: Design) -> list[tuple[str, str]]:
    plan = planned.plan
    return [
        ("positions", f"{plan.positions}, every {plan.step * 1e3:.4g} mm"),
        ("half range", f"{plan.half_range * 1e3:.4g} mm"),
        ("repeats", f"{plan.repeats}"),
        ("load", f"{plan.load:.4g} N"),
        ("largest signal", f"{plan.signal * 1e3:.4g} mV"),
        (
            "noise of a voltage",
            f"{plan.point_noise * 1e3:.3g} mV ({plan.point_noise / plan.signal * 100:.3g} %)",
        ),
    ]


def _rows(planned: Design) -> list[tuple[str, str, str, str]]:
    rows = []
    for name, words, _, unit, scale in _SHOWN:
        value, error = planned.parameters[name], planned.parameters.uncertainty(name)
        share = planned.relative_uncertainty(name)
        rows.append((words, f"{value * scale:.4g} {unit}", f"{error * scale:.2g}", _percent(share)))
    g, error = planned.g[0] * 1e-6, planned.g_errors[0] * 1e-6
    rows.append(("G at the axis", f"{g:.4g} 1/mm^2", f"{error:.2g}", _percent(error / abs(g))))
    band = planned.resolved_wavenumber
    detail = f"detail of {6.283185 / band * 1e3:.3g} mm"
    rows.append(("resolved up to", f"{band * 1e-3:.4g} rad/mm", detail, ""))
    return rows


def _percent(share: float) -> str:
    return f"{share * 100:.3g} %"


def _contributions(planned: Design) -> tuple[list[str], list[list[str]]]:
    """Return head and rows: a source in each, for A and both widths."""
    shares = {
        name: {s: u / abs(planned.parameters[name]) for s, u in planned.budget[name].items()}
        for name, *_ in _SHOWN
    }
    largest = {name: max(parts.values()) for name, parts in shares.items()}
    sources = [
        source
        for source in shares["conversion_constant"]
        if any(shares[name].get(source, 0.0) > _NEGLIGIBLE * largest[name] for name in shares)
    ]
    rows = [
        [
            _WORDS.get(source, source.replace("_", " ")),
            *(_cell(shares[name].get(source, 0.0), largest[name]) for name in shares),
        ]
        for source in sources
    ]
    return ["source", *(symbol for _, _, symbol, _, _ in _SHOWN)], rows


def _cell(share: float, largest: float) -> str:
    return f"{share * 100:.2g}" if share > _NEGLIGIBLE * largest else "0"


def _object(planned: Design, wishes: Mapping[str, float]) -> dict[str, Any]:
    plan = planned.plan
    return {
        "schema_version": "1",
        "planned": True,
        "method": planned.method,
        "plan": {
            "positions": plan.positions,
            "step": _quantity(plan.step * 1e3, "mm"),
            "half_range": _quantity(plan.half_range * 1e3, "mm"),
            "repeats": plan.repeats,
            "load": _quantity(plan.load, "N"),
            "largest_signal": _quantity(plan.signal * 1e3, "mV"),
            "noise": _quantity(plan.point_noise * 1e3, "mV"),
        },
        "wanted_si": dict(wishes),
        "expected": {name: _expected(planned, name, unit, s) for name, _, _, unit, s in _SHOWN},
        "g_at_axis": {
            **_quantity(planned.g[0] * 1e-6, "1/mm^2"),
            "uncertainty": planned.g_errors[0] * 1e-6,
        },
        "resolved_wavenumber": _quantity(planned.resolved_wavenumber * 1e-3, "rad/mm"),
    }


def _expected(planned: Design, name: str, unit: str, scale: float) -> dict[str, Any]:
    return {
        **_quantity(planned.parameters[name] * scale, unit),
        "uncertainty": planned.parameters.uncertainty(name) * scale,
        "relative_uncertainty": planned.relative_uncertainty(name),
        "budget": {source: part * scale for source, part in planned.budget[name].items()},
    }


def _quantity(value: float, unit: str) -> dict[str, Any]:
    return {"value": float(value), "unit": unit}
