"""Gauss-Legendre rules on panels, for integrands that oscillate at a known rate."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["gauss_between", "gauss_panels", "ring_areas"]


def gauss_panels(upper: float, longest: float, order: int = 16) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of a composite Gauss-Legendre rule on [0, upper].

    Parameters
    ----------
    upper : float
        End of the range.
    longest : float
        Longest panel allowed.  With 16 nodes a panel integrates one or two oscillations
        (up to 16 rad of phase) to rounding; with 64, up to 100 rad.
    order : int
        Nodes in each panel.

    Examples
    --------
    >>> k, weights = gauss_panels(np.pi, longest=1.0)
    >>> round(float(weights @ np.sin(k)), 14)
    2.0
    """
    count = max(1, math.ceil(upper / longest))
    nodes, weights = _legendre(order)
    width = upper / count
    starts = width * np.arange(count)
    k = (starts[:, None] + width * (nodes + 1) / 2).ravel()
    return k, np.tile(width / 2 * weights, count)


def gauss_between(edges: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of Gauss-Legendre rules between neighbouring edges.

    Parameters
    ----------
    edges : ndarray, shape (n + 1,)
        Increasing ends of the panels.
    order : int
        Nodes in each panel.

    Examples
    --------
    >>> x, weights = gauss_between(np.array([0.0, 1.0, 3.0]), order=4)
    >>> round(float(weights @ x**3), 12)
    20.25
    """
    nodes, weights = _legendre(order)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (nodes + 1)).ravel(), (half * weights).ravel()


def ring_areas(r: FloatArray) -> FloatArray:
    """Weights that integrate a radial function over the plane, on even radii from zero.

    The trapezoidal rule with the Euler-Maclaurin correction of its end on the axis.
    """
    weights = 2 * np.pi * r * np.gradient(r)
    weights[0] += np.pi * (r[1] - r[0]) ** 2 / 6
    return np.asarray(weights)


@lru_cache(maxsize=8)
def _legendre(order: int) -> tuple[FloatArray, FloatArray]:
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return nodes, weights
