"""Units, converted here and nowhere else: SI inside Python, any right unit in files.

Canonical units are powers of ten, so that 0.25 mm is exactly 0.25e-3; others are left to pint.
"""

import functools
import math
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import UnitError
from memscal.model.arrays import FloatArray, floats
from memscal.model.notation import NAMED_UNITS, Reading
from memscal.model.quantities import DIMENSIONS

#: Words for readings in a unit of their own.
ARBITRARY = (
    "a.u.",
    "a.u",
    "arb",
    "arb.",
    "arb. units",
    "arbitrary",
    "adu",
    "ADU",
    "lsb",
    "LSB",
    "digits",
)
# Canonical units of each dimension beside the SI unit, with the power of ten that takes them to it;
# the micro sign and the Greek mu are two characters.
_POWERS = {
    "length": {"cm": -2, "mm": -3, "um": -6, "µm": -6, "μm": -6, "nm": -9},
    "voltage": {"mV": -3, "uV": -6, "µV": -6, "μV": -6},
    "force": {"kN": 3, "mN": -3, "uN": -6},
    "stress": {"kPa": 3, "MPa": 6, "GPa": 9},
    "stress squared": {"kPa^2": 6},
    "voltage per stress": {"mV/Pa": -3, "V/MPa": -6, "mV/kPa": -6, "mV/MPa": -9},
    "area": {"mm^2": -6, "um^2": -12},
    "per area": {"1/mm^2": 6},
    "per area squared": {"1/mm^4": 12},
    "wavenumber": {"rad/mm": 3, "1/m": 0, "1/mm": 3},
    "voltage per length": {"mV/mm": 0},
    "time": {"ms": -3},
    "stress per length": {"MPa/mm": 9},
    "dimensionless": dict.fromkeys(("", *ARBITRARY), 0),
}
_CANONICAL: dict[str, tuple[str, int]] = {}
for _dimension, _of in DIMENSIONS.items():
    _units = {_of.si: 0, **_POWERS.get(_dimension, {})}
    _CANONICAL |= {unit: (_dimension, power) for unit, power in _units.items()}

# What pint may be asked: names, products and small powers.  Arithmetic such as 9**9**9 is a
# way to hang a program from inside a file.
# Units of print and of land are other words in a head: pixels and points of a scan, R of a lock-in.
_WORD = (
    r"(?!(?:px|points?|picas?|hands?|li|links?|rods?|chains?|poles?|R|m?U)\b)"
    r"(?:[A-Za-zµμ°%][A-Za-z0-9_µμ°%]*|1)"
)
_FACTOR = rf"{_WORD}(?:\s*(?:\*\*|\^)\s*\(?-?[0-9](?:\.5)?\)?)?"
_UNIT = re.compile(rf"\s*\(?{_FACTOR}(?:\s*[*/·.]\s*\(?{_FACTOR}\)?|\s+{_FACTOR})*\)?\s*")
_MAX_LENGTH = 64
#: What to do where there is no unit that is known.
_NONE = {
    "reading": " A reading in a unit of its own has the unit 1.",
    "length": " Of counts of unknown size take any, and --reference point: lengths are in it.",
}


def to_si(values: ArrayLike, unit: str | None, dimension: str, where: str) -> FloatArray:
    """Convert values from a file's unit to SI; only a dimensionless quantity may have no unit."""
    numbers = floats(values)
    if unit is None:
        if dimension == "dimensionless":
            return numbers
        raise UnitError(
            f"{where} has no unit.",
            why=f"Its dimension is {dimension}, and a bare number could be in any unit.",
            cure=f'Add an attribute units, such as "{DIMENSIONS[dimension].stored}".',
        )
    power = _power(unit.strip(), dimension)
    if power is not None:
        return _scaled(numbers, power)
    if unit.strip() in _CANONICAL:
        raise _wrong_dimension(where, unit, dimension)
    with np.errstate(over="ignore"):  # what is infinite then is refused by who knows its place
        return np.asarray(numbers * _pint_factor(unit, dimension, where))


def from_si(values: ArrayLike, dimension: str) -> tuple[FloatArray, str]:
    """Convert SI values to the unit that our files use; return them with that unit."""
    unit = DIMENSIONS[dimension].stored
    return _scaled(floats(values), -(_power(unit, dimension) or 0)), unit


def _power(unit: str, dimension: str) -> int | None:
    """Return the power of ten that takes a unit of a dimension to SI, where it is known."""
    of, power = _CANONICAL.get(unit, ("", 0))
    units = DIMENSIONS[dimension]
    if of and DIMENSIONS[of].si == units.si:
        return power
    # Units of readings are entered among the dimensions by what they are stored in.
    return round(math.log10(units.scale)) if unit == units.stored and not of else None


