"""The model's assumptions: false alarms are as rare as stated, and real departures are found."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import outside
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.outside import ROUND, line
from helpers.scans import CENTRE, CONVERSION, as_points, estimated, simulated
from scipy.stats import binom, chi2

import memscal
from memscal import Scan
from memscal.estimation.model_tests import axisymmetry_test, linearity_test, symmetry_test
from memscal.estimation.runs import hysteresis_test
from memscal.model.checks import chi_square_limit

BOTH = {"repeats": 2, "points": 33, "branch": ["approach", "retreat"]}


@pytest.mark.parametrize(
    ("test", "options"),
    [
        (symmetry_test, {}),
        (linearity_test, {"load": [0.5, 1.5], "points": 33}),
        (hysteresis_test, BOTH),
        (hysteresis_test, BOTH | {"state_noise": False}),
    ],
)
def test_a_true_hypothesis_is_rejected_as_rarely_as_chance_demands(test, options):
    scans = 80 if FULL else 16
    extra = [test(estimated(simulated(seed=seed, **options))) for seed in range(scans)]
    chances = [
        columns.outcome.p_value if test is hysteresis_test else chi2.sf(columns.fall, columns.count)
        for columns in extra
    ]
    rejected = sum(chance < 0.1 for chance in chances)
    # A tenth of good scans fall below p = 0.1, within what a binomial allows once in 1e6.
    low, high = binom.ppf([1e-6, 1 - 1e-6], scans, 0.1)
    assert low <= rejected <= high


def test_a_tilted_rod_is_found():
    scan = simulated(noise=0.002)
    side = scan.x - 0.14e-3
    bump = 0.05 * scan.u_zz.max() * (side / 1e-3) * np.exp(-((side / 1.2e-3) ** 2))
    odd = symmetry_test(estimated(replace(scan, u_zz=scan.u_zz + bump)))
    assert odd.fall > chi_square_limit(odd.count)


def test_linearity_and_hysteresis_are_tested_only_where_loads_and_branches_differ():
    assert linearity_test(estimated(simulated())) is None
    for branch in (["approach", ""], ["retreat", "retreat"]):
        assert hysteresis_test(estimated(simulated(**BOTH | {"branch": branch}))) is None


def hysteretic(seed, conversion=0.0, play=0.0, step=0.0):
    """Two scans, of sensors that differ in A and centre, as approach and retreat of one."""
    rows = [
        simulated(
            seed=2 * seed + i,
            noise=0.002,
            baseline=0.0,
            drift=0.0,
            conversion_constant=CONVERSION * (1 + side * conversion),
            centre=(CENTRE + side * play, 0.0),
        )
        for i, side in enumerate((0.5, -0.5))
    ]
    u, errors = (np.stack([getattr(row, name) for row in rows]) for name in ("u_zz", "u_zz_errors"))
    u += np.array([[0.5], [-0.5]]) * step
    return replace(rows[0], u_zz=u, u_zz_errors=errors, branch=BOTH["branch"])


@pytest.mark.parametrize("differences", [(0.02, 0.0, 0.0), (0.0, -20e-6, 0.0), (0.0, 0.0, 1e-4)])
def test_a_hysteresis_is_found_and_measured_within_its_uncertainty(differences):
    scans = 40 if FULL else 8
    extra = [hysteresis_test(estimated(hysteretic(seed, *differences))) for seed in range(scans)]
    assert all(columns.outcome.value > columns.outcome.limit for columns in extra)
    truth = np.insert(differences, 1, 0.0)  # of the width
    z = np.array([(columns.values - truth) / columns.errors for columns in extra])
    low, high = root_mean_square_range(scans, 1e-6)
    scatter = root_mean_square(z)
    assert np.all((low < scatter) & (scatter < high))
    found = hysteresis_test(estimated(as_points(hysteretic(0, *differences))))
    np.testing.assert_allclose(found.values, extra[0].values, rtol=1e-6, atol=1e-9)


PASSES = line(step=0.5e-3)


def passes(
    seed,
    *,
    pairs=1,
    lag=0.0,
    creep=0.0,
    play=0.0,
    wander=0.0,
    louder=1.0,
    offset=0.0,
    stated=True,
    named=True,
):
    """Passes forth and back over a sensor, each pair with its own disturbances."""
    side = np.tile([1.0, -1.0], pairs)
    rng = np.random.default_rng(seed)
    shift = play * side + wander * rng.standard_normal(side.size)
    noise = np.full(side.size, 0.003)
    noise[-1] *= louder
    rows = []
    for own, moved in zip(lag * side, shift, strict=True):
        at_once = ROUND.voltages(PASSES + moved)
        late = replace(ROUND, lag=own).voltages(PASSES + moved)
        rows.append((1 - creep) * at_once + creep * late)
    u = np.array(rows)
    top = u.max()
    u[-1] += offset * top
    u += top * noise[:, None] * rng.standard_normal(u.shape)
    return Scan(
        x=PASSES,
        u_zz=u,
        u_zz_errors=np.full(u.shape, 0.003 * top) if stated else None,
        load=ROUND.load,
        indenter=memscal.Rod(radius=ROUND.radius),
        film=outside.FILM,
        branch=BOTH["branch"] * pairs if named else None,
    )


CREEP = {"creep": 0.05, "lag": 0.5e-3}


@pytest.mark.parametrize(
    ("given", "failed", "centre"),
    [
        ({}, "", None),
        ({}, "", "per-repeat"),
        ({"pairs": 3, "wander": 30e-6}, "", None),
        (CREEP, "hysteresis", "common"),
        (CREEP, "hysteresis", None),
        (CREEP | {"stated": False}, "hysteresis", "per-repeat"),
        (CREEP | {"pairs": 2}, "hysteresis", None),
        ({"play": -20e-6}, "hysteresis", None),
        ({"offset": 0.3, "named": False}, "offset_agreement", "per-repeat"),
        ({"offset": 0.3, "named": False, "stated": False, "pairs": 2}, "offset_agreement", None),
        ({"louder": 4.0, "named": False, "stated": False}, "noise_agreement", None),
    ],
)
def test_what_differs_between_passes_fails_its_check_and_no_other(given, failed, centre):
    found = memscal.calibrate(passes(1, **given), centre=centre, method="bayesian", other=False)
    checks = {check.name: check for check in found.apparatus.checks}
    names = {"hysteresis", "offset_agreement", "noise_agreement"}
    assert [name for name in names & {*checks} if not checks[name].passed] == [*failed.split()]
    if failed == "hysteresis":
        words = checks["hysteresis"].meaning
        assert re.search(r"position by \((3|4)\d\.\d ± \d\.\d\) um", words)
        assert "grows with the speed is creep" in words
        assert "play of the stage" in words
    if failed == "offset_agreement":
        last = 2 * given.get("pairs", 1)
        named = checks["offset_agreement"]
        assert named.value == pytest.approx(0.3, rel=0.05)
        assert f"number {last if last > 2 else 1} of {last} is off by" in named.meaning


@pytest.mark.parametrize("eta", [-0.05, 0.1])
def test_a_gain_that_changes_with_load_is_measured(eta):
    scan = simulated(load=[0.5, 1.0, 1.5], noise=0.002, baseline=0.0, drift=0.0)
    bent = scan.u_zz * (1 + eta * (scan.normal_load - 1.0))
    linear = linearity_test(estimated(replace(scan, u_zz=bent)))
    assert linear.fall > chi_square_limit(1)
    # First order in eta, and what departures absorb of it.
    error = abs(linear.coefficients[0]) / np.sqrt(linear.fall)
    assert linear.coefficients[0] == pytest.approx(eta, abs=5 * error + 0.3 * abs(eta))


def test_a_round_sensor_passes_and_an_elliptic_one_is_found():
    scan = simulated(raster=True, points=17, noise=0.003)
    even = axisymmetry_test(estimated(scan))
    assert even.fall < chi2.isf(1e-6, even.count)
    dx = scan.x[None, :] - 0.14e-3
    dy = scan.y[:, None]
    lobes = (dx**2 - dy**2) / 1e-6 * np.exp(-(dx**2 + dy**2) / 3e-6)
    oval = replace(scan, u_zz=scan.u_zz + 0.02 * scan.u_zz.max() * lobes)
    uneven = axisymmetry_test(estimated(oval))
    assert uneven.fall > chi_square_limit(uneven.count)
    assert uneven.size == pytest.approx(0.02 * np.abs(lobes).max(), rel=0.5)
