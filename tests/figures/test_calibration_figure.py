"""The calibration figure: what its panels hold, and what they may not."""

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from helpers.builders import scan_points
from helpers.scans import shear_scan, simulated
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.patches import Rectangle

import memscal
from memscal.figures.calibration import calibration_figure
from memscal.model.apparatus import ApparatusData, ParameterSet
from memscal.model.scan import StressSensor


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


@pytest.mark.parametrize("points", [33, 200])
def test_the_scan_panel_holds_the_points_and_both_reconvolutions(make_apparatus, drawn, points):
    data = make_apparatus(points=points)
    axes = panels(drawn(points=points))["scan"]
    scan = data.reconvolution
    (bars,) = axes.containers
    np.testing.assert_allclose(bars.lines[0].get_xdata(), scan.x * 1e3)
    np.testing.assert_allclose(bars.lines[0].get_ydata(), scan.u_zz * 1e3)
    segments = bars.lines[2][0].get_segments()
    lengths = [segment[1, 1] - segment[0, 1] for segment in segments]
    np.testing.assert_allclose(lengths, 4e3 * scan.u_zz_errors)
    np.testing.assert_allclose(line(axes, "reconvolved, G")[1], scan.u_zz_predicted * 1e3)
    np.testing.assert_allclose(line(axes, "reconvolved, Gaussian")[1], scan.u_zz_gaussian * 1e3)


@pytest.mark.parametrize("order", [np.arange(33)[::-1] * 7 % 33, np.tile(np.arange(33), 3)])
def test_points_out_of_order_and_repeats_of_a_position_share_one_line(make_apparatus, order):
    data = make_apparatus(points=33)
    scan = scan_points(data.reconvolution, order)
    figure = calibration_figure(replace(data, reconvolution=scan))
    joined = curve(panels(figure)["scan"], "reconvolved, G")
    assert (joined.get_linestyle(), joined.get_xdata().size) == ("-", 33)
    assert np.all(np.diff(joined.get_xdata()) > 0)


def test_the_reference_reads_in_kilopascals_on_the_right_hand_axis(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["scan"]
    (right,) = axes.child_axes
    x, height = line(axes, "reference")
    to_stress = right._functions[0]  # what the drawn ticks are computed with
    assert to_stress(np.max(height)) == pytest.approx(np.max(data.reference.sigma_zz) / 1e3)
    assert to_stress(data.parameters["baseline"] * 1e3) == pytest.approx(0.0)
    assert x[np.argmax(height)] == pytest.approx(data.parameters["centre"] * 1e3)


def test_the_black_patch_is_as_wide_as_the_rod_and_stands_at_the_centre(drawn):
    axes = panels(drawn())["scan"]
    (patch,) = [each for each in axes.patches if isinstance(each, Rectangle)]
    assert patch.get_width() == pytest.approx(0.5)
    assert patch.get_x() + 0.25 == pytest.approx(0.14)


@pytest.mark.parametrize("kind", ["line", "radii", "flat"])
def test_logarithmic_panels_hold_no_value_that_is_not_positive(drawn, kind):
    axes = panels(drawn(kind, 33, noise=0.05, ripple=0.3, error=0.4))
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
    data = make_apparatus(noise=0.03)
    axes = panels(drawn(noise=0.03))["scan_log"]
    scan = data.reconvolution
    signal = (scan.u_zz - data.parameters["baseline"]) * 1e3
    errors = scan.u_zz_errors * 1e3
    measured = np.asarray(axes.containers[0].lines[0].get_ydata(), float)
    _, limits = line(axes, "less than 2u")
    np.testing.assert_array_equal(np.isfinite(measured), signal > 2 * errors)
    np.testing.assert_array_equal(np.isfinite(limits), ~(signal > 2 * errors))
    low = np.isfinite(limits)
    np.testing.assert_allclose(limits[low], np.maximum(signal[low], 0) + 2 * errors[low])


def test_a_drift_is_taken_off_before_the_logarithm(make_apparatus, drawn):
    data = make_apparatus()
    scan = data.reconvolution
    known = data.parameters
    tilt = 5e-4 * scan.x / 8e-3  # V: a tenth of the maximum at the scan's end
    names = ("u_zz", "u_zz_predicted", "u_zz_gaussian")
    scan = replace(scan, **{name: getattr(scan, name) + tilt for name in names})
    more = ParameterSet(
        (*known.names, "drift"), np.append(known.values, 1e-3), np.diag(np.full(6, 1e-12))
    )
    figure = calibration_figure(replace(data, reconvolution=scan, parameters=more))
    tilted = panels(figure)["scan_log"]
    level = panels(drawn())["scan_log"]
    for label in ("reconvolved, G", "less than 2u"):
        np.testing.assert_allclose(line(tilted, label)[1], line(level, label)[1], rtol=1e-6)


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


def test_without_uncertainties_the_residuals_say_what_they_are_divided_by(make_apparatus):
    data = make_apparatus()
    record = data.reconvolution
    exact = replace(record, u_zz_errors=np.zeros_like(record.u_zz_errors))
    data = replace(data, reconvolution=exact)
    axes = panels(calibration_figure(data))["residuals"]
    assert "own rms" in axes.get_ylabel()
    _, z = line(axes, "G: rms")
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0)


