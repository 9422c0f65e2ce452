"""Notation of measured values: with uncertainty, rounded by it, and unit; printable text."""

import math
from dataclasses import dataclass
from decimal import Decimal, localcontext

from memscal.errors import InputError

# Outside these powers of ten a factor reads better than a row of zeros.
_PLAIN_EXPONENTS = range(-3, 5)
_NEGLIGIBLE = 1e-12
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: SI units that take prefixes, and these, from 10^-18 to 10^9.
NAMED_UNITS = ("V", "A", "T", "Pa", "N", "m", "Hz", "W", "J", "C", "F", "ohm", "S", "K", "s")
_PREFIXES = "afpnum kMG"
#: Begins the unit of a reference whose size is not known.
RELATIVE = "relative"


@dataclass(frozen=True)
class Reading:
    """Unit of a sensor's readings: SI unit in Python (1: counts), the power of ten shown with it.

    ``per``: the unit of the reference, by which A divides that of the readings; ``"1"``: by none,
    ``"relative"``: by the reference's largest value, as the load is not known, or before the unit
    of a reference without one, a point.
    """

    si: str = "V"
    power: int = -3
    per: str = "Pa"

    @classmethod
    def fitting(cls, si: str, size: float = 0.0) -> "Reading":
        """Return the unit in which readings up to a size are shown: volts are in mV always."""
        if si not in NAMED_UNITS[1:] or not 0 < size < math.inf:
            return cls(si, -3 if si == "V" else 0)
        return cls(si, min(max(3 * math.floor(math.log10(size) / 3 + 1e-9), -18), 9))

    @property
    def unit(self) -> str:
        """The unit that is shown, with its prefix."""
        return _PREFIXES[self.power // 3 + 6].strip() + self.si

    @property
    def scale(self) -> float:
        """How many SI units that is."""
        return 10.0**self.power

    @property
    def relative(self) -> bool:
        """Whether A is relative: the size of what the sensor read is not known."""
        return self.per.startswith(RELATIVE)

    def over(self, unit: str) -> str:
        """Return a unit of readings over that of the reference."""
        per = self.per.removeprefix(RELATIVE).strip() or "1"
        if per != "1":
            unit = "1" if unit == per else f"{unit}/{per}".replace("/1/", "*")
        return f"{unit} (relative)" if self.relative else unit

    def text(self, value: float, form: str = ".3g") -> str:
        """Write a reading, given in its SI unit."""
        return f"{value / self.scale:{form}} {self.unit}".removesuffix(" 1")

    def constant(self, value: float) -> str:
        """Write a conversion constant, given in SI units."""
        return f"{value / self.scale:.4g} {self.over(self.unit)}"


VOLTS = Reading()


def format_measured(value: float, uncertainty: float | None, unit: str = "") -> str:
    """Write a value with its standard uncertainty and unit, for people to read."""
    # The uncertainty keeps two significant digits and the value is rounded to the same place (GUM,
    # JCGM 100:2008, 7.2).
    tail = "" if unit in ("", "1") else f" {unit}"
    if not math.isfinite(value):
        return "not determined"
    if uncertainty is not None and uncertainty < 0:
        raise InputError(f"A standard uncertainty of {uncertainty:g}{tail} is negative.")
    if uncertainty is None or not math.isfinite(uncertainty):
        return f"{value:.4g}{tail} (no uncertainty stated)"
    if uncertainty <= _NEGLIGIBLE * abs(value):
        return f"{value:.6g}{tail} (no uncertainty stated)"
    number, spread, exponent = rounded(value, uncertainty)
    factor = "" if exponent == 0 else "×10" + str(exponent).translate(SUPERSCRIPTS)
    if factor or tail:
        return f"({number} ± {spread}){factor}{tail}"
    return f"{number} ± {spread}"


def rounded(value: float, uncertainty: float) -> tuple[str, str, int]:
    """Return value and uncertainty as digits, and the power of ten that they share."""
    # Decimal arithmetic, because a binary 0.0145 would round differently from what is read.
    with localcontext() as context:
        context.prec = 800  # the widest span of two doubles
        number = Decimal(repr(float(value)))
        spread = Decimal(repr(float(uncertainty)))
        for _ in range(2):  # 0.0996 gives 0.10, not 0.100
            spread = spread.quantize(Decimal(1).scaleb(spread.adjusted() - 1))
        number = number.quantize(spread)
        exponent = max(number.adjusted() if number else spread.adjusted(), spread.adjusted())
        if exponent in _PLAIN_EXPONENTS:
            exponent = 0
        number = number.scaleb(-exponent)
        spread = spread.scaleb(-exponent)
        if not number:
            number = abs(number)  # never "-0.00"
        return f"{number:f}", f"{spread:f}", exponent


def format_bound(bound: float, *, upper: bool) -> str:
    """Write a bound to two digits, rounded outward, so that it still holds."""
    if bound <= 0:
        return "0"
    place = 1 - math.floor(math.log10(bound))
    shifted = bound * 10.0**place
    nearest = round(shifted)
    # A bound that has two digits only stays what it is.
    outward = math.ceil(shifted) if upper else math.floor(shifted)
    digits = nearest if abs(shifted - nearest) < 1e-9 else outward
    return f"{digits * 10.0**-place:.{max(place, 0)}f}"


def printable(value: object, limit: int) -> str:
    """Return text, or bytes as UTF-8, without the characters that could steer a terminal."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    text = text[:limit]
    if text.isprintable():
        return text
    return "".join(c for c in text if c.isprintable() or c in "\n\t")
