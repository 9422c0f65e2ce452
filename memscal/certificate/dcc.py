"""A certificate as XML: PTB's Digital Calibration Certificate (DCC) 3.3.0, with units by D-SI."""

import base64
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from scipy.special import chdtri

from memscal.certificate.certificate import (
    COVERAGE_FACTOR,
    COVERAGE_PROBABILITY,
    Certificate,
    Conformity,
)
from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.quantities import DIMENSIONS, PER_MM, Quantity
from memscal.version import __version__

_VERSION = "3.3.0"
_NAMESPACES = {
    "xmlns:dcc": "https://ptb.de/dcc",
    "xmlns:si": "https://ptb.de/si",
    "xmlns:xsi": "http://www.w3.org/2001/XMLSchema-instance",
    "xsi:schemaLocation": f"https://ptb.de/dcc https://ptb.de/dcc/v{_VERSION}/dcc.xsd",
}
_UNITS = {
    "m": "metre",
    "V": "volt",
    "Pa": "pascal",
    "N": "newton",
    "A": "ampere",
    "T": "tesla",
    "rad": "radian",
    "K": "kelvin",
    "°C": "degreecelsius",
    "%": "percent",
    "s": "second",
    "Hz": "hertz",
    "W": "watt",
    "J": "joule",
    "C": "coulomb",
    "F": "farad",
    "ohm": "ohm",
    "S": "siemens",
    "kg": "kilogram",
    "cd": "candela",
    "mol": "mole",
}
_PREFIXES = {
    "a": "atto",
    "f": "femto",
    "p": "pico",
    "n": "nano",
    "u": "micro",
    "m": "milli",
    "k": "kilo",
    "M": "mega",
    "G": "giga",
}
_FACTOR = re.compile(r"([*/]?)([A-Za-z°%]+|1)\^?(-?\d*)")


def dsi_unit(*units: str) -> str:
    r"""Return the product of units as D-SI writes it: mV/Pa as ``\milli\volt\pascal\tothe{-1}``."""
    powers: Counter[str] = Counter()
    for unit in units:
        plain = unit.replace("²", "^2").replace("⁴", "^4")
        for sign, symbol, power in _FACTOR.findall(plain):
            if symbol != "1":
                powers[_dsi_name(symbol)] += (-1 if sign == "/" else 1) * int(power or 1)
    factors = (
        f"{name}\\tothe{{{power}}}" if power != 1 else name
        for name, power in powers.items()
        if power
    )
    return "".join(factors) or r"\one"


def _dsi_name(symbol: str) -> str:
    if symbol in _UNITS:
        return f"\\{_UNITS[symbol]}"
    if symbol[0] in _PREFIXES and symbol[1:] in _UNITS:
        return f"\\{_PREFIXES[symbol[0]]}\\{_UNITS[symbol[1:]]}"
    problem = f"The unit {symbol} has no name in D-SI."
    raise InputError(problem, cure="Write the certificate as .html.")


def certificate_xml(of: Certificate) -> bytes:
    """Return a certificate as a Digital Calibration Certificate, in UTF-8."""
    attributes = {**_NAMESPACES, "schemaVersion": _VERSION}
    root = ET.Element("dcc:digitalCalibrationCertificate", attributes)
    _administrative(ET.SubElement(root, "dcc:administrativeData"), of)
    results = ET.SubElement(root, "dcc:measurementResults")
    _result(ET.SubElement(results, "dcc:measurementResult"), of)
    ET.indent(root)
    made: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return made


def _add(parent: ET.Element, path: str, text: str = "", **attributes: str) -> ET.Element:
    """Add nested elements of a path, the last one with text and attributes, and return it."""
    for name in path.split("/"):
        parent = ET.SubElement(parent, f"dcc:{name}" if ":" not in name else name)
    parent.attrib |= attributes
    parent.text = text or None
    return parent


def _words(parent: ET.Element, path: str, text: str) -> ET.Element:
    """Add an element with text in English, and return it."""
    element = _add(parent, path)
    _add(element, "content", text, lang="en")
    return element


