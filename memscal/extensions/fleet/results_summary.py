"""Results of a fleet of sensors as tables and a mapping: distributions, outliers, failures."""

import re
from collections import Counter
from collections.abc import Mapping
from functools import lru_cache
from pathlib import PurePath

import numpy as np

from memscal.extensions.fleet.results import SUMMARISED, FleetResults, median, robust_spread
from memscal.extensions.fleet.tolerance import tolerance_mapping
from memscal.extensions.fleet.wafer import FEWEST, deviations, trend
from memscal.model.arrays import Values
from memscal.model.notation import format_measured
from memscal.summaries.table import Table, finite, stated_text, texts_of

Counts = dict[str, int]
"""Numbers of sensors, by what they are counted by."""

_MOST_ROWS = 50
#: What outliers are told from, in words.
_CENTRES = {
    "trend": "the wafer's smooth trend (quadratic in x and y)",
    "median": f"the median (a trend takes {FEWEST} calibrated sensors with their places)",
}
#: What errors of one kind differ in: what is quoted, and words with digits, as most names.
_PARTICULARS = re.compile(r"'[^']*'|\S*\d\S*")


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
    """Return the counts as a sentence, and the yield as another one where there are tolerances."""
    number = counts(fleet)
    failed = f"{number['failed_checks']} failed one, {number['errors']} were not calibrated"
    text = f"{number['passed']} of {number['sensors']} sensors passed every check, {failed}."
    if not fleet.tolerances:
        return text
    share = tolerance_mapping(fleet)["yield"]
    return (
        f"{text} Yield: {share['value']:.1%} ({share['low']:.1%} to {share['high']:.1%} at 95 %)."
    )


def failures(fleet: FleetResults) -> Counts:
    """Return how many sensors failed each check."""
    return dict(Counter(c for checks in fleet.failed.values() for c in checks).most_common())


def error_groups(fleet: FleetResults) -> list[Values]:
    """Return the errors that agree in class and first sentence, the most frequent first."""
    groups: dict[tuple[str, str], list[int]] = {}
    for i, error in fleet.errors.items():
        sentence = error.problem.partition(". ")[0].replace(PurePath(fleet.paths[i]).name, "")
        groups.setdefault((error.error_class, _PARTICULARS.sub("", sentence)), []).append(i)
    return [
        {"scans": len(some), "first": fleet.paths[some[0]], **fleet.errors[some[0]]._asdict()}
        for some in sorted(groups.values(), key=len, reverse=True)
    ]


def _centre(fleet: FleetResults) -> str:
    """Return what outliers are told from: the trend, if there is one, or the median."""
    smooth = trend(fleet, fleet.conversion_constant)
    return "trend" if np.isfinite(smooth).any() else "median"


@lru_cache(maxsize=1)
def outliers(fleet: FleetResults) -> dict[int, str]:
    """Return sensors that are far off or have a failed check, the farthest first, and why."""
    found = {symbol: deviations(fleet, name) for symbol, name in SUMMARISED.items()}
    farthest = np.max(np.abs(list(found.values())), axis=0)
    chosen = set(np.flatnonzero(farthest).tolist()) | (fleet.failed.keys() - fleet.errors.keys())
    centre = _centre(fleet)
    reasons = {}
    for i in sorted(chosen, key=lambda i: (-farthest[i], i)):
        texts = []
        for symbol, z in found.items():
            side = "above" if z[i] > 0 else "below"
            if z[i]:
                texts.append(f"{symbol} {abs(z[i]):.1f} deviations {side} the {centre}")
        if i in fleet.failed:
            texts.append("failed " + ", ".join(fleet.failed[i]).replace("_", " "))
        reasons[i] = "; ".join(texts)
    return reasons


