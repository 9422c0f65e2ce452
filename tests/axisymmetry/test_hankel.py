"""Hankel transforms and their Gauss rules against pairs and integrals in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import j1, jv

import memscal
from memscal.axisymmetry.hankel import (
    RadialSpectrum,
    Wavenumbers,
    gauss_panels,
    hankel_transform,
    radial_spline,
)
from memscal.axisymmetry.kernels import unit_gaussian

K = np.linspace(0.05, 20.0, 60)


def gaussian(r):
    return unit_gaussian(r, 1.0)


@pytest.mark.parametrize(("power", "jinc"), [(0, j1(K) / K), (1, 2 * jv(2, K) / K**2)])
def test_a_disc_and_a_paraboloid_become_jincs(power, jinc):
    # Sonine: the integral of (1 - r^2) J0(kr) r over the unit disc is 2 J2(k)/k^2.
    r = np.linspace(0.0, 1.0, 9)
    found = hankel_transform(r, (1 - r**2) ** power, K)
    np.testing.assert_allclose(found, 2 * np.pi * jinc, atol=1e-13)


@given(width=st.floats(1e-5, 1e3))
def test_a_gaussian_becomes_a_gaussian_in_any_unit_of_length(width):
    r = width * np.linspace(0.0, 9.0, 600)
    k = np.array([0.0, 0.5, 1.0, 3.0]) / width
    found = hankel_transform(r, unit_gaussian(r, width), k)
    np.testing.assert_allclose(found, np.exp(-((k * width) ** 2) / 2), atol=1e-8)


def test_a_point_load_below_a_surface_becomes_an_exponential():
    # 1/(1 + r^2)^(3/2) and 2 pi exp(-k) are a pair.  By parts, with (r J1(kr))' = k r J0(kr),
    # what lies beyond R is less than 2 (2 pi) R J1/(k R^3) <= 4 pi/(k R^2) sqrt(2/(pi k R)).
    reach = 2000.0
    r = np.concatenate([np.linspace(0.0, 20.0, 801), np.geomspace(20.0, reach, 800)[1:]])
    k = np.array([0.3, 1.0, 2.5])
    found = hankel_transform(r, (1 + r**2) ** -1.5, k)
    beyond = 4 * np.pi / (k * reach**2) * np.sqrt(2 / (np.pi * k * reach))
    np.testing.assert_array_less(np.abs(found - 2 * np.pi * np.exp(-k)), beyond + 1e-6)


@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_the_error_falls_with_the_fourth_power_of_the_step(offset):
    k = np.linspace(0.1, 6.0, 12)
    errors = []
    for count in (20, 40, 80, 160):
        r = (10.0 / count) * (np.arange(count + 1) + offset)
        errors.append(np.abs(hankel_transform(r, gaussian(r), k) - np.exp(-(k**2) / 2)).max())
    # Three halvings would give 16^3 = 4096; an order of 3.5 gives 1448.
    assert errors[0] / errors[-1] > 1448
    assert errors[-1] < 1e-7


@pytest.mark.parametrize("start", [0.0, 1e-12, 0.02, 0.1])
def test_a_spline_has_no_kink_on_the_axis_wherever_the_table_begins(start):
    r = np.concatenate([[start], np.arange(0.15, 8.0, 0.05)])
    spline = radial_spline(r, np.cos(r))
    inner = np.linspace(0.0, 1.0, 201)
    np.testing.assert_allclose(spline(inner), np.cos(inner), atol=2e-5)
    slope = (spline(np.array([1e-4])) - spline(np.array([0.0]))) / 1e-4
    assert abs(slope[0]) < 1e-3


@given(product=st.floats(1.0, 3000.0), k_max=st.floats(6.5, 60.0))
def test_nodes_resolve_the_radii_that_they_are_made_for(product, k_max):
    # The weights carry k dk / 2 pi; beyond k_max the Gaussian's transform is below exp(-21).
    r_max = product / k_max
    wavenumbers = Wavenumbers.covering(k_max, r_max)
    r = np.linspace(0.0, r_max, 50)
    found = wavenumbers.synthesise(np.exp(-(wavenumbers.k**2) / 2), r)
    left_out = np.exp(-(k_max**2) / 2) / (2 * np.pi)
    np.testing.assert_allclose(found, gaussian(r), atol=left_out + 1e-13)


@pytest.mark.parametrize(
    ("function", "transform", "k_max"),
    [
        (lambda r: (1 + r**2) ** -1.5, lambda k: 2 * np.pi * np.exp(-k), 36.0),
        # Two Gaussians, one taken off the other: a ring with a hole of no stress.
        (
            lambda r: np.exp(-(r**2) / 4) - np.exp(-(r**2)),
            lambda k: 4 * np.pi * np.exp(-(k**2)) - np.pi * np.exp(-(k**2) / 4),
            12.0,
        ),
    ],
)
def test_synthesis_inverts_transforms_known_in_closed_form(function, transform, k_max):
    r = np.linspace(0.0, 30.0, 24).reshape(4, 6)
    wavenumbers = Wavenumbers.covering(k_max, 30.0)
    spectrum = RadialSpectrum(wavenumbers, transform(wavenumbers.k))
    np.testing.assert_allclose(spectrum.at(r), function(r), atol=1e-12)


@pytest.mark.parametrize("width", [5e-3, 3e-3, 1e-3])
def test_a_narrow_peak_in_a_long_table_is_transformed_as_well_as_it_is_tabulated(width):
    r = np.concatenate([np.linspace(0, 10 * width, 400), np.linspace(10 * width, 8, 400)[1:]])
    k = np.array([0.0, 1.0, 5.0])
    found = hankel_transform(r, unit_gaussian(r, width), k)
    np.testing.assert_allclose(found, np.exp(-0.5 * (width * k) ** 2), atol=1e-6)


@pytest.mark.parametrize(("start", "spread"), [(0.0, 0.4), (0.0, 1.0), (0.05, 1.0)])
def test_the_slope_of_a_gaussian_has_k_times_its_transform(start, spread):
    # A table of a vector field need not begin on the axis.
    r = np.linspace(start, 9.0 * spread, 600)
    slope = -r / spread**2 * unit_gaussian(r, spread)
    found = hankel_transform(r, slope, K, order=1)
    np.testing.assert_allclose(found, -K * np.exp(-((K * spread) ** 2) / 2), atol=1e-6)


def test_synthesis_of_order_one_takes_a_transform_back_and_has_a_potential():
    wavenumbers = Wavenumbers.covering(9.0, 12.0)
    k = wavenumbers.k
    spectrum = RadialSpectrum(wavenumbers, k * np.exp(-(k**2) / 2), order=1)
    r = np.linspace(0.0, 6.0, 25)
    np.testing.assert_allclose(spectrum.at(r), r * gaussian(r), atol=1e-12)
    np.testing.assert_allclose(spectrum.scalar.at(r), gaussian(r), atol=1e-12)
    assert spectrum.integral == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("r_max", [0.5, 3.0, 200.0])
def test_the_integral_is_the_transform_at_zero(r_max):
    # A ring: one Gaussian taken off another; its integral over the plane is 4 pi - pi.
    k = Wavenumbers.covering(12.0, r_max)
    ring = RadialSpectrum(k, 4 * np.pi * np.exp(-(k.k**2)) - np.pi * np.exp(-(k.k**2) / 4))
    assert ring.integral == pytest.approx(3 * np.pi, rel=1e-10)


@given(upper=st.floats(1e-3, 1e3), longest=st.floats(1e-1, 1e4), order=st.integers(1, 20))
def test_no_panel_is_longer_than_allowed_and_none_is_spent_needlessly(upper, longest, order):
    nodes, weights = gauss_panels(upper, longest, order)
    panels = nodes.size // order
    assert upper / panels <= longest * (1 + 1e-12)
    assert panels == 1 or upper / (panels - 1) >= longest * (1 - 1e-12)
    assert np.all(np.diff(nodes, prepend=0.0, append=upper) > 0)
    assert weights.sum() == pytest.approx(upper, rel=1e-12)


def test_a_table_with_an_edge_is_integrated_as_it_stands():
    radius = 3.175e-3
    r = np.concatenate([np.linspace(0, 3.1749e-3, 20), np.linspace(3.1751e-3, 10e-3, 20)])
    disc = memscal.StressProfile(r=r, sigma_zz=np.where(r < radius, 1e5, 0.0), load=1.0)
    k = np.linspace(1.0, 4e3, 200)
    expected = 2e5 * np.pi * radius / k * j1(k * radius)
    force = 1e5 * np.pi * radius**2
    assert disc.force == pytest.approx(force, rel=1e-3)
    np.testing.assert_allclose(hankel_transform(r, disc.sigma_zz, k), expected, atol=1e-6 * force)
