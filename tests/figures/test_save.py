"""Figures in files: whole, and of the right kind."""

import struct
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest
from matplotlib.figure import Figure

from memscal.errors import InputError, OutputError
from memscal.figures.style import render_figure, save_figure


def test_a_png_has_its_signature_and_at_least_150_dots_per_inch(drawn, tmp_path):
    figure = drawn()
    save_figure(figure, tmp_path / "figure.PNG")
    data = (tmp_path / "figure.PNG").read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    assert width >= 150 * figure.get_figwidth()
    assert height >= 150 * figure.get_figheight()


def test_an_svg_is_xml_that_refers_to_nothing_outside_itself(drawn):
    root = ET.fromstring(render_figure(drawn("radii", 25), "svg"))
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    for element in root.iter():
        for name, value in element.attrib.items():
            if name.endswith("href"):
                assert value.startswith(("#", "data:"))


@pytest.mark.parametrize(("file_format", "start", "end"), [
    ("png", b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"),
    ("svg", b"<?xml", b"</svg>\n"),
    ("pdf", b"%PDF-", b"%%EOF\n"),
])  # fmt: skip
def test_a_file_begins_and_ends_as_its_kind_and_holds_no_date(drawn, file_format, start, end):
    data = render_figure(drawn(), file_format)
    assert data.startswith(start)
    assert data.endswith(end)
    assert b"CreationDate" not in data
    assert b"dc:date" not in data


@pytest.mark.parametrize("name", ["figure.jpg", "figure", "figure.png.exe"])
def test_another_suffix_is_refused_with_the_allowed_ones_named(tmp_path, name):
    with pytest.raises(InputError, match=r"\.png, \.svg, \.pdf"):
        save_figure(Figure(), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_exists_stays_unless_overwriting_is_allowed(tmp_path):
    path = tmp_path / "figure.svg"
    path.write_text("mine")
    figure = Figure(figsize=(1, 1))
    with pytest.raises(OutputError):
        save_figure(figure, path)
    assert path.read_text() == "mine"
    save_figure(figure, path, overwrite=True)
    assert path.read_bytes().startswith(b"<?xml")


def test_drawing_needs_no_pyplot_and_the_rest_no_matplotlib():
    code = (
        "import sys, memscal.figures, memscal.model.notation\n"
        "assert 'matplotlib' not in sys.modules\n"
        "import memscal.figures.style, memscal.figures.report, memscal.figures.sweep\n"
        "assert 'matplotlib.figure' in sys.modules\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
