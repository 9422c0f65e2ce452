"""Plan of a line scan: film, rod, load, positions, repeats and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.errors import InputError
from memscal.mechanics.press_rod import press_rod
from memscal.model.arrays import require_non_negative, require_positive
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.scan import Scan
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD, simulate

#: As many as a simulated scan may have.
MOST_POSITIONS = 4096
#: A range that is a whole number of steps but for rounding is one.
_ROUNDING = 1e-6
#: The film passes nothing beyond exp(-kh) of this.
_LARGEST_KH = 20.0


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A line scan to be made; the attributes are the arguments of :func:`memscal.design`.

    ``load_uncertainty`` and ``noise`` are relative, to the load and to the signal with the rod
    right above the sensor; ``noise_voltage`` (V) replaces ``noise``.  Positions run from minus to
    plus ``half_range``, or to the last whole step within.
    """

    film: ElasticFilm = PAPER_FILM
    rod: Rod = PAPER_ROD
    kernel: RadialKernel = field(default_factory=GaussianMixture)
    conversion_constant: float = 1e-7
    load: float = 1.0
    load_uncertainty: float | None = 0.01
    step: float = 0.25e-3
    half_range: float = 8e-3
    repeats: int = 1
    noise: float = 0.005
    noise_voltage: float | None = None
    centre: float = 0.0

    def __post_init__(self) -> None:
        require_positive("step of the scan", self.step, "m")
        require_positive("half range of the scan", self.half_range, "m")
        require_positive("load", self.load, "N")
        require_positive("conversion constant", self.conversion_constant, "V/Pa")
        if self.load_uncertainty is not None:
            require_non_negative("relative standard uncertainty of the load", self.load_uncertainty)
        if self.repeats < 1 or self.repeats != int(self.repeats):
            raise InputError(
                f"The scan would be repeated {self.repeats} times.",
                cure="Give a whole number of repeats, one or more.",
            )
        noise = self.noise if self.noise_voltage is None else self.noise_voltage
        if not 0 < noise < math.inf:
            raise InputError(
                f"The noise of the planned scan is {noise:g}.",
                why="Without noise there is no uncertainty to expect, and no scan is without.",
                cure="Give its standard deviation: a share of the largest signal (0.005: half a "
                "percent), or a voltage; measure it with the rod at rest.",
            )
        if not abs(self.centre) <= self.half_range:
            raise InputError(
                f"The scan would reach {self.half_range * 1e3:.4g} mm to either side, but the "
                f"sensor is expected at {self.centre * 1e3:.4g} mm.",
                why="A sensor that is not passed over is not calibrated.",
                cure="Scan farther, or about the sensor.",
            )
        if self.positions > MOST_POSITIONS:
            raise InputError(
                f"A step of {self.step * 1e3:.4g} mm over {self.half_range * 1e3:.4g} mm to either "
                f"side makes {self.positions} positions; at most {MOST_POSITIONS} are planned.",
                cure="Give the step and the half range in metres (mm on the command line).",
            )

    @property
    def positions(self) -> int:
        """How many positions the line has."""
        return math.floor(2 * self.half_range / self.step * (1 + _ROUNDING)) + 1

    @property
    def signal(self) -> float:
        """Voltage to expect with the rod right above the sensor, in V."""
        wavenumbers = Wavenumbers.covering(_LARGEST_KH / self.film.thickness, self.film.thickness)
        contact = press_rod(self.film, self.rod, self.load)
        spectrum = contact.base_spectrum(wavenumbers.k) * self.kernel.transform(wavenumbers.k)
        peak = RadialSpectrum(wavenumbers, spectrum).at(np.zeros(1))[0]
        return float(self.conversion_constant * peak)

    @property
    def point_noise(self) -> float:
        """Standard deviation of one voltage, in V."""
        return self.noise * self.signal if self.noise_voltage is None else self.noise_voltage

    def scan(self) -> Scan:
        """Return the expected mean of all repeats: without noise, whose size is stated."""
        count = self.positions
        scan = simulate(
            film=self.film,
            rod=self.rod,
            kernel=self.kernel,
            conversion_constant=self.conversion_constant,
            load=self.load,
            load_uncertainty=self.load_uncertainty,
            half_range=self.step * (count - 1) / 2,
            points=count,
            noise=0.0,
            centre=(self.centre, 0.0),
            baseline=0.0,
            drift=0.0,
        )
        noise = self.point_noise / math.sqrt(self.repeats)
        return replace(scan, title="Planned rod scan", u_zz_errors=np.full(count, noise))
