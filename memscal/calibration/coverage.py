r"""Coverage intervals of draws, and how well draws tell a standard uncertainty.

JCGM 101:2008, 7.7: of :math:`M` ordered draws, an interval of coverage :math:`p` holds
:math:`q = pM` of them; the probabilistically symmetric one leaves as many out at either end, the
shortest is the shortest.
"""

from __future__ import annotations

import numpy as np

from memscal.errors import InputError
from memscal.model.validation import FloatArray

__all__ = ["sampling_error", "shortest_interval", "symmetric_interval"]


def symmetric_interval(draws: FloatArray, coverage: float = 0.95) -> FloatArray:
    """Return the probabilistically symmetric coverage interval.

    Parameters
    ----------
    draws : ndarray, shape (m, ...)
        Draws along the first axis; two or more.
    coverage : float, default 0.95
        Probability that the interval holds.

    Returns
    -------
    ndarray, shape (2, ...)
        Its ends.
    """
    tail = (1 - _checked(draws, coverage)) / 2
    return np.asarray(np.quantile(draws, [tail, 1 - tail], axis=0))


def shortest_interval(draws: FloatArray, coverage: float = 0.95) -> FloatArray:
    """Return the shortest coverage interval.

    Parameters and the shape that is returned are those of :func:`symmetric_interval`.

    Examples
    --------
    Of an exponential distribution the shortest interval begins at zero:

    >>> draws = -np.log(1 - (np.arange(10_000) + 0.5) / 10_000)
    >>> [round(float(end), 2) for end in shortest_interval(draws)]
    [0.0, 3.0]
    """
    _checked(draws, coverage)
    ordered = np.sort(draws, axis=0)
    held = min(int(np.rint(coverage * len(draws))), len(draws) - 1)
    widths = ordered[held:] - ordered[:-held]
    first = np.argmin(widths, axis=0)[None]
    lower = np.take_along_axis(ordered, first, axis=0)
    upper = np.take_along_axis(ordered, first + held, axis=0)
    return np.concatenate([lower, upper])


def sampling_error(draws: FloatArray) -> FloatArray:
    r"""Relative standard uncertainty of the draws' standard deviation.

    :math:`\sqrt{(\kappa - 1)/4M}` with the kurtosis :math:`\kappa`, 3 of a normal distribution.
    """
    centred = draws - draws.mean(axis=0)
    variance = np.mean(centred**2, axis=0)
    safe = np.where(variance > 0, variance, 1.0)
    kurtosis = np.mean(centred**4, axis=0) / safe**2
    return np.asarray(np.sqrt(np.maximum(kurtosis - 1, 0.0) / (4 * len(draws))))


def _checked(draws: FloatArray, coverage: float) -> float:
    if not 0 < coverage < 1:
        raise InputError(
            f"The coverage is {coverage:g}, but a probability between 0 and 1 is needed."
        )
    if len(draws) < 2:
        raise InputError(f"{len(draws)} draws have no coverage interval.", cure="Give two or more.")
    return coverage
