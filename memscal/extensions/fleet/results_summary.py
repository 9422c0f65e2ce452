"""Results of a fleet of sensors as tables and a mapping: distributions, outliers, failures."""

from collections import Counter
from typing import Any

import numpy as np

from memscal.extensions.fleet.results import FleetResults, robust_limit, robust_spread
from memscal.model.notation import format_measured
from memscal.summaries.table import Table, finite, texts_of

_MOST_ROWS = 50
_VALUES = {"conversion_constant": "A", "gaussian_sigma": "sigma"}


def counts(fleet: FleetResults) -> dict[str, int]:
    """Return how many sensors there are, passed, failed a check, and were not calibrated."""
    sensors, failed, errors = (len(of) for of in (fleet.paths, fleet.failed, fleet.errors))
    numbers = {"sensors": sensors, "passed": sensors - failed, "failed_checks": failed - errors}
    return numbers | {"errors": errors}


def verdict(fleet: FleetResults) -> str:
    """Return the counts as a sentence."""
    number = counts(fleet)
    failed = f"{number['failed_checks']} failed one, {number['errors']} were not calibrated"
    return f"{number['passed']} of {number['sensors']} sensors passed every check, {failed}."


def failures(fleet: FleetResults) -> dict[str, int]:
    """Return how many sensors failed each check."""
    return dict(Counter(c for checks in fleet.failed.values() for c in checks).most_common())


def error_classes(fleet: FleetResults) -> dict[str, int]:
    """Return how many scans were not calibrated, by the class of the error."""
    return dict(Counter(kind for kind, _ in fleet.errors.values()).most_common())


def _limit(fleet: FleetResults) -> float:
    return robust_limit(int(np.isfinite(fleet.conversion_constant).sum()))


def outliers(fleet: FleetResults) -> dict[int, str]:
    """Return sensors far from the median or with a failed check, the farthest first, and why."""
    deviations = {}
    for name, symbol in _VALUES.items():
        values = getattr(fleet, name)
        known = values[np.isfinite(values)]
        if not known.size:
            deviations[symbol] = np.zeros(values.size)
            continue
        # Where most values are the same, others are as far as their uncertainty says.
        spread = robust_spread(known) or float(np.nanmedian(getattr(fleet, f"{name}_errors")))
        deviations[symbol] = np.nan_to_num((values - np.median(known)) / (spread or 1.0))
    farthest = np.max([np.abs(z) for z in deviations.values()], axis=0)
    limit = _limit(fleet)
    chosen = {int(i) for i in np.flatnonzero(farthest > limit)}
    chosen |= fleet.failed.keys() - fleet.errors.keys()
    reasons = {}
    for i in sorted(chosen, key=lambda i: (-farthest[i], i)):
        texts = [
            f"{symbol} {abs(z[i]):.1f} deviations {'above' if z[i] > 0 else 'below'} the median"
            for symbol, z in deviations.items()
            if abs(z[i]) > limit
        ]
        if names := fleet.failed.get(i):
            texts.append("failed " + ", ".join(names).replace("_", " "))
        reasons[i] = "; ".join(texts)
    return reasons


def tables(fleet: FleetResults) -> list[Table]:
    """Return counts and distributions, failed checks, errors, and the farthest outliers."""
    told = mapping(fleet)
    total = len(fleet.paths)
    shares, checks = (
        [(name.replace("_", " "), str(n), f"{n / total:.2%}") for name, n in numbers.items()]
        for numbers in (counts(fleet), told["checks"])
    )
    values = []
    for name, symbol in _VALUES.items():
        unit, *numbers = told[name].values()
        if numbers[0] is not None:
            values.append((f"{symbol} ({unit})", *(f"{number:.4g}" for number in numbers)))
    heads = [name.replace("_", " ") for name in told["gaussian_sigma"] if name != "unit"]
    first = {kind: i for i, (kind, _) in reversed(list(fleet.errors.items()))}
    errors = [
        (kind, str(n), fleet.paths[first[kind]], fleet.errors[first[kind]][1].partition("\n")[0])
        for kind, n in told["error_classes"].items()
    ]
    title = (
        f"Outliers: beyond {_limit(fleet):.2g} robust deviations from the median, or a failed check"
    )
    if (further := told["outliers_in_all"] - _MOST_ROWS) > 0:
        title += f" ({further} further ones are in the tables)"
    return [
        Table("Sensors", ("", "number", "share"), shares),
        Table("Distributions", ("", *heads), values),
        Table("Failed checks", ("check", "sensors", "share"), checks),
        Table("Not calibrated", ("error", "scans", "the first of them", "its error"), errors),
        Table(title, ("scan", f"A ({fleet.unit})", "sigma (mm)", "reason"), _rows(fleet)),
    ]


def _rows(fleet: FleetResults) -> list[tuple[str, ...]]:
    rows = []
    for i, reason in list(outliers(fleet).items())[:_MOST_ROWS]:
        pairs = ((getattr(fleet, name)[i], getattr(fleet, f"{name}_errors")[i]) for name in _VALUES)
        rows.append((fleet.paths[i], *(format_measured(*pair) for pair in pairs), reason))
    return rows


def mapping(fleet: FleetResults) -> dict[str, Any]:
    """Return counts, distributions, failed checks, errors, and the farthest outliers."""
    reasons = outliers(fleet)
    told: dict[str, Any] = {**counts(fleet), "checks": failures(fleet)}
    for name, unit in zip(_VALUES, (fleet.unit, "mm"), strict=True):
        known = np.isfinite(getattr(fleet, name))
        values = getattr(fleet, name)[known]
        errors = getattr(fleet, f"{name}_errors")[known]
        low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)) if values.size else [np.nan] * 3
        numbers = {
            "median": middle,
            "robust_deviation": robust_spread(values),
            "quantile_05": low,
            "quantile_95": high,
            "median_standard_uncertainty": np.median(errors) if errors.size else np.nan,
        }
        told[name] = {"unit": unit} | {key: finite(value) for key, value in numbers.items()}
    told["warnings"] = texts_of(fleet.messages)
    listed = [{"path": fleet.paths[i], "reason": text} for i, text in reasons.items()]
    told |= {"error_classes": error_classes(fleet), "outliers": listed[:_MOST_ROWS]}
    return told | {"outliers_in_all": len(listed)}
