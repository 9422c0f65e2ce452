"""The unit in which each estimated quantity is shown, and its name in words."""

from __future__ import annotations

from dataclasses import dataclass

from memscal.estimation.channels import TANGENTIAL
from memscal.model.apparatus import ApparatusData, ParameterSet
from memscal.model.notation import format_measured

__all__ = [
    "KPA",
    "MM",
    "MV",
    "PER_MM",
    "PER_MM2",
    "Quantity",
    "channel_indices",
    "measured_text",
    "quantity",
    "shown_quantity",
]

MM = 1e-3
"""Metres in a millimetre; dividing by it shows a length in mm."""
MV = 1e-3
"""Volts in a millivolt."""
KPA = 1e3
"""Pascals in a kilopascal."""
PER_MM = 1e3
"""rad/m in a rad/mm."""
PER_MM2 = 1e6
"""1/m^2 in a 1/mm^2."""


@dataclass(frozen=True)
class Quantity:
    """How a parameter is shown: in words, as a symbol, in which unit of how many SI units."""

    words: str
    symbol: str
    unit: str
    scale: float


# Words, symbol, and the SI unit, by the name in the artifact.
_KNOWN = {
    "conversion_constant": ("conversion constant", "A", "V/Pa"),
    "gaussian_sigma": ("Gaussian width, fitted to the scan", "σ", "m"),
    "gaussian_sigma_deconvolved": ("Gaussian width, fitted to the deconvolved G", "σ(G)", "m"),
    "fwhm": ("full width of G at half maximum", "FWHM", "m"),
    "noise_equivalent_area": ("noise-equivalent area of G", "", "m^2"),
    "ellipticity": ("ellipticity of the Gaussian along x", "e₁", ""),
    "ellipticity_diagonal": ("ellipticity of the Gaussian along the diagonal", "e₂", ""),
    "centre": ("centre of the scan", "x₀", "m"),
    "centre_y": ("centre of the scan along y", "y₀", "m"),
    "baseline": ("baseline", "U₀", "V"),
    "drift": ("drift of the baseline across the scan", "ΔU", "V"),
    "drift_y": ("drift of the baseline along y", "ΔU", "V"),
    "conversion_constant_gaussian": ("conversion constant with the Gaussian", "A", "V/Pa"),
}

# The unit that is shown for an SI unit, and how many of the latter it is.
_SHOWN_UNITS = {
    "V/Pa": ("mV/Pa", MV),
    "m": ("mm", MM),
    "m^2": ("mm²", MM**2),
    "V": ("mV", MV),
    "V/m": ("mV/mm", MV / MM),
    "Pa": ("kPa", KPA),
}


def quantity(name: str, si_unit: str = "") -> Quantity:
    """Return how a parameter is shown; one that is not known keeps its name.

    A number at the end of a known name says which scan it belongs to.

    Examples
    --------
    >>> quantity("centre").unit
    'mm'
    >>> quantity("baseline_slope", "V/m")
    Quantity(words='baseline slope', symbol='', unit='mV/mm', scale=1.0)
    """
    known, _, number = name.rpartition("_")
    if known in _KNOWN and number.isdigit():
        words, symbol, usual = _KNOWN[known]
        words = f"{words}, scan {number}"
    else:
        words, symbol, usual = _KNOWN.get(name, (name.replace("_", " "), "", "SI units"))
    si_unit = si_unit or usual
    unit, scale = _SHOWN_UNITS.get(si_unit, (si_unit, 1.0))
    return Quantity(words, symbol, unit, scale)


def shown_quantity(parameters: ParameterSet, name: str) -> Quantity:
    """Return how one of a set's parameters is shown, by its stated unit where there is one."""
    if not parameters.units:
        return quantity(name)
    return quantity(name, parameters.units[parameters.names.index(name)])


def measured_text(parameters: ParameterSet, name: str) -> str:
    """Return one parameter as text with its standard uncertainty and unit.

    Examples
    --------
    >>> import numpy as np
    >>> p = ParameterSet(("gaussian_sigma",), np.array([5.612e-4]), np.array([[1.2e-11]]))
    >>> measured_text(p, "gaussian_sigma")
    '(0.5612 ± 0.0035) mm'
    """
    shown = shown_quantity(parameters, name)
    uncertainty = parameters.uncertainty(name)
    return format_measured(parameters[name] / shown.scale, uncertainty / shown.scale, shown.unit)


def channel_indices(data: ApparatusData) -> str:
    """Return the indices of the stress that a sensor's channel measures: zz, xz or yz."""
    return data.sensor.channel if data.sensor.channel in TANGENTIAL else "zz"
