"""A certificate's pages: what they say, and that the PDF is a tagged PDF/A-3 with the XML in it."""

import io
import re
import socket
from dataclasses import replace

import pypdf
import pytest

import memscal
from memscal.extensions.certificate.certificate import Certificate, certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.page import certificate_page, certificate_pdf
from memscal.model.checks import QualityCheck

NO_ACCREDITATION = "This is no accredited certificate"


def text_of(certificate: Certificate) -> str:
    return re.sub(r"<[^>]+>", " ", certificate_page(certificate).partition("<body>")[2])


def stating(certificate: Certificate, section: str, **values: str) -> Certificate:
    changed = {**certificate.sections[section], **values}
    return replace(certificate, sections={**certificate.sections, section: changed})


@pytest.fixture(scope="module")
def reader(certificate: Certificate, pango: None) -> pypdf.PdfReader:
    page = certificate_page(certificate)
    xml = certificate_xml(certificate)
    return pypdf.PdfReader(io.BytesIO(certificate_pdf(certificate, page, xml)))


def test_the_page_states_every_value_of_the_file_and_ends_with_its_mark(certificate):
    text = text_of(certificate)
    stated = [certificate.number, certificate.issued]
    for section in ("laboratory", "customer", "person", "sensor"):
        stated += [v for k, v in certificate.sections[section].items() if k != "prefix"]
    for item in certificate.equipment:
        stated += [item[key] for key in ("name", "serial", "certificate", "date")]
    # A = 1.01731(180)e-4 mV/Pa and σ = 0.5596(145) mm with k = 1 in the shipped artifact.
    stated += ["(1.017 ± 0.036)×10⁻⁴ mV/Pa", "(0.560 ± 0.029) mm", "y ± U (k = 2)"]
    stated += ["(23.00 ± 0.60) °C", "(45.0 ± 6.0) %"]
    assert [value for value in stated if value not in text] == []
    assert text.strip().endswith(f"— End of certificate {certificate.number} —")


def test_it_is_no_accredited_certificate_unless_the_laboratory_says_otherwise(certificate):
    assert NO_ACCREDITATION in text_of(certificate)
    text = text_of(stating(certificate, "laboratory", accreditation="body X, number 5"))
    assert NO_ACCREDITATION not in text
    assert "as the laboratory states it: body X, number 5" in text


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


def test_the_pdf_has_two_pages_of_a4_with_the_number_on_each(reader, certificate):
    assert len(reader.pages) == 2
    for i, page in enumerate(reader.pages, 1):
        assert [float(x) for x in page.mediabox[2:]] == pytest.approx([595.28, 841.89], abs=0.1)
        text = page.extract_text()
        said = (f"Certificate {certificate.number}", f"Page {i} of 2", "NOTHING WAS MEASURED")
        assert [words for words in said if words not in text] == []


def test_the_pdf_is_a_tagged_pdf_a_3_with_embedded_fonts(reader):
    catalog = reader.trailer["/Root"]
    xmp = catalog["/Metadata"].get_object().get_data().decode()
    assert re.search(r"pdfaid:part(=\"|>)3", xmp)
    assert re.search(r"pdfaid:conformance(=\"|>)A", xmp)
    assert catalog["/MarkInfo"]["/Marked"]
    assert catalog["/Lang"] == "en"
    assert {"/OutputIntents", "/StructTreeRoot"} <= set(catalog)
    fonts = [font for page in reader.pages for font in page["/Resources"]["/Font"].values()]
    inner = [font.get_object()["/DescendantFonts"][0].get_object() for font in fonts]
    described = [font["/FontDescriptor"].get_object() for font in inner]
    assert all({"/FontFile2", "/FontFile3"} & set(font) for font in described)


def test_the_pdf_holds_the_same_xml_as_its_alternative(reader, certificate):
    (file,) = {item.idnum: item.get_object() for item in reader.trailer["/Root"]["/AF"]}.values()
    assert file["/AFRelationship"] == "/Alternative"
    assert file["/UF"] == f"{certificate.number}.xml"
    held = file["/EF"]["/F"].get_object()
    assert held["/Subtype"] in ("/text/xml", "/application/xml")
    assert held.get_data() == certificate_xml(certificate)


@pytest.mark.usefixtures("pango")
def test_the_same_contents_and_date_give_the_same_bytes(apparatus, laboratory, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    made = []
    for _ in range(2):
        certificate = certify(apparatus, laboratory)
        page = certificate_page(certificate)
        xml = certificate_xml(certificate)
        made.append((page, xml, certificate_pdf(certificate, page, xml)))
    assert made[0] == made[1]
    assert b">2026-01-01<" in made[0][1]


@pytest.mark.usefixtures("pango")
def test_nothing_is_fetched_for_the_pdf(certificate, monkeypatch):
    def refuse(*_: object) -> None:
        raise AssertionError("a connection was asked for")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    away = '<img alt="away" src="http://192.0.2.1/a.png"><img alt="here" src="file:///etc/hosts">'
    page = certificate_page(certificate).replace("</main>", f"{away}</main>")
    assert certificate_pdf(certificate, page, b"<a/>").startswith(b"%PDF")


@pytest.mark.usefixtures("pango")
def test_scans_at_several_loads_in_another_unit_get_two_pages_too(laboratory):
    scan = replace(memscal.simulate(load=(0.1, 1.0), points=33, seed=3), unit="A")
    bare = memscal.calibrate(replace(scan, sensor=memscal.StressSensor())).apparatus
    kept = {k: v for k, v in laboratory.sections.items() if k != "decision"}
    made = certify(bare, replace(laboratory, sections=kept))
    assert "loads 0.1 to 1 N" in text_of(made)
    assert "No statement of conformity was agreed." in text_of(made)
    pdf = certificate_pdf(made, certificate_page(made), certificate_xml(made))
    assert len(pypdf.PdfReader(io.BytesIO(pdf)).pages) == 2