def reading_of(unit: str, where: str) -> Reading:
    """Return the unit of readings in any unit: one that has a name, base units, or 1."""
    if unit.strip() in _CANONICAL:
        dimension, power = _CANONICAL[unit.strip()]
        return Reading.fitting(DIMENSIONS[dimension].si, 10.0**power)
    quantity = _pint_quantity(unit, "reading", where)
    base = quantity.to_base_units()
    if not base.dimensionality:
        return Reading.fitting("1")
    named = (name for name in NAMED_UNITS if quantity.is_compatible_with(name))
    si = next(named, f"{base.units:~C}".replace("**", "^"))
    return Reading.fitting(si, float(quantity.to(si).magnitude))


def is_common_unit(text: str) -> bool:
    """Whether a text is one of the units that need no look-up."""
    return text != "" and text in _CANONICAL


def is_unit(text: str) -> bool:
    """Whether a text is a unit that can be worked with."""
    try:
        return is_common_unit(text.strip()) or _pint_quantity(text, "unit", "") is not None
    except UnitError:
        return False


def same_unit(first: str, second: str) -> bool:
    """Whether two units are the same one, however they are written."""
    known = [_CANONICAL.get(unit.strip()) for unit in (first, second)]
    if None not in known:
        return len({(DIMENSIONS[of].si, power) for of, power in filter(None, known)}) == 1
    try:
        one, other = (_pint_quantity(unit, "unit", "") for unit in (first, second))
    except UnitError:
        return False
    alike = one.is_compatible_with(other)
    return bool(alike and math.isclose(one.to(other.units).magnitude, 1.0, rel_tol=1e-9))


def dimension_of(unit: str, where: str) -> str:
    """Return the dimension of a unit whose quantity is not known beforehand."""
    if unit.strip() in _CANONICAL:
        return _CANONICAL[unit.strip()][0]
    for dimension, units in DIMENSIONS.items():
        if units.stored == unit:
            return dimension
    for dimension in DIMENSIONS:
        try:
            _pint_factor(unit, dimension, where)
        except UnitError:
            continue
        return dimension
    problem = f'{where} has the unit "{_shown(unit)}", which memscal does not work with.'
    cure = "Use one of: " + ", ".join(u for u in _CANONICAL if u.isascii() and u) + "."
    raise UnitError(problem, cure=cure)


def _scaled(numbers: FloatArray, power: int) -> FloatArray:
    """Multiply by a power of ten; dividing by 10^n rounds once, multiplying by 10^-n twice."""
    if power == 0:
        return numbers
    with np.errstate(over="ignore"):  # an absurd number becomes infinite, and is refused as such
        return np.asarray(numbers * 10.0**power if power >= 0 else numbers / 10.0**-power)


def _pint_factor(unit: str, dimension: str, where: str) -> float:
    import pint

    try:
        quantity = _pint_quantity(unit, dimension, where)
        si = DIMENSIONS[dimension].si
        return float(quantity.to("dimensionless" if si == "1" else si).magnitude)
    except pint.DimensionalityError as error:
        raise _wrong_dimension(where, unit, dimension) from error


def _pint_quantity(unit: str, dimension: str, where: str) -> Any:
    """Return one of a unit, which pint must know, and whose zero is that of the SI unit."""
    cure = f'Write it like "{DIMENSIONS.get(dimension, DIMENSIONS["voltage"]).stored}".'
    cure += _NONE.get(dimension, "")
    if len(unit) > _MAX_LENGTH or not _UNIT.fullmatch(unit):
        raise UnitError(
            f'{where} has the unit "{_shown(unit)}", which is not a unit that can be read.',
            cure=cure,
        )
    try:
        quantity = _registry().Quantity(1.0, _registry().parse_units(unit))
        return quantity + 0 * quantity  # no sum of degrees above another zero, or of logarithms
    except Exception as error:  # pint raises what its parser happens to meet
        raise UnitError(
            f'{where} has the unit "{_shown(unit)}", which is unknown, or has a zero of its own.',
            why=f"Its dimension is {dimension}.",
            cure=cure,
        ) from error


def dsi_unit(*units: str) -> str:
    r"""Return the product of units as D-SI writes it: mV/Pa as ``\milli\volt\pascal\tothe{-1}``."""
    product = _registry().Quantity(1.0)
    for unit in units:
        plain = unit.replace("²", "^2").replace("⁴", "^4")
        product *= _pint_quantity(plain or "1", "unit", "certificate")
    factors = []
    for unit, power in product.unit_items():
        prefix, name, _ = _registry().parse_unit_name(unit)[0]
        factor = (rf"\{prefix}" if prefix else "") + "\\" + name.replace("meter", "metre")
        factors.append(factor if power == 1 else rf"{factor}\tothe{{{power:g}}}")
    return "".join(factors) or r"\one"


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _wrong_dimension(where: str, unit: str, dimension: str) -> UnitError:
    grams = ' (of weights in grams, "gf")' if dimension == "force" else ""
    stored = DIMENSIONS[dimension].stored
    article = "an" if dimension[0] in "ae" else "a"
    return UnitError(
        f'{where} has the unit "{_shown(unit)}", but it must be {article} {dimension}.',
        why="A number in a unit of another kind cannot be converted.",
        cure=f'Give it in "{stored}" or another unit of {dimension}{grams}.',
    )


def _shown(unit: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in unit[:_MAX_LENGTH])