def _administrative(part: ET.Element, of: Certificate) -> None:
    laboratory, customer, person, sensor, conditions = (
        of.sections[key] for key in ("laboratory", "customer", "person", "sensor", "conditions")
    )
    _software(_add(part, "dccSoftware"), __version__)
    core = _add(part, "coreData")
    _add(core, "countryCodeISO3166_1", laboratory["country"])
    for name in ("usedLangCodeISO639_1", "mandatoryLangCodeISO639_1"):
        _add(core, name, "en")
    _add(core, "uniqueIdentifier", of.number)
    begin = conditions["start_time"][:10]
    _add(core, "beginPerformanceDate", begin)
    _add(core, "endPerformanceDate", (conditions.get("end_time") or begin)[:10])
    _add(core, "performanceLocation", "laboratory")
    _add(core, "issueDate", of.issued)
    item = _add(part, "items/item")
    _words(item, "name", sensor["name"])
    _words(_add(item, "manufacturer"), "name", sensor["manufacturer"])
    if sensor.get("model"):
        _add(item, "model", sensor["model"])
    _identify(_add(item, "identifications"), "manufacturer", "Serial number", sensor["serial"])
    _contact(_add(part, "calibrationLaboratory/contact"), laboratory)
    persons = _add(part, "respPersons")
    signing = _add(persons, "respPerson")
    _words(_add(signing, "person"), "name", person["name"])
    _add(signing, "role", person["role"])
    _add(signing, "mainSigner", "true")
    _contact(_add(part, "customer"), customer)
    statements = _add(part, "statements")
    for name, text in _statements(of).items():
        statement = _add(statements, "statement")
        _words(statement, "name", name)
        _words(statement, "declaration", text)


def _statements(of: Certificate) -> dict[str, str]:
    accredited = of.sections["laboratory"].get("accreditation")
    none = "This is no accredited certificate: the laboratory states no accreditation for it."
    traceable = "The values are traceable to the SI through the certificates of the equipment."
    synthetic = "The data are synthetic: nothing was measured, and nothing is certified."
    return {
        "Accreditation": f"As the laboratory states it: {accredited}." if accredited else none,
        "Traceability": traceable,
        **({"Synthetic data": synthetic} if of.synthetic else {}),
    }


def _software(parent: ET.Element, version: str) -> None:
    software = _add(parent, "software")
    _words(software, "name", "memscal")
    numbers = re.match(r"\d+(\.\d+){0,2}", version)
    _add(software, "release", f"v{numbers[0] if numbers else 0}")
    _add(software, "type", "application")


def _identify(parent: ET.Element, issuer: str, name: str, value: str) -> None:
    identification = _add(parent, "identification")
    _add(identification, "issuer", issuer)
    _add(identification, "value", value)
    _words(identification, "name", name)


def _contact(part: ET.Element, of: Mapping[str, Any]) -> None:
    _words(part, "name", of["name"])
    for name, key in (("eMail", "email"), ("phone", "phone")):
        if key in of:
            _add(part, name, of[key])
    location = _add(part, "location")
    for name, key in (("city", "city"), ("countryCode", "country"), ("postCode", "post_code"),
                      ("street", "street")):  # fmt: skip
        if key in of:
            _add(location, name, of[key])


