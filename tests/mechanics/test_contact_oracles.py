"""Contacts against closed forms, limits, tables, and the rod's independent solution."""

import math

import numpy as np
import pytest
from helpers.paper import LOADS, SPHERE, film
from scipy.integrate import simpson

from memscal import Cone, Contact, Profile, Rod, indent
from memscal.axisymmetry.hankel import gauss_panels
from memscal.errors import ConvergenceError, DomainError
from memscal.mechanics.rod import solve_rod

FRICTIONS = (0.0, 0.1, 0.3, 1.6, math.inf)


def test_a_sphere_on_a_thick_film_is_hertz_s():
    thick = film(0.3, thickness=2.0)
    contact = indent(thick, SPHERE, load=1e-2)
    radius = (3 * contact.load * SPHERE.radius / (4 * thick.contact_modulus)) ** (1 / 3)
    assert contact.contact_radius == pytest.approx(radius, rel=5e-4)
    assert contact.depth == pytest.approx(radius**2 / SPHERE.radius, rel=5e-4)
    peak = 3 * contact.load / (2 * math.pi * radius**2)
    assert contact.max_interface_stress == pytest.approx(peak, rel=5e-4)
    r = np.linspace(0.0, 0.97, 30) * radius
    hertz = peak * np.sqrt(1 - (r / radius) ** 2)
    np.testing.assert_allclose(contact.interface_pressure(r), hertz, atol=2e-3 * peak)


def test_a_cone_on_a_thick_film_is_sneddon_s():
    thick = film(0.3, thickness=2.0)
    contact = indent(thick, Cone(inclination=0.1), load=1e-2)
    slope = math.tan(0.1)
    load = 2 / math.pi * thick.contact_modulus * contact.depth**2 / slope
    assert contact.load == pytest.approx(load, rel=5e-4)
    assert contact.contact_radius == pytest.approx(2 * contact.depth / (math.pi * slope), rel=5e-4)


@pytest.mark.parametrize(
    ("friction", "loading"), [(0.1, "incremental"), (1.0, "total"), (math.inf, "incremental")]
)
def test_friction_changes_nothing_on_an_incompressible_half_space(friction, loading):
    thick = film(0.5, thickness=2.0)
    smooth = indent(thick, SPHERE, load=1e-2)
    rough = indent(thick, SPHERE, load=1e-2, friction=friction, loading=loading)
    assert rough.depth == pytest.approx(smooth.depth, rel=2e-4)
    r = np.linspace(0.0, 0.95, 20) * smooth.contact_radius
    difference = rough.interface_pressure(r) - smooth.interface_pressure(r)
    assert np.max(np.abs(difference)) < 2e-3 * smooth.max_interface_stress


def test_a_thin_compressible_film_is_a_row_of_springs():
    errors = []
    for thickness in (2e-4, 4e-5):
        thin = film(0.3, thickness=thickness)
        contact = indent(thin, SPHERE, depth=0.05 * thickness, rings=48)
        modulus = thin.shear_modulus * 2 * 0.7 / 0.4
        springs = math.pi * modulus * SPHERE.radius * contact.depth**2 / thickness
        errors.append(abs(contact.load / springs - 1))
    assert errors[1] < 1e-3
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize(("friction", "grip"), [(0.0, 1), (math.inf, 4)])
def test_a_thin_incompressible_film_is_squeezed_as_a_lubricant(friction, grip):
    # w = -h^3 / 3G div grad p with a free surface, four times stiffer where both faces stick:
    # P = grip pi G a^6 / (32 R h^3), delta = a^2 / 4R.  The error falls as h/a.
    excess = []
    for thickness in (4e-5, 2e-5):
        thin = film(0.5, thickness=thickness)
        contact = indent(
            thin, SPHERE, depth=0.02 * thickness, friction=friction, loading="total", rings=96
        )
        a = contact.contact_radius
        squeezed = math.pi * thin.shear_modulus * a**6 / (32 * SPHERE.radius * thickness**3)
        excess.append([contact.load / (grip * squeezed) - 1, thickness / a])
    (large, wide), (small, narrow) = excess
    assert 0 < small < large
    assert small / large == pytest.approx(narrow / wide, rel=0.1)


