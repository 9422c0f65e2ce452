"""A certificate as XML: PTB's Digital Calibration Certificate (DCC) 3.3.0, with units by D-SI."""

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from scipy.special import chdtri

from memscal.extensions.certificate.certificate import (
    COVERAGE_FACTOR,
    COVERAGE_PROBABILITY,
    Certificate,
)
from memscal.extensions.certificate.laboratory import SECTIONS, ZERO_CELSIUS
from memscal.formats.units import dsi_unit
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import DIMENSIONS, PER_MM
from memscal.version import __version__

_CONSTANT = Path(__file__).with_name("dcc.xml")
_SPACES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
#: Elements by their names: text, a tree of more, or a list of such, one after the other.
Tree = Mapping[str, Any]


def certificate_xml(certificate: Certificate) -> bytes:
    """Return a certificate as a Digital Calibration Certificate, in UTF-8."""
    for prefix, space in {**_SPACES, "xsi": "http://www.w3.org/2001/XMLSchema-instance"}.items():
        ET.register_namespace(prefix, space)
    root = ET.fromstring(_CONSTANT.read_bytes())
    texts = _texts(certificate)
    for element in root.iter():
        element.text = Template((element.text or "").strip()).substitute(texts)
    equipment = [_equipment(item) for item in certificate.equipment]
    results = [_values(certificate), _profile(certificate), _artifact(certificate)]
    variable = {
        "measuringEquipments": {"measuringEquipment": equipment},
        "results": {"result": results},
        "measurementMetaData": {"metaData": _conformity(certificate)},
    }
    for name, tree in variable.items():
        (place,) = root.iterfind(f".//dcc:{name}", _SPACES)
        _grow(place, tree)
    _prune(root)
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _texts(certificate: Certificate) -> dict[str, str]:
    """Return what is filled into the constant parts."""
    sections = certificate.sections
    process = certificate.apparatus.process
    conditions = sections["conditions"]
    begin = conditions["start_time"][:10]
    t = conditions["temperature"]
    humidity = conditions["humidity"]
    assumptions = []
    for each in certificate.apparatus.assumptions:
        size = f"{each.measure}: {each.size_text('conversion_constant')}"
        assumptions.append(f"{each.sentence} {each.state.capitalize()}; {size}.")
    texts = {}
    for section in ("laboratory", "customer", "person", "sensor"):
        for key in SECTIONS[section]:
            texts[f"{section}_{key}"] = sections[section].get(key) or ""
    return texts | {
        "release": _release(__version__),
        "release_of_artifact": _release(process.version),
        "number": certificate.number,
        "begin": begin,
        "end": conditions["end_time"][:10] or begin,
        "issued": certificate.issued,
        "accreditation": certificate.accreditation,
        "quality": " ".join(certificate.warnings) or "No check failed.",
        "assumptions": " ".join(assumptions) or "None is recorded.",
        "method": process.configuration.get("method", "not stated"),
        "temperature": _numbers(t.value - ZERO_CELSIUS),
        "temperature_expanded": _numbers(COVERAGE_FACTOR * t.uncertainty),
        "humidity": _numbers(100 * humidity.value),
        "humidity_expanded": _numbers(100 * COVERAGE_FACTOR * humidity.uncertainty),
    }


def _release(version: str) -> str:
    """Return a version as a DCC has it, without what follows its numbers."""
    numbers = re.match(r"\d+(\.\d+){0,2}", version)
    return f"v{numbers[0] if numbers else 0}"


def _grow(parent: ET.Element, tree: Tree) -> None:
    """Add the elements of a tree, of dcc where they name no other space."""
    for name, content in tree.items():
        prefix, _, tag = name.rpartition(":")
        for item in content if isinstance(content, list) else [content]:
            child = ET.SubElement(parent, f"{{{_SPACES[prefix or 'dcc']}}}{tag}")
            if isinstance(item, Mapping):
                _grow(child, item)
            else:
                child.text = item
            if name == "content":
                child.set("lang", "en")


def _prune(element: ET.Element) -> None:
    for child in list(element):
        _prune(child)
        if not len(child) and not child.text:
            element.remove(child)


def _words(text: str) -> Tree:
    return {"content": text}


def _equipment(item: Mapping[str, str]) -> Tree:
    serial = {"issuer": "manufacturer", "value": item["serial"], "name": _words("Serial number")}
    words = _words(f"Certificate of {item['date']}")
    certificate = {"issuer": "other", "value": item["certificate"], "name": words}
    identifications = {"identification": [serial, certificate]}
    return {"name": _words(item["name"]), "identifications": identifications}


def _real(value: float, unit: str) -> Tree:
    return {"si:value": _numbers(value), "si:unit": dsi_unit(unit)}


def _numbers(values: float | Iterable[float] | FloatArray) -> str:
    numbers = np.atleast_1d(np.asarray(values, dtype=np.float64)).tolist()
    return " ".join(repr(number) if np.isfinite(number) else "NaN" for number in numbers)


