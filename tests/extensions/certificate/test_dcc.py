"""The XML of a certificate: a Digital Calibration Certificate that says what the artifact says."""

import base64
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from dsi_unit import DsiUnit

import memscal
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.formats.inspection import check
from memscal.formats.units import dsi_unit
from memscal.model.quantities import PER_MM2

# It tells of a notation in its own tables; a unit of ours would have it in its warnings.
pytestmark = pytest.mark.filterwarnings("ignore:The dsi string contains the token")

NAMES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}


@pytest.fixture(scope="module")
def xml(certificate):
    return certificate_xml(certificate)


@pytest.fixture(scope="module")
def root(xml):
    return ET.fromstring(xml)


def found(root, path):
    element = root.find(path, NAMES)
    assert element is not None, path
    return element


def numbers(root, path):
    return np.array([float(text) for text in (found(root, path).text or "").split()])


@pytest.mark.parametrize(
    ("units", "expected", "scale"),
    [
        (("mV/Pa",), r"\milli\volt\pascal\tothe{-1}", 1e-3),
        (("mm",), r"\milli\metre", 1e-3),
        (("mm²",), r"\milli\metre\tothe{2}", 1e-6),
        (("1/mm²",), r"\milli\metre\tothe{-2}", 1e6),
        (("1/mm⁴",), r"\milli\metre\tothe{-4}", 1e12),
        (("uT/Pa",), None, 1e-6),
        (("",), r"\one", 1.0),
        (("mm", "mm"), r"\milli\metre\tothe{2}", 1e-6),
        (("1/Pa",), r"\pascal\tothe{-1}", 1.0),
        (("mm", "1/mm"), r"\one", 1.0),
        (("mV/Pa", "mm"), None, 1e-6),
        (("kg*m^2/s^3",), None, 1.0),
    ],
)
def test_units_are_written_as_d_si_reads_them(units, expected, scale):
    written = dsi_unit(*units)
    assert expected in (None, written)
    unit = DsiUnit(written)
    assert unit.valid
    assert unit.warnings == []
    si = [u.replace("mm", "m").replace("mV", "V").replace("uT", "T") for u in units]
    assert DsiUnit(dsi_unit(*si)).get_scale_factor(unit) == pytest.approx(scale)


def test_values_uncertainties_and_covariance_are_those_of_the_artifact(root, apparatus):
    stated = (e.text or "" for e in root.iter() if e.tag.endswith(("}unit", "}unitXMLList")))
    assert [unit for text in stated for unit in text.split() if not DsiUnit(unit).valid] == []
    values = found(root, ".//dcc:result[1]//si:realListXMLList")
    names = (found(values, "si:labelXMLList").text or "").split()
    parameters = apparatus.parameters.only(names)
    units = (found(values, "si:unitXMLList").text or "").split()
    scale = np.array([1e-3 if "milli" in unit else 1.0 for unit in units])
    scale = np.where(["tothe{2}" in unit for unit in units], 1e-6, scale)
    u = np.sqrt(np.diag(parameters.covariance))
    np.testing.assert_allclose(numbers(values, "si:valueXMLList") * scale, parameters.values)
    expanded = numbers(values, ".//si:valueExpandedMUXMLList")
    np.testing.assert_allclose(expanded * scale, 2 * u)
    stored = values.iterfind(".//si:columnXMLList", NAMES)
    columns = [numbers(column, ".//si:valueXMLList") for column in stored]
    np.testing.assert_allclose(np.array(columns) * np.outer(scale, scale), parameters.covariance)
    # The 95 % quantile of chi-square with five degrees of freedom.
    region = found(values, ".//si:ellipsoidalRegionMUXMLList")
    assert numbers(region, "si:coverageFactorXMLList") ** 2 == pytest.approx(11.070, abs=1e-3)


def test_what_is_assumed_stands_among_the_statements(root, apparatus):
    declared = [element.text or "" for element in root.iterfind(".//dcc:declaration/*", NAMES)]
    assert any(apparatus.assumptions[0].sentence in text for text in declared)


def test_an_incomplete_certificate_states_no_conformity(apparatus, laboratory, xml):
    assert b"<dcc:conformity>pass</dcc:conformity>" in xml
    less = replace(apparatus, film=replace(apparatus.film, thickness_uncertainty=None))
    incomplete = certificate_xml(certify(less, laboratory, incomplete=True))
    assert b"onformity" not in incomplete
    assert b"it lacks the uncertainty of the film's thickness" in incomplete


def test_the_profile_is_that_of_the_page(root, certificate):
    r, g = root.findall(".//dcc:result[2]//si:realListXMLList", NAMES)
    np.testing.assert_allclose(numbers(r, "si:valueXMLList"), 1e3 * certificate.profile.r)
    np.testing.assert_allclose(numbers(g, "si:valueXMLList") * PER_MM2, certificate.profile.g)
    expanded = numbers(g, ".//si:valueExpandedMUXMLList") * PER_MM2
    np.testing.assert_allclose(expanded, 2 * np.sqrt(np.diag(certificate.profile.covariance)))
    assert len(g.findall(".//si:columnXMLList", NAMES)) == certificate.profile.r.size


def test_the_artifact_in_it_is_whole_and_says_the_same(root, apparatus, tmp_path):
    held = found(root, ".//dcc:byteData/dcc:dataBase64").text
    assert held is not None
    path = tmp_path / "artifact.h5"
    path.write_bytes(base64.b64decode(held))
    assert all(finding.passed for finding in check(path))
    again = memscal.load_apparatus(path)
    assert again.conversion_constant == apparatus.conversion_constant
    np.testing.assert_allclose(again.radial_profile.g, apparatus.radial_profile.g, rtol=1e-15)


def test_what_is_too_large_or_not_determined_is_said_in_its_place(certificate):
    values = tuple(replace(value, value=np.nan) for value in certificate.values)
    root = ET.fromstring(certificate_xml(replace(certificate, artifact=b"", values=values)))
    assert np.isnan(numbers(root, ".//dcc:result[1]//si:valueXMLList")).all()
    assert root.find(".//dcc:byteData", NAMES) is None
    text = found(root, ".//dcc:result[3]//dcc:text/dcc:content").text or ""
    assert certificate.apparatus.content_digest in text
