"""One parameter by draws and by the first-order budget, and whether both agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from memscal.calibration.coverage import sampling_error, shortest_interval, symmetric_interval
from memscal.calibration.disagreement import Blame
from memscal.calibration.replicate_results import REPLICATED
from memscal.model.apparatus import ParameterSet
from memscal.model.validation import FloatArray

__all__ = ["COVERAGE", "TOLERANCE", "Comparison", "compared", "judged"]

#: Probability that a coverage interval holds.
COVERAGE = 0.95
#: Share by which standard uncertainties may differ.
TOLERANCE = 0.1
_LARGEST_SHIFT = 0.25
#: What an estimate counts but no draw shows.
_NOT_RANDOM = ("regularisation", "window", "raster_noise")


@dataclass(frozen=True, eq=False)
class Comparison:
    """One parameter by draws and by the first-order budget, in its SI unit.

    Parameters
    ----------
    name : str
        The parameter.
    value : float
        The calibration's.
    mean, uncertainty : float
        Mean and standard deviation of the draws.
    sampling_error : float
        Standard uncertainty of ``uncertainty`` for the number of draws.
    symmetric, shortest : tuple of float
        Coverage intervals of 95 %.
    first_order : float
        Standard uncertainty by the budget, of what scatters: noise and inputs.
    stated : float
        The calibration's standard uncertainty, what regularisation hides included.
    reason : str
        Why both do not agree; empty where they do.
    """

    name: str
    value: float
    mean: float
    uncertainty: float
    sampling_error: float
    symmetric: tuple[float, float]
    shortest: tuple[float, float]
    first_order: float
    stated: float
    reason: str = ""

    @property
    def ratio(self) -> float:
        """Standard uncertainty of the draws over that of the budget."""
        return self.uncertainty / self.first_order if self.first_order > 0 else np.nan

    @property
    def agrees(self) -> bool:
        """Whether the budget may be used in place of draws.

        Their standard uncertainties differ by no more than a tenth, and the mean of the draws
        from the calibration's value by no more than a quarter of one, beyond what the number of
        draws allows (two standard errors).
        """
        return not self.reason


def compared(
    parameters: ParameterSet, budget: Mapping[str, Mapping[str, float]], samples: FloatArray
) -> list[Comparison]:
    """Sum up draws, shape (draws, 5), beside the parameters and their budget."""
    return [
        Comparison(
            name=name,
            value=parameters[name],
            mean=float(column.mean()),
            uncertainty=float(column.std(ddof=1)),
            sampling_error=float(sampling_error(column) * column.std(ddof=1)),
            symmetric=_pair(symmetric_interval(column, COVERAGE)),
            shortest=_pair(shortest_interval(column, COVERAGE)),
            first_order=_random_part(budget[name]),
            stated=parameters.uncertainty(name),
        )
        for name, column in zip(REPLICATED, samples.T, strict=True)
    ]


def judged(
    found: Comparison,
    column: int,
    budget: Mapping[str, float],
    sources: Sequence[str],
    draws: int,
    blame: Blame,
) -> Comparison:
    """Give the reason where draws and budget disagree."""
    u = found.first_order
    spread = abs(found.uncertainty - u) <= TOLERANCE * u + 2 * found.sampling_error
    error = 2 * found.uncertainty / np.sqrt(draws)
    place = abs(found.mean - found.value) <= _LARGEST_SHIFT * u + error
    if spread and place:
        return found
    drawn = {source: budget.get(source, 0.0) for source in sources}
    return replace(found, reason=blame.sentence(column, found.value, drawn))


def _random_part(budget: Mapping[str, float]) -> float:
    """Standard uncertainty of what scatters; correlations carry the sign of what they add."""
    variance = sum(
        float(np.copysign(part**2, part))
        for source, part in budget.items()
        if source not in _NOT_RANDOM
    )
    return float(np.sqrt(max(variance, 0.0)))


def _pair(ends: FloatArray) -> tuple[float, float]:
    return float(ends[0]), float(ends[1])
