r"""Fields of sensors as they were measured, where no film and no round G describe them.

A magnetic skin's field changes its sign from place to place: there is no constant in pascals.  A
raster of presses, repeated, gives for each sensor a map :math:`H_i(r)` of its reading per press:
the mean of the repeats, smoothed by bicubic splines until its misfit is the scatter of that mean.
Contacts like those presses are then located with a free amplitude, in presses of the scan.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from memscal.extensions.arrays.array_data import ArrayData
from memscal.model.arrays import ArrayPair, FloatArray, array_record, floats

#: The length over which fields change, in steps of the raster.
_SCALE = 4.0


@array_record
class MeasuredFields:
    """The maps of an array whose kernel is measured; as receptive fields, without shear."""

    array: ArrayData
    unit = "1"
    most = np.inf

    @cached_property
    def nodes(self) -> ArrayPair:
        """Places of the raster along x and along y, in m."""
        readings = self.array.readings
        return np.unique(readings.x), np.unique(readings.y)

    @property
    def sensors(self) -> Any:
        """Numbers of the sensors that are used."""
        return np.flatnonzero(self.array.used)

    @property
    def centres(self) -> FloatArray:
        """Ends of the raster, (2, 2), in m: the sensors' own places do not matter."""
        return np.transpose([axis[[0, -1]] for axis in self.nodes])

    @property
    def scale(self) -> float:
        """Length over which fields change, in m."""
        return float(_SCALE * np.diff(self.nodes[0]).min())

    @cached_property
    def _splines(self) -> list[Any]:
        from scipy.interpolate import RectBivariateSpline

        x, y = self.nodes
        maps = self.array.readings.predicted[self.sensors].reshape(-1, x.size, y.size)
        return [RectBivariateSpline(x, y, one) for one in maps]

    def radius(self, force: FloatArray) -> FloatArray:
        """Contact radii, which are not known."""
        return np.full_like(force, np.nan)

    def value(self, places: FloatArray, *_: Any) -> FloatArray:
        """Fields per press, (m, n)."""
        return self._derived(places, 0, 0)

    def normal(self, places: FloatArray, *_: Any) -> FloatArray:
        """Their derivatives by x and y, and they themselves, (3, m, n)."""
        return np.stack([self._derived(places, *order) for order in ((1, 0), (0, 1), (0, 0))])

    def _derived(self, places: FloatArray, by_x: int, by_y: int) -> FloatArray:
        x, y = places.T
        return np.stack([one.ev(x, y, by_x, by_y) for one in self._splines], axis=1)

    def forward(self, places: FloatArray, force: FloatArray, *_: Any) -> ArrayPair:
        """Readings (m, n), and their derivatives by x, y, presses and two shears, (m, n, 5)."""
        by_x, by_y, h = self.normal(places)
        scale = force[:, None]
        return scale * h, np.stack([scale * by_x, scale * by_y, h, 0 * h, 0 * h], axis=-1)

    def errors(self, _: FloatArray, force: FloatArray, *__: Any) -> FloatArray:
        """Changes of the readings by one u of each map, (m, n, n)."""
        return floats(force[:, None, None] * np.diag(self.array.root[self.sensors, 0]))
