r"""Evidence of laws of the interface: the likelihood averaged over what a law leaves free.

The nuisances of a group of voltages (one load of one scan; the model and its symbols are those of
:mod:`memscal.friction.likelihood`) enter linearly, and are integrated in closed form (equation in
docs/friction.md).  With :math:`Q = N^{-1} - N^{-1}F(F^TN^{-1}F)^{-1}F^TN^{-1}`,
:math:`g = D^TQ\rho` and :math:`M = 1 + D^TQD`,

.. math:: \chi^2 = \rho^T Q\rho - g^T M^{-1} g, \qquad
    \ln\det C = \ln\det N + \ln\det F^TN^{-1}F + \ln\det M .

Groups only share :math:`\xi`: their contributions add up in :math:`\rho^TQ\rho`, g, M and the
determinants.  A law with one parameter of each load is therefore integrated load by load.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.special import logsumexp

from memscal.friction.family import bounded
from memscal.model.arrays import FloatArray

#: Paths through the loads along which a parameter of each load is drawn: a power of two.
_PATHS = 256
#: A systematic direction that moves the data by less than this, in standard deviations, is none.
_NEGLIGIBLE = 1e-2


class Tables(NamedTuple):
    """Statistics of J groups at M values of a parameter, their own nuisances integrated."""

    squares: FloatArray  # (M, J): rho^T Q rho
    pulls: FloatArray  # (M, J, q): D^T Q rho
    grips: FloatArray  # (M, J, q, q): D^T Q D
    volumes: FloatArray  # (M, J): ln det N + ln det F^T N^-1 F

    def together(self) -> Tables:
        """Return the groups as one, of shape (M, 1): one parameter for all of them."""
        return Tables(*(np.sum(array, axis=1, keepdims=True) for array in self))

    def only(self, chosen: Sequence[int]) -> Tables:
        """Return some of the groups."""
        return Tables(*(array[:, list(chosen)] for array in self))

    def group(self, index: int | Sequence[int]) -> Tables:
        """Return some of the groups, as one."""
        return self.only(np.atleast_1d(index).tolist()).together()


def log_likelihood(tables: Tables) -> tuple[FloatArray, FloatArray]:
    """Return the logarithm of the likelihood, and chi-square, of each entry of tables."""
    squares = tables.squares
    q = tables.pulls.shape[-1]
    # One factorisation gives both: the last pivot of M bordered by g is chi-square (plus one, so
    # that data without any misfit do not make it singular).
    bordered = np.empty((*squares.shape, q + 1, q + 1))
    bordered[..., :q, :q] = tables.grips + np.eye(q)
    bordered[..., q, :q] = bordered[..., :q, q] = tables.pulls
    bordered[..., q, q] = squares + 1
    pivots = np.einsum("...ii->...i", np.linalg.cholesky(bordered))
    chi_square = np.maximum(pivots[..., q] ** 2 - 1, 0.0)
    volume = 2 * np.log(pivots[..., :q]).sum(axis=-1) + tables.volumes
    return -(chi_square + volume) / 2, chi_square


def evidence_of_one(log_likelihoods: FloatArray, weights: FloatArray) -> float:
    """Return the logarithm of the evidence of a law with one parameter; ``weights`` (M,): prior."""
    return float(logsumexp(log_likelihoods, b=weights))


def evidence_of_each(
    tables: Sequence[Tables], weights: Sequence[FloatArray]
) -> tuple[float, float]:
    """Return the log evidence of a law with one parameter of each load, and its error."""
    # The parameter of each load is drawn (by a Sobol sequence) given those before; the evidence is
    # the mean over the draws of the product of what each load was expected to be.
    from scipy.stats.qmc import Sobol

    tables = _compressed(tables)
    steps = len(tables) - 1
    # Without scrambling the first point is 0: it is moved into the middle of its cell.
    draws = Sobol(steps, scramble=False).random(_PATHS) + 0.5 / _PATHS if steps else None
    paths = _PATHS if steps else 1
    taken = Tables(*(np.zeros((paths, *array.shape[2:])) for array in tables[0]))
    logs = np.zeros(paths)
    before = np.zeros(paths)
    for step, (table, weight) in enumerate(zip(tables, weights, strict=True)):
        both = Tables(
            *(old[:, None] + new[None, :, 0] for old, new in zip(taken, table, strict=True))
        )
        with np.errstate(divide="ignore"):
            joint = log_likelihood(both)[0] + np.log(weight)
        expected = np.asarray(logsumexp(joint, axis=-1))
        logs += expected - before
        if draws is None or step == steps:
            continue
        cumulated = np.cumsum(np.exp(joint - expected[:, None]), axis=1)
        drawn = (cumulated < draws[:, step, None] * cumulated[:, -1:]).sum(axis=1)
        drawn = np.minimum(drawn, weight.size - 1)
        taken = Tables(*(array[np.arange(paths), drawn] for array in both))
        before = log_likelihood(taken)[0]
    mean = float(logsumexp(logs)) - math.log(paths)
    return mean, float(np.std(np.exp(logs - mean)) / np.sqrt(paths))


def _compressed(tables: Sequence[Tables]) -> list[Tables]:
    """Keep the systematic directions that move any datum: the work goes with their cube."""
    largest = np.sum([np.mean(table.grips[:, 0], axis=0) for table in tables], axis=0)
    values, vectors = np.linalg.eigh(largest)
    basis = vectors[:, values > _NEGLIGIBLE**2]
    return [
        table._replace(
            pulls=table.pulls @ basis,
            grips=np.einsum("qa,mjqp,pb->mjab", basis, table.grips, basis, optimize=True),
        )
        for table in tables
    ]


Prior: TypeAlias = Callable[[FloatArray], FloatArray]
"""The share of a prior below values of a parameter that is not negative."""


def bounded_prior(scale: float) -> Prior:
    """Return the prior that is uniform in the bounded coordinate about a ``scale``."""
    return lambda values: bounded(values, scale)


def log_uniform_prior(low: float, high: float) -> Prior:
    """Return the prior that gives each decade from ``low`` to ``high`` the same share."""
    whole = math.log(high / low)
    return lambda values: np.asarray(np.log(np.clip(values, low, high) / low) / whole)
