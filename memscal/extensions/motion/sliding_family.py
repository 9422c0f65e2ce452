r"""Families of base stresses of a sphere that slides on a film, along the friction coefficient.

The base stress of a sliding contact is even across the direction of sliding, so that its transform
is a series in the angle to it, real in even orders and imaginary in odd ones,

.. math::

    \hat\sigma(k, \varphi) = \sum_m i^{m \bmod 2}\,a_m(k)\,\cos m\varphi, \qquad
    \sigma(x) = \frac{1}{2\pi} \int_0^\infty \sum_m s_m(k)\,J_m(kx)\,k\,dk,

with :math:`s_m = (-1)^{\lceil m/2 \rceil} a_m`, along the line through the axis.  What is round,
such as a sensor, multiplies all orders alike.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers, bessel_table
from memscal.extensions.motion.slide import slide
from memscal.extensions.motion.sliding_contact import SlidingContact
from memscal.friction.family import FamilySetup, LoadingPath, ProfileFamily
from memscal.model.arrays import FloatArray, Values, array_record

SLIDING = "sliding"
"""The loading of a sphere that slides."""
FRICTIONS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0)
"""Friction coefficients of the contacts that are solved."""

#: Cells across a contact.
_CELLS = 48
#: Orders beyond these are below 1e-5 of the stress on the axis at a friction of 0.6, below 7e-4 at
#: 2; angles by which they are found.
_ORDERS = 9
_ANGLES = 12
#: Places along a line for each thickness: a cubic spline through the stress is good to 1e-4.
_FINENESS = 20
#: Friction at the middle of the bounded coordinate.  The stress is nearly linear in the friction,
#: and a cubic spline along it is good to 1e-4 of the shift.
_SCALE = 3.0


@array_record
class LineNodes(Wavenumbers):
    """Nodes of each angular order, one order after the other; ``line`` (m): even places, in m."""

    line: FloatArray

    @cached_property
    def waves(self) -> FloatArray:
        """Inverse transform from the nodes to the places of the line, (m, K)."""
        return self._waves(self.line)

    def synthesise(
        self,
        spectrum: FloatArray,
        r: FloatArray,
        *,
        order: int = 0,  # noqa: ARG002 - all orders are in the nodes
    ) -> FloatArray:
        """Evaluate the inverse transform at places (m) along the line."""
        return self._waves(r) @ spectrum

    def _waves(self, x: FloatArray) -> FloatArray:
        k = self.k[: self.k.size // _ORDERS]
        sides = np.sign(x)[:, None]
        orders = [sides**m * bessel_table(abs(x), k, m) for m in range(_ORDERS)]
        return np.hstack(orders) * self.weights


def line_spectrum(contact: SlidingContact, k: FloatArray) -> FloatArray:
    """Return the series s of the transform of the base stress, at nodes of all orders, in N."""
    radial = k[: k.size // _ORDERS, None]
    angle = np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES
    found = contact.base_spectrum(radial * np.cos(angle), radial * np.sin(angle))
    orders = []
    for order in range(_ORDERS):
        part = found.imag if order % 2 else found.real
        share = (-1) ** ((order + 1) // 2) * min(order + 1, 2) / _ANGLES
        orders.append(share * part @ np.cos(order * angle))
    return np.concatenate(orders)


class SlidingPath(LoadingPath):
    """Sliding contacts at several loads; each is the same whatever the way to it."""

    def contacts(self, loads: FloatArray) -> Sequence[Any]:
        """Solve the contacts."""
        found = []
        for load in loads.tolist():
            contact = slide(
                self.film, self.indenter, load=load, friction=self.friction, points=_CELLS
            )
            seen = SimpleNamespace(
                base_spectrum=partial(line_spectrum, contact),
                depth=contact.depth,
                contact_radius=contact.region.half_width,
                convergence=contact.convergence,
            )
            found.append(seen)
        return found


def sliding_family(setting: Values) -> ProfileFamily:
    """Return the base stresses of a sliding sphere; the setting is that of any other family."""
    setup = FamilySetup(**setting)
    round_nodes = setup.wavenumbers
    step = setup.film.thickness / _FINENESS
    half = math.ceil(setting["reach"] / step)
    setup.wavenumbers = LineNodes(
        k=np.tile(round_nodes.k, _ORDERS),
        weights=np.tile(round_nodes.weights, _ORDERS),
        line=step * np.arange(-half, half + 1),
    )
    paths = [SlidingPath(**vars(setup.path(friction=mu, loading=SLIDING))) for mu in FRICTIONS]
    solved = setup.family(paths, name=SLIDING, loading=SLIDING, values=np.array(FRICTIONS))
    return replace(solved, scale=_SCALE, interpolation="CubicSpline")
