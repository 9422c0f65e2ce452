"""The history of a sensor as an answer, tables and a mapping."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from memscal.extensions.history.changes import LEVEL
from memscal.extensions.history.history import History, moment_of
from memscal.model.arrays import FloatArray, Values
from memscal.model.notation import format_measured
from memscal.summaries.declared import parameters_json
from memscal.summaries.table import Table, percent, texts_of


def answer(history: History) -> str:
    """Return whether the sensor changed, what would have been seen, and the next date."""
    days = [str(moment_of(history.times[i]).date()) for i in history.tested]
    if not history.tests:
        why = f"that takes two calibrations since the last repair, not {len(days)}"
        return f"Nothing is tested: {why}.\n{history.due}"
    when = f"of {days[0]}" if history.of_one_date else f"from {days[0]} to {days[-1]}"
    dates = f"{len(days)} calibrations {when}"
    changed = [change for change in history.changes if change["significant"]]
    lines = []
    if changed:
        found = "; ".join(map(_change, sorted(changed, key=lambda change: "between" not in change)))
        lines.append(f"The sensor has CHANGED: {dates} differ ({found}).")
    seen = [_seen(test) for test in history.tests if test["test"] == "change_point"]
    if seen and not changed:
        step = f"a step of A of {seen[0]} would have been seen in 95 %"
        lines.append(f"No change seen in {dates}; {step}.")
    if history.trend:
        lines.append(f"Trend of A: {_percent(history.trend)} per year.")
    return "\n".join([*lines, history.due])


def tables(history: History) -> list[Table]:
    """Return the tests, the dates, the repairs, and of one date the E_n of each pair."""
    tests = []
    for test in history.tests:
        numbers = (f"{test['statistic']:.3g}", f"{test['p']:.2g}", _seen(test))
        tests.append((_words(test), test["quantity"], *numbers))
    significant = frozenset(i for i, test in enumerate(history.tests) if test["p"] < LEVEL)
    head = ("test", "of", "statistic", "p, adjusted", "seen in 95 %")
    changes = ("date", *(f"{name} (%)" for name in history.quantities))
    repairs = [
        (repair["date"], repair["last_before"] or "none", _percent(repair["change"]))
        for repair in history.repairs
    ]
    unsure = "Repairs: what was measured since the last calibration rests on no state as found"
    pairs = [(*[*pair.values()][:3], f"{pair['en']:.2f}") for pair in _pairs(history)]
    return [
        Table("Tests for a change", head, tests, significant, labels=2),
        Table("Calibrations", ("date", "A", "sigma", "film", "repairs before"), _dates(history)),
        Table("Changes since the first date", changes, _changes(history)),
        Table(unsure, ("date", "last calibration before", "change of A"), repairs),
        Table("Pairs of one date", ("from", "and", "of", "E_n (up to 1: they agree)"), pairs),
    ]


def mapping(history: History) -> Values:
    """Return the object of ``history --json``; the contract fixes changes, trend, next_date."""
    dates = [
        {
            "start_time": history.times[i],
            "film": history.films[i],
            "repairs_before": history.segment[i],
            **parameters_json(found),
        }
        for i, found in enumerate(history.parameters)
    ]
    return {
        "schema_version": "1",
        "sensor": history.sensor,
        "changes": history.changes,
        "tests": list(history.tests),
        "trend": history.trend,
        "temperature_coefficient": history.temperature,
        "tolerance": history.tolerance,
        "next_date": history.next_date,
        "dates": dates,
        "repairs": list(history.repairs),
        "pairs": list(_pairs(history)),
        "notes": texts_of(history.messages),
    }


def _change(change: Values) -> str:
    """Return a significant change in words."""
    if "between" not in change:
        return f"{_words(change)} of {change['quantity']}"
    verb = "rose" if change["value"] > 0 else "fell"
    size = _percent(change).replace("(-", "(")
    return f"{change['quantity']} {verb} by {size} between {' and '.join(change['between'])}"


def _words(test: Values) -> str:
    return str(test["test"]).replace("_", " ")


def _seen(test: Values) -> str:
    """Return the size that a test would have seen in 95 %."""
    size = percent(test["seen"]) if test["seen"] <= 1 else "over 100 %"
    return size + (" per year" if test["test"] == "trend" else "")


def _percent(change: Any) -> str:
    """Return a change of a logarithm with its uncertainty, in percent of what it was."""
    if change is None:
        return "not known: calibrations on one side of it alone"
    share = 100 * np.exp(change["value"])
    return format_measured(share - 100, share * change["standard_uncertainty"], "%")


def _dates(history: History) -> list[tuple[str, ...]]:
    rows = []
    for i, parameters in enumerate(history.parameters):
        numbers = parameters_json(parameters).values()
        cells = [format_measured(n["value"], n["standard_uncertainty"], n["unit"]) for n in numbers]
        rows.append((history.times[i], *cells, history.films[i], str(history.segment[i])))
    return rows


def _changes(history: History) -> list[tuple[str, ...]]:
    """Return the changes since the first date, with what their two dates do not share."""
    rows = []
    for i in range(1, len(history.times)):
        cells = [
            format_measured(100 * values[i], 100 * _of_differences(covariance)[0, i])
            for values, covariance in zip(history.values, history.covariances, strict=True)
        ]
        rows.append((history.times[i], *cells))
    return rows


def _of_differences(covariance: FloatArray) -> FloatArray:
    """Return the standard uncertainties (n, n) of differences between dates."""
    own = np.diag(covariance)
    return np.sqrt(np.maximum(np.add.outer(own, own) - 2 * covariance, 0.0))


def _pairs(history: History) -> Iterator[Values]:
    """Yield two calibrations of one day, a quantity, and its E_n by what they do not share."""
    # ISO 13528:2022, 9.7: the difference over its expanded uncertainty, k = 2.
    if not history.of_one_date:
        return
    for i, j in combinations(range(len(history.times)), 2):
        for k, quantity in enumerate(history.quantities[:2]):
            u = _of_differences(history.covariances[k])[i, j]
            difference = history.values[k, j] - history.values[k, i]
            yield {
                "first": history.labels[i],
                "second": history.labels[j],
                "quantity": quantity,
                "en": float(abs(difference) / (2 * u)),
            }
