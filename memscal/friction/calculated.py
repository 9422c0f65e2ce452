"""Calculated profiles: families of base stresses to hold a measured one against.

- :func:`amontons_family`: rigid interface, along the friction coefficient;
- :func:`elasto_plastic_family`: given friction, along the slip length;
- :func:`normal_compliance_family`: no friction, along the length of a normal compliance;
- :func:`external_family`: tables from another program, along their friction coefficients.

All are solved by :func:`memscal.indent` but for the last, hold transforms of the base stress (so
that a sensor's apparatus function is a factor), and carry what the stated uncertainties of film
and sphere change in them; see :class:`memscal.friction.family.ProfileFamily`.
"""

from __future__ import annotations

from memscal.friction.amontons import FRICTIONS, amontons_family
from memscal.friction.compliant import (
    SLIP_LENGTHS,
    elasto_plastic_family,
    normal_compliance_family,
)
from memscal.friction.external import external_family

__all__ = [
    "FRICTIONS",
    "SLIP_LENGTHS",
    "amontons_family",
    "elasto_plastic_family",
    "external_family",
    "normal_compliance_family",
]
