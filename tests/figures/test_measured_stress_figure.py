"""The figure of measured stress: what is drawn is what was measured."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.contacts import contact_scan
from helpers.spheres import known_apparatus
from matplotlib.axes import Axes

import memscal
from memscal.figures.stress import measured_stress_figure
from memscal.model.measured_stress import MeasuredStress


@pytest.fixture(scope="module")
def found() -> MeasuredStress:
    scans = [
        contact_scan(1, load=(0.34, 2.75)),
        contact_scan(2, load=(0.34,), lubrication="lubricated"),
    ]
    return memscal.measure_stress(scans, known_apparatus(conversion_uncertainty=0.01))


def points(axes: Axes) -> np.ndarray:
    """All points that are drawn with a mark, shape (n, 2), in order."""
    drawn = [line.get_xydata() for line in axes.lines if line.get_marker() in ("o", "s")]
    together = np.concatenate([np.asarray(d) for d in drawn if len(d)])
    return together[np.lexsort(together.T)]


def test_both_panels_show_every_point(found: MeasuredStress) -> None:
    rows = [np.column_stack([p.r * 1e3, p.s_zz * 1e-3]) for p in found.profiles]
    wanted = np.concatenate(rows)
    wanted = wanted[np.lexsort(wanted.T)]
    for axes in measured_stress_figure(found).axes:
        np.testing.assert_allclose(points(axes), wanted)


def test_the_bars_are_those_of_95_percent(found: MeasuredStress) -> None:
    bars = measured_stress_figure(found).axes[0].collections
    assert len(bars) == len(found.profiles)
    for bar, profile in zip(bars, found.profiles, strict=True):
        lengths = [segment[1, 1] - segment[0, 1] for segment in bar.get_segments()]
        np.testing.assert_allclose(lengths, 2 * 1.96 * profile.s_zz_errors * 1e-3)


def test_the_logarithmic_panel_shows_three_decades(found: MeasuredStress) -> None:
    axes = measured_stress_figure(found).axes[1]
    low, high = axes.get_ylim()
    top = max(profile.s_zz.max() for profile in found.profiles) * 1e-3
    assert axes.get_yscale() == "log"
    assert low == pytest.approx(1e-3 * top)
    assert high > top


def test_dry_and_lubricated_differ_in_mark_and_line_and_share_the_colour_of_their_load(
    found: MeasuredStress,
) -> None:
    axes = measured_stress_figure(found).axes[0]
    curves = [line for line in axes.lines if len(line.get_xdata()) > 100]
    styles = [line.get_linestyle() for line in curves]
    colours = [line.get_color() for line in curves]
    assert styles == ["-", "-", "--"]
    assert colours[0] == colours[2] != colours[1]


def test_the_contact_radii_are_marked(found: MeasuredStress) -> None:
    axes = measured_stress_figure(found).axes[0]
    marked = [line.get_xdata()[0] for line in axes.lines if line.get_xdata()[0] > 1.0]
    for profile in found.profiles:
        assert np.any(np.isclose(marked, profile.contact_radius * 1e3))


def test_the_legend_names_loads_and_states(found: MeasuredStress) -> None:
    figure = measured_stress_figure(found)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words[:2] == ["0.34 N", "2.75 N"]
    assert any("dry" in word for word in words)
    assert any("lubricated" in word for word in words)
