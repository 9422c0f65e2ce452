"""A certificate's pages: what they say, and that the PDF is a tagged PDF/A-3 with the XML in it."""

import re
from dataclasses import replace
from html import unescape

from memscal import QualityCheck
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.page import certificate_page
from memscal.model.assumptions import MOVED, NAMES, Assumption

NO_ACCREDITATION = "This is no accredited certificate"


def text_of(certificate):
    return re.sub(r"<[^>]+>", " ", certificate_page(certificate).partition("<body>")[2])


def stating(certificate, section, **values):
    changed = {**certificate.sections[section], **values}
    return replace(certificate, sections={**certificate.sections, section: changed})


def test_the_page_states_values_and_conditions_and_ends_with_its_mark(certificate):
    text = text_of(certificate)
    # A = 1.00665(1974)e-4 mV/Pa and σ = 0.5574(147) mm with k = 1 in the shipped artifact.
    stated = ["(1.007 ± 0.039)×10⁻⁴ mV/Pa", "(0.557 ± 0.029) mm", "y ± U (k = 2)"]
    stated += ["(23.00 ± 0.60) °C", "(45.0 ± 6.0) %"]
    assert [value for value in stated if value not in text] == []
    assert text.strip().endswith(f"— End of certificate {certificate.number} —")


def test_a_factor_of_coverage_is_that_of_its_degrees_of_freedom(apparatus, laboratory):
    configuration = {"effective_degrees": {"conversion_constant": 10.0}}
    process = replace(apparatus.process, configuration=configuration)
    certificate = certify(replace(apparatus, process=process), laboratory)
    # u(A) is 0.0197e-4 mV/Pa, and k = 2.28 by table G.2 of the GUM.
    text = text_of(certificate)
    assert "y ± U (k = 2 to 2.28)" in text
    assert "(1.007 ± 0.045)×10⁻⁴ mV/Pa" in text
    listed = re.findall(r"coverageFactorXMLList>([^<]+)<", certificate_xml(certificate).decode())
    assert [round(float(factor), 2) for factor in listed[0].split()[:2]] == [2.28, 2.0]


def test_it_is_no_accredited_certificate_unless_the_laboratory_says_otherwise(certificate):
    assert NO_ACCREDITATION in text_of(certificate)
    text = text_of(stating(certificate, "laboratory", accreditation="body X, number 5"))
    assert NO_ACCREDITATION not in text
    assert "as the laboratory states it: body X, number 5" in text


def test_what_the_values_take_for_granted_is_listed_with_its_sizes(apparatus, laboratory):
    assumed = tuple(Assumption(name, "assumed", dict.fromkeys(MOVED, 0.05)) for name in NAMES)
    text = unescape(text_of(certify(replace(apparatus, assumptions=assumed), laboratory)))
    assert all(each.sentence.removesuffix(".") in text for each in assumed)
    assert "The sensor is round (axis ratio less one: 0.05). The line" in text


def test_hostile_names_stay_text(certificate):
    name = '</style><script>alert("1")</script>\\'
    hostile = stating(stating(certificate, "laboratory", name=name), "customer", name=name)
    page = certificate_page(hostile)
    assert "<script" not in page
    assert page.count("</style>") == 1
    assert "default-src 'none'" in page


def test_synthetic_data_and_failed_checks_are_said_first(apparatus, laboratory, certificate):
    assert "SYNTHETIC DATA" in text_of(certificate)[:600]
    failed = QualityCheck("symmetry", 2.0, 1.0, False, "Left and right differ.")
    process = replace(apparatus.process, messages=())
    text = text_of(certify(replace(apparatus, checks=(failed,), process=process), laboratory))
    assert "SYNTHETIC" not in text
    assert "checks of the calibration that failed: symmetry." in text[:600]
