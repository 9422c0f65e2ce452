r"""A few Gauss-Newton steps: least squares from a start that is close already.

A general solver spends more on its trust region than on the model.  Steps of

.. math::

    \bigl(J^T W J\bigr)\,\delta = -J^T W r, \qquad W = (1 + r^2/c^2)^{-1/2}

minimise the soft L1 loss :math:`\sum 2c^2\,(\sqrt{1 + r^2/c^2} - 1)` of the residuals :math:`r`
(reweighted least squares); with :math:`c = \infty` they are the plain steps of least squares.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["gauss_newton"]

_MOST_STEPS = 20
_MOST_HALVINGS = 5
#: Steps end here, in units of the parameters' typical sizes: the model is no longer linear.
_LONGEST_STEP = 1.0
#: Rounding may raise a cost that has settled by this share.
_ROUNDING = 1e-10

Linearised = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def gauss_newton(
    linearise: Linearised, start: FloatArray, *, tolerance: float, knee: float = np.inf
) -> FloatArray | None:
    """Minimise the loss of the residuals of a model that is nearly linear about the start.

    Parameters
    ----------
    linearise : callable
        Residuals, shape (n,), and their derivatives, shape (n, p), at parameters of shape (p,).
    start : ndarray, shape (p,)
        Where to begin; the parameters are scaled to numbers near one.
    tolerance : float
        The last step is shorter than this in every parameter.
    knee : float
        Residual from which on the loss grows linearly; infinite for least squares.

    Returns
    -------
    ndarray, shape (p,), or None
        ``None`` if the steps do not settle downhill: use a solver with a trust region.

    Examples
    --------
    >>> x = np.arange(4.0)
    >>> def decay(p):
    ...     curve = np.exp(-p[0] * x)
    ...     return curve - np.exp(-0.5 * x), -(x * curve)[:, None]
    >>> round(float(gauss_newton(decay, np.array([0.4]), tolerance=1e-9)[0]), 6)
    0.5
    """
    place: FloatArray = start
    step: FloatArray = np.zeros_like(start)
    cost, halvings = np.inf, 0
    for _ in range(_MOST_STEPS):
        residual, slope = linearise(place)
        stretch = np.sqrt(1 + (residual / knee) ** 2)
        # The loss, in a form without cancellation where the knee is far away.
        found = float(np.sum(2 * residual**2 / (1 + stretch)))
        if not found <= cost * (1 + _ROUNDING):
            halvings += 1
            if halvings > _MOST_HALVINGS:
                return None
            step = step / 2
            place = place - step
            continue
        root = stretch**-0.5
        whole = np.linalg.lstsq(slope * root[:, None], -residual * root, rcond=None)[0]
        longest = float(np.abs(whole).max())
        step = np.asarray(whole * (_LONGEST_STEP / max(longest, _LONGEST_STEP)), dtype=np.float64)
        place, cost = place + step, found
        if longest < tolerance:
            return np.asarray(place)
    return None
