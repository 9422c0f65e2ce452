"""Bayes factor: ratio of the evidences of two models, with its strength in words."""

import math
from dataclasses import dataclass

#: From these values of twice its logarithm on the evidence is positive, strong, and very strong.
POSITIVE = 2.0
STRONG = 6.0
VERY_STRONG = 10.0
#: Steps of twice the natural logarithm of a Bayes factor, in words.
_WORDS = (
    (POSITIVE, "not worth more than a bare mention"),
    (STRONG, "positive"),
    (VERY_STRONG, "strong"),
    (math.inf, "very strong"),
)


@dataclass(frozen=True)
class BayesFactor:
    r"""Ratio of the evidences of two laws, by their names.

    :math:`\ln B = \ln p(u | \text{favoured}) - \ln p(u | \text{against})` is not negative.
    ``log_likelihood_ratio`` is that of the largest likelihoods, which no prior changes; ``None``
    where it was not asked for.

    >>> factor = BayesFactor("elasto-plastic", "Amontons", 4.0)
    >>> print(f"{factor.value:.0f}: {factor.words}")
    55: strong
    """

    favoured: str
    against: str
    log_factor: float
    log_likelihood_ratio: float | None = None

    @property
    def value(self) -> float:
        """The factor itself; ``inf`` where it is beyond all numbers."""
        return math.exp(self.log_factor) if self.log_factor < 700 else math.inf

    @property
    def words(self) -> str:
        r"""Evidence in words, by :math:`2\ln B` (Kass and Raftery, JASA 90 (1995) 773)."""
        return next(words for limit, words in _WORDS if 2 * self.log_factor < limit)
