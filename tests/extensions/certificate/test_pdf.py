"""The PDF of a certificate: a tagged PDF/A-3 of two pages with the XML in it."""

import io
import re
import socket

import pytest
from helpers.folders import SHIPPED

from memscal.cli import main
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.page import certificate_page, certificate_pdf

# What WeasyPrint says of libraries that it will need is no matter of ours.
pytestmark = [
    pytest.mark.pages,
    pytest.mark.filterwarnings("default::DeprecationWarning:weasyprint"),
]


@pytest.fixture(scope="module")
def reader(certificate):
    import pypdf

    page = certificate_page(certificate)
    xml = certificate_xml(certificate)
    return pypdf.PdfReader(io.BytesIO(certificate_pdf(certificate, page, xml)))


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


def test_nothing_is_fetched_for_the_pdf(certificate, monkeypatch):
    def refuse(*_):
        raise AssertionError("a connection was asked for")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    away = '<img alt="away" src="http://192.0.2.1/a.png"><img alt="here" src="file:///etc/hosts">'
    page = certificate_page(certificate).replace("</main>", f"{away}</main>")
    assert certificate_pdf(certificate, page, b"<a/>").startswith(b"%PDF")


def test_the_command_writes_the_pdf(tmp_path):
    files = [str(SHIPPED / name) for name in ("rod_scan_65.apparatus.h5", "lab.toml")]
    output = tmp_path / "c.pdf"
    assert main(["certificate", files[0], "--lab", files[1], "-o", str(output)]) == 0
    assert output.read_bytes().startswith(b"%PDF-1.7")
