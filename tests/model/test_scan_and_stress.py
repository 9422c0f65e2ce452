"""Scans and stress profiles: shapes, values, and what is kept from later changes."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.builders import make_profile, make_scan
from hypothesis import given
from hypothesis import strategies as st

from memscal import Dynamics
from memscal.errors import InputError


def test_a_line_that_is_repeated_once_is_still_repeats():
    scan = make_scan("repeats")
    one = slice(0, 1)
    single = replace(
        scan,
        u_zz=scan.u_zz[one],
        u_zz_errors=scan.u_zz_errors[one],
        normal_load=scan.normal_load[one],
        channels={},
    )
    assert single.kind == "repeats"
    assert set(replace(scan, branch=["Approach", "", "retreat"]).only_passes(2).branch.flat) == {2}


@pytest.mark.parametrize(
    ("kind", "changes", "problem"),
    [
        ("line", {"u_zz": np.zeros(32)}, r"u_zz has shape \(32,\).*\(33,\) or \(repeat, 33\)"),
        ("line", {"u_zz": np.zeros((0, 33))}, "u_zz has shape"),
        ("raster", {"u_zz": np.zeros((33, 9))}, r"\(33, 9\).*\(9, 33\), from y and x"),
        ("points", {"y": np.zeros(32)}, r"\(32, 33\), from y and x"),
        ("points", {"repeat": np.zeros(32)}, r"repeat has shape \(32,\)"),
        ("points", {"repeat": np.full(33, 0.5)}, "no whole numbers"),
        ("raster", {"repeat": np.zeros(33)}, r"repeat has shape(.|\n)*rows of a u_zz"),
        ("points", {"y": np.full(33, 1e-3)}, r"0 mm along y(.|\n)*Leave y out"),
        ("points", {"x": np.full(33, 1e-3)}, r"0 mm along x(.|\n)*direction='y'"),
        ("line", {"u_zz_errors": np.zeros(3)}, "u_zz_errors has shape"),
        ("line", {"channels": {"u_yz": np.zeros(7)}}, "u_yz has shape"),
        ("line", {"x": np.full(33, np.nan)}, "x of the scan holds a value that is not finite"),
        ("line", {"u_zz": np.full(33, np.inf)}, "infinite value"),
        ("line", {"u_zz_errors": np.full(33, -1e-6)}, "negative or infinite"),
        ("line", {"load": 0.0}, "load of the scan is 0 N"),
        ("line", {"load_uncertainty": -0.01}, "load uncertainty of the scan"),
        ("line", {"branch": [1, 2]}, r"branch has shape \(2,\)"),
        ("line", {"branch": np.full(33, 3)}, "branch of the scan holds 3,"),
        ("repeats", {"branch": ["approach", "retreat", "up"]}, "branch of the scan holds up,"),
        ("line", {"normal_load_errors": np.full(33, -0.01)}, "negative or infinite"),
        (
            "line",
            {"normal_load": None, "normal_load_errors": np.full(33, 0.02)},
            "without normal_load",
        ),
        ("line", {"sliding_direction": 1}, "motion is pressed"),
        ("line", {"sliding_direction": 0, "motion": "sliding"}, "directions of sliding"),
        ("line", {"speed": -1e-3}, "speed of the scan"),
        ("line", {"tangential_load": np.full(33, np.inf)}, "tangential_load holds an infinite"),
        ("line", {"lubrication": "wet"}, "lubrication of the scan is 'wet'"),
        ("line", {"lubrication": "dry", "lubricant": "glycerol"}, "'glycerol'.*is dry"),
        ("line", {"lubricant": "glycerol"}, "'glycerol'.*is not stated"),
    ],
)
def test_a_scan_that_contradicts_itself_is_refused(kind, changes, problem):
    with pytest.raises(InputError, match=problem):
        make_scan(kind, **changes)


@pytest.mark.parametrize(
    ("stated", "problem"),
    [
        ({"low_pass": 0.0}, "low_pass of the sensor is 0"),
        ({"low_pass_uncertainty": 0.1}, "low_pass_uncertainty, but no low_pass"),
        ({"quality": 2.0}, "quality, but no resonance"),
        ({"creep_share": 0.05}, "creep_share, but no creep_time"),
        ({"creep_share": 1.0, "creep_time": 1.0}, "creep_share of the sensor is 1"),
    ],
)
def test_dynamics_that_are_not_whole_are_refused(stated, problem):
    with pytest.raises(InputError, match=problem):
        Dynamics(**stated)


@pytest.mark.parametrize("kind", ["repeats", "points"])
def test_passes_of_one_direction_are_told_from_those_of_the_other(kind):
    forth = make_scan(kind).passes % 2 == 0
    scan = make_scan(kind, motion="sliding", sliding_direction=np.where(forth, 1, -1))
    for word, own in (("forth", forth), ("back", ~forth)):
        part = scan.only_direction(word)
        assert part.directions == (word,)
        assert np.array_equal(part.u_zz.ravel(), scan.u_zz[own], equal_nan=True)


def test_a_pass_of_both_directions_is_refused():
    scan = make_scan(motion="sliding", sliding_direction=[1, -1, 1] * 11)
    with pytest.raises(InputError, match="holds both directions"):
        scan.only_direction("forth")


def test_a_scan_keeps_its_own_copy_of_its_data():
    x = np.linspace(-1e-3, 1e-3, 33)
    u = np.ones(33)
    shear = np.ones(33)
    scan = make_scan(x=x, u_zz=u, channels={"u_xz": shear})
    x += 1.0
    u += 1.0
    shear += 1.0
    assert scan.x.max() == pytest.approx(1e-3)
    assert scan.u_zz.max() == 1.0
    assert scan.channels["u_xz"].max() == 1.0
    for array in (scan.x, scan.u_zz, scan.channels["u_xz"]):
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"load": 0.0}, "load of the stress profile is 0 N"),
        ({"r": np.linspace(1e-2, 0, 101)}, "r of the stress profile must increase"),
        ({"r": np.zeros(101)}, "r of the stress profile must increase"),
        ({"r": np.linspace(-1e-3, 1e-2, 101)}, "r of the stress profile is negative"),
        ({"sigma_zz": np.zeros(100)}, "sigma_zz of the stress profile has 100 values for 101"),
        ({"sigma_rz": np.zeros(102)}, "sigma_rz of the stress profile has 102 values for 101"),
        ({"sigma_zz": np.full(101, np.nan)}, "sigma_zz of the stress profile holds"),
        ({"sigma_zz": np.zeros((101, 1))}, "sigma_zz of the stress profile has shape"),
        ({"r": [], "sigma_zz": []}, r"r of the stress profile has shape \(0,\)"),
        ({"r": 1.0}, r"r of the stress profile has shape \(\)"),
    ],
)
def test_a_profile_that_contradicts_itself_is_refused(changes, problem):
    with pytest.raises(InputError, match=problem):
        make_profile(**changes)


@given(
    seed=st.integers(0, 2**16),
    count=st.integers(3, 60),
    axis=st.booleans(),
    curvature=st.floats(-0.9, 2.0),
)
def test_the_force_of_uneven_radii_is_exact_where_a_spline_is(seed, count, axis, curvature):
    """A stress a + b r^2 makes sigma r an odd cubic, which the mirrored spline is."""
    steps = np.random.default_rng(seed).uniform(0.05, 1.0, count)
    r = np.cumsum(steps) - (steps[0] if axis else 0.0)
    reach = r[-1]
    profile = make_profile(r=r, sigma_zz=1.0 + curvature * (r / reach) ** 2, sigma_rz=None)
    assert profile.force == pytest.approx(np.pi * reach**2 * (1.0 + curvature / 2), rel=1e-9)


def test_a_single_radius_carries_the_force_of_an_even_pressure_or_none():
    even = make_profile(r=[2e-3], sigma_zz=[1e5], sigma_rz=None)
    assert even.force == pytest.approx(np.pi * 4e-6 * 1e5)
    assert make_profile(r=[0.0], sigma_zz=[1e5], sigma_rz=None).force == 0.0
