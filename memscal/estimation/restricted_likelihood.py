r"""The evidence for one shape of departure at one strength, and its posterior.

Amplitudes :math:`c_j \sim N(0, \tau^2)` stand beside parameters (A, width, centre, baseline,
drift) without prior.  With the latter projected out (restricted likelihood: Patterson and
Thompson, Biometrika 58, 1971) and singular values :math:`s_j` of what is left of the shape's
design,

.. math::

    -2\log p(u \mid \tau) = \nu\log\hat\sigma^2 + \sum_j\log(1+\tau^2 s_j^2/\hat\sigma^2), \qquad
    \nu\hat\sigma^2 = \rho + \sum_j \frac{p_j^2}{1+\tau^2 s_j^2/\hat\sigma^2},

where :math:`p_j` are the data along the singular vectors and :math:`\rho` the rest.

Before a scan is made, its data are not known but their expected squares are: those of the signal
plus those of the noise.  With :math:`E[p_j^2]` and :math:`E[\rho]` in place of the data's, the same
formulas give the covariance to expect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["Outcome", "Part", "Projected"]

_VARIANCE_ROUNDS = 8
#: The smallest noise, over the largest residual of a Gaussian, that is told from rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Part:
    """One shape's design with the flat columns projected out, by its singular values.

    ``along``: the data along the left singular vectors; ``power``: their squares, those of the
    expected noise included.
    """

    block: slice
    columns: FloatArray
    left: FloatArray
    singular: FloatArray
    right: FloatArray
    along: FloatArray
    power: FloatArray


@dataclass(frozen=True, eq=False)
class Outcome:
    """One hypothesis: log evidence, noise variance, and what gives its posterior.

    ``shrink``: factors from data to amplitudes along the singular vectors; ``slope``: derivative
    of the log evidence by the weighted data.
    """

    log_evidence: float
    variance: float
    strength: float
    part: Part | None
    shrink: FloatArray
    slope: FloatArray

    def amplitude_covariance(self, least_variance: float) -> FloatArray:
        """Posterior covariance of the amplitudes, at a noise that is believed at least."""
        if self.part is None:
            return np.zeros((0, 0))
        prior, right = self.strength**2, self.part.right
        variance = max(self.variance, least_variance)
        left_over = prior * variance / (variance + prior * self.part.singular**2)
        seen = (right.T * left_over) @ right
        if right.shape[0] == right.shape[1]:
            return np.asarray(seen)
        # Fewer points than components leave the prior as it was along what they do not see.
        return np.asarray(seen + prior * (np.eye(right.shape[1]) - right.T @ right))


@dataclass(frozen=True, eq=False)
class Projected:
    """Weighted data and flat columns: what every hypothesis shares.

    ``added``: variance of noise that is expected, but not in the data.
    """

    scale: FloatArray
    q: FloatArray
    inverse: FloatArray
    data: FloatArray
    rest: FloatArray
    freedom: float
    added: float

    @classmethod
    def from_columns(
        cls, flat: FloatArray, data: FloatArray, freedom: float, added: float
    ) -> Projected:
        """Project the flat columns out of the data; all of them weighted."""
        scale = np.linalg.norm(flat, axis=0)
        q, r = np.linalg.qr(flat / scale)
        return cls(scale, q, np.linalg.inv(r), data, data - q @ (q.T @ data), freedom, added)

    @property
    def power(self) -> float:
        """Square of all that the flat columns leave over, the expected noise included."""
        return float(self.rest @ self.rest) + self.added * self.freedom

    def part(self, columns: FloatArray, block: slice) -> Part:
        """Decompose a shape's columns, weighted; ``block`` is where they stand among all."""
        free = columns - self.q @ (self.q.T @ columns)
        left, singular, right = np.linalg.svd(free, full_matrices=False)
        along = left.T @ self.rest
        # Of a vector that meets the flat columns, only the part beside them carries noise.
        free_share = 1 - np.sum((self.q.T @ left) ** 2, axis=0)
        return Part(
            block, columns, left, singular, right, along, along**2 + self.added * free_share
        )

    def gaussian(self) -> Outcome:
        """Return the outcome without any departure."""
        variance = self._floor(self.power / self.freedom)
        nothing = np.zeros(0)
        log_evidence = -0.5 * self.freedom * float(np.log(variance))
        return Outcome(log_evidence, variance, 0.0, None, nothing, -self.rest / variance)

    def weigh(self, part: Part, strength: float) -> Outcome:
        """Return the outcome for one shape at one strength, the noise at its most probable."""
        beyond = max(self.power - float(part.power.sum()), 0.0)
        signal = (strength * part.singular) ** 2
        variance = self._floor(self.power / self.freedom)
        for _ in range(_VARIANCE_ROUNDS):
            explained = part.power * variance / (variance + signal)
            variance = self._floor((beyond + float(explained.sum())) / self.freedom)
        inflation = 1 + signal / variance
        log_evidence = -0.5 * (self.freedom * np.log(variance) + float(np.log(inflation).sum()))
        return Outcome(
            log_evidence,
            variance,
            strength,
            part,
            strength**2 * part.singular / (variance + signal),
            (part.left @ (signal / (variance + signal) * part.along) - self.rest) / variance,
        )

    def _floor(self, variance: float) -> float:
        return max(variance, (_ROUNDING * float(np.abs(self.data).max())) ** 2, 1e-300)
