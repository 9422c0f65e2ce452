"""Why draws and the first-order budget disagree: the source that does it, and how."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from memscal.calibration.input_draws import ReferenceTable
from memscal.model.validation import FloatArray

__all__ = ["Blame"]

#: Draws of the noise and one more source, by its name: scalars, shape (draws, parameters).
DrawOf = Callable[[str], FloatArray]
#: A share of a stated uncertainty that draws must lose before a cut-off is to blame.
_CUT = 0.05
#: Sources below this share of the largest are not looked at.
_COUNTS = 0.05


class Blame:
    """Finds the source that makes draws and budget disagree, varying one at a time.

    Parameters
    ----------
    draw_of : callable
        Draws the scalars with noise and one more source varied, the others kept.
    table : ReferenceTable or None
        Where the draws of film and rod come from.
    """

    def __init__(self, draw_of: DrawOf, table: ReferenceTable | None) -> None:
        self._draw_of = draw_of
        self._table = table
        self._drawn: dict[str, FloatArray] = {}

    def sentence(self, column: int, value: float, budget: Mapping[str, float]) -> str:
        """Say why one parameter disagrees.

        Parameters
        ----------
        column : int
            Which of the scalars.
        value : float
            The calibration's.
        budget : mapping of str to float
            Standard uncertainty by source, of those that are drawn.
        """
        largest = max(budget.values())
        counting = [name for name, u in budget.items() if u > _COUNTS * largest]
        source = max(counting, key=lambda name: self._off(name, column, value, budget[name]))
        if source == "noise":
            return (
                "It is not linear in the noise: the Gaussian and the departures from it are "
                "weighed anew in every draw."
            )
        cut = self._cut_off()
        if source == "poisson_ratio" and cut:
            return cut
        return f"It is not linear in the {source.replace('_', ' ')} over its uncertainty."

    def _off(self, name: str, column: int, value: float, first_order: float) -> float:
        """Square by which spread and mean of one source's draws differ from the budget's.

        Without noise the estimate would be another one: an input is what it adds to the noise.
        """
        draws = self._drawn_with(name)[:, column]
        draws = draws - (value if name == "noise" else self._drawn_with("noise")[:, column])
        return float(abs(draws.var(ddof=1) - first_order**2) + draws.mean() ** 2)

    def _drawn_with(self, name: str) -> FloatArray:
        if name not in self._drawn:
            self._drawn[name] = self._draw_of(name)
        return self._drawn[name]

    def _cut_off(self) -> str:
        """Say that Poisson's ratio loses the films above 1/2, if it does."""
        if self._table is None or "poisson_ratio" not in self._table.sources:
            return ""
        stated = self._table.stated("poisson_ratio")
        quantiles = (np.arange(1000) + 0.5) / 1000
        kept = float(self._table.quantiles("poisson_ratio", quantiles).std())
        if kept > (1 - _CUT) * stated:
            return ""
        return (
            f"Poisson's ratio is cut off at 0.5: its draws scatter by {kept:.2g}, not by the "
            f"{stated:.2g} that the budget counts, and all to one side."
        )
