r"""Contact of a rigid indenter with a film, ring by ring: its conditions and its state.

At every ring the separation of the two surfaces is

.. math:: g_i = f_i - \delta + w_i,

with the indenter's height :math:`f` above its lowest point, the depth :math:`\delta` and the
film's depression :math:`w`.  A rigid interface asks for :math:`g \ge 0`, :math:`p \ge 0` and
:math:`g\,p = 0` (Signorini); a compliant one for :math:`p = F(g)`.  Tangentially, with the
displacement :math:`u - u^0` of the film since the ring was last free of elastic strain,

.. math:: |q| \le \mu p, \qquad
          q = -\mu p\,\frac{u - u^0}{\ell}\ \text{(sticking)}, \qquad
          q = \mp\mu p\ \text{(slipping outward, inward)},

where sticking on a rigid interface (:math:`\ell = 0`) means :math:`u = u^0`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.mechanics.interface import Interface, NormalLaw
from memscal.mechanics.surface import SurfaceCompliance
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """A film, an indenter and what is between them."""

    film: ElasticFilm
    compliance: SurfaceCompliance
    heights: FloatArray  # of the face above its lowest point, in m; inf where it has ended
    friction: float
    interface: Interface

    @property
    def size(self) -> int:
        """Number of rings."""
        return self.heights.size

    @property
    def normal_law(self) -> NormalLaw | None:
        """The interface's normal compliance, or ``None`` where it is rigid."""
        return self.interface.normal_law

    def displacements(self, p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return depression and outward displacement (m) under tractions (Pa) at the rings."""
        c = self.compliance
        return c.normal @ p + c.normal_by_shear @ q, c.radial_by_pressure @ p + c.radial @ q

    def separations(self, state: ContactState) -> FloatArray:
        """Return the distance between the two surfaces in m, ``inf`` beyond the indenter."""
        w, _ = self.displacements(state.pressure, state.shear)
        return np.asarray(self.heights - state.depth + w)

    def virgin(self) -> ContactState:
        """Return the state of the first touch, at the ring (or rings) of the lowest height."""
        nothing, lowest = np.zeros(self.size), float(self.heights.min())
        touching, slip = self.heights <= lowest, np.zeros(self.size, dtype=np.int8)
        return ContactState(nothing, nothing, lowest, 0.0, touching, slip, nothing, nothing)


@dataclass(frozen=True, eq=False)
class ContactState:
    """A contact in equilibrium, as arrays over the rings."""

    pressure: FloatArray  # Pa
    shear: FloatArray  # Pa, positive outward on the film
    depth: float  # m
    load: float  # N
    touching: NDArray[np.bool_]
    slip: NDArray[np.int8]  # sign of the shear where a ring slips, 0 where it sticks
    anchor: FloatArray  # outward displacement at which a sticking ring bears no shear, in m
    outward: FloatArray  # outward displacement in m
    iterations: int = 0  # linear systems that were solved

    def sticking(self, friction: float) -> NDArray[np.bool_]:
        """Return the rings in contact that stick."""
        if friction == 0:
            return np.zeros_like(self.touching)
        return np.asarray(self.touching & (self.slip == 0))


@dataclass(frozen=True)
class Load:
    """Press until the load is ``value`` N."""

    value: float


@dataclass(frozen=True)
class Depth:
    """Press until the depth is ``value`` m."""

    value: float


@dataclass(frozen=True)
class Touch:
    """Move until the surfaces meet at ``ring`` without pressing there."""

    ring: int


Target = Load | Depth
Goal = Load | Depth | Touch
