"""Quantities of memscal's records: each declared once by name, dimension, axes, words and symbol.

Files, tables, figures and reports take what they write from here and :mod:`memscal.model.records`.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import Axes, value_record
from memscal.model.notation import VOLTS, Reading, format_measured

# SI units in the unit that is shown: m in a mm, V in a mV, ...; dividing by MM shows mm.
MM = 1e-3
MV = 1e-3
KPA = 1e3
PER_MM = 1e3
PER_MM2 = 1e6


class Dimension(NamedTuple):
    """Units of a dimension: in Python, in files, and as shown, with the SI units in the last."""

    si: str
    stored: str
    shown: str
    scale: float = 1.0


DIMENSIONS = {
    "length": Dimension("m", "mm", "mm", MM),
    "voltage": Dimension("V", "mV", "mV", MV),
    "force": Dimension("N", "N", "N"),
    "stress": Dimension("Pa", "Pa", "kPa", KPA),
    "stress squared": Dimension("Pa^2", "Pa^2", "kPa²", KPA**2),
    "voltage per stress": Dimension("V/Pa", "mV/Pa", "mV/Pa", MV),
    "area": Dimension("m^2", "mm^2", "mm²", MM**2),
    "per area": Dimension("1/m^2", "1/mm^2", "1/mm²", PER_MM2),
    "per area squared": Dimension("1/m^4", "1/mm^4", "1/mm⁴", PER_MM2**2),
    "wavenumber": Dimension("rad/m", "rad/mm", "rad/mm", PER_MM),
    "voltage per length": Dimension("V/m", "mV/mm", "mV/mm", MV / MM),
    "dimensionless": Dimension("1", "1", ""),
    "angle": Dimension("rad", "rad", "rad"),
    "energy": Dimension("J", "J", "J"),
    "temperature": Dimension("K", "K", "K"),
    "time": Dimension("s", "s", "s"),
    "frequency": Dimension("Hz", "Hz", "Hz"),
    "speed": Dimension("m/s", "mm/s", "mm/s", MM),
    "stress per length": Dimension("Pa/m", "MPa/mm", "MPa/mm", 1e9),
}


def dimension_in(dimension: str, reading: Reading) -> str:
    """Return a dimension for readings in a unit, which is entered where they are not in volts."""
    if not dimension.startswith("voltage") or reading == VOLTS:
        return dimension
    si = reading.si
    shown = reading.unit
    scale = reading.scale
    if dimension == "voltage per length":
        si = f"{si}/m"
        shown = f"{shown}/mm"
        scale = scale / MM
    elif dimension == "voltage per stress":
        si = reading.over(si)
        shown = reading.over(shown)
    if si == "1":
        shown = "1"
        scale = 1.0
    si, stored = (name.removesuffix(" (relative)") for name in (si, shown))
    key = f"reading in {shown}"
    DIMENSIONS[key] = Dimension(si, stored, shown.removeprefix("1 ") if shown != "1" else "", scale)
    return key


# Units other than a dimension's own in which some quantities are shown, in SI units.
_OTHER_UNITS = {"um": 1e-6, "MPa": 1e6, "1/mm^2": PER_MM2, "percent": 1e-2}


@value_record
class Quantity:
    """A quantity of a record."""

    name: str  # of its attribute
    dimension: str  # a key of DIMENSIONS, or of memscal.formats.groups.KINDS, such as "text"
    words: str = ""
    symbol: str = ""
    axes: Axes = ()  # the quantities along which an array runs
    required: bool = False
    stored: str = ""  # the name in files where it is another
    shown: str = ""  # the unit where it is not its dimension's
    origin: str = ""  # the name among the origins of a file where it says where data come from
    label: str = ""  # the name in JSON and in data frames where it is another
    of: float | None = None  # of an uncertainty: the value that stands beside it in files

    @property
    def key(self) -> str:
        """Its name in files."""
        return self.stored or self.name

    @property
    def _units(self) -> Dimension:
        name = self.dimension
        return DIMENSIONS.get(name) or Dimension(name, name, name)

    @property
    def unit(self) -> str:
        """The unit in which it is shown; that of a number of unknown dimension is its dimension."""
        return self.shown or self._units.shown

    @property
    def unit_text(self) -> str:
        """The unit in ASCII, as JSON states it: ``1`` of a number without a unit."""
        return self.unit.replace("²", "^2").replace("⁴", "^4") or "1"

    @property
    def column(self) -> str:
        """The name of its column in a data frame: ``r (mm)``."""
        return self._with_unit(self.label or self.name)

    @property
    def heading(self) -> str:
        """Its words and unit over a column of a table."""
        return self._with_unit(self.words)

    def _with_unit(self, words: str) -> str:
        shown = self.unit if self.dimension in DIMENSIONS else ""
        return f"{words} ({shown})" if shown else words

    @property
    def si_unit(self) -> str:
        """The SI unit of its values in Python."""
        return self._units.si

    @property
    def scale(self) -> float:
        """How many SI units :attr:`unit` is; 1 of a count."""
        return _OTHER_UNITS.get(self.shown, 1.0) if self.shown else self._units.scale

    def read_in(self, reading: Reading) -> "Quantity":
        """Return the quantity for readings in a unit."""
        return replace(self, dimension=dimension_in(self.dimension, reading))


@value_record
class Record:
    """Quantities that stand together: a group of a file, of a NeXus class, with its signal."""

    nx_class: str
    quantities: tuple[Quantity, ...]
    signal: str = ""

    @property
    def axes(self) -> Axes:
        """Names of the axes of the signal."""
        return next((q.axes for q in self.quantities if q.key == self.signal), ())

    def read_in(self, reading: Reading) -> "Record":
        """Return the record for readings in a unit."""
        return replace(self, quantities=tuple(q.read_in(reading) for q in self.quantities))


def record(nx_class: str, *quantities: Quantity, signal: str = "") -> Record:
    """Return a record of quantities."""
    return Record(nx_class, quantities, signal)


def required(*quantities: Quantity) -> list[Quantity]:
    """Return quantities without which a file is refused."""
    return [replace(quantity, required=True) for quantity in quantities]


def along(axes: Axes, *quantities: Quantity) -> list[Quantity]:
    """Return quantities as arrays that run along the same axes."""
    return [replace(quantity, axes=axes) for quantity in quantities]


def measured(quantity: Quantity) -> tuple[Quantity, Quantity]:
    """Return a number and its standard uncertainty, ``NAME_errors`` in files."""
    spread = replace(
        quantity,
        name=f"{quantity.name}_uncertainty",
        stored=f"{quantity.key}_errors",
        words=f"standard uncertainty of the {quantity.words}",
        symbol="",
        required=False,
        label=f"u({quantity.label or quantity.name})",
    )
    return quantity, spread


def by_name(quantities: Iterable[Quantity]) -> dict[str, Quantity]:
    """Return quantities by their names."""
    return {quantity.name: quantity for quantity in quantities}


_A = "voltage per stress"
_L = "length"
_U = "voltage"
_ONE = "dimensionless"

ESTIMATED = by_name(
    (
        Quantity("conversion_constant", _A, "conversion constant", "A"),
        Quantity("gaussian_sigma", _L, "Gaussian width, fitted to the scan", "σ"),
        Quantity(
            "gaussian_sigma_deconvolved", _L, "Gaussian width, fitted to the deconvolved G", "σ(G)"
        ),
        Quantity("fwhm", _L, "full width of G at half maximum", "FWHM"),
        Quantity("noise_equivalent_area", "area", "noise-equivalent area of G"),
        Quantity("ellipticity", _ONE, "ellipticity of the Gaussian along x", "e₁"),
        Quantity(
            "ellipticity_diagonal", _ONE, "ellipticity of the Gaussian along the diagonal", "e₂"
        ),
        Quantity("centre", _L, "centre of the scan", "x₀"),
        Quantity("centre_y", _L, "centre of the scan along y", "y₀"),
        Quantity("baseline", _U, "baseline", "U₀"),
        Quantity("baseline_curvature", _U, "curvature of the baseline, edge to centre"),
        Quantity("baseline_slope", "voltage per length", "baseline slope"),
        Quantity("drift", _U, "drift of the baseline across the scan", "ΔU"),
        Quantity("drift_y", _U, "drift of the baseline along y", "ΔU"),
        Quantity("conversion_constant_gaussian", _A, "conversion constant with the Gaussian", "A"),
        Quantity("force", "force", "force", "P"),
        Quantity("maximum", "stress", "largest stress", "S"),
    )
)
"""What a calibration or a measurement estimates: parameters of an artifact, rows of a budget."""

TRUTH = ESTIMATED | by_name(
    (
        Quantity("gaussian_sigma", _L, "Gaussian width", "σ"),
        Quantity("noise", _U, "noise"),
        Quantity("young_modulus", "stress", "Young's modulus of the film", "E", shown="MPa"),
        Quantity("poisson_ratio", _ONE, "Poisson's ratio of the film", "ν"),
        Quantity("thickness", _L, "thickness of the film", "h"),
        Quantity("indenter_radius", _L, "radius of the indenter", "R"),
        Quantity("load", "force", "true load", "P"),
        Quantity("friction", _ONE, "friction coefficient", "μ"),
        Quantity("rod_friction", _ONE, "friction of the rod"),
        Quantity("mooney_rivlin_ratio", _ONE, "C2/C1 of the film"),
        Quantity("slip_length", _L, "slip length", shown="um"),
        Quantity("roughness", _L, "rms height of the asperities", shown="um"),
        Quantity("asperity_density", "per area", "asperities", shown="1/mm^2"),
        Quantity("asperity_radius", _L, "radius of their tips", shown="um"),
        Quantity("decay_length", _L, "decay length of the pressure", shown="um"),
        Quantity("reference_pressure", "stress", "pressure where mean planes meet", shown="MPa"),
        Quantity("load_scale", _ONE, "true loads over the stated"),
        Quantity("load_scatter", _ONE, "scatter of the loads", shown="percent"),
        Quantity("position_error", _L, "scatter of the positions", shown="um"),
        Quantity("gain", _ONE, "gain against the rod scan"),
        Quantity("crosstalk", _ONE, "crosstalk of neighbours"),
        Quantity("seed", _ONE, "seed"),
    )
)
"""The truth of a simulated experiment: what is estimated, film and indenter, what went wrong."""


def name_and_scan(name: str) -> tuple[str, str]:
    """Return a parameter's name without the number of its scan, and that number if it has one."""
    start, _, number = name.rpartition("_")
    return (start, number) if start in ESTIMATED and number.isdigit() else (name, "")


