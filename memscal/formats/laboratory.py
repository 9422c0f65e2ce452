"""The laboratory's file, lab.toml: who calibrates for whom, with what, under which conditions."""

import math
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import date, datetime
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

from memscal.errors import FormatError, InputError
from memscal.formats.files import read_bytes
from memscal.formats.units import to_si
from memscal.model.apparatus import ApparatusData
from memscal.model.quantities import ESTIMATED
from memscal.model.scan import Scan

_LONGEST = 1 << 20
_CELSIUS, _FREEZING = ("degC", "°C"), 273.15

RULES = ("simple acceptance", "guarded acceptance")
"""Decision rules: whether a value must lie within its tolerance, or clear of its limits."""

KINDS = ("load cell", "stage")
"""Kinds of equipment that scans and artifacts carry; any other is in the certificate only."""


class Key(NamedTuple):
    """What a key of the file holds: its meaning, its kind, and whether a certificate needs it."""

    words: str
    kind: str = "text"  # or another of _FORMS; "date", "time", "number", "limits"; a dimension
    needed: bool = False


_FORMS = {
    "text": (r".*\S.*", "text on one line"),
    "country": ("[A-Z]{2}", "two capital letters"),
    "code": ("[A-Za-z0-9 ._/-]{1,40}", "of up to 40 letters, digits, blanks, and . _ / -"),
    "rule": ("|".join(RULES), " or ".join(f'"{rule}"' for rule in RULES)),
}
"""Patterns of texts by their kind, and what they are in words."""

_ADDRESS = {
    "street": Key("street and number"),
    "post_code": Key("postal code"),
    "city": Key("city", needed=True),
    "country": Key("country, by its two letters (ISO 3166-1)", "country", needed=True),
    "email": Key("e-mail"),
    "phone": Key("telephone"),
}
_LIMITS = {
    "lower": Key("lower tolerance limit", "number"),
    "upper": Key("upper tolerance limit", "number"),
    "unit": Key("unit of the limits"),
}
SECTIONS: Mapping[str, Mapping[str, Key]] = {
    "laboratory": {
        "name": Key("name of the laboratory", needed=True),
        **_ADDRESS,
        "accreditation": Key("accreditation for this calibration, if there is one"),
        "prefix": Key("begin of the numbers of its certificates", "code"),
        "number": Key("number of this certificate, in place of the one that is derived", "code"),
    },
    "customer": {"name": Key("name of the customer", needed=True), **_ADDRESS},
    "person": {
        "name": Key("who authorises the certificate", needed=True),
        "role": Key("role of that person", needed=True),
        "operator": Key("who measured"),
    },
    "sensor": {
        "name": Key("name of the sensor", needed=True),
        "model": Key("model of the sensor"),
        "manufacturer": Key("manufacturer of the sensor", needed=True),
        "serial": Key("serial number of the sensor", needed=True),
    },
    "equipment": {
        "name": Key("name of the instrument", needed=True),
        "kind": Key('"load cell", "stage" or another word'),
        "serial": Key("its serial number", needed=True),
        "certificate": Key("number of its certificate", needed=True),
        "date": Key("date of that certificate", "date", needed=True),
    },
    "conditions": {
        "temperature": Key("temperature of the sensor", "temperature", needed=True),
        "humidity": Key("relative humidity", "dimensionless", needed=True),
        "start_time": Key("begin of the measurement", "time", needed=True),
        "end_time": Key("end of the measurement", "time"),
    },
    "decision": {
        "rule": Key("decision rule", "rule"),
        "guard_band": Key("guard band over the expanded uncertainty", "number"),
        **{name: Key(quantity.words, "limits") for name, quantity in ESTIMATED.items()},
    },
}
"""Every key of the file by its section; ``[[equipment]]`` is a list of such."""

#: Attributes of records that have other names in the file.
_NAMES = {"serial": "serial_number", "date": "certificate_date"}


