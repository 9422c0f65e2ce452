"""The figure of a tangential channel: its shear, its names, and both sides on one logarithm."""

import numpy as np
import pytest
from helpers.scans import shear_scan
from matplotlib.figure import Figure

import memscal
from memscal.figures.calibration import calibration_figure, draw_scan, draw_scan_log
from memscal.model.apparatus import ApparatusData


@pytest.fixture(scope="module")
def sheared() -> ApparatusData:
    """An artifact of channel xz."""
    return memscal.calibrate(shear_scan(seed=1), channel="xz", method="evidence").apparatus


def test_axes_and_curves_name_the_channel(sheared: ApparatusData):
    figure = calibration_figure(sheared)
    labels = " ".join(axes.get_ylabel() for axes in figure.axes)
    assert "U_{xz}" in labels
    assert "G_{xz}" in labels
    assert "zz" not in labels


def test_the_reference_is_the_shear_with_its_sides(sheared: ApparatusData):
    axes = Figure().subplots()
    draw_scan(axes, sheared)
    [curve] = [line for line in axes.lines if "reference" in str(line.get_label())]
    x, y = (np.asarray(values, dtype=float) for values in curve.get_data())
    scan = sheared.reconvolution
    # The scan is the reference, blurred: they rise and fall together.
    along = np.interp(scan.x * 1e3, x, y)
    assert np.corrcoef(along, scan.u_zz)[0, 1] > 0.95


def test_both_sides_stand_above_zero_on_the_logarithmic_axis(sheared: ApparatusData):
    axes = Figure().subplots()
    draw_scan_log(axes, sheared)
    [curve] = [line for line in axes.lines if line.get_label() == "reconvolved, G"]
    x, y = (np.asarray(values, dtype=float) for values in curve.get_data())
    for side in (x < -0.5, x > 0.8):
        assert np.isfinite(y[side]).mean() > 0.9
