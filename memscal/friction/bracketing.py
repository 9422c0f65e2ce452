"""Where the measured stress lies between no friction and full stick, point by point."""

from __future__ import annotations

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["bracketed_share"]

#: Coverage factor of 95 %.
_EXPANDED = 1.96


def bracketed_share(
    measured: FloatArray, errors: FloatArray, calculated: FloatArray, calculated_errors: FloatArray
) -> float:
    """Return the share of points between the extremes of a family, within 1.96 u.

    Where the profiles of different friction cross, away from the axis, the larger of the two
    extremes is above.

    Parameters
    ----------
    measured, errors : ndarray, shape (n,)
        Measured stress and its standard uncertainty, in Pa.
    calculated, calculated_errors : ndarray, shape (m, n)
        Calculated stress of each member, the extremes first and last, and its standard
        uncertainty, in Pa.

    Examples
    --------
    >>> calculated = np.array([[10.0, 5.0], [12.0, 4.0]])
    >>> bracketed_share(np.array([13.0, 8.0]), np.ones(2), calculated, np.zeros((2, 2)))
    0.5
    """
    ends, end_errors = calculated[[0, -1]], calculated_errors[[0, -1]]
    allowed = _EXPANDED * np.hypot(errors, end_errors)
    above = (ends + allowed).max(axis=0)
    below = (ends - allowed).min(axis=0)
    return float(np.mean((below <= measured) & (measured <= above)))