class Measured(NamedTuple):
    """A value with its standard uncertainty, in SI units."""

    value: float
    uncertainty: float | None


@dataclass(frozen=True)
class LaboratoryFile:
    """What a laboratory's file states, by section and key; of equipment a list of such."""

    name: str
    sections: Mapping[str, Mapping[str, Any]]
    equipment: tuple[Mapping[str, Any], ...] = ()

    def stated(self, section: str, key: str) -> Any:
        """Return the value of a key, ``None`` where it is not stated."""
        return self.sections.get(section, {}).get(key)

    def instrument(self, kind: str) -> dict[str, Any]:
        """Return attributes of the load cell or stage, where there is one."""
        found = (item for item in self.equipment if item.get("kind") == kind)
        return {_NAMES.get(k, k): v for k, v in next(found, {}).items() if k != "kind"}

    def additions(self, of: Scan | ApparatusData) -> dict[str, Any]:
        """Return instruments, user and times with what the file adds; a contradiction is refused.

        The customer, and who authorises, stay in the file.
        """
        sensor = {_NAMES.get(k, k): v for k, v in self.sections.get("sensor", {}).items()}
        if (temperature := self.stated("conditions", "temperature")) is not None:
            sensor |= {"temperature": temperature.value}
            sensor |= {"temperature_uncertainty": temperature.uncertainty}
        user = {"name": self.stated("person", "operator")}
        user |= {"affiliation": self.stated("laboratory", "name")}
        times = {key: self.stated("conditions", key) for key in ("start_time", "end_time")}
        added = {
            "sensor": self._added(of.sensor, sensor, "sensor"),
            "load_cell": self._added(of.load_cell, self.instrument("load cell"), "load cell"),
            "stage": self._added(of.stage, self.instrument("stage"), "stage"),
            "user": self._added(of.user, user, "user"),
        }
        parts = {name: replace(getattr(of, name), **values) for name, values in added.items()}
        return parts | self._added(of, times, "measurement")

    def _added(self, part: object, stated: Mapping[str, Any], subject: str) -> dict[str, Any]:
        added = {name: value for name, value in stated.items() if value not in ("", None)}
        for name in [name for name in added if getattr(part, name) not in ("", None)]:
            if (held := getattr(part, name)) != added.pop(name):
                raise InputError(
                    f"The {name.replace('_', ' ')} of the {subject} is {stated[name]!r} in "
                    f"{self.name}, but {held!r} in the scan or artifact.",
                    why="Both describe one measurement.",
                    cure="Correct one of them, or leave it out of the laboratory's file.",
                )
        return added


