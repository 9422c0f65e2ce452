"""Presses of a rod on an array: the readings of all sensors at each place."""

from __future__ import annotations

from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, bessel_table, radial_spline
from memscal.estimation.points import agreeing_tops
from memscal.model.arrays import BoolArray, FloatArray, IndexArray, array_record
from memscal.model.scan import Scan

#: Phase (rad) of the last wavenumber from one radius of a table to the next.
_PHASE = 0.25
#: Combinations of waves of less than this share of the largest are not seen.
_SEEN = 1e-6


@array_record
class Presses:
    """What m sensors read in t presses of one rod; those that are not used read nothing."""

    places: FloatArray  # (2, t): of the rod, in m
    load: FloatArray  # (t,): in N
    u: FloatArray  # (m, t): readings, in V; zero where not kept
    keep: BoolArray  # (m, t)
    drift: FloatArray  # (t, d): columns of baseline and drift
    axes: tuple[int, ...]  # along which the centres are free: 0 for x, 1 for y
    place_errors: FloatArray  # (t,): standard uncertainty of each place along the scan, in m
    load_errors: FloatArray  # (t,): of each load, over it
    board: IndexArray  # (m,): whose electronics a sensor shares
    stated: FloatArray | None = None  # (m, t): stated noise, in V
    averaging: float = 0.0  # way along the scan over which each reading is the mean, in m

    @property
    def used(self) -> BoolArray:
        """Which sensors have readings, (m,)."""
        return np.asarray(self.keep.any(axis=1))


@array_record
class Waves:
    """Combinations f of all waves that a film passes, as functions of the distance."""

    radii: FloatArray  # (r,), in m
    values: FloatArray  # (r, f): per newton
    mix: FloatArray  # (f, nodes): a kernel of transform K is the combination mix @ K

    @classmethod
    def of(cls, reference: RadialSpectrum, reach: float) -> Waves:
        """Decompose the waves of a reference out to a distance, by singular values."""
        k = reference.wavenumbers.k
        radii = np.arange(0.0, reach + 2 * _PHASE / k[-1], _PHASE / k[-1])
        measure = reference.wavenumbers.weights * reference.values
        left, size, right = np.linalg.svd(bessel_table(radii, k) * measure, full_matrices=False)
        seen = size > _SEEN * size[0]
        scale = np.sqrt(radii.size)
        return cls(radii, scale * left[:, seen], size[seen, None] / scale * right[seen])

    def profiles(self, columns: FloatArray) -> Any:
        """Functions of the distance (m), (q,) each, of combinations (f, q); a cubic spline."""
        return radial_spline(self.radii, self.values @ columns)


#: A sensor whose peak is below so many times the noise of its outermost readings is dead.
_DEAD = 8.0
#: The outermost readings are this share of all, the highest three stand for the peak.
_OUTERMOST = 0.1
_FEWEST = 10
#: The highest readings are at a ceiling if so many agree to such a share of the noise: readings to
#: many digits, and to few.
_CLIPPED = ((3, 0.02), (6, 0.2))


@array_record
class Sorted:
    """Readings (n, t) of an array at places (2, t), and which count; which of its n sensors do."""

    places: FloatArray
    u: FloatArray
    keep: BoolArray
    used: BoolArray
    dead: BoolArray
    at_ceiling: IndexArray  # (n,): how many readings
    peak: FloatArray  # (n,): over the baseline, in V
    baseline: FloatArray  # (n,)

    @property
    def largest(self) -> int:
        """The used sensor of the highest peak."""
        return int(np.argmax(np.where(self.used, self.peak, -np.inf)))


def sorted_readings(scan: Scan) -> Sorted:
    """Find dead sensors and readings at a ceiling, as stated or as they agree."""
    n = len(scan.sensors)
    places = np.stack([values.ravel() for values in scan.positions])
    u = scan.u_zz.reshape(n, -1)
    numbers = np.zeros((3, n))
    low = -np.inf if scan.reading_low is None else scan.reading_low[:, None]
    high = np.inf if scan.reading_high is None else scan.reading_high[:, None]
    keep = (u > low) & (u < high)
    for i, row in enumerate(u):
        inside = np.flatnonzero(keep[i])
        if inside.size < _FEWEST:
            continue
        values = row[inside]
        top = places[:, inside[np.argmax(abs(values - np.median(values)))]]
        distance = np.hypot(*(places[:, inside] - top[:, None]))
        count = max(int(_OUTERMOST * inside.size), _FEWEST)
        falling = np.argsort(-distance)
        outermost = np.sort(falling[:count])
        # A drift across the scan is no peak: it is that of the half farther from the peak.
        far = falling[: max(inside.size // 2, _FEWEST)]
        columns = np.vstack([np.ones(inside.size), places[:, inside]]).T
        level = values - columns @ np.linalg.lstsq(columns[far], values[far])[0]
        peak = np.sort(level)[-3] - np.median(level[outermost])
        # Steps tell the noise also where a peak begins.
        noise = np.sqrt(np.mean(np.diff(level[outermost]) ** 2) / 2)
        numbers[:, i] = peak, np.median(values[outermost]), noise
        if scan.reading_high is None:
            keep[i, inside[_clipped(values, noise)]] = False
    peak, baseline, noise = numbers
    stated = np.ones(n, bool) if scan.used is None else scan.used
    # The few outermost readings of one sensor may scatter by less than its noise.
    dead = stated & (peak <= _DEAD * np.maximum(noise, np.median(noise)))
    used = stated & ~dead
    at_ceiling = np.sum(np.isfinite(u) & ~keep, axis=1) * used
    return Sorted(places, u, keep & used[:, None], used, dead, at_ceiling, peak, baseline)


def _clipped(u: FloatArray, noise: float) -> IndexArray:
    """Numbers of the highest readings (n,), if they agree as no noise has them."""
    falling, counts, apart = agreeing_tops(u)
    for fewest, share in _CLIPPED:
        alike = counts[(counts >= fewest) & (apart[counts - 1] <= share * noise)]
        if alike.size:
            return falling[: alike.max()]
    return falling[:0]


def fitted_layout(
    layout: FloatArray, centres: FloatArray, used: BoolArray
) -> tuple[FloatArray, complex]:
    """Shift, turn and scale a layout (n, 2) to the centres (m, 2) of the used sensors: (n, 2).

    The factor is that of complex numbers: its angle is the turn.
    """
    # A similarity is a linear function of complex numbers.
    design = layout @ [1, 1j]
    columns = np.stack([np.ones_like(design), design], axis=1)
    solution = np.linalg.lstsq(columns[used], centres @ [1, 1j])[0]
    fitted = columns @ solution
    return np.stack([fitted.real, fitted.imag], axis=1), solution[1]
