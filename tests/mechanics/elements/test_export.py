"""The mesh that leaves the house holds the same field as the film model."""

from functools import cache

import numpy as np
import pytest
from helpers.paper import film

from memscal.mechanics.elements.element_film import ElementFilm

H = 2e-3


@cache
def solved(nu):
    r = np.linspace(0, H, 81)
    pressure = 1e5 * (1 - (r / H) ** 2) ** 2
    field = ElementFilm(film(nu), r, radius=25e-3).field(pressure, 0.2 * pressure * r / H)
    return field, field.mesh(), r, pressure


def test_quadratic_triangles_cover_the_film_anticlockwise():
    _, mesh, _, _ = solved(0.5)
    corners = mesh.points[mesh.triangles[:, :3]]
    (x1, y1), (x2, y2) = ((corners[:, i] - corners[:, 0]).T for i in (1, 2))
    area = (x1 * y2 - x2 * y1) / 2
    assert area.min() > 0
    assert area.sum() == pytest.approx(25e-3 * H, rel=1e-12)
    for column, (one, other) in enumerate(((0, 1), (1, 2), (2, 0)), start=3):
        middle = (corners[:, one] + corners[:, other]) / 2
        np.testing.assert_allclose(mesh.points[mesh.triangles[:, column]], middle, atol=1e-15)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_the_stress_balances_the_tractions_on_both_faces(nu):
    field, mesh, rings, pressure = solved(nu)
    r, z = mesh.points.T
    top = np.isclose(z, H, atol=1e-12)
    base = z == 0
    # Tension positive: a pressure of p is a stress of -p; z upward: an outward traction q is q.
    carried = np.interp(r[top], rings, pressure, right=0.0)
    np.testing.assert_allclose(mesh.stress[top, 1], -carried, atol=1.5e3)
    np.testing.assert_allclose(mesh.stress[top, 3], 0.2 * carried * r[top] / H, atol=1.5e3)
    peak = field.base(np.zeros(1), 0)[0]
    np.testing.assert_allclose(mesh.stress[base, 1], -field.base(r[base], 0), atol=2e-3 * peak)
    np.testing.assert_allclose(mesh.stress[base, 3], -field.base(r[base], 1), atol=2e-3 * peak)


def test_the_displacement_is_that_of_the_field_with_z_upward():
    field, mesh, _, _ = solved(0.5)
    r, z = mesh.points.T
    top = np.isclose(z, H, atol=1e-12)
    np.testing.assert_allclose(mesh.displacement[top, 1], -field.surface(r[top], 0), atol=1e-15)
    np.testing.assert_allclose(mesh.displacement[top, 0], field.surface(r[top], 1), atol=1e-15)
    assert np.all(mesh.displacement[z == 0] == 0)


def test_hooke_holds_on_the_axis_where_radial_and_hoop_stress_are_one():
    _, mesh, _, _ = solved(0.3)
    axis = mesh.points[:, 0] == 0
    np.testing.assert_allclose(
        mesh.stress[axis, 0], mesh.stress[axis, 2], atol=1e-3 * np.abs(mesh.stress).max()
    )
    assert "tension" in mesh.notes
