r"""What is thought possible of a friction coefficient or a length before it is measured.

A Bayes factor depends on it.  A *bounded* prior is uniform in the coordinate
:math:`t = \theta/(\theta + \theta_0)` from 0 to infinity; a *log-uniform* one gives each decade
between its ends the same share.  Where the likelihood is narrow, the evidence is in proportion
to the prior's density there: a log-uniform range that is wider by a decade at a place that the
data exclude costs its law a factor of (n + 1)/n.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["Prior", "bounded_prior", "log_uniform_prior", "uniform_prior"]


@dataclass(frozen=True)
class Prior:
    """A prior of one parameter that is not negative.

    Parameters
    ----------
    words : str
        The prior in words, with its range.
    below : callable
        Share of the prior below each of several values, infinity included.
    """

    words: str
    below: Callable[[FloatArray], FloatArray]

    def weights(self, edges: FloatArray) -> FloatArray:
        """Return the prior's share of the cells between edges, shape (m + 1,) to (m,)."""
        return np.asarray(np.diff(self.below(edges)))


def bounded_prior(scale: float, words: str) -> Prior:
    """Return the prior that is uniform in the bounded coordinate about a ``scale``.

    Examples
    --------
    >>> bounded_prior(0.3, "mu").below(np.array([0.0, 0.3, np.inf]))
    array([0. , 0.5, 1. ])
    """

    def below(values: FloatArray) -> FloatArray:
        known = np.isfinite(values)
        finite = np.where(known, values, 0.0)
        return np.where(known, finite / (finite + scale), 1.0)

    return Prior(words, below)


def log_uniform_prior(low: float, high: float, words: str) -> Prior:
    """Return the prior that gives each decade from ``low`` to ``high`` the same share.

    Examples
    --------
    >>> log_uniform_prior(0.1, 10.0, "mu").below(np.array([0.0, 1.0, np.inf]))
    array([0. , 0.5, 1. ])
    """

    def below(values: FloatArray) -> FloatArray:
        return np.asarray(np.log(np.clip(values, low, high) / low) / math.log(high / low))

    return Prior(words, below)


def uniform_prior(high: float, words: str) -> Prior:
    """Return the prior that is uniform from 0 to ``high``.

    Examples
    --------
    >>> uniform_prior(2.0, "mu").below(np.array([0.0, 1.0, np.inf]))
    array([0. , 0.5, 1. ])
    """
    return Prior(words, lambda values: np.asarray(np.clip(values, 0.0, high) / high))
