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
from memscal.model.arrays import FloatArray
from memscal.model.quantities import DIMENSIONS, PER_MM
from memscal.version import __version__

_CONSTANT = Path(__file__).with_name("dcc.xml")
_SPACES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
#: Elements by their names: text, a tree of more, or a list of such, one after the other.
Tree = Mapping[str, Any]


def certificate_xml(of: Certificate) -> bytes:
    """Return a certificate as a Digital Calibration Certificate, in UTF-8."""
    for prefix, space in {**_SPACES, "xsi": "http://www.w3.org/2001/XMLSchema-instance"}.items():
        ET.register_namespace(prefix, space)
    root = ET.fromstring(_CONSTANT.read_bytes())
    sections = of.sections
    process = of.apparatus.process
    begin, end = (sections["conditions"][key][:10] for key in ("start_time", "end_time"))
    t, humidity = (sections["conditions"][key] for key in ("temperature", "humidity"))
    stated = {
        f"{section}_{key}": sections[section].get(key) or ""
        for section in ("laboratory", "customer", "person", "sensor")
        for key in SECTIONS[section]
    } | {
        "release": _release(__version__),
        "release_of_artifact": _release(process.version),
        "number": of.number,
        "begin": begin,
        "end": end or begin,
        "issued": of.issued,
        "accreditation": of.accreditation,
        "quality": " ".join(of.warnings) or "No check failed.",
        "method": str(process.configuration.get("method", "not stated")),
        "temperature": _numbers(t.value - ZERO_CELSIUS),
        "temperature_expanded": _numbers(COVERAGE_FACTOR * t.uncertainty),
        "humidity": _numbers(100 * humidity.value),
        "humidity_expanded": _numbers(100 * COVERAGE_FACTOR * humidity.uncertainty),
    }
    for element in root.iter():
        element.text = Template((element.text or "").strip()).substitute(stated)
    variable = {
        "measuringEquipments": {"measuringEquipment": [*map(_equipment, of.equipment)]},
        "results": {"result": [_values(of), _profile(of), _artifact(of)]},
        "measurementMetaData": {"metaData": _conformity(of)},
    }
    for name, tree in variable.items():
        (place,) = root.iterfind(f".//dcc:{name}", _SPACES)
        _grow(place, tree)
    _prune(root)
    ET.indent(root)
    made: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return made


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
    numbers = [
        ("manufacturer", item["serial"], "Serial number"),
        ("other", item["certificate"], f"Certificate of {item['date']}"),
    ]
    identifications = [{"issuer": i, "value": v, "name": _words(n)} for i, v, n in numbers]
    return {"name": _words(item["name"]), "identifications": {"identification": identifications}}


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
) -> Tree:
    """Return a quantity of several values, with expanded uncertainties and covariance if given."""
    stated: dict[str, Any] = {
        "si:labelXMLList": " ".join(labels),
        "si:valueXMLList": _numbers(values),
        "si:unitXMLList": " ".join(map(dsi_unit, units)),
    }
    if covariance is not None:
        n = len(values)
        expanded = {
            "si:valueExpandedMUXMLList": _numbers(COVERAGE_FACTOR * np.sqrt(np.diag(covariance))),
            "si:coverageFactorXMLList": _numbers([COVERAGE_FACTOR] * n),
            "si:coverageProbabilityXMLList": _numbers([COVERAGE_PROBABILITY] * n),
        }
        products = [" ".join(dsi_unit(unit, other) for other in units) for unit in units]
        if len(units) == 1:
            products *= n
        columns = [
            {"si:covarianceXMLList": {"si:valueXMLList": _numbers(c), "si:unitXMLList": unit}}
            for c, unit in zip(covariance.T, products, strict=True)
        ]
        # The ellipsoid that holds all n values with this probability (JCGM 102:2011, 6.5.2).
        factor = np.sqrt(chdtri(n, 1 - COVERAGE_PROBABILITY))
        region = {
            "si:covarianceMatrixXMLList": {"si:columnXMLList": columns},
            "si:coverageFactorXMLList": _numbers(factor),
            "si:coverageProbabilityXMLList": _numbers(COVERAGE_PROBABILITY),
        }
        stated["si:measurementUncertaintyUnivariateXMLList"] = {"si:expandedMUXMLList": expanded}
        stated["si:measurementUncertaintyMultivariateXMLList"] = {
            "si:ellipsoidalRegionMUXMLList": region
        }
    return {"name": _words(name), "si:realListXMLList": stated}


def _values(of: Certificate) -> Tree:
    scale = np.array([value.quantity.scale for value in of.values])
    joint = _listed(
        ", ".join(value.quantity.words for value in of.values),
        np.array([value.value for value in of.values]) / scale,
        [value.quantity.unit for value in of.values],
        of.covariance / np.multiply.outer(scale, scale),
        [value.quantity.name for value in of.values],
    )
    words = _words("Wavenumber up to which the scan determines G")
    resolved = _real(of.apparatus.resolved_wavenumber / PER_MM, "rad/mm")
    quantities = [joint, {"name": words, "si:real": resolved}]
    return {"name": _words("Values"), "data": {"quantity": quantities}}


def _profile(of: Certificate) -> Tree:
    r, g = (DIMENSIONS[name] for name in ("length", "per area"))
    radii = _listed("Radius r", of.profile.r / r.scale, [r.shown])
    values = of.profile.g / g.scale
    profile = _listed("G(r)", values, [g.shown], of.profile.covariance / g.scale**2)
    data = {"list": {"quantity": [radii, profile]}}
    return {"name": _words("Apparatus function G(r)"), "data": data}


def _artifact(of: Certificate) -> Tree:
    digest = f"Content digest of the artifact: {of.apparatus.content_digest}."
    file = {
        "description": _words(f"The artifact in its compact form. {digest}"),
        "fileName": f"{of.number.replace('/', '-')}.apparatus.h5",
        "mimeType": "application/x-hdf5",
        "dataBase64": base64.b64encode(of.artifact).decode("ascii"),
    }
    absent = {"text": _words(f"{digest} It is too large to be held here.")}
    return {"name": _words("Artifact"), "data": {"byteData": file} if of.artifact else absent}


def _conformity(of: Certificate) -> list[Tree]:
    statements: list[Tree] = []
    for item in of.conformity:
        unit = item.of.quantity.unit
        scale = item.of.quantity.scale
        limits = {"Lower": item.lower, "Upper": item.upper}
        sizes = {f"{k} tolerance limit": v for k, v in limits.items() if np.isfinite(v)}
        sizes |= {"Guard band": item.guard_band}
        named = [{"name": _words(k), "si:real": _real(v / scale, unit)} for k, v in sizes.items()]
        p = {"name": _words("Conformance probability"), "si:real": _real(item.probability, "1")}
        statements.append(
            {
                "name": _words(f"Conformity of the {item.of.quantity.words}"),
                "norm": "JCGM 106:2012",
                "declaration": _words(f"Decision rule: {of.decision}"),
                "conformity": "pass" if item.accepted else "noPass",
                "data": {"quantity": [*named, p]},
            }
        )
    return statements
