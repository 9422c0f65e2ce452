r"""Predicting a part of the scan from the rest of it.

One group of points (a repeat, a load, a scan) is held out; every apparatus function that the scan
can tell apart is fitted to the others, and predicts it.  The distance of the held-out voltages
:math:`z_0` from the prediction :math:`X_0\hat\beta_1`, in its covariance
:math:`1 + X_0 (X_1^T X_1)^{-1} X_0^T` of noise and parameters, is the fall of the residual sum of
squares when they are left out (Chow, Econometrica 28, 1960),

.. math::

    \chi^2 = S_{\text{all}} - S_{\text{others}}.

Baseline, drift and centre of the held-out group are its own: they may differ from one pass to the
next, and are fitted to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri, fdtrc, fdtri

from memscal.estimation.free_model import FreeModel, free_model
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.estimation.residuals import FEWEST_RESIDUALS
from memscal.model.checks import FALSE_ALARM
from memscal.model.validation import FloatArray

__all__ = ["HeldOut", "hold_out", "load_groups"]

#: More groups than this are held out several at a time.
_MOST_FOLDS = 10
#: Loads that differ by less of their mean are one load, recorded with scatter.
_SAME_LOAD = 0.05
_DEPENDENT = 1e-10


@dataclass(frozen=True, eq=False)
class HeldOut:
    """The worst predicted of several groups of points.

    Parameters
    ----------
    value : float
        Chi-square of the held-out voltages per degree of freedom; over the others' own where the
        noise is not stated (F).
    limit : float
        What the worst of all groups exceeds by chance once in a thousand.
    p_value : float
        Chance of a group so badly predicted among all, or less.
    worst : int
        Its place among the groups, from zero.
    folds : int
        How many groups were held out.
    alone : bool
        Whether each was one group: more than ten are held out several at a time.
    """

    value: float
    limit: float
    p_value: float
    worst: int
    folds: int
    alone: bool


def load_groups(load: FloatArray) -> NDArray[np.intp]:
    """Number the loads: those closer than a twentieth of their mean are one, shape (n,)."""
    levels = np.unique(load)
    start = np.concatenate([[0], np.cumsum(np.diff(levels) > _SAME_LOAD * load.mean())])
    return np.asarray(start[np.searchsorted(levels, load)], dtype=np.intp)


def hold_out(estimate: ProfileEstimate, group: NDArray[np.intp]) -> HeldOut | None:
    """Hold out each group of points in turn, and predict it from the others.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile.
    group : ndarray of int, shape (n,)
        Which group each point belongs to, counted from zero.

    Returns
    -------
    HeldOut or None
        The worst group; ``None`` where there is one group alone, or none that tells.

    Examples
    --------
    >>> import memscal
    >>> estimate = memscal.calibrate(memscal.simulate(repeats=3)).solution.estimate
    >>> hold_out(estimate, estimate.points.repeat).folds
    3
    """
    if np.unique(group).size < 2:
        return None
    # Many outliers in one group are its fault, and a single one is not: none may count for much.
    model = free_model(estimate, clip_outliers=True)
    # Centre, baseline and drift, which a held-out group has to itself.
    nuisances = int(estimate.points.free.sum()) + estimate.model.drift_columns.shape[1]
    own = model.design[:, 2 : 2 + nuisances]
    fold = _folds(group)[model.kept]
    found = {
        int(i): outcome
        for i in np.unique(fold)
        if (outcome := _predict(model, own, fold == i)) is not None
    }
    if len(found) < 2:
        return None
    p_values = {i: _p_value(*outcome) for i, outcome in found.items()}
    worst = min(p_values, key=lambda i: p_values[i])
    # The worst of several is worse than one: Bonferroni's correction, for any dependence.
    folds = len(found)
    p_value, share = min(folds * p_values[worst], 1.0), FALSE_ALARM / folds
    value, degrees, rest = found[worst]
    limit = chdtri(degrees, share) / degrees if rest is None else fdtri(degrees, rest, 1 - share)
    return HeldOut(value, float(limit), p_value, worst, folds, alone=int(group.max()) < _MOST_FOLDS)


def _folds(group: NDArray[np.intp]) -> NDArray[np.intp]:
    """Join neighbouring groups until there are few enough."""
    count = int(group.max()) + 1
    return group if count <= _MOST_FOLDS else group * _MOST_FOLDS // count


def _predict(
    model: FreeModel, own: FloatArray, out: NDArray[np.bool_]
) -> tuple[float, int, int | None] | None:
    """Chi-square per degree, its degrees, and those of the others where the noise is theirs."""
    others, others_degrees = _residual(model.design[~out], model.data[~out])
    both, both_degrees = _residual(np.hstack([model.design, own * out[:, None]]), model.data)
    degrees = both_degrees - others_degrees
    if degrees < FEWEST_RESIDUALS or others_degrees < FEWEST_RESIDUALS:
        return None
    value = max(both - others, 0.0) / degrees
    if model.stated:
        return value, degrees, None
    return value / max(others / others_degrees, np.finfo(float).tiny), degrees, others_degrees


def _residual(design: FloatArray, data: FloatArray) -> tuple[float, int]:
    """Residual sum of squares and its degrees of freedom."""
    size = np.linalg.norm(design, axis=0)
    scaled = design[:, size > 0] / size[size > 0]
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    basis = left[:, singular > _DEPENDENT * singular[0]]
    rest = data - basis @ (basis.T @ data)
    return float(rest @ rest), int(data.size - basis.shape[1])


def _p_value(value: float, degrees: int, rest: int | None) -> float:
    if rest is None:
        return float(chdtrc(degrees, degrees * value))
    return float(fdtrc(degrees, rest, value))