def test_the_band_of_g_is_two_standard_uncertainties_either_way(make_apparatus, drawn):
    data = make_apparatus()
    axes = panels(drawn())["radial"]
    corners = band(axes)
    r, g = line(axes, "deconvolved G")
    spread = np.interp(r, data.radial_profile.r * 1e3, data.radial_profile.g_errors / 1e6)
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
    assert hatched.get_x() == pytest.approx(3.7), box
    assert hatched.get_x() + hatched.get_width() == pytest.approx(axes.get_xlim()[1])
    for label in ("window", "modulus"):
        k, drawn = line(axes, label)
        samples = np.interp(k, data.transfer.k / 1e3, getattr(data.transfer, label))
        np.testing.assert_allclose(drawn, samples, atol=1e-2)


def test_values_and_failed_checks_stand_in_words_above_the_panels(drawn):
    said = texts(drawn(failed=2))
    assert "A = (3.000 ± 0.026)×10⁻⁵ mV/Pa" in said
    assert "σ = (0.5610 ± 0.0068) mm" in said
    assert "U = 2u (k = 2)" in said
    assert "2 of 5 checks FAILED: reconvolution, symmetry." in said


def test_a_calibration_without_failures_says_so(drawn):
    assert "All 5 checks passed." in texts(drawn())


@pytest.mark.parametrize("name", ["many words name a sensor ", "WWWWW WWWWW ", "i" * 99])
def test_no_text_above_the_panels_leaves_the_page(drawn, name):
    figure = drawn(failed=5, sensor=StressSensor(name=name * 4))
    renderer = figure.canvas.get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.texts]
    panel_top = max(axes.get_tightbbox(renderer).y1 for axes in panels(figure).values())
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.width for box in boxes)
    assert all(panel_top <= box.y0 and box.y1 <= figure.bbox.height for box in boxes)


def test_a_raster_is_drawn_against_the_distance_from_its_centre(drawn):
    axes = panels(drawn("radii", 25))
    assert "distance" in axes["scan_log"].get_xlabel()
    x, height = line(axes["scan"], "reference")
    assert x[np.argmax(height)] == 0.0
    # No line joins points at all angles about a sensor that need not be round.
    assert curve(axes["scan"], "reconvolved, G").get_linestyle() == "None"


def cells(axes):
    """Centres and values of the coloured cells of a map, missing ones masked."""
    (mesh,) = [each for each in axes.collections if isinstance(each, QuadMesh)]
    corners = mesh.get_coordinates()
    return (corners[:-1, :-1] + corners[1:, 1:]) / 2, mesh.get_array()