def _result(part: ET.Element, of: Certificate) -> None:
    data = of.apparatus
    _words(part, "name", f"Apparatus function and conversion constant, number {of.number}")
    method = _add(part, "usedMethods/usedMethod")
    chosen = data.process.configuration.get("method", "")
    _words(method, "name", f"Deconvolution of a scan, {chosen}".removesuffix(", "))
    equation = (
        "U = A (G * sigma): the reading U is the stress sigma at the base of the film, convolved "
        "with the apparatus function G of unit integral, times the conversion constant A. "
        "Expanded uncertainties are U = k u, k = 2."
    )
    _words(method, "description", equation)
    _add(method, "norm", "JCGM 100:2008")
    _software(_add(part, "usedSoftware"), data.process.version)
    equipments = _add(part, "measuringEquipments")
    for item in of.equipment:
        equipment = _add(equipments, "measuringEquipment")
        _words(equipment, "name", item["name"])
        identifications = _add(equipment, "identifications")
        _identify(identifications, "manufacturer", "Serial number", item["serial"])
        words = f"Calibration certificate of {item['date']}"
        _identify(identifications, "other", words, item["certificate"])
    influences = _add(part, "influenceConditions")
    t, h = (of.sections["conditions"][k] for k in ("temperature", "humidity"))
    for name, kind, value, u, unit in (
        ("Temperature", "basic_temperature", t.value - 273.15, t.uncertainty, "°C"),
        ("Relative humidity", "basic_humidityRelative", 100 * h.value, 100 * h.uncertainty, "%"),
    ):
        influence = _add(influences, "influenceCondition", refType=kind)
        _words(influence, "name", name)
        _real(_quantity(_add(influence, "data"), name), value, unit, u)
    results = _add(part, "results")
    _values(results, of)
    _profile(results, of)
    _budget(results, of)
    _artifact(results, of)
    if of.conformity:
        statements = _add(part, "measurementMetaData")
        for statement in of.conformity:
            _conformity(statements, statement, of.decision)


def _data_of(results: ET.Element, name: str, description: str = "") -> ET.Element:
    result = _add(results, "result")
    _words(result, "name", name)
    if description:
        _words(result, "description", description)
    return _add(result, "data")


def _quantity(parent: ET.Element, name: str, kind: str = "basic_measuredValue") -> ET.Element:
    quantity = _add(parent, "quantity", refType=kind)
    _words(quantity, "name", name)
    return quantity


def _real(parent: ET.Element, value: float, unit: str, u: float | None = None) -> None:
    real = _add(parent, "si:real")
    _add(real, "si:value", _number(value))
    _add(real, "si:unit", dsi_unit(unit))
    if u is not None:
        expanded = _add(real, "si:measurementUncertaintyUnivariate/si:expandedMU")
        _add(expanded, "si:valueExpandedMU", _number(COVERAGE_FACTOR * u))
        _add(expanded, "si:coverageFactor", _number(COVERAGE_FACTOR))
        _add(expanded, "si:coverageProbability", _number(COVERAGE_PROBABILITY))
        _add(expanded, "si:distribution", "normal")


def _list(
    parent: ET.Element,
    values: Sequence[float] | FloatArray,
    units: Sequence[str],
    covariance: FloatArray | None = None,
    labels: Iterable[str] = (),
) -> None:
    """Add values in their units, with expanded uncertainties and covariance where it is given."""
    real, n = _add(parent, "si:realListXMLList"), len(values)
    if named := " ".join(labels):
        _add(real, "si:labelXMLList", named)
    _add(real, "si:valueXMLList", _numbers(values))
    one = len(set(units)) == 1
    _add(real, "si:unitXMLList", " ".join(map(dsi_unit, units[:1] if one else units)))
    if covariance is None:
        return
    expanded = _add(real, "si:measurementUncertaintyUnivariateXMLList/si:expandedMUXMLList")
    u = np.sqrt(np.diag(covariance))
    _add(expanded, "si:valueExpandedMUXMLList", _numbers(COVERAGE_FACTOR * u))
    _add(expanded, "si:coverageFactorXMLList", _numbers([COVERAGE_FACTOR] * n))
    _add(expanded, "si:coverageProbabilityXMLList", _numbers([COVERAGE_PROBABILITY] * n))
    path = "si:measurementUncertaintyMultivariateXMLList/si:ellipsoidalRegionMUXMLList"
    region = _add(real, path)
    matrix = _add(region, "si:covarianceMatrixXMLList")
    for column, unit in zip(covariance.T, units, strict=True):
        entries = _add(matrix, "si:columnXMLList/si:covarianceXMLList")
        _add(entries, "si:valueXMLList", _numbers(column))
        products = [dsi_unit(unit, other) for other in (units[:1] if one else units)]
        _add(entries, "si:unitXMLList", " ".join(products))
    # The ellipsoid that holds all n values with this probability (JCGM 102:2011, 6.5.2).
    factor = float(np.sqrt(chdtri(n, 1 - COVERAGE_PROBABILITY)))
    _add(region, "si:coverageFactorXMLList", _number(factor))
    _add(region, "si:coverageProbabilityXMLList", _number(COVERAGE_PROBABILITY))


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Iterable[float]) -> str:
    return " ".join(map(_number, values))


