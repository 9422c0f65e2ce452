"""The figure of a restoration: what is drawn is what was restored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.spheres import known_apparatus, pressed, sphere_scan

import memscal
from memscal.figures.stress import restoration_figure
from memscal.measurement.restoration import Restoration


@pytest.fixture(scope="module")
def found() -> Restoration:
    return memscal.restore(sphere_scan(pressed(), seed=1), known_apparatus(), expected=pressed())


def lines(axes) -> dict[str, object]:
    return {line.get_label(): line for line in axes.lines}


def test_the_curves_are_those_of_the_restoration(found: Restoration) -> None:
    drawn = lines(restoration_figure(found).axes[0])
    by_word = {
        word: next(line for label, line in drawn.items() if word in label)
        for word in ("restored", "blurred", "calculated", "scan")
    }
    np.testing.assert_allclose(by_word["restored"].get_ydata(), found.sigma_zz * 1e-3)
    np.testing.assert_allclose(by_word["blurred"].get_ydata(), found.blurred_stress(found.r) * 1e-3)
    np.testing.assert_allclose(
        by_word["calculated"].get_ydata(), pressed().base_stress(found.r) * 1e-3, atol=1e-3
    )
    np.testing.assert_allclose(by_word["scan"].get_ydata(), found.measured_stress * 1e-3)


def test_the_band_is_two_standard_uncertainties(found: Restoration) -> None:
    (band,) = restoration_figure(found).axes[0].collections
    upper = band.get_paths()[0].vertices[:, 1].max()
    highest = found.sigma_zz + 2 * found.stress_uncertainty(found.r)
    assert upper == pytest.approx(highest.max() * 1e-3)


def test_residuals_beyond_the_axis_stand_at_its_edge(found: Restoration) -> None:
    scan = sphere_scan(pressed(), seed=1)
    u = scan.u_zz.copy()
    u[5] += 100 * scan.u_zz_errors[5]
    spoilt = memscal.restore(replace(scan, u_zz=u), known_apparatus())
    axes = restoration_figure(spoilt).axes[1]
    low, high = axes.get_ylim()
    drawn = [line.get_ydata() for line in axes.lines if line.get_marker() in ("o", "^")]
    shown = np.concatenate(drawn)
    assert shown.size == scan.x.size
    assert np.all((shown > low) & (shown < high))