def tables(fleet: FleetResults) -> list[Table]:
    """Return counts, distributions, tolerances, failures, outliers, and how it was calibrated."""
    far = "Outliers: beyond 5 robust deviations (more of few sensors) and u from"
    title = f"{far} {_CENTRES[_centre(fleet)]}, or a failed check"
    reasons = outliers(fleet)
    further = len(reasons) - _MOST_ROWS
    if further > 0:
        title += f" ({further} further ones are in the tables)"
    outlying = []
    for i, reason in list(reasons.items())[:_MOST_ROWS]:
        values = [
            format_measured(getattr(fleet, name)[i], getattr(fleet, f"{name}_errors")[i])
            for name in SUMMARISED.values()
        ]
        outlying.append((fleet.sensors[i], fleet.paths[i], *values, reason))
    errors = [tuple(map(str, group.values())) for group in error_groups(fleet)]
    made = [(key.replace("_", " "), stated_text(text)) for key, text in fleet.provenance.items()]
    return [
        Table("Sensors", ("", "number", "share"), _shares(fleet, counts(fleet))),
        _by_symbol("Distributions", {key: _distribution(fleet, key) for key in SUMMARISED}),
        *_tolerance_tables(fleet),
        Table("Failed checks", ("check", "sensors", "share"), _shares(fleet, failures(fleet))),
        Table("Not calibrated", ("scans", "the first", "error", "problem", "cure"), errors),
        Table(title, ("sensor", "scan", f"A ({fleet.unit})", "sigma (mm)", "reason"), outlying),
        Table("How the sensors were calibrated", ("", ""), made),
    ]


def _shares(fleet: FleetResults, numbers: Counts) -> list[tuple[str, str, str]]:
    """Return numbers of sensors, each with its share of all."""
    total = len(fleet.paths)
    return [(name.replace("_", " "), str(n), f"{n / total:.2%}") for name, n in numbers.items()]


def _tolerance_tables(fleet: FleetResults) -> list[Table]:
    """Return why sensors pass or fail, and how many are near the middle or beyond."""
    if not fleet.tolerances:
        return []
    found = tolerance_mapping(fleet)
    title = "Within the tolerance; undecided: within U of a limit"
    return [
        Table("Yield", ("", "number", "share"), _shares(fleet, found["sensors"])),
        _by_symbol(title, found["bins"]),
    ]


def _by_symbol(title: str, found: Mapping[str, Values]) -> Table:
    """Return a row of numbers for each of A and sigma that has them."""
    rows = []
    heads = []
    for symbol, entry in found.items():
        unit, *numbers = entry.values()
        heads = [key.replace("_", " ") for key in entry if key != "unit"]
        if numbers[0] is not None:
            rows.append((f"{symbol} ({unit})", *(f"{number:.4g}" for number in numbers)))
    return Table(title, ("", *heads), rows)


def mapping(fleet: FleetResults) -> Values:
    """Return counts, distributions, tolerances, failures, the farthest outliers, provenance."""
    listed = [
        {"path": fleet.paths[i], "sensor": fleet.sensors[i], "reason": text}
        for i, text in list(outliers(fleet).items())[:_MOST_ROWS]
    ]
    return {
        "schema_version": "1",
        **counts(fleet),
        "checks": failures(fleet),
        **{name: _distribution(fleet, symbol) for symbol, name in SUMMARISED.items()},
        "tolerances": tolerance_mapping(fleet) if fleet.tolerances else None,
        "warnings": texts_of(fleet.messages),
        "error_classes": dict(Counter(e.error_class for e in fleet.errors.values())),
        "error_groups": error_groups(fleet),
        "outliers": listed,
        "outliers_in_all": len(outliers(fleet)),
        "outliers_from": _centre(fleet),
        "provenance": dict(fleet.provenance),
    }


def _distribution(fleet: FleetResults, symbol: str) -> Values:
    """Return median, spread and quantiles of a parameter over the sensors, in its unit."""
    values = getattr(fleet, SUMMARISED[symbol])
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, (0.05, 0.95)) if known.size else (np.nan, np.nan)
    u = median(getattr(fleet, f"{SUMMARISED[symbol]}_errors"))
    return {
        "unit": fleet.unit_of(symbol),
        "median": finite(median(values)),
        "robust_deviation": finite(robust_spread(values)),
        "quantile_05": finite(low),
        "quantile_95": finite(high),
        "median_standard_uncertainty": finite(u),
    }
