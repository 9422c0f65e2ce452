"""A certificate's pages: what they say, and that the PDF is a tagged PDF/A-3 with the XML in it."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from memscal import QualityCheck
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.content import fields_of
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.page import certificate_page, page_of

NO_ACCREDITATION = "This is no accredited certificate"


def text_of(certificate):
    return re.sub(r"<[^>]+>", " ", certificate_page(page_of(certificate)).partition("<body>")[2])


def stating(certificate, section, **values):
    changed = {**certificate.sections[section], **values}
    return replace(certificate, sections={**certificate.sections, section: changed})


def test_the_page_states_values_and_conditions_and_ends_with_its_mark(certificate):
    text = text_of(certificate)
    # The shipped artifact has A = 1.00665(1974)e-4 mV/Pa with k = 1; 0.5 % of gain and 0.2 % of
    # the stage's scale add 0.0050 and 0.0040.
    stated = ["(1.007 ± 0.042)×10⁻⁴ mV/Pa", "(0.557 ± 0.030) mm"]
    stated += ["(23.00 ± 0.60) °C", "(45.0 ± 6.0) %"]
    assert [value for value in stated if value not in text] == []
    assert text.strip().endswith(f"— End of certificate {certificate.number} —")


def test_a_factor_of_coverage_is_that_of_its_degrees_of_freedom(apparatus, laboratory):
    configuration = {"effective_degrees": {"conversion_constant": 10.0}}
    process = replace(apparatus.process, configuration=configuration)
    certificate = certify(replace(apparatus, process=process), laboratory)
    # u(A) is 0.0208e-4 mV/Pa, and k = 2.28 by table G.2 of the GUM.
    text = re.sub(r"\s+", " ", text_of(certificate))
    assert "(1.007 ± 0.047)×10⁻⁴ mV/Pa 2.28 4.7 %" in text
    listed = re.findall(r"coverageFactorXMLList>([^<]+)<", certificate_xml(certificate).decode())
    assert [round(float(factor), 2) for factor in listed[0].split()[:2]] == [2.28, 2.0]


def test_it_is_no_accredited_certificate_unless_the_laboratory_says_otherwise(certificate):
    assert NO_ACCREDITATION in text_of(certificate)
    text = text_of(stating(certificate, "laboratory", accreditation="body X, number 5"))
    assert NO_ACCREDITATION not in text
    assert "as the laboratory states it: body X, number 5" in text


def test_what_the_values_take_for_granted_is_listed_with_size_and_whether_it_counts(certificate):
    text = re.sub(r"\s+", " ", unescape(text_of(certificate)))
    assert "The sensor is round. axis ratio less one: 0.067 assumed no" in text
    assert "The stage moves as far as it says (scale of the stage). relative error" in text
    assert "relative error of its scale: 0.01 stated yes" in text
    # Not stated, but in the budget all the same.
    assert re.search(r"The baseline is straight\. [^.]+0\.\d+ assumed yes", text)
    # Taken as stated, and nothing of it in the budget.
    assert re.search(r"law of the reference\. [^.]+0\.\d+ stated no", text)


def test_the_page_names_no_option_field_or_quantity_that_is_not_determined(apparatus, laboratory):
    i = apparatus.parameters.names.index("fwhm")
    covariance = np.array(apparatus.parameters.covariance)
    covariance[i, i] = (0.27 * apparatus.parameters["fwhm"]) ** 2
    parameters = replace(apparatus.parameters, covariance=covariance)
    text = text_of(certify(replace(apparatus, parameters=parameters), laboratory))
    assert "not certified: Full width of G at half maximum, FWHM (U/y = 54 %)." in text
    assert re.findall(r"[a-z]+_[a-z]+|--\w+|white-noise", text) == []
    assert len(re.findall(r"Conversion constant, A ", text)) == 2
    assert text.index("Annex") < text.index("Conversion constant with the Gaussian")


def test_the_budget_has_the_digits_of_the_values_and_names_every_source(certificate):
    text = re.sub(r"\s+", " ", unescape(text_of(certificate)))
    _, _, budget = text.partition("Uncertainty budget")
    assert "(1) 10⁻⁴ mV/Pa (2) mm" in budget
    # U = 0.042 and 0.030 with k = 2; the gain adds 0.5 % of A, and nothing to a width.
    assert "gain of the reading 0.005 0.000" in budget
    assert "root sum of squares: u 0.021 0.015" in budget
    words = certificate.texts["sources"]
    assert [
        words[name] for name in certificate.apparatus.budget["fwhm"] if words[name] not in budget
    ] == []


@pytest.mark.parametrize("kinds", [(), ("voltmeter",), ("thickness gauge", "radius gauge")])
def test_quantities_are_traceable_by_the_instruments_that_are_listed(apparatus, laboratory, kinds):
    more = tuple({**laboratory.equipment[0], "kind": kind} for kind in kinds)
    made = certify(apparatus, replace(laboratory, equipment=laboratory.equipment + more))
    text = text_of(made)
    shown = {"voltmeter": "reading", "thickness gauge": "thickness", "radius gauge": "radius"}
    traceable, _, rest = text.partition("Not shown to be traceable")
    for kind, quantity in shown.items():
        sentence = traceable.partition("Traceable to the SI")[2] if kind in kinds else rest[:200]
        assert quantity in sentence


def test_all_that_the_texts_fill_in_is_known(apparatus, laboratory):
    keys = ("received", "condition", "place", "deviations", "remarks", "replaces")
    contact = {"phone": "1", "email": "a@b", "contact": "who", "accreditation": "body X"}
    sections = {**laboratory.sections, "certificate": {key: f"the {key}" for key in keys}}
    for name in ("laboratory", "customer"):
        sections[name] = {**contact, **sections[name]}
    made = certify(apparatus, replace(laboratory, sections=sections))
    text = text_of(made)
    assert [key for key in keys if f"the {key}" not in text] == []
    wanted = set(re.findall(r"\$(\w+)", str({**made.texts, "decision": ""})))
    # Known only where there is such a thing.
    seldom = {"missing", "left_out", "until", "scan_digest"}
    assert wanted - set(fields_of(made)) <= seldom


def test_hostile_names_stay_text(certificate):
    name = '</style><script>alert("1")</script>\\'
    hostile = stating(stating(certificate, "laboratory", name=name), "customer", name=name)
    page = certificate_page(page_of(hostile))
    assert "<script" not in page
    assert page.count("</style>") == 1
    assert "default-src 'none'" in page


def test_synthetic_data_and_failed_checks_are_said_first(apparatus, laboratory, certificate):
    assert "SYNTHETIC DATA" in text_of(certificate)[:600]
    failed = QualityCheck("symmetry", 2.0, 1.0, False, "Left and right differ.")
    process = replace(apparatus.process, messages=())
    lacking = replace(apparatus, checks=(failed,), process=process)
    text = text_of(certify(lacking, laboratory, incomplete=True))
    assert "SYNTHETIC" not in text
    assert "INCOMPLETE" in text[:600]
    assert "lacks: passed quality checks (symmetry)." in text[:600]
