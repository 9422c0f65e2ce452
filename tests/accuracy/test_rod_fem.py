"""The rod by its own series against finite elements on rings that crowd towards its edge."""

import math
from itertools import product

import numpy as np
import pytest
from helpers.bounds import FULL

from memscal import ElasticFilm, Rod, indent
from memscal.mechanics.elements.element_film import ElementFilm
from memscal.model.arrays import FloatArray

RADIUS = 0.25e-3
CASES = list(product([0.2, 0.5], [0.0, math.inf])) if FULL else [(0.2, 0.0), (0.5, math.inf)]

pytestmark = pytest.mark.accuracy


def press(elements: ElementFilm, *, sticking: bool) -> tuple[FloatArray, FloatArray]:
    """Return pressure and shear on the rings under a flat end pressed down by 1 m."""
    c = elements.compliance
    size = elements.r.size
    if not sticking:
        return np.linalg.solve(c.normal, np.ones(size)), np.zeros(size)
    # On the axis there is no shear.
    matrix = np.block(
        [[c.normal, c.normal_by_shear[:, 1:]], [c.radial_by_pressure[1:], c.radial[1:, 1:]]]
    )
    solution = np.linalg.solve(matrix, np.repeat([1.0, 0.0], [size, size - 1]))
    return solution[:size], np.append(0.0, solution[size:])


@pytest.mark.parametrize(("nu", "friction"), CASES)
def test_the_rod_agrees_with_finite_elements(nu: float, friction: float) -> None:
    film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=nu, thickness=2e-3)
    elements = ElementFilm(
        film, np.append(RADIUS * (1 - np.geomspace(1.0, 1e-6, 160 if FULL else 80)), RADIUS)
    )
    pressure, shear = press(elements, sticking=math.isinf(friction))
    stiffness = elements.compliance.areas @ pressure
    field = elements.field(pressure / stiffness, shear / stiffness)

    contact = indent(film, Rod(radius=RADIUS), load=1.0, friction=friction)
    assert contact.load / contact.depth == pytest.approx(stiffness, rel=1e-4)
    r = np.linspace(0.0, 8e-3, 200)
    normal = contact.base_stress(r)
    radial = contact.base_shear(r)
    assert np.max(np.abs(field.base(r, 0) - normal)) < 3e-4 * normal.max()
    assert np.max(np.abs(field.base(r, 1) - radial)) < 3e-4 * normal.max()
