"""Results of a fleet of sensors: what a summary needs of their calibrations."""

from collections.abc import Mapping, Sequence

import numpy as np

from memscal.model.arrays import FloatArray, keyword_array_record
from memscal.model.checks import Message
from memscal.model.result import Shown

#: A value farther from the median is an outlier, in robust standard deviations: of a million
#: normal values one; and how much more is allowed where the deviation is that of few values.
_ROBUST_LIMIT = 5.0
_FEW_VALUES = 8.0
_TO_SIGMA = 1.4826  # of a normal law's median absolute deviation


@keyword_array_record
class FleetResults(Shown):
    """Sensors in the order of their batch; arrays have NaN where a scan has an error.

    ``conversion_constant`` is in ``unit``, ``gaussian_sigma`` and the places on a wafer are in mm,
    as in the files; ``failed`` has the names of the checks that failed, ``errors`` class and words
    of errors, both by the number of the sensor; ``name`` is that of the folder of results.
    ``messages`` say what is missing, mixed, repeated or overridden.
    """

    paths: Sequence[str]
    conversion_constant: FloatArray
    conversion_constant_errors: FloatArray
    gaussian_sigma: FloatArray
    gaussian_sigma_errors: FloatArray
    wafer_x: FloatArray
    wafer_y: FloatArray
    failed: Mapping[int, tuple[str, ...]]
    errors: Mapping[int, tuple[str, str]]
    unit: str
    name: str = "sensors"
    messages: tuple[Message, ...] = ()


def robust_limit(count: int) -> float:
    """Return how many robust deviations from the median none of so many values lies by chance."""
    # In 1 of 100 batches or fewer, by simulation of 4 to 1000 normal values.
    return _ROBUST_LIMIT * (1 + _FEW_VALUES / max(count, 1))


def robust_spread(values: FloatArray) -> float:
    """Return the scaled median absolute deviation, NaN of no values."""
    if not values.size:
        return float("nan")
    return _TO_SIGMA * float(np.median(np.abs(values - np.median(values))))
