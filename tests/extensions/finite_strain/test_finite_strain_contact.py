"""Finite strain behind the same door as all other contacts."""

import math

import pytest
from helpers.paper import FILM, ROD, SPHERE

from memscal import Cone, Interface, indent
from memscal.errors import DomainError, InputError


@pytest.mark.parametrize(
    ("indenter", "asked", "error", "message"),
    [
        (ROD, {"friction": 0.3}, DomainError, "slides freely .* or sticks"),
        (ROD, {"interface": Interface(slip_length=1e-6)}, DomainError, "do not yield"),
        (SPHERE, {"friction": math.inf}, DomainError, 'loading="total" only'),
        (Cone(inclination=0.1), {}, DomainError, "a cone cannot be pressed"),
        (ROD, {"rings": 64}, InputError, "the surface has none"),
        (ROD, {"load": None, "depth": 2.5e-3}, DomainError, "goes through the film"),
        (SPHERE, {"load": 500.0}, DomainError, "contact would be"),
    ],
)
def test_what_is_not_modelled_at_finite_strain_is_refused(indenter, asked, error, message):
    with pytest.raises(error, match=message):
        indent(FILM, indenter, **{"load": 0.1, "strain": "finite", **asked})
