"""Results of a fleet of sensors as tables and a mapping: distributions, outliers, failures."""

from collections import Counter
from typing import Any

import numpy as np

from memscal.model.arrays import FloatArray
from memscal.model.fleet import ROBUST_LIMIT, FleetResults, robust_spread
from memscal.model.notation import format_measured
from memscal.summaries.table import Table, finite

_MOST_ROWS = 50
_RANGE = (0.05, 0.5, 0.95)
_VALUES = {"conversion_constant": "A", "gaussian_sigma": "sigma"}


def counts(fleet: FleetResults) -> dict[str, int]:
    """Return how many sensors there are, passed, failed a check, and were not calibrated."""
    failed = len(fleet.failed) - len(fleet.errors)
    passed = len(fleet.paths) - len(fleet.failed)
    return {
        "sensors": len(fleet.paths),
        "passed": passed,
        "failed_checks": failed,
        "errors": len(fleet.errors),
    }


def failures(fleet: FleetResults) -> Counter[str]:
    """Return how many sensors failed each check."""
    return Counter(name for names in fleet.failed.values() for name in names)


def error_classes(fleet: FleetResults) -> Counter[str]:
    """Return how many scans were not calibrated, by the class of the error."""
    return Counter(kind for kind, _ in fleet.errors.values())


def outliers(fleet: FleetResults) -> dict[int, str]:
    """Return sensors far from the median or with a failed check, the farthest first, and why."""
    deviations = fleet.deviations
    far = {name: np.where(np.isfinite(z), z, 0.0) for name, z in deviations.items()}
    farthest = np.max([np.abs(z) for z in far.values()], axis=0)
    chosen = {int(i) for i in np.flatnonzero(farthest > ROBUST_LIMIT)}
    chosen |= fleet.failed.keys() - fleet.errors.keys()
    reasons = {}
    for i in sorted(chosen, key=lambda i: (-farthest[i], i)):
        texts = [
            f"{_VALUES[name]} {abs(z[i]):.1f} {'above' if z[i] > 0 else 'below'} the median"
            for name, z in far.items()
            if abs(z[i]) > ROBUST_LIMIT
        ]
        if names := fleet.failed.get(i):
            texts.append("failed " + ", ".join(name.replace("_", " ") for name in names))
        reasons[i] = "; ".join(texts)
    return reasons


def tables(fleet: FleetResults) -> list[Table]:
    """Return counts and distributions, failed checks, errors, and the farthest outliers."""
    number, reasons = counts(fleet), outliers(fleet)
    total = number["sensors"]
    share = [(name.replace("_", " "), str(n), f"{n / total:.2%}") for name, n in number.items()]
    checks = [
        (name.replace("_", " "), str(n), f"{n / total:.2%}")
        for name, n in failures(fleet).most_common()
    ]
    return [
        Table("Sensors", ("", "number", "share"), share),
        _distributions(fleet),
        Table("Failed checks", ("check", "sensors", "share"), checks),
        _errors(fleet),
        _outlier_table(fleet, reasons),
    ]


def _distributions(fleet: FleetResults) -> Table:
    rows = []
    for name, symbol in _VALUES.items():
        values = getattr(fleet, name)
        values = values[np.isfinite(values)]
        if values.size:
            spread = robust_spread(values)
            low, middle, high = (f"{v:.4g}" for v in np.quantile(values, _RANGE))
            u = np.nanmedian(getattr(fleet, f"{name}_errors"))
            unit = fleet.unit if name == "conversion_constant" else "mm"
            rows.append((f"{symbol} ({unit})", middle, f"{spread:.2g}", low, high, f"{u:.2g}"))
    head = ("", "median", "robust deviation", "5 %", "95 %", "median standard uncertainty")
    return Table("Distributions", head, rows)


def _errors(fleet: FleetResults) -> Table:
    first: dict[str, tuple[str, str]] = {}
    for i, (kind, words) in fleet.errors.items():
        first.setdefault(kind, (fleet.paths[i], words.partition("\n")[0]))
    rows = [(kind, str(n), *first[kind]) for kind, n in error_classes(fleet).most_common()]
    return Table("Scans that were not calibrated", ("error", "scans", "the first", "error"), rows)


def _outlier_table(fleet: FleetResults, reasons: dict[int, str]) -> Table:
    rows = []
    for i in list(reasons)[:_MOST_ROWS]:
        a, s = (
            format_measured(getattr(fleet, name)[i], getattr(fleet, f"{name}_errors")[i])
            for name in _VALUES
        )
        rows.append((fleet.paths[i], a, s, reasons[i]))
    further = len(reasons) - len(rows)
    title = "Outliers: more than 5 robust standard deviations from the median, or a failed check"
    title += f" ({further} further ones are in the tables)" if further else ""
    return Table(title, ("scan", f"A ({fleet.unit})", "sigma (mm)", "reason"), rows)


def mapping(fleet: FleetResults) -> dict[str, Any]:
    """Return counts, distributions, failed checks, errors, and the farthest outliers."""
    reasons = outliers(fleet)
    values = {
        "conversion_constant": _stated(fleet.conversion_constant, fleet.unit),
        "gaussian_sigma": _stated(fleet.gaussian_sigma, "mm"),
        "checks": dict(failures(fleet).most_common()),
        "error_classes": dict(error_classes(fleet).most_common()),
        "outliers": [
            {"path": fleet.paths[i], "reason": reason}
            for i, reason in list(reasons.items())[:_MOST_ROWS]
        ],
        "outliers_in_all": len(reasons),
    }
    return counts(fleet) | values


def _stated(values: FloatArray, unit: str) -> dict[str, Any]:
    values = values[np.isfinite(values)]
    low, middle, high = np.quantile(values, _RANGE) if values.size else (np.nan,) * 3
    spread = robust_spread(values)
    numbers = {"median": middle, "robust_deviation": spread, "quantile_5": low, "quantile_95": high}
    return {name: finite(value) for name, value in numbers.items()} | {"unit": unit}
