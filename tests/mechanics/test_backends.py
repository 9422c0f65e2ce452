"""Two methods that share nothing but the contact: Hankel transforms and finite elements."""

import math
from functools import lru_cache

import numpy as np
import pytest
from helpers.paper import SPHERE, film

from memscal import Rod, indent
from memscal.errors import InputError

R = np.linspace(0.0, 8e-3, 60)
# Largest relative difference that the two may have, the same for all that is compared.
AGREEMENT = 2e-3
FULL = pytest.mark.full_study


@lru_cache
def by_both(nu, indenter, load, friction, loading="incremental"):
    ways = [
        indent(
            film(nu),
            indenter,
            load=load,
            friction=friction,
            loading=loading,
            rings=rings,
            backend=backend,
            film_radius=radius,
        )
        for backend, radius, rings in (("hankel", None, None), ("fem", 16e-3, 32))
    ]
    return ways[0], ways[1]


@pytest.mark.parametrize(
    ("nu", "friction", "loading"),
    [
        (0.5, 0.0, "incremental"),
        (0.3, 0.3, "incremental"),
        pytest.param(0.5, math.inf, "incremental", marks=FULL),
        pytest.param(0.3, 0.3, "total", marks=FULL),
        pytest.param(0.3, 0.0, "incremental", marks=FULL),
        pytest.param(0.5, 0.3, "incremental", marks=FULL),
        pytest.param(0.3, math.inf, "incremental", marks=FULL),
        pytest.param(0.5, 0.3, "total", marks=FULL),
    ],
)
def test_both_find_the_same_sphere(nu, friction, loading):
    hankel, fem = by_both(nu, SPHERE, 1.37, friction, loading)
    assert fem.backend == "fem"
    assert "triangles" in fem.discretisation
    for name in ("load", "depth", "contact_radius", "max_interface_stress", "elastic_energy"):
        assert getattr(fem, name) == pytest.approx(getattr(hankel, name), rel=AGREEMENT), name
    assert np.max(np.abs(fem.base_stress(R) - hankel.base_stress(R))) < (
        AGREEMENT * hankel.max_base_stress
    )
    shear = hankel.base_shear(R)
    assert np.max(np.abs(fem.base_shear(R) - shear)) < AGREEMENT * np.max(np.abs(shear))
    assert np.max(np.abs(fem.surface_depression(R) - hankel.surface_depression(R))) < (
        AGREEMENT * hankel.depth
    )
    # Both say of themselves that they have converged well below what they differ by at most.
    assert max(fem.convergence, hankel.convergence) < AGREEMENT


# Finite elements failed on all of these, Hankel transforms on the compressible films.
@pytest.mark.parametrize(
    ("nu", "load"),
    [(0.47, 0.34), pytest.param(0.5, 2.75, marks=FULL), pytest.param(0.45, 2.75, marks=FULL)],
)
def test_both_find_the_same_sphere_that_sticks_at_once(nu, load):
    hankel, fem, slips = (
        indent(film(nu), SPHERE, load=load, friction=mu, loading="total", backend=way, rings=48)
        for way, mu in (("hankel", math.inf), ("fem", math.inf), ("hankel", 10.0))
    )
    assert fem.depth == pytest.approx(hankel.depth, rel=3e-4)
    for other, agreement in ((fem, 3e-4), (slips, 1e-3)):
        difference = other.base_stress(R) - hankel.base_stress(R)
        assert np.max(np.abs(difference)) < agreement * hankel.max_base_stress


@pytest.mark.parametrize(
    "friction", [0.2, pytest.param(0.0, marks=FULL), pytest.param(math.inf, marks=FULL)]
)
def test_both_find_the_same_rod(friction):
    hankel, fem = by_both(0.5, Rod(radius=0.25e-3), 1.0, friction)
    assert fem.depth == pytest.approx(hankel.depth, rel=AGREEMENT)
    difference = fem.base_stress(R) - hankel.base_stress(R)
    assert np.max(np.abs(difference)) < AGREEMENT * hankel.max_base_stress


def test_a_film_by_hankel_transforms_has_no_end():
    with pytest.raises(InputError, match="a film has no end"):
        indent(film(0.5), SPHERE, load=1.37, film_radius=25e-3)


def test_only_finite_elements_have_a_mesh_to_show():
    hankel, fem = by_both(0.5, SPHERE, 1.37, 0.0)
    assert fem.mesh().points[:, 1].max() == pytest.approx(2e-3)
    with pytest.raises(InputError, match="has no mesh"):
        hankel.mesh()
