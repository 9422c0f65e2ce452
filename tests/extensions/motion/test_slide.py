"""Sliding contacts against closed forms, contacts at rest, and influences by Hankel transforms."""

from dataclasses import replace

import numpy as np
import pytest

import memscal
from memscal.errors import DomainError, InputError
from memscal.extensions.motion.slide import solve_sliding
from memscal.mechanics.film_response import HankelField, RingTraction

H = 2e-3
FILM = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=H)
SPHERE = memscal.Sphere(radius=128.8e-3)
POINTS = np.linspace(-8e-3, 8e-3, 161)


def film(nu):
    return replace(FILM, poisson_ratio=nu)


def slid(friction, nu=0.5, **options):
    return memscal.slide(film(nu), SPHERE, load=1.37, friction=friction, **options)


@pytest.mark.parametrize("load", [0.05, 1.37, 10.0])
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_without_friction_it_is_the_contact_at_rest(nu, load):
    contact = memscal.slide(film(nu), SPHERE, load=load, friction=0.0)
    still = memscal.indent(film(nu), SPHERE, load=load)
    expected = still.base_stress(abs(POINTS))
    assert contact.base_stress(POINTS) == pytest.approx(expected, abs=1e-3 * expected.max())
    assert contact.depth == pytest.approx(still.depth, rel=1e-3)
    assert contact.region == pytest.approx(still.contact_radius * np.array([-1, 1, 1]), rel=0.01)
    assert 1e-5 < contact.convergence < 1e-3


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45, 0.5])
def test_forces_and_moments_balance(nu):
    contact = slid(0.4, nu)
    x = np.linspace(-30e-3, 30e-3, 601)
    cell = (x[1] - x[0]) ** 2
    stress = contact.base_stress(x, x[:, None])
    assert stress.sum() * cell == pytest.approx(1.37, rel=1e-4)
    centroid = (stress @ x).sum() * cell / 1.37
    assert centroid - contact.surface_centroid == pytest.approx(0.4 * H, rel=1e-3)
    assert contact.base_centroid == pytest.approx(centroid, abs=1e-3 * H)
    assert contact.tangential_load == pytest.approx(0.4 * 1.37)


def test_a_sphere_with_friction_of_the_film_in_the_paper():
    # Measured with a solver of its own on a grid of 0.05 mm: mm from the sphere's lowest point.
    contact = slid(0.3)
    assert contact.surface_centroid == pytest.approx(0.19e-3, abs=0.01e-3)
    assert contact.region[:2] == pytest.approx([-2.72e-3, 3.00e-3], abs=0.05e-3)
    assert contact.max_base_stress / slid(0.0).max_base_stress == pytest.approx(1.009, abs=1e-3)
    # What a sensor of 0.561 mm sees is the static stress, 0.46 mm farther along.
    k = np.linspace(0.0, 4e3, 801)
    line = contact.base_spectrum(k, 0.0) * np.exp(-((0.561e-3 * k) ** 2) / 2)
    seen = (line * np.exp(1j * np.outer(POINTS, k))).real.sum(axis=1)
    assert POINTS[seen.argmax()] == pytest.approx(0.46e-3, abs=0.1e-3)


def test_the_error_falls_faster_than_the_cells_become_smaller():
    region = slid(0.5).region
    *coarse, fine = (
        solve_sliding(FILM, SPHERE, 1.37, 0.5, region, cells).base_stress(POINTS)
        for cells in (16, 32, 64, 160)
    )
    errors = [abs(stress - fine).max() / fine.max() for stress in coarse]
    assert errors[1] < 1e-3
    assert errors[2] < errors[0] / 4**1.5


def test_the_other_way_is_the_mirror_image():
    forth = slid(0.6, 0.4)
    back = slid(0.6, 0.4, direction=-1)
    expected = forth.base_stress(-POINTS)
    assert back.base_stress(POINTS) == pytest.approx(expected, abs=1e-4 * expected.max())
    assert back.tangential_load == -forth.tangential_load


def hamilton(x, z, a):
    """Normal stress below a sliding sphere by its pressure and by its shear, each of load one.

    Hamilton, Proc. IMechE C 197 (1983) 53, at y = 0; compression positive, z into the half-space.
    """
    across = x**2 + z**2 - a**2
    s = np.hypot(across, 2 * a * z)
    m = np.sqrt((s + across) / 2)
    n = np.sqrt((s - across) / 2)
    scale = 3 / (2 * np.pi * a**3)
    by_shear = -z * n / (2 * x) * (1 - (x**2 + z**2 + a**2) / s)
    return scale * (n - a * z * m / s), scale * by_shear


