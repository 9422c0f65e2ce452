"""Velocity of the indenter along a scan, by the times of its readings or by its speed."""

import numpy as np

from memscal.errors import InputError
from memscal.estimation.points import grouped
from memscal.measurement.restore import place_of
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan

#: A velocity is taken over so many readings to either side, and over this share of them.
_AROUND = 5
_SHARE = 0.025
#: Of the ways between readings, what moves on is at least this share; a random order has less.
_ONWARDS = 0.5
#: Share of the way that may be against the stated direction, and ratio of speeds that are one.
_AGAINST = 0.1
_ALIKE = 1.5


def velocities(scan: Scan) -> FloatArray:
    """Return the velocity at each reading, in m/s, of their shape; zero where it was held.

    By the times of the readings; else by the speed, in the stated direction, or in the order of the
    readings.
    """
    velocity = np.zeros(scan.shape)
    if scan.dwell_time:
        return velocity
    clock = np.arange(0.0, velocity.size).reshape(scan.shape)
    speed = scan.speed
    if scan.time is not None and np.isfinite(scan.time).any():
        known = np.isfinite(scan.time)
        # A reading without a time is taken to be between its neighbours.
        clock = np.interp(clock, clock[known], scan.time[known])
        speed = None
    elif not speed:
        return velocity
    elif scan.sliding_direction is not None:
        return velocity + speed * scan.sliding_direction
    along, across = scan.positions if scan.direction == "x" else scan.positions[::-1]
    line = grouped(np.ravel(scan.passes), np.ravel(across)).reshape(scan.shape)
    for number in range(line.max() + 1):
        rows = line == number
        velocity[rows] = _slopes(along[rows], clock[rows])
    return speed * np.sign(velocity) if speed else velocity


def sliding_speed(scan: Scan) -> float | None:
    """Return the speed of an indenter that slid, in m/s: as stated, or by the times to two digits.

    Refuse passes of several speeds, and directions against the times.
    """
    if scan.time is None or scan.dwell_time or not np.isfinite(scan.time).any():
        return scan.speed
    velocity = velocities(scan)
    if scan.sliding_direction is not None:
        forth = velocity * scan.sliding_direction
        if -forth.sum(where=forth < 0) > _AGAINST * np.abs(forth).sum():
            raise InputError(
                f"{place_of(scan)}: in time the indenter moves against its direction of sliding.",
                why="Forth is to larger positions, back to smaller ones.",
                cure="Correct the directions (--sliding), or the sign of the positions.",
            )
    passes = np.broadcast_to(scan.passes, velocity.shape)
    each = [np.median(np.abs(velocity[passes == i])) for i in np.unique(passes)]
    if max(each) > _ALIKE * min(each):
        low, high = (f"{1e3 * speed:.2g}" for speed in (min(each), max(each)))
        raise InputError(
            f"{place_of(scan)}: the indenter slid at {low} to {high} mm/s.",
            why="Friction depends on the speed, and passes of one file are taken as alike.",
            cure="Give the passes of each speed a file of their own.",
        )
    return scan.speed or float(f"{np.median(np.abs(velocity)):.2g}")


def _slopes(x: FloatArray, time: FloatArray) -> FloatArray:
    """Return dx/dt at each of the readings (n,) of one pass."""
    # A coarse clock gives several readings one time: they count by their mean.
    ticks, tick, count = np.unique(time, return_inverse=True, return_counts=True)
    path = np.bincount(tick, x) / count
    place = np.arange(ticks.size)
    around = max(_AROUND, round(_SHARE * ticks.size))
    after = np.minimum(place + around, ticks.size - 1)
    before = np.maximum(place - around, 0)
    onwards = path[after] - path[before]
    way = np.append(0.0, np.cumsum(np.abs(np.diff(path))))
    if ticks.size < 2 or np.abs(onwards).sum() < _ONWARDS * (way[after] - way[before]).sum():
        raise InputError(
            "The positions of a scan do not follow each other in time.",
            why="How a sensor follows a reading depends on how fast the indenter moves there.",
            cure="Give the time of each reading (/entry/data/time); if the indenter was held at "
            "each, say how long (memscal import --dwell S).",
        )
    slopes = onwards / (ticks[after] - ticks[before])
    return slopes[tick]
