"""Films and indenters: their ranges, their moduli, and that they stay as they were made."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from memscal.errors import InputError
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, Sphere

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)


@given(nu=st.floats(0.0, 0.5), modulus=st.floats(1.0, 1e12))
def test_the_moduli_are_those_of_isotropic_elasticity(nu: float, modulus: float) -> None:
    film = replace(FILM, poisson_ratio=nu, young_modulus=modulus)
    # E = 2 G (1 + nu), and the plane-strain modulus is 2 G/(1 - nu).
    assert 2 * film.shear_modulus * (1 + nu) == pytest.approx(modulus)
    assert film.contact_modulus == pytest.approx(2 * film.shear_modulus / (1 - nu))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"young_modulus": 0.0}, "young_modulus is 0 Pa"),
        ({"young_modulus": float("inf")}, "young_modulus is inf Pa"),
        ({"poisson_ratio": 0.5000001}, "poisson_ratio"),
        ({"poisson_ratio": -0.1}, "poisson_ratio is -0.1"),
        ({"poisson_ratio": float("nan")}, "poisson_ratio is nan"),
        ({"thickness": -2e-3}, "thickness is -0.002 m"),
        ({"roughness_rms": -1e-6}, "roughness_rms"),
        ({"young_modulus_uncertainty": -1.0}, "uncertainty of film young_modulus"),
        ({"poisson_ratio_uncertainty": float("nan")}, "uncertainty of film poisson_ratio"),
        ({"thickness_uncertainty": float("inf")}, "uncertainty of film thickness"),
        ({"roughness_rms_uncertainty": -1e-9}, "uncertainty of film roughness_rms"),
    ],
)
def test_a_film_that_cannot_be_is_refused_by_name(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(InputError, match=named):
        replace(FILM, **changes)


@pytest.mark.parametrize("nu", [0.0, 0.5])
def test_both_ends_of_poissons_ratio_are_films(nu: float) -> None:
    assert replace(FILM, poisson_ratio=nu).poisson_ratio == nu


def test_an_uncertainty_of_zero_is_stated_and_none_is_not() -> None:
    assert replace(FILM, thickness_uncertainty=0.0).thickness_uncertainty == 0.0
    assert FILM.thickness_uncertainty is None


@pytest.mark.parametrize("radius", [0.0, -1e-3, float("nan"), float("inf")])
@pytest.mark.parametrize("kind", [Rod, Sphere])
def test_an_indenter_without_a_radius_is_refused_by_its_shape(
    kind: type[Rod | Sphere], radius: float
) -> None:
    with pytest.raises(InputError, match=f"{kind.__name__.lower()} radius"):
        kind(radius=radius)


def test_an_indenter_with_a_negative_uncertainty_is_refused() -> None:
    with pytest.raises(InputError, match="uncertainty of the rod radius"):
        Rod(radius=1e-3, radius_uncertainty=-1e-6)


def test_a_rod_is_no_sphere() -> None:
    assert Rod(radius=1e-3) != Sphere(radius=1e-3)
    assert (Rod(radius=1e-3).shape, Sphere(radius=1e-3).shape) == ("rod", "sphere")


def test_films_and_indenters_stay_as_they_were_made() -> None:
    with pytest.raises(FrozenInstanceError):
        FILM.thickness = 1e-3
    with pytest.raises(FrozenInstanceError):
        Rod(radius=1e-3).radius = 2e-3
