"""Velocity of the indenter along a scan, by the times of its readings or by its speed."""

import numpy as np

from memscal.estimation.points import grouped
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan

#: A velocity is taken over so many readings to either side.
_AROUND = 5


def velocities(scan: Scan) -> FloatArray:
    """Return the velocity at each reading, in m/s, of their shape; zero where it was held, or NaN.

    By the times of the readings; else by the speed, in the stated direction, or in the order of the
    positions.
    """
    along, across = scan.positions if scan.direction == "x" else scan.positions[::-1]
    velocity = np.zeros(scan.shape)
    if scan.dwell_time:
        return velocity
    if scan.time is not None:
        line = grouped(np.ravel(scan.passes), np.ravel(across)).reshape(scan.shape)
        for number in range(line.max() + 1):
            rows = (line == number) & np.isfinite(scan.time)
            velocity[rows] = _slopes(along[rows], scan.time[rows])
        return velocity
    if scan.speed:
        ways = np.sign(scan.x[-1] - scan.x[0])
        velocity += scan.speed * (
            ways if scan.sliding_direction is None else scan.sliding_direction
        )
    return velocity


def _slopes(x: FloatArray, time: FloatArray) -> FloatArray:
    """Return dx/dt at each of the readings (n,) of one pass."""
    order = np.argsort(time, kind="stable")
    place = np.arange(order.size)
    after = order[np.minimum(place + _AROUND, order.size - 1)]
    before = order[np.maximum(place - _AROUND, 0)]
    apart = time[after] - time[before]
    later = apart > 0
    slopes = np.zeros(x.size)
    slopes[order[later]] = (x[after] - x[before])[later] / apart[later]
    return slopes
