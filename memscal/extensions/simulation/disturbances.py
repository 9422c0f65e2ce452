"""What disturbs a simulated scan, in one record for rod scans and contacts alike."""

import math

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.model.arrays import (
    FloatArray,
    keyword_value_record,
    require_non_negative,
    require_positive,
    require_range,
)

# Beyond this scatter of the loads a parabola in ln P is no longer good to 1e-3.
_MOST_SCATTER = 0.1


@keyword_value_record
class Disturbances:
    """What keeps a simulated scan from being ideal, and what the scan states of it.

    A rod scan (:func:`memscal.simulate`) meets those of the first two groups; an experiment
    (:func:`memscal.simulate_experiment`) meets all.

    Parameters
    ----------
    noise, baseline, drift : float
        Standard deviation of the noise, offset, and change of the offset across the scan, each
        as a share of the scan's largest signal.
    centre : tuple of float
        Position of the sensor, in m.
    load_uncertainty : float, optional
        Relative standard uncertainty that a scan states for its load: of the common error of the
        rod's load, and of that of all loads of the sphere.
    state_noise, state_law : bool
        Whether the scans state their noise (``u_zz_errors``), and the film's law with the rod's
        friction.
    load_scatter, record_loads, load_reading, position_error : float, bool, float, float
        Of each contact of the sphere: relative standard deviation of its load; whether that load
        is recorded in place of the nominal one, and the relative standard deviation of its
        reading; standard deviation of its position in m.
    draw_inputs : bool
        Draw the true values from the stated uncertainties: modulus, Poisson's ratio
        (reflected at 0.5) and thickness of the film, the radii, and the common errors of the
        rod's and of the sphere's loads.  The files state the nominal values.  Without it, the true
        values are those, and the mean of a Poisson's ratio.
    one_load_cell : bool
        Whether the loads of rod and sphere have one common error, and all scans name its load
        cell; else the two errors are independent.
    gain, thickness_factor : float
        Mistakes: factor on the voltages of the sphere's scans only, and the film's true thickness
        relative to the stated one.

    Raises
    ------
    InputError
        If a number is out of range.

    Examples
    --------
    >>> import memscal
    >>> quiet = Disturbances(noise=0.001, drift=0.0)
    >>> scan = memscal.simulate(disturbances=quiet, seed=1)
    >>> bool(scan.u_zz_errors.max() < 0.0011 * scan.u_zz.max())
    True
    """

    noise: float = 0.005
    baseline: float = 0.01
    drift: float = 0.005
    centre: tuple[float, float] = (0.14e-3, 0.0)
    load_uncertainty: float | None = 0.01
    state_noise: bool = True
    state_law: bool = True
    load_scatter: float = 0.02
    record_loads: bool = False
    load_reading: float = 0.002
    position_error: float = 10e-6
    draw_inputs: bool = False
    one_load_cell: bool = False
    gain: float = 1.0
    thickness_factor: float = 1.0

    def __post_init__(self) -> None:
        require_non_negative("noise", self.noise)
        require_non_negative("relative standard uncertainty of the load", self.load_uncertainty)
        require_range("load_scatter", self.load_scatter, 0.0, _MOST_SCATTER)
        require_range("load_reading", self.load_reading, 0.0, _MOST_SCATTER)
        require_non_negative("position_error", self.position_error)
        require_positive("gain", self.gain)
        require_positive("thickness_factor", self.thickness_factor)
        if not all(map(math.isfinite, (*self.centre, self.baseline, self.drift))):
            raise InputError(
                f"The centre is {self.centre} m, the offset {self.baseline:g} and the drift "
                f"{self.drift:g} of the largest signal; they must be finite."
            )

    def level(self, x: FloatArray) -> FloatArray:
        """Return offset and drift at positions (m), as a share of the largest signal."""
        half_range = 0.5 * np.ptp(x)
        middle = 0.5 * (x.min() + x.max())
        return np.asarray(self.baseline + 0.5 * self.drift * (x - middle) / half_range)

    def in_volts(self, largest: float) -> dict[str, float]:
        """Return offset, drift and noise in V, by the names of a truth."""
        return {name: getattr(self, name) * largest for name in ("baseline", "drift", "noise")}


TYPICAL = Disturbances()

Shear = tuple[RadialKernel, float] | None
"""Apparatus function and conversion constant (V/Pa) of the tangential channel along x."""
