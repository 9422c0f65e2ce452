"""The calibration end to end: exact without noise, independent of its grid, and honest."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import assert_as_stated, cramer_rao
from helpers.machine import assert_same_to_rounding
from helpers.scans import CONVERSION, RING, SIGMA, TAILS, as_points, plane_error, simulated

import memscal
from memscal.calibration import fields as fields_room
from memscal.deconvolution.division import Tikhonov, regulariser_names
from memscal.errors import InputError

R = np.linspace(0, 3e-3, 121)


def check(calibration, name):
    return next(c for c in calibration.apparatus.checks if c.name == name)


@pytest.mark.parametrize("kernel", [memscal.GaussianMixture(), TAILS, RING])
def test_with_hardly_any_noise_the_truth_returns(kernel):
    apparatus = memscal.calibrate(simulated(kernel=kernel, noise=1e-6, points=129)).apparatus
    assert apparatus.conversion_constant == pytest.approx(CONVERSION, rel=1e-3)
    # A signal-to-noise ratio of a million resolves about 6 rad/mm; the ring's sharp centre
    # (0.3 mm) has five percent of its power beyond.
    limit = 0.2 if kernel is RING else 0.02
    assert plane_error(R, apparatus.radial(R), kernel.radial(R)) < limit


def test_a_scan_without_noise_is_known_to_the_error_of_the_model():
    calibration = memscal.calibrate(simulated(noise=0.0))
    failed = [check.name for check in calibration.apparatus.checks if not check.passed]
    assert failed == ["indentation"]  # of a film that is stated to be linear
    for name in ("gaussian_sigma", "gaussian_sigma_deconvolved"):
        assert calibration.apparatus.parameters[name] == pytest.approx(SIGMA, rel=1e-3)


def test_g_integrates_to_one_on_its_support_and_a_times_g_predicts_the_scan():
    calibration = memscal.calibrate(simulated())
    stored = calibration.apparatus.field
    cell = (stored.x[1] - stored.x[0]) * (stored.y[1] - stored.y[0])
    assert stored.g.sum() * cell == pytest.approx(1.0, abs=1e-12)
    record = calibration.apparatus.reconvolution
    assert np.std(record.residual / record.u_zz_errors) < 1.5


@pytest.mark.parametrize(("spacing", "extent"), [(0.5, 1.0), (1.0, 2.0)])
def test_the_result_does_not_depend_on_the_grid(monkeypatch, spacing, extent):
    scan = simulated(kernel=TAILS, noise=0.002)
    usual = memscal.calibrate(scan).apparatus
    chosen = fields_room.choose_grid

    def other(*arguments):
        choice = chosen(*arguments)
        cells = np.ceil(choice.support / (choice.spacing * spacing))
        return replace(choice, spacing=choice.support / cells, extent=choice.extent * extent)

    monkeypatch.setattr("memscal.calibration.stages.choose_grid", other)
    changed = memscal.calibrate(scan).apparatus
    for name in ("conversion_constant", "gaussian_sigma_deconvolved"):
        assert changed.parameters[name] == pytest.approx(usual.parameters[name], rel=2e-4)
    np.testing.assert_allclose(changed.radial(R), usual.radial(R), atol=2e-4 * usual.radial(0.0))


def test_the_reference_may_be_a_contact_a_table_or_a_file(tmp_path):
    scan = simulated(noise=0.001)
    contact = memscal.indent(scan.film, scan.indenter, load=1.0)
    path = tmp_path / "reference.h5"
    memscal.write_reference(contact.profile(), path)
    solved = memscal.calibrate(scan).apparatus
    for reference in (contact, contact.profile(), path, str(path)):
        other = memscal.calibrate(scan, reference=reference).apparatus
        assert other.conversion_constant == pytest.approx(solved.conversion_constant, rel=1e-5)
        assert other.gaussian_sigma == pytest.approx(solved.gaussian_sigma, rel=1e-5)
    carried = memscal.calibrate(replace(scan, reference=contact.profile())).apparatus
    assert carried.gaussian_sigma == pytest.approx(solved.gaussian_sigma, rel=1e-5)


def test_a_reference_for_another_load_is_scaled_and_a_wrong_force_is_caught():
    scan = simulated(noise=0.001)
    heavy = memscal.indent(scan.film, scan.indenter, load=2.0).profile()
    good = memscal.calibrate(scan, reference=heavy)
    assert good.apparatus.conversion_constant == pytest.approx(CONVERSION, rel=0.01)
    wrong = memscal.calibrate(scan, reference=replace(heavy, load=1.9))
    assert not check(wrong, "reference_force").passed
    assert check(wrong, "reference_force").value == pytest.approx(2 / 1.9 - 1, rel=1e-3)


def test_a_raster_is_used_as_it_is_and_agrees_with_a_line():
    setting = {"raster": True, "points": 25, "centre": (0.3e-3, -0.4e-3), "noise": 0.005}
    raster = memscal.calibrate(simulated(**setting))
    assert plane_error(R, raster.apparatus.radial(R), memscal.GaussianMixture().radial(R)) < 0.15
    assert {c.name for c in raster.apparatus.checks} >= {"axisymmetry", "reconvolution"}
    for name, parts in raster.apparatus.budget.items():
        total = np.linalg.norm(list(parts.values()))
        assert total == pytest.approx(raster.apparatus.parameters.uncertainty(name), rel=1e-9)
    # Not lifted: the field keeps the noise of its own points, which no two directions share.
    g = raster.apparatus.field.g
    assert not np.allclose(g, g[:, ::-1], atol=1e-6 * g.max())


def test_a_raster_off_its_lattice_is_refused():
    scan = simulated(raster=True, points=13)
    x = scan.x.copy()
    x[4] += 0.3e-3
    with pytest.raises(InputError, match=r"not evenly spaced(.|\n)*--method bayesian"):
        memscal.calibrate(replace(scan, x=x))
    apparatus = memscal.calibrate(replace(scan, x=x), method="evidence").apparatus
    assert apparatus.process.configuration["method"] == "bayesian"


@pytest.mark.parametrize("method", ["bayesian", "white-noise"])
@pytest.mark.parametrize(
    "options", [{"raster": True, "points": 13}, {"load": [0.5, 1.0], "points": 21}], ids=str
)
def test_single_points_give_what_rows_give(options, method):
    scan = simulated(noise=0.005, **options)
    rows, points = (memscal.calibrate(s, method=method).apparatus for s in (scan, as_points(scan)))
    assert points.conversion_constant == pytest.approx(rows.conversion_constant, rel=1e-9)
    np.testing.assert_allclose(points.field.g, rows.field.g, atol=1e-9 * rows.field.g.max())
    assert [c.name for c in points.checks] == [c.name for c in rows.checks]
    values = [[c.value for c in apparatus.checks] for apparatus in (points, rows)]
    np.testing.assert_allclose(*values, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", regulariser_names()[:6])
def test_every_method_gives_a_near_the_truth_and_says_what_it_is(name):
    apparatus = memscal.calibrate(simulated(noise=0.002), method=name).apparatus
    assert apparatus.process.configuration["method"] == name
    assert apparatus.conversion_constant == pytest.approx(CONVERSION, rel=0.05)
    assert apparatus.gaussian_sigma == pytest.approx(SIGMA, rel=0.02)


def test_a_method_may_be_an_object_and_options_reach_it():
    scan = simulated()
    named = memscal.calibrate(scan, method="tikhonov", options={"amplitude": 2.0}).apparatus
    given = memscal.calibrate(scan, method=Tikhonov(amplitude=2.0)).apparatus
    assert_same_to_rounding(named.field.g, given.field.g)
    assert named.process.configuration["options"] == {"amplitude": 2.0}
    with pytest.raises(InputError, match="set up already"):
        memscal.calibrate(scan, method=Tikhonov(), options={"amplitude": 2.0})


def test_the_sweep_is_flat_about_the_rule_s_choice():
    calibration = memscal.calibrate(simulated(noise=0.002))
    sweep = calibration.sweep(amplitudes=9, draws=2, seed=11)
    assert sweep.amplitude[[0, 4, 8]] == pytest.approx([0.1, 1.0, 10.0])
    middle = slice(2, 7)  # one decade
    assert np.ptp(sweep.conversion_constant[middle]) < 0.005 * CONVERSION
    usual = calibration.apparatus.conversion_constant
    assert sweep.conversion_constant[4] == pytest.approx(usual, rel=1e-9)
    # More noise than the rule's smooths more: the width grows, and the scan is no longer met.
    assert (np.diff(sweep.gaussian_sigma_deconvolved[4:]) > 0).all()
    assert sweep.relative_rms[8] > sweep.relative_rms[0]
    assert sweep.seed_conversion_constant.shape == (9, 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"reference": {1: 2}}, "The reference is of type dict"),
        ({"reference": [None, None]}, "differ in number: 2 and 1"),
        ({"method": 3}, "cannot divide"),
        ({"method": Tikhonov}, "that is set up"),
        ({"options": {"amplitude": "abc"}}, "must be a positive number"),
        ({"method": "white-noise-draw", "seed": -1}, "whole number"),
    ],
)
def test_what_cannot_be_used_is_refused_in_words(arguments, words):
    with pytest.raises(InputError, match=words):
        memscal.calibrate(simulated(), **arguments)


def test_a_raster_may_miss_whole_rows_and_columns():
    scan = simulated(raster=True, points=21, noise=0.002)
    u = scan.u_zz.copy()
    u[3] = np.nan
    u[:, 7] = np.nan
    u[10, 10] = np.nan
    apparatus = memscal.calibrate(replace(scan, u_zz=u)).apparatus
    bounds = cramer_rao(0.002, raster=True, points=21)
    assert_as_stated(apparatus.parameters, scan.synthetic, bounds)
    assert "42 points of the scan are missing" in "\n".join(map(str, apparatus.process.messages))


def test_lengths_and_voltages_of_any_size_give_the_same():
    large = simulated(noise=0.005, seed=3)
    small = simulated(
        film=replace(large.film, thickness=large.film.thickness * 1e-2),
        rod=memscal.Rod(radius=large.indenter.radius * 1e-2),
        kernel=memscal.GaussianMixture((1.0,), (SIGMA * 1e-2,)),
        half_range=8e-5,
        centre=(0.14e-5, 0.0),
        load=1e-4,
        conversion_constant=1e-2,
        noise=0.005,
        seed=3,
    )
    one = memscal.calibrate(large).apparatus
    other = memscal.calibrate(small).apparatus
    assert other.gaussian_sigma == pytest.approx(one.gaussian_sigma * 1e-2, rel=1e-6)
    assert other.conversion_constant == pytest.approx(one.conversion_constant * 1e5, rel=1e-6)
