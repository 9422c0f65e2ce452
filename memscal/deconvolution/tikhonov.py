"""Tikhonov regularisation of order zero."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from memscal.deconvolution.problem import (
    NOISE_RATIO,
    Division,
    DivisionProblem,
    filtered_division,
    require_amplitude,
)

__all__ = ["Tikhonov"]


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
