"""Places of a scan's readings, and even lattices of them."""

from dataclasses import dataclass

import numpy as np

from memscal.model.arrays import IndexArray


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the points of one scan."""

    index: IndexArray  # (n,): the place of each point
    row: IndexArray  # (n,): its row along y, 0 on a line
    # Typical distance of neighbours along x and y, in m, 0 along an axis without spread.
    steps: tuple[float, float]

    @property
    def count(self) -> int:
        """How many places there are."""
        return int(self.index.max()) + 1

    @property
    def readings(self) -> IndexArray:
        """Number of readings at the place of each point, shape (n,)."""
        return np.bincount(self.index)[self.index]


@dataclass(frozen=True, eq=False)
class EvenAxis:
    """An even lattice along one axis: ``start`` and ``step`` in m, ``index`` (n,) of each point."""

    start: float
    step: float
    index: IndexArray
