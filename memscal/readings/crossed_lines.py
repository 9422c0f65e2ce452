"""Points in a plane that are two crossed lines, as a scan of each line."""

from dataclasses import replace
from typing import Any

import numpy as np

from memscal.model.arrays import BoolArray, FloatArray
from memscal.model.correlation import of_points
from memscal.model.scan import LIKE_SIGNAL, Scan

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
    return (
        _line(scan, along_x, scan.x - middles[0], "x"),
        _line(scan, along_y, scan.y - middles[1], "y"),
    )


def _most_frequent(places: FloatArray) -> float:
    values, counts = np.unique(np.round(places, 7), return_counts=True)
    return float(values[np.argmax(counts)])


def _line(scan: Scan, chosen: BoolArray, positions: FloatArray, direction: str) -> Scan:
    """Return the chosen points as a line."""
    arrays: dict[str, Any] = {"x": positions[chosen], "u_zz": scan.u_zz[chosen]}
    for name in ("repeat", "branch", "x_errors", *LIKE_SIGNAL):
        values = getattr(scan, name)
        if values is not None:
            arrays[name] = values[chosen]
    if scan.u_zz_correlation is not None:
        arrays["u_zz_correlation"] = of_points(scan.u_zz_correlation, np.flatnonzero(chosen))
    channels = {name: values[chosen] for name, values in scan.channels.items()}
    return replace(scan, y=None, direction=direction, channels=channels, **arrays)