def test_a_raster_has_maps_of_voltage_residual_and_g(make_apparatus):
    data = make_apparatus("radii", 25)
    scan = scan_points(data.reconvolution, np.random.default_rng(1).permutation(625)[:600])
    axes = panels(calibration_figure(replace(data, reconvolution=scan)))
    offsets = np.stack([scan.offset_x, scan.offset_y], axis=1)
    shown = {
        "voltage map": (scan.u_zz - data.parameters["baseline"]) * 1e3,
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


def test_points_on_no_lattice_are_dots_at_their_places(make_apparatus):
    data = make_apparatus("radii", 25)
    scan = data.reconvolution
    shifted = scan.offset_x + np.random.default_rng(1).uniform(-3e-4, 3e-4, scan.x.size)
    data = replace(data, reconvolution=replace(scan, offset_x=shifted))
    (dots,) = panels(calibration_figure(data))["voltage map"].collections
    wanted = np.stack([shifted, scan.offset_y], axis=1) * 1e3
    np.testing.assert_allclose(np.asarray(dots.get_offsets()), wanted)


def test_each_of_several_loads_has_a_panel_and_a_colour(make_apparatus):
    data = make_apparatus(points=33, loads=(0.5, 1.0, 2.0))
    figure = calibration_figure(data)
    named = [a for a in figure.axes if any(t.get_text().endswith(" N") for t in a.texts)]
    assert [a.texts[0].get_text() for a in named] == ["0.5 N", "1 N", "2 N"]
    for i, axes in enumerate(named):
        drawn = axes.containers[0].lines[0].get_ydata()
        np.testing.assert_allclose(drawn, data.reconvolution.u_zz[33 * i : 33 * i + 33] * 1e3)
    residuals = panels(figure)["residuals"]
    marks = [curve(residuals, f"{load} N: rms") for load in ("0.5", "1", "2")]
    looks = [(each.get_color(), each.get_marker()) for each in marks]
    assert len(set(looks)) == 3
    for axes, points in zip(named, panels(figure)["scan_log"].containers, strict=True):
        shown = (points.lines[0], axes.containers[0].lines[0])
        assert [(each.get_color(), each.get_marker()) for each in shown] == [looks.pop(0)] * 2
    assert "0.5 N to 2 N" in texts(figure)


def test_of_many_loads_the_first_are_drawn_and_the_others_counted(make_apparatus):
    figure = calibration_figure(make_apparatus(points=9, loads=np.arange(1.0, 9.0)))
    shown = [t.get_text() for axes in figure.axes for t in axes.texts if " N" in t.get_text()]
    assert len(shown) == 6
    assert shown[-1] == "6 N\nand 2 more loads"


def test_a_raster_at_two_loads_has_two_rows_of_maps(make_apparatus):
    axes = calibration_figure(make_apparatus("radii", 9, loads=(0.5, 1.0))).axes
    maps = [each.get_title("left") for each in axes if each.get_label() == "voltage map"]
    assert maps == ["0.5 N", "1 N"]


def test_voltages_that_share_a_position_are_not_joined_by_a_line(drawn):
    found = curve(panels(drawn("flat", 25))["scan"], "reconvolved, G")
    assert (found.get_linestyle(), np.size(found.get_xdata())) == ("None", 625)


@pytest.mark.parametrize(
    "name", ["$x_{$ \\frac", "<b>&amp;</b>", "传感器 \x07", "a" * 400, "", "line\nbreak"]
)
def test_a_sensor_of_any_name_is_drawn_as_plain_text(drawn, name):
    figure = drawn(sensor=StressSensor(name=name))
    figure.draw_without_rendering()
    assert figure.texts[0].get_text().startswith("Apparatus function of ")


def test_a_conversion_constant_below_zero_leaves_out_the_stress_axis(make_apparatus):
    data = make_apparatus()
    values = data.parameters.values.copy()
    values[0] *= -1
    data = replace(data, parameters=replace(data.parameters, values=values))
    axes = panels(calibration_figure(data))["scan"]
    assert not axes.child_axes
    assert not [each for each in axes.lines if each.get_label().startswith("reference")]


def test_the_settings_of_matplotlib_are_given_back(make_apparatus):
    with mpl.rc_context({"font.size": 23.0, "axes.facecolor": "black"}):
        before = dict(mpl.rcParams)
        figure = calibration_figure(make_apparatus())
        assert dict(mpl.rcParams) == before
    assert panels(figure)["scan"].get_facecolor() == (1.0, 1.0, 1.0, 1.0)


def test_a_line_along_y_says_so_and_stands_at_its_centre():
    calibration = memscal.calibrate(replace(simulated(points=33), direction="y"))
    axes = panels(calibration.plot())["scan_log"]
    assert axes.get_xlabel() == "position $y$ (mm)"
    (rod,) = [each for each in axes.patches if isinstance(each, Rectangle)]
    centre = rod.get_x() + rod.get_width() / 2
    assert centre == pytest.approx(1e3 * calibration.apparatus.parameters["centre_y"])


def test_no_line_joins_the_points_of_several_scans(make_apparatus):
    data = make_apparatus(points=33)
    configuration = {**data.process.configuration, "further_scans": [None]}
    joint = replace(data, process=replace(data.process, configuration=configuration))
    found = curve(panels(calibration_figure(joint))["scan"], "reconvolved, G")
    assert found.get_linestyle() == "None"


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
    x, y = line(panels(calibration_figure(sheared))["scan"], "reference")
    scan = sheared.reconvolution
    # The scan is the reference, blurred: they rise and fall together.
    along = np.interp(scan.x * 1e3, x, y)
    assert np.corrcoef(along, scan.u_zz)[0, 1] > 0.95


def test_both_sides_stand_above_zero_on_the_logarithmic_axis(sheared: ApparatusData):
    x, y = line(panels(calibration_figure(sheared))["scan_log"], "reconvolved, G")
    for side in (x < -0.5, x > 0.8):
        assert np.isfinite(y[side]).mean() > 0.9
