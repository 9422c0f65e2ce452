"""The PDF of a certificate: a tagged PDF/A-3 with the XML in it."""

import io
import re
from dataclasses import replace

import pypdf
import pytest
from helpers.folders import SHIPPED

from memscal.cli import main
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.page import certificate_pdf, page_of


@pytest.fixture(scope="module")
def reader(certificate):
    made = certificate_pdf(page_of(certificate), certificate_xml(certificate))
    return pypdf.PdfReader(io.BytesIO(made))


def test_every_page_is_a4_and_has_the_number(reader, certificate):
    assert len(reader.pages) == 3
    for i, page in enumerate(reader.pages, 1):
        assert [float(x) for x in page.mediabox[2:]] == pytest.approx([595.28, 841.89], abs=0.1)
        text = page.extract_text()
        said = (f"Certificate {certificate.number}", f"Page {i} of 3", "NOTHING WAS MEASURED")
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


def test_the_same_contents_and_date_give_the_same_bytes(apparatus, laboratory, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    made = []
    for _ in range(2):
        certificate = certify(apparatus, laboratory)
        xml = certificate_xml(certificate)
        made.append((xml, certificate_pdf(page_of(certificate), xml)))
    assert made[0] == made[1]
    assert b">2026-01-01<" in made[0][0]


def test_hostile_names_stay_text(certificate):
    name = '#read("/etc/passwd") *bold* \\ $x$ @label'
    sections = {
        **certificate.sections,
        "customer": {**certificate.sections["customer"], "name": name},
    }
    hostile = certificate_pdf(page_of(replace(certificate, sections=sections)), b"<a/>")
    pages = pypdf.PdfReader(io.BytesIO(hostile)).pages
    assert name in pages[0].extract_text()


def test_the_command_writes_the_pdf(tmp_path):
    files = [str(SHIPPED / name) for name in ("rod_scan_65.apparatus.h5", "lab.toml")]
    output = tmp_path / "c.pdf"
    command = ["certificate", files[0], "--lab", files[1], "--incomplete", "-o", str(output)]
    assert main(command) == 0
    assert output.read_bytes().startswith(b"%PDF-1.7")
