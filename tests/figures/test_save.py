"""Figures in files: whole, and of the right kind."""

import struct
import subprocess
import sys

import pytest

from memscal.figures.style import figure_format, panels_of, render_figure


@pytest.fixture(scope="module")
def figure():
    with panels_of(3.0) as (figure, panels):
        panels.flat[0].plot([1, 2, 3], [1, 4, 9], label="squares")
    return figure


def test_a_png_has_at_least_150_dots_per_inch(figure):
    data = render_figure(figure, figure_format(".PNG"))
    width, height = struct.unpack(">II", data[16:24])
    assert width >= 150 * figure.get_figwidth()
    assert height >= 150 * figure.get_figheight()


@pytest.mark.parametrize(
    ("file_format", "start", "end"),
    [
        ("png", b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"),
        ("svg", b"<?xml", b"</svg>\n"),
        ("pdf", b"%PDF-", b"%%EOF\n"),
    ],
)
def test_a_file_begins_and_ends_as_its_kind_and_holds_no_date(figure, file_format, start, end):
    data = render_figure(figure, file_format)
    assert data.startswith(start)
    assert data.endswith(end)
    assert b"CreationDate" not in data
    assert b"dc:date" not in data


def test_drawing_needs_no_pyplot_and_the_rest_no_matplotlib():
    code = (
        "import sys, memscal.figures, memscal.model.notation\n"
        "assert 'matplotlib' not in sys.modules\n"
        "import memscal.figures.style, memscal.figures.report, memscal.figures.stress\n"
        "assert 'matplotlib.figure' in sys.modules\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
