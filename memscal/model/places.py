"""Places of a scan's readings, and even lattices of them."""

import numpy as np

from memscal.model.arrays import IndexArray, array_record


@array_record
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


@array_record
class EvenAxis:
    """An even lattice along one axis: ``start`` and ``step`` in m, ``index`` (n,) of each point."""

    start: float
    step: float
    index: IndexArray
