"""Restored stress as tables, mapping and arrays, as ``memscal restore`` prints it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from memscal.measurement.restoration import Comparison, Restoration
from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray
from memscal.model.notation import format_measured
from memscal.model.quantities import KPA, MM, MV, PER_MM, Quantity
from memscal.model.records import PROFILE
from memscal.summaries.interop import (
    correlated_numbers,
    data_frame,
    labelled_dataset,
    quantity_json,
)
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray

_SHOWN_RADII = 9
#: The table of the stress ends where it has fallen to this share of its maximum.
_TAIL = 0.01
_QUANTITIES = (
    *PROFILE.quantities,
    Quantity(
        "covariance", "stress squared", "covariance of the normal stress", axes=("r", "r_prime")
    ),
    Quantity("sigma_zz_calculated", "stress", "calculated normal stress", axes=("r",)),
)


def _numbers(restored: Restoration) -> list[tuple[str, str, float, float, str]]:
    """Name in JSON, words, value, standard uncertainty and unit of each number."""
    axis, error = float(restored.stress(0.0)), float(restored.stress_uncertainty(0.0))
    rows = [
        ("force", "total force", restored.force, restored.force_uncertainty, "N"),
        ("stress_on_axis", "stress on the axis", axis / KPA, error / KPA, "kPa"),
    ]
    for i, name in _free_centres(restored):
        words = "centre of the scan" + (" along y" if i else "")
        value, spread = restored.centre[i] / MM, restored.centre_uncertainty[i] / MM
        rows.append((name, words, float(value), float(spread), "mm"))
    baseline, spread = restored.baseline / MV, restored.baseline_uncertainty / MV
    return [*rows, ("baseline", "baseline", baseline, spread, "mV")]


def _free_centres(restored: Restoration) -> list[tuple[int, str]]:
    """Return the coordinates of the centre that the scan determines."""
    free = restored.points.free[0]
    return [(i, name) for i, name in enumerate(("centre", "centre_y")) if free[i]]


def _errors(restored: Restoration) -> FloatArray:
    return np.asarray(np.sqrt(np.maximum(np.diag(restored.covariance), 0.0)))


def mapping(restored: Restoration) -> dict[str, Any]:
    """Return the object of ``restore --json`` without its file; the contract fixes its form."""
    resolved = restored.resolved_wavenumber / PER_MM
    comparison = restored.comparison
    return {
        "load": quantity_json(restored.scan.load, "N"),
        **{name: quantity_json(value, unit, u) for name, _, value, u, unit in _numbers(restored)},
        "force_budget": {source: finite(u) for source, u in restored.force_budget.items()},
        "resolved_wavenumber": quantity_json(resolved, "rad/mm"),
        "reconvolution": {
            "chi2_reduced": finite(restored.chi_square / restored.degrees),
            "degrees": finite(restored.degrees),
        },
        "stress": {
            "r_mm": [finite(r / MM) for r in restored.r],
            "sigma_zz_kpa": [finite(s / KPA) for s in restored.sigma_zz],
            "sigma_zz_errors_kpa": [finite(u / KPA) for u in _errors(restored)],
        },
        "calculated": None if comparison is None else _comparison_json(comparison),
        "checks": checks_json(restored.checks),
        "warnings": texts_of(restored.messages),
    }


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    return {
        "origin": _origin(comparison),
        "chi2_reduced": finite(comparison.chi_square),
        "degrees": comparison.degrees,
        "p_value": finite(comparison.p_value),
        "largest_difference": finite(comparison.difference),
        "share_within_95_percent": finite(comparison.within),
    }


def tables(restored: Restoration) -> list[Table]:
    """Return the numbers, the stress at a few radii, and the quality checks."""
    rows = [(words, format_measured(v, u, unit)) for _, words, v, u, unit in _numbers(restored)]
    rows[:0] = [("load", f"{restored.scan.load:.4g} N")]
    rows += [
        ("resolved up to the wavenumber", f"{restored.resolved_wavenumber / PER_MM:.3g} rad/mm"),
        ("restored stress blurred again", f"χ²/ν = {restored.chi_square / restored.degrees:.3g}"),
    ]
    if (comparison := restored.comparison) is not None:
        origin, within = _origin(comparison), comparison.within
        fit = f"χ²/ν = {comparison.chi_square:.3g}, p = {comparison.p_value:.2g}"
        beside = f"within 95 % bounds at {within:.0%} of radii"
        rows += [(f"{origin}, blurred", fit), (f"{origin}, beside the restored", beside)]
    indenter, film = restored.scan.indenter, restored.scan.film
    title = (
        f"Stress at the base of a {film.thickness / MM:.4g} mm film under a {indenter.shape} of "
        f"radius {indenter.radius / MM:.4g} mm (± standard uncertainty, k = 1)"
    )
    return [Table(title, ("", ""), rows), _stress_table(restored), checks_table(restored.checks)]


def _stress_table(restored: Restoration) -> Table:
    """Return the stress from the axis to where it has decayed."""
    comparison = restored.comparison
    strong = np.abs(restored.sigma_zz) > _TAIL * float(np.abs(restored.sigma_zz).max())
    last = float(restored.r[np.flatnonzero(strong)[-1]])
    step = max(round(last / MM / (_SHOWN_RADII - 1) * 4) / 4, 0.05) * MM
    radii = np.arange(_SHOWN_RADII) * step
    radii = radii[radii <= restored.r[-1]]
    stress, errors = restored.stress(radii) / KPA, restored.stress_uncertainty(radii) / KPA
    head = ["r (mm)", "restored"] + (["calculated"] if comparison is not None else [])
    rows = []
    for r, s, u in zip(radii, stress, errors, strict=True):
        row = [f"{r / MM:.4g}", format_measured(float(s), float(u), "kPa")]
        if comparison is not None:
            row.append(f"{np.interp(r, restored.r, comparison.sigma_zz) / KPA:.4g} kPa")
        rows.append(row)
    return Table("Normal stress at the base, positive in compression", head, rows)


def _origin(comparison: Comparison) -> str:
    if isinstance(comparison.stress, Contact):
        friction = comparison.stress.friction
        return f"calculated with{f' friction {friction:.4g}' if friction else 'out friction'}"
    source = comparison.stress.source
    return "expected stress" if source is None else f"expected stress ({source.file_name})"


def _arrays(restored: Restoration) -> dict[str, FloatArray]:
    values = {
        "r": restored.r,
        "sigma_zz": restored.sigma_zz,
        "sigma_zz_errors": _errors(restored),
        "covariance": restored.covariance,
    }
    if restored.comparison is not None:
        values["sigma_zz_calculated"] = restored.comparison.sigma_zz
    return values


def dataset(restored: Restoration) -> xarray.Dataset:
    """Return the stress with its covariance along r, and the calculated one where there is one."""
    return labelled_dataset(_QUANTITIES, _arrays(restored))


def frame(restored: Restoration) -> pd.DataFrame:
    """Return one row for each radius."""
    columns = {name: values for name, values in _arrays(restored).items() if values.ndim == 1}
    return data_frame(_QUANTITIES, columns)


def correlated(restored: Restoration) -> dict[str, Any]:
    """Return force, stress on the axis, centre and baseline with their joint covariance."""
    centres = {name: float(restored.centre[i]) for i, name in _free_centres(restored)}
    values = {"force": restored.force, "stress_on_axis": float(restored.stress(0.0)), **centres}
    values["baseline"] = restored.baseline
    return correlated_numbers(list(values), list(values.values()), restored.scalar_covariance)
