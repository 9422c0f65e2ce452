"""Calibration of an array against an independent layer: what is found, named, left out, refused."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.true_arrays import Errors, simulated_scan
from scipy.interpolate import CubicSpline

import memscal
from memscal import Dynamics, StressSensor
from memscal.errors import FitError, InputError, MemscalError
from memscal.extensions.arrays.presses import sorted_readings


def deviations(array, true):
    """Errors of A and of the estimated crosstalk over their uncertainties."""
    n = len(array.sensors)
    u = array.uncertainties()
    near = array.estimated
    of_a = np.log(array.conversion_constants / true.conversion_constants) / u[:n]
    of_c = (array.crosstalk - true.crosstalk)[near] / u[3 * n : 3 * n + near.sum()]
    return of_a, of_c


@pytest.mark.parametrize("shape", [(1, 6), (3, 3)], ids=["row", "grid"])
@pytest.mark.parametrize("kernel", ["gaussian", "disc", "tails"])
def test_an_array_is_found(shape, kernel):
    scan, true = simulated_scan(*shape, kernel=kernel, seed=3)
    calibration = memscal.calibrate_array(scan)
    array = calibration.array
    of_a, of_c = deviations(array, true)
    # All by one scan, of which load and thickness are common to all.
    assert np.sqrt(np.mean(of_a**2)) < 3.5
    assert np.sqrt(np.mean(of_c**2)) < 3.5
    assert np.all(abs(array.centres - true.centres)[:, 0] < 10e-6)
    assert np.isnan(array.centres[:, 1]).all() == (shape[0] == 1)
    assert array.sensors == true.sensors
    assert np.allclose(np.diag(array.crosstalk), 1)
    near = array.crosstalk[array.estimated]
    assert abs(near.mean() - 0.01) < 0.005


def test_sensors_share_the_errors_of_load_and_film():
    array = memscal.calibrate_array(simulated_scan(1, 6, seed=1)[0]).array
    a = array.conversion_constants
    relative = array.covariance / np.outer(a, a)
    ratio = relative[0, 0] + relative[1, 1] - 2 * relative[0, 1]
    assert ratio < 0.2 * relative[0, 0]
    assert np.allclose(array.effects["load"][:6], -0.01)


def test_what_is_wrong_with_a_sensor_is_named_and_moves_no_other():
    plain = memscal.calibrate_array(simulated_scan(1, 8, seed=5)[0]).array
    errors = Errors(dead=(2,), ceiling={5: 0.6}, missing=0.02)
    scan = simulated_scan(1, 8, seed=5, errors=errors)[0]
    calibration = memscal.calibrate_array(scan)
    array = calibration.array
    assert array.used.tolist() == [i != 2 for i in range(8)]
    assert array.failing["dead_taxels"] == ("T02",)
    assert array.failing["saturation"] == ("T05",)
    assert not calibration.passed
    assert any("T02" in m.text for m in array.process.messages if m.severity == "warning")
    used = array.used
    moved = np.log(array.conversion_constants / plain.conversion_constants)[used]
    assert np.all(abs(moved) < plain.uncertainties()[:8][used])


def test_a_silent_sensor_that_is_stated_is_no_fault():
    scan = simulated_scan(1, 4, seed=2)[0]
    array = memscal.calibrate_array(replace(scan, used=[True, True, False, True])).array
    assert array.used.tolist() == [True, True, False, True]
    assert array.failing["dead_taxels"] == ()
    assert np.isnan(array.conversion_constants[2])


def test_crosstalk_and_own_shapes_are_one_thing_to_a_dense_row():
    scan, true = simulated_scan(1, 8, pitch=1e-3, seed=1)
    calibration = memscal.calibrate_array(scan, kernel="own")
    check = next(c for c in calibration.checks if c.name == "crosstalk_identified")
    assert not check.passed
    assert not any("Crosstalk is" in message.text for message in calibration.array.messages)
    of_a, _ = deviations(calibration.array, true)
    assert np.sqrt(np.mean(of_a**2)) < 3


@pytest.mark.parametrize(
    ("crosstalk", "count"),
    [("none", 0), ("nearest", 6), ("full", 12), ([("T00", "T01"), ("T03", "T02")], 2)],
)
def test_pairs_are_chosen(crosstalk, count):
    scan = simulated_scan(1, 4, seed=2, crosstalk=0.0)[0]
    array = memscal.calibrate_array(scan, crosstalk=crosstalk).array
    assert array.estimated.sum() == count
    assert np.count_nonzero(array.crosstalk) == 4 + count


def test_pairs_that_read_nothing_of_each_other_do_not_hide_the_crosstalk_of_neighbours():
    names = [f"T0{i}" for i in range(5)]
    apart = abs(np.subtract.outer(range(5), range(5)))
    near = [(names[i], names[j]) for i, j in np.argwhere((apart > 0) & (apart < 3))]
    for seed, crosstalk in enumerate(["full", near]):
        scan, true = simulated_scan(1, 5, seed=seed, crosstalk=0.02)
        array = memscal.calibrate_array(scan, crosstalk=crosstalk).array
        of_a, of_c = deviations(array, true)
        assert np.sqrt(np.mean(of_a**2)) < 3.5
        assert np.sqrt(np.mean(of_c**2)) < 3.5
        assert np.all(array.crosstalk[apart == 1] > 0.01)


def test_stated_errors_of_presses_may_be_larger_than_the_noise():
    for seed in range(4):
        errors = Errors(noise=0.002, load=0.01)
        scan, true = simulated_scan(1, 6, seed=seed, errors=errors)
        array = memscal.calibrate_array(replace(scan, u_zz_errors=None)).array
        of_a, _ = deviations(array, true)
        assert np.sqrt(np.mean(of_a**2)) < 3.5
        noise = np.sqrt(np.diag(array.noise)) / np.max(scan.u_zz)
        assert np.all(abs(noise / 0.002 - 1) < 0.5)


@pytest.mark.parametrize("silent", [[1], [0, 1, 2, 3]], ids=["one", "all"])
def test_a_pass_without_readings_changes_nothing_else(silent):
    scan = simulated_scan(1, 4, repeats=3, seed=7)[0]
    u = scan.u_zz.copy()
    u[silent, 1] = np.nan
    plain, lacking = (
        memscal.calibrate_array(replace(scan, u_zz=readings)).array for readings in (scan.u_zz, u)
    )
    moved = np.log(lacking.conversion_constants / plain.conversion_constants)
    assert np.all(abs(moved) < lacking.uncertainties()[:4])


@pytest.mark.parametrize("count", [2, 4, 7])
def test_a_sensor_near_the_end_of_the_scan_is_not_dead(count):
    scan, _ = simulated_scan(1, count, beyond=1.0, seed=count, errors=Errors(noise=0.002))
    array = memscal.calibrate_array(scan).array
    assert array.used.all()
    assert len(array.failing["ends_covered"]) == 2


def test_a_dead_sensor_of_an_even_row_is_where_it_should_be():
    scan = simulated_scan(1, 8, seed=5, errors=Errors(dead=(3,)))[0]
    unplaced = replace(scan, layout=None, layout_uncertainty=None)
    a, of_unplaced = (
        memscal.calibrate_array(each).array.conversion_constants for each in (scan, unplaced)
    )
    # Without the place of the dead one A is 3 % too large.
    np.testing.assert_allclose(of_unplaced, a, rtol=2e-3)


def test_what_is_stated_of_the_base_is_counted_and_what_is_not_is_named():
    scan = simulated_scan(1, 4, seed=2)[0]
    plain = memscal.calibrate_array(scan).array
    stated = replace(
        scan,
        base_slip_uncertainty=0.3,
        shear_sensitivity_uncertainty=0.1e-3,
        roundness_uncertainty=0.2,
    )
    array = memscal.calibrate_array(stated).array
    # One sensor alone, of another estimator, has the same share of its A by the base's slip; its
    # shape takes up half of the response to shear.
    alone = memscal.calibrate(stated.of_sensor(1), method="bayesian").apparatus
    share = alone.budget["conversion_constant"]["base_slip"] / alone.conversion_constant
    np.testing.assert_allclose(abs(array.effects["base_slip"][:4]), share, rtol=0.05)
    assert np.all(abs(array.effects["shear_sensitivity"][:4]) > 0.01)
    assert np.all(array.uncertainties()[:4] > 2 * plain.uncertainties()[:4])
    said = " ".join(message.text for message in array.messages)
    assert "roundness_uncertainty" in said
    assert "base_slip" not in said


@pytest.mark.parametrize("shape", [(1, 4), (3, 3)], ids=["row", "grid"])
def test_a_layout_is_where_the_sensors_are_or_fails(shape):
    scan = simulated_scan(*shape, seed=4)[0]
    layout = scan.layout
    n = len(layout)
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    for places, uncertainty, passes in (
        (1.2 * layout @ turn + 1e-3, None, True),
        (layout[[1, 0, *range(2, n)]], None, False),
        (-layout, None, False),
        (1e3 * layout, 20e-3, False),
        (1e-3 * layout, 20e-9, False),
        (np.zeros((n, 2)), None, False),
    ):
        errors = None if uncertainty is None else np.full((n, 2), uncertainty)
        wrong = replace(scan, layout=places, layout_uncertainty=errors)
        calibration = memscal.calibrate_array(wrong)
        assert calibration.passed == passes
        assert ("T00" in calibration.array.failing["layout"]) != passes


def test_a_layout_with_sensors_beside_the_line_fails():
    scan = simulated_scan(1, 6, seed=4)[0]
    for beside, passes in ((10e-6, True), (0.3e-3, False)):
        zigzag = scan.layout + np.outer((-1.0) ** np.arange(6), [0.0, beside])
        array = memscal.calibrate_array(replace(scan, layout=zigzag)).array
        assert (array.failing["layout"] == ()) == passes


def test_widths_are_compared_about_a_common_shape_whatever_else_is():
    scan = simulated_scan(3, 3, seed=2)[0]
    common, auto = (
        next(
            check.value
            for check in memscal.calibrate_array(scan, kernel=kernel).checks
            if check.name == "common_kernel"
        )
        for kernel in ("common", "auto")
    )
    # Eight degrees of freedom.
    assert auto > 1
    assert abs(auto - common) < 1


def test_unstated_errors_of_presses_fail_their_check():
    jitter = simulated_scan(1, 6, seed=4, errors=Errors(noise=0.002, place=30e-6, load=0.02))[0]
    assert memscal.calibrate_array(jitter).passed
    unstated = replace(jitter, x_errors=None, normal_load=None, normal_load_errors=None)
    checks = memscal.calibrate_array(unstated).checks
    assert "press_errors" in [check.name for check in checks if not check.passed]


def test_means_along_the_scan_are_brought_to_their_places():
    scan = simulated_scan(1, 4, seed=1, errors=Errors(noise=0.001))[0]
    length = 0.5e-3
    profile = CubicSpline(scan.x, scan.u_zz, axis=1)
    shifts = np.linspace(-0.5, 0.5, 41) * length
    mean = np.mean([profile(scan.x + shift) for shift in shifts], axis=0)
    a, unstated, stated = (
        memscal.calibrate_array(
            replace(scan, u_zz=u, averaging_length=d)
        ).array.conversion_constants
        for u, d in ((scan.u_zz, None), (mean, None), (mean, length))
    )
    assert np.all(unstated / a - 1 > 5e-3)
    assert np.all(abs(stated / a - 1) < 1.5e-3)


def test_a_line_along_y_tells_no_x():
    scan = simulated_scan(1, 4, seed=1)[0]
    turned = replace(scan, direction="y", layout=scan.layout[:, ::-1])
    calibration = memscal.calibrate_array(turned)
    plain = memscal.calibrate_array(scan).array
    assert calibration.passed
    assert np.isnan(calibration.array.centres[:, 0]).all()
    assert np.allclose(calibration.array.centres[:, 1], plain.centres[:, 0])


def refused_scans():
    scan = simulated_scan(1, 3, seed=1)[0]
    yield "single", scan.of_sensor(0), {}, InputError, "single sensor"
    yield "kernel", scan, {"kernel": "shared"}, MemscalError, "common"
    yield "crosstalk", scan, {"crosstalk": "nearst"}, MemscalError, "nearest"
    yield "pair", scan, {"crosstalk": [("T00", "T1")]}, MemscalError, "T01"
    yield "itself", scan, {"crosstalk": [("T01", "T01")]}, MemscalError, "no other sensor T01"
    slow = StressSensor(dynamics=Dynamics(low_pass=3.0))
    for pairs in (None, ["T00"], [("T00",)]):
        yield f"{pairs}", scan, {"crosstalk": pairs}, InputError, "pairs of names"
    yield "beside", replace(scan, line_offset=0.5e-3), {}, InputError, "0.5 mm beside"
    yield "dynamics", replace(scan, sensor=slow), {}, InputError, "stress_sensor/dynamics"
    yield "silent", replace(scan, u_zz=0 * scan.u_zz), {}, FitError, "3 sensors"
    yield "falling", replace(scan, u_zz=-scan.u_zz), {}, FitError, "change their sign"
    yield "source", scan, {"reference": "point"}, InputError, "a source is given in their place"
    yield "none", None, {}, InputError, "None, is that of a single sensor or of none"


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"layout_uncertainty": -1e-5}, "layout_uncertainty .* 0 possible values"),
        ({"layout_uncertainty": np.inf}, "layout_uncertainty .* 0 possible values"),
        ({"used": [2, -3, 1]}, "used .* 1 possible values"),
        ({"board": [0, np.nan, 1]}, "board .* 2 possible values"),
        ({"board": ["A", "B", "C"]}, "board of the scan is no array of numbers"),
        ({"layout": np.full((3, 2), 1e300)}, "layout of the scan is 1e.300"),
        ({"reading_low": 1.0, "reading_high": -1.0}, "reading_low .* is not below"),
        ({"motion": "rest"}, "record at rest is of 3 sensors"),
    ],
)
def test_what_no_sensors_have_is_no_scan_of_an_array(stated, words):
    readings = np.ones((3, 5)) * np.arange(5)
    with pytest.raises(InputError, match=words):
        memscal.Scan(sensors=("A", "B", "C"), x=np.arange(5.0) * 1e-3, u_zz=readings, **stated)


@pytest.mark.parametrize(
    ("scan", "options", "error", "word"),
    [pytest.param(*case[1:], id=case[0]) for case in refused_scans()],
)
def test_refused(scan, options, error, word):
    with pytest.raises(error, match=word):
        memscal.calibrate_array(scan, **options)


def test_dead_sensors_that_drift_are_dead(seed):
    rng = np.random.default_rng(seed)
    scan, _ = simulated_scan()
    dead = 400
    drift = np.linspace(-0.5, 0.5, scan.x.size) * rng.normal(0.0, 0.01, (dead, 1))
    silent = scan.u_zz.max() * (drift + rng.normal(0.0, 0.005, (dead, scan.x.size)))
    u = np.vstack([*[scan.u_zz] * 7, silent])
    many = memscal.Scan(x=scan.x, u_zz=u, sensors=[f"T{i}" for i in range(len(u))])
    found = sorted_readings(many)
    np.testing.assert_array_equal(found.dead, np.arange(len(u)) >= 70)


def test_a_rod_that_is_dragged_over_an_array_is_refused():
    scan = replace(simulated_scan(1, 6, seed=1)[0], motion="sliding", sliding_direction=-1.0)
    with pytest.raises(InputError, match="sliding indenter"):
        memscal.calibrate_array(scan)
