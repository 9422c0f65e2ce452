"""compare(): from scans and an artifact to friction, its checks, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest

import memscal
from memscal.errors import InputError
from memscal.friction.calculated import amontons_family
from memscal.friction.compare import compare_measured
from memscal.friction.likelihood import load_points, points_of, predict, sensor_of

FRICTION = (0.0, 0.1, 0.2, 0.3, math.inf)
TRUTH = 0.2


@pytest.fixture(scope="module")
def made():
    return memscal.simulate_experiment(friction=TRUTH, loads=[0.69, 2.75], seed=11)


@pytest.fixture(scope="module")
def apparatus(made):
    return memscal.calibrate(made.rod, method="evidence").apparatus


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return tmp_path_factory.mktemp("contacts")


@pytest.fixture(scope="module")
def found(made, apparatus, kept):
    return memscal.compare(
        [made.dry, made.lubricated],
        apparatus,
        friction=FRICTION,
        loading="incremental",
        macroscopic=1.6,
        macroscopic_uncertainty=0.1,
        cache=kept,
    )


@pytest.fixture(scope="module")
def families(made, kept):
    """The contacts of the comparison, from its folder."""
    family = amontons_family(
        made.dry.film, made.dry.indenter, [0.69, 2.75], friction=FRICTION, reach=24e-3, cache=kept
    )
    return {"incremental": family}


def scaled(scan, factor, noise=1.0):
    return replace(scan, u_zz=factor * scan.u_zz, u_zz_errors=noise * scan.u_zz_errors)


def failed(found):
    return {check.name for check in found.checks if not check.passed}


def test_what_is_calculated_is_the_contact_blurred_by_g(found, apparatus, made):
    one = found.loads["incremental"][1]
    r = np.linspace(0.0, 30e-3, 1200)
    contact = memscal.indent(made.dry.film.expected, made.dry.indenter, load=2.75, friction=0.3)
    blurred = apparatus.convolve(r, contact.base_stress(r))
    expected = np.interp(one.profile.r, r, blurred)
    assert one.calculated[FRICTION.index(0.3)] == pytest.approx(expected, abs=1e-3 * blurred[0])
    assert one.p_max[FRICTION.index(0.3)] == pytest.approx(blurred[0], rel=1e-3)
    assert one.p0_max == one.p_max[0]
    assert one.ratio == pytest.approx(one.s_max / one.p0_max)


def test_chi_square_of_the_calculated_profiles_is_that_of_the_likelihood(found):
    for one in found.loads["incremental"]:
        assert one.chi_square.shape == one.p_values.shape == (len(FRICTION),)
        assert one.deviance.min() >= 0
        assert one.degrees == one.by_profile.degrees + 1
        where = [int(np.flatnonzero(one.by_profile.values == mu)[0]) for mu in FRICTION]
        along = one.by_profile.deviance
        assert along[where] - along.min() == pytest.approx(one.deviance)


def test_a_stress_beyond_full_stick_fails_checks(made, apparatus, families):
    """A gain of 30 % that the rod scan did not have."""
    wrong = [scaled(scan, 1.3) for scan in (made.dry, made.lubricated)]
    measured = memscal.measure_stress(wrong, apparatus)
    found = compare_measured(measured, apparatus, families, lubricated_friction=None)
    assert {"applied_force_all", "bracketing_1", "bracketing_2"} <= failed(found)
    assert found.joint["dry"]["incremental"].value is None


def test_noise_that_is_understated_fails_the_chi_square(made, apparatus, families):
    wrong = scaled(made.dry, 1.0, noise=0.25)
    found = compare_measured(memscal.measure_stress(wrong, apparatus), apparatus, families)
    assert "joint_chi_square_dry" in failed(found)
    assert found.joint["dry"]["incremental"].p_value < 1e-6


def over_a_plane(made):
    axis = np.linspace(-5e-3, 5e-3, 9)
    u = np.exp(-np.add.outer(axis**2, axis**2) / 2e-6)
    return replace(made.rod, x=axis, y=axis, u_zz=u, u_zz_errors=None, indenter=made.dry.indenter)


def on_another_film(made):
    film = replace(made.dry.film, young_modulus=2.3e6)
    return [made.lubricated, replace(made.dry, film=film)]


@pytest.mark.parametrize(
    ("scans", "words"),
    [
        (over_a_plane, r"was scanned over x and y(.|\n)*line scan"),
        (lambda made: made.rod, r"made with a rod, not with a sphere[\s\S]*calibrate"),
        (on_another_film, "another film or sphere"),
        (lambda made: replace(made.dry, motion="sliding"), "sliding indenter"),
    ],
)
def test_scans_that_cannot_be_compared_are_refused(made, apparatus, scans, words):
    with pytest.raises(InputError, match=words):
        memscal.compare(scans(made), apparatus)


def test_a_stress_under_a_sliding_sphere_is_refused_too(made, apparatus):
    measured = memscal.measure_stress(replace(made.dry, motion="sliding"), apparatus)
    with pytest.raises(InputError, match="sliding indenter"):
        memscal.compare(measured, apparatus)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"friction": [0.2]}, "nothing to choose from"),
        ({"loading": ()}, "No loading"),
        ({"loading": "sideways"}, "sideways"),
        ({"interface": True}, "macroscopic friction coefficient is not given"),
        ({"macroscopic_uncertainty": 0.1}, "macroscopic friction coefficient is not given"),
        ({"macroscopic": -0.1}, "macroscopic"),
    ],
)
def test_options_that_make_no_sense_are_refused(made, apparatus, options, words):
    with pytest.raises(InputError, match=words):
        memscal.compare(made.lubricated, apparatus, **options)


def test_lubricated_loads_are_fitted_beside_the_dry_ones(made, apparatus, families, found):
    measured = memscal.measure_stress([made.dry, made.lubricated], apparatus)
    by = [
        compare_measured(measured, apparatus, families, lubricated_friction=width)
        for width in (0.0, 0.015, 0.03, None)
    ]
    held, usual, wide, apart = (each.joint["dry"]["incremental"] for each in by)
    assert [each.beside for each in (held, usual, wide, apart)] == [2, 2, 2, 0]
    assert held.interval.holds(TRUTH)
    for source in ("apparatus", "young_modulus", "thickness"):
        assert held.budget[source] < apart.budget[source] / 2, source
    assert found.joint["dry"]["incremental"].interval == usual.interval
    # Without friction the dry coefficient is less by what moves it; the unknown is in the budget.
    assert held.value < usual.value < wide.value
    assert usual.interval.low <= held.interval.low
    assert apart.by_lubricated is None
    assert "lubricated_friction" not in held.budget
    assert usual.budget["lubricated_friction"] < wide.budget["lubricated_friction"]
    assert held.standard_uncertainty < usual.standard_uncertainty < wide.standard_uncertainty


def test_how_far_lubricated_friction_moves_the_dry_coefficient(
    made, apparatus, families, monkeypatch
):
    measured = memscal.measure_stress([made.dry, made.lubricated], apparatus)

    def estimate(at):
        def one_value(values, _):
            return np.eye(values.size)[np.abs(values - at).argmin()]

        monkeypatch.setattr("memscal.friction.effective.half_normal_weights", one_value)
        found = compare_measured(measured, apparatus, families, lubricated_friction=0.0)
        return found.joint["dry"]["incremental"]

    none = estimate(0.0)
    values = none.values
    little = float(values[np.abs(values - 0.01).argmin()])
    change = (estimate(little).value - none.value) / little
    # One that is held at none though it is there lowers the coefficient by as much.
    assert none.by_lubricated == pytest.approx(-change, rel=0.2)


def test_what_passes_the_check_moves_the_dry_coefficient_by_one_uncertainty(found):
    limit = next(one.limit for one in found.checks if one.name == "lubricated_frictionless")
    moved = []
    for loading, dry in found.joint["dry"].items():
        known = np.linalg.norm([*found.joint["lubricated"][loading].budget.values()])
        beyond = known * np.sqrt(limit) - 0.015 * np.sqrt(2 / np.pi)
        moved.append(-dry.by_lubricated * beyond / dry.standard_uncertainty)
    assert max(moved) == pytest.approx(1.0)


def test_a_failed_check_leaves_the_fit_as_it_is(made, apparatus, families):
    wrong = [made.dry, replace(made.dry, lubrication="lubricated")]
    refused = memscal.measure_stress(wrong, apparatus)
    chosen = compare_measured(refused, apparatus, families)
    assert "lubricated_frictionless" in failed(chosen)
    assert chosen.joint["dry"]["incremental"].beside == 2
    with pytest.raises(InputError, match="frictionless"):
        memscal.compare(refused, apparatus, lubricated="wet")
    with pytest.raises(InputError, match="a friction of their own"):
        memscal.compare(refused, apparatus, lubricated="apart", lubricated_friction=0.03)


def test_a_budget_adds_up_to_its_total(made, apparatus):
    found = memscal.compare([made.dry, made.lubricated], apparatus, friction=FRICTION)
    joint = found.joint["dry"]
    loads = [one.by_profile for loads in found.loads.values() for one in loads]
    stated = [one for one in (*joint.values(), *loads) if one.standard_uncertainty is not None]
    assert len(stated) > 2
    for one in stated:
        assert np.linalg.norm([*one.budget.values()]) == pytest.approx(one.standard_uncertainty)
    assert "loading" in joint["total"].budget


def test_each_scan_has_a_gain_of_its_own(made, apparatus, families):
    scans = [made.dry, made.lubricated, scaled(made.dry, 1.01)]
    measured = memscal.measure_stress(scans, apparatus)
    points = points_of(measured.profiles)
    assert [one.scan.tolist() for one in points[::2]] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    sensor = sensor_of(apparatus, families["incremental"], 8e-3, measured.scans)
    column = predict(points[2], sensor, families["incremental"].at(0.2), 0).columns
    signal = predict(points[2], sensor, families["incremental"].at(0.2), 0).signal
    assert column["between_scan_gain"][0, :, 1] == pytest.approx(0.005 * signal[0])
    assert not column["between_scan_gain"][..., [0, 2]].any()
    # No load cell is named: each scan has a load of its own.
    assert column["load"].shape[-1] == 3


def test_a_noise_that_was_estimated_has_no_chi_square(made, apparatus, families):
    scans = [replace(scan, u_zz_errors=None) for scan in (made.dry, made.lubricated)]
    found = compare_measured(memscal.measure_stress(scans, apparatus), apparatus, families)
    assert not found.measured.noise_stated
    names = {check.name.rstrip("_1234") for check in found.checks}
    assert "bracketing" in names
    assert not {name for name in names if "chi_square" in name}


def test_an_error_of_the_film_that_sensor_and_contact_share_counts_once(made, apparatus, families):
    # A film that is thicker than stated: the calibration's A G and the contacts err together.
    family = families["incremental"]
    film = made.dry.film
    sensor = sensor_of(apparatus, family, 8e-3, [made.dry])
    assert set(sensor.shared) == {"young_modulus", "thickness", "poisson_ratio"}
    points = load_points(memscal.measure_stress(made.dry, apparatus).profiles[0])
    found = predict(points, sensor, family.at(0.2), 0)
    u = film.thickness_uncertainty or 0.0
    thick = replace(film, thickness=film.thickness + u)
    other = memscal.calibrate(replace(made.rod, film=thick), method="evidence").apparatus
    thicker = amontons_family(thick, made.dry.indenter, [0.69], friction=[0.2], reach=24e-3)
    theirs = sensor_of(other, thicker, 8e-3, [made.dry])
    truth = predict(points, theirs, thicker, 0).signal - found.signal
    change = found.columns["thickness"][0, :, 0]
    assert np.abs(change - truth[0]).max() < 0.1 * np.abs(truth).max()
    # Of another film, each has its own.
    assert not sensor_of(apparatus, family, 8e-3, [replace(made.dry, film=thick)]).shared


def stated(thing, **factors):
    return replace(thing, **{name: by * getattr(thing, name) for name, by in factors.items()})


def pressed_by(factor):
    return lambda scan: {"load": factor * scan.load, "normal_load": factor * scan.normal_load}


def read_with_gain(factor):
    return lambda scan: {name: factor * getattr(scan, name) for name in ("u_zz", "u_zz_errors")}


def by_night(changes, name, factor):
    """One of the trials that take too long for every day."""
    return pytest.param(changes, {name: factor}, marks=pytest.mark.full_study)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        (lambda scan: {"indenter": stated(scan.indenter, radius=2)}, {"radius": 0.5}),
        by_night(
            lambda scan: {"film": stated(scan.film, young_modulus=1.5)}, "young_modulus", 0.667
        ),
        by_night(lambda scan: {"film": stated(scan.film, thickness=1.3)}, "thickness", 0.769),
        by_night(pressed_by(1.2), "load", 0.833),
        by_night(read_with_gain(1.2), "gain", 1.2),
        (lambda scan: {"u_zz": scan.u_zz * (1 + np.sin(scan.x / 1e-3))}, {}),
    ],
)
def test_the_one_input_is_named_that_is_not_as_stated(made, apparatus, kept, changes, named):
    wrong = [replace(scan, **changes(scan)) for scan in (made.dry, made.lubricated)]
    found = memscal.compare(
        wrong, apparatus, friction=FRICTION, loading="incremental", override=True, cache=kept
    )
    assert "joint_chi_square_dry" in failed(found)
    factors = found.to_dict()["wrong_inputs"]
    for name, factor in named.items():
        assert factors[name] == pytest.approx(factor, rel=0.06)
        words = name.replace("young_", "Young's ")
        assert f"{words} of {factors[name]:.2f} times" in found.answer()
    if "radius" in named:  # they are degenerate
        assert factors["young_modulus"] == pytest.approx(1 / factors["radius"], rel=0.01)
    if not named:
        assert factors == {}
        assert "nor does a factor on radius" in found.answer()
    assert found.answer().startswith("No friction coefficient explains the dry")
    assert "μ" not in found.answer()
    for joint in found.to_dict()["joint"]:
        if joint["lubrication"] == "dry":
            assert joint["interval"]["low"] is joint["interval"]["high"] is joint["value"] is None
            assert "No friction coefficient" in joint["reason"]
    labels = found.plot().axes[-1].get_legend_handles_labels()[1]
    assert "all loads: none explains them" in labels
