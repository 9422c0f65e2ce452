"""What every regulariser is given, and what it gives back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from memscal.axisymmetry.grids import FieldGrid
from memscal.errors import InputError
from memscal.model.validation import FloatArray

__all__ = [
    "Division",
    "DivisionProblem",
    "Regulariser",
    "filtered_division",
    "image_division",
    "require_amplitude",
    "require_count",
]

#: The paper adds white noise "ten times weaker than the weakest relevant spectral component".
NOISE_RATIO = 0.1


@dataclass(frozen=True, eq=False)
class DivisionProblem:
    r"""The two fields of the paper's Eq. (2), and how far their spectra can be believed.

    Parameters
    ----------
    grid : FieldGrid
        Where the fields live.
    voltage : ndarray
        Lifted voltage per newton, in V/N.
    reference : ndarray
        Lifted base stress per newton, in 1/m^2.
    weakest_voltage, weakest_reference : float
        Moduli of the weakest relevant spectral components: the fields' transforms where the
        voltage's stands ten times above its noise, in V m^2/N and 1.
    """

    grid: FieldGrid
    voltage: FloatArray
    reference: FloatArray
    weakest_voltage: float
    weakest_reference: float


@dataclass(frozen=True, eq=False)
class Division:
    """The quotient of the fields.

    Parameters
    ----------
    field : ndarray
        A G on the grid, in V/Pa/m^2.
    window : ndarray
        What the regularisation leaves of each spectral component, from 0 to 1.
    """

    field: FloatArray
    window: FloatArray


class Regulariser(Protocol):
    """A way to divide fields whose transforms vanish.

    Any object with these members will do; register a class, called without arguments, or
    with ``seed=`` if it ``uses_seed``, under the entry point group ``memscal.regularisers``.
    """

    name: ClassVar[str]
    assumes: ClassVar[str]
    fails: ClassVar[str]

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide the voltage field by the stress field."""
        ...


def require_amplitude(method: str, amplitude: object) -> None:
    """Refuse a noise amplitude that is no positive number."""
    if not isinstance(amplitude, int | float) or not 0 < amplitude < math.inf:
        raise InputError(
            f"The amplitude of method {method} is {amplitude}, but it must be a positive number.",
            cure="It is a factor on the rule's own choice: 1 keeps that, 2 doubles the noise.",
        )


def require_count(method: str, name: str, value: object, least: int) -> None:
    """Refuse an option that is no whole number from ``least`` on."""
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InputError(
            f"Option {name} of method {method} is {value}, but it must be a whole number of at "
            f"least {least}."
        )


def filtered_division(problem: DivisionProblem, window: FloatArray) -> Division:
    """Divide the spectra wherever the window is open.

    Components whose window is below 1e-9 are left out: there the quotient of two
    transforms that have both vanished is rounding, not information.
    """
    grid = problem.grid
    voltage, reference = grid.forward(problem.voltage), grid.forward(problem.reference)
    open_ = window > 1e-9
    quotient = np.zeros_like(voltage)
    np.divide(voltage, reference, out=quotient, where=open_)
    return Division(grid.inverse(quotient * np.where(open_, window, 0.0)), window)


def image_division(problem: DivisionProblem, image: FloatArray) -> Division:
    """Wrap an image that an image-restoration routine made, with its effective window."""
    grid = problem.grid
    field = grid.from_image(image)
    voltage, reference = grid.forward(problem.voltage), grid.forward(problem.reference)
    kept = np.abs(grid.transfer(field)) * np.abs(reference)
    window = np.divide(kept, np.abs(voltage), out=np.zeros_like(kept), where=np.abs(voltage) > 0)
    return Division(field, np.clip(window, 0.0, 1.0))
