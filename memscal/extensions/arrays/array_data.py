r"""A calibrated array of sensors under one film.

Sensor i reads, of a rod at r with the load P,

.. math::

    u_i = b_i + \sum_j C_{ij} A_j P\,f_j(r - c_j), \qquad
    f_j(R) = \frac{1}{2\pi}\int \hat G_j(k)\,\hat\sigma(k)\,J_0(kR)\,k\,dk,

with :math:`C_{ii} = 1`: only the products :math:`C_{ij} A_j` are observed, and that is a
convention.  A uniform pressure p reads :math:`p \sum_j C_{ij} A_j`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

import numpy as np

from memscal.model.arrays import (
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    keyword_array_record,
)
from memscal.model.checks import Checked, QualityCheck
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.notation import VOLTS, Reading
from memscal.model.provenance import Process

#: Owner of a mode that changes the kernels of all sensors.
ALL = -1


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
    line_y: float = 0.0  # of a single line, which passes the sensors at this y, in m
    layout: FloatArray | None = None
    layout_uncertainty: float | None = None
    reading_low: FloatArray | None = None  # (n,): readings at or below it are no readings
    reading_high: FloatArray | None = None
    reading: Reading = VOLTS
    checks: tuple[QualityCheck, ...] = ()
    failing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # sensors, by check
    process: Process

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
        columns = np.column_stack([self.root, *self.effects.values()])[:n]
        columns = self.conversion_constants[:, None] * columns
        return np.asarray(columns @ columns.T)

    def uncertainties(self) -> FloatArray:
        """Standard uncertainty of each parameter by all sources, (p,)."""
        columns = np.column_stack([self.root, *self.effects.values()])
        return np.sqrt(np.sum(columns**2, axis=1))