@pytest.mark.parametrize(
    ("nu", "friction"), [(0.0, math.inf), (0.3, 0.0), (0.495, math.inf), (0.5, 0.0)]
)
def test_every_load_increment_is_a_flat_punch_s(nu, friction):
    # What is in contact goes down together, and sticks, if it does, where it touched: between two
    # loads a contact is stiff as a rod of its radius (Mossakovskii's argument, on any film).
    path = indent(film(nu), SPHERE, load=list(np.linspace(1.0, 1.6, 7)), friction=friction)
    stiffness = [
        2
        * film(nu).contact_modulus
        * a
        * solve_rod(a / 2e-3, nu, sticking=friction > 0).stiffness_factor
        for a in np.array([contact.contact_radius for contact in path])
    ]
    depth = simpson(1 / np.array(stiffness), x=np.array([contact.load for contact in path]))
    # Where a film of nu = 0 sticks, its tractions oscillate towards the edge, which blurs it.
    assert path[-1].depth - path[0].depth == pytest.approx(depth, rel=4e-4 if nu > 0 else 1.5e-3)


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("loading", ["incremental", "total"])
def test_the_base_carries_the_load(friction, loading):
    contact = indent(film(), SPHERE, load=1.37, friction=friction, loading=loading)
    r, weights = gauss_panels(contact.contact_radius + 80e-3, 4e-3)
    force = 2 * math.pi * np.sum(weights * r * contact.base_stress(r))
    assert force == pytest.approx(1.37, rel=1e-8)
    assert contact.base_spectrum(0.0) == pytest.approx(1.37, rel=1e-10)


# A compressible film that sticks at once has an edge that oscillates: see the refusals.
@pytest.mark.parametrize(
    ("nu", "friction", "loading"),
    [
        (nu, friction, loading)
        for nu in (0.3, 0.5)
        for friction in FRICTIONS
        for loading in ("incremental", "total")
        if nu > 0.4 or loading == "incremental" or friction < 10
    ],
)
def test_signorini_s_and_amontons_conditions_hold(nu, friction, loading):
    setting = {"friction": friction, "loading": loading, "rings": 48}
    for contact in indent(film(nu), SPHERE, load=LOADS[1::2], **setting):
        a = contact.contact_radius
        peak = contact.max_interface_stress
        r = contact.traction.rings
        p = contact.interface_pressure(r)
        q = contact.interface_shear(r)
        # What sticks may pull a little at the very edge of its contact: the last rings.
        assert p[r < 0.98 * a].min() >= 0
        assert p.min() > -1e-2 * peak
        if math.isfinite(friction):
            assert np.max((np.abs(q) - friction * p)[r < 0.98 * a]) < 1e-9 * peak
        inside = r[r < 0.97 * a]
        outside = np.linspace(1.01, 3.0, 40) * a
        gap = SPHERE.height(inside) - contact.depth + contact.surface_depression(inside)
        assert np.max(np.abs(gap)) < 1e-9 * contact.depth
        beyond = SPHERE.height(outside) - contact.depth + contact.surface_depression(outside)
        assert np.all(beyond > 0)


def test_a_profile_is_what_it_samples():
    table = Profile.from_function(lambda r: r**2 / (2 * SPHERE.radius), extent=10e-3)
    sampled, exact = (indent(film(), tip, load=1.0, friction=0.2) for tip in (table, SPHERE))
    # Sphere and parabola differ by (a/2R)^2 of the height.
    assert sampled.depth == pytest.approx(exact.depth, rel=2e-4)
    assert sampled.base_stress(0.0) == pytest.approx(float(exact.base_stress(0.0)), rel=2e-4)


