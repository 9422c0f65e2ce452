"""The history of a sensor as an answer, tables and a mapping."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from memscal.extensions.history.changes import LEVEL
from memscal.extensions.history.history import FEWEST, STAIRCASE, History
from memscal.model.arrays import Values
from memscal.model.notation import format_measured
from memscal.summaries.declared import parameters_json
from memscal.summaries.table import Table, percent, texts_of


def answer(history: History) -> str:
    """Return whether the sensor changed, what would have been seen, and the next date."""
    count = len(history.times)
    dates = f"{count} calibrations from {history.times[0][:10]} to {history.times[-1][:10]}"
    changed = [change for change in history.changes if change["significant"]]
    lines = []
    if changed:
        found = ", ".join(f"{_words(change)} of {change['quantity']}" for change in changed)
        lines.append(f"The sensor has CHANGED: {dates} differ ({found}).")
    for test in history.tests[:FEWEST]:
        if test["test"] == "change_point" and not changed:
            seen = f"a step of A of {_seen(test)} would have been seen in 95 %"
            lines.append(f"No change seen in {dates}; {seen}.")
    if history.trend is not None:
        lines.append(f"Trend of A: {_percent(history.trend)} per year.")
    if history.next_date is not None:
        allowed = percent(history.tolerance)
        lines.append(f"Next calibration: {history.next_date}, for a tolerance of {allowed} of A.")
    elif not history.of_one_date:
        lines.append(STAIRCASE)
    return "\n".join(lines)


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
    pairs = [(*pair[:3], f"{pair[3]:.2f}") for pair in _pairs(history)]
    return [
        Table("Tests for a change", head, tests, significant, labels=2),
        Table("Calibrations", ("date", "A", "sigma", "film", "repairs before"), _dates(history)),
        Table("Changes since the first date", changes, _changes(history)),
        Table(unsure, ("date", "last calibration before", "change of A"), repairs),
        Table("Pairs of one date", ("from", "and", "of", "E_n (up to 1: they agree)"), pairs),
    ]


def mapping(history: History) -> Values:
    """Return the object of ``history --json``; the contract fixes changes, trend, next_date."""
    dates = []
    for time, film, repairs, found in zip(
        history.times, history.films, history.segment, history.parameters, strict=True
    ):
        stated = {"start_time": time, "film": film, "repairs_before": repairs}
        dates.append({**stated, **parameters_json(found)})
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
        "pairs": [
            {"first": first, "second": second, "quantity": quantity, "en": en}
            for first, second, quantity, en in _pairs(history)
        ],
        "notes": texts_of(history.messages),
    }


def _words(test: Values) -> str:
    return str(test["test"]).replace("_", " ")


def _seen(test: Values) -> str:
    """Return the size that a test would have seen in 95 %."""
    return percent(test["seen"]) + (" per year" if test["test"] == "trend" else "")


def _percent(change: Any) -> str:
    """Return a value with its uncertainty, in percent."""
    if change is None:
        return "not known: calibrations on one side of it alone"
    return format_measured(100 * change["value"], 100 * change["standard_uncertainty"], "%")


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
        cells = []
        for values, covariance in zip(history.values, history.covariances, strict=True):
            u = _uncertainty_of_difference(covariance, 0, i)
            cells.append(format_measured(100 * values[i], 100 * u))
        rows.append((history.times[i], *cells))
    return rows


def _uncertainty_of_difference(covariance: Any, i: int, j: int) -> float:
    variance = covariance[i, i] + covariance[j, j] - 2 * covariance[i, j]
    return float(np.sqrt(max(variance, 0.0)))


def _pairs(history: History) -> Iterator[tuple[str, str, str, float]]:
    """Yield two calibrations of one day, a quantity, and its E_n by what they do not share."""
    # ISO 13528:2022, 9.7: the difference over its expanded uncertainty, k = 2.
    if not history.of_one_date:
        return
    for i, j in combinations(range(len(history.times)), 2):
        for k, quantity in enumerate(history.quantities[:2]):
            u = _uncertainty_of_difference(history.covariances[k], i, j)
            difference = history.values[k, j] - history.values[k, i]
            yield history.labels[i], history.labels[j], quantity, abs(difference) / (2 * u)
