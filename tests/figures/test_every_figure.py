"""Every figure keeps the same rules of words, units and layout, and an SVG holds them as text."""

import re
from functools import cache
from itertools import combinations, starmap
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.builders import make_sweep
from helpers.friction_results import comparison, interface_comparison
from helpers.paper import FILM, SPHERE
from helpers.scans import known_apparatus, measured, pressed, sphere_scan
from matplotlib.transforms import Bbox

import memscal
from memscal.cli.compare import figure_stems
from memscal.extensions.fleet.results import Failure, FleetResults
from memscal.figures.calibration import calibration_figure
from memscal.figures.style import house_style

STATES = ("dry", "lubricated")
OF_A_COMPARISON = ["", *figure_stems(STATES[:1], interface=True)]
WITHOUT_UNCERTAINTIES = {"contacts", "sweep", "fleet"}


WHITE = SimpleNamespace(corner=0.5, spectral_density=np.ones_like)


@cache
def compared():
    return comparison(lubrications=STATES, interface=interface_comparison())


def fleet():
    values = 1e-4 * (1 + 0.01 * np.random.default_rng(1).normal(size=60))
    x, y = np.divmod(np.arange(60.0), 8)
    return FleetResults(
        paths=[f"{i}.h5" for i in range(60)],
        sensors=[f"W7-{i}" for i in range(60)],
        conversion_constant=values,
        unit="mV/Pa",
        conversion_constant_errors=0.01 * values,
        gaussian_sigma=5e3 * values,
        gaussian_sigma_errors=50 * values,
        wafer_x=x,
        wafer_y=y,
        failed={3: ("symmetry",)},
        errors={7: Failure("InputError", "The scan has no point.", "Add some.")},
    )


FIGURES = {
    "failed": lambda make: calibration_figure(make(failed=1, meaning="They are 31 um apart.")),
    "raster": lambda make: calibration_figure(make(raster=True, points=25)),
    "loads": lambda make: calibration_figure(make(load=(0.5, 1.0, 2.0), points=33)),
    "stress": lambda _: measured(lubrication="dry").plot(),
    "restoration": lambda _: memscal.restore(
        sphere_scan(pressed(), seed=1), known_apparatus(), expected=pressed()
    ).plot(),
    "contacts": lambda _: contacts()[0].plot(beside=contacts()[1:]),
    "design": lambda _: memscal.design(step=0.5e-3, repeats=2).plot(),
    "response": lambda _: memscal.response(
        known_apparatus(), 4e-3, 1e-3, noise_record=WHITE, length=50e-3
    ).plot(),
    "sweep": lambda _: make_sweep().plot(),
    "fleet": lambda _: fleet().plot(),
    "laws": lambda _: interface_comparison().plot(),
} | {
    f"comparison {name}".strip(): lambda _, name=name: compared().plot(name=name)
    for name in OF_A_COMPARISON
}


def contacts():
    return memscal.indent(FILM, SPHERE, load=[0.34, 2.75], friction=0.2)


@pytest.fixture(name="figure", scope="module", params=FIGURES)
def figure_fixture(request, make_apparatus):
    figure = FIGURES[request.param](make_apparatus)
    figure.set_label(request.param)
    with house_style():  # as it is rendered: the number of ticks depends on their size
        figure.draw_without_rendering()
        yield figure


def words(figure):
    """Texts that are drawn: not the ticks beyond an axis, not what is empty or hidden."""
    texts = list(figure.texts)
    axes = [each for each in figure.axes if each.axison]
    axes += [child for each in axes for child in each.child_axes]
    for each in axes:
        texts += [each.title, each._left_title, each._right_title, *each.texts]
        texts += [each.xaxis.label, each.yaxis.label]
        for axis in (axis for axis in (each.xaxis, each.yaxis) if axis.get_visible()):
            texts += [label for t in axis._update_ticks() for label in (t.label1, t.label2)]
    for legend in (*figure.legends, *(each.get_legend() for each in axes if each.get_legend())):
        texts += [*legend.get_texts(), legend.get_title()]
    return [text for text in texts if text.get_visible() and text.get_text().strip()]


def test_uncertainties_have_one_coverage_factor_which_is_stated(figure):
    said = " ".join(text.get_text() for text in words(figure))
    expected = 0 if figure.get_label() in WITHOUT_UNCERTAINTIES else 1
    assert min(said.count("k = 2"), 1) == expected
    assert "1.96" not in said
    assert "k = 1" not in said
    assert expected or "±" not in said
    assert set(re.findall(r"±(\S*)u\b", said)) <= {"2"}


def test_no_text_lies_on_another_or_leaves_the_page(figure):
    renderer = figure.canvas.get_renderer()
    boxes = [(each, each.get_window_extent(renderer)) for each in words(figure)]
    page = figure.bbox.padded(1)
    outside = [t.get_text() for t, box in boxes if not page.contains(*box.min)]
    outside += [t.get_text() for t, box in boxes if not page.contains(*box.max)]
    assert outside == []

    def overlap(one, other):
        common = Bbox.intersection(one[1], other[1])
        # Boxes have room for ascenders: letters that are a pixel into it do not touch.
        touching = common is not None and min(common.width, common.height) > 1.5
        return [one[0].get_text(), other[0].get_text()] if touching else []

    assert [pair for pair in starmap(overlap, combinations(boxes, 2)) if pair] == []


WITHOUT_UNIT = r"\$u\$|^sensors|in the batch|mu_e\$|ln[ (\\]"


def test_the_label_of_an_axis_has_a_unit(figure):
    labels = [text for each in figure.axes for text in (each.get_xlabel(), each.get_ylabel())]
    assert any(labels)
    for label in filter(None, labels):
        assert re.search(rf"\(.+\)|{WITHOUT_UNIT}", label), label
