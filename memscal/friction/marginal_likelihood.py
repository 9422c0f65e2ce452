r"""Evidence of laws of the interface: the likelihood averaged over what a law leaves free.

The nuisances of a group of voltages (one load of one scan; the model and its symbols are those of
:mod:`memscal.friction.likelihood`) enter linearly, and are integrated in closed form (equation in
docs/friction_model.md).  With :math:`Q = N^{-1} - N^{-1}F(F^TN^{-1}F)^{-1}F^TN^{-1}`,
:math:`g = D^TQ\rho` and :math:`M = 1 + D^TQD`,

.. math:: \chi^2 = \rho^T Q\rho - g^T M^{-1} g, \qquad
    \ln\det C = \ln\det N + \ln\det F^TN^{-1}F + \ln\det M .

Groups only share :math:`\xi`: their contributions add up in :math:`\rho^TQ\rho`, g, M and the
determinants.  A law with one parameter of each load is therefore integrated load by load.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.special import logsumexp

from memscal.model.arrays import ArrayFunction, ArrayPair, FloatArray

#: Paths through the loads along which a parameter of each load is drawn: a power of two.
_PATHS = 256
#: A systematic direction that moves the data by less than this, in standard deviations, is none.
_NEGLIGIBLE = 1e-2


class Statistics(NamedTuple):
    """What readings tell at values of a parameter, their own nuisances integrated; any shape."""

    chi_square: FloatArray  # rho^T Q rho: without systematic errors
    projection: FloatArray  # (..., q): D^T Q rho
    information: FloatArray  # (..., q, q): D^T Q D
    log_determinant: FloatArray  # ln det N + ln det F^T N^-1 F

    def at(self, place: Any) -> Statistics:
        """Return the statistics at some of the values, by an index of the arrays."""
        return Statistics(*(array[place] for array in self))


def added(several: Sequence[Statistics]) -> Statistics:
    """Return the statistics of several groups of readings together."""
    return Statistics(*(sum(arrays) for arrays in zip(*several, strict=True)))


def log_likelihood(statistics: Statistics) -> ArrayPair:
    """Return the logarithm of the likelihood, and chi-square, at each value."""
    q = statistics.projection.shape[-1]
    # One factorisation gives both: the last pivot of M bordered by g is chi-square (plus one, so
    # that data without any misfit do not make it singular).
    bordered = np.empty((*statistics.chi_square.shape, q + 1, q + 1))
    bordered[..., :q, :q] = statistics.information + np.eye(q)
    bordered[..., q, :q] = statistics.projection
    bordered[..., q, q] = statistics.chi_square + 1
    # Only the lower triangle is read.
    pivots = np.einsum("...ii->...i", np.linalg.cholesky(bordered))
    chi_square = np.maximum(pivots[..., q] ** 2 - 1, 0.0)
    log_determinant = 2 * np.log(pivots[..., :q]).sum(axis=-1) + statistics.log_determinant
    return -(chi_square + log_determinant) / 2, chi_square


def evidence_of_each(
    loads: Sequence[Statistics], weights: Sequence[FloatArray]
) -> tuple[float, float]:
    """Return the log evidence of a law with one parameter of each load, and its error."""
    # The parameter of each load is drawn (by a Sobol sequence) given those before; the evidence is
    # the mean over the draws of the product of what each load was expected to be.
    from scipy.stats.qmc import Sobol

    loads = _compressed(loads)
    steps = len(loads) - 1
    # Without scrambling the first point is 0: it is moved into the middle of its cell.
    draws = Sobol(steps, scramble=False).random(_PATHS) + 0.5 / _PATHS
    drawn = Statistics(*(np.zeros((_PATHS, *array.shape[1:])) for array in loads[0]))
    logs = np.zeros(_PATHS)
    before = np.zeros(_PATHS)
    for step, (load, weight) in enumerate(zip(loads, weights, strict=True)):
        both = added([drawn.at(np.s_[:, None]), load])
        with np.errstate(divide="ignore"):
            joint = log_likelihood(both)[0] + np.log(weight)
        expected = logsumexp(joint, axis=-1)
        logs += expected - before
        if step == steps:
            break
        cumulated = np.cumsum(np.exp(joint - expected[:, None]), axis=1)
        nodes = (cumulated < draws[:, step, None] * cumulated[:, -1:]).sum(axis=1)
        nodes = np.minimum(nodes, weight.size - 1)
        drawn = both.at((np.arange(_PATHS), nodes))
        before = log_likelihood(drawn)[0]
    mean = float(logsumexp(logs)) - math.log(_PATHS)
    return mean, float(np.std(np.exp(logs - mean)) / np.sqrt(_PATHS))


def _compressed(loads: Sequence[Statistics]) -> list[Statistics]:
    """Keep the systematic directions that move any datum: the work goes with their cube."""
    largest = np.sum([np.mean(load.information, axis=0) for load in loads], axis=0)
    values, vectors = np.linalg.eigh(largest)
    basis = vectors[:, values > _NEGLIGIBLE**2]
    return [
        load._replace(
            projection=load.projection @ basis, information=basis.T @ load.information @ basis
        )
        for load in loads
    ]


Prior: TypeAlias = ArrayFunction
"""The share of a prior below values of a parameter that is not negative."""


def log_uniform_prior(low: float, high: float) -> Prior:
    """Return the prior that gives each decade from ``low`` to ``high`` the same share."""
    whole = math.log(high / low)
    return lambda values: np.log(np.clip(values, low, high) / low) / whole
