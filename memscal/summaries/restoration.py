"""Restored stress as tables, mapping and arrays, as ``memscal restore`` prints it."""

import numpy as np

from memscal.measurement.restoration import Restoration, StressComparison
from memscal.mechanics.contact import Contact
from memscal.model.arrays import Values
from memscal.model.notation import format_measured
from memscal.model.quantities import KPA, MM, PER_MM, Quantity, by_name
from memscal.model.records import PROFILE, RESTORED, RESTORED_AGAINST
from memscal.summaries.declared import (
    DataFrame,
    Dataset,
    cell,
    correlated_numbers,
    data_frame,
    labelled_dataset,
    members,
)
from memscal.summaries.stress import contact_words
from memscal.summaries.table import Table, checks_json, checks_table, finite, texts_of, verdict

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
_PROFILE = by_name(PROFILE.quantities)
_NUMBERS = ("force", "stress_on_axis", "centre", "centre_y", "baseline")


def _values(restored: Restoration) -> Values:
    """Return what the numbers of a restoration are, where they are no attributes of it."""
    values = {
        "load": restored.scan.load,
        "stress_on_axis": float(restored.stress(0.0)),
        "stress_on_axis_uncertainty": float(restored.stress_uncertainty(0.0)),
    }
    for i, name in enumerate(("centre", "centre_y")):
        values[name] = float(restored.centre[i])
        values[f"{name}_uncertainty"] = float(restored.centre_uncertainty[i])
    return values


def _determined(restored: Restoration) -> dict[str, Quantity]:
    """Return the quantities of a restoration without centres that the scan does not determine."""
    shown = {q.name: q.read_in(restored.points.reading) for q in RESTORED}
    for name, free in zip(("centre", "centre_y"), restored.points.free[0], strict=True):
        if not free:
            del shown[name], shown[f"{name}_uncertainty"]
    return shown


def mapping(restored: Restoration) -> Values:
    """Return the object of ``restore --json`` without its file; the contract fixes its form."""
    comparison = restored.comparison
    calculated = None
    if comparison is not None:
        calculated = members(RESTORED_AGAINST, comparison, origin=_origin(comparison))
    stress = [_PROFILE[name] for name in ("r", "sigma_zz", "sigma_zz_errors")]
    return {
        "schema_version": "1",
        **members(_determined(restored).values(), restored, **_values(restored)),
        "reconvolution": {
            "chi2_reduced": finite(restored.chi_square / restored.degrees),
            "degrees": finite(restored.degrees),
        },
        "stress": members(stress, restored.profile()),
        "calculated": calculated,
        "checks": checks_json(restored.checks),
        "warnings": texts_of(restored.messages),
    }


def answer(restored: Restoration) -> str:
    """Return stress on the axis and total force."""
    cells = _cells(restored)
    return (
        f"Stress on the axis {cells['stress_on_axis']}; force {cells['force']} at "
        f"{restored.scan.load:.4g} N.\n{verdict(restored.checks)}"
    )


def _cells(restored: Restoration) -> dict[str, str]:
    """Return the numbers that the scan determines, with their uncertainties, by their names."""
    values = _values(restored)
    shown = _determined(restored).items()
    return {name: cell(q, restored, **values) for name, q in shown if name in _NUMBERS}


def tables(restored: Restoration) -> list[Table]:
    """Return the numbers, the stress at a few radii, and the quality checks."""
    rows = [("load", f"{restored.scan.load:.4g} N")]
    rows += [("direction of sliding", word) for word in restored.scan.directions]
    shown = _determined(restored)
    rows += [(shown[name].words, cell) for name, cell in _cells(restored).items()]
    resolved = restored.resolved_wavenumber / PER_MM
    rows.append(("resolved up to the wavenumber", f"{resolved:.3g} rad/mm"))
    misfit = restored.chi_square / restored.degrees
    rows.append(("restored stress blurred again", f"χ²/ν = {misfit:.3g}"))
    comparison = restored.comparison
    if comparison is not None:
        origin = _origin(comparison)
        fit = f"χ²/ν = {comparison.chi_square:.3g}, p = {comparison.p_value:.2g}"
        rows.append((f"{origin}, blurred", fit))
        share = f"within 95 % bounds at {comparison.within:.0%} of radii"
        rows.append((f"{origin}, beside the restored", share))
    pressed = contact_words(restored.scan)
    title = f"Stress at the base of {pressed} (± standard uncertainty, k = 1)"
    return [Table(title, ("", ""), rows), _stress_table(restored), checks_table(restored.checks)]


def _stress_table(restored: Restoration) -> Table:
    comparison = restored.comparison
    size = abs(restored.sigma_zz)
    strong = size > _TAIL * size.max()
    last = restored.r[strong][-1]
    step = max(round(last / MM / (_SHOWN_RADII - 1) * 4) / 4, 0.05) * MM
    radii = np.arange(_SHOWN_RADII) * step
    radii = radii[radii <= restored.r[-1]]
    stress = restored.stress(radii) / KPA
    errors = restored.stress_uncertainty(radii) / KPA
    head = ["r (mm)", "restored"]
    if comparison is not None:
        head.append("calculated")
    rows = []
    for r, s, u in zip(radii, stress, errors, strict=True):
        row = [f"{r / MM:.4g}", format_measured(s, u, "kPa")]
        if comparison is not None:
            row.append(f"{np.interp(r, restored.r, comparison.sigma_zz) / KPA:.4g} kPa")
        rows.append(row)
    return Table("Normal stress at the base, positive in compression", head, rows)


def _origin(comparison: StressComparison) -> str:
    if isinstance(comparison.stress, Contact):
        friction = comparison.stress.friction
        return (
            f"calculated with friction {friction:.4g}"
            if friction
            else "calculated without friction"
        )
    source = comparison.stress.source
    return "expected stress" if source is None else f"expected stress ({source.file_name})"


def _arrays(restored: Restoration) -> Values:
    values = {
        "r": restored.r,
        "sigma_zz": restored.sigma_zz,
        "sigma_zz_errors": restored.profile().sigma_zz_errors,
        "covariance": restored.covariance,
    }
    if restored.comparison is not None:
        values["sigma_zz_calculated"] = restored.comparison.sigma_zz
    return values


def dataset(restored: Restoration) -> Dataset:
    """Return the stress with its covariance along r, and the calculated one where there is one."""
    return labelled_dataset(_QUANTITIES, _arrays(restored))


def frame(restored: Restoration) -> DataFrame:
    """Return one row for each radius."""
    columns = {name: values for name, values in _arrays(restored).items() if values.ndim == 1}
    return data_frame(_QUANTITIES, columns)


def correlated(restored: Restoration) -> Values:
    """Return force, stress on the axis, centre and baseline with their joint covariance."""
    values = _values(restored) | {"force": restored.force, "baseline": restored.baseline}
    names = [name for name in _determined(restored) if name in _NUMBERS]
    numbers = [values[name] for name in names]
    return correlated_numbers(names, numbers, restored.scalar_covariance)