def _values(results: ET.Element, of: Certificate) -> None:
    data = _data_of(results, "Values", "Parameters with their joint covariance.")
    scale = np.array([value.quantity.scale for value in of.values])
    _list(
        _quantity(data, ", ".join(value.quantity.words for value in of.values)),
        np.array([value.value for value in of.values]) / scale,
        [value.quantity.unit for value in of.values],
        of.covariance / np.multiply.outer(scale, scale),
        [value.quantity.name for value in of.values],
    )
    resolved = _quantity(data, "Wavenumber up to which the scan determines G", "basic_nominalValue")
    _real(resolved, of.apparatus.resolved_wavenumber / PER_MM, "rad/mm")


def _profile(results: ET.Element, of: Certificate) -> None:
    data = _data_of(results, "Apparatus function G(r)")
    table, profile = _add(data, "list", refType="basic_1IndexTable"), of.profile
    r, g = (DIMENSIONS[name] for name in ("length", "per area"))
    _list(_quantity(table, "Radius r", "basic_tableIndex0"), profile.r / r.scale, [r.shown])
    covariance = profile.covariance / g.scale**2
    _list(_quantity(table, "G(r)"), profile.g / g.scale, [g.shown] * profile.r.size, covariance)


def _budget(results: ET.Element, of: Certificate) -> None:
    budget = {v.quantity: of.apparatus.budget.get(v.quantity.name) for v in of.values}
    stated = {quantity: sources for quantity, sources in budget.items() if sources}
    if not stated:
        return
    data = _data_of(results, "Uncertainty budget", "Standard uncertainties (k = 1) by source.")
    for quantity, sources in stated.items():
        values = [u / quantity.scale for u in sources.values()]
        _list(_quantity(data, quantity.words), values, [quantity.unit], labels=sources)


def _artifact(results: ET.Element, of: Certificate) -> None:
    digest = f"Content digest of the artifact: {of.apparatus.content_digest}."
    if not of.artifact:
        _words(_data_of(results, "Artifact"), "text", f"{digest} It is too large to be held here.")
        return
    file = _add(_data_of(results, "Artifact"), "byteData")
    _words(file, "description", f"The artifact in its compact form. {digest}")
    _add(file, "fileName", f"{of.number.replace('/', '-')}.apparatus.h5")
    _add(file, "mimeType", "application/x-hdf5")
    _add(file, "dataBase64", base64.b64encode(of.artifact).decode("ascii"))


def _conformity(statements: ET.Element, item: Conformity, decision: str) -> None:
    quantity: Quantity = item.of.quantity
    statement = _add(statements, "metaData")
    _words(statement, "name", f"Conformity of the {quantity.words}")
    _add(statement, "norm", "JCGM 106:2012")
    _words(statement, "declaration", f"Decision rule: {decision}")
    _add(statement, "conformity", "pass" if item.accepted else "noPass")
    data = _add(statement, "data")
    for name, limit in (("Lower", item.lower), ("Upper", item.upper)):
        if np.isfinite(limit):
            of = _quantity(data, f"{name} tolerance limit", f"basic_acceptanceLimit{name}")
            _real(of, limit / quantity.scale, quantity.unit)
    guard = _quantity(data, "Guard band", "basic_nominalValue")
    _real(guard, item.guard_band / quantity.scale, quantity.unit)
    _real(_quantity(data, "Conformance probability"), item.probability, "1")
