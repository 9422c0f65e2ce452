"""Tolerances: how many sensors pass, why others fail, and the table of both for a prober."""

import io
from collections import Counter

import numpy as np
from scipy.special import betaincinv

from memscal.extensions.fleet.results import SUMMARISED, FleetResults
from memscal.extensions.fleet.shards import arrow
from memscal.extensions.fleet.wafer import lattice
from memscal.model.arrays import FloatArray, Values
from memscal.summaries.table import finite

#: Multiples of a tolerance within which sensors are counted.
_BINS = {"within_half": 0.5, "within": 1.0, "within_double": 2.0}
_COVERAGE = 2.0  # U is so many standard uncertainties


def _distances(fleet: FleetResults, symbol: str) -> FloatArray:
    """Return how far sensors are from what the tolerance is about, in tolerances."""
    centre, allowed = fleet.allowed(symbol)
    return np.asarray(np.abs(getattr(fleet, SUMMARISED[symbol]) - centre) / allowed)


def reasons(fleet: FleetResults) -> list[str]:
    """Return why each sensor fails: an error, or A, sigma and a check; empty where it passes."""
    found: list[list[str]] = [[] for _ in fleet.paths]
    for symbol in fleet.tolerances:
        for i in np.flatnonzero(~(_distances(fleet, symbol) <= 1)).tolist():
            found[i].append(symbol)
    for i in fleet.failed:
        found[i] = ["error"] if i in fleet.errors else [*found[i], "check"]
    return [" and ".join(some) for some in found]


def tolerance_mapping(fleet: FleetResults) -> Values:
    """Return yield, why sensors fail, and how many are within each tolerance."""
    kinds = Counter(reason or "passed" for reason in reasons(fleet))
    passed = kinds["passed"]
    failed = len(fleet.paths) - passed
    # Jeffreys' interval, which holds where none or all pass, too.
    low, high = betaincinv(passed + 0.5, failed + 0.5, (0.025, 0.975)).tolist()
    bins = {}
    for symbol in fleet.tolerances:
        centre, allowed = fleet.allowed(symbol)
        distance = _distances(fleet, symbol)
        expanded = _COVERAGE * getattr(fleet, f"{SUMMARISED[symbol]}_errors") / allowed
        bins[symbol] = {
            "unit": fleet.unit_of(symbol),
            "centre": finite(centre),
            "tolerance": finite(allowed),
            **{name: int(np.sum(distance <= most)) for name, most in _BINS.items()},
            "undecided": int(np.sum(np.abs(distance - 1) <= expanded)),
        }
    return {
        "yield": {"value": passed / len(fleet.paths), "low": low, "high": high},
        "sensors": dict(kinds.most_common()),
        "bins": bins,
    }


def prober_table(fleet: FleetResults) -> bytes:
    """Return a row for each sensor as CSV: its name and place, whether it passes, and why not."""
    pa = arrow()
    why = reasons(fleet)
    columns = {
        "sensor": fleet.sensors,
        "path": fleet.paths,
        "row": pa.array(lattice(fleet.wafer_y), from_pandas=True),
        "column": pa.array(lattice(fleet.wafer_x), from_pandas=True),
        "result": ["fail" if reason else "pass" for reason in why],
        "reason": why,
    }
    text = io.BytesIO()
    pa.csv.write_csv(pa.table(columns), text)
    return text.getvalue()