def test_on_a_thick_film_it_is_a_hertz_contact_with_its_shear():
    # Compared is the stress below the surface of a half-space under the tractions of a contact on
    # a film that is ten radii thick: the stress at the base of a bonded film is another one.
    thick = replace(FILM, thickness=20e-3)
    a = 2e-3
    load = 4 / 3 * thick.contact_modulus * a**3 / SPHERE.radius
    contact = memscal.slide(thick, SPHERE, load=load, friction=0.5)
    x = np.array([-2.0, -1.0, 0.4, 1.0, 2.0]) * a
    z = 0.7 * a
    offset = x[:, None, None] - contact.x
    distance = np.sqrt(offset**2 + contact.y[:, None] ** 2 + z**2)
    # Boussinesq and Cerruti: both are 3 z^2/(2 pi R^5) times the force along R.
    along = contact.pressure * (z + 0.5 * offset)
    cell = (contact.x[1] - contact.x[0]) ** 2
    stress = (1.5 / np.pi * z**2 * cell * along / distance**5).sum(axis=(1, 2))
    by_pressure, by_shear = hamilton(x, z, a)
    expected = load * (by_pressure + 0.5 * by_shear)
    assert stress == pytest.approx(expected, abs=0.01 * expected.max())


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_the_film_lies_on_the_sphere_by_influences_of_hankel_transforms(nu):
    # The pressure of a small disc depresses the surface and moves it outward: by Betti's
    # reciprocity as far as the disc's shear would depress it.  A contact with friction is unique.
    contact = slid(0.6, nu, points=20)
    radius = (contact.x[1] - contact.x[0]) / np.sqrt(np.pi)
    rings = radius * np.array([0.0, 0.5, 0.95, 1.05])
    disc = HankelField(film(nu), RingTraction(rings, np.array([1.0, 1.0, 1.0, 0.0]), np.zeros(4)))
    x, y = (grid.ravel() for grid in np.meshgrid(contact.x, contact.y))
    pressure = contact.pressure.ravel()
    ahead = np.subtract.outer(x, x)
    distances = np.hypot(ahead, np.subtract.outer(y, y)).round(9)
    r, place = np.unique(distances, return_inverse=True)
    by_shear = disc.surface(r, 1)[place] * -ahead / np.maximum(distances, 1e-9)
    depressed = (disc.surface(r, 0)[place] + 0.6 * by_shear) @ pressure
    gap = (depressed + SPHERE.height(np.hypot(x, y))) / contact.depth - 1
    assert gap[pressure > 0] == pytest.approx(0.0, abs=0.01)
    assert gap[pressure == 0].min() > 0


def test_what_does_not_slide_here_is_refused():
    bowl = memscal.Profile.from_function(lambda r: r**2 / 0.2576, extent=3.1e-3)
    cases = [
        ({"indenter": memscal.Rod(radius=1e-3)}, InputError, "A rod is given"),
        ({"friction": -0.1}, InputError, "friction is -0.1"),
        ({"points": 7}, InputError, "7 points are asked for"),
        ({"points": 33.5}, InputError, "33.5 points"),
        ({"direction": 0.5}, InputError, "direction 0.5"),
        ({"load": 1e-5}, DomainError, "a half-space to it"),
        ({"indenter": bowl}, DomainError, "reaches beyond the profile's known face"),
    ]
    for changes, error, words in cases:
        given = {"film": FILM, "indenter": SPHERE, "load": 1.37, "friction": 0.6} | changes
        with pytest.raises(error, match=words):
            memscal.slide(**given)


def test_a_cone_slides_and_shows_itself():
    contact = memscal.slide(FILM, memscal.Cone(inclination=0.02), load=1.0, friction=0.2)
    assert contact.base_centroid - contact.surface_centroid == pytest.approx(0.2 * H, rel=1e-3)
    assert contact.to_dict()["tangential_load"] == {"value": pytest.approx(0.2), "unit": "N"}
    assert "A cone that slides" in contact.summary()
    pressure, _ = contact.plot().axes[0].lines
    assert pressure.get_ydata()[100] == pytest.approx(contact.interface_pressure(0.0, 0.0) / 1e3)