def _listed(
    name: str,
    values: FloatArray,
    units: Sequence[str],
    covariance: FloatArray | None = None,
    labels: Iterable[str] = (),
    factors: float | FloatArray = COVERAGE_FACTOR,
) -> Tree:
    """Return a quantity of several values, with expanded uncertainties and covariance if given."""
    stated: Values = {
        "si:labelXMLList": " ".join(labels),
        "si:valueXMLList": _numbers(values),
        "si:unitXMLList": " ".join(map(dsi_unit, units)),
    }
    if covariance is not None:
        u = np.sqrt(np.diag(covariance))
        expanded = {
            "si:valueExpandedMUXMLList": _numbers(factors * u),
            "si:coverageFactorXMLList": _numbers(np.broadcast_to(factors, u.shape)),
            "si:coverageProbabilityXMLList": _numbers(np.full_like(u, COVERAGE_PROBABILITY)),
        }
        region = _region(covariance, units)
        stated["si:measurementUncertaintyUnivariateXMLList"] = {"si:expandedMUXMLList": expanded}
        stated["si:measurementUncertaintyMultivariateXMLList"] = {
            "si:ellipsoidalRegionMUXMLList": region
        }
    return {"name": _words(name), "si:realListXMLList": stated}


def _region(covariance: FloatArray, units: Sequence[str]) -> Tree:
    """Return a covariance matrix and the ellipsoid that it spans."""
    n = len(covariance)
    products = [" ".join(dsi_unit(unit, other) for other in units) for unit in units]
    if len(units) == 1:
        products *= n
    columns = []
    for column, unit in zip(covariance.T, products, strict=True):
        listed = {"si:valueXMLList": _numbers(column), "si:unitXMLList": unit}
        columns.append({"si:covarianceXMLList": listed})
    # The ellipsoid that holds all n values with this probability (JCGM 102:2011, 6.5.2).
    factor = np.sqrt(chdtri(n, 1 - COVERAGE_PROBABILITY))
    return {
        "si:covarianceMatrixXMLList": {"si:columnXMLList": columns},
        "si:coverageFactorXMLList": _numbers(factor),
        "si:coverageProbabilityXMLList": _numbers(COVERAGE_PROBABILITY),
    }


def _values(certificate: Certificate) -> Tree:
    values = certificate.values
    quantities = [value.quantity for value in values]
    scale = np.array([quantity.scale for quantity in quantities])
    joint = _listed(
        ", ".join(quantity.words for quantity in quantities),
        np.array([value.value for value in values]) / scale,
        [quantity.unit for quantity in quantities],
        certificate.covariance / np.outer(scale, scale),
        [quantity.name for quantity in quantities],
        np.array([value.factor for value in values]),
    )
    words = _words("Wavenumber up to which the scan determines G")
    resolved = _real(certificate.apparatus.resolved_wavenumber / PER_MM, "rad/mm")
    data = {"quantity": [joint, {"name": words, "si:real": resolved}]}
    return {"name": _words("Values"), "data": data}


def _profile(certificate: Certificate) -> Tree:
    r = DIMENSIONS["length"]
    g = DIMENSIONS["per area"]
    profile = certificate.profile
    radii = _listed("Radius r", profile.r / r.scale, [r.shown])
    values = _listed("G(r)", profile.g / g.scale, [g.shown], profile.covariance / g.scale**2)
    data = {"list": {"quantity": [radii, values]}}
    return {"name": _words("Apparatus function G(r)"), "data": data}


def _artifact(certificate: Certificate) -> Tree:
    digest = f"Content digest of the artifact: {certificate.apparatus.content_digest}."
    if not certificate.artifact:
        data = {"text": _words(f"{digest} It is too large to be held here.")}
    else:
        file = {
            "description": _words(f"The artifact in its compact form. {digest}"),
            "fileName": f"{certificate.number.replace('/', '-')}.apparatus.h5",
            "mimeType": "application/x-hdf5",
            "dataBase64": base64.b64encode(certificate.artifact).decode("ascii"),
        }
        data = {"byteData": file}
    return {"name": _words("Artifact"), "data": data}


def _conformity(certificate: Certificate) -> list[Tree]:
    statements: list[Tree] = []
    for item in certificate.conformity:
        quantity = item.certified.quantity
        numbers = {"Lower tolerance limit": item.lower, "Upper tolerance limit": item.upper}
        numbers["Guard band"] = item.guard_band
        shown = []
        for name, number in numbers.items():
            if np.isfinite(number):
                real = _real(number / quantity.scale, quantity.unit)
                shown.append({"name": _words(name), "si:real": real})
        probability = _real(item.probability, "1")
        shown.append({"name": _words("Conformance probability"), "si:real": probability})
        statements.append(
            {
                "name": _words(f"Conformity of the {quantity.words}"),
                "norm": "JCGM 106:2012",
                "declaration": _words(f"Decision rule: {certificate.decision}"),
                "conformity": "pass" if item.accepted else "noPass",
                "data": {"quantity": shown},
            }
        )
    return statements
