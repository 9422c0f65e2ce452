"""Laws of a rough interface, alone and between a sphere and a film."""

import math

import numpy as np
import pytest
from helpers.paper import FILM, SPHERE
from scipy.integrate import quad
from scipy.optimize import brentq

from memscal import ElasticFilm, ExponentialCompliance, GreenwoodTripp, Interface, Rod, indent
from memscal.errors import InputError

ROUGHNESS = 1.82e-6
GREENWOOD_TRIPP = GreenwoodTripp(roughness=ROUGHNESS, asperity_density=5e9, asperity_radius=20e-6)
EXPONENTIAL = ExponentialCompliance(decay_length=0.8e-6, reference_pressure=0.5e6)


def press(interface=None, load=1.37, mu=0.0):
    return indent(FILM, SPHERE, load=load, friction=mu, interface=interface, rings=48)


@pytest.mark.parametrize("separation", [-60.0, -25.0, -19.0, -3.0, 0.0, 2.5, 7.0])
def test_the_pressure_is_the_sum_over_gaussian_asperities(separation):
    law = GreenwoodTripp(roughness=2.0, asperity_density=3.0, asperity_radius=4.0)

    def density(s):
        return (s - separation) ** 1.5 * math.exp(-(s**2) / 2) / math.sqrt(2 * math.pi)

    summed, _ = quad(density, max(separation, -12.0), 14.0, epsabs=0, epsrel=1e-11, limit=400)
    # Hertz of each: in roughnesses r, 4/3 E* times density, root of the radius and r^(3/2).
    expected = 4 / 3 * FILM.contact_modulus * 3.0 * 2.0 * 2.0**1.5 * summed
    assert law.pressure(np.array(2.0 * separation), FILM) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("law", [GREENWOOD_TRIPP, EXPONENTIAL], ids=["GT", "exponential"])
def test_a_law_its_inverse_and_its_slope_belong_together(law):
    separation = np.linspace(-3e-6, 6e-6, 40)
    pressure = law.pressure(separation, FILM)
    np.testing.assert_allclose(law.separation(pressure, FILM), separation, atol=1e-13)
    step = 1e-11
    slope = law.pressure(separation - step, FILM) - law.pressure(separation + step, FILM)
    np.testing.assert_allclose(law.stiffness(separation, FILM), slope / (2 * step), rtol=1e-4)


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize(
    "rough",
    [
        GreenwoodTripp(roughness=1e-10, asperity_density=1e16, asperity_radius=1e-9),
        ExponentialCompliance(decay_length=1e-10, reference_pressure=1e5),
    ],
    ids=["GT", "exponential"],
)
def test_the_rigid_contact_returns_as_the_roughness_vanishes(rough, mu):
    smooth = press(mu=mu)
    nearly = press(Interface(normal=rough), mu=mu)
    assert nearly.depth == pytest.approx(smooth.depth, rel=5e-4)
    assert nearly.contact_radius == pytest.approx(smooth.contact_radius, rel=2e-2)
    r = np.linspace(0.0, 6e-3, 40)
    difference = nearly.base_stress(r) - smooth.base_stress(r)
    assert np.max(np.abs(difference)) < 5e-4 * smooth.max_base_stress


def test_zero_compliances_are_the_rigid_interface_itself():
    law = GreenwoodTripp(roughness=0.0, asperity_density=1e9, asperity_radius=1e-5)
    none = Interface(normal=law)
    assert none.rigid
    assert press(none, mu=0.3).depth == press(mu=0.3).depth


@pytest.mark.parametrize("law", [GREENWOOD_TRIPP, EXPONENTIAL], ids=["GT", "exponential"])
def test_every_point_of_a_rough_contact_obeys_the_law(law):
    contact = press(Interface(normal=law), mu=0.2)
    r = contact.traction.rings
    separation = SPHERE.height(r) - contact.depth + contact.surface_depression(r)
    pressure = contact.interface_pressure(r)
    np.testing.assert_allclose(pressure, law.pressure(separation, FILM), atol=1e-7 * pressure.max())


def test_a_wide_rough_contact_under_a_rod_is_a_layer_over_the_film():
    # A stiff film, so that the interface alone yields: pressure P / (pi a^2) everywhere.
    stiff = ElasticFilm(young_modulus=2.2e11, poisson_ratio=0.3, thickness=2e-3)
    law = ExponentialCompliance(decay_length=1e-6, reference_pressure=1e6)
    contact = indent(stiff, Rod(radius=1e-3), load=0.5, interface=Interface(normal=law))
    mean = 0.5 / (math.pi * 1e-6)
    assert contact.interface_pressure(0.5e-3) == pytest.approx(mean, rel=1e-2)
    depth = brentq(lambda d: law.pressure(np.array(-d), stiff) - mean, -1e-4, 1e-4)
    assert contact.depth == pytest.approx(depth, abs=2e-8)


def test_a_slip_length_lowers_the_friction_that_a_contact_seems_to_have():
    depths = [
        press(Interface(slip_length=length), mu=1.6).depth
        for length in (1e-10, ROUGHNESS, 10 * ROUGHNESS, 1.0)
    ]
    assert depths[0] == pytest.approx(press(mu=1.6).depth, rel=3e-3)
    assert np.all(np.diff(depths) > 0)
    assert depths[-1] == pytest.approx(press(mu=0.0).depth, rel=1e-5)


def test_the_shear_follows_the_elastic_stretch_up_to_the_slip_length():
    mu = 0.5
    length = 3e-6
    contact = indent(
        FILM,
        SPHERE,
        load=1.37,
        friction=mu,
        interface=Interface(slip_length=length),
        loading="total",
        rings=64,
    )
    r = np.linspace(0.05, 0.9, 30) * contact.contact_radius
    stretch = np.clip(contact.surface_outward(r) / length, -1, 1)
    expected = -mu * contact.interface_pressure(r) * stretch
    scale = float(np.max(np.abs(expected)))
    np.testing.assert_allclose(contact.interface_shear(r), expected, atol=5e-3 * scale)


def test_a_path_through_a_compliant_interface_loses_work_in_every_cycle():
    contacts = indent(
        FILM,
        SPHERE,
        load=[1.37, 0.3, 1.37],
        friction=0.3,
        interface=Interface(normal=EXPONENTIAL, slip_length=0.5e-6),
        rings=48,
    )
    dissipated = [contact.dissipated_energy or 0.0 for contact in contacts]
    assert 0 < dissipated[0] < dissipated[2]
    assert contacts[2].depth == pytest.approx(contacts[0].depth, rel=0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Interface(slip_length=-1e-6), "slip length"),
        (lambda: Interface(slip_length=math.nan), "slip length"),
        (lambda: ExponentialCompliance(decay_length=-1.0, reference_pressure=1.0), "decay length"),
        (lambda: ExponentialCompliance(decay_length=1.0, reference_pressure=0.0), "reference"),
        (
            lambda: GreenwoodTripp(roughness=1e-6, asperity_density=0.0, asperity_radius=1e-6),
            "density",
        ),
    ],
)
def test_laws_that_make_no_sense_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
