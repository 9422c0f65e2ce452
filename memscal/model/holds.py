"""Holds that were found in the log of an instrument."""

from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.model.arrays import Arrays, FloatArray, IndexArray, array_record
from memscal.model.notation import Reading
from memscal.model.result import Drawn


@array_record
class Holds(Drawn):
    """Holds that were found in a log of n rows, m of them, in SI units."""

    log: Arrays  # (n,) each: x, u_zz, and y and normal_load where they are logged
    line: NDArray[Any]  # (n,): line of the file
    first: IndexArray  # (m,): row of the log
    stop: IndexArray  # (m,): row after the last one
    mean: Arrays  # (m,) each: every column, averaged over each hold
    u_errors: FloatArray  # (m,): standard uncertainty of the mean reading
    reading: Reading
    notes: tuple[str, ...]
    highest: FloatArray = field(default_factory=lambda: np.zeros(0))  # (m,): row, as it was logged
    ceiling: float | None = None  # at which rows pile up, as they were logged
