"""The laboratory's file, lab.toml: who calibrates for whom, with what, under which conditions."""

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

from memscal.errors import FormatError, InputError
from memscal.formats.files import FilePath, read_bytes
from memscal.formats.units import to_si
from memscal.model.apparatus import ApparatusData
from memscal.model.arrays import Values
from memscal.model.instrument import Dynamics
from memscal.model.quantities import ESTIMATED
from memscal.model.scan import STATED_ERRORS, Scan

_LONGEST = 1 << 20
_CELSIUS = ("degC", "°C")
ZERO_CELSIUS = 273.15

Section = Mapping[str, Any]
"""What a section of the file states, by key."""

RULES = ("simple acceptance", "guarded acceptance")
"""Decision rules: whether a value must lie within its tolerance, or clear of its limits."""
THINGS = ("film", "indenter")
"""What a scan or an artifact may hold, by the sections that name it."""
KINDS = {"load cell": "load_cell", "stage": "stage"}
"""Kinds of equipment that scans and artifacts carry, with their attributes there."""
MEASURED_BY = {
    "load": "load cell",
    "reading": "voltmeter",
    "position": "stage",
    "thickness": "thickness gauge",
    "radius": "radius gauge",
}
"""Quantities that enter a calibration, with the kind of equipment that measures each."""
TEXTS = Path(__file__).with_name("texts")
"""Folder of the texts of certificates, a file for each language."""
_LANGUAGES = sorted(path.stem for path in TEXTS.glob("*.toml"))

# A star: a certificate needs it. After a colon its kind, if it is not text on one line.
_ADDRESS = "street post_code city* country*:country contact email phone"
_KEYS = {
    "laboratory": f"name* {_ADDRESS} accreditation prefix:code number:code",
    "customer": f"name* {_ADDRESS}",
    "person": "name* role* operator",
    "sensor": "name* model manufacturer* serial* low_pass:number low_pass_uncertainty:number "
    "resonance:number resonance_uncertainty:number quality:number quality_uncertainty:number",
    "film": "name",
    "indenter": "name",
    "equipment": "name* kind:kind serial* certificate* date*:date",
    "conditions": "temperature*:temperature humidity*:dimensionless start_time*:time end_time:time",
    "certificate": "language:language place received:date condition deviations remarks replaces",
    "decision": " ".join(
        ["rule:rule guard_band:number", *(f"{name}:limits" for name in ESTIMATED)]
    ),
    "uncertainties": " ".join(f"{name}_uncertainty:number" for name in STATED_ERRORS),
    "limits": "lower:number upper:number unit",
    "quantity": "value:number unit uncertainty:number",
}
SECTIONS = {
    section: {key: kind or "text" for key, kind in re.findall(r"(\w+)\*?:?(\w*)", text)}
    for section, text in _KEYS.items()
}
"""Every key of the file with its kind, by its section, of limits, and of quantities."""
NEEDED = {section: re.findall(r"(\w+)\*", text) for section, text in _KEYS.items() if "*" in text}
"""Keys that a certificate needs, by their section."""

_FORMS = {
    "text": (r".*\S.*", "text on one line"),
    "country": ("[A-Z]{2}", "two capital letters (ISO 3166-1)"),
    "code": ("[A-Za-z0-9 ._/-]{1,40}", "of up to 40 letters, digits, blanks, and . _ / -"),
    "rule": ("|".join(RULES), " or ".join(f'"{rule}"' for rule in RULES)),
    "kind": (
        "|".join(MEASURED_BY.values()),
        f"one of {', '.join(MEASURED_BY.values())}, or left out",
    ),
    "language": ("|".join(_LANGUAGES), ", ".join(_LANGUAGES)),
}
#: Keys of the file whose attributes have other names.
_NAMES = {"serial": "serial_number", "date": "certificate_date"}


class Measured(NamedTuple):
    """A value with its standard uncertainty, in SI units."""

    value: float
    uncertainty: float | None


@dataclass(frozen=True)
class LaboratoryFile:
    """What a laboratory's file states, by section and key; of equipment a list of such."""

    name: str
    sections: Mapping[str, Section]
    equipment: tuple[Section, ...] = ()

    def stated(self, section: str, key: str) -> Any:
        """Return the value of a key, ``None`` where it is not stated."""
        return self.sections.get(section, {}).get(key)

    def additions(self, holder: Scan | ApparatusData) -> Values:
        """Return instruments, user and times with what the file adds; a contradiction is refused.

        The customer, and who authorises, stay in the file.
        """
        sensor = dict(self.sections.get("sensor", {}))
        names = sensor.keys() & vars(Dynamics()).keys()
        dynamics = {name: sensor.pop(name) for name in names}
        temperature = self.stated("conditions", "temperature")
        if temperature is not None:
            sensor["temperature"] = temperature.value
            sensor["temperature_uncertainty"] = temperature.uncertainty
        operator = self.stated("person", "operator")
        user = {"name": operator, "affiliation": self.stated("laboratory", "name")}
        parts = {"sensor": sensor, "user": user}
        for thing in THINGS:
            if getattr(holder, thing) is not None:
                parts[thing] = dict(self.sections.get(thing, {}))
        for kind, attribute in KINDS.items():
            found = [item for item in self.equipment if item.get("kind") == kind]
            parts[attribute] = {k: v for k, v in found[0].items() if k != "kind"} if found else {}
        times = {key: self.stated("conditions", key) for key in ("start_time", "end_time")}
        added = self._added(holder, times, "measurement")
        if isinstance(holder, Scan):
            added |= self._added(holder, self.sections.get("uncertainties", {}), "scan")
        for name, stated in parts.items():
            part = getattr(holder, name)
            added[name] = replace(part, **self._added(part, stated, name))
        if dynamics:
            held = holder.sensor.dynamics or Dynamics()
            known = replace(held, **self._added(held, dynamics, "sensor"))
            added["sensor"] = replace(added["sensor"], dynamics=known)
        return added

    def _added(self, part: object, stated: Section, subject: str) -> Values:
        """Return what a part does not hold; what it holds must be the same."""
        added = {}
        for key, value in stated.items():
            name = _NAMES.get(key, key)
            held = getattr(part, name)
            if value in ("", None) or held == value:
                continue
            if held not in ("", None):
                what = f"{name} of the {subject}".replace("_", " ")
                raise InputError(
                    f"The {what} is {value!r} in {self.name}, {held!r} in the scan or artifact.",
                    cure="Correct one of them, or leave it out of the laboratory's file.",
                )
            added[name] = value
        return added


