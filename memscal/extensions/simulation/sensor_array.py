"""Simulated sensors in rows and columns under one film: places, constants, and crosstalk."""

import numpy as np

from memscal.extensions.simulation.sensor import Truth
from memscal.model.arrays import FloatArray, Values, array_record, require_positive, require_range

#: Scatter of the conversion constants, and of the centres about the layout, in m.
_SCATTER = 0.05
MISPLACED = 20e-6
#: What a truth knows of each sensor.
OF_SENSORS = ("conversion_constant", "centre", "centre_y")
#: Neighbours are apart by at most this times the pitch; most rows and columns.
_NEAR = 1.3
_MOST = 32


@array_record
class SimulatedArray:
    """An array of n sensors: its layout and true centres (m), and what each reads of each."""

    layout: FloatArray  # (n, 2)
    centres: FloatArray  # (n, 2)
    scale: FloatArray  # (n,): conversion constants over their nominal value
    crosstalk: float
    shares: FloatArray  # (n, n): of what a row's sensor reads of each signal

    @property
    def sensors(self) -> tuple[str, ...]:
        """Their names: row by row, T01, T02 and so on."""
        return tuple(f"T{number:02d}" for number in range(1, len(self.layout) + 1))

    @property
    def stated(self) -> Values:
        """What a scan states of them."""
        return {"sensors": self.sensors, "layout": self.layout, "layout_uncertainty": MISPLACED}

    def read(self, stresses: FloatArray) -> FloatArray:
        """Return what sensors read of their stresses, (n, ...), over the nominal constant."""
        return np.tensordot(self.shares * self.scale, stresses, axes=1)

    def truth(self, conversion_constant: float) -> Truth:
        """Return constants and centres by the names of a truth, which are lower-case in files."""
        truth: Truth = {"crosstalk": self.crosstalk}
        for name, scale, (x, y) in zip(self.sensors, self.scale, self.centres, strict=True):
            known = (scale * conversion_constant, x, y)
            for what, value in zip(OF_SENSORS, known, strict=True):
                truth[f"{what}_{name.lower()}"] = float(value)
        return truth


def simulated_array(
    array: tuple[int, int],
    pitch: float,
    crosstalk: float,
    centre: tuple[float, float],
    seed: int,
) -> SimulatedArray:
    """Draw an array of rows and columns about a centre (m) that reads of its neighbours."""
    rows, columns = array
    for count in array:
        require_range("number of rows or columns", count, 1, _MOST)
    require_positive("pitch", pitch, "m")
    require_range("crosstalk", crosstalk, -0.5, 0.5)
    y, x = np.mgrid[:rows, :columns]
    layout = pitch * np.column_stack([x.ravel(), y.ravel()])
    layout -= layout.mean(axis=0)
    rng = np.random.default_rng([seed, 2])
    apart = np.hypot(*(layout[:, None] - layout).T)
    return SimulatedArray(
        layout=layout,
        centres=layout + centre + MISPLACED * rng.standard_normal(layout.shape),
        scale=1 + _SCATTER * rng.standard_normal(len(layout)),
        crosstalk=crosstalk,
        shares=np.where(apart > 0, crosstalk * (apart < _NEAR * pitch), 1.0),
    )