def dimension_with(si_unit: str, reading: Reading) -> str:
    """Return the dimension of numbers in an SI unit, which may be that of the readings."""
    if si_unit == reading.si:
        return dimension_in("voltage", reading)
    return next((name for name, units in DIMENSIONS.items() if units.si == si_unit), si_unit)


def estimated_quantity(name: str, si_unit: str = "", reading: Reading = VOLTS) -> Quantity:
    """Return how an estimated parameter is shown; one that is not known keeps its name."""
    start, scan = name_and_scan(name)
    declared = ESTIMATED.get(start) or Quantity(name, "SI units", name.replace("_", " "))
    if scan:
        declared = replace(declared, name=name, words=f"{declared.words}, scan {scan}")
    if not si_unit:
        return declared
    dimension = dimension_with(si_unit, reading)
    return declared if dimension == declared.dimension else replace(declared, dimension=dimension)


def parameter_quantity(parameters: ParameterSet, name: str) -> Quantity:
    """Return how one of a set's parameters is shown, by its stated unit where there is one."""
    declared = estimated_quantity(name)
    reading = parameters.reading
    if not parameters.units or (reading != VOLTS and declared.dimension in DIMENSIONS):
        return declared.read_in(reading)
    return estimated_quantity(name, parameters.units[parameters.names.index(name)], reading)


def measured_text(parameters: ParameterSet, name: str, coverage: float = 1.0) -> str:
    """Return one parameter as text with its uncertainty, k times the standard one, and unit."""
    shown = parameter_quantity(parameters, name)
    uncertainty = coverage * parameters.uncertainty(name)
    return format_measured(parameters[name] / shown.scale, uncertainty / shown.scale, shown.unit)
