r"""A calibrated array of sensors under one film.

Sensor i reads, of a rod at r with the load P,

.. math::

    u_i = b_i + \sum_j C_{ij} A_j P\,f_j(r - c_j), \qquad
    f_j(R) = \frac{1}{2\pi}\int \hat G_j(k)\,\hat\sigma(k)\,J_0(kR)\,k\,dk,

with :math:`C_{ii} = 1`: only the products :math:`C_{ij} A_j` are observed, and that is a
convention.  A uniform pressure p reads :math:`p \sum_j C_{ij} A_j`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from memscal.axisymmetry.hankel import hankel_transform
from memscal.axisymmetry.kernels import gaussian_transfer, gaussian_transfer_slope
from memscal.model.arrays import (
    BoolArray,
    FloatArray,
    IndexArray,
    Values,
    array_record,
    floats,
    keyword_array_record,
)
from memscal.model.checks import Checked, Message, QualityCheck
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.instrument import Equipment, LoadCell, User
from memscal.model.notation import VOLTS, Reading
from memscal.model.provenance import Process

#: Owner of a mode that changes the kernels of all sensors.
ALL = -1
#: Radii at which G is shown, in widths of its Gaussian.
RADII = np.linspace(0.0, 8.0, 161)


@array_record
class KernelModes:
    """What is open of the shape of G: changes of its transform, whose sizes are parameters."""

    changes: FloatArray  # (m, nodes): of the transform of G; zero at k = 0
    owner: IndexArray  # (m,): the sensor whose kernel changes, or ALL


@array_record
class ArrayReadings:
    """What an array was calibrated with, and what it predicts; press by press."""

    x: FloatArray  # (t,): position of the rod, in m
    y: FloatArray  # (t,)
    load: FloatArray  # (t,): in N
    u: FloatArray  # (n, t): readings, in V; NaN where missing, at a ceiling, or not used
    predicted: FloatArray  # (n, t): with baselines
    background: FloatArray  # (n, t): baselines and drifts


def nearest_width(k: FloatArray, transfer: FloatArray, start: float) -> float:
    """Return the width of the Gaussian nearest to a G in the plane, in m, by its transform."""
    from scipy.optimize import minimize_scalar

    # By Parseval's theorem the squares of transforms count by k dk.
    area = k * np.gradient(k)
    found = minimize_scalar(
        lambda sigma: np.sum(area * (transfer - gaussian_transfer(k, sigma)) ** 2),
        bounds=(start / 3, 3 * start),
        method="bounded",
        options={"xatol": 1e-6 * start},
    )
    return float(found.x)


@keyword_array_record
class ArrayData(Checked):
    """Everything that an array artifact stores, in SI units; n sensors, p parameters."""

    sensors: tuple[str, ...]
    used: BoolArray  # (n,): False of a dead one, whose numbers are NaN
    conversion_constants: FloatArray  # (n,): in V/Pa, or in the SI unit of the readings per Pa
    centres: FloatArray  # (n, 2): x and y in m; y is NaN where the scan does not tell it (a line)
    crosstalk: FloatArray  # (n, n): what the row's sensor reads of the column's; 1 on the diagonal
    estimated: BoolArray  # (n, n): which of these were estimated; the others are 0
    gaussian_sigmas: FloatArray  # (n,): width of the Gaussian nearest to each G, in m
    baselines: FloatArray  # (n,): in V
    noise: FloatArray  # (n, n): covariance of one reading of each, in V^2; common mode included
    k: FloatArray  # (nodes,): wavenumbers, in rad/m
    kernels: FloatArray  # (1, nodes) of all, or (n, nodes): transforms of G, 1 at k = 0
    modes: KernelModes
    # Parameters: ln A of each, x of each, y of each, each estimated c (row by row), each mode.
    root: FloatArray  # (p, c): of their covariance by what the scan leaves open
    effects: Mapping[str, FloatArray]  # (p,) each: of one standard uncertainty of a stated input
    film: ElasticFilm
    indenter: Rod
    load: float  # nominal, of the scan, in N
    readings: ArrayReadings
    kernel: str = "common"
    # (nodes,): transform of the stress that the array was calibrated with, per newton; without it
    # that of the rod on the film is calculated.
    reference: FloatArray | None = None
    baseline_uncertainties: FloatArray | None = None  # (n,): in V
    line_y: float = 0.0  # of a single line, which passes the sensors at this y, in m
    layout: FloatArray | None = None
    layout_uncertainty: float | None = None
    reading_low: FloatArray | None = None  # (n,): readings at or below it are no readings
    reading_high: FloatArray | None = None
    reading: Reading = VOLTS
    checks: tuple[QualityCheck, ...] = ()
    failing: Mapping[str, Sequence[str]] = field(default_factory=dict)  # sensors, by check
    process: Process
    load_cell: LoadCell = field(default_factory=LoadCell)
    stage: Equipment = field(default_factory=Equipment)
    user: User = field(default_factory=User)
    start_time: str = ""
    end_time: str = ""

    def stated(self) -> Values:
        """Return its fields by their names, without what follows from them."""
        return {name: getattr(self, name) for name in ArrayData.__dataclass_fields__}

    @property
    def messages(self) -> tuple[Message, ...]:
        """What the calibration says beside its checks."""
        return self.process.messages

    @property
    def pairs(self) -> IndexArray:
        """Rows and columns of the estimated crosstalk, in the order of the parameters, (q, 2)."""
        return np.argwhere(self.estimated)

    @property
    def on_a_line(self) -> bool:
        """Whether the scan was a single line, which tells no y."""
        return bool(np.isnan(self.centres[self.used, 1]).all())

    @property
    def places(self) -> FloatArray:
        """The centres with the y of the line where there is no other, (n, 2), in m."""
        unknown = np.isnan(self.centres) & self.used[:, None]
        return np.where(unknown, [0.0, self.line_y], self.centres)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the conversion constants by all sources, (n, n), in (V/Pa)^2."""
        n = len(self.sensors)
        columns = self.conversion_constants[:, None] * self.columns[:n]
        return np.asarray(columns @ columns.T)

    @cached_property
    def columns(self) -> FloatArray:
        """Root of the covariance of the parameters by all sources, (p, c)."""
        return np.column_stack([self.root, *self.effects.values()])

    def split(self, rows: FloatArray) -> list[FloatArray]:
        """Return rows of the parameters as those of ln A, of x, of y, of c and of the modes."""
        n = len(self.sensors)
        return np.split(rows, [n, 2 * n, 3 * n, 3 * n + len(self.pairs)])

    def uncertainties(self) -> FloatArray:
        """Standard uncertainty of each parameter by all sources, (p,)."""
        return np.asarray(np.linalg.norm(self.columns, axis=1))

    @property
    def centre_uncertainties(self) -> FloatArray:
        """Standard uncertainties of the centres, (n, 2), in m; NaN where a centre is not known."""
        errors = np.column_stack(self.split(self.uncertainties())[1:3])
        return np.where(np.isnan(self.centres), np.nan, errors)

    @property
    def crosstalk_uncertainties(self) -> FloatArray:
        """Standard uncertainties of the crosstalk, (n, n); 0 where a pair is not estimated."""
        errors = np.zeros_like(self.crosstalk)
        errors[self.estimated] = self.split(self.uncertainties())[3]
        return errors

    def radial(self, transforms: FloatArray, r: FloatArray) -> FloatArray:
        """Return what has the transforms (nodes,) or (nodes, m) at radii in m."""
        return hankel_transform(self.k, transforms, r) / (2 * np.pi) ** 2

    def distances(self, i: int) -> FloatArray:
        """Return how far the presses are from a sensor, (t,), in m: on a line, signed."""
        away = np.stack([self.readings.x, self.readings.y]) - self.places[i][:, None]
        return floats(away[0] if self.on_a_line else np.hypot(*away))

    def kernel_of(self, i: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a sensor's transform of G, its changes by modes, and the modes' root."""
        own = (self.modes.owner == ALL) | (self.modes.owner == i)
        kernel = self.kernels[i if len(self.kernels) > 1 else 0]
        return kernel, self.modes.changes[own], self.split(self.columns)[4][own]

    @property
    def sigma_columns(self) -> FloatArray:
        """Changes of the widths of the Gaussians nearest to each G, (n, c), in m."""
        # Of the nearest width, where Gaussian and G differ by little.
        area = self.k * np.gradient(self.k)
        changes = np.full((len(self.sensors), self.columns.shape[1]), np.nan)
        for i in np.flatnonzero(self.used).tolist():
            slope = gaussian_transfer_slope(self.k, self.gaussian_sigmas[i])
            _, by_mode, root = self.kernel_of(i)
            changes[i] = (by_mode @ (area * slope) / np.sum(area * slope**2)) @ root
        return changes
