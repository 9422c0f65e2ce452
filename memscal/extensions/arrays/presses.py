"""Presses of a rod on an array: the readings of all sensors at each place."""

from __future__ import annotations

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, bessel_table, radial_spline
from memscal.model.arrays import ArrayFunction, BoolArray, FloatArray, IndexArray, array_record

#: Phase (rad) of the last wavenumber from one radius of a table to the next.
_PHASE = 0.25
#: Combinations of waves of less than this share of the largest are not seen.
_SEEN = 1e-8


@array_record
class Presses:
    """What m sensors read in t presses of one rod."""

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

    def profiles(self, columns: FloatArray) -> ArrayFunction:
        """Functions of the distance (m), (q,) each, of combinations (f, q); a cubic spline."""
        return radial_spline(self.radii, self.values @ columns)
