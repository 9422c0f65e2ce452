"""The hypotheses of :mod:`memscal.estimation.evidence` for many sets of data at once."""

from __future__ import annotations

import numpy as np

from memscal.estimation.departure import SHAPES, DepartureBasis
from memscal.estimation.evidence import HYPOTHESES, Hypothesis
from memscal.model.validation import FloatArray

__all__ = ["BatchEvidence"]

_VARIANCE_ROUNDS = 8
_NEGLIGIBLE = 1e-4


class BatchEvidence:
    """Designs that many sets of data share, decomposed once.

    Parameters
    ----------
    basis : DepartureBasis
        The kernels.
    flat : ndarray, shape (n, p)
        Standardised derivatives by the parameters without prior.
    columns : ndarray, shape (n, m)
        Standardised voltages of the departures' components.
    freedom : float
        How many points the data are worth, less p.
    """

    def __init__(
        self, basis: DepartureBasis, flat: FloatArray, columns: FloatArray, freedom: float
    ) -> None:
        scale = np.linalg.norm(flat, axis=0)
        self.q, triangle = np.linalg.qr(flat / scale)
        self.plain = np.linalg.inv(triangle) @ self.q.T / scale[:, None]
        self.basis, self.columns, self.freedom = basis, columns, freedom
        free = columns - self.q @ (self.q.T @ columns)
        self.parts = [
            np.linalg.svd(free[:, b.start - basis.flat : b.stop - basis.flat], full_matrices=False)
            for b in basis.blocks
        ]

    def weigh(
        self, data: FloatArray, size: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weigh departures in many sets of data.

        Parameters
        ----------
        data : ndarray, shape (replicates, n)
            Standardised voltages less those of each one's Gaussian.
        size : ndarray, shape (replicates,)
            Amplitude of each one's Gaussian over that of the basis: departures are expected to
            be as much larger.

        Returns
        -------
        mean, noise, probability : ndarray
            As in :class:`memscal.estimation.evidence.WeighedFit`, a row for each replicate.
        """
        flat = self.basis.flat
        rest = data - (data @ self.q) @ self.q.T
        square = np.sum(rest**2, axis=1)
        along = [rest @ left for left, _, _ in self.parts]
        kept = [h for h in HYPOTHESES if h.estimate > 0]
        evidence, variance, shrunk = zip(
            *(self._hypothesis(h, square, along, size) for h in kept), strict=True
        )
        weight = _posterior(np.stack(evidence), np.array([h.estimate for h in kept]))
        amplitudes = np.zeros((len(data), self.columns.shape[1]))
        for hypothesis, share, part in zip(kept, weight, shrunk, strict=True):
            if hypothesis.shape is not None:
                i = SHAPES.index(hypothesis.shape)
                block = self.basis.blocks[i]
                inside = slice(block.start - flat, block.stop - flat)
                amplitudes[:, inside] += (share[:, None] * part) @ self.parts[i][2]
        # What the departures explain is not the flat parameters' to explain.
        own = (data - amplitudes @ self.columns.T) @ self.plain.T
        noise = np.sqrt(np.sum(weight * np.stack(variance), axis=0))
        probability = np.zeros((len(data), len(HYPOTHESES)))
        probability[:, [HYPOTHESES.index(h) for h in kept]] = weight.T
        return np.hstack([own, amplitudes]), noise, probability

    def _hypothesis(
        self,
        hypothesis: Hypothesis,
        square: FloatArray,
        along: list[FloatArray],
        size: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Log evidence, noise variance, and amplitudes along the singular vectors."""
        variance = square / self.freedom
        if hypothesis.shape is None:
            return -0.5 * self.freedom * np.log(variance), variance, np.zeros(0)
        i = SHAPES.index(hypothesis.shape)
        singular, data = self.parts[i][1], along[i]
        beyond = np.maximum(square - np.sum(data**2, axis=1), 0.0)
        strength = hypothesis.strength * size[:, None]
        signal = (strength * singular) ** 2
        for _ in range(_VARIANCE_ROUNDS):
            each = variance[:, None]
            variance = (beyond + np.sum(data**2 * each / (each + signal), axis=1)) / self.freedom
        each = variance[:, None]
        log_evidence = self.freedom * np.log(variance) + np.log1p(signal / each).sum(axis=1)
        shrunk = strength**2 * singular / (each + signal) * data
        return -0.5 * log_evidence, variance, shrunk


def _posterior(log_evidence: FloatArray, prior: FloatArray) -> FloatArray:
    """Posterior weights, shape (hypotheses, replicates)."""
    weight = prior[:, None] * np.exp(log_evidence - log_evidence.max(axis=0))
    weight[weight < _NEGLIGIBLE * weight.sum(axis=0)] = 0.0
    return np.asarray(weight / weight.sum(axis=0))
