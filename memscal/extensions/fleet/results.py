"""Results of a fleet of sensors: what a summary needs of their calibrations."""

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import NamedTuple

import numpy as np

from memscal.model.arrays import FloatArray, Values, keyword_array_record
from memscal.model.checks import Message
from memscal.model.result import Shown

#: A value farther from the median is an outlier, in robust standard deviations: of a million
#: normal values one; and how much more is allowed where the deviation is that of few values.
_ROBUST_LIMIT = 5.0
_FEW_VALUES = 8.0
_TO_SIGMA = 1.4826  # of a normal law's median absolute deviation
SUMMARISED = {"A": "conversion_constant", "sigma": "gaussian_sigma"}
"""What is summarised, by its symbol."""


class Failure(NamedTuple):
    """Class of the error of a scan that was not calibrated, what was wrong, and what to do."""

    error_class: str
    problem: str
    cure: str


class Tolerance(NamedTuple):
    """By what share of a nominal value, or without one of the median, sensors may differ."""

    share: float
    nominal: float | None


@keyword_array_record
class FleetResults(Shown):
    """Sensors in the order of their batch; arrays have NaN where a scan has an error.

    ``conversion_constant`` is in ``unit``, ``gaussian_sigma`` and the places on a wafer are in mm,
    as in the files, or places are columns and rows, counted, where ``place_unit`` is "die";
    ``failed`` has the names of the checks that failed, ``errors`` the errors, both by the number of
    the sensor; ``name`` is that of the folder of results.  ``messages`` say what is missing, mixed,
    repeated or overridden, ``provenance`` how the batch was calibrated, ``tolerances`` by symbol
    how far sensors that pass may be off.
    """

    paths: Sequence[str]
    sensors: Sequence[str]
    conversion_constant: FloatArray
    conversion_constant_errors: FloatArray
    gaussian_sigma: FloatArray
    gaussian_sigma_errors: FloatArray
    wafer_x: FloatArray
    wafer_y: FloatArray
    failed: Mapping[int, tuple[str, ...]]
    errors: Mapping[int, Failure]
    unit: str
    place_unit: str = "mm"
    name: str = "sensors"
    messages: tuple[Message, ...] = ()
    provenance: Values = field(default_factory=dict)
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)

    def unit_of(self, symbol: str) -> str:
        """Return the unit of A or sigma."""
        return self.unit if symbol == "A" else "mm"

    def allowed(self, symbol: str) -> tuple[float, float]:
        """Return what the tolerance of A or sigma is about, and how far sensors may be from it."""
        tolerance = self.tolerances[symbol]
        centre = tolerance.nominal or median(getattr(self, SUMMARISED[symbol]))
        return centre, tolerance.share * centre


def median(values: FloatArray) -> float:
    """Return the median of what is known, NaN of no values."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else np.nan


def robust_limit(count: int) -> float:
    """Return how many robust deviations from the median none of so many values lies by chance."""
    # In 1 of 100 batches or fewer, by simulation of 4 to 1000 normal values.
    return _ROBUST_LIMIT * (1 + _FEW_VALUES / max(count, 1))


def robust_spread(values: FloatArray) -> float:
    """Return the scaled median absolute deviation of what is known, NaN of no values."""
    return _TO_SIGMA * median(np.abs(values - median(values)))