def read_laboratory(path: str | os.PathLike[str]) -> LaboratoryFile:
    """Read a laboratory's file; a key that is not known is refused, with the nearest that is."""
    name = Path(path).name
    try:
        content = tomllib.loads(read_bytes(path, limit=_LONGEST).decode("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        why = "A laboratory's file is TOML, in UTF-8; docs/certificate.md shows one."
        raise FormatError(f"{name} is no TOML: {error}.", why=why) from error
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
    known = [section for section in SECTIONS if section != "equipment"]
    for section in content:
        _require_known(name, section, known, "section")
    sections = {key: _section(f"{name}: [{key}]", key, item) for key, item in content.items()}
    return LaboratoryFile(name, sections, listed)


def missing_keys(stated: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield each key that a certificate needs and that sections do not state, with its words."""
    for section, keys in SECTIONS.items():
        if section != "equipment":
            yield from _missing(f"[{section}]", keys, stated.get(section, {}))


def missing_of_equipment(number: int, stated: Mapping[str, Any]) -> Iterator[str]:
    """Yield the keys that a certificate needs of an instrument, counted from one."""
    return _missing(f"[[equipment]] {number}", SECTIONS["equipment"], stated)


def _missing(place: str, keys: Mapping[str, Key], stated: Mapping[str, Any]) -> Iterator[str]:
    for key, of in keys.items():
        if of.needed and stated.get(key) in (None, ""):
            yield f"{place} {key} ({of.words})"
        value = stated.get(key)
        if isinstance(value, Measured) and value.uncertainty is None:
            yield f"{place} {key}.uncertainty (its standard uncertainty)"


def _section(where: str, section: str, content: Any) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise FormatError(f"{where} is {content!r}.", cure=f"Write it as a table, [{section}].")
    for key in content:
        _require_known(where, key, list(SECTIONS[section]), "key")
    return {k: _value(f"{where} {k}", SECTIONS[section][k], v) for k, v in content.items()}


def _require_known(where: str, key: str, known: list[str], kind: str) -> None:
    if key not in known:
        close = get_close_matches(key, known, 1, 0.5)
        cure = f"Did you mean {close[0]}?" if close else f"It may have {', '.join(known)}."
        why = "A name that is misspelt would be missing in the certificate."
        raise FormatError(f"{where} has the {kind} {key}, which is not known.", why=why, cure=cure)


def _value(where: str, key: Key, value: Any) -> Any:
    """Return a value as its kind asks for: text, a time as text, a number, or a quantity."""
    if key.kind in _FORMS:
        pattern, form = _FORMS[key.kind]
        fits = isinstance(value, str) and value.isprintable() and re.fullmatch(pattern, value)
        if not fits:
            raise FormatError(f"{where} is {value!r}, but should be {form}.")
        return value.strip()
    if key.kind in ("date", "time"):
        if isinstance(value, str):
            value = _time(value)
        if not isinstance(value, date) or (key.kind == "date" and isinstance(value, datetime)):
            form = "2026-11-20" if key.kind == "date" else "2026-11-20T09:30:00+01:00"
            raise FormatError(f"{where} is no {key.kind}.", cure=f"Write it like {form}.")
        return value.isoformat()
    if key.kind == "number":
        return _number(where, value)
    if key.kind == "limits":
        if not isinstance(value, dict) or not {"lower", "upper"} & set(value):
            cure = "Write it as a table with lower, upper, or both, and their unit."
            raise FormatError(f"{where} states no limits.", cure=cure)
        for name in value:
            _require_known(where, name, list(_LIMITS), "key")
        limits = {name: _value(f"{where}.{name}", _LIMITS[name], v) for name, v in value.items()}
        if limits.get("lower", -math.inf) >= limits.get("upper", math.inf):
            raise FormatError(f"{where}: the lower limit is not below the upper one.")
        return limits
    return _quantity(where, key.kind, value)


def _time(text: str) -> date | None:
    for kind in (date, datetime):
        try:
            return kind.fromisoformat(text)
        except ValueError:
            continue
    return None


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FormatError(f"{where} is {value!r}, but should be a number.")
    return float(value)


def _quantity(where: str, dimension: str, value: Any) -> Measured:
    keys = ("value", "unit", "uncertainty")
    if not isinstance(value, dict) or not {"value", "unit"} <= set(value):
        cure = 'Write it like {value = 23.0, unit = "degC", uncertainty = 0.3}; u is for k = 1.'
        raise FormatError(f"{where} is {value!r}, but should be a value with its unit.", cure=cure)
    for key in value:
        _require_known(where, key, list(keys), "key")
    unit, zero = value["unit"], 0.0
    if not isinstance(unit, str):
        raise FormatError(f"{where}.unit is {unit!r}, but should be text.")
    if dimension == "temperature" and unit in _CELSIUS:
        unit, zero = "K", _FREEZING
    number = _number(f"{where}.value", value["value"])
    spread = value.get("uncertainty")
    if spread is not None:
        spread = float(to_si(_number(f"{where}.uncertainty", spread), unit, dimension, where))
        if spread < 0:
            raise FormatError(f"{where}.uncertainty is negative.")
    return Measured(float(to_si(number, unit, dimension, where)) + zero, spread)
