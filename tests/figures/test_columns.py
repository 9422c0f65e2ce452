"""Figures for a column of a journal, and for a notebook."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from helpers.scans import measured

import memscal
from memscal.figures.style import render_figure

PANELS = ("scan", "residuals", "scan_log", "radial", "radial_log", "transfer")


@pytest.fixture(scope="module")
def apparatus():
    return memscal.calibrate(memscal.simulate(seed=1, points=33)).apparatus


@pytest.mark.parametrize("name", PANELS)
def test_one_panel_fits_a_column_with_labels_apart(apparatus, name):
    figure = apparatus.plot(figsize=(3.15, 2.4), panels=name)
    [axes] = figure.axes
    figure.draw_without_rendering()
    assert tuple(figure.get_size_inches()) == (3.15, 2.4)
    assert axes.get_xlabel()
    assert axes.get_ylabel()
    whole = figure.bbox.padded(2)
    texts = [axes.xaxis.label, axes.yaxis.label, *axes.get_xticklabels(), *axes.get_yticklabels()]
    shown = [text.get_window_extent() for text in texts if text.get_text() and text.get_visible()]
    legend = axes.get_legend()
    shown += [legend.get_window_extent()] if legend else []
    assert all(whole.contains(*box.min) and whole.contains(*box.max) for box in shown[:2])
    assert axes.bbox.height > 0.35 * figure.bbox.height
    for box in shown[-1:] if legend else []:
        assert whole.contains(*box.min)
        assert whole.contains(*box.max)
        assert not any(box.overlaps(other) for other in shown[:-1])


def test_panels_are_named_by_letter_or_label_and_a_wrong_one_is_refused(apparatus):
    assert [axes.get_label() for axes in measured().plot(panels="b").axes] == ["b"]
    two = apparatus.plot(panels=["scan", "radial"])
    assert [axes.get_label() for axes in two.axes] == ["scan", "radial"]
    with pytest.raises(memscal.MemscalError, match=r"no panel scn(.|\n)*Did you mean scan"):
        apparatus.plot(panels="scn")


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"figsiz": (3.0, 2.0)}, "no option figsiz"),
        ({"vary": "step"}, "no option vary"),
        ({"figsize": (-1.0, 2.0)}, r"figsize=\(-1.0, 2.0\)"),
        ({"k": 0.0}, "k=0.0"),
        ({"style": "no style"}, "style='no style'"),
        ({"style": {"axes.labelsiz": 3}}, "axes.labelsize"),
    ],
)
def test_what_no_figure_has_is_refused(apparatus, asked, words):
    with pytest.raises(memscal.MemscalError, match=words):
        apparatus.plot(**asked)


def test_bands_have_the_coverage_factor_that_is_asked_for(apparatus):
    heights = []
    for k in (1.0, 3.0):
        [axes] = apparatus.plot(panels="radial", k=k).axes
        band = axes.collections[0].get_paths()[0].vertices
        heights.append(np.ptp(band[:, 1][np.isclose(band[:, 0], band[:, 0].min())]))
        assert f"±{k:g}u (conservative)" in [text.get_text() for text in axes.get_legend().texts]
    assert heights[1] == pytest.approx(3 * heights[0], rel=1e-6)
    assert f"k = {k:g}" not in str(apparatus.plot().texts)


def test_a_style_lies_on_top_of_ours_for_this_figure_alone(apparatus):
    styled, ours = (apparatus.plot(style=s) for s in ({"axes.labelsize": 12.0}, ()))
    sizes = [figure.axes[1].yaxis.label.get_fontsize() for figure in (styled, ours)]
    assert sizes == [12.0, 8.0]


def test_a_notebook_shows_one_png_of_a_figure_and_of_a_result(apparatus):
    formatter = pytest.importorskip("IPython.core.formatters").DisplayFormatter()
    shown, _ = formatter.format(apparatus.plot())
    assert set(shown) == {"image/png", "text/plain"}
    assert shown["image/png"] == render_figure(apparatus.plot(), "png", dpi=100.0)
    cell, _ = formatter.format(apparatus)
    assert cell["text/html"].count("data:image/png;base64,") == 1
    assert plt.get_fignums() == []
