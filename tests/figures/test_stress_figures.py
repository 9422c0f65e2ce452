"""The figures of measured and of restored stress: what is drawn is what was found."""

import numpy as np
import pytest
from helpers.scans import contact_scan, known_apparatus, pressed, sphere_scan

import memscal
from memscal.figures.stress import measured_stress_figure, restoration_figure


@pytest.fixture(scope="module")
def stress():
    lubricated = contact_scan(2, load=(0.34,), lubrication="lubricated")
    scans = [contact_scan(1, load=(0.34, 2.75)), lubricated]
    return memscal.measure_stress(scans, known_apparatus(conversion_uncertainty=0.01))


def points(axes):
    """All points that are drawn with a mark, shape (n, 2), in order."""
    drawn = [line.get_xydata() for line in axes.lines if line.get_marker() in ("o", "s")]
    together = np.concatenate([np.asarray(d) for d in drawn if len(d)])
    return together[np.lexsort(together.T)]


def test_both_panels_show_every_point(stress):
    rows = [np.column_stack([p.r * 1e3, p.s_zz * 1e-3]) for p in stress.profiles]
    wanted = np.concatenate(rows)
    wanted = wanted[np.lexsort(wanted.T)]
    for axes in measured_stress_figure(stress).axes:
        np.testing.assert_allclose(points(axes), wanted)


def test_the_bars_are_two_standard_uncertainties(stress):
    bars = measured_stress_figure(stress).axes[0].collections
    assert len(bars) == len(stress.profiles)
    for bar, profile in zip(bars, stress.profiles, strict=True):
        lengths = [segment[1, 1] - segment[0, 1] for segment in bar.get_segments()]
        np.testing.assert_allclose(lengths, 4 * profile.s_zz_errors * 1e-3)


@pytest.fixture(scope="module")
def restoration():
    return memscal.restore(sphere_scan(pressed(), seed=1), known_apparatus(), expected=pressed())


def lines(axes):
    return {line.get_label(): line for line in axes.lines}


def test_the_curves_are_those_of_the_restoration(restoration):
    drawn = lines(restoration_figure(restoration).axes[0])
    by_word = {
        word: next(line for label, line in drawn.items() if word in label)
        for word in ("restored", "blurred", "calculated", "scan")
    }
    np.testing.assert_allclose(by_word["restored"].get_ydata(), restoration.sigma_zz * 1e-3)
    np.testing.assert_allclose(
        by_word["blurred"].get_ydata(), restoration.blurred_stress(restoration.r) * 1e-3
    )
    np.testing.assert_allclose(
        by_word["calculated"].get_ydata(), pressed().base_stress(restoration.r) * 1e-3, atol=1e-3
    )
    np.testing.assert_allclose(by_word["scan"].get_ydata(), restoration.measured_stress * 1e-3)


def test_the_band_is_two_standard_uncertainties(restoration):
    (band,) = restoration_figure(restoration).axes[0].collections
    upper = band.get_paths()[0].vertices[:, 1].max()
    highest = restoration.sigma_zz + 2 * restoration.stress_uncertainty(restoration.r)
    assert upper == pytest.approx(highest.max() * 1e-3)
