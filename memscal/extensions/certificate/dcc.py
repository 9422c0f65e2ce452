"""A certificate as XML: PTB's Digital Calibration Certificate (DCC) 3.3.0, with units by D-SI."""

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from memscal.extensions.certificate.certificate import (
    COVERAGE_FACTOR,
    COVERAGE_PROBABILITY,
    Certificate,
    CertifiedValue,
)
from memscal.extensions.certificate.content import assumption_rows, fields_of, filled
from memscal.formats.units import dsi_unit
from memscal.model.arrays import FloatArray, Values, floats
from memscal.model.quantities import DIMENSIONS, PER_MM
from memscal.version import __version__

_CONSTANT = Path(__file__).with_name("dcc.xml")
_SPACES = {
    "dcc": "https://ptb.de/dcc",
    "si": "https://ptb.de/si",
    "xsi": "http://www.w3.org/2001/XMLSchema-instance",
}
#: Elements by their names: text, a tree of more, or a list of such, one after the other.
Tree = Mapping[str, Any]


def certificate_xml(certificate: Certificate) -> bytes:
    """Return a certificate as a Digital Calibration Certificate, in UTF-8."""
    for prefix, space in _SPACES.items():
        ET.register_namespace(prefix, space)
    root = ET.fromstring(_CONSTANT.read_bytes())
    fields = fields_of(certificate) | _beside_the_page(certificate)
    for element in root.iter():
        element.text = filled((element.text or "").strip(), fields)
    equipment = [_equipment(certificate, item) for item in certificate.equipment]
    results = [_values(certificate), _profile(certificate), _artifact(certificate)]
    for other in certificate.others:
        listed = _listed_values(certificate, [other])
        results.append({"name": _words("other"), "data": {"quantity": listed}})
    variable = {
        "measuringEquipments": {"measuringEquipment": equipment},
        "results": {"result": results},
        "measurementMetaData": {"metaData": _conformity(certificate, fields)},
    }
    for name, tree in variable.items():
        (place,) = root.iterfind(f".//dcc:{name}", _SPACES)
        _grow(place, tree)
    _prune(root)
    for content in root.iterfind(".//dcc:content", _SPACES):
        content.set("lang", fields["certificate_language"])
        content.text = certificate.texts["xml"].get(content.text, content.text)
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _beside_the_page(certificate: Certificate) -> dict[str, str]:
    """Return what the XML states beside the page: releases, and assumptions in one text."""
    release = _release(certificate.apparatus.process.version)
    fields = {"release": _release(__version__), "release_of_artifact": release}
    listed = ["; ".join(row) for row in assumption_rows(certificate)]
    if listed:
        fields["assumptions"] = ". ".join(listed)
    return fields


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


def _prune(element: ET.Element) -> None:
    for child in list(element):
        _prune(child)
        if not len(child) and not child.text:
            element.remove(child)


def _words(text: str) -> Tree:
    return {"content": text}


def _equipment(certificate: Certificate, item: Mapping[str, str]) -> Tree:
    # An incomplete certificate may lack any of them.
    words = _words(f"{certificate.words('xml', 'certificate_of')} {item.get('date', '')}".strip())
    stated = (
        ("manufacturer", item.get("serial"), _words("serial_number")),
        ("other", item.get("certificate"), words),
    )
    known = [
        {"issuer": issuer, "value": value, "name": name} for issuer, value, name in stated if value
    ]
    name = _words(item.get("name") or "")
    return {"name": name, "identifications": {"identification": known}}


def _real(value: float, unit: str) -> Tree:
    return {"si:value": _numbers(value), "si:unit": dsi_unit(unit)}


def _numbers(values: ArrayLike) -> str:
    numbers = floats(values).ravel().tolist()
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
        stated["si:measurementUncertaintyUnivariateXMLList"] = {"si:expandedMUXMLList": expanded}
        stated["si:measurementUncertaintyMultivariateXMLList"] = {
            "si:ellipsoidalRegionMUXMLList": _region(covariance, units)
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
    joint = _listed_values(certificate, certificate.values)
    resolved = _real(certificate.apparatus.resolved_wavenumber / PER_MM, "rad/mm")
    data = {"quantity": [joint, {"name": _words("resolved"), "si:real": resolved}]}
    return {"name": _words("values"), "data": data}


def _listed_values(certificate: Certificate, values: Sequence[CertifiedValue]) -> Tree:
    quantities = [value.quantity for value in values]
    names = [quantity.name for quantity in quantities]
    scale = np.array([quantity.scale for quantity in quantities])
    return _listed(
        ", ".join(certificate.words("quantities", name) for name in names),
        np.array([value.value for value in values]) / scale,
        [quantity.unit for quantity in quantities],
        certificate.covariance_of(values) / np.outer(scale, scale),
        names,
        np.array([value.factor for value in values]),
    )


def _profile(certificate: Certificate) -> Tree:
    r = DIMENSIONS["length"]
    g = DIMENSIONS["per area"]
    profile = certificate.profile
    radii = _listed("radius", profile.r / r.scale, [r.shown])
    values = _listed("profile", profile.g / g.scale, [g.shown], profile.covariance / g.scale**2)
    return {
        "name": _words("apparatus_function"),
        "data": {"list": {"quantity": [radii, values]}},
    }


def _artifact(certificate: Certificate) -> Tree:
    digest = certificate.apparatus.content_digest
    if not certificate.artifact:
        data = {"text": _words(f"{certificate.words('xml', 'too_large')} {digest}")}
    else:
        file = {
            "description": _words(f"{certificate.words('xml', 'artifact_held')} {digest}"),
            "fileName": f"{certificate.number.replace('/', '-')}.apparatus.h5",
            "mimeType": "application/x-hdf5",
            "dataBase64": base64.b64encode(certificate.artifact).decode("ascii"),
        }
        data = {"byteData": file}
    return {"name": _words("artifact"), "data": data}


def _conformity(certificate: Certificate, fields: Mapping[str, str]) -> list[Tree]:
    statements: list[Tree] = []
    for item in certificate.conformity:
        quantity = item.certified.quantity
        numbers = {"lower_limit": item.lower, "upper_limit": item.upper}
        numbers["guard_band"] = item.guard_band
        shown = []
        for name, number in numbers.items():
            if np.isfinite(number):
                real = _real(number / quantity.scale, quantity.unit)
                shown.append({"name": _words(name), "si:real": real})
        shown.append({"name": _words("probability"), "si:real": _real(item.probability, "1")})
        statements.append(
            {
                "name": _words(certificate.words("quantities", quantity.name)),
                "norm": "JCGM 106:2012",
                "declaration": _words(fields["decision"]),
                "conformity": "pass" if item.accepted else "noPass",
                "data": {"quantity": shown},
            }
        )
    return statements