def test_a_hollow_tip_touches_on_a_ring_first():
    def hollow(r):
        dip = 5e-6 * (1 - np.minimum(r / 1.5e-3, 1) ** 2) ** 2
        return np.asarray(dip + np.maximum(r - 1.5e-3, 0) ** 2 / 0.05)

    tip = Profile.from_function(hollow, extent=8e-3)
    light, heavy = indent(film(), tip, load=[0.02, 2.0], friction=0.3, rings=32)
    assert light.interface_pressure(0.0) == 0
    assert light.interface_pressure(1.5e-3) > 0
    assert heavy.interface_pressure(0.0) > 0


@pytest.mark.parametrize("friction", [0.2, 1.0])
def test_a_rod_slips_in_a_ring_between_sliding_and_sticking(friction):
    contacts = {
        mu: indent(film(0.3), Rod(radius=0.5e-3), load=0.2, friction=mu)
        for mu in (0.0, friction, math.inf)
    }
    slides, between, sticks = (contacts[mu] for mu in (0.0, friction, math.inf))
    assert sticks.depth < between.depth < slides.depth
    assert 0 < between.stick_radius < between.contact_radius


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_rings_and_spherical_bessel_functions_solve_the_same_rod(nu):
    # A friction so low that it does nothing takes the rings' way.
    rod = Rod(radius=0.25e-3)
    by_rings, by_series = (indent(film(nu), rod, load=1.0, friction=mu) for mu in (1e-9, 0.0))
    assert "rings" in by_rings.discretisation
    assert by_rings.depth == pytest.approx(by_series.depth, rel=1e-5)
    r = np.linspace(0.0, 6e-3, 40)
    difference = by_rings.base_stress(r) - by_series.base_stress(r)
    assert np.max(np.abs(difference)) < 1e-6 * by_series.max_base_stress


def test_a_contact_does_not_depend_on_the_rings_by_more_than_it_says():
    for friction in (0.0, 0.3, math.inf):
        coarse = indent(film(), SPHERE, load=1.37, friction=friction, rings=48)
        fine = indent(film(), SPHERE, load=1.37, friction=friction, rings=128)
        r = np.linspace(0.0, 8e-3, 50)
        change = np.max(np.abs(coarse.base_stress(r) - fine.base_stress(r)))
        assert change < 1.5 * coarse.convergence * fine.max_base_stress
        assert fine.convergence < 3e-5


def test_a_load_that_outgrows_the_film_the_model_or_the_tip_is_refused():
    with pytest.raises(DomainError, match="would sink"):
        indent(film(), Cone(inclination=1.5), load=200.0)
    with pytest.raises(DomainError, match="times as wide as the film is thick"):
        indent(film(thickness=1e-6), SPHERE, load=2.0)
    short = Profile.from_function(lambda r: r**2 / (2 * SPHERE.radius), extent=1e-3)
    with pytest.raises(DomainError, match="end of the profile, 1 mm from its axis"):
        indent(film(), short, load=1.0)


def test_a_contact_that_does_not_settle_is_an_error_that_carries_the_last_one(monkeypatch):
    monkeypatch.setattr("memscal.mechanics.solver.step._MOST_ITERATIONS", 4)
    with pytest.raises(ConvergenceError, match="did not settle") as caught:
        indent(film(0.3), SPHERE, load=[0.011, 1.111], friction=0.123, rings=64)
    assert isinstance(caught.value.last, Contact)
    assert 0 < caught.value.last.load < 1.111


@pytest.mark.parametrize("way", ["hankel", "fem"])
def test_a_film_that_sticks_at_once_is_refused_if_it_would_enter_the_indenter(way):
    with pytest.raises(ConvergenceError, match="Load incrementally"):
        indent(
            *(film(0.1), SPHERE),
            load=1.0,
            friction=math.inf,
            loading="total",
            backend=way,
            rings=24,
        )
