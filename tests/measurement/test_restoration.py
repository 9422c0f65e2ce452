"""The way back: what is restored is what was pressed, as far as its uncertainty says."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers import scans as made
from helpers.bounds import FULL, cramer_rao, root_mean_square_range
from helpers.scans import simulate, with_outlier
from scipy.stats import chi2

import memscal
from memscal.mechanics.tabulated_rod import tabulated_rod

EXACT = made.known_apparatus()
RUBBER = replace(made.EXACT_FILM, law="neo-hookean")
FEW = 6 if FULL else 4
NOISE = 0.005
SCAN = made.sphere_scan(made.pressed(), seed=1)


def wider(share):
    return memscal.GaussianMixture((1.0,), ((1 + share) * made.SIGMA,))


def apparatus_part(found, source, r):
    """Standard uncertainty of the stress by one source, in Pa."""
    n = found.posterior.nodes
    matrix = found.posterior.estimate.model.reference.wavenumbers.synthesise(np.eye(n), r)
    covariance = found.posterior.covariances[source][:n, :n]
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", matrix, covariance, matrix)))


@lru_cache
def restored(load, friction, seed, noise=NOISE):
    contact = made.pressed(load, friction)
    scan = made.sphere_scan(contact, noise=noise, seed=seed)
    return memscal.restore(scan, EXACT, expected=contact)


@pytest.mark.parametrize(("load", "friction"), [(0.34, np.inf), (2.75, 0.0)])
def test_without_noise_the_calculated_stress_comes_back(load, friction):
    found = restored(load, friction, 0, 0.0)
    contact = made.pressed(load, friction)
    assert made.plane_error(found.r, found.sigma_zz, contact.base_stress(found.r)) < 4e-3
    assert found.force == pytest.approx(load, rel=0.02)
    assert found.passed


@pytest.mark.parametrize("law", ["neo-hookean", ""])
def test_a_film_at_finite_strain_is_not_taken_as_linear(law):
    contact = tabulated_rod(RUBBER, made.EXACT_ROD, 1.0, sticking=True)
    film = replace(RUBBER, law=law)
    scans = [replace(made.sphere_scan(contact, seed=seed), film=film) for seed in range(FEW)]
    found = [memscal.restore(scan, replace(EXACT, film=film)) for scan in scans]
    errors = np.array([f.force - 1.0 for f in found])
    stated = np.array([f.force_uncertainty for f in found])
    # The truth sticks: it is at an end of what is counted where friction is not stated.
    assert np.sum((errors / stated) ** 2) < chi2.ppf(0.9999, FEW)
    apart = [made.plane_error(f.r, f.sigma_zz, contact.base_stress(f.r)) for f in found]
    assert np.mean(apart) < 0.04
    if not law:
        assert np.mean([f.force_budget["film"] for f in found]) > 0.05


def test_the_restored_stress_blurred_again_is_what_was_measured():
    found = [restored(1.0, 0.0, seed) for seed in range(FEW)]
    total, degrees = (sum(getattr(f, name) for f in found) for name in ("chi_square", "degrees"))
    # What departures explain of the noise is at most the handful that the scan can tell apart.
    assert 0.6 < total / degrees < 1 + 4 * np.sqrt(2 / degrees)
    for f in found:
        order = np.argsort(f.distance)
        apart = f.measured_stress[order] - f.blurred_stress(f.distance[order])
        np.testing.assert_allclose(apart, f.residual[order] / made.CONVERSION, atol=20.0)


def test_a_calculated_contact_is_told_from_another():
    found = restored(1.0, np.inf, 3)
    same = found.compare(made.pressed(1.0, np.inf))
    other = found.compare(made.pressed(1.0, 0.0))
    assert same.p_value > 1e-3 > other.p_value
    assert same.within > 0.7 > other.within


def test_the_direct_comparison_has_the_chi_square_of_its_degrees():
    compared = [restored(1.0, 0.0, seed).comparison for seed in range(FEW)]
    total = sum(c.chi_square * c.degrees for c in compared if c is not None)
    degrees = sum(c.degrees for c in compared if c is not None)
    assert abs(total / degrees - 1) < 4 * np.sqrt(2 / degrees)


SHARE = 0.01
QUIET = made.sphere_scan(made.pressed(), noise=0.001, seed=2)
UNSURE, THICKER = (
    replace(QUIET.film, **{name: size * QUIET.film.thickness})
    for name, size in (("thickness_uncertainty", SHARE), ("thickness", 1 + SHARE))
)
STRONGER = replace(QUIET, u_zz=(1 + SHARE) * QUIET.u_zz)


@pytest.mark.parametrize(
    ("source", "stated", "wrong"),
    [
        (
            "position_scale",
            (replace(QUIET, position_scale_uncertainty=SHARE), EXACT),
            (replace(QUIET, x=(1 + SHARE) * QUIET.x), EXACT),
        ),
        ("film", (replace(QUIET, film=UNSURE), EXACT), (replace(QUIET, film=THICKER), EXACT)),
        (
            "apparatus",
            (QUIET, made.known_apparatus(width_uncertainty=SHARE)),
            (QUIET, made.known_apparatus(wider(SHARE))),
        ),
        (
            "apparatus",
            (QUIET, made.known_apparatus(conversion_uncertainty=SHARE)),
            (STRONGER, EXACT),
        ),
    ],
    ids=["position scale", "film", "width of G", "conversion constant"],
)
def test_what_is_uncertain_counts_as_much_as_it_changes(source, stated, wrong):
    r = np.array([0.0, 1e-3, 1.5e-3, 3e-3])
    found = memscal.restore(*stated)
    changed = memscal.restore(*wrong, override=True)
    difference = np.append(changed.stress(r) - found.stress(r), changed.force - found.force)
    counted = np.append(apparatus_part(found, source, r), found.force_budget[source])
    size = np.append(np.full(r.size, found.sigma_zz[0]), found.force)
    np.testing.assert_allclose(counted / size, np.abs(difference) / size, atol=5e-4)


def test_less_noise_resolves_more():
    resolved = [restored(1.0, 0.0, 0, noise).resolved_wavenumber for noise in (0.02, 0.005, 0.001)]
    assert resolved == sorted(resolved)
    assert resolved[0] < resolved[-1] <= np.pi / 0.5e-3 * (1 + 1e-9)


@pytest.mark.parametrize(
    "setting", [{"load": (0.5, 1.0, 2.0), "points": 33}, {"raster": True, "points": 15}], ids=str
)
def test_a_rod_s_stress_comes_back_from_several_loads_and_from_a_raster(setting):
    scans = [simulate(film=EXACT.film, seed=s, **setting) for s in range(FEW)]
    found = [memscal.restore(scan, EXACT) for scan in scans]
    z = [(f.force - f.scan.load) / f.force_uncertainty for f in found]
    low, high = root_mean_square_range(len(z), 1e-4) ** 2
    # Half of a mean square of one: any shape may be.
    assert 0.4 * low < np.mean(np.square(z)) < high
    raster = "raster" in setting
    bounds = cramer_rao(0.005, **setting)
    for f in found:
        assert ("axisymmetry" in {check.name for check in f.checks}) == raster
        # Of a round contact no other parameter is correlated with the centre.
        u = f.centre_uncertainty[: 1 + raster]
        bound = [bounds["centre"]] * (1 + raster)
        np.testing.assert_allclose(u, bound, rtol=0.2)
        assert np.all(np.abs(f.centre[: 1 + raster] - [0.14e-3, 0.0][: 1 + raster]) < 5 * u)


def test_the_direction_of_a_scan_changes_nothing():
    along_x, along_y = (memscal.restore(replace(SCAN, direction=d), EXACT) for d in "xy")
    np.testing.assert_allclose(along_y.sigma_zz, along_x.sigma_zz)
    assert along_y.centre[1] == along_x.centre[0]


def test_a_wrong_unit_of_the_voltage_fails_the_check_of_the_force():
    scan = replace(SCAN, u_zz=1e3 * SCAN.u_zz, u_zz_errors=1e3 * SCAN.u_zz_errors)
    found = memscal.restore(scan, EXACT)
    assert "restored_force" in {check.name for check in found.checks if not check.passed}


def test_a_spoilt_point_is_named_and_moves_little():
    scan = made.sphere_scan(made.pressed(), seed=4)
    clean, spoilt = (memscal.restore(s, EXACT) for s in (scan, with_outlier(scan, 14, 0.5)))
    assert any(message.kind == "outlier" for message in spoilt.messages)
    assert abs(spoilt.stress(0.0) - clean.stress(0.0)) < 2 * clean.stress_uncertainty(0.0)


def test_the_table_is_a_reference_with_uncertainties():
    found = restored(1.0, 0.0, 0)
    profile = found.profile()
    np.testing.assert_allclose(profile.sigma_zz_errors, found.stress_uncertainty(found.r))
    assert profile.load == found.scan.load


OTHER = memscal.StressSensor(name="other")
NOISE = np.random.default_rng(0).normal(0, 1e-5, 33)
BARE = replace(EXACT.radial_profile, g_covariance=np.full((301, 301), np.nan))
BESIDE = replace(SCAN, x=SCAN.x[18:], u_zz=SCAN.u_zz[18:], u_zz_errors=None)
BAD = {
    "several loads": (replace(SCAN, normal_load=np.linspace(0.5, 1.5, 33)), EXACT, "grows"),
    "another sensor": (replace(SCAN, sensor=OTHER), EXACT, 'name of the sensor  "other"'),
    "no covariance": (SCAN, replace(EXACT, radial_profile=BARE), "does not state the covariance"),
    "zero noise": (replace(SCAN, u_zz_errors=np.zeros(33)), EXACT, "uncertainty of zero"),
    "wrong sign": (replace(SCAN, u_zz=-SCAN.u_zz), EXACT, "Change the sign"),
    "beside the sensor": (BESIDE, EXACT, "Scan across"),
    "noise alone": (replace(SCAN, u_zz=NOISE), EXACT, "determines no stress"),
    "no scan": (1.0, EXACT, "where a Scan is needed"),
    "no apparatus": (SCAN, 1.0, "where an apparatus function is needed"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_restored_is_refused_with_a_reason(case):
    scan, apparatus, text = BAD[case]
    with pytest.raises(memscal.MemscalError) as caught:
        memscal.restore(scan, apparatus)
    assert text in str(caught.value)
    assert caught.value.cure


@pytest.mark.parametrize("expected", [3, made.pressed(2.75)])
def test_an_expected_stress_that_does_not_fit_is_refused(expected):
    with pytest.raises(memscal.MemscalError):
        memscal.restore(SCAN, EXACT, expected=expected)


def test_a_radius_beyond_what_was_computed_is_refused():
    with pytest.raises(memscal.MemscalError, match="24 mm"):
        restored(1.0, 0.0, 0).stress(1.0)
