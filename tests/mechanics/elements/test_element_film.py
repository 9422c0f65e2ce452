"""The film by finite elements: against Hankel transforms, and against what must hold exactly."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.paper import film

from memscal.errors import DomainError
from memscal.mechanics.elements import mesh
from memscal.mechanics.elements.element_film import ElementFilm
from memscal.mechanics.film_response import HankelFilm

H = 2e-3
RATIOS = (0.0, 0.3, 0.495, 0.5)
FULL = pytest.mark.full_study


@cache
def elements(nu, width, rings=60):
    return ElementFilm(film(nu), np.linspace(0, width * H, rings + 1), radius=25e-3)


def tractions(r):
    """A pressure with Hertz's edge, and a shear that does not look like its field."""
    x = r / r[-1]
    return 1e5 * np.sqrt(1 - x**2), 3e4 * x * (1 - x**2)


def worst(found, expected, scale):
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(scale)))


@pytest.mark.parametrize(
    ("nu", "width"),
    [
        pytest.param(nu, width, marks=[] if (nu, width) in ((0.3, 0.5), (0.5, 1.7)) else FULL)
        for nu in RATIOS
        for width in (0.5, 1.7)
    ],
)
def test_surface_and_base_are_as_by_hankel_transforms(nu, width):
    ours = elements(nu, width)
    hankel = HankelFilm(ours.film, ours.r)
    p, q = tractions(ours.r)
    a = ours.compliance
    b = hankel.compliance
    for way, both, bound in ((0, (p, 0 * p), 2e-4), (1, (0 * q, q), 1e-4)):
        moved, expected = ((c.whole @ np.concatenate(both)).reshape(2, -1) for c in (a, b))
        for found, known in zip(moved, expected, strict=True):
            assert worst(found, known, expected[way]) < bound
    carried = a.areas @ p
    a = ours.field(p, q)
    b = hankel.field(p, q)
    r = np.linspace(0, ours.r[-1] + 4 * H, 80)
    normal = b.base(r, 0)
    assert worst(a.base(r, 0), normal, normal) < 2e-4
    assert worst(a.base(r, 1), b.base(r, 1), normal) < 2e-4
    k = np.array([[0.0, 200.0], [1000.0, 3000.0]])
    load = b.spectrum(k, 0)
    assert a.spectrum(k, 0)[0, 0] == pytest.approx(carried, rel=1e-7)
    assert worst(a.spectrum(k, 0), load, load) < 1e-4
    assert worst(a.spectrum(k, 1), b.spectrum(k, 1), load) < 1e-4


def test_the_field_at_the_rings_is_what_the_compliance_says():
    ours = elements(0.5, 1.7)
    p, q = tractions(ours.r)
    field = ours.field(p, q)
    w, u = (ours.compliance.whole @ np.append(p, q)).reshape(2, -1)
    np.testing.assert_allclose(field.surface(ours.r, 0), w, rtol=1e-8, atol=1e-14)
    np.testing.assert_allclose(field.surface(ours.r, 1), u, rtol=1e-8, atol=1e-14)
    between = (ours.r[1:] + ours.r[:-1]) / 2
    np.testing.assert_allclose(
        field.surface(between, 0), np.interp(between, ours.r, w), atol=1e-3 * w.max()
    )


def test_finer_triangles_agree_better_with_hankel_transforms(monkeypatch):
    model = elements(0.5, 1.0, rings=40)
    traction = tractions(model.r)
    expected = HankelFilm(model.film, model.r).field(*traction)
    r = np.linspace(0, 4 * H, 60)
    normal = expected.base(r, 0)
    down = expected.surface(r, 0)
    found = [model.field(*traction)]
    monkeypatch.setattr(mesh, "_UNEVEN", 0.0)
    for name in ("_WIDEST", "_WIDENING", "_GROWTH", "_SLOPE", "_TALLEST"):
        monkeypatch.setattr(mesh, name, np.multiply(getattr(mesh, name), 0.5))
    found.append(replace(model).field(*traction))
    at_base = [worst(field.base(r, 0), normal, normal) for field in found]
    on_top = [worst(field.surface(r, 0), down, down) for field in found]
    assert at_base[1] < at_base[0] / 3
    assert on_top[1] < on_top[0] / 1.5


def test_a_compressible_film_under_a_wide_pressure_is_an_oedometer():
    soft = film(0.25)
    wide = ElementFilm(soft, np.linspace(0, 20 * H, 31), radius=30 * H)
    modulus = soft.shear_modulus * 2 * 0.75 / 0.5
    pressure = np.full(31, 1e4)
    field = wide.field(pressure, 0 * pressure)
    r = np.array([0.0, 2 * H, 5 * H])
    np.testing.assert_allclose(field.surface(r, 0), 1e4 * H / modulus, rtol=1e-6)
    np.testing.assert_allclose(field.base(r, 0), 1e4, rtol=1e-6)


def test_a_film_that_ends_near_the_load_is_softer():
    ours = elements(0.5, 0.5)
    cut = ElementFilm(ours.film, ours.r, radius=0.8 * H)
    p = tractions(ours.r)[0]
    moved, uncut = (each.compliance.whole[0, : p.size] @ p for each in (cut, ours))
    assert moved > 1.005 * uncut


def test_beyond_the_edge_there_is_neither_stress_nor_surface():
    ours = elements(0.5, 0.5)
    field = ours.field(*tractions(ours.r))
    assert field.base(np.array([26e-3]), 0)[0] == 0
    assert field.base(np.array([[26e-3]]), 1)[0, 0] == 0
    with pytest.raises(DomainError, match=r"no surface at 0\.026 m: the film ends at 0\.025 m"):
        field.surface(np.array([1e-3, 26e-3]), 0)
