"""Results of a fleet of sensors as tables and a mapping: distributions, outliers, failures."""

from collections import Counter

import numpy as np

from memscal.extensions.fleet.results import FleetResults, robust_limit, robust_spread
from memscal.model.arrays import Values
from memscal.model.notation import format_measured
from memscal.summaries.table import Table, finite, texts_of

Counts = dict[str, int]
"""Numbers of sensors, by what they are counted by."""

_MOST_ROWS = 50
_VALUES = {"conversion_constant": "A", "gaussian_sigma": "sigma"}


def counts(fleet: FleetResults) -> Counts:
    """Return how many sensors there are, passed, failed a check, and were not calibrated."""
    errors = len(fleet.errors)
    return {
        "sensors": len(fleet.paths),
        "passed": len(fleet.paths) - len(fleet.failed),
        "failed_checks": len(fleet.failed) - errors,
        "errors": errors,
    }


def verdict(fleet: FleetResults) -> str:
    """Return the counts as a sentence."""
    number = counts(fleet)
    failed = f"{number['failed_checks']} failed one, {number['errors']} were not calibrated"
    return f"{number['passed']} of {number['sensors']} sensors passed every check, {failed}."


def failures(fleet: FleetResults) -> Counts:
    """Return how many sensors failed each check."""
    return dict(Counter(c for checks in fleet.failed.values() for c in checks).most_common())


def error_classes(fleet: FleetResults) -> Counts:
    """Return how many scans were not calibrated, by the class of the error."""
    return dict(Counter(kind for kind, _ in fleet.errors.values()).most_common())


def _limit(fleet: FleetResults) -> float:
    return robust_limit(np.isfinite(fleet.conversion_constant).sum())


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
        spread = robust_spread(known) or np.nanmedian(getattr(fleet, f"{name}_errors"))
        deviations[symbol] = np.nan_to_num((values - np.median(known)) / (spread or 1.0))
    farthest = np.max([np.abs(z) for z in deviations.values()], axis=0)
    limit = _limit(fleet)
    chosen = set(np.flatnonzero(farthest > limit).tolist())
    chosen |= fleet.failed.keys() - fleet.errors.keys()
    reasons = {}
    for i in sorted(chosen, key=lambda i: (-farthest[i], i)):
        texts = []
        for symbol, z in deviations.items():
            side = "above" if z[i] > 0 else "below"
            if abs(z[i]) > limit:
                texts.append(f"{symbol} {abs(z[i]):.1f} deviations {side} the median")
        if i in fleet.failed:
            texts.append("failed " + ", ".join(fleet.failed[i]).replace("_", " "))
        reasons[i] = "; ".join(texts)
    return reasons


def tables(fleet: FleetResults) -> list[Table]:
    """Return counts and distributions, failed checks, errors, and the farthest outliers."""
    limit = f"{_limit(fleet):.2g} robust deviations from the median, or a failed check"
    title = f"Outliers: beyond {limit}"
    reasons = outliers(fleet)
    further = len(reasons) - _MOST_ROWS
    if further > 0:
        title += f" ({further} further ones are in the tables)"
    outlying = []
    for i, reason in list(reasons.items())[:_MOST_ROWS]:
        a = format_measured(fleet.conversion_constant[i], fleet.conversion_constant_errors[i])
        sigma = format_measured(fleet.gaussian_sigma[i], fleet.gaussian_sigma_errors[i])
        outlying.append((fleet.paths[i], a, sigma, reason))
    return [
        Table("Sensors", ("", "number", "share"), _shares(fleet, counts(fleet))),
        _distributions(fleet),
        Table("Failed checks", ("check", "sensors", "share"), _shares(fleet, failures(fleet))),
        _errors_table(fleet),
        Table(title, ("scan", f"A ({fleet.unit})", "sigma (mm)", "reason"), outlying),
    ]


def _shares(fleet: FleetResults, numbers: Counts) -> list[tuple[str, str, str]]:
    """Return numbers of sensors, each with its share of all."""
    total = len(fleet.paths)
    return [(name.replace("_", " "), str(n), f"{n / total:.2%}") for name, n in numbers.items()]


def _distributions(fleet: FleetResults) -> Table:
    rows = []
    heads = []
    for name, symbol in _VALUES.items():
        distribution = _distribution(fleet, name)
        unit, *numbers = distribution.values()
        heads = [key.replace("_", " ") for key in distribution if key != "unit"]
        if numbers[0] is not None:
            rows.append((f"{symbol} ({unit})", *(f"{number:.4g}" for number in numbers)))
    return Table("Distributions", ("", *heads), rows)


def _errors_table(fleet: FleetResults) -> Table:
    first = {kind: i for i, (kind, _) in reversed(list(fleet.errors.items()))}
    rows = []
    for kind, number in error_classes(fleet).items():
        text = fleet.errors[first[kind]][1].partition("\n")[0]
        rows.append((kind, str(number), fleet.paths[first[kind]], text))
    return Table("Not calibrated", ("error", "scans", "the first of them", "its error"), rows)


def mapping(fleet: FleetResults) -> Values:
    """Return counts, distributions, failed checks, errors, and the farthest outliers."""
    listed = [{"path": fleet.paths[i], "reason": text} for i, text in outliers(fleet).items()]
    return {
        **counts(fleet),
        "checks": failures(fleet),
        **{name: _distribution(fleet, name) for name in _VALUES},
        "warnings": texts_of(fleet.messages),
        "error_classes": error_classes(fleet),
        "outliers": listed[:_MOST_ROWS],
        "outliers_in_all": len(listed),
    }


def _distribution(fleet: FleetResults, name: str) -> Values:
    """Return median, spread and quantiles of a parameter over the sensors, in its unit."""
    known = np.isfinite(getattr(fleet, name))
    values = getattr(fleet, name)[known]
    errors = getattr(fleet, f"{name}_errors")[known]
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)) if values.size else [np.nan] * 3
    return {
        "unit": fleet.unit if name == "conversion_constant" else "mm",
        "median": finite(middle),
        "robust_deviation": finite(robust_spread(values)),
        "quantile_05": finite(low),
        "quantile_95": finite(high),
        "median_standard_uncertainty": finite(np.median(errors) if errors.size else np.nan),
    }
