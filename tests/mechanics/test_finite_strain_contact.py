"""Finite strain behind the same door as all other contacts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from memscal.errors import ConvergenceError, DomainError, InputError
from memscal.mechanics.contact import Contact
from memscal.mechanics.finite_strain import solve as finite_strain
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Cone, Rod, Sphere

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
ROD, SPHERE = Rod(radius=0.25e-3), Sphere(radius=128.8e-3)
R = np.linspace(0.0, 4e-3, 30)


def test_a_light_rod_stresses_the_base_as_in_the_linear_film() -> None:
    finite = indent(FILM, ROD, load=0.01, friction=math.inf, strain="finite")
    linear = indent(FILM, ROD, load=0.01, friction=math.inf)
    difference = finite.base_stress(R) - linear.base_stress(R)
    assert np.max(np.abs(difference)) < 1e-2 * linear.max_base_stress
    assert (finite.strain, finite.backend) == ("finite", "fem")
    assert finite.base_spectrum(0.0) == pytest.approx(0.01, rel=1e-5)
    assert finite.profile().solver == "memscal, fem backend, finite strain"


def test_a_sphere_that_sinks_by_a_hundredth_is_a_linear_one() -> None:
    finite = indent(FILM, SPHERE, load=0.34, strain="finite")
    linear = indent(FILM, SPHERE, load=0.34)
    assert finite.depth == pytest.approx(linear.depth, rel=3e-3)
    assert finite.contact_radius == pytest.approx(linear.contact_radius, rel=2e-2)
    difference = finite.base_stress(R) - linear.base_stress(R)
    assert np.max(np.abs(difference)) < 5e-3 * linear.max_base_stress
    middle = finite.interface_pressure(0.3e-3)
    assert middle == pytest.approx(float(linear.interface_pressure(0.3e-3)), rel=3e-2)


@pytest.mark.parametrize(
    ("indenter", "asked", "error", "message"),
    [
        (ROD, {"friction": 0.3}, DomainError, "slides freely .* or sticks"),
        (ROD, {"interface": Interface(slip_length=1e-6)}, DomainError, "do not yield"),
        (SPHERE, {"friction": math.inf}, DomainError, 'loading="total" only'),
        (Cone(inclination=0.1), {}, DomainError, "a cone cannot be pressed"),
        (ROD, {"rings": 64}, InputError, "the surface has none"),
    ],
)
def test_what_is_not_modelled_at_finite_strain_is_refused(
    indenter: Any, asked: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        indent(FILM, indenter, load=0.1, strain="finite", **asked)


def test_a_film_that_folds_gives_the_last_contact_that_was_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (state,) = finite_strain.solve_finite_strain(FILM, SPHERE, depths=[5e-6])

    def folds(*_: object, **__: object) -> None:
        error = ConvergenceError("No equilibrium was found.")
        error.last = state
        raise error

    monkeypatch.setattr(finite_strain, "solve_finite_strain", folds)
    with pytest.raises(ConvergenceError) as caught:
        indent(FILM, SPHERE, depth=[5e-6, 1e-3], strain="finite")
    assert isinstance(caught.value.last, Contact)
    assert caught.value.last.depth == pytest.approx(5e-6)
