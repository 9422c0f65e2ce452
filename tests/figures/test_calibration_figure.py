"""The calibration figure: what its panels hold, and what they may not."""

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from helpers.builders import scan_points
from helpers.scans import shear_scan
from matplotlib.collections import PolyCollection, QuadMesh
from scipy.interpolate import CubicSpline

import memscal
from memscal import StressSensor
from memscal.figures.calibration import calibration_figure
from memscal.figures.style import panels_of

NOISY = {"noise": 0.05}


def panels(figure):
    return {axes.get_label(): axes for axes in figure.axes if axes.get_label()}


def curve(axes, label):
    exact = [each for each in axes.lines if each.get_label() == label]
    (found,) = exact or [each for each in axes.lines if each.get_label().startswith(label)]
    return found


def line(axes, label):
    found = curve(axes, label)
    return np.asarray(found.get_xdata(), float), np.asarray(found.get_ydata(), float)


def band(axes):
    (found,) = [each for each in axes.collections if isinstance(each, PolyCollection)]
    return found.get_paths()[0].vertices


def texts(figure):
    return "\n".join(text.get_text() for text in figure.texts)


@pytest.fixture(scope="module")
def raster(make_apparatus):
    """A raster of much noise, with points missing, and its panels."""
    data = make_apparatus(raster=True, points=25, **NOISY)
    scan = scan_points(data.reconvolution, np.random.default_rng(1).permutation(625)[:600])
    data = replace(data, reconvolution=scan)
    return data, panels(calibration_figure(data))