def read_laboratory(path: FilePath) -> LaboratoryFile:
    """Read a laboratory's file; a key that is not known is refused, with the nearest that is."""
    name = Path(path).name
    try:
        content = tomllib.loads(read_bytes(path, limit=_LONGEST).decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(
            f"{name} is no TOML: {error}.",
            why="A laboratory's file is TOML, in UTF-8; docs/certificate.md shows one.",
        ) from error
    equipment = content.pop("equipment", [])
    if not isinstance(equipment, list):
        raise FormatError(f"{name}: equipment is one table.", cure="Write [[equipment]] over each.")
    listed = tuple(
        _section(f"{name}: [[equipment]] {i}", "equipment", item)
        for i, item in enumerate(equipment, 1)
    )
    for kind in KINDS:
        if sum(item.get("kind") == kind for item in listed) > 1:
            raise FormatError(f"{name} has more than one {kind}.", cure="Leave all but one out.")
    known = [*NEEDED, "certificate", "decision", "uncertainties", *THINGS]
    for section in content:
        _require_known(name, section, known)
    sections = {key: _section(f"{name}: [{key}]", key, item) for key, item in content.items()}
    return LaboratoryFile(name, sections, listed)


def missing_keys(sections: Mapping[str, Section], equipment: Sequence[Section]) -> Iterator[str]:
    """Yield each key that a certificate needs and that is not stated, with its section."""
    for section in NEEDED:
        if section != "equipment":
            yield from _missing(f"[{section}]", section, sections.get(section, {}))
    for i, item in enumerate(equipment, start=1):
        yield from _missing(f"[[equipment]] {i}", "equipment", item)
    if not any(item.get("kind") == "load cell" for item in equipment):
        yield '[[equipment]] of kind = "load cell"'


def _missing(place: str, section: str, stated: Section) -> Iterator[str]:
    for key in NEEDED[section]:
        value = stated.get(key)
        if value in (None, ""):
            yield f"{place} {key}"
        elif isinstance(value, Measured) and value.uncertainty is None:
            yield f"{place} {key}.uncertainty"


def _section(where: str, section: str, content: Any) -> Values:
    """Return a table with its values as their kinds ask for."""
    if not isinstance(content, dict):
        raise FormatError(
            f"{where} is {content!r}.",
            cure=f"Write it as a table of {', '.join(SECTIONS[section])}.",
        )
    for key in content:
        _require_known(where, key, list(SECTIONS[section]))
    return {k: _value(f"{where} {k}", SECTIONS[section][k], v) for k, v in content.items()}


def _require_known(where: str, key: str, known: list[str]) -> None:
    if key not in known:
        close = get_close_matches(key, known, 1, 0.5)
        raise FormatError(
            f"{where} has {key}, which is not known.",
            why="What is misspelt would be missing in the certificate.",
            cure=f"Did you mean {close[0]}?" if close else f"It may have {', '.join(known)}.",
        )


def _value(where: str, kind: str, value: Any) -> Any:
    """Return a value as its kind asks for: text, a time as text, a number, or a quantity."""
    if kind in _FORMS:
        pattern, form = _FORMS[kind]
        if isinstance(value, str) and value.isprintable() and re.fullmatch(pattern, value):
            return value.strip()
        for near in get_close_matches(str(value), pattern.split("|"), 1):
            form += f" (did you mean {near}?)"
    elif kind == "date":
        form = "a date, 2026-11-20"
        if type(value) is date:
            return value.isoformat()
    elif kind == "time":
        form = "a date, 2026-11-20, or a time, 2026-11-20T09:30:00+01:00"
        if isinstance(value, date):
            return value.isoformat()
    elif kind == "number":
        form = "a number"
        if type(value) in (int, float) and math.isfinite(value):
            return float(value)
    elif kind == "limits":
        form = "limits, the lower below the upper"
        limits = _section(where, kind, value)
        lower = limits.get("lower", -math.inf)
        upper = limits.get("upper", math.inf)
        if lower < upper and (math.isfinite(lower) or math.isfinite(upper)):
            return limits
    else:
        form = "a value with its unit, u not negative"
        stated = _section(where, "quantity", value)
        if "value" in stated and "unit" in stated and stated.get("uncertainty", 0.0) >= 0:
            return _measured(where, kind, **stated)
    raise FormatError(f"{where} is {value!r}, but should be {form}.")


def _measured(
    where: str, dimension: str, value: float, unit: str, uncertainty: float | None = None
) -> Measured:
    zero = 0.0
    if dimension == "temperature" and unit in _CELSIUS:
        unit = "K"
        zero = ZERO_CELSIUS
    number = float(to_si(value, unit, dimension, where)) + zero
    return Measured(number, uncertainty and float(to_si(uncertainty, unit, dimension, where)))
