r"""The paper's white-noise method: a seeded draw, and its exact expectation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.fft

from memscal.deconvolution.division import (
    NOISE_RATIO,
    Division,
    DivisionProblem,
    filtered_division,
    require_amplitude,
    require_count,
)

__all__ = ["Tikhonov", "WhiteNoise", "WhiteNoiseDraw"]


@dataclass(frozen=True, kw_only=True)
class Tikhonov:
    r"""Minimiser of :math:`|\hat\sigma \hat g - \hat u|^2 + \alpha |\hat g|^2`.

    Its window :math:`|\hat\sigma|^2 / (|\hat\sigma|^2 + \alpha)` closes more slowly than
    the white noise's, at the same place: :math:`\sqrt\alpha` is the paper's noise amplitude.

    Parameters
    ----------
    amplitude : float
        Square root of alpha, in units of a tenth of the weakest relevant component.
    """

    amplitude: float = 1.0
    name: ClassVar[str] = "tikhonov"
    assumes: ClassVar[str] = "G has little power; all wavenumbers are equally likely to carry it."
    fails: ClassVar[str] = "Every component is a little too small, the peak of G with them."

    def __post_init__(self) -> None:
        require_amplitude(self.name, self.amplitude)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide with the Tikhonov window."""
        alpha = (self.amplitude * NOISE_RATIO * problem.weakest_reference) ** 2
        power = np.abs(problem.reference_spectrum) ** 2
        return filtered_division(problem, power / (power + alpha))


@dataclass(frozen=True, kw_only=True)
class WhiteNoise:
    r"""Expectation of the paper's method over all draws of its noise.

    White noise added to both fields leaves the numerator's mean as it is and turns the
    denominator's reciprocal, for circular complex noise of variance :math:`s^2`, into
    :math:`E[1/(z + n)] = (1 - \exp(-|z|^2/s^2))/z`: a smooth spectral window.

    Parameters
    ----------
    amplitude : float
        Noise amplitude, in units of the paper's: a tenth of the weakest relevant component.
    """

    amplitude: float = 1.0
    name: ClassVar[str] = "white-noise"
    assumes: ClassVar[str] = (
        "G is negligible beyond the wavenumber where the voltage sinks into its noise."
    )
    fails: ClassVar[str] = (
        "A G with fine detail (sharp edges, a narrow ring) is smoothed to the resolved band."
    )

    def __post_init__(self) -> None:
        require_amplitude(self.name, self.amplitude)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide with the expected window."""
        s = self.amplitude * NOISE_RATIO * problem.weakest_reference
        window = -np.expm1(-((np.abs(problem.reference_spectrum) / s) ** 2))
        return filtered_division(problem, window)


@dataclass(frozen=True, kw_only=True)
class WhiteNoiseDraw:
    """One seeded draw of the paper's method, as published.

    White noise is added to both fields before the transform.  The quotient of two
    components lost in noise has no finite variance: single draws carry rare, large ripples.

    Parameters
    ----------
    amplitude : float
        Noise amplitude, in units of the paper's.
    seed : int
        Seed of the noise.
    """

    amplitude: float = 1.0
    seed: int = 0
    name: ClassVar[str] = "white-noise-draw"
    assumes: ClassVar[str] = WhiteNoise.assumes
    fails: ClassVar[str] = "Draws are heavy-tailed: some carry ripples that others do not."

    def __post_init__(self) -> None:
        require_amplitude(self.name, self.amplitude)
        require_count(self.name, "seed", self.seed, 0)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide one draw; the window is that of its expectation."""
        grid = problem.grid
        rng = np.random.default_rng(self.seed)
        numerator = grid.to_period(problem.voltage)
        denominator = grid.to_period(problem.reference)
        # Noise of spectral amplitude s has, per pixel, s / (cell area * sqrt(pixels)).
        per_pixel = self.amplitude * NOISE_RATIO / (grid.cell_area * np.sqrt(numerator.size))
        noisy_u = numerator + rng.normal(0, per_pixel * problem.weakest_voltage, numerator.shape)
        noisy_s = denominator + rng.normal(
            0, per_pixel * problem.weakest_reference, denominator.shape
        )
        quotient = scipy.fft.rfft2(noisy_u) / scipy.fft.rfft2(noisy_s)
        period = scipy.fft.irfft2(quotient, s=numerator.shape) / grid.cell_area
        expected = WhiteNoise(amplitude=self.amplitude).divide(problem)
        return Division(grid.from_quotient(period), expected.window)