def test_the_scan_panel_holds_the_points_and_both_reconvolutions(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["scan"]
    scan = data.reconvolution
    (bars,) = axes.containers
    np.testing.assert_allclose(bars.lines[0].get_xdata(), scan.x * 1e3)
    np.testing.assert_allclose(bars.lines[0].get_ydata(), scan.u_zz * 1e3)
    segments = bars.lines[2][0].get_segments()
    lengths = [segment[1, 1] - segment[0, 1] for segment in segments]
    np.testing.assert_allclose(lengths, 4e3 * scan.u_zz_errors)
    np.testing.assert_allclose(line(axes, "reconvolved, G")[1], scan.u_zz_predicted * 1e3)
    np.testing.assert_allclose(line(axes, "reconvolved, Gaussian")[1], scan.u_zz_gaussian * 1e3)


def background(data, x):
    """Baseline, drift and curvature of a line from -8 to 8 mm, in V."""
    p = data.parameters
    along = x / 8e-3
    return p["baseline"] + p["drift"] * along / 2 + p["baseline_curvature"] * along**2


def test_the_reference_reads_in_kilopascals_on_the_right_hand_axis(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["scan"]
    (right,) = axes.child_axes
    x, height = line(axes, "reference")
    to_stress = right._functions[0]  # what the drawn ticks are computed with
    baseline = data.parameters["baseline"]
    height = height + 1e3 * (baseline - background(data, x * 1e-3))
    assert to_stress(np.max(height)) == pytest.approx(np.max(data.reference.sigma_zz) / 1e3)
    assert to_stress(baseline * 1e3) == pytest.approx(0.0)
    assert x[np.argmax(height)] == pytest.approx(data.parameters["centre"] * 1e3)


@pytest.mark.parametrize("kind", ["line", "radii"])
def test_logarithmic_panels_hold_no_value_that_is_not_positive(drawn, raster, kind):
    axes = panels(drawn(**NOISY)) if kind == "line" else raster[1]
    for name in ("scan_log", "radial_log"):
        assert axes[name].get_yscale() == "log"
        for each in axes[name].lines:
            heights = np.asarray(each.get_ydata(), float)
            assert not np.any(heights <= 0), each.get_label()
    for bars in axes["scan_log"].containers:
        segments = [segment for segment in bars.lines[2][0].get_segments() if len(segment)]
        assert np.all(np.concatenate(segments)[:, 1] > 0)
    assert np.min(band(axes["radial_log"])[:, 1]) > 0


def test_each_point_is_a_value_or_an_upper_limit_on_the_logarithmic_axis(make_apparatus, drawn):
    data = make_apparatus(**NOISY)
    axes = panels(drawn(**NOISY))["scan_log"]
    scan = data.reconvolution
    signal = (scan.u_zz - background(data, scan.x)) * 1e3
    errors = scan.u_zz_errors * 1e3
    measured = np.asarray(axes.containers[0].lines[0].get_ydata(), float)
    _, limits = line(axes, "less than 2u")
    np.testing.assert_array_equal(np.isfinite(measured), signal > 2 * errors)
    np.testing.assert_array_equal(np.isfinite(limits), ~(signal > 2 * errors))
    low = np.isfinite(limits)
    np.testing.assert_allclose(limits[low], np.maximum(signal[low], 0) + 2 * errors[low])


def test_residuals_are_in_units_of_the_standard_uncertainty(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["residuals"]
    scan = data.reconvolution
    _, z = line(axes, "G: rms")
    np.testing.assert_allclose(z, scan.residual / scan.u_zz_errors)
    label = curve(axes, "G: rms").get_label()
    assert float(label.split()[-1]) == pytest.approx(np.sqrt(np.mean(z**2)), abs=0.006)


def test_an_outlier_is_drawn_at_the_edge_and_does_not_stretch_the_axis(make_apparatus):
    data = make_apparatus()
    record = data.reconvolution
    residual = record.residual.copy()
    residual[10] = 60 * record.u_zz_errors[10]
    data = replace(data, reconvolution=replace(record, residual=residual))
    axes = panels(calibration_figure(data))["residuals"]
    low, high = axes.get_ylim()
    assert high < 10
    x = data.reconvolution.x[10] * 1e3
    edge = [each for each in axes.lines if each.get_marker() == "^"]
    shown = [(each.get_xdata(), each.get_ydata()) for each in edge]
    assert any(x in np.asarray(xs) and np.all(low < ys) and np.all(ys < high) for xs, ys in shown)


def test_the_band_of_g_is_two_standard_uncertainties_either_way(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["radial"]
    corners = band(axes)
    r, g = line(axes, "deconvolved G")
    radial = data.radial_profile
    # On the axis it has no slope.
    level = ("clamped", "not-a-knot")
    spread = CubicSpline(radial.r * 1e3, radial.g_errors / 1e6, bc_type=level)(r)
    for each in (g + 2 * spread, g - 2 * spread):
        distance = np.abs(corners[:, None] - np.column_stack([r, each])[None]).max(axis=2)
        assert np.max(distance.min(axis=0)) < 1e-3 * np.max(g)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert any("±2u" in label for label in labels)


def test_g_and_its_gaussian_differ_in_more_than_colour(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["radial"]
    radial = data.radial_profile
    for label, samples in (("deconvolved G", radial.g), ("Gaussian fit", radial.g_gaussian)):
        r, g = line(axes, label)
        inside = radial.r <= r[-1] * 1e-3
        drawn = np.interp(radial.r[inside] * 1e3, r, g)
        np.testing.assert_allclose(drawn, samples[inside] / 1e6, atol=1e-4 * g.max())
    deconvolved = curve(axes, "deconvolved G")
    fitted = curve(axes, "Gaussian fit")
    assert deconvolved.get_linestyle() != fitted.get_linestyle()


def test_the_transfer_function_is_hatched_beyond_the_resolved_wavenumber(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["transfer"]
    (hatched,) = [each for each in axes.patches if each.get_hatch()]
    box = hatched.get_path().vertices
    assert hatched.get_x() == pytest.approx(data.transfer.resolved_wavenumber / 1e3), box
    assert hatched.get_x() + hatched.get_width() == pytest.approx(axes.get_xlim()[1])
    for label in ("window", "modulus"):
        k, drawn = line(axes, label)
        samples = CubicSpline(data.transfer.k / 1e3, getattr(data.transfer, label))(k)
        np.testing.assert_allclose(drawn, samples, atol=1e-2)


def cells(axes):
    """Centres and values of the coloured cells of a map, missing ones masked."""
    (mesh,) = [each for each in axes.collections if isinstance(each, QuadMesh)]
    corners = mesh.get_coordinates()
    return (corners[:-1, :-1] + corners[1:, 1:]) / 2, mesh.get_array()


def test_a_raster_has_maps_of_voltage_residual_and_g(raster):
    data, axes = raster
    scan = data.reconvolution
    offsets = np.stack([scan.offset_x, scan.offset_y], axis=1)
    shown = {
        "voltage map": (scan.u_zz - scan.background) * 1e3,
        "residual map": scan.residual / scan.u_zz_errors,
    }
    for name, values in shown.items():
        place, drawn = cells(axes[name])
        assert np.ma.count_masked(drawn) == 25
        distance = np.linalg.norm(place.reshape(-1, 1, 2) - 1e3 * offsets, axis=2)
        assert distance.min(axis=0).max() < 1e-9
        np.testing.assert_allclose(drawn.ravel()[distance.argmin(axis=0)], values, atol=1e-12)
        assert axes[name].get_aspect() == 1
        assert "mm" in axes[name].get_xlabel()
    place, drawn = cells(axes["G map"])
    assert drawn.max() * 1e6 == pytest.approx(data.field.g.max())
    units = {"voltage map": "(mV)", "residual map": "/ $u$", "G map": "(1/mm$^2$)"}
    for name, unit in units.items():
        (bar,) = axes[name].child_axes
        assert unit in bar.get_ylabel()


def test_a_sensor_of_any_name_is_drawn_as_plain_text(drawn):
    figure = drawn(sensor=StressSensor(name="$x_{$ \\frac 传感器 \x07 line\nbreak"))
    assert figure.texts[0].get_text().startswith("Apparatus function of ")


def test_the_settings_of_matplotlib_are_given_back():
    with mpl.rc_context({"font.size": 23.0, "axes.facecolor": "black"}):
        before = dict(mpl.rcParams)
        with panels_of(3.0) as (_, panels):
            assert panels.flat[0].get_facecolor() == (1.0, 1.0, 1.0, 1.0)
        assert dict(mpl.rcParams) == before


@pytest.fixture(scope="module")
def sheared():
    """An artifact of channel xz."""
    return memscal.calibrate(shear_scan(seed=1), channel="xz", method="evidence").apparatus


def test_the_reference_is_the_shear_with_its_sides(sheared):
    x, y = line(panels(calibration_figure(sheared))["scan"], "reference")
    scan = sheared.reconvolution
    # The scan is the reference, blurred: they rise and fall together.
    along = np.interp(scan.x * 1e3, x, y)
    assert np.corrcoef(along, scan.u_zz)[0, 1] > 0.95
