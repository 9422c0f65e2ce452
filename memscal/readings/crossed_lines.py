"""Points in a plane that are two crossed lines, as a scan of each line."""

import numpy as np

from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan, only_points

#: Points within this share of the lines' length from a line are on it.
_ON_LINE = 1e-3
#: Fewer points on a line are none.
_FEWEST = 6


def crossed_lines(scan: Scan) -> tuple[Scan, ...]:
    """Return two lines, along x and y, about where they cross, or a scan that is none such."""
    if scan.kind != "points" or scan.y is None:
        return (scan,)
    middles = [_most_frequent(places) for places in (scan.x, scan.y)]
    tolerance = _ON_LINE * max(np.ptp(scan.x), np.ptp(scan.y))
    along_x = np.abs(scan.y - middles[1]) <= tolerance
    along_y = np.abs(scan.x - middles[0]) <= tolerance
    if not (along_x | along_y).all() or min(along_x.sum(), along_y.sum()) < _FEWEST:
        return (scan,)
    along_y &= ~along_x
    x = scan.x[along_x] - middles[0]
    y = scan.y[along_y] - middles[1]
    return (
        only_points(scan, np.flatnonzero(along_x), x=x, y=None),
        only_points(scan, np.flatnonzero(along_y), x=y, y=None, direction="y"),
    )


def _most_frequent(places: FloatArray) -> float:
    values, counts = np.unique(np.round(places, 7), return_counts=True)
    return float(values[np.argmax(counts)])
